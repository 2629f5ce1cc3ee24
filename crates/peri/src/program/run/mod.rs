//! Runs a scene: solves every variant, compares, draws and judges; resumable from checkpoints.

mod compare;
mod device;
mod draw;
mod history;
mod outcome;
mod program;
mod references;
mod studies;
mod variants;

pub use outcome::{Profile, VariantOutcome};
pub use program::Peri;

use variants::VariantRun;

use crate::bonds::Bonds;
use crate::calibrate::Space;
use crate::contact::Contact;
use crate::error::Error;
use crate::program::card::{self, Card};
use crate::program::observe::{self, FieldFrames, Moment, Physics, SceneObservers, in_space};
use crate::program::quantities as q;
use crate::program::scene::{self, ContactSpec, NAMING, NamedState, Scene, SceneVariant};
use crate::solver::{Breaking, Method, StageEnd, State, Status, StepRecord, System, load_stepping};
use harness::case::{Fault, Run, Step, StepField};
use harness::observe::{Outputs, Scalars};
use harness::report::{Phases, Report, SceneUnits};
use harness::scene::Source;
use harness::study;
use polycore::memory::available;
use std::cell::RefCell;
use std::path::Path;

/// Error of a run: an invalid scene, or a failure while solving.
pub type PeriFailure = harness::scene::Failure<Error>;

/// Particles of a body whose loops keep all threads busy: larger variants are solved one after another.
const LARGE_BODY: usize = 100_000;

/// Finished run of a scene.
pub struct FinishedScene {
    /// Report, as in `report.json`.
    pub report: Report,
    /// Results of the variants, in their order.
    pub outcomes: Vec<VariantOutcome>,
}

impl FinishedScene {
    /// Returns warnings and remarks, a line each.
    pub fn notes(&self) -> String {
        compare::notes(&self.outcomes)
    }

    /// Returns the summary for the terminal: all values of a single variant or a line per variant, then the
    /// verdicts.
    pub fn summary(&self) -> String {
        let notes = self.notes();
        if self.outcomes.len() == 1 {
            self.report.table() + &history::peak_lines(&self.outcomes) + &notes
        } else {
            compare::table(&self.outcomes)
                + &history::peak_lines(&self.outcomes)
                + &notes
                + &self.report.verdict()
        }
    }
}

/// Runs a scene and writes all files but `report.json`, which [`Run::finish`] writes.
///
/// # Errors
/// [`PeriFailure`]; no file is half-written, and an interrupted run can be resumed.
pub fn run(source: &Source, scene: &Scene, run: &mut Run) -> Result<FinishedScene, PeriFailure> {
    match scene.body.space {
        Space::Solid => run_in::<3>(source, scene, run),
        _ => run_in::<2>(source, scene, run),
    }
}

fn run_in<const D: usize>(
    source: &Source,
    scene: &Scene,
    run: &mut Run,
) -> Result<FinishedScene, PeriFailure> {
    let (output, quick) = (run.options.output, run.options.quick);
    let variants = observe::check(source, scene, quick)?;
    // every body is built once before anything is computed or written, so that errors show at once
    let (mut largest, mut memory, mut on_card) = (0, f64::MIN_POSITIVE, false);
    for variant in variants.iter().filter(|variant| variant.of.expect_error.is_none()) {
        let (source, scene) = variant.resolved();
        let bonds = Physics::<D>::new(source, scene, variant)?.0.bonds;
        on_card |= device::choose(source, scene, &*bonds)?.card.is_some();
        largest = largest.max(bonds.particles().len());
        memory = memory.max(scene::memory_needed(scene, &*bonds));
    }
    run.begin()?;
    // one after another if steps are observed or run times are compared
    let timed = scene.exact.is_some() || scene.output.compare.is_some();
    let alone = run.options.on_step.is_some() || timed || on_card || largest > LARGE_BODY;
    let fitting = (available() / memory) as usize;
    let at_once = if alone { 1 } else { rayon::current_num_threads().min(fitting).max(1) };
    let names: Vec<String> = variants.iter().map(SceneVariant::name).collect();
    let lengths = scene::free_lengths::<D>(&variants)?;
    let mut finished = study::solve(run, NAMING, &names, at_once, |index, own| {
        let variant = &variants[index];
        let (state, expected) = (own.reached()?, variant.of.expect_error.as_deref());
        let (own_source, own_scene) = variant.resolved();
        let outcome = scene::check_variant(own_source, own_scene)
            .map_err(PeriFailure::from)
            .and_then(|()| {
                run_variant::<D>(own_source, own_scene, variant, output, &VariantRun(own.into()), state)
            })
            .and_then(|(outcome, ended)| match ended {
                Some(error) if expected.is_none_or(|text| !error.to_string().contains(text)) => {
                    write_failed((source, scene, quick), outcome, &error, output)?;
                    Err(PeriFailure::Run(error))
                }
                _ => Ok(outcome),
            });
        let mut outcome = match study::expected(outcome, expected) {
            Err(PeriFailure::Run(error)) if variants.len() > 1 && !error.is_interruption() => {
                return Err(Error::Within { variant: variant.name(), error: Box::new(error) }.into());
            }
            outcome => outcome?.unwrap_or_else(|error| VariantOutcome {
                error: Some(error),
                ..VariantOutcome::new(variant.name(), variant)
            }),
        };
        if expected.is_some() {
            outcome.value(q::FAILED_AS_EXPECTED, f64::from(u8::from(outcome.error.is_some())));
        }
        outcome.description.clone_from(&variant.of.description);
        Ok(outcome)
    })?;
    finished.iter_mut().take(1).for_each(|outcome| outcome.warnings.extend(lengths.clone()));
    let mut report = compare::report(source, scene, &finished, quick);
    history::write(scene, &finished, output)?;
    compare::write(&finished, output)?;
    compare::suite(&mut report, &finished, output)?;
    let errors = references::reference_errors(&scene.expect, &finished);
    references::add(&mut report, &errors);
    if scene.output.pictures {
        draw::draw_curves(scene, &finished, output)?;
        references::draw(&errors, output)?;
        let units = SceneUnits::from_scene(&source.text);
        studies::draw_studies(&scene.expect, &finished, &units, output)?;
    }
    Ok(FinishedScene { report, outcomes: finished })
}

/// Writes the history, values and failed report of a variant that ended in an error.
fn write_failed(
    (source, scene, quick): (&Source, &Scene, bool),
    outcome: VariantOutcome,
    error: &Error,
    output: &Path,
) -> Result<(), PeriFailure> {
    let outcomes = [outcome];
    history::write(scene, &outcomes, output)?;
    let mut report = compare::report(source, scene, &outcomes, quick);
    report.ended(&outcomes[0].name, &error.to_string());
    report.write(output)?;
    Ok(())
}

fn run_variant<const D: usize>(
    source: &Source,
    scene: &Scene,
    variant: &SceneVariant,
    output: &Path,
    variant_run: &VariantRun,
    state: Option<State<D>>,
) -> Result<(VariantOutcome, Option<Error>), PeriFailure> {
    let phases = RefCell::new(Phases::new());
    phases.borrow_mut().start("build");
    let (mut body, mut physics) = Physics::<D>::new(source, scene, variant)?;
    physics.begin(source, scene, variant, &body)?;
    phases.borrow_mut().stop();
    let mut outcome = VariantOutcome::new(variant.name(), variant);
    physics.name = outcome.file_name();
    outcome.warnings = scene::warnings(source, scene, &body);
    outcome.warnings.extend(scene::tearing_warnings(scene, &body, physics.body.toughness.as_ref()));
    let device = device::choose(source, scene, &*body.bonds)?;
    outcome.warnings.extend(device.note);
    outcome.snaps_back = scene.solver.snap_back;
    let mut state = initial_state((source, scene), &body, state, output)?;
    let last = scene.at_end();
    let mut observers = observe::observers::<D>(&last);
    let mut frames = FieldFrames::new(scene, &state, &output.join(physics.field_file()))?;
    let outputs = Outputs { folder: output, pictures: scene.output.pictures };
    let (whole, states) = (scene, scene.named_states());
    let mut solved = Ok(StageEnd::default());
    for index in state.stage.finished..=scene.step.len() {
        let (own_source, own_scene) = (scene.source_of(source, index), scene.stage(index));
        if let Some(before) = index.checked_sub(1) {
            // bonds of the whole body, as in a run that is resumed here
            body = Physics::<D>::new(source, scene, variant)?.0;
            let stage = &physics.stages[before];
            if state.stage.finished < index {
                let end = solved.unwrap_or_default();
                stage.begin([&scene.stage(before), &own_scene], &body, end, &mut state);
            }
            physics.loads = stage.loads(&own_scene, &body, &state).map_err(PeriFailure::Run)?;
            physics.surfaces.clone_from(&stage.surfaces);
        }
        let contact = physics.contact(&own_scene, &body)?;
        physics.place_surfaces(&own_scene, contact.as_ref());
        let watched = Watched { observers: &mut observers, frames: &mut frames, states: &states, outputs };
        let own = (&*own_source, &*own_scene, device.card.as_ref().filter(|_| index == 0));
        solved = solve(own, (&physics, contact), variant_run, &mut body, &mut state, &phases, watched);
        if solved.is_err() {
            break;
        }
        for named in states.iter().filter(|named| named.is_now(&state, true)) {
            body.bonds.prepare(&state.displacement);
            let moment = Moment::new((&own_scene, &physics), &*body.bonds, &state, &phases);
            let moment = moment.with_card(device.card.as_ref()).named(named.name);
            observers.iter().try_for_each(|observer| observer.draw(&moment, &outputs))?;
        }
    }
    outcome.regions = scene::region_names(scene);
    let scene = &*last;
    let ended = match solved {
        Err(PeriFailure::Run(error @ Error::NoEquilibrium { .. })) if !state.history.is_empty() => {
            Some(error)
        }
        other => other.map(|_| None)?,
    };
    if let Some(error) = &ended {
        // bonds of the last equilibrium have broken since
        body = Physics::<D>::new(source, scene, variant)?.0;
        state.fracture.restore(&mut *body.bonds)?;
        outcome.error = Some(error.to_string());
    }
    outcome.warnings.extend(whole.unreached(&state, ended.is_some()));
    if scene.dynamics.is_some() {
        body.bonds.prepare(&state.displacement);
    }
    let moment =
        Moment::new((scene, &physics), &*body.bonds, &state, &phases).with_card(device.card.as_ref());
    moment.stresses()?;
    phases.borrow_mut().start("compare");
    observers.iter_mut().try_for_each(|observer| observer.end(&moment))?;
    for observer in &observers {
        let mut take = |named, value| outcome.value(named, value);
        observer.scalars(&mut Scalars::new(Some(&moment), &mut take));
        outcome.warnings.extend(observer.warnings(&moment));
        outcome.profiles.extend(observer.curves(&moment).into_iter().filter_map(Profile::from_curve));
    }
    phases.borrow_mut().stop();
    outcome.record_work(&*body.bonds, &state);
    outcome.history.clone_from(&state.history);
    outcome.events.clone_from(&state.fracture.events);
    outcome.starts.clone_from(&state.stage.starts);
    outcome.fragments = moment.fragments().to_vec();
    outcome.planes = scene.contact.as_ref().map_or(0, |contact| contact.plane.len());
    outcome.surfaces = scene.contact.as_ref().map_or_else(Vec::new, ContactSpec::surface_names);
    outcome.probes = observe::columns(scene);
    outcome.record_seconds(&phases.borrow());
    frames.finish(&observers, &moment)?;
    observers.iter().try_for_each(|observer| observer.write(&moment, &outputs))?;
    outcome.warnings.extend(observe::animate(&moment, output));
    Ok((outcome, ended))
}

/// Returns the initial state of a variant: that of the checkpoint, else the undeformed body.
fn initial_state<const D: usize>(
    (source, scene): (&Source, &Scene),
    body: &scene::DiscreteBody<D>,
    state: Option<State<D>>,
    output: &Path,
) -> Result<State<D>, PeriFailure> {
    let sites = body.bonds.sites();
    let Some(state) = state else {
        let mut state = State::new(sites);
        if scene.dynamics.is_some() {
            state.velocity = scene::velocities_of(source, scene, body)?;
        }
        return Ok(state);
    };
    if state.displacement.sites() != sites {
        let why = format!("it has {} sites, the body now has {sites}", state.displacement.sites());
        let path = output.join(harness::checkpoint::FILE_NAME);
        return Err(polycore::Error::Checkpoint { path, why }.into());
    }
    Ok(state)
}

/// Receivers of the finished steps of a run: observers, field file, and the pictures of named states.
struct Watched<'a, 's, const D: usize> {
    observers: &'a mut SceneObservers<'s, D>,
    frames: &'a mut FieldFrames,
    states: &'a [NamedState<'s>],
    outputs: Outputs<'a>,
}

/// Solves a step; returns its end if another one follows.
fn solve<const D: usize>(
    (source, scene, card): (&Source, &Scene, Option<&Card>),
    (physics, contact): (&Physics<D>, Option<Contact<D>>),
    variant_run: &VariantRun,
    body: &mut scene::DiscreteBody<D>,
    state: &mut State<D>,
    phases: &RefCell<Phases>,
    Watched { observers, frames, states, outputs }: Watched<'_, '_, D>,
) -> Result<StageEnd<D>, PeriFailure> {
    let (material, loads) = (&physics.body.material, &physics.loads);
    let (factors, times) = scene.load_steps();
    let mut watch = |status: &Status, state: &State<D>| variant_run.watch(status, state);
    let density_ratios = scene::density_ratios(source, scene, body)?;
    let amplitude = scene.amplitude();
    let row = |bonds: &dyn Bonds<D>, state: &State<D>| physics.row(bonds, state);
    let response = material.respond(&*body.bonds);
    let mut system = System::of_response(&mut *body.bonds, response, loads, &factors);
    system.times = times.into();
    system.density_ratios = density_ratios;
    system.amplitude = amplitude.as_deref();
    system.observer = Some(&row);
    system.fit_bound = scene.fit_bound();
    let criterion = physics.body.criterion.clone();
    system.breaking = criterion.map(|criterion| Breaking { criterion, policy: scene.solver.breaking });
    system.sliding = scene::sliding_bonds(scene, &physics.body.interfaces);
    system.contact = contact;
    (system.refine, system.snap_back) = (scene.solver.refine, scene.solver.snap_back);
    system.stop_below = scene.solver.stop_below.map_or(0.0, |part| part.si());
    phases.borrow_mut().start("solve");
    let mut finished = |bonds: &dyn Bonds<D>, state: &State<D>| {
        phases.borrow_mut().stop();
        let mut moment = Moment::new((scene, physics), bonds, state, phases).with_card(card);
        observers.iter_mut().try_for_each(|observer| observer.see(&moment))?;
        frames.step(observers, &moment)?;
        for named in states.iter().filter(|named| state.control.round == 0 && named.is_now(state, false)) {
            moment = moment.named(named.name);
            observers.iter().try_for_each(|observer| observer.draw(&moment, &outputs))?;
        }
        if state.control.round == 0 {
            variant_run.step(|| step_data(bonds, state));
        }
        phases.borrow_mut().start("solve");
        Ok(())
    };
    let solved = match &scene.dynamics {
        Some(dynamics) => {
            let method = dynamics.method();
            match card {
                Some(card) => card::solve(card, &method, &mut system, state, &mut watch, &mut finished),
                None => method.solve(&mut system, state, &mut watch, &mut finished),
            }
        }
        None => {
            let on_card = card.map(|card| card::equilibria(card, scene));
            let mut method = on_card.unwrap_or_else(|| scene.equilibria());
            load_stepping(&mut *method, &mut system, state, &mut watch, &mut finished)
        }
    };
    phases.borrow_mut().stop();
    solved?;
    let later = state.stage.finished < physics.stages.len();
    Ok(if later { system.end_of_step(state) } else { StageEnd::default() })
}

/// Returns the data of a finished step for a callback: positions and displacements in three components.
fn step_data<const D: usize>(bonds: &dyn Bonds<D>, state: &State<D>) -> Step {
    let Some(record) = state.history.last() else { return Step::default() };
    let of_particles = |name, get: &dyn Fn(usize) -> [f64; D]| {
        let each = bonds.particles().iter().flat_map(|&site| in_space(get(site as usize)));
        StepField { name, unit: "m", components: 3, data: each.collect() }
    };
    Step {
        values: StepRecord::SCALARS.map(|(name, unit, get)| (name, unit, get(record))).to_vec(),
        fields: vec![
            of_particles("position", &|site| bonds.position(site)),
            of_particles("displacement", &|site| state.displacement.get(site)),
        ],
    }
}

/// Formats the progress line of an iteration.
fn progress_line(status: &Status) -> String {
    let Status { step, steps, iteration, residual, load, broken, .. } = *status;
    let broken = if broken > 0 { format!("  broken {broken}") } else { String::new() };
    let load = load.map_or(String::new(), |load| format!("  load {load:.4e} N before"));
    format!("step {}/{steps}{broken}  iteration {iteration}  residual {residual:.2e}{load}", step + 1)
}

/// Returns the finished fraction of a variant, 0 to 1, from the logarithm of the residual.
fn finished_fraction(status: &Status) -> f64 {
    let decades = (1.0 / status.tolerance).log10();
    let done = (-status.residual.log10()).clamp(0.0, decades) / decades;
    (status.step as f64 + done) / status.steps as f64
}

/// Lists what a scene builds and leaves out, by variant.
///
/// # Errors
/// An invalid scene.
pub fn explanation(source: &Source, scene: &Scene, quick: bool) -> Result<Vec<String>, PeriFailure> {
    match scene.body.space {
        Space::Solid => explanation_in::<3>(source, scene, quick),
        _ => explanation_in::<2>(source, scene, quick),
    }
}

fn explanation_in<const D: usize>(
    source: &Source,
    scene: &Scene,
    quick: bool,
) -> Result<Vec<String>, PeriFailure> {
    let mut lines = Vec::new();
    let variants = observe::check(source, scene, quick)?;
    let lengths = scene::free_lengths::<D>(&variants)?;
    for variant in variants {
        if let Some(error) = &variant.of.expect_error {
            lines.push(format!("variant {}\n  expects    an error that contains `{error}`", variant.name()));
            continue;
        }
        let (source, scene) = variant.resolved();
        let (body, physics) = Physics::<D>::new(source, scene, &variant)?;
        let (criterion, reports) = (physics.body.criterion.as_ref(), observe::quantities(scene));
        lines.extend(scene::explain(source, scene, &variant, &body, criterion, &reports)?);
        lines.extend(scene::explain_tearing(scene, &body, physics.body.toughness.as_ref()));
        let device = device::choose(source, scene, &*body.bonds)?;
        lines.extend(device.note.map(|note| format!("  builds     {note}")));
        lines.extend(physics.body.followed.iter().map(|one| format!("  follows    {one}")));
    }
    lines.extend(lengths.into_iter().map(|text| format!("  warning    {text}")));
    Ok(lines)
}
