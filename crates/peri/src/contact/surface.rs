//! Rigid surfaces that a body cannot pass, or to which it is tied: planes, spheres, cylinders, facets.

use super::Inertia;
use super::friction_pair::across;
use super::non_negative;
use crate::amplitude::Amplitude;
use crate::error::Error;
use crate::geometry::{SignedDistance, length};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Parts of the time of a run at which the path of a surface is known.
const MOMENTS: u32 = 64;

/// Shape of a rigid surface, through its signed distance h and the normal ∇h: positive on the side of the
/// body.
#[derive(Clone, Debug, PartialEq)]
pub enum SurfaceShape<const D: usize> {
    /// Half-space behind a plane, by its normal towards the body.
    Plane([f64; D]),
    /// Sphere, in a plane body a disc, of this radius, m, about the point of the surface.
    Sphere(f64),
    /// Cylinder about an axis through the point of the surface: direction and radius, m.
    Cylinder([f64; D], f64),
    /// Closed facets, whose origin is the point of the surface.
    Facets(Arc<SignedDistance<D>>),
}

/// A rigid body bounded by a surface. A face of a deformable body at the depth o below the surface is pushed
/// out with the pressure s(M/Δx)o, with the longitudinal modulus M and the spacing Δx: s layers of confined
/// material are as stiff as the contact.
#[derive(Clone, Debug, PartialEq)]
pub struct RigidSurface<const D: usize> {
    /// Name in messages; empty: by its number.
    pub name: String,
    /// A point of a plane, the centre of a sphere, a point of the axis of a cylinder, the origin of facets,
    /// m.
    pub point: [f64; D],
    /// Shape; vectors have any length.
    pub shape: SurfaceShape<D>,
    /// Stiffness s.
    pub stiffness: f64,
    /// Coefficient of friction μ.
    pub friction: f64,
    /// Elastic slip γ at which friction reaches Coulomb's limit, m; `None`: tangential and normal stiffness
    /// are equal.
    pub elastic_slip: Option<f64>,
    /// Ties the faces that touch it in the reference state: no gap, no slip; others touch it without
    /// friction. Planes only.
    pub bonded: bool,
    /// Displacement at load factor 1, m, in proportion to the factor.
    pub displacement: [f64; D],
    /// Velocity in explicit dynamics, m/s, in addition to the displacement.
    pub velocity: [f64; D],
    /// Displacement by its velocity in earlier steps, m.
    pub drift: [f64; D],
    /// Force on the rigid body at load factor 1, N, in equilibria: it moves along the force, from where it
    /// first touches the undeformed body, to where contact balances the force. `None`: moves by
    /// `displacement` and `velocity`.
    pub force: Option<[f64; D]>,
    /// Mass in explicit dynamics, with a force: `velocity` is then that at the start, and there is no
    /// `displacement`. `None`: moves as prescribed.
    pub inertia: Option<Inertia<D>>,
    /// Multiples of the components of `displacement` over the load factor, of which `force` follows the
    /// first; `None`: the factor itself. A system with amplitudes has
    /// [`Loads::curved`](crate::solver::Loads::curved) loads, which count the work.
    pub amplitudes: Option<[Amplitude; D]>,
}

impl<const D: usize> RigidSurface<D> {
    /// A plane at rest, without friction, of stiffness [`super::PLANE_STIFFNESS`].
    pub fn plane(point: [f64; D], normal: [f64; D]) -> Self {
        Self {
            name: String::new(),
            point,
            shape: SurfaceShape::Plane(normal),
            stiffness: super::PLANE_STIFFNESS,
            friction: 0.0,
            elastic_slip: None,
            bonded: false,
            displacement: [0.0; D],
            velocity: [0.0; D],
            drift: [0.0; D],
            force: None,
            inertia: None,
            amplitudes: None,
        }
    }

    /// A sphere, in a plane body a disc, as [`Self::plane`].
    pub fn sphere(centre: [f64; D], radius: f64) -> Self {
        Self { shape: SurfaceShape::Sphere(radius), ..Self::plane(centre, [0.0; D]) }
    }

    /// A cylinder without ends, as [`Self::plane`].
    pub fn cylinder(point: [f64; D], axis: [f64; D], radius: f64) -> Self {
        Self { shape: SurfaceShape::Cylinder(axis, radius), ..Self::plane(point, [0.0; D]) }
    }

    /// A body inside facets whose origin is `point`, as [`Self::plane`].
    pub fn facets(point: [f64; D], facets: Arc<SignedDistance<D>>) -> Self {
        Self { shape: SurfaceShape::Facets(facets), ..Self::plane(point, [0.0; D]) }
    }

    /// Word for the shape.
    pub fn kind(&self) -> &'static str {
        match self.shape {
            SurfaceShape::Plane(_) => "plane",
            SurfaceShape::Sphere(_) if D == 2 => "circle",
            SurfaceShape::Sphere(_) => "sphere",
            SurfaceShape::Cylinder(..) => "cylinder",
            SurfaceShape::Facets(_) => "surface",
        }
    }

    /// Shape and name of the surface, the `index`-th of its body from 0, for messages.
    pub fn title(&self, index: usize) -> String {
        match self.name.as_str() {
            "" => format!("{} {}", self.kind(), index + 1),
            name => format!("{} `{name}`", self.kind()),
        }
    }

    /// Vector from the centre or axis of a round surface at rest to a place, m.
    pub(super) fn offset_of(&self, place: [f64; D]) -> [f64; D] {
        let from = std::array::from_fn(|d| place[d] - self.point[d]);
        match &self.shape {
            SurfaceShape::Cylinder(axis, _) => across(axis, from),
            _ => from,
        }
    }

    /// Radius of a round surface, m.
    pub(super) fn radius(&self) -> Option<f64> {
        match self.shape {
            SurfaceShape::Plane(_) | SurfaceShape::Facets(_) => None,
            SurfaceShape::Sphere(radius) | SurfaceShape::Cylinder(_, radius) => Some(radius),
        }
    }

    /// Height of a place above the surface at rest, m.
    pub fn height(&self, place: [f64; D]) -> f64 {
        match (&self.shape, self.radius()) {
            (SurfaceShape::Facets(facets), _) => facets.height_and_normal(self.offset_of(place)).0,
            (SurfaceShape::Plane(normal), _) => (0..D).map(|d| (place[d] - self.point[d]) * normal[d]).sum(),
            (_, radius) => length(self.offset_of(place)) - radius.unwrap_or(0.0),
        }
    }

    /// Unit normal at a place beside the surface at rest, towards the body; zero on an axis or centre.
    pub fn normal(&self, place: [f64; D]) -> [f64; D] {
        let from = self.offset_of(place);
        match &self.shape {
            SurfaceShape::Plane(normal) => return *normal,
            SurfaceShape::Facets(facets) => return facets.height_and_normal(from).1,
            _ => {}
        }
        let size = length(from);
        if size > 0.0 { from.map(|x| x / size) } else { [0.0; D] }
    }

    /// Displacement at a load factor, m, without that of its velocity.
    pub fn displacement_at(&self, factor: f64) -> [f64; D] {
        let multiple = |d: usize| self.amplitudes.as_ref().map_or(factor, |each| each[d].multiple(factor));
        std::array::from_fn(|d| multiple(d) * self.displacement[d])
    }

    /// Displacement at a load factor and a time, s, m, of a surface without a force.
    pub fn place_at(&self, factor: f64, time: f64) -> [f64; D] {
        let displacement = self.displacement_at(factor);
        std::array::from_fn(|d| displacement[d] + time * self.velocity[d] + self.drift[d])
    }

    /// Multiple of the force at a load factor.
    pub(super) fn force_factor(&self, factor: f64) -> f64 {
        self.amplitudes.as_ref().map_or(factor, |each| each[0].multiple(factor))
    }

    /// Mean rate of the displacement over the load factor between two factors, m.
    pub(super) fn rate(&self, before: f64, after: f64) -> [f64; D] {
        let rate = |d: usize| self.amplitudes.as_ref().map_or(1.0, |each| each[d].secant(before, after));
        std::array::from_fn(|d| rate(d) * self.displacement[d])
    }

    /// Displacements from the start to the end of its motion, m, without those of its velocity.
    pub fn path(&self) -> Vec<[f64; D]> {
        match self.amplitudes {
            None => vec![[0.0; D], self.displacement],
            Some(_) => {
                (0..=MOMENTS).map(|k| self.displacement_at(f64::from(k) / f64::from(MOMENTS))).collect()
            }
        }
    }

    /// Size of the force at load factor 1, N, and its direction.
    pub(super) fn pushed(&self) -> Option<(f64, [f64; D])> {
        let force = self.force?;
        let size = length(force);
        Some((size, force.map(|f| f / size)))
    }

    /// Returns true for a plane whose force is along its normal, so that friction is across it.
    pub fn is_pushed_along_normal(&self) -> bool {
        let (SurfaceShape::Plane(normal), Some(force)) = (&self.shape, self.force) else { return false };
        length(across(&normal.map(|n| n / length(*normal)), force)) <= 1e-9 * length(force)
    }

    /// Returns true if it moves by itself.
    pub fn moves(&self) -> bool {
        self.displacement != [0.0; D] || self.velocity != [0.0; D] || self.inertia.is_some()
    }

    /// Checks the surface and normalises its vectors.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a vector without direction, and for values that are negative or not finite.
    pub(super) fn checked(mut self) -> Result<Self, Error> {
        non_negative("stiffness of a rigid surface", self.stiffness)?;
        non_negative("friction of a rigid surface", self.friction)?;
        if let Some(slip) = self.elastic_slip {
            super::positive("elastic slip of a rigid surface", slip)?;
        }
        for (name, vector) in [
            ("point of a rigid surface", self.point),
            ("displacement of a rigid surface", self.displacement),
            ("velocity of a rigid surface", self.velocity),
        ] {
            if let Some(&found) = vector.iter().find(|x| !x.is_finite()) {
                return Err(Error::Parameter { name, found, allowed: "finite".into() });
            }
        }
        if let Some(radius) = self.radius() {
            super::positive("radius of a rigid surface", radius)?;
        }
        self.shape = match self.shape {
            SurfaceShape::Plane(normal) => SurfaceShape::Plane(unit("normal of a plane", normal)?),
            SurfaceShape::Cylinder(axis, radius) => {
                SurfaceShape::Cylinder(unit("axis of a cylinder", axis)?, radius)
            }
            other => other,
        };
        if self.bonded && (self.force.is_some() || !matches!(self.shape, SurfaceShape::Plane(_))) {
            let allowed = "a plane without a force".to_owned();
            return Err(Error::Parameter { name: "bonded rigid surface", found: 1.0, allowed });
        }
        if let Some(inertia) = &self.inertia {
            inertia.check()?;
        }
        if let Some(force) = self.force {
            unit("force on a rigid surface", force)?;
        }
        Ok(self)
    }
}

/// Scales a vector to the length 1.
fn unit<const D: usize>(name: &'static str, vector: [f64; D]) -> Result<[f64; D], Error> {
    let size = length(vector);
    if !size.is_normal() {
        return Err(Error::Parameter { name, found: size, allowed: "a length above 0, finite".to_owned() });
    }
    Ok(vector.map(|x| x / size))
}

/// Contact of a body with a rigid surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SurfaceReaction {
    /// Force of the surface on the body, N.
    pub force: [f64; 3],
    /// Area of the faces in contact, m².
    pub area: f64,
    /// Root of the mean square distance from the centre of pressure, weighted with the pressure, m; b/2 for a
    /// Hertzian strip of half-width b, a√(2/5) for a Hertzian circle of radius a.
    pub spread: f64,
    /// Least gap, m, negative for an overlap.
    pub gap: f64,
    /// Largest extent of the faces in contact across the normal, or across the force of a round surface, m:
    /// in a plane body the width of the contact.
    pub width: f64,
    /// Greatest pressure, Pa, see [`SurfaceTraction`](super::SurfaceTraction); 0 where nothing is pressed.
    pub pressure: f64,
    /// Displacement of the surface, m.
    pub moved: [f64; 3],
    /// Velocity of a surface with a mass, m/s.
    pub velocity: [f64; 3],
}
