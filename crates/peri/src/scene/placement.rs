//! What a scene names beside its body must lie where the body is: a closed form's hole, displacements of the loads.

use super::build::Body;
use super::{ExactSpec, Scene};
use crate::solver::Loads;
use polycore::scene::{SceneError, Source};

/// Checks what only the body and its loads can tell.
///
/// # Errors
/// A hole of `[exact]` that the body does not have; a load asked for at a displacement that is never reached.
pub fn check_placement<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &Body<D>,
    loads: &Loads<D>,
) -> Result<(), SceneError> {
    if let Some(ExactSpec::Kirsch { radius, .. }) = &scene.exact {
        hole(source, body, radius.si())?;
    }
    let reach = loads.reach(&*body.bonds);
    // under forces alone nobody knows before the run how far they get
    let beyond = |at: f64| reach > 0.0 && at > reach * (1.0 + 1e-9);
    match scene.output.load_at.iter().position(|at| beyond(at.si())) {
        Some(index) => {
            let found = format!("{} m, beyond the last displacement", scene.output.load_at[index].si());
            Err(source.error(&format!("output.load_at[{index}]"), found, format!("up to {reach} m")))
        }
        None => Ok(()),
    }
}

/// No particle inside the radius, and some at the rim.
fn hole<const D: usize>(source: &Source, body: &Body<D>, radius: f64) -> Result<(), SceneError> {
    let places = body.bonds.particles().iter().map(|&slot| body.bonds.position(slot as usize));
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
