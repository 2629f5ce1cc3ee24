//! Checks of indenters against the body: outside of it at the start, resolved, and something to press on.

use super::indenter::refuse_leap;
use super::values::{DiscreteBody, plain};
use super::{Boundary, Prescribed, PrescribedField, Scene, SolverMethod};
use crate::contact::{RigidSurface, SurfaceShape};
use crate::geometry::length;
use harness::scene::{SceneError, Source};

/// Least radius of an indenter in spacings: a smaller one passes between the faces of the body.
const LEAST_RADIUS: f64 = 2.0;
/// Overlap of an indenter and the surface of the body at the start, in spacings, up to which it counts as
/// touch: faces of a round body stand out by less.
const TOUCHES: f64 = 0.1;

/// Returns true if a boundary prescribes the displacement along an axis.
fn holds(boundary: &Boundary, axis: usize) -> bool {
    let prescribed = boundary.displacement.as_ref().and_then(|each| each.get(axis));
    let by_field = boundary.displacement_field.as_ref().and_then(|each| each.get(axis));
    prescribed.is_some_and(|own| *own != Prescribed::Free)
        || by_field.is_some_and(|own| *own != PrescribedField::Free)
        || boundary.rotation.is_some()
}

/// Returns the directions in which rigid surfaces may push a body, at the start and at load factor 1; one
/// with a force of its own stops nothing.
pub(super) fn stops<const D: usize>(surfaces: &[RigidSurface<D>], body: &DiscreteBody<D>) -> Vec<[f64; D]> {
    let bonds = &body.bonds;
    let centres: Vec<[f64; D]> =
        bonds.particles().iter().map(|&site| bonds.position(site as usize)).collect();
    let standing = surfaces.iter().filter(|surface| surface.force.is_none());
    let shifts = standing.flat_map(|surface| [[0.0; D], surface.displacement].map(|shift| (surface, shift)));
    shifts.flat_map(|(surface, shift)| surface.stops(&shift, &centres, 0.5 * bonds.spacing())).collect()
}

/// Checks indenters against the body: its surface must be resolved, and something must hold it.
///
/// # Errors
/// A [`SceneError`] that names the key, the value found and what is allowed.
pub(super) fn check<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
) -> Result<(), SceneError> {
    let Some(contact) = &scene.contact else { return Ok(()) };
    let surfaces = contact.surfaces::<D>(source, scene.method() == SolverMethod::Verlet)?;
    let (spacing, outside) = (body.bonds.spacing(), body.surface());
    let held =
        if surfaces.iter().any(|own| own.force.is_some()) { stops(&surfaces, body) } else { Vec::new() };
    for (number, surface) in surfaces.iter().enumerate().skip(contact.plane.len()) {
        let index = number - contact.plane.len();
        let key = |name: &str| format!("contact.indenter[{index}].{name}");
        let name = contact.indenter[index].name(index);
        if let SurfaceShape::Sphere(radius) | SurfaceShape::Cylinder(_, radius) = surface.shape
            && radius < LEAST_RADIUS * spacing
        {
            let allowed = format!(
                "at least {} mm, {LEAST_RADIUS} spacings: a smaller one passes between the faces of the body",
                plain(LEAST_RADIUS * spacing * 1e3)
            );
            return Err(source.error(&key("radius"), format!("{} mm", plain(radius * 1e3)), allowed));
        }
        if let SurfaceShape::Facets(facets) = &surface.shape {
            let (low, high) = facets.body().facets().bounds();
            let least = (0..D).map(|d| high[d] - low[d]).fold(f64::INFINITY, f64::min);
            if least < 2.0 * LEAST_RADIUS * spacing {
                let found = format!("a surface {} mm across", plain(least * 1e3));
                let allowed = format!(
                    "at least {} mm, {} spacings: a smaller one passes between the faces of the body",
                    plain(2.0 * LEAST_RADIUS * spacing * 1e3),
                    2.0 * LEAST_RADIUS
                );
                return Err(source.error(&key("file"), found, allowed));
            }
            refuse_leap(source, scene, (index, &contact.indenter[index]), 0.5 * least, "half its width")?;
        }
        let particles = body.bonds.particles();
        let height = |&site: &u32| surface.height(body.bonds.position(site as usize));
        let heights: Vec<f64> = particles.iter().map(height).collect();
        let behind = heights.iter().filter(|height| **height < -1e-6 * spacing).count();
        if behind > 0 && surface.force.is_none() {
            let found = format!("{behind} of {} particles inside indenter `{name}`", particles.len());
            return Err(source.error(&key("point"), found, "an indenter outside the body at the start"));
        }
        let faces = outside.faces().iter().map(|face| surface.height(face.place));
        let lowest = faces.fold(f64::INFINITY, f64::min);
        // a cloud has no faces
        let of_particles = || heights.iter().copied().fold(f64::INFINITY, f64::min) - 0.5 * spacing;
        let depth = -if lowest.is_finite() { lowest } else { of_particles() };
        let is_plane = matches!(surface.shape, SurfaceShape::Plane(_));
        if depth > TOUCHES * spacing && surface.force.is_none() && !is_plane {
            let mm = |x: f64| format!("{:.4}", x * 1e3);
            let found = format!("indenter `{name}` {} mm inside the surface of the body", mm(depth));
            let allowed = format!(
                "up to {} mm, {TOUCHES} spacings, at the start: move it away by {} mm, it presses by its \
                 `displacement`",
                mm(TOUCHES * spacing),
                mm(depth)
            );
            return Err(source.error(&key("point"), found, allowed));
        }
        let Some(force) = surface.force else { continue };
        if surface.friction > 0.0 && !surface.is_pushed_along_normal() {
            let allowed =
                "`friction = 0` of an indenter with a `force`, unless a plane is pressed along its normal";
            return Err(source.error(&key("friction"), plain(surface.friction), allowed));
        }
        let size = length(force);
        let ahead = |&site: &u32| {
            let place = body.bonds.position(site as usize);
            surface.travel_to(place, 0.5 * spacing, &force.map(|f| f / size)).is_some()
        };
        if !particles.iter().any(ahead) {
            let found = format!("a force along which indenter `{name}` does not meet the body");
            return Err(source.error(&key("force"), found, "a force that leads to the body"));
        }
        for d in (0..D).filter(|&d| force[d] != 0.0) {
            let stopped = held.iter().any(|push| push[d] * force[d] < 0.0);
            if !stopped && !scene.boundary.iter().any(|boundary| holds(boundary, d)) {
                let axis = ["x", "y", "z"][d];
                let found = format!("a force along {axis}, along which nothing holds the body");
                let allowed =
                    format!("a `displacement` along {axis} of some region, or a plane behind the body");
                return Err(source.error(&key("force"), found, allowed));
            }
        }
    }
    Ok(())
}
