//! A whole scene: every variant solved, measured, compared, drawn and judged; restartable at any moment.

mod compare;
mod draw;
mod envelope;
mod frames;
mod history;
mod lines;
mod material;
mod outcome;
mod probes;
mod program;
mod scale;
mod sections;
mod solid;
mod stages;
mod toughness;
mod variants;

pub use outcome::{Outcome, Profile};
pub use program::Peri;

use frames::Frames;
use material::Observed;
pub(crate) use material::{Acting, Bonded};
use probes::Probes;
use sections::Sections;
use toughness::NewCrack;
use variants::UnderWay;

use crate::bonds::{Bonds, Property, covered_stretches, fragments};
use crate::calibrate::Space;
use crate::error::Error;
use crate::material::relief;
use crate::potential::KernelFit;
use crate::program::quantities as q;
use crate::program::scene::{self, NAMING, Scene, Variant, body_of, loads_of};
use crate::solver::{
    Bilinear, Breaking, Criterion, Loads, Method, Record, State, Status, System, load_stepping,
};
use harness::case::{Fault, Run, Step, StepField};
use harness::report::{Phases, Report};
use harness::scene::Source;
use harness::study;
use polycore::memory::available;
use std::path::Path;

/// What stops a run: a fault in the scene, or one on the way.
pub type Failure = harness::scene::Failure<Error>;

/// Particles of a body from which on its own loops keep all threads busy: such variants are solved one after another.
const LARGE: usize = 100_000;
/// Error of forces in mixed precision beyond which a run warns.
const MIXED: f64 = 1e-2;

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

/// Runs a scene in its dimension, all but `report.json`, which [`Run::finish`] writes.
///
/// # Errors
/// [`Failure`]; nothing half-written remains, and an interrupted run can be resumed.
pub fn run(source: &Source, scene: &Scene, run: &mut Run) -> Result<Finished, Failure> {
    match scene.body.space {
        Space::Solid => run_in::<3>(source, scene, run),
        _ => run_in::<2>(source, scene, run),
    }
}

fn run_in<const D: usize>(source: &Source, scene: &Scene, run: &mut Run) -> Result<Finished, Failure> {
    let (output, quick) = (run.options.output, run.options.quick);
    let variants = scene::check(source, scene, quick)?;
    // every body is built once before anything is computed or written: faults show at once
    let (mut largest, mut memory) = (0, f64::MIN_POSITIVE);
    for variant in variants.iter().filter(|variant| variant.of.expect_error.is_none()) {
        let (source, scene) = variant.resolved();
        let bonds = Built::<D>::new(source, scene, variant)?.bonded.body.bonds;
        largest = largest.max(bonds.particles().len());
        memory = memory.max(scene::memory_needed(scene, &*bonds));
    }
    run.begin()?;
    // one after another where steps are watched and where errors are drawn against run times
    let timed = scene.exact.is_some() || scene.output.compare.is_some();
    let alone = run.options.on_step.is_some() || timed || largest > LARGE;
    let fitting = (available() / memory) as usize;
    let at_once = if alone { 1 } else { rayon::current_num_threads().min(fitting).max(1) };
    let names: Vec<String> = variants.iter().map(Variant::name).collect();
    let lengths = scene::free_lengths::<D>(&variants)?;
    let mut finished = study::solve(run, NAMING, &names, at_once, |index, own| {
        let variant = &variants[index];
        let (state, expected) = (own.reached()?, variant.of.expect_error.as_deref());
        let (own_source, own_scene) = variant.resolved();
        let outcome = scene::check_variant(own_source, own_scene)
            .map_err(Failure::from)
            .and_then(|()| {
                run_variant::<D>(own_source, own_scene, variant, output, &UnderWay(own.into()), state)
            })
            .and_then(|(outcome, ended)| match ended {
                Some(error) if expected.is_none_or(|text| !error.to_string().contains(text)) => {
                    kept((source, scene, quick), outcome, &error, output)?;
                    Err(Failure::Run(error))
                }
                _ => Ok(outcome),
            });
        let mut outcome = match study::expected(outcome, expected) {
            Err(Failure::Run(error)) if variants.len() > 1 && !error.is_interruption() => {
                return Err(Error::Within { variant: variant.name(), error: Box::new(error) }.into());
            }
            outcome => outcome?.unwrap_or_else(|error| Outcome {
                error: Some(error),
                ..Outcome::new(variant.name(), variant)
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
    if scene.output.pictures {
        draw::curves(scene, &finished, output)?;
    }
    Ok(Finished { report, outcomes: finished })
}

/// Writes what there is of a variant that ended in an error: its history, its values, and a report that has not passed.
fn kept(
    (source, scene, quick): (&Source, &Scene, bool),
    outcome: Outcome,
    error: &Error,
    output: &Path,
) -> Result<(), Failure> {
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
    variant: &Variant,
    output: &Path,
    under_way: &UnderWay,
    state: Option<State<D>>,
) -> Result<(Outcome, Option<Error>), Failure> {
    let mut phases = Phases::new();
    phases.start("build");
    let Built { bonded, loads, loaded, held, probes, sections } = Built::<D>::new(source, scene, variant)?;
    let Bonded { mut body, material, criterion, toughness, followed, stiffness } = bonded;
    let plate = scene::exact_plate(source, scene, &body)?;
    phases.stop();
    let mut warnings = scene::warnings(source, scene, &body);
    warnings.extend(scene::tearing_warnings(scene, &body, toughness.as_ref()));
    let crack = criterion.as_ref().map(|_| NewCrack::new(scene, &*body.bonds, toughness.as_ref()));
    let sites = body.bonds.sites();
    let fresh = state.is_none();
    let mut state = state.unwrap_or_else(|| State::new(sites));
    if fresh && scene.dynamics.is_some() {
        state.velocity = scene::velocities_of(source, scene, &body)?;
    }
    if state.displacement.sites() != sites {
        let why = format!("it has {} particles' sites, the body now has {sites}", state.displacement.sites());
        let path = output.join(harness::checkpoint::FILE_NAME);
        return Err(polycore::Error::Checkpoint { path, why }.into());
    }
    let mut outcome = Outcome::new(variant.name(), variant);
    outcome.warnings = warnings;
    outcome.snaps_back = scene.solver.snap_back;
    for scene::Followed { parameter, field: [mean, least, largest], mesh_mean, unit, .. } in &followed {
        for (quantity, value) in q::OF_A_FIELD.iter().zip([mean, mesh_mean, least, largest]) {
            outcome.value(quantity.of(&[parameter.value_name()]).in_unit(unit), *value);
        }
    }
    let path = output.join(format!("{}.vtkhdf", outcome.file_name()));
    // where forces act, and where the surface correction has already made up for missing bonds
    let corrected = variant.surface == scene::SurfaceCorrection::Energy;
    let by_window = loaded.iter().map(|&loaded| loaded || corrected).collect();
    let observed = Observed::new(scene, &material, &*body.bonds);
    let mut frames = Frames::new(scene, &observed, (&*body.bonds, &body.cuts), &state, path, by_window)?;
    let solution = Solution {
        material: &material,
        observed: &observed,
        loads: &loads,
        probes: &probes,
        sections: &sections,
        criterion: criterion.as_ref(),
        stiffness: &stiffness,
        held: held.as_deref(),
    };
    let solved =
        solve((source, scene), &solution, under_way, &mut body, &mut state, &mut phases, &mut frames);
    let ended = match solved {
        Err(Failure::Run(error @ Error::NoEquilibrium { .. })) if !state.history.is_empty() => Some(error),
        other => other.map(|()| None)?,
    };
    if let Some(error) = &ended {
        // the last equilibrium has bonds that are broken by now
        body = Built::<D>::new(source, scene, variant)?.bonded.body;
        state.fracture.restore(&mut *body.bonds)?;
        outcome.error = Some(error.to_string());
    }
    outcome.work_of(&*body.bonds, &state);
    if let Acting::Bonds(bonded) = &material {
        let stretches = covered_stretches(&*body.bonds, &state.displacement);
        outcome.value(q::FIT_ERROR, KernelFit::new(bonded.law(), stretches, scene.fit_bound())?.max_error);
    }
    if let Some(criterion) = &criterion {
        match criterion {
            Criterion::Stretch(stretch) => outcome.value(q::CRITICAL_STRETCH, stretch.least()),
            Criterion::Energy(limit) | Criterion::Softening(Bilinear { limit, .. }) => {
                outcome.value(q::CRITICAL_ENERGY, *limit);
            }
        }
        outcome.fragments = fragments(&*body.bonds);
        outcome.value(q::FRAGMENTS, outcome.fragments.len() as f64);
        let volume: f64 = body.bonds.particles().iter().map(|&site| body.bonds.volume(site as usize)).sum();
        outcome.value(
            q::LARGEST_FRAGMENT,
            outcome.fragments.first().map_or(0.0, |largest| largest.volume / volume),
        );
    }
    if scene.dynamics.is_some() {
        // a body that is held everywhere has none
        if state.motion.limits.critical_step.is_finite() {
            outcome.value(q::CRITICAL_TIME_STEP, state.motion.limits.critical_step);
        }
        outcome.value(q::TIME_STEP, state.motion.steps.time_step);
        outcome.value(q::KINETIC_ENERGY, state.motion.energies.kinetic);
        body.bonds.prepare(&state.displacement);
        let lattice = body.bonds.as_lattice();
        if let Some(error) = lattice.and_then(|lattice| lattice.mixed_error(&state.displacement)) {
            outcome.value(q::MIXED_ERROR, error);
            if error > MIXED {
                outcome.warnings.push(format!(
                    "forces in mixed precision are wrong by {error:.1e} of their mean: take double precision"
                ));
            }
        }
    }
    let stresses = frames.stresses(&*body.bonds, &state, &mut phases)?;
    outcome.history.clone_from(&state.history);
    outcome.events.clone_from(&state.fracture.events);
    outcome.regions = scene::region_names(scene);
    let planes = scene.contact.iter().flat_map(|contact| contact.plane.iter().enumerate());
    outcome.planes = planes.map(|(index, plane)| plane.name(index)).collect();
    phases.time("compare", || {
        outcome.responses(&*body.bonds, &loads, &state);
        outcome.values_of_history(scene);
        if let Some(crack) = &crack {
            crack.values(&*body.bonds, &mut outcome);
        }
        outcome.values_of_contact::<D>(scene);
        outcome.values_of_probes(scene);
        if let Some(exact) = &scene.exact {
            compare::hole(&*body.bonds, exact, plate.as_ref(), &stresses.cauchy, &loaded, &mut outcome);
        }
    });
    sections::write::<D>(scene, &mut outcome, output)?;
    if !scene.output.line.is_empty() {
        let damage = frames.damage(&*body.bonds);
        lines::write(scene, &*body.bonds, &state, &stresses, damage.as_deref(), &outcome, output)?;
    }
    outcome.seconds(&phases);
    let path = frames.path().to_path_buf();
    let staged =
        scene.output.fields && scene.output.every.is_some() && scene.stress.is_some() && criterion.is_some();
    let seen_at_end = D == 3 && scene.output.pictures && !staged;
    let flagged = scene.output.pictures && scene.output.flags;
    let flagged = if flagged { observed.flags(&*body.bonds, &state) } else { None };
    let flagged: Option<Vec<f64>> =
        flagged.map(|flags| flags.iter().map(|flags| f64::from(u8::from(flags.any()))).collect());
    let damage = if seen_at_end && flagged.is_none() { frames.damage(&*body.bonds) } else { None };
    let cracks = frames.damage_of_cracks();
    frames.finish(&*body.bonds, &state, &stresses)?;
    if scene.output.pictures {
        draw::maps(scene, &*body.bonds, &state, &stresses.cauchy, &outcome, output)?;
        if let Some(values) = flagged.as_ref().filter(|_| D == 2) {
            draw::flagged(&*body.bonds, &state, values, &outcome, output)?;
        }
        if staged {
            stages::stages(scene, &outcome, (body.bonds.spacing(), cracks), &path, output)?;
        } else if seen_at_end {
            let damage = damage.map(|damage| (solid::damage_field(), damage));
            let second = flagged.map(|flagged| (solid::flagged_field(), flagged)).or(damage);
            solid::end(scene, &*body.bonds, &state, &stresses, second, &outcome, output)?;
        }
    }
    Ok((outcome, ended))
}

/// All that a variant is before it is solved.
struct Built<const D: usize> {
    bonded: Bonded<D>,
    loads: Loads<D>,
    /// Sites in any loading layer.
    loaded: Vec<bool>,
    /// Particles of grips that are tied at their surface, by site.
    held: Option<Vec<bool>>,
    probes: Probes<D>,
    sections: Sections<D>,
}

impl<const D: usize> Built<D> {
    fn new(source: &Source, scene: &Scene, variant: &Variant) -> Result<Self, Failure> {
        let mut body = body_of::<D>(source, scene, variant)?;
        // before the loads: tractions act on the areas that it leaves
        if scene.material.solid.is_some()
            && let Some(theta) = relief(&*body.bonds)
        {
            body.bonds.set_relief(theta);
        }
        let (loads, loaded) = loads_of(source, scene, &body)?;
        scene::check_placement(source, scene, &body, &loads)?;
        let held = scene::tied_grips(source, scene, &*body.bonds, &loads)?;
        if let Some(held) = &held {
            let list = crate::contact::across(&*body.bonds, held);
            body.bonds.sever(&list);
        }
        let probes = Probes::new(source, scene, &body)?;
        let sections = Sections::new(source, &scene.output.section, &body)?;
        lines::check(source, &scene.output.line, &*body.bonds)?;
        let bonded = Bonded::new(source, scene, variant, body)?;
        Ok(Self { bonded, loads, loaded, held, probes, sections })
    }
}

/// What is solved and does not change.
struct Solution<'a, const D: usize> {
    material: &'a Acting<D>,
    observed: &'a Observed<'a, D>,
    loads: &'a Loads<D>,
    probes: &'a Probes<D>,
    sections: &'a Sections<D>,
    criterion: Option<&'a Criterion>,
    stiffness: &'a Property,
    held: Option<&'a [bool]>,
}

fn solve<const D: usize>(
    (source, scene): (&Source, &Scene),
    solution: &Solution<D>,
    under_way: &UnderWay,
    body: &mut scene::Body<D>,
    state: &mut State<D>,
    phases: &mut Phases,
    frames: &mut Frames<D>,
) -> Result<(), Failure> {
    let Solution { material, observed, loads, probes, sections, criterion, stiffness, held } = *solution;
    let factors = scene.solver.factors();
    let mut watch = |status: &Status, state: &State<D>| under_way.watch(status, state);
    let contact = match &scene.contact {
        Some(contact) => {
            let planes = contact.planes(source, scene.dynamics.is_some()).map_err(Failure::from)?;
            let whole = material.longitudinal_modulus(&*body.bonds);
            let modulus = Property::new(&*body.bonds, |site, _| whole * stiffness.at(site));
            let tied = held.map(|held| (held, contact.tie_stiffness(scene.dynamics.is_some())));
            Some(contact.contact(planes, body, material.micromodulus(&*body.bonds), &modulus, tied)?)
        }
        None => None,
    };
    let course = scene.dynamics.as_ref().and_then(|dynamics| dynamics.factor.as_ref());
    let course = course.map(|formula| |time: f64| formula.in_time(time));
    let observer = |bonds: &dyn Bonds<D>, state: &State<D>| {
        let mut seen = probes.see(bonds, state, observed);
        seen.extend(observed.flagged(bonds, state).into_iter().flatten());
        seen.extend(sections.see(bonds, state, observed));
        seen
    };
    let sees = !scene.probe.is_empty() || !scene.output.section.is_empty() || scene.is_learnt();
    let response = material.respond(&*body.bonds);
    let mut system = System::of_response(&mut *body.bonds, response, loads, &factors);
    system.course = course.as_ref().map(|course| course as _);
    system.observer = sees.then_some(&observer as _);
    system.fit_bound = scene.fit_bound();
    system.breaking =
        criterion.map(|criterion| Breaking { criterion: criterion.clone(), policy: scene.solver.breaking });
    system.contact = contact;
    (system.refine, system.snap_back) = (scene.solver.refine, scene.solver.snap_back);
    system.stop_below = scene.solver.stop_below.unwrap_or(0.0);
    phases.start("solve");
    let mut finished = |bonds: &dyn Bonds<D>, state: &State<D>| {
        phases.stop();
        frames.step(bonds, state, phases)?;
        if state.control.round == 0 {
            under_way.step(|| seen(bonds, state));
        }
        phases.start("solve");
        Ok(())
    };
    let solved = match &scene.dynamics {
        Some(dynamics) => dynamics.method().solve(&mut system, state, &mut watch, &mut finished),
        None => load_stepping(&mut *scene.equilibria(), &mut system, state, &mut watch, &mut finished),
    };
    phases.stop();
    Ok(solved?)
}

/// A finished step, as who watches the run sees it: positions and displacements in three components.
fn seen<const D: usize>(bonds: &dyn Bonds<D>, state: &State<D>) -> Step {
    let Some(record) = state.history.last() else { return Step::default() };
    let of_particles = |name, get: &dyn Fn(usize) -> [f64; D]| {
        let each = bonds.particles().iter().flat_map(|&site| frames::in_space(get(site as usize)));
        StepField { name, unit: "m", components: 3, data: each.collect() }
    };
    Step {
        values: Record::SCALARS.map(|(name, unit, get)| (name, unit, get(record))).to_vec(),
        fields: vec![
            of_particles("position", &|site| bonds.position(site)),
            of_particles("displacement", &|site| state.displacement.get(site)),
        ],
    }
}

/// An iteration in a line.
fn line_of(status: &Status) -> String {
    let Status { step, steps, iteration, residual, load, broken, .. } = *status;
    let broken = if broken > 0 { format!("  broken {broken}") } else { String::new() };
    let load = load.map_or(String::new(), |load| format!("  load {load:.4e} N before"));
    format!("step {}/{steps}{broken}  iteration {iteration}  residual {residual:.2e}{load}", step + 1)
}

/// The part of a variant that is done, 0 to 1: residuals fall by powers of ten.
fn part_of(status: &Status) -> f64 {
    let decades = (1.0 / status.tolerance).log10();
    let done = (-status.residual.log10()).clamp(0.0, decades) / decades;
    (status.step as f64 + done) / status.steps as f64
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
    let variants = scene::check(source, scene, quick)?;
    let lengths = scene::free_lengths::<D>(&variants)?;
    for variant in variants {
        if let Some(error) = &variant.of.expect_error {
            lines.push(format!("variant {}\n  expects    an error that contains `{error}`", variant.name()));
            continue;
        }
        let (source, scene) = variant.resolved();
        let built = Built::<D>::new(source, scene, &variant)?;
        let Bonded { body, criterion, toughness, followed, .. } = &built.bonded;
        lines.extend(scene::explain(source, scene, &variant, body, criterion.as_ref())?);
        lines.extend(scene::explain_tearing(scene, body, toughness.as_ref()));
        lines.extend(followed.iter().map(|one| format!("  follows    {one}")));
    }
    lines.extend(lengths.into_iter().map(|text| format!("  warning    {text}")));
    Ok(lines)
}
