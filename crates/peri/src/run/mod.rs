//! A whole scene: every variant solved, measured, compared, drawn and judged; restartable at any moment.

mod against;
mod bonded;
mod compare;
mod draw;
mod frames;
mod history;
mod outcome;
mod probes;

pub use compare::BALANCES;
pub use history::load_at_name;
pub use outcome::{Outcome, Profile};

use bonded::Bonded;
use frames::Frames;
use probes::Probes;

use crate::bonds::{Bonds, Kind, fragments, stretch_range};
use crate::calibrate::Space;
use crate::checkpoint;
use crate::contact::Contact;
use crate::error::Error;
use crate::material::{BondMaterial, Property};
use crate::potential::{BondPotential, KernelFit};
use crate::scene::{self, Scene, Variant, body_of, loads_of};
use crate::solver::{Breaking, Loads, State, Status, System, march};
use crate::stress::{Loaded, Tensor, piola_in_cloud, piola_on_lattice};
use polycore::report::{Phases, Report};
use polycore::scene::Source;
use std::path::Path;
use std::time::{Duration, Instant};

/// How long a run that is asked to stop looks for a moment from which it can go on.
const PATIENCE: Duration = Duration::from_secs(5);

/// How a run behaves towards its user.
pub struct Options<'a> {
    /// Where results go.
    pub output: &'a Path,
    /// Leave out variants and expectations marked `quick = false`.
    pub quick: bool,
    /// Time between checkpoints.
    pub checkpoint_every: Duration,
    /// Continue from the checkpoint in `output`.
    pub resume: bool,
    /// Whether the user asked to stop.
    pub interrupted: &'a dyn Fn() -> bool,
    /// Sees progress.
    pub progress: &'a mut dyn FnMut(&str, &Status),
}

/// What stops a run: a fault in the scene, or one met on the way.
pub type Failure = polycore::scene::Failure<Error>;

/// A finished run.
pub struct Finished {
    /// As written to `report.json`.
    pub report: Report,
    /// The variants, in the order they ran.
    pub outcomes: Vec<Outcome>,
}

impl Finished {
    /// For the terminal: all values of a single variant, a line for each of several, then the judged expectations.
    pub fn summary(&self) -> String {
        let notes = compare::notes(&self.outcomes);
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

/// Runs a scene in its dimension.
///
/// # Errors
/// [`Failure`]; nothing half-written remains, and an interrupted run can be resumed.
pub fn run(source: &Source, scene: &Scene, options: &mut Options) -> Result<Finished, Failure> {
    match scene.body.space {
        Space::Solid => run_in::<3>(source, scene, options),
        _ => run_in::<2>(source, scene, options),
    }
}

fn run_in<const D: usize>(
    source: &Source,
    scene: &Scene,
    options: &mut Options,
) -> Result<Finished, Failure> {
    let variants = scene::check(source, scene, options.quick)?;
    // every body is built once before anything is computed or written: faults show at once
    if !options.resume {
        for variant in variants.iter().filter(|variant| expected_error(scene, variant).is_none()) {
            let (source, scene) = variant.resolve(source, scene)?;
            Built::<D>::new(&source, &scene, variant)?;
        }
    }
    let (mut finished, mut state) = (Vec::new(), None);
    let _lock;
    if options.resume {
        _lock = polycore::output::resume_run(options.output)?;
        let read = checkpoint::read::<D>(options.output)?;
        (finished, state) = (read.finished, read.state);
    } else {
        _lock = polycore::output::prepare_run(options.output)?;
        // a run can be resumed from its first moment on
        checkpoint::write::<D>(options.output, source, options.quick, &finished, None)?;
    }
    for variant in &variants[finished.len().min(variants.len())..] {
        let state = state.take();
        let (own_source, own_scene) = variant.resolve(source, scene)?;
        let study = variant.study.and_then(|index| scene.study.get(index));
        let expected = expected_error(scene, variant);
        let mut outcome = match scene::check_variant(&own_source, &own_scene)
            .map_err(Failure::from)
            .and_then(|()| run_variant::<D>(&own_source, &own_scene, variant, options, &finished, state))
        {
            Err(failure) if expected.is_some_and(|text| failure.to_string().contains(text)) => {
                let mut outcome = Outcome::new(variant.name(), variant);
                outcome.error = Some(failure.to_string());
                outcome
            }
            Err(Failure::Run(error)) if variants.len() > 1 && !matches!(error, Error::Interrupted(_)) => {
                return Err(Error::Within { variant: variant.name(), error: Box::new(error) }.into());
            }
            other => other?,
        };
        if expected.is_some() {
            outcome.value("failed_as_it_must", f64::from(u8::from(outcome.error.is_some())), "");
        }
        outcome.must = study.and_then(|study| study.must.clone());
        finished.push(outcome);
        checkpoint::write::<D>(options.output, source, options.quick, &finished, None)?;
    }
    let mut report = compare::report(source, scene, &finished, options.quick);
    history::write(scene, &finished, options.output)?;
    compare::study(&finished, options.output)?;
    history::suite(&mut report, &finished, options.output)?;
    if scene.output.pictures {
        draw::curves(scene, &finished, options.output)?;
    }
    report.write(options.output)?;
    // the report is the last file: a checkpoint without it is an unfinished run
    let _ = std::fs::remove_file(options.output.join(checkpoint::FILE_NAME));
    Ok(Finished { report, outcomes: finished })
}

/// What the error of a variant must contain, where one is expected.
fn expected_error<'a>(scene: &'a Scene, variant: &Variant) -> Option<&'a str> {
    variant.study.and_then(|index| scene.study.get(index)?.fails.as_deref())
}

fn run_variant<const D: usize>(
    source: &Source,
    scene: &Scene,
    variant: &Variant,
    options: &mut Options,
    finished: &[Outcome],
    state: Option<State<D>>,
) -> Result<Outcome, Failure> {
    let mut phases = Phases::new();
    phases.start("build");
    let Built { bonded, loads, loaded, probes } = Built::<D>::new(source, scene, variant)?;
    let Bonded { mut body, law, modulus, critical_stretch } = bonded;
    let plate = scene::exact_plate(source, scene, &body)?;
    phases.stop();
    let warnings = scene::warnings(scene, &body);
    let slots = body.bonds.slots();
    let fresh = state.is_none();
    let mut state = state.unwrap_or_else(|| State::new(slots));
    if fresh && scene.dynamics.is_some() {
        state.velocity = scene::velocities_of(source, scene, &body)?;
    }
    if state.displacement.slots() != slots {
        let why = format!("it has {} particles' slots, the body now has {slots}", state.displacement.slots());
        let path = options.output.join(checkpoint::FILE_NAME);
        return Err(polycore::Error::Checkpoint { path, why }.into());
    }
    let mut outcome = Outcome::new(variant.name(), variant);
    outcome.warnings = warnings;
    let path = options.output.join(format!("{}.vtkhdf", outcome.file_name()));
    // where forces act, and where the surface correction has already made up for missing bonds
    let corrected = variant.surface == scene::SurfaceCorrection::Energy;
    let by_window = loaded.iter().map(|&loaded| loaded || corrected).collect();
    let mut frames = Frames::new(scene, &*law, modulus, &*body.bonds, &state, path, by_window)?;
    let (law_used, loads_used) = (&*law, &loads);
    let solution = Solution {
        variant,
        finished,
        law: law_used,
        modulus,
        loads: loads_used,
        probes: &probes,
        critical_stretch: critical_stretch.as_ref(),
    };
    solve(source, scene, &solution, options, &mut body, &mut state, &mut phases, &mut frames)?;
    outcome.work_of(&*body.bonds, &state);
    let fit = KernelFit::new(&*law, covering(&*body.bonds, &state), scene.fit_bound())?;
    outcome.value("fit_error", fit.max_error, "");
    if let Some(critical) = &critical_stretch {
        outcome.value("critical_stretch", critical.least(), "");
        outcome.value("fragments", fragments(&*body.bonds) as f64, "");
    }
    if scene.dynamics.is_some() {
        // a body that is held everywhere has none
        if state.motion.critical_step.is_finite() {
            outcome.value("critical_time_step", state.motion.critical_step, "s");
        }
        outcome.value("time_step", state.motion.time_step, "s");
        outcome.value("kinetic_energy", state.motion.kinetic, "J");
    }
    let stresses = frames.stresses(&*body.bonds, &state, &mut phases)?;
    outcome.history.clone_from(&state.history);
    outcome.events.clone_from(&state.events);
    outcome.regions = scene::region_names(scene);
    phases.time("compare", || {
        outcome.responses(&*body.bonds, &loads, &state);
        outcome.values_of_history(scene);
        outcome.values_of_probes(&scene.probe);
        if let Some(exact) = &scene.exact {
            compare::hole(&*body.bonds, exact, plate.as_ref(), &stresses.cauchy, &loaded, &mut outcome);
        }
    });
    outcome.seconds(&phases);
    let path = frames.path().to_path_buf();
    frames.finish(&*body.bonds, &state, &stresses)?;
    if scene.output.pictures {
        draw::maps(scene, &*body.bonds, &state, &stresses.cauchy, &outcome, options.output)?;
        if scene.output.fields && scene.output.every.is_some() && critical_stretch.is_some() {
            frames::stages(scene, &outcome, body.bonds.spacing(), &path, options.output)?;
        }
    }
    Ok(outcome)
}

/// All that a variant is before it is solved.
struct Built<const D: usize> {
    bonded: Bonded<D>,
    loads: Loads<D>,
    /// Slots in any loading layer.
    loaded: Vec<bool>,
    probes: Probes<D>,
}

impl<const D: usize> Built<D> {
    fn new(source: &Source, scene: &Scene, variant: &Variant) -> Result<Self, Failure> {
        let body = body_of::<D>(source, scene, variant)?;
        let (loads, loaded) = loads_of(source, scene, &body)?;
        scene::check_placement(source, scene, &body, &loads)?;
        let probes = Probes::new(source, scene, &body)?;
        Ok(Self { bonded: Bonded::new(source, scene, variant, body)?, loads, loaded, probes })
    }
}

/// What is solved and does not change.
struct Solution<'a, const D: usize> {
    variant: &'a Variant,
    finished: &'a [Outcome],
    law: &'a dyn BondPotential,
    modulus: f64,
    loads: &'a Loads<D>,
    probes: &'a Probes<D>,
    critical_stretch: Option<&'a Property>,
}

#[expect(clippy::too_many_arguments, reason = "one call, of what changes and what does not")]
fn solve<const D: usize>(
    source: &Source,
    scene: &Scene,
    solution: &Solution<D>,
    options: &mut Options,
    body: &mut scene::Body<D>,
    state: &mut State<D>,
    phases: &mut Phases,
    frames: &mut Frames,
) -> Result<(), Failure> {
    let Solution { variant, finished, law, modulus, loads, probes, critical_stretch } = *solution;
    let factors = scene.solver.factors();
    let name = variant.name();
    let (mut written, mut asked) = (Instant::now(), None);
    let (output, quick, every, interrupted) =
        (options.output, options.quick, options.checkpoint_every, options.interrupted);
    let progress = &mut *options.progress;
    let mut watch = |status: &Status, state: &State<D>| -> Result<(), Error> {
        progress(&name, status);
        let stop = interrupted();
        if status.restartable && (stop || written.elapsed() >= every) {
            checkpoint::write(output, source, quick, finished, Some(state))?;
            written = Instant::now();
        }
        if stop {
            let since = *asked.get_or_insert_with(Instant::now);
            // the last checkpoint will do where the next restartable moment is far
            if status.restartable || since.elapsed() > PATIENCE {
                return Err(Error::Interrupted(output.to_path_buf()));
            }
        }
        Ok(())
    };
    let contact =
        scene.contact.map(|contact| Contact::new(&*body.bonds, modulus, contact.stiffness)).transpose()?;
    let course = scene.dynamics.as_ref().and_then(|dynamics| dynamics.factor.as_ref());
    let course = course.map(|formula| |time: f64| formula.in_time(time));
    let observer = |bonds: &dyn Bonds<D>, state: &State<D>| probes.see(bonds, state);
    let mut system = System::new(&mut *body.bonds, BondMaterial::new(law, modulus), loads, &factors);
    system.course = course.as_ref().map(|course| course as _);
    system.observer = (!scene.probe.is_empty()).then_some(&observer as _);
    system.fit_bound = scene.fit_bound();
    system.breaking =
        critical_stretch.map(|stretch| Breaking { stretch: stretch.clone(), policy: scene.solver.breaking });
    system.contact = contact;
    system.stop_below = scene.solver.stop_below.unwrap_or(0.0);
    phases.start("solve");
    let mut finished = |bonds: &dyn Bonds<D>, state: &State<D>| {
        phases.stop();
        frames.step(bonds, state, phases)?;
        phases.start("solve");
        Ok(())
    };
    let solved = match &scene.dynamics {
        Some(dynamics) => dynamics.method().solve(&mut system, state, &mut watch, &mut finished),
        None => march(&mut *scene.equilibria(), &mut system, state, &mut watch, &mut finished),
    };
    phases.stop();
    Ok(solved?)
}

/// The stretches of a state, with a margin for rounding.
fn covering<const D: usize>(bonds: &dyn Bonds<D>, state: &State<D>) -> [f64; 2] {
    let met = stretch_range(bonds, &state.displacement);
    [(1.0 + met.low).max(0.0).sqrt() - 1e-3, (1.0 + met.high).sqrt() + 1e-3].map(|s| s.max(1e-3))
}

fn stress<const D: usize>(
    bonds: &dyn Bonds<D>,
    loaded: &Loaded<D>,
    measure: crate::stress::Measure,
    ball: crate::stress::BallVolume,
) -> Vec<Tensor<D>> {
    match bonds.kind() {
        Kind::Lattice(lattice) => piola_on_lattice(lattice, loaded, measure, ball),
        Kind::Cloud(cloud) => piola_in_cloud(cloud, loaded, measure, ball),
    }
}

/// What a scene builds and leaves out, variant by variant.
///
/// # Errors
/// A fault of the scene.
pub fn explanation(source: &Source, scene: &Scene, quick: bool) -> Result<Vec<String>, Failure> {
    match scene.body.space {
        Space::Solid => explanation_in::<3>(source, scene, quick),
        _ => explanation_in::<2>(source, scene, quick),
    }
}

fn explanation_in<const D: usize>(
    source: &Source,
    scene: &Scene,
    quick: bool,
) -> Result<Vec<String>, Failure> {
    let mut lines = Vec::new();
    for variant in scene::check(source, scene, quick)? {
        if let Some(error) = expected_error(scene, &variant) {
            lines.push(format!("variant {}\n  must fail  with `{error}`", variant.name()));
            continue;
        }
        let (source, scene) = variant.resolve(source, scene)?;
        let built = Built::<D>::new(&source, &scene, &variant)?;
        let Bonded { body, critical_stretch, .. } = &built.bonded;
        let critical_stretch = critical_stretch.as_ref().map(Property::least);
        lines.extend(scene::explain(&source, &scene, &variant, body, critical_stretch)?);
    }
    Ok(lines)
}
