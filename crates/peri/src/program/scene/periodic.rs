//! Periodic sides of a body, and the mean deformation of the cell between them.

use super::{AxisName, Scene, Track};
use crate::calibrate::Space;
use crate::geometry::{Gaps, Lattice};
use crate::stress::StressMethod;
use harness::scene::{SceneError, Source};
use serde::Deserialize;

/// Distance of a period from a whole number of spacings, over the spacing, that counts as rounding.
const ROUNDING: f64 = 1e-6;

/// Axes along which the body repeats itself, and its mean deformation.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PeriodicSpec {
    /// Axes: the body continues beyond its sides there, with its extent as period.
    pub axes: Vec<AxisName>,
    /// Mean displacement gradient H at load factor 1, row by row: a period e along x of the deformed body is
    /// (1 + H) e. Columns of other axes are 0. Default: 0.
    pub gradient: Option<Vec<Vec<f64>>>,
}

impl Scene {
    /// Returns true for each axis with periodic sides.
    pub fn periodic_axes<const D: usize>(&self) -> [bool; D] {
        let axes = || self.periodic.iter().flat_map(|periodic| &periodic.axes);
        std::array::from_fn(|d| axes().any(|axis| axis.index() == d))
    }

    /// Returns the mean displacement gradient of a cell with periodic sides at load factor 1, if it is
    /// prescribed.
    pub fn mean_gradient<const D: usize>(&self) -> Option<[[f64; D]; D]> {
        let rows = self.periodic.as_ref()?.gradient.as_ref()?;
        let entry = |a: usize, b: usize| rows.get(a).and_then(|row| row.get(b)).copied().unwrap_or(0.0);
        Some(std::array::from_fn(|a| std::array::from_fn(|b| entry(a, b))))
    }
}

/// Checks periodic sides, and refuses what is not available with them.
///
/// # Errors
/// A [`SceneError`] that names the key, the value found and what is allowed.
pub(super) fn check(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    let Some(periodic) = &scene.periodic else { return Ok(()) };
    let dimension = if scene.body.space == Space::Solid { 3 } else { 2 };
    let known = |axis: &AxisName| axis.index() < dimension;
    let again = |(index, axis): (usize, &AxisName)| periodic.axes[..index].contains(axis);
    let axes = || periodic.axes.iter();
    if periodic.axes.is_empty() || !axes().all(known) || axes().enumerate().any(again) {
        let allowed = format!("one to {dimension} axes of the body, each once, e.g. `[\"x\"]`");
        let named: Vec<&str> = axes().map(|axis| ["x", "y", "z"][axis.index()]).collect();
        return Err(source.error("periodic.axes", format!("{named:?}"), allowed));
    }
    if let Some(rows) = &periodic.gradient {
        let good = rows.len() == dimension && rows.iter().all(|row| row.len() == dimension);
        if !good || rows.iter().flatten().any(|entry| entry.is_nan() || entry.abs() >= 1e3) {
            let allowed = format!("{dimension} rows of {dimension} numbers between −1000 and 1000");
            return Err(source.error("periodic.gradient", format!("{rows:?}"), allowed));
        }
        let other =
            |d: &usize| axes().all(|axis| axis.index() != *d) && rows.iter().any(|row| row[*d] != 0.0);
        if let Some(d) = (0..dimension).find(other) {
            let found = format!("a column {} that is not 0 without periodic sides there", d + 1);
            return Err(source.error("periodic.gradient", found, "0: the body is free to deform along it"));
        }
    }
    refuse_blocks(source, scene, periodic)?;
    refuse_boundaries(source, scene)
}

fn refuse_blocks(source: &Source, scene: &Scene, periodic: &PeriodicSpec) -> Result<(), SceneError> {
    let solid = scene.material.solid.is_some();
    let own = if solid { StressMethod::Constitutive } else { StressMethod::OnePoint };
    let measures = || scene.stress.iter().flat_map(|stress| &stress.measures);
    let along = |axis: AxisName| scene.periodic_axes::<3>()[axis.index()];
    let tracked = |probe: &super::HistoryProbe| match probe.track {
        Track::Displacement | Track::Strain | Track::Opening => false,
        Track::Crack | Track::Front => probe.axis.is_none_or(along),
        _ => true,
    };
    let spin = scene.body_force.iter().position(|force| force.spin.is_some());
    let spin_key = format!("body_force[{}].spin", spin.unwrap_or(0));
    let (device, _, block) = scene.device();
    let device_key = format!("{block}.device");
    let refused = [
        ("body.points", scene.body.points.is_some()),
        ("body.grid", scene.body.grid.is_some()),
        ("contact", scene.contact.is_some()),
        ("interface", !scene.interface.is_empty()),
        (spin_key.as_str(), spin.is_some()),
        ("exact", scene.exact.is_some()),
        ("output.section", !scene.output.section.is_empty()),
        ("output.line", !scene.output.line.is_empty()),
        ("material.critical.convention", scene.softens()),
        ("material.inclusions", scene.material.is_prestrained()),
        (device_key.as_str(), device == super::DeviceChoice::Gpu),
    ];
    if let Some((key, _)) = refused.into_iter().find(|(_, given)| *given) {
        let why = match key {
            "material.inclusions" => "prestrained parts are not available with periodic sides",
            "material.critical.convention" => "bonds that soften are not available with periodic sides",
            _ => "not available with periodic sides",
        };
        return Err(source.conflict(key, "periodic", why));
    }
    let strained = [
        ("dynamics", scene.dynamics.is_some(), "only equilibria have a mean deformation"),
        (
            "body_force",
            !scene.body_force.is_empty(),
            "forces of the body would do work beside the mean stress",
        ),
        ("step", !scene.step.is_empty(), "a mean deformation has one step"),
        ("time", scene.time.is_some(), "a mean deformation has no time"),
    ];
    let conflict = strained.into_iter().find(|(_, given, _)| *given && periodic.gradient.is_some());
    if let Some((key, _, why)) = conflict {
        return Err(source.conflict(key, "periodic.gradient", why));
    }
    if let Some(index) = measures().position(|&measure| measure != own) {
        let key = format!("stress.measures[{index}]");
        let allowed = format!("`{}`: others see no particles beyond periodic sides", own.name());
        return Err(source.error(&key, "a measure of neighbouring bonds", allowed));
    }
    if let Some(index) = scene.probe.iter().position(tracked) {
        let key = format!("probe[{index}].track");
        let found = "a probe of rotations or J, or of a crack or wave along a periodic axis";
        return Err(source.error(
            &key,
            found,
            "with periodic sides: displacement, strain, opening; a crack or front along another axis",
        ));
    }
    Ok(())
}

fn refuse_boundaries(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    let axes = scene.periodic_axes::<3>();
    for (index, boundary) in scene.boundary.iter().enumerate() {
        let refused = [
            ("side", boundary.side.is_some_and(|side| axes[side.axis().0])),
            ("pressure", boundary.pressure.is_some()),
            ("rotation", boundary.rotation.is_some()),
            ("rigid", boundary.rigid),
            ("curve", boundary.has_curve() && scene.mean_gradient::<3>().is_some()),
        ];
        if let Some((name, _)) = refused.into_iter().find(|(_, given)| *given) {
            let why = if name == "side" {
                "a periodic side has no end of the body; `min` and `max` name particles"
            } else {
                "not available with periodic sides"
            };
            return Err(source.conflict(&format!("boundary[{index}].{name}"), "periodic", why));
        }
        let strained = |d: usize| {
            let rows = scene.periodic.iter().flat_map(|periodic| periodic.gradient.iter().flatten());
            rows.skip(d).take(1).flatten().any(|&entry| entry != 0.0)
        };
        if let Some(name) = (0..3).filter(|&d| strained(d)).find_map(|d| boundary.acts_along(d)) {
            let why = "components that the mean deformation moves are free";
            return Err(source.conflict(&format!("boundary[{index}].{name}"), "periodic.gradient", why));
        }
    }
    Ok(())
}

/// Refuses a body whose extent along a periodic axis is no whole number of spacings, or whose gaps would have
/// to be followed across its sides.
///
/// # Errors
/// As [`check`].
pub(super) fn check_body<const D: usize>(
    source: &Source,
    scene: &Scene,
    (low, high): ([f64; D], [f64; D]),
    (lattice, ratio): (&Lattice<D>, f64),
    severs: bool,
) -> Result<(), SceneError> {
    let axes = scene.periodic_axes::<D>();
    if axes == [false; D] {
        return Ok(());
    }
    let spacing = lattice.spacing;
    let whole = |d: usize| {
        let count = (high[d] - low[d]) / spacing;
        (count - count.round()).abs() <= ROUNDING
    };
    if let Some(d) = (0..D).find(|&d| axes[d] && !whole(d)) {
        let found = format!(
            "{spacing} m, of which {} m along {} is no multiple",
            high[d] - low[d],
            ["x", "y", "z"][d]
        );
        return Err(source.error("body.spacing", found, "a whole fraction of the period"));
    }
    let layers = axes.map(|periodic| if periodic { ratio.floor() as usize } else { 0 });
    let parted = || {
        let (mut repeated, copies) = lattice.clone().widened(layers);
        copies.iter().for_each(|[copy, _]| repeated.occupied[*copy] = true);
        Gaps::of_cells(&repeated).is_some()
    };
    if severs || (scene.body.bond_gaps != Some(true) && parted()) {
        let found = "gaps: parts that do not touch, also across sides, or cut-outs narrower than the horizon";
        let allowed = "with periodic sides none, or `body.bond_gaps = true`";
        return Err(source.error("body.shapes", found, allowed));
    }
    Ok(())
}
