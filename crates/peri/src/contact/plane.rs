//! Rigid planes that a body cannot pass, or to which it is tied.

use super::non_negative;
use crate::error::Error;
use crate::geometry::length;
use serde::{Deserialize, Serialize};

/// A rigid half-space behind a plane. A face of the body at the depth o below it is pushed out with the
/// pressure s(M/Δx)o, with the longitudinal modulus M and the spacing Δx: s layers of confined material are
/// as stiff as the contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidPlane<const D: usize> {
    /// A point of the plane, m.
    pub point: [f64; D],
    /// Normal, of any length, towards the body.
    pub normal: [f64; D],
    /// Stiffness s.
    pub stiffness: f64,
    /// Coefficient of friction μ.
    pub friction: f64,
    /// Elastic slip γ at which friction reaches Coulomb's limit, m; `None`: tangential and normal stiffness
    /// are equal.
    pub elastic_slip: Option<f64>,
    /// Ties the faces that touch it in the reference state: no gap, no slip.
    pub bonded: bool,
    /// Displacement at load factor 1, m, in proportion to the factor.
    pub displacement: [f64; D],
    /// Velocity in explicit dynamics, m/s, in addition to the displacement.
    pub velocity: [f64; D],
}

impl<const D: usize> RigidPlane<D> {
    /// A plane at rest, without friction, of stiffness [`super::PLANE_STIFFNESS`].
    pub fn new(point: [f64; D], normal: [f64; D]) -> Self {
        Self {
            point,
            normal,
            stiffness: super::PLANE_STIFFNESS,
            friction: 0.0,
            elastic_slip: None,
            bonded: false,
            displacement: [0.0; D],
            velocity: [0.0; D],
        }
    }

    /// Height of a point above the plane at rest, m.
    pub fn height(&self, place: [f64; D]) -> f64 {
        (0..D).map(|d| (place[d] - self.point[d]) * self.normal[d]).sum()
    }

    /// Checks the plane and normalises its normal.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a normal without direction and for values that are negative or not finite.
    pub(super) fn checked(mut self) -> Result<Self, Error> {
        non_negative("stiffness of a plane", self.stiffness)?;
        non_negative("friction of a plane", self.friction)?;
        if let Some(found) = self.elastic_slip.filter(|slip| !(*slip > 0.0 && slip.is_finite())) {
            let allowed = "above 0, finite".to_owned();
            return Err(Error::Parameter { name: "elastic slip of a plane", found, allowed });
        }
        for (name, vector) in [
            ("point of a plane", self.point),
            ("displacement of a plane", self.displacement),
            ("velocity of a plane", self.velocity),
        ] {
            if let Some(&found) = vector.iter().find(|x| !x.is_finite()) {
                return Err(Error::Parameter { name, found, allowed: "finite".into() });
            }
        }
        let size = length(self.normal);
        if !size.is_normal() {
            let allowed = "a length above 0, finite".to_owned();
            return Err(Error::Parameter { name: "normal of a plane", found: size, allowed });
        }
        self.normal = self.normal.map(|n| n / size);
        Ok(self)
    }
}

/// Contact of a body with a plane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlaneReaction {
    /// Force of the plane on the body, N.
    pub force: [f64; 3],
    /// Area of the faces in contact, m².
    pub area: f64,
    /// Root of the mean square distance from the centre of pressure, weighted with the pressure, m; b/2 for a
    /// Hertzian strip of half-width b.
    pub spread: f64,
    /// Least gap, m, negative for an overlap.
    pub gap: f64,
    /// Largest extent of the faces in contact across the normal, m: in a plane body the width of the contact.
    pub width: f64,
}
