//! Indenters of a scene: rigid spheres, cylinders and planes with a displacement or a force of their own.

use super::contact::motion;
use super::line::plane_of;
use super::values::{DiscreteBody, plain, vector};
use super::{Boundary, ContactSpec, Prescribed, PrescribedField, Scene, SolverMethod};
use crate::contact::{RigidSurface, SurfaceShape};
use crate::geometry::length;
use harness::scene::{SceneError, Source};
use polycore::units::{Force, Length, Speed};
use serde::Deserialize;

/// Least radius of an indenter in spacings: a smaller one passes between the faces of the body.
const LEAST_RADIUS: f64 = 2.0;
/// Overlap of an indenter and the surface of the body at the start, in spacings, up to which it counts as
/// touch: faces of a round body stand out by less.
const TOUCHES: f64 = 0.1;

/// A rigid sphere (in a plane body a circle), cylinder or plane that the body cannot pass.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IndenterSpec {
    /// Name in curves and values; default: `indenter` and its number.
    pub name: Option<String>,
    /// Centre of a sphere or circle, a point of the axis of a cylinder, a point of a plane.
    pub point: Vec<Length>,
    /// Radius of a sphere, circle or cylinder.
    pub radius: Option<Length>,
    /// Direction of the axis of a cylinder, of any length, in a solid.
    pub axis: Option<Vec<f64>>,
    /// Normal of a plane, of any length, towards the body.
    pub normal: Option<Vec<f64>>,
    /// Stiffness s; default: `contact.stiffness` if above 0, else 10, in explicit dynamics 2.
    pub stiffness: Option<f64>,
    /// Coefficient of friction; default: `contact.friction`.
    pub friction: Option<f64>,
    /// Displacement at the end of the last step; it follows the load factor.
    pub displacement: Option<Vec<Length>>,
    /// Velocity, in explicit dynamics; added to the displacement.
    pub velocity: Option<Vec<Speed>>,
    /// Force on the indenter at the end of the last step instead of a displacement, in equilibrium: it moves
    /// along the force only, from where it first touches the body at rest.
    pub force: Option<Vec<Force>>,
}

impl IndenterSpec {
    /// Returns its name; default: `indenter` and its number.
    pub fn name(&self, index: usize) -> String {
        self.name.clone().unwrap_or_else(|| format!("indenter{}", index + 1))
    }

    /// Returns true if it is pressed on the body.
    pub fn is_driven(&self) -> bool {
        self.displacement.is_some() || self.force.is_some()
    }

    /// Converts the indenter.
    ///
    /// # Errors
    /// As [`super::check`].
    pub(super) fn surface<const D: usize>(
        &self,
        source: &Source,
        key: &str,
        contact: &ContactSpec,
        explicit: bool,
    ) -> Result<RigidSurface<D>, SceneError> {
        let point = vector(source, &format!("{key}.point"), &self.point)?;
        let plain_surface = match (&self.radius, &self.normal) {
            (Some(_), Some(_)) => {
                let why = "a plane has a `normal`, a sphere or cylinder a `radius`";
                return Err(source.conflict(&format!("{key}.normal"), "radius", why));
            }
            (None, None) => {
                let why = "a `radius` of a sphere, circle or cylinder, or the `normal` of a plane";
                return Err(source.missing(&format!("{key}.radius"), why));
            }
            (None, Some(normal)) => {
                if self.axis.is_some() {
                    let why = "the axis of a cylinder, which has a `radius`; a plane has a `normal` only";
                    return Err(source.unexpected(&format!("{key}.axis"), why));
                }
                let (point, normal) = plane_of(source, key, &self.point, normal)?;
                RigidSurface::plane(point, normal)
            }
            (Some(radius), None) => {
                super::values::positive(source, &format!("{key}.radius"), radius.si(), "m")?;
                match &self.axis {
                    None => RigidSurface::sphere(point, radius.si()),
                    Some(axis) => {
                        let key = format!("{key}.axis");
                        if D == 2 {
                            let why = "a plane body has circles, whose axis is z";
                            return Err(source.unexpected(&key, why));
                        }
                        let Ok(axis) = <[f64; D]>::try_from(axis.as_slice()) else {
                            let found = format!("{} components", axis.len());
                            return Err(source.error(&key, found, format!("{D} components")));
                        };
                        if !length(axis).is_normal() {
                            let allowed = "finite numbers, not all of them 0";
                            return Err(source.error(&key, format!("{axis:?}"), allowed));
                        }
                        let size = length(axis);
                        RigidSurface::cylinder(point, axis.map(|x| x / size), radius.si())
                    }
                }
            }
        };
        let (displacement, velocity) =
            motion(source, key, self.displacement.as_deref(), self.velocity.as_deref())?;
        let force = match &self.force {
            None => None,
            Some(force) => Some(self.force(source, key, force)?),
        };
        Ok(RigidSurface {
            stiffness: contact.stiffness_of(self.stiffness, explicit),
            friction: contact.friction_of(self.friction),
            elastic_slip: contact.elastic_slip.map(|slip| slip.si()),
            displacement,
            velocity,
            force,
            ..plain_surface
        })
    }

    fn force<const D: usize>(
        &self,
        source: &Source,
        key: &str,
        force: &[Force],
    ) -> Result<[f64; D], SceneError> {
        let key = format!("{key}.force");
        if self.displacement.is_some() {
            let why = "an indenter has a force or a displacement";
            return Err(source.conflict(&key, "displacement", why));
        }
        let values: Vec<f64> = force.iter().map(|f| f.si()).collect();
        let Ok(values) = <[f64; D]>::try_from(values.as_slice()) else {
            let found = format!("{} components", values.len());
            return Err(source.error(&key, found, format!("{D} components")));
        };
        if !length(values).is_normal() {
            return Err(source.error(&key, "no force", "components of which one is not 0, finite"));
        }
        Ok(values)
    }
}

/// Checks what needs no body.
///
/// # Errors
/// A [`SceneError`] that names the key, the value found and what is allowed.
pub(super) fn check(source: &Source, scene: &Scene, contact: &ContactSpec) -> Result<(), SceneError> {
    let explicit = scene.method() == SolverMethod::Verlet;
    for (index, indenter) in contact.indenter.iter().enumerate() {
        let key = |name: &str| format!("contact.indenter[{index}].{name}");
        if indenter.velocity.is_some() && !explicit {
            let why = format!(
                "needs `solver.method = \"verlet\"`; with `{}` write `displacement`",
                scene.method().name()
            );
            return Err(source.unexpected(&key("velocity"), why));
        }
        if let (Some(radius), Some(most)) = (indenter.radius, longest_step(scene, indenter))
            && most > radius.si()
        {
            let found = format!(
                "a step of {} mm, longer than the radius: it could pass a part of the body",
                plain(most * 1e3)
            );
            return Err(source.error(
                &key("displacement"),
                found,
                "steps of a radius or less: more `solver.steps`",
            ));
        }
        if indenter.force.is_none() {
            continue;
        }
        if explicit {
            let why = "an indenter has no mass: explicit dynamics moves it by `displacement` or `velocity`";
            return Err(source.unexpected(&key("force"), why));
        }
        if scene.has_curves() {
            let why = "it follows the load factor, which runs with curves or pressures do not have";
            return Err(source.unexpected(&key("force"), why));
        }
        let friction = contact.friction_of(indenter.friction);
        if friction > 0.0 {
            let allowed = "`friction = 0` of an indenter with a `force`";
            return Err(source.error(&key("friction"), plain(friction), allowed));
        }
        if contact.stiffness_of(indenter.stiffness, explicit) == 0.0 {
            return Err(source.error(&key("stiffness"), 0, "above 0 of an indenter with a `force`"));
        }
        if let Some(factor) = scene.programme().0.into_iter().find(|factor| *factor < 0.0) {
            let found = format!("a load factor of {}", plain(factor));
            let allowed = "factors of 0 and above: an indenter pushes and never pulls";
            return Err(source.error(&key("force"), found, allowed));
        }
    }
    Ok(())
}

/// Longest way of an indenter in one step of an equilibrium, m; `None` where it does not follow load factors.
fn longest_step(scene: &Scene, indenter: &IndenterSpec) -> Option<f64> {
    let way = indenter.displacement.as_ref()?;
    if scene.method() == SolverMethod::Verlet {
        return None;
    }
    let (factors, _) = scene.programme();
    let starts = std::iter::once(0.0).chain(factors.iter().copied());
    let most = starts.zip(&factors).map(|(from, to)| (to - from).abs()).fold(0.0, f64::max);
    Some(most * way.iter().map(|d| d.si().powi(2)).sum::<f64>().sqrt())
}

/// Returns true if a boundary prescribes the displacement along an axis.
fn holds(boundary: &Boundary, axis: usize) -> bool {
    let prescribed = boundary.displacement.as_ref().and_then(|each| each.get(axis));
    let by_field = boundary.displacement_field.as_ref().and_then(|each| each.get(axis));
    prescribed.is_some_and(|own| *own != Prescribed::Free)
        || by_field.is_some_and(|own| *own != PrescribedField::Free)
        || boundary.rotation.is_some()
}

/// Returns the directions in which rigid surfaces may push a body, at the start and at load factor 1; one with
/// a force of its own stops nothing.
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
pub(super) fn check_placed<const D: usize>(
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
        let particles = body.bonds.particles();
        let heights = particles.iter().map(|&site| surface.height(body.bonds.position(site as usize)));
        let behind = heights.filter(|height| *height < -1e-6 * spacing).count();
        if behind > 0 && surface.force.is_none() {
            let found = format!("{behind} of {} particles inside indenter `{name}`", particles.len());
            return Err(source.error(&key("point"), found, "an indenter outside the body at the start"));
        }
        let faces = outside.faces().iter().map(|face| surface.height(face.place));
        let depth = -faces.fold(f64::INFINITY, f64::min);
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
