//! Checks of indenters against the body: outside of it at the start, resolved, and something to press on.

use super::indenter::refuse_leap;
use super::pressure::{LEAST_WALL, wall};
use super::values::{DiscreteBody, plain};
use super::{Boundary, Prescribed, PrescribedField, Scene};
use crate::contact::{BEHIND, RigidSurface, SurfaceShape};
use crate::geometry::{Enclosure, inside, length};
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

/// Returns the directions in which rigid surfaces may push a body, at the start and on their way; one with a
/// force of its own stops nothing.
pub(super) fn stops<const D: usize>(surfaces: &[RigidSurface<D>], body: &DiscreteBody<D>) -> Vec<[f64; D]> {
    let bonds = &body.bonds;
    let centres: Vec<[f64; D]> =
        bonds.particles().iter().map(|&site| bonds.position(site as usize)).collect();
    let standing = surfaces.iter().filter(|surface| surface.force.is_none());
    let shifts = standing.flat_map(|surface| surface.path().into_iter().map(move |shift| (surface, shift)));
    shifts.flat_map(|(surface, shift)| surface.stops(&shift, &centres, 0.5 * bonds.spacing())).collect()
}

/// Warns of bodies too thin below a rigid surface, and passes on the notes of files.
pub(super) fn warnings<const D: usize>(
    source: &Source,
    scene: &Scene,
    body: &DiscreteBody<D>,
) -> Vec<String> {
    let Some(contact) = &scene.contact else { return Vec::new() };
    let surfaces = contact.surfaces::<D>(source, scene).unwrap_or_default();
    let (spacing, outside) = (body.bonds.spacing(), body.surface());
    let thin = |(number, surface): (usize, &RigidSurface<D>)| {
        let heights: Vec<f64> = outside.faces().iter().map(|face| surface.height(face.place)).collect();
        let nearest = heights.iter().copied().fold(f64::INFINITY, f64::min).max(0.0);
        let reach = nearest + surface.path().into_iter().map(length).fold(0.0, f64::max) + spacing;
        let met = outside.faces().iter().zip(&heights).filter(|(face, height)| {
            let beyond: [f64; D] = std::array::from_fn(|d| face.place[d] + 0.1 * spacing * face.normal[d]);
            **height < reach && surface.height(beyond) < **height - 0.05 * spacing
        });
        let wall = wall(body, met.map(|(face, _)| face)).filter(|wall| *wall < LEAST_WALL * spacing)?;
        Some(format!(
            "{} meets a body {} mm thick, one layer of particles: that has no stiffness across it; take a \
             smaller `body.spacing`",
            surface.title(number),
            plain(wall * 1e3)
        ))
    };
    let notes = contact.indenter.iter().flat_map(|indenter| indenter.notes(source));
    surfaces.iter().enumerate().filter_map(thin).chain(notes).collect()
}

/// Refuses a closed surface with a wall or an edge that passes between the faces of the body, or with a
/// corner inside the body.
fn refuse_slender<const D: usize>(
    source: &Source,
    key: &str,
    (surface, facets): (&RigidSurface<D>, &Enclosure<D>),
    body: &DiscreteBody<D>,
) -> Result<(), SceneError> {
    let spacing = body.bonds.spacing();
    let is_deep = |corner: [f64; D]| {
        let beside = |d: usize, way: f64| {
            std::array::from_fn(|e| corner[e] + if e == d { way * TOUCHES * spacing } else { 0.0 })
        };
        (0..D).all(|d| [1.0, -1.0].iter().all(|&way| inside(&body.operations, beside(d, way))))
    };
    let mm = |place: [f64; D]| place.map(|x| plain((x * 1e6).round() / 1e3)).join(", ");
    for (index, corners) in facets.facets().corners().iter().enumerate() {
        let normal = facets.facets().normal(index);
        let middle: [f64; D] =
            std::array::from_fn(|d| corners.iter().map(|corner| corner[d]).sum::<f64>() / D as f64);
        let place: [f64; D] = std::array::from_fn(|d| middle[d] + surface.point[d]);
        let behind = std::array::from_fn(|d| place[d] - LEAST_RADIUS * spacing * normal[d]);
        if surface.height(behind) > 0.0 {
            let found =
                format!("a wall or an edge thinner than {LEAST_RADIUS} spacings at ({}) mm", mm(place));
            let allowed = format!(
                "at least {} mm of solid behind every facet: less passes between the faces of the body",
                plain(LEAST_RADIUS * spacing * 1e3)
            );
            return Err(source.error(key, found, allowed));
        }
        let corner = corners.iter().map(|corner| std::array::from_fn(|d| corner[d] + surface.point[d]));
        if surface.force.is_none()
            && !body.operations.is_empty()
            && let Some(corner) = corner.clone().find(|&corner| is_deep(corner))
        {
            let found = format!("a corner inside the body, at ({}) mm", mm(corner));
            return Err(source.error(key, found, "an indenter outside the body at the start"));
        }
    }
    Ok(())
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
    let surfaces = contact.surfaces::<D>(source, scene)?;
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
        if let SurfaceShape::Sphere(radius) | SurfaceShape::Cylinder(_, radius) = surface.shape {
            refuse_leap(source, scene, (&key("displacement"), surface), radius, "the radius")?;
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
            refuse_slender(source, &key("file"), (surface, facets.body()), body)?;
            refuse_leap(source, scene, (&key("displacement"), surface), 0.5 * least, "half its width")?;
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
        let size = length(force);
        let ahead = |&site: &u32| {
            let place = body.bonds.position(site as usize);
            surface.travel_to(place, 0.5 * spacing, &force.map(|f| f / size)).is_some()
        };
        if !particles.iter().any(ahead) {
            let found = format!("a force along which indenter `{name}` does not meet the body");
            return Err(source.error(&key("force"), found, "a force that leads to the body"));
        }
        if let SurfaceShape::Facets(facets) = &surface.shape {
            let way = force.map(|f| f / size);
            let ways = outside.faces().iter().filter_map(|face| surface.travel_to(face.place, 0.0, &way));
            let first = ways.fold(f64::INFINITY, f64::min);
            if first < -BEHIND * facets.ball().1 {
                let found = format!(
                    "a surface that first touches the body {} mm behind its place: indenter `{name}` \
                     surrounds or overlaps it",
                    plain((-first * 1e6).round() / 1e3)
                );
                let allowed = "a surface in front of the body, or a `displacement`";
                return Err(source.error(&key("force"), found, allowed));
            }
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
