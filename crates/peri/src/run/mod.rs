//! A whole scene: every variant solved, measured, compared, drawn and judged; restartable at any moment.

mod bonded;
mod compare;
mod draw;
mod outcome;

pub use outcome::{Outcome, Profile};

use bonded::Bonded;

use crate::bonds::{Bonds, stretch_range};
use crate::calibrate::Space;
use crate::checkpoint;
use crate::error::Error;
use crate::potential::{BondPotential, KernelFit};
use crate::scene::{self, Scene, Variant, body_of, loads_of};
use crate::solver::{AdaptiveDynamicRelaxation, Loads, State, Status, System};
use crate::stress::{Loaded, Tensor, cauchy, deformation_gradients, piola_in_cloud, piola_on_lattice};
use polycore::report::{Phases, Report};
use polycore::scene::{SceneError, Source};
use std::path::Path;
use std::time::{Duration, Instant};

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
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// The scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Anything else.
    #[error(transparent)]
    Run(#[from] Error),
}

impl From<polycore::Error> for Failure {
    fn from(error: polycore::Error) -> Self {
        Self::Run(error.into())
    }
}

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
        if self.outcomes.len() == 1 {
            self.report.table()
        } else {
            compare::table(&self.outcomes) + &self.report.verdict()
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
        for variant in &variants {
            let body = body_of::<D>(source, scene, variant)?;
            loads_of(source, scene, &body)?;
            Bonded::new(source, scene, variant, body)?;
        }
    }
    polycore::output::prepare_directory(options.output)?;
    if !options.resume {
        // what an earlier run left must not pass for this one's
        for old in [checkpoint::FILE_NAME, polycore::report::FILE_NAME] {
            let _ = std::fs::remove_file(options.output.join(old));
        }
    }
    remove_unfinished_files(options.output);
    let (mut finished, mut state) = (Vec::new(), None);
    if options.resume {
        let read = checkpoint::read::<D>(options.output)?;
        (finished, state) = (read.finished, read.state);
    } else {
        // a run can be resumed from its first moment on
        checkpoint::write::<D>(options.output, source, options.quick, &finished, None)?;
    }
    for variant in &variants[finished.len().min(variants.len())..] {
        let state = state.take();
        let outcome = run_variant::<D>(source, scene, variant, options, &finished, state)?;
        finished.push(outcome);
        checkpoint::write::<D>(options.output, source, options.quick, &finished, None)?;
    }
    let report = compare::report(source, scene, &finished, options.quick);
    if scene.output.pictures {
        draw::curves(scene, &finished, options.output)?;
    }
    report.write(options.output)?;
    // the report is the last file: a checkpoint without it is an unfinished run
    let _ = std::fs::remove_file(options.output.join(checkpoint::FILE_NAME));
    Ok(Finished { report, outcomes: finished })
}

/// A killed run leaves files that it had begun to write under their temporary names.
fn remove_unfinished_files(directory: &Path) {
    for entry in std::fs::read_dir(directory).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.starts_with('.') && name.ends_with(".part") {
            let _ = std::fs::remove_file(entry.path());
        }
    }
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
    let body = body_of::<D>(source, scene, variant)?;
    let (loads, loaded) = loads_of(source, scene, &body)?;
    let Bonded { mut body, law, modulus, critical_stretch } = Bonded::new(source, scene, variant, body)?;
    phases.stop();
    let slots = body.bonds.slots();
    let mut state = state.unwrap_or_else(|| State::new(slots));
    if state.displacement.slots() != slots {
        let why = format!("it has {} particles' slots, the body now has {slots}", state.displacement.slots());
        let path = options.output.join(checkpoint::FILE_NAME);
        return Err(Error::Checkpoint { path, why }.into());
    }
    phases.start("solve");
    let solved =
        solve(source, scene, variant, options, finished, &mut body, &*law, modulus, &loads, &mut state);
    phases.stop();
    solved?;
    let mut outcome = Outcome::new(variant.name(), variant);
    outcome.work_of(&*body.bonds, &state);
    let fit = KernelFit::new(&*law, covering(&*body.bonds, &state), scene.solver.fit_bound)?;
    outcome.value("fit_error", fit.max_error, "");
    if let Some(critical) = critical_stretch {
        outcome.value("critical_stretch", critical, "");
    }
    let (mut fields, mut piola_fields) = (Vec::new(), Vec::new());
    if let Some(spec) = &scene.stress {
        let gradients =
            phases.time("deformation gradient", || deformation_gradients(&*body.bonds, &state.displacement));
        for &measure in &spec.measures {
            let loaded = Loaded { displacement: &state.displacement, fit: &fit, modulus };
            let started = Instant::now();
            let piola = stress(&*body.bonds, &loaded, measure, spec.ball);
            let field = cauchy(&piola, &gradients);
            let seconds = started.elapsed().as_secs_f64();
            phases.add(&format!("stress {}", measure.name()), seconds);
            if scene.output.fields {
                piola_fields.push((measure, piola));
            }
            fields.push((measure, field));
        }
    }
    phases.time("compare", || {
        outcome.responses(&*body.bonds, &loads, &state);
        if let Some(exact) = &scene.exact {
            compare::kirsch(&*body.bonds, exact, &fields, &loaded, &mut outcome);
        }
    });
    outcome.seconds(&phases);
    if scene.output.fields {
        draw::fields(
            &*body.bonds,
            &state,
            &[("cauchy", &fields), ("piola", &piola_fields)],
            &options.output.join(format!("{}.vtkhdf", outcome.file_name())),
        )?;
    }
    if scene.output.pictures {
        draw::maps(scene, &*body.bonds, &state, &fields, &outcome, options.output)?;
    }
    Ok(outcome)
}

#[expect(
    clippy::too_many_arguments,
    reason = "one call, and a struct for it would only rename the arguments"
)]
fn solve<const D: usize>(
    source: &Source,
    scene: &Scene,
    variant: &Variant,
    options: &mut Options,
    finished: &[Outcome],
    body: &mut scene::Body<D>,
    law: &dyn BondPotential,
    modulus: f64,
    loads: &Loads<D>,
    state: &mut State<D>,
) -> Result<(), Failure> {
    let solver = AdaptiveDynamicRelaxation {
        tolerance: scene.solver.tolerance,
        max_iterations: scene.solver.max_iterations,
        mass_safety: scene.solver.mass_safety.unwrap_or(scene.material.law.mass_safety()),
    };
    let steps = scene.solver.steps;
    let factors: Vec<f64> = (1..=steps).map(|s| s as f64 / steps as f64).collect();
    let name = variant.name();
    let mut written = Instant::now();
    let (output, quick, every, interrupted) =
        (options.output, options.quick, options.checkpoint_every, options.interrupted);
    let progress = &mut *options.progress;
    let mut watch = |status: &Status, state: &State<D>| -> Result<(), Error> {
        progress(&name, status);
        let stop = interrupted();
        if stop || written.elapsed() >= every {
            checkpoint::write(output, source, quick, finished, Some(state))?;
            written = Instant::now();
        }
        if stop { Err(Error::Interrupted(output.to_path_buf())) } else { Ok(()) }
    };
    let mut system = System::new(&mut *body.bonds, law, modulus, loads, &factors);
    system.fit_bound = scene.solver.fit_bound;
    solver.solve(&mut system, state, &mut watch, &mut |_, _| Ok(()))?;
    Ok(())
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
    if let Some(lattice) = bonds.as_lattice() {
        piola_on_lattice(lattice, loaded, measure, ball)
    } else if let Some(cloud) = bonds.as_cloud() {
        piola_in_cloud::<D>(cloud, loaded, measure, ball)
    } else {
        Vec::new()
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
        let body = body_of::<D>(source, scene, &variant)?;
        loads_of(source, scene, &body)?;
        let bonded = Bonded::new(source, scene, &variant, body)?;
        lines.extend(scene::explain(scene, &variant, &*bonded.body.bonds));
    }
    Ok(lines)
}
