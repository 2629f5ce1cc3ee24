//! Run of a part scene: solves, records, draws and judges.

use crate::error::Error;
use crate::ledger::StepBalance;
use crate::mesh::Mesh;
use crate::program::observe::celsius::{TEMPERATURE, to_celsius};
use crate::program::observe::{FIELDS, PartObservers, observers};
use crate::program::quantities as q;
use crate::program::scene::{PartScene, PartTask};
use crate::simulation::{Simulation, State};
use harness::case::{Finished, Run, STATISTICS, Step, StepField};
use harness::observe::{Outputs, Place};
use harness::output::vtkhdf::{Cells, Data, MeshSeries};
use harness::report::{Phases, Report, Value};
use harness::scene::{Failure, Source};
use std::ops::ControlFlow;
use std::sync::Arc;

/// Runs or resumes a part scene.
pub fn run(source: &Source, scene: &PartScene, run: &mut Run) -> Result<Finished, Failure<Error>> {
    scene.check(source)?;
    let report = run_scene(source, scene, false, run)?;
    // values of layers and births would fill the screen: they are in the report only
    let is_layer = |name: &str| {
        let rest = name.strip_prefix("layer-").and_then(|rest| rest.split_once('.'));
        rest.is_some_and(|(_, quantity)| STATISTICS.iter().any(|statistic| quantity.starts_with(statistic)))
    };
    let mut text = report.table_of(|name| !is_layer(name) && !name.contains("at_birth_"));
    let cut = scene.cut_steps().map_or(String::new(), |cut| format!("warning: {cut}\n"));
    let notes = warnings(&report) + &cut;
    text += &notes;
    Ok(Finished::new(report, text).with_notes(&notes))
}

/// Runs one scene, or one study of a scene; expectations are judged after all studies.
pub fn run_scene(
    source: &Source,
    scene: &PartScene,
    is_study: bool,
    run: &mut Run,
) -> Result<Report, Failure<Error>> {
    let (output, quick) = (run.options.output, run.options.quick);
    let mut phases = Phases::new();
    phases.start("mesh");
    let built = scene.mesh.build(source)?;
    let task = scene.task(source, built)?;
    let mut observers = observers(scene, &task);
    if !is_study && !run.options.resume {
        scene.check_expectations(source, &observers.names(), &[])?;
    }
    phases.start("solve");
    let (mut simulation, mut frames);
    if run.options.resume {
        run.begin()?;
    }
    if let Some((written, state, seen)) = run.reached::<PartCheckpoint>()? {
        simulation = Simulation::resume(Arc::clone(&task.problem), task.settings, state)?;
        observers.restore(&seen)?;
        frames = written;
    } else {
        simulation = Simulation::new(Arc::clone(&task.problem), task.settings)?;
        scene.refuse_too_large(source, &simulation, task.mechanics.as_ref(), task.end)?;
        if !run.options.resume {
            run.begin()?;
        }
        frames = 0;
    }
    let mut report = Report::new("crystfem", env!("CARGO_PKG_VERSION"), &source.text);
    solve(scene, &task, &mut simulation, (&mut observers, &mut frames), &mut phases, run)?;
    phases.start("write");
    observers.scalars(&simulation, &mut |named, value| {
        report.value(named, value);
    });
    for (name, count) in observers.work(&simulation) {
        report.work(name, count);
    }
    let outputs = Outputs { folder: output, pictures: scene.output.pictures };
    observers.write(&simulation, &outputs)?;
    if scene.output.pictures {
        phases.start("draw");
        observers.draw(&simulation, &outputs)?;
    }
    phases.stop();
    let expect = if is_study { &[] } else { &scene.expect[..] };
    report.phases(&phases).threads(rayon::current_num_threads()).judge(expect, quick);
    Ok(report)
}

/// Returns a warning for each Mises stress above the strength, a line each.
pub fn warnings(report: &Report) -> String {
    let mut lines = String::new();
    for (name, value) in &report.values {
        let Value::Scalar { value, .. } = value else { continue };
        if *value > 1.0 && name.rsplit('.').next() == Some(q::MISES_OVER_STRENGTH.name) {
            lines += &format!(
                "warning: {name} = {value:.3}: the largest Mises stress exceeds the strength; yielding and \
                 fracture are not modelled\n"
            );
        }
    }
    lines
}

/// Describes a scene, line by line.
///
/// # Errors
/// Returns an error for an invalid scene.
pub fn explain(source: &Source, scene: &PartScene) -> Result<Vec<String>, Failure<Error>> {
    scene.check(source)?;
    let (lines, names) = super::explain::explain_scene(source, scene)?;
    scene.check_expectations(source, &names, &[])?;
    Ok(lines)
}

/// Returns a time step for callbacks: temperatures and material fields at the nodes, NaN for nonexistent
/// nodes.
fn describe_step(simulation: &Simulation, step: &StepBalance, names: &[&'static str]) -> Step {
    let mut fields = vec![StepField {
        name: TEMPERATURE,
        unit: "°C",
        components: 1,
        data: to_celsius(&simulation.temperatures(f64::NAN)),
    }];
    fields.extend(names.iter().map(|&name| {
        let data = simulation.field(name).into_iter().map(|value| value.unwrap_or(f64::NAN)).collect();
        StepField { name, unit: "", components: 1, data }
    }));
    Step { values: vec![("time", "s", simulation.state().time), ("time_step", "s", step.dt)], fields }
}

/// Content of a checkpoint: number of written frames, state of the simulation, and states of the observers.
type PartCheckpoint = (usize, State, Vec<Vec<u8>>);

/// Solves frame by frame to the end. Steps end at the times of frames even if no fields are written.
fn solve(
    scene: &PartScene,
    task: &PartTask,
    simulation: &mut Simulation,
    (observers, frames): (&mut PartObservers, &mut usize),
    phases: &mut Phases,
    run: &mut Run,
) -> Result<(), Failure<Error>> {
    let (end, mesh) = (task.end, &task.problem.mesh);
    let every = scene.every(end);
    let last = (end / every - 1e-9).ceil().max(1.0) as usize;
    let path = run.options.output.join(FIELDS);
    let mut series = match (scene.output.fields, *frames) {
        (false, _) => None,
        (true, 0) => Some(MeshSeries::create(path, mesh.points.clone(), cells(mesh))?),
        (true, frames) => Some(MeshSeries::resume(path, mesh.points.clone(), cells(mesh), frames)?),
    };
    if *frames == 0 {
        simulation.check_finite()?;
        observers.see(simulation)?;
    }
    let (interrupted, names) = (run.options.interrupted, simulation.field_names());
    while *frames <= last {
        let until = (*frames as f64 * every).min(end);
        let mut result = Ok(());
        let mut observe = |simulation: &Simulation, step: &StepBalance| -> ControlFlow<()> {
            result = simulation.check_finite().and_then(|()| observers.see(simulation));
            let state = simulation.state();
            run.show(state.time / end, &|| {
                let (time, dt, equations) = (state.time, step.dt, state.temperature.len());
                format!("t = {time:.4} of {end:.4} s  step {dt:.3e} s  {equations} equations")
            });
            run.step(|| describe_step(simulation, step, &names));
            if result.is_ok() {
                result = run.pause(|| Some((*frames, state, observers.save()))).map_err(Error::from);
            }
            if result.is_err() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        // the release comes at its time
        let release = task.mechanics.as_ref().and_then(|mechanics| mechanics.settings.release_at);
        let release = release.filter(|&time| time > simulation.time() && time < until);
        let mut flow = ControlFlow::Continue(());
        for stop in release.into_iter().chain([until]) {
            if flow.is_continue() {
                flow = simulation.advance_unless(interrupted, stop, &mut observe)?;
            }
        }
        result?;
        if flow.is_break() {
            // interrupted within a step
            run.pause(|| Some((*frames, simulation.state(), observers.save()))).map_err(Error::from)?;
        }
        if *frames == last {
            observers.end(simulation)?;
        }
        phases.start("write");
        if let Some(series) = &mut series {
            write(simulation, observers, series)?;
        }
        *frames += 1;
        phases.start("solve");
    }
    series.map(MeshSeries::finish).transpose()?;
    Ok(())
}

/// Writes a frame. Nonexistent elements have NaN values and 0 in `exists`.
fn write(simulation: &Simulation, observers: &PartObservers, series: &mut MeshSeries) -> Result<(), Error> {
    let fields = observers.fields(simulation);
    let data = |place: Place| -> Vec<Data> {
        let own = fields.iter().filter(|field| field.place == place);
        own.map(|field| (field.name.as_str(), field.components, field.values.as_slice())).collect()
    };
    Ok(series.step(simulation.time(), &data(Place::Points), &data(Place::Cells))?)
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
