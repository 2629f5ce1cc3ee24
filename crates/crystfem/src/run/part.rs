//! A body in time: solved, recorded, drawn and judged.

use super::section::Section;
use super::{Failure, Options, point::CELSIUS, prepare};
use crate::error::Error;
use crate::ledger::Ledger;
use crate::mesh::Mesh;
use crate::scene::{PartScene, Task};
use crate::simulation::Simulation;
use polycore::output::csv;
use polycore::output::picture::{FieldMap, LegendPlace, LinePlot, Panel, Series};
use polycore::output::vtkhdf::{Cells, Data, MeshSeries};
use polycore::report::{Phases, Report};
use polycore::scene::Source;
use std::ops::ControlFlow;
use std::path::Path;

/// Fields written unless the scene says how often.
const FRAMES: f64 = 50.0;
/// Rows of a probe that are drawn at most.
const ROWS: usize = 4000;

/// Runs the scene of a body.
pub fn run(source: &Source, scene: &PartScene, options: &Options) -> Result<Report, Failure> {
    scene.check(source)?;
    let mut phases = Phases::new();
    phases.start("mesh");
    let built = scene.mesh.build(source)?;
    let task = scene.task(source, built.mesh)?;
    let probes = Probes::new(scene, &task.problem.mesh);
    let mut report = Report::new("crystfem", env!("CARGO_PKG_VERSION"), &source.text);
    phases.start("solve");
    let mut simulation = Simulation::new(task.problem.clone(), task.settings)?;
    prepare(options.output)?;
    let mut run = Run { scene, task: &task, output: options.output, probes, names: simulation.field_names() };
    let (series, stages) = run.solve(&mut simulation, &mut phases)?;
    phases.start("write");
    run.record(&simulation, &mut report);
    run.probes.write(options.output, &mut report)?;
    if let Some(series) = series {
        series.finish()?;
    }
    if scene.output.pictures {
        phases.start("draw");
        run.probes.draw(scene, options.output)?;
        run.draw(&stages)?;
    }
    phases.stop();
    report.phases(&phases).threads(rayon::current_num_threads()).judge(&scene.expect, options.quick);
    report.write(options.output)?;
    Ok(report)
}

/// What a scene builds and leaves out.
///
/// # Errors
/// A fault of the scene.
pub fn explain(source: &Source, scene: &PartScene) -> Result<Vec<String>, Failure> {
    scene.check(source)?;
    let built = scene.mesh.build(source)?;
    let (points, elements) = (built.mesh.points.len(), built.mesh.element_count());
    let mut lines = vec![format!("builds     {points} nodes, {elements} elements, {:.4e} m³", built.volume)];
    lines.extend(built.notes.iter().map(|note| format!("note       {note}")));
    let task = scene.task(source, built.mesh)?;
    lines.extend(task.notes.iter().map(|note| format!("note       {note}")));
    let problem = &task.problem;
    match problem.births.len() {
        0 => lines.push("leaves out births: everything exists from the start".into()),
        births => lines.push(format!(
            "builds     {births} births of {} elements; what is not printed yet has no equations",
            task.printed.len()
        )),
    }
    let names: Vec<&str> = problem.materials.iter().flat_map(|m| m.field_names().iter().copied()).collect();
    match names.is_empty() {
        true => lines.push("leaves out states of materials".into()),
        false => lines.push(format!("builds     states: {}", names.join(", "))),
    }
    let (end, settings) = (task.end, task.settings);
    let simulation = Simulation::new(task.problem, settings)?;
    lines.extend(simulation.explain(end).into_iter().map(|line| format!("solver     {line}")));
    lines.push(format!("ends at    {end} s"));
    Ok(lines)
}

struct Run<'a> {
    scene: &'a PartScene,
    task: &'a Task,
    output: &'a Path,
    probes: Probes,
    /// Names of the materials' fields.
    names: Vec<&'static str>,
}

/// A section at a time.
struct Stage {
    title: String,
    section: Section,
    /// °C, then the fields.
    values: Vec<Vec<f64>>,
}

impl Run<'_> {
    fn solve(
        &mut self,
        simulation: &mut Simulation,
        phases: &mut Phases,
    ) -> Result<(Option<MeshSeries>, Vec<Stage>), Failure> {
        let (end, mesh) = (self.task.end, &self.task.problem.mesh);
        let every = self.scene.output.every.map_or(end / FRAMES, |every| every.si());
        let frames = (end / every - 1e-9).ceil().max(1.0) as usize;
        let wanted = self.scene.output.stages.min(frames);
        let drawn: Vec<usize> = (1..=wanted).map(|stage| stage * frames / wanted).collect();
        let mut series = match self.scene.output.fields {
            true => {
                let path = self.output.join("fields.vtkhdf");
                Some(MeshSeries::create(path, mesh.points.clone(), cells(mesh))?)
            }
            false => None,
        };
        let mut stages = Vec::new();
        self.probes.record(simulation, &self.names);
        if let Some(series) = &mut series {
            self.frame(simulation, series)?;
        }
        for frame in 1..=frames {
            let until = (frame as f64 * every).min(end);
            let (probes, names) = (&mut self.probes, &self.names);
            let mut worst = Ok(());
            let mut observe = |simulation: &Simulation, _: &_| -> ControlFlow<()> {
                worst = probes.check(simulation);
                probes.record(simulation, names);
                if worst.is_err() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            };
            let _ = simulation.advance(until, &mut observe)?;
            worst?;
            phases.start("write");
            if let Some(series) = &mut series {
                self.frame(simulation, series)?;
            }
            if self.scene.output.pictures && drawn.contains(&frame) {
                stages.push(self.stage(simulation));
            }
            phases.start("solve");
        }
        Ok((series, stages))
    }

    /// Writes the fields; what does not exist yet is NaN, and 0 in `exists`.
    fn frame(&self, simulation: &Simulation, series: &mut MeshSeries) -> Result<(), Error> {
        let temperature: Vec<f64> =
            simulation.temperatures(f64::NAN).into_iter().map(|kelvin| kelvin - CELSIUS).collect();
        let fields: Vec<Vec<f64>> = self.names.iter().map(|name| simulation.field(name)).collect();
        let mut arrays: Vec<Data> = vec![("temperature_degC", 1, temperature.as_slice())];
        arrays.extend(self.names.iter().zip(&fields).map(|(name, values)| (*name, 1, values.as_slice())));
        let elements = self.task.problem.mesh.element_count() as u32;
        let exists: Vec<f64> =
            (0..elements).map(|element| f64::from(u8::from(simulation.is_born(element)))).collect();
        Ok(series.step(simulation.time(), &arrays, &[("exists", 1, &exists)])?)
    }

    fn stage(&self, simulation: &Simulation) -> Stage {
        let mesh = &self.task.problem.mesh;
        let born: Vec<u32> =
            self.task.printed.iter().copied().filter(|&element| simulation.is_born(element)).collect();
        let section = Section::through_the_middle(mesh, &born);
        let temperature: Vec<f64> =
            simulation.temperatures(f64::NAN).into_iter().map(|kelvin| kelvin - CELSIUS).collect();
        let mut values = vec![section.values(mesh, &temperature)];
        values.extend(self.names.iter().map(|name| section.values(mesh, &simulation.field(name))));
        Stage { title: format!("{:.4} s", simulation.time()), section, values }
    }

    /// The scalars of the end.
    fn record(&self, simulation: &Simulation, report: &mut Report) {
        let state = simulation.state();
        let Ledger { stored, exchange, reaction, birth, missing, worst } = state.ledger;
        report.value("stored_energy", stored, "J");
        report.value("exchanged_energy", exchange.total(), "J");
        report.value("reaction_energy", reaction, "J");
        report.value("birth_energy", birth, "J");
        report.value("missing_energy", missing, "J");
        report.value("worst_balance", worst, "");
        let temperature = simulation.temperatures(f64::NAN);
        let volumes = simulation.volumes(&self.task.printed);
        summarise(report, "", "temperature", &shifted(&temperature), &volumes, "degC");
        let fields: Vec<(&str, Vec<f64>)> =
            self.names.iter().map(|name| (*name, simulation.field(name))).collect();
        for (name, values) in &fields {
            summarise(report, "", name, values, &volumes, "");
        }
        for (layer, elements) in self.task.layers.iter().enumerate() {
            let volumes = simulation.volumes(elements);
            let prefix = format!("layer-{}.", layer + 1);
            summarise(report, &prefix, "temperature", &shifted(&temperature), &volumes, "degC");
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

    fn draw(&self, stages: &[Stage]) -> Result<(), Error> {
        let labels = std::iter::once("T [°C]").chain(self.names.iter().copied());
        for (index, label) in labels.enumerate() {
            let all = stages.iter().flat_map(|stage| stage.values[index].iter().copied());
            let (low, high) = all
                .filter(|x| x.is_finite())
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
            if low > high {
                continue;
            }
            let mut map = FieldMap::new().lengths("mm", 1e-3).columns(1).size(700).axes(["x", "z"]);
            for stage in stages.iter().filter(|stage| !stage.section.places.is_empty()) {
                let (places, values) = (&stage.section.places, &stage.values[index]);
                let panel = Panel::new(&stage.title, label, places, values, stage.section.spacing);
                map = map.panel(if high > low { panel.range(low, high) } else { panel });
            }
            let name = if index == 0 { "temperature" } else { self.names[index - 1] };
            map.write(self.output.join(format!("section_{name}.png")))?;
        }
        Ok(())
    }
}

fn shifted(kelvin: &[f64]) -> Vec<f64> {
    kelvin.iter().map(|t| t - CELSIUS).collect()
}

/// Mean by volume, least, largest and standard deviation of a field.
fn summarise(report: &mut Report, prefix: &str, name: &str, values: &[f64], volumes: &[f64], unit: &str) {
    let (mut sum, mut volume) = (0.0, 0.0);
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    let there = || values.iter().zip(volumes).filter(|(value, volume)| **volume > 0.0 && value.is_finite());
    for (value, weight) in there() {
        sum += value * weight;
        volume += weight;
        least = least.min(*value);
        most = most.max(*value);
    }
    if volume > 0.0 {
        let mean = sum / volume;
        let variance = there().map(|(value, weight)| weight * (value - mean).powi(2)).sum::<f64>() / volume;
        report.value(&format!("{prefix}mean_{name}"), mean, unit);
        report.value(&format!("{prefix}least_{name}"), least, unit);
        report.value(&format!("{prefix}largest_{name}"), most, unit);
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

/// What is recorded in every step.
struct Probes {
    probes: Vec<Probe>,
}

struct Probe {
    name: String,
    node: u32,
    /// How far the node is from where it was asked for, m.
    distance: f64,
    time: Vec<f64>,
    /// °C.
    temperature: Vec<f64>,
    fields: Vec<(&'static str, Vec<f64>)>,
}

impl Probes {
    fn new(scene: &PartScene, mesh: &Mesh) -> Self {
        let probes = scene.probe.iter().map(|spec| {
            let at = spec.at.map(|x| x.si());
            let distance = |node: usize| {
                let place = mesh.points[node];
                (0..3).map(|d| (place[d] - at[d]).powi(2)).sum::<f64>().sqrt()
            };
            let nearest = (0..mesh.points.len()).min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
            let node = nearest.unwrap_or(0);
            Probe {
                name: spec.name.clone(),
                node: node as u32,
                distance: distance(node),
                time: Vec::new(),
                temperature: Vec::new(),
                fields: Vec::new(),
            }
        });
        Self { probes: probes.collect() }
    }

    /// Names a temperature that is none.
    fn check(&self, simulation: &Simulation) -> Result<(), Error> {
        let state = simulation.state();
        let Some(wrong) = state.temperature.iter().position(|t| !t.is_finite()) else { return Ok(()) };
        let place = format!("equation {wrong}");
        Err(Error::NotFinite { quantity: "temperature", place, time: state.time })
    }

    fn record(&mut self, simulation: &Simulation, names: &[&'static str]) {
        if !self.probes.iter().any(|probe| simulation.exists(probe.node)) {
            return;
        }
        let fields: Vec<Vec<f64>> = names.iter().map(|name| simulation.field(name)).collect();
        for probe in &mut self.probes {
            let Some(temperature) = simulation.temperature(probe.node) else { continue };
            if probe.time.last() == Some(&simulation.time()) {
                continue;
            }
            probe.time.push(simulation.time());
            probe.temperature.push(temperature - CELSIUS);
            for (index, (name, values)) in names.iter().zip(&fields).enumerate() {
                let value = values[probe.node as usize];
                match probe.fields.get_mut(index) {
                    Some((_, list)) => list.push(value),
                    None => probe.fields.push((name, vec![value])),
                }
            }
        }
    }

    fn write(&self, output: &Path, report: &mut Report) -> Result<(), Error> {
        for probe in &self.probes {
            let name = &probe.name;
            report.value(&format!("{name}.distance"), probe.distance, "m");
            let mut columns: Vec<csv::Column> =
                vec![("time", "s", &probe.time), ("temperature", "degC", &probe.temperature)];
            columns.extend(probe.fields.iter().map(|(name, values)| (*name, "", values.as_slice())));
            csv::write(output.join(format!("probe_{name}.csv")), &columns)?;
            let mut last = |quantity: &str, values: &[f64], unit: &str| {
                if let Some(last) = values.last().filter(|last| last.is_finite()) {
                    report.value(&format!("{name}.{quantity}"), *last, unit);
                }
            };
            last("temperature", &probe.temperature, "degC");
            for (quantity, values) in &probe.fields {
                last(quantity, values, "");
            }
        }
        Ok(())
    }

    /// Temperatures and fields of all probes over time.
    fn draw(&self, scene: &PartScene, output: &Path) -> Result<(), Error> {
        let mut quantities = vec![("temperature", "T [°C]")];
        if let Some(probe) = self.probes.iter().find(|probe| !probe.fields.is_empty()) {
            quantities.extend(probe.fields.iter().map(|(name, _)| (*name, *name)));
        }
        for (index, (name, label)) in quantities.iter().enumerate() {
            let mut plot = LinePlot::new(&scene.title).axes("t [s]", label).legend(LegendPlace::TopRight);
            let mut drawn = false;
            for probe in self.probes.iter().filter(|probe| probe.time.len() > 1) {
                let values = match index {
                    0 => Some(&probe.temperature),
                    _ => probe.fields.get(index - 1).map(|(_, values)| values),
                };
                if let Some(values) = values.filter(|values| values.iter().any(|x| x.is_finite())) {
                    let every = values.len().div_ceil(ROWS);
                    let thinned =
                        |list: &[f64]| -> Vec<f64> { list.iter().copied().step_by(every).collect() };
                    plot = plot.series(Series::line(&probe.name, &thinned(&probe.time), &thinned(values)));
                    drawn = true;
                }
            }
            if drawn {
                plot.write(output.join(format!("probes_{name}.png")))?;
            }
        }
        Ok(())
    }
}
