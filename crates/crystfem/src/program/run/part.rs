//! A body in time: solved, recorded, drawn and judged.

use super::celsius::{CELSIUS, TEMPERATURE};
use super::healing::{Healed, Healer};
use super::mechanics::{self, Follower};
use super::probe::{self, Probe};
use super::{Failure, animation, line, warped};
use crate::error::Error;
use crate::ledger::{Ledger, Record};
use crate::mesh::Mesh;
use crate::program::quantities as q;
use crate::program::scene::{PartScene, Task};
use crate::simulation::{Simulation, State};
use harness::case::{Finished, Run, STATISTICS, Step, StepField};
use harness::output::vtkhdf::{Cells, Data, MeshSeries};
use harness::report::{Phases, Quantity, Report, Value};
use harness::scene::Source;
use std::ops::ControlFlow;
use std::sync::Arc;

/// Runs the scene of a body, or resumes it.
pub fn run(source: &Source, scene: &PartScene, run: &mut Run) -> Result<Finished, Failure> {
    scene.check(source)?;
    let report = one(source, scene, false, run)?;
    // what each layer ends with, and does to each probe, is more than a screen holds
    let of_layer = |name: &str| {
        let rest = name.strip_prefix("layer-").and_then(|rest| rest.split_once('.'));
        rest.is_some_and(|(_, quantity)| STATISTICS.iter().any(|statistic| quantity.starts_with(statistic)))
    };
    let mut text = report.table_of(|name| !of_layer(name) && !name.contains("at_birth_"));
    text += &warnings(&report);
    text += &scene.cut_steps().map_or(String::new(), |cut| format!("warning: {cut}\n"));
    Ok(Finished { text, report })
}

/// Runs one scene, or one study of a scene, whose expectations wait for the others.
pub fn one(source: &Source, scene: &PartScene, is_study: bool, run: &mut Run) -> Result<Report, Failure> {
    let (output, quick) = (run.options.output, run.options.quick);
    let mut phases = Phases::new();
    phases.start("mesh");
    let built = scene.mesh.build(source)?;
    let task = scene.task(source, built)?;
    if !is_study && !run.options.resume {
        scene.check_expectations(source, &scene.quantities(&task), &[])?;
    }
    phases.start("solve");
    let (mut simulation, frames, probes, stressed, healed);
    if run.options.resume {
        run.begin()?;
    }
    if let Some((written, state, rows, body, faces)) = run.reached::<Reached>()? {
        simulation = Simulation::resume(Arc::clone(&task.problem), task.settings, state)?;
        (frames, probes) = (written, rows);
        (stressed, healed) = (body.unwrap_or_default(), faces.unwrap_or_default());
    } else {
        simulation = Simulation::new(Arc::clone(&task.problem), task.settings)?;
        scene.refuse_too_large(source, &simulation, task.mechanics.as_ref(), task.end)?;
        if !run.options.resume {
            run.begin()?;
        }
        let fields = simulation.field_names().len();
        (frames, stressed, healed) = (0, mechanics::Reached::default(), Healed::default());
        probes = scene
            .probe
            .iter()
            .zip(&task.probes)
            .map(|(spec, place)| Probe::new(spec, place, fields))
            .collect();
    }
    let mut report = Report::new("crystfem", env!("CARGO_PKG_VERSION"), &source.text);
    let names = simulation.field_names();
    let follow = |spec| Follower::new(spec, &task.problem.mesh, stressed);
    let follower = task.mechanics.as_ref().map(follow).transpose()?;
    let healer = task.interfaces.as_ref().map(|spec| Healer::new(spec, healed));
    let mut recorder = Recorder { scene, task: &task, probes, names, frames, follower, healer };
    let series = recorder.solve(&mut simulation, &mut phases, run)?;
    phases.start("write");
    recorder.record(&simulation, &mut report);
    probe::write(&recorder.probes, &recorder.names, output, &mut report)?;
    line::write(scene, &task, &simulation, &recorder.names, output)?;
    if !task.layers.is_empty() {
        let births: Vec<f64> = task.problem.births.iter().map(|birth| birth.time).collect();
        probe::births(&recorder.probes, &recorder.names, &births, &mut report);
    }
    let path = series.map(MeshSeries::finish).transpose()?;
    if scene.output.pictures {
        phases.start("draw");
        probe::draw(&recorder.probes, &recorder.names, scene, output)?;
        animation::draw(scene, &task, &simulation, path.as_deref(), output)?;
        if let Some(follower) = &recorder.follower {
            warped::draw(scene, &task, follower, output)?;
        }
        if let Some(healer) = &recorder.healer {
            healer.draw(scene, &simulation, output)?;
        }
    }
    phases.stop();
    let expect = if is_study { &[] } else { &scene.expect[..] };
    report.phases(&phases).threads(rayon::current_num_threads()).judge(expect, quick);
    Ok(report)
}

/// What the values of a report warn of, a line each: stress that would flow.
pub fn warnings(report: &Report) -> String {
    let mut lines = String::new();
    for (name, value) in &report.values {
        let Value::Scalar { value, .. } = value else { continue };
        if *value > 1.0 && name.rsplit('.').next() == Some(q::MISES_OVER_STRENGTH.name) {
            lines += &format!(
                "warning: {name} = {value:.3}: the largest Mises stress is above the strength; the material would yield or break there, which is not computed\n"
            );
        }
    }
    lines
}

/// What a scene builds and leaves out.
///
/// # Errors
/// A fault of the scene.
pub fn explain(source: &Source, scene: &PartScene) -> Result<Vec<String>, Failure> {
    scene.check(source)?;
    let (lines, names) = super::explain::one(source, scene)?;
    scene.check_expectations(source, &names, &[])?;
    Ok(lines)
}

/// A time step, as who watches the run sees it: temperatures and the materials' fields at the nodes, NaN where nothing is yet.
fn seen(simulation: &Simulation, step: &Record, names: &[&'static str]) -> Step {
    let mut fields = vec![StepField {
        name: TEMPERATURE,
        unit: "°C",
        components: 1,
        data: simulation.temperatures(f64::NAN).into_iter().map(|kelvin| kelvin - CELSIUS).collect(),
    }];
    fields.extend(names.iter().map(|&name| {
        let data = simulation.field(name).into_iter().map(|value| value.unwrap_or(f64::NAN)).collect();
        StepField { name, unit: "", components: 1, data }
    }));
    Step { values: vec![("time", "s", simulation.state().time), ("time_step", "s", step.dt)], fields }
}

/// How far a run is, as its checkpoint holds it: frames of the fields that are written, state, rows of the probes, stress, healing.
type Reached = (usize, State, Vec<Probe>, Option<mechanics::Reached>, Option<Healed>);

/// What is seen of a body on its way.
struct Recorder<'a> {
    scene: &'a PartScene,
    task: &'a Task,
    probes: Vec<Probe>,
    /// Names of the materials' fields.
    names: Vec<&'static str>,
    /// Frames of the fields that are written.
    frames: usize,
    /// Stress, where the scene asks for it.
    follower: Option<Follower<'a>>,
    /// Healing, where the scene asks for it.
    healer: Option<Healer<'a>>,
}

impl Recorder<'_> {
    /// To the end, frame by frame; a frame is written at each of their times even where no fields are.
    fn solve(
        &mut self,
        simulation: &mut Simulation,
        phases: &mut Phases,
        run: &mut Run,
    ) -> Result<Option<MeshSeries>, Failure> {
        let (end, mesh) = (self.task.end, &self.task.problem.mesh);
        let every = self.scene.every(end);
        let last = (end / every - 1e-9).ceil().max(1.0) as usize;
        let path = run.options.output.join("fields.vtkhdf");
        let mut series = match (self.scene.output.fields, self.frames) {
            (false, _) => None,
            (true, 0) => Some(MeshSeries::create(path, mesh.points.clone(), cells(mesh))?),
            (true, frames) => Some(MeshSeries::resume(path, mesh.points.clone(), cells(mesh), frames)?),
        };
        if self.frames == 0 {
            simulation.finite()?;
            probe::record(&mut self.probes, simulation, &self.names)?;
            self.follower.as_mut().map_or(Ok(()), |follower| follower.see(simulation, false))?;
            self.healer.iter_mut().for_each(|healer| healer.see(simulation));
        }
        let interrupted = run.options.interrupted;
        while self.frames <= last {
            let until = (self.frames as f64 * every).min(end);
            let (probes, names, frames) = (&mut self.probes, &self.names, self.frames);
            let (follower, healer) = (&mut self.follower, &mut self.healer);
            let mut result = Ok(());
            let mut observe = |simulation: &Simulation, step: &Record| -> ControlFlow<()> {
                result = simulation.finite().and_then(|()| probe::record(probes, simulation, names));
                if let (Ok(()), Some(follower)) = (&result, follower.as_mut()) {
                    result = follower.see(simulation, false);
                }
                healer.iter_mut().for_each(|healer| healer.see(simulation));
                let state = simulation.state();
                run.show(state.time / end, &|| {
                    let (time, dt, equations) = (state.time, step.dt, state.temperature.len());
                    format!("t = {time:.4} of {end:.4} s  step {dt:.3e} s  {equations} equations")
                });
                run.step(|| seen(simulation, step, names));
                if result.is_ok() {
                    let stressed = || follower.as_ref().map(Follower::reached);
                    let healed = || healer.as_ref().map(Healer::reached);
                    let reached = || Some((frames, state, &*probes, stressed(), healed()));
                    result = run.pause(reached).map_err(Error::from);
                }
                if result.is_err() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            };
            let flow = simulation.advance_unless(interrupted, until, &mut observe)?;
            result?;
            if flow.is_break() {
                // within a step
                let reached = (
                    self.frames,
                    simulation.state(),
                    &self.probes,
                    self.follower.as_ref().map(Follower::reached),
                    self.healer.as_ref().map(Healer::reached),
                );
                run.pause(|| Some(reached)).map_err(Error::from)?;
            }
            if let Some(follower) = self.follower.as_mut().filter(|_| self.frames == last) {
                follower.see(simulation, true)?;
                follower.release()?;
            }
            phases.start("write");
            if let Some(series) = &mut series {
                self.frame(simulation, series)?;
            }
            self.frames += 1;
            phases.start("solve");
        }
        Ok(series)
    }

    /// Writes the fields; what does not exist yet is NaN, and 0 in `exists`.
    fn frame(&self, simulation: &Simulation, series: &mut MeshSeries) -> Result<(), Error> {
        let temperature: Vec<f64> =
            simulation.temperatures(f64::NAN).into_iter().map(|kelvin| kelvin - CELSIUS).collect();
        let or_nan = |field: Vec<Option<f64>>| field.into_iter().map(|x| x.unwrap_or(f64::NAN)).collect();
        let fields: Vec<Vec<f64>> = self.names.iter().map(|name| or_nan(simulation.field(name))).collect();
        let mut arrays: Vec<Data> = vec![(TEMPERATURE, 1, temperature.as_slice())];
        arrays.extend(self.names.iter().zip(&fields).map(|(name, values)| (*name, 1, values.as_slice())));
        let elements = self.task.problem.mesh.element_count() as u32;
        let exists: Vec<f64> =
            (0..elements).map(|element| f64::from(u8::from(simulation.is_born(element)))).collect();
        let (displacement, mises, stresses) = match &self.follower {
            Some(follower) => (follower.displacement(), follower.mises(), follower.stresses()),
            None => Default::default(),
        };
        let mut of_cells: Vec<Data> = vec![("exists", 1, &exists)];
        if self.follower.is_some() {
            arrays.push(("displacement_m", 3, &displacement));
            of_cells.push(("mises_Pa", 1, &mises));
            of_cells.push(("residual_stress_Pa", 6, &stresses));
        }
        let healing = self.healer.as_ref().map(|healer| healer.field(simulation));
        of_cells.extend(healing.iter().map(|field| ("healing", 1, field.as_slice())));
        let strength = self.task.interfaces.as_ref().and_then(|interfaces| interfaces.strength);
        let strength = strength.zip(healing.as_ref());
        let strength: Option<Vec<f64>> =
            strength.map(|(strength, degrees)| degrees.iter().map(|degree| strength * degree).collect());
        of_cells.extend(strength.iter().map(|field| ("interlayer_strength_Pa", 1, field.as_slice())));
        Ok(series.step(simulation.time(), &arrays, &of_cells)?)
    }

    /// Volume of what exists, m³, as the materials have it: of each element the part that is filled.
    fn printed_volume(&self, simulation: &Simulation) -> f64 {
        let mesh = &self.task.problem.mesh;
        let parts = self.task.filling.as_ref().and_then(|filling| filling.parts.as_ref());
        let of = |element: u32| parts.map_or(1.0, |(values, of)| values[of[element as usize]]);
        let born = (0..mesh.element_count() as u32).filter(|&element| simulation.is_born(element));
        born.map(|element| of(element) * crate::element::volume(mesh, element)).sum()
    }

    /// The scalars of the end.
    fn record(&self, simulation: &Simulation, report: &mut Report) {
        let state = simulation.state();
        let Ledger { stored, exchange, reaction, birth, missing, worst } = state.ledger;
        report.value(q::STORED_ENERGY, stored);
        report.value(q::EXCHANGED_ENERGY, exchange.total());
        report.value(q::REACTION_ENERGY, reaction);
        report.value(q::BIRTH_ENERGY, birth);
        report.value(q::HEAT_GIVEN_OFF, -(exchange.total() + reaction));
        report.value(q::MISSING_ENERGY, missing);
        report.value(q::WORST_BALANCE, worst);
        if let Some(filling) = &self.task.filling {
            report.value(q::PRINTED_VOLUME, self.printed_volume(simulation));
            report.value(q::CELLS_OVER_BODY, filling.ratio);
            if let Some((path, _)) = &filling.path {
                report.value(q::PATH_TIME, path.duration());
                report.value(q::FILAMENT, path.fed());
            }
        }
        if let Some(follower) = &self.follower {
            follower.record(&self.probes, report);
        }
        if let Some(healer) = &self.healer {
            healer.record(report);
        }
        let nodes = 0..self.task.problem.mesh.points.len() as u32;
        let temperature: Vec<Option<f64>> =
            nodes.map(|node| simulation.temperature(node).map(|kelvin| kelvin - CELSIUS)).collect();
        let volumes = simulation.volumes(&self.task.printed);
        summarise(report, "", "temperature", &temperature, &volumes, "degC");
        let fields: Vec<(&str, Vec<Option<f64>>)> =
            self.names.iter().map(|name| (*name, simulation.field(name))).collect();
        for (name, values) in &fields {
            summarise(report, "", name, values, &volumes, "");
        }
        for (layer, elements) in self.task.layers.iter().enumerate() {
            let volumes = simulation.volumes(elements);
            let prefix = format!("layer-{}.", layer + 1);
            summarise(report, &prefix, "temperature", &temperature, &volumes, "degC");
            for (name, values) in &fields {
                summarise(report, &prefix, name, values, &volumes, "");
            }
        }
        let work = state.work;
        report
            .work("nodes", self.task.problem.mesh.points.len() as u64)
            .work("elements", self.task.problem.mesh.element_count() as u64)
            .work("equations", state.temperature.len() as u64)
            .work("steps", work.steps)
            .work("rejected", work.rejected)
            .work("newton_iterations", work.newton_iterations)
            .work("cg_iterations", work.cg_iterations)
            .work("factorizations", work.factorizations)
            .work("direct_solves", work.direct_solves)
            .work("material_responses", work.responses)
            .work("builds", work.builds);
    }
}

/// Mean by volume, least, largest and standard deviation of a field over the nodes that have it; a value that is not finite
/// makes all of them so, which fails the report.
fn summarise(
    report: &mut Report,
    prefix: &str,
    name: &str,
    values: &[Option<f64>],
    volumes: &[f64],
    unit: &str,
) {
    let (mut sum, mut volume) = (0.0, 0.0);
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    let there = || {
        let with_volume = values.iter().zip(volumes).filter(|(_, volume)| **volume > 0.0);
        with_volume.filter_map(|(value, volume)| Some(((*value)?, *volume)))
    };
    for (value, weight) in there() {
        sum += value * weight;
        volume += weight;
        least = least.min(value);
        most = most.max(value);
    }
    if volume > 0.0 {
        let mean = sum / volume;
        let variance = there().map(|(value, weight)| weight * (value - mean).powi(2)).sum::<f64>() / volume;
        let of = |quantity: Quantity| quantity.of(&[prefix, name]).in_unit(unit);
        // `min` and `max` pass over NaN
        let known = |extreme: f64| if mean.is_finite() { extreme } else { mean };
        report.value(of(q::MEAN), mean);
        report.value(of(q::LEAST), known(least));
        report.value(of(q::LARGEST), known(most));
        let spread = if unit == "degC" { "K" } else { unit };
        report.value(of(q::DEVIATION).in_unit(spread), variance.sqrt());
    }
}

fn cells(mesh: &Mesh) -> Cells {
    let mut cells = Cells::default();
    mesh.hexahedra.iter().for_each(|nodes| cells.push(12, nodes));
    mesh.tetrahedra.iter().for_each(|nodes| cells.push(10, nodes));
    for cell in &mesh.others {
        match cell.shape.vtk() {
            (kind, Some(order)) => cells.push(kind, &order.map(|k| cell.nodes()[k])),
            (kind, None) => cells.push(kind, cell.nodes()),
        }
    }
    cells
}
