//! A body in time: solved, recorded, drawn and judged.

use super::checkpoint::{self, Header};
use super::probe::{self, Probe};
use super::rows::STATISTICS;
use super::{Failure, Finished, Options, Progress, film, point::CELSIUS};
use crate::error::Error;
use crate::ledger::{Ledger, Record};
use crate::mesh::Mesh;
use crate::scene::{PartScene, Task};
use crate::simulation::{Simulation, State};
use polycore::output::vtkhdf::{Cells, Data, MeshSeries};
use polycore::report::{Phases, Report};
use polycore::scene::Source;
use std::ops::ControlFlow;
use std::time::Instant;

/// Name of the temperature among the fields.
pub const TEMPERATURE: &str = "temperature_degC";
/// Fields written unless the scene says how often.
const FRAMES: f64 = 50.0;

/// Runs the scene of a body, or goes on with it.
pub fn run(source: &Source, scene: &PartScene, options: &mut Options) -> Result<Finished, Failure> {
    if !scene.study.is_empty() {
        return super::suite::run(source, scene, options);
    }
    scene.check(source)?;
    let report = one(source, scene, None, options)?;
    // what each layer ends with, and does to each probe, is more than a screen holds
    let of_layer = |name: &str| {
        let rest = name.strip_prefix("layer-").and_then(|rest| rest.split_once('.'));
        rest.is_some_and(|(_, quantity)| STATISTICS.iter().any(|statistic| quantity.starts_with(statistic)))
    };
    let text = report.table_of(|name| !of_layer(name) && !name.contains("at_birth_"));
    Ok(Finished { text, report })
}

/// Runs one scene, or one study of a scene, whose expectations wait for the others.
pub fn one(
    source: &Source,
    scene: &PartScene,
    study: Option<&str>,
    options: &mut Options,
) -> Result<Report, Failure> {
    let mut phases = Phases::new();
    phases.start("mesh");
    let built = scene.mesh.build(source)?;
    let task = scene.task(source, built.mesh)?;
    if study.is_none() && !options.resume {
        scene.check_expectations(source, &scene.quantities(&task), &[])?;
    }
    phases.start("solve");
    let (mut simulation, frames, probes, _lock);
    if options.resume {
        _lock = polycore::output::resume_run(options.output)?;
        let saved = checkpoint::read(options.output)?;
        simulation = Simulation::resume(task.problem.clone(), task.settings, saved.state)?;
        (frames, probes) = (saved.frames, saved.probes);
    } else {
        simulation = Simulation::new(task.problem.clone(), task.settings)?;
        scene.refuse_too_large(source, &simulation, task.end)?;
        _lock = polycore::output::prepare_run(options.output)?;
        let fields = simulation.field_names().len();
        frames = 0;
        probes = scene
            .probe
            .iter()
            .zip(&task.probes)
            .map(|(spec, place)| Probe::new(spec, place, fields))
            .collect();
    }
    let mut report = Report::new("crystfem", env!("CARGO_PKG_VERSION"), &source.text);
    let names = simulation.field_names();
    let header = Header::new(source, options.quick, study);
    let mut run = Run { header, scene, task: &task, probes, names, frames };
    let series = run.solve(&mut simulation, &mut phases, options)?;
    phases.start("write");
    run.record(&simulation, &mut report);
    probe::write(&run.probes, &run.names, options.output, &mut report)?;
    if !task.layers.is_empty() {
        let births: Vec<f64> = task.problem.births.iter().map(|birth| birth.time).collect();
        probe::births(&run.probes, &run.names, &births, &mut report);
    }
    let path = series.map(MeshSeries::finish).transpose()?;
    if scene.output.pictures {
        phases.start("draw");
        probe::draw(&run.probes, &run.names, scene, options.output)?;
        film::draw(scene, &task, &simulation, path.as_deref(), options.output)?;
    }
    phases.stop();
    let expect = if study.is_none() { &scene.expect[..] } else { &[] };
    report.phases(&phases).threads(rayon::current_num_threads()).judge(expect, options.quick);
    report.write(options.output)?;
    // the report is the last file: a checkpoint without it is an unfinished run
    let _ = std::fs::remove_file(options.output.join(polycore::checkpoint::FILE_NAME));
    Ok(report)
}

/// What a scene builds and leaves out.
///
/// # Errors
/// A fault of the scene.
pub fn explain(source: &Source, scene: &PartScene, quick: bool) -> Result<Vec<String>, Failure> {
    if !scene.study.is_empty() {
        return super::suite::explain(source, scene, quick);
    }
    scene.check(source)?;
    let (lines, names) = super::explain::one(source, scene)?;
    scene.check_expectations(source, &names, &[])?;
    Ok(lines)
}

struct Run<'a> {
    header: Header,
    scene: &'a PartScene,
    task: &'a Task,
    probes: Vec<Probe>,
    /// Names of the materials' fields.
    names: Vec<&'static str>,
    /// Frames of the fields that are written.
    frames: usize,
}

impl Run<'_> {
    /// To the end, frame by frame; a frame is written at each of their times even where no fields are.
    fn solve(
        &mut self,
        simulation: &mut Simulation,
        phases: &mut Phases,
        options: &mut Options,
    ) -> Result<Option<MeshSeries>, Failure> {
        let (end, mesh) = (self.task.end, &self.task.problem.mesh);
        let every = self.scene.output.every.map_or(end / FRAMES, |every| every.si());
        let last = (end / every - 1e-9).ceil().max(1.0) as usize;
        let path = options.output.join("fields.vtkhdf");
        let mut series = match (self.scene.output.fields, self.frames) {
            (false, _) => None,
            (true, 0) => Some(MeshSeries::create(path, mesh.points.clone(), cells(mesh))?),
            (true, frames) => Some(MeshSeries::resume(path, mesh.points.clone(), cells(mesh), frames)?),
        };
        let save = |frames: usize, state: &State, probes: &[Probe]| {
            checkpoint::write(options.output, &self.header, frames, state, probes)
        };
        if self.frames == 0 {
            simulation.finite()?;
            probe::record(&mut self.probes, simulation, &self.names)?;
            // a run can be resumed from its first moment on
            save(0, simulation.state(), &self.probes)?;
        }
        let mut written = Instant::now();
        while self.frames <= last {
            let until = (self.frames as f64 * every).min(end);
            let (probes, names, frames) = (&mut self.probes, &self.names, self.frames);
            let mut result = Ok(());
            let mut observe = |simulation: &Simulation, step: &Record| -> ControlFlow<()> {
                result = simulation.finite().and_then(|()| probe::record(probes, simulation, names));
                let state = simulation.state();
                (options.progress)(&Progress {
                    time: state.time,
                    end,
                    dt: step.dt,
                    equations: state.temperature.len(),
                    of: [1, 1],
                });
                let stop = (options.interrupted)();
                if result.is_ok() && (stop || written.elapsed() >= options.checkpoint_every) {
                    result = save(frames, state, probes);
                    written = Instant::now();
                }
                if result.is_ok() && stop {
                    result = Err(Error::Interrupted(options.output.to_path_buf()));
                }
                if result.is_err() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            };
            let _ = simulation.advance(until, &mut observe)?;
            result?;
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
        Ok(series.step(simulation.time(), &arrays, &[("exists", 1, &exists)])?)
    }

    /// The scalars of the end.
    fn record(&self, simulation: &Simulation, report: &mut Report) {
        let state = simulation.state();
        let Ledger { stored, exchange, reaction, birth, missing, worst } = state.ledger;
        report.value("stored_energy", stored, "J");
        report.value("exchanged_energy", exchange.total(), "J");
        report.value("reaction_energy", reaction, "J");
        report.value("birth_energy", birth, "J");
        report.value("heat_given_off", -(exchange.total() + reaction), "J");
        report.value("missing_energy", missing, "J");
        report.value("worst_balance", worst, "");
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

pub fn shifted(kelvin: &[f64]) -> Vec<f64> {
    kelvin.iter().map(|t| t - CELSIUS).collect()
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
        // `min` and `max` pass over NaN
        let known = |extreme: f64| if mean.is_finite() { extreme } else { mean };
        report.value(&format!("{prefix}mean_{name}"), mean, unit);
        report.value(&format!("{prefix}least_{name}"), known(least), unit);
        report.value(&format!("{prefix}largest_{name}"), known(most), unit);
        let spread = if unit == "degC" { "K" } else { unit };
        report.value(&format!("{prefix}deviation_of_{name}"), variance.sqrt(), spread);
    }
}

fn cells(mesh: &Mesh) -> Cells {
    let mut cells = Cells::default();
    mesh.hexahedra.iter().for_each(|nodes| cells.push(12, nodes));
    mesh.tetrahedra.iter().for_each(|nodes| cells.push(10, nodes));
    cells
}
