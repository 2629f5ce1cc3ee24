//! Steps of a programme in sequence: the scene's own blocks are the first, each `[[step]]` is a later one.

use super::check::check_variant;
use super::loads::{name_of, own_region_names};
use super::{
    BodyForceSpec, Boundary, ContactSpec, CrackSpec, DeviceChoice, Dynamics, Prescribed, Scene, SolverMethod,
    SolverSpec,
};
use super::{TimeProgramSpec, common_amplitude, crack};
use crate::bonds::Bonds;
use crate::geometry::Cut;
use crate::solver::Rotation;
use harness::scene::{SceneError, Source};
use serde::Deserialize;
use std::borrow::Cow;

/// Later step, from the state at the end of the one before.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StepSpec {
    /// Loads and supports; a region that the step does not name is free.
    #[serde(default)]
    pub boundary: Vec<Boundary>,
    /// Gravity, centrifugal and other body forces.
    #[serde(default)]
    pub body_force: Vec<BodyForceSpec>,
    /// Solver settings; default: as in a scene without `[solver]`.
    pub solver: Option<SolverSpec>,
    /// Ramps and holds of a quasi-static step in time.
    pub time: Option<TimeProgramSpec>,
    /// Explicit dynamics in this step.
    pub dynamics: Option<Dynamics>,
    /// Cracks that appear at the start.
    #[serde(default)]
    pub cracks: Vec<CrackSpec>,
}

/// Steps before a later one.
#[derive(Clone, Copy, Debug, Default)]
pub struct EarlierSteps {
    /// Their time, s, and that of explicit dynamics among them.
    pub(super) time: f64,
    pub(super) moving: f64,
    /// Load factor at the end of the first step, at which rigid surfaces without a curve stay.
    pub(super) factor: f64,
    /// True if any step of the scene is explicit dynamics.
    explicit: bool,
}

/// Keys of a step and the keys of the scene in whose place they are.
const KEYS: [[&str; 2]; 6] = [
    ["boundary", "boundary"],
    ["body_force", "body_force"],
    ["solver", "solver"],
    ["time", "time"],
    ["dynamics", "dynamics"],
    ["cracks", "body.cracks"],
];

impl Scene {
    /// Returns a source whose errors about a step, from 0, point at it.
    pub fn source_of<'a>(&self, source: &'a Source, index: usize) -> Cow<'a, Source> {
        let Some(at) = index.checked_sub(1) else { return Cow::Borrowed(source) };
        let replaced =
            |own: Source, [name, key]: [&str; 2]| own.with_replaced_first(key, &format!("step[{at}].{name}"));
        Cow::Owned(KEYS.into_iter().fold(source.clone(), replaced))
    }

    /// Returns the scene of a step, from 0.
    pub fn stage(&self, index: usize) -> Cow<'_, Self> {
        let Some(step) = index.checked_sub(1).and_then(|at| self.step.get(at)) else {
            return Cow::Borrowed(self);
        };
        let mut scene = self.clone();
        let StepSpec { boundary, body_force, solver, time, dynamics, cracks } = step.clone();
        let explicit = dynamics.is_some().then_some(SolverMethod::Verlet);
        (scene.boundary, scene.body_force) = (boundary, body_force);
        (scene.time, scene.dynamics) = (time, dynamics);
        scene.solver = solver.unwrap_or_default();
        scene.solver.method = scene.solver.method.or(explicit);
        (scene.body.cracks, scene.step, scene.later) = (cracks, Vec::new(), true);
        let later = || self.step[..index - 1].iter().map(|own| (&own.time, &own.dynamics));
        let all = || std::iter::once((&self.time, &self.dynamics)).chain(later());
        let time = all().map(|(time, dynamics)| duration(time.as_ref(), dynamics.as_ref())).sum();
        let moving = all().map(|(_, dynamics)| duration(None, dynamics.as_ref())).sum();
        let (factor, explicit) = (self.last_factor(), self.has_dynamics());
        scene.earlier = EarlierSteps { time, moving, factor, explicit };
        Cow::Owned(scene)
    }

    /// Returns the load factor at the end of the step.
    fn last_factor(&self) -> f64 {
        let last = self.programme().0.last().copied().unwrap_or(1.0);
        if self.dynamics.is_some() { common_amplitude(self).multiple(1.0) } else { last }
    }

    /// Returns true if any step of the scene is explicit dynamics.
    pub fn has_dynamics(&self) -> bool {
        self.earlier.explicit || self.dynamics.is_some() || self.step.iter().any(|own| own.dynamics.is_some())
    }

    /// Returns the scene of the last step.
    pub fn at_end(&self) -> Cow<'_, Self> {
        self.stage(self.step.len())
    }
}

/// Returns the time of a step, s; 0 without times.
pub(super) fn duration(time: Option<&TimeProgramSpec>, dynamics: Option<&Dynamics>) -> f64 {
    let ramps = time.iter().flat_map(|time| &time.step).map(|own| own.duration.si()).sum();
    dynamics.map_or(ramps, |dynamics| dynamics.end_time.si())
}

/// Returns the cuts of a later step.
///
/// # Errors
/// As [`super::body_of`], and a crack that severs no bond.
pub fn step_cuts<const D: usize>(
    source: &Source,
    scene: &Scene,
    bonds: &dyn Bonds<D>,
) -> Result<Vec<Cut<D>>, SceneError> {
    let cuts = crack::cracks(source, scene)?;
    crack::severed(source, bonds, &cuts)?;
    Ok(cuts)
}

/// Checks the steps of a scene.
///
/// # Errors
/// A [`SceneError`] that names the key, the value found and what is allowed.
pub(super) fn check(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    let held = |boundary: &Boundary| boundary.displacement.iter().flatten().any(|u| *u == Prescribed::Hold);
    if let Some(index) = scene.boundary.iter().position(held).filter(|_| !scene.later) {
        let key = format!("boundary[{index}].displacement");
        return Err(source.error(&key, "`hold`", "a length or `free`; `hold` is for a later [[step]]"));
    }
    if scene.step.is_empty() {
        return Ok(());
    }
    if let Some(contact) = &scene.contact {
        refuse_in_contact(source, scene, contact)?;
    }
    refuse_other_axes(source, scene)?;
    for index in 0..=scene.step.len() {
        let (source, scene) = (scene.source_of(source, index), scene.stage(index));
        if scene.solver.refine > 1 || scene.solver.snap_back {
            let name = if scene.solver.snap_back { "snap_back" } else { "refine" };
            let why = "not available with [[step]]";
            return Err(source.unexpected(&format!("solver.{name}"), why));
        }
        let surfaces = scene.contact.as_ref().is_some_and(ContactSpec::has_surfaces);
        if surfaces && scene.solver.stop_below.is_some() {
            let why =
                "not available with [[step]] and rigid surfaces: each has its place at the end of a step";
            return Err(source.unexpected("solver.stop_below", why));
        }
        if scene.solver.device == Some(DeviceChoice::Gpu) {
            let allowed = "`\"cpu\"` or `\"auto\"` with [[step]]: the processor takes all steps";
            return Err(source.error("solver.device", "\"gpu\"", allowed));
        }
        if scene.is_mixed() {
            let why = "all steps of a run have one precision";
            return Err(source.error("dynamics.precision", why, "`double` with [[step]]"));
        }
        if let Some(at) = scene
            .boundary
            .iter()
            .position(|own| own.name.is_none() && own.side.is_none() && own.set.is_none())
        {
            let why = "needed with [[step]]: the name identifies a region in all steps";
            return Err(source.missing(&format!("boundary[{at}].name"), why));
        }
        let names = own_region_names(&scene.boundary);
        if let Some(name) =
            names.iter().enumerate().find_map(|(k, name)| names[..k].contains(name).then_some(name))
        {
            let found = format!("two regions `{name}`");
            return Err(source.error("boundary", found, "different names within a step"));
        }
        if index == 0 {
            continue;
        }
        if let Some(time) = &scene.time
            && scene.programme().0.last() != Some(&1.0)
        {
            let key = format!("time.step[{}].factor", time.step.len().max(1) - 1);
            let found = "a load factor that does not end at 1";
            let allowed = "1 at the end: loads of the step reach their values and those of the step before \
                           end with it";
            return Err(source.error(&key, found, allowed));
        }
        if scene.dynamics.as_ref().is_some_and(|dynamics| dynamics.device != DeviceChoice::Cpu) {
            return Err(source.error("dynamics.device", "a graphics card in a later step", "`cpu`"));
        }
        check_variant(&source, &scene)?;
    }
    Ok(())
}

/// Refuses a rotation of a region about another axis than that about which the step before has turned it.
fn refuse_other_axes(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    let near = 1e-9 * scene.body.spacing.map_or(1e-3, |spacing| spacing.si());
    let mut turned: Vec<(String, Rotation<3>)> = Vec::new();
    for index in 0..=scene.step.len() {
        let (source, scene) = (scene.source_of(source, index), scene.stage(index));
        let mut now = Vec::new();
        for (at, boundary) in scene.boundary.iter().enumerate() {
            let name = name_of(at, boundary);
            let before = turned.iter().find(|(own, _)| *own == name).map(|(_, rotation)| *rotation);
            let Some(rotation) = &boundary.rotation else {
                now.extend(before.filter(|_| boundary.held_in_place() != 0).map(|own| (name, own)));
                continue;
            };
            let rotation = rotation.in_space();
            let differs = |before: &Rotation<3>| !rotation.shares_axis(before, near);
            if let Some(before) = before.filter(differs) {
                let [point, axis] = [before.centre.map(|x| x * 1e3), before.axis].map(|x| format!("{x:?}"));
                let found =
                    format!("another axis than that of the step before, through {point} mm along {axis}");
                let allowed = "the axis of the step before; another one once the region is turned back to 0°";
                return Err(source.error(&format!("boundary[{at}].rotation"), found, allowed));
            }
            if rotation.angle != 0.0 {
                now.push((name, rotation));
            }
        }
        turned = now;
    }
    Ok(())
}

/// Refuses what rigid surfaces do not carry over to the next step.
fn refuse_in_contact(source: &Source, scene: &Scene, contact: &ContactSpec) -> Result<(), SceneError> {
    let pushed = contact.indenter.iter().position(|own| own.force.is_some());
    if let Some(index) = pushed.filter(|_| scene.has_dynamics()) {
        let why = "a step is explicit dynamics: move the indenter by `displacement`";
        return Err(source.unexpected(&format!("contact.indenter[{index}].force"), why));
    }
    if contact.tied_grips == Some(true) {
        return Err(source.conflict("contact.tied_grips", "step", "each step holds regions of its own"));
    }
    Ok(())
}
