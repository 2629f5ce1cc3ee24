//! Checks that need the body and its loads: the hole of `[exact]`, displacements of `output.load_at`, planes.

use super::region::layers;
use super::values::DiscreteBody;
use super::{ExactSpec, Scene, Side};
use crate::contact::RigidSurface;
use crate::exact::Plate;
use crate::solver::Loads;
use harness::scene::{SceneError, Source};

/// Checks what needs the body and its loads.
///
/// # Errors
/// A hole of `[exact]` that the body lacks; a load at a displacement that is never reached; planes.
pub fn check_placement<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
    loads: &Loads<D>,
) -> Result<(), SceneError> {
    if let Some(exact) = &scene.exact {
        check_hole(source, body, exact.hole().0)?;
    }
    plate_frame(source, scene, body)?;
    check_surfaces(source, scene, body)?;
    let surfaces = scene.contact.as_ref().map_or(Ok(Vec::new()), |own| own.surfaces(source, scene))?;
    let rigid: Vec<[f64; D]> = surfaces.iter().flat_map(RigidSurface::path).collect();
    let reach = loads.reach(&*body.bonds, &rigid);
    // the displacement under forces is unknown before the run
    let beyond = |at: f64| reach > 0.0 && at > reach * (1.0 + 1e-9);
    for (key, list) in [("load_at", &scene.output.load_at), ("stiffness_at", &scene.output.stiffness_at)] {
        if let Some(index) = list.iter().position(|at| beyond(at.si())) {
            let found = format!("{} m, beyond the last displacement", list[index].si());
            return Err(source.error(&format!("output.{key}[{index}]"), found, format!("up to {reach} m")));
        }
    }
    Ok(())
}

/// Checks the places of rigid surfaces during a step.
///
/// # Errors
/// A surface inside the body, planes without room between them, steps too long for an indenter.
pub fn check_surfaces<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
) -> Result<(), SceneError> {
    super::planes::check(source, scene, body)?;
    super::indenter_place::check(source, scene, body)
}

/// Returns half the edges of the plate of `[exact]` and the width of its loaded layers, m; `None` for other
/// problems.
fn plate_frame<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
) -> Result<Option<([f64; 2], f64)>, SceneError> {
    let Some(exact @ ExactSpec::PlateWithHole { .. }) = &scene.exact else { return Ok(None) };
    let (low, high) = &body.bounds;
    let half = [0.5 * (high[0] - low[0]), 0.5 * (high[1] - low[1])];
    if (0..2).any(|d| (low[d] + high[d]).abs() > 1e-6 * half[d]) {
        let found = format!("a body from {low:?} to {high:?} m");
        return Err(source.error("exact.problem", found, "a rectangle about the origin"));
    }
    let only = "the sides x+ and x- with tractions ± `exact.remote_stress` along x, and no other condition";
    if !scene.body_force.is_empty() {
        return Err(source.error("body_force", "a force that `plate-with-hole` does not have", only));
    }
    let mut widths = [0.0; 2];
    for (index, boundary) in scene.boundary.iter().enumerate() {
        let sign = match boundary.side {
            Some(Side::XHigh) => 1.0,
            Some(Side::XLow) => -1.0,
            _ => f64::NAN,
        };
        let traction = boundary.traction.iter().flatten().map(|t| t.si());
        let wanted = [sign * exact.hole().1, 0.0];
        let has_more = boundary.force.is_some()
            || boundary.traction_field.is_some()
            || boundary.pressure.is_some()
            || boundary.rigid
            || boundary.prescribes_displacement()
            || boundary.prescribes_velocity();
        if !traction.eq(wanted) || has_more {
            let found = "a condition that `plate-with-hole` does not have";
            return Err(source.error(&format!("boundary[{index}]"), found, only));
        }
        widths[usize::from(sign < 0.0)] = layers(boundary, &*body.bonds) as f64 * body.bonds.spacing();
    }
    if widths[0] != widths[1] {
        let found = format!("layers of {} and {} m at x+ and x-", widths[0], widths[1]);
        return Err(source.error("boundary", found, "tractions on both, in layers of one width"));
    }
    Ok(Some((half, widths[0])))
}

/// Returns the exact stresses of the plate of `[exact]`, with the width of the scene's loaded layers.
///
/// # Errors
/// As [`check_placement`].
pub fn exact_plate<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
) -> Result<Option<Plate>, SceneError> {
    let Some((half, layer)) = plate_frame(source, scene, body)? else { return Ok(None) };
    let radius = scene.exact.as_ref().map_or(0.0, |exact| exact.hole().0);
    let plate = Plate::new(radius, half, layer).ok_or_else(|| {
        let found =
            format!("a radius of {radius} m in a plate of half edges {half:?} m, loaded layers of {layer} m");
        source.error("exact.radius", found, "a hole that neither an edge nor a loaded layer touches")
    })?;
    Ok(Some(plate))
}

/// Refuses a hole radius that contains a particle or has none at the rim.
fn check_hole<const D: usize>(
    source: &Source,
    body: &DiscreteBody<D>,
    radius: f64,
) -> Result<(), SceneError> {
    let places = body.bonds.particles().iter().map(|&site| body.bonds.position(site as usize));
    let distance = |place: &[f64; D]| place[0].hypot(place[1]);
    let Some(nearest) = places.min_by(|a, b| distance(a).total_cmp(&distance(b))) else { return Ok(()) };
    let rim = radius + 1.5 * body.bonds.spacing();
    if (radius * (1.0 - 1e-9)..=rim).contains(&distance(&nearest)) {
        return Ok(());
    }
    let [x, y] = [nearest[0], nearest[1]].map(|x| (x * 1e9).round() / 1e9);
    let found = format!("{radius} m, but the particle nearest the origin is at ({x}, {y}) m");
    Err(source.error("exact.radius", found, "the radius of a hole that the body has at the origin"))
}
