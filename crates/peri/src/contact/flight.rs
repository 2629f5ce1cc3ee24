//! Rigid surfaces with a mass, in explicit dynamics: contact and a force of their own accelerate them; they
//! do not turn.

use super::surfaces::{MovingSurface, RigidSurfaces};
use super::{Contact, positive};
use crate::error::Error;
use crate::field::Field;
use serde::{Deserialize, Serialize};

/// Mass of a rigid surface, and a force on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertia<const D: usize> {
    /// Mass, kg.
    pub mass: f64,
    /// Force at load factor 1, N.
    pub force: [f64; D],
}

impl<const D: usize> Inertia<D> {
    /// Checks the mass and the force.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a mass that is not positive, and values that are not finite.
    pub(super) fn check(&self) -> Result<(), Error> {
        positive("mass of a rigid surface", self.mass)?;
        match self.force.iter().find(|force| !force.is_finite()) {
            Some(&found) => Err(Error::Parameter {
                name: "force on a rigid surface",
                found,
                allowed: "finite".to_owned(),
            }),
            None => Ok(()),
        }
    }
}

/// Motion of a rigid surface with a mass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Flight {
    /// Displacement, m.
    pub moved: [f64; 3],
    /// Velocity, m/s.
    pub velocity: [f64; 3],
    /// Acceleration, m/s².
    pub acceleration: [f64; 3],
}

impl Flight {
    /// First half of a kick and the drift of a step, s, of velocity Verlet.
    pub fn drift_on(&self, step: f64) -> Self {
        let Self { moved, velocity, acceleration } = *self;
        let velocity = std::array::from_fn(|d| velocity[d] + 0.5 * step * acceleration[d]);
        Self { moved: std::array::from_fn(|d| moved[d] + step * velocity[d]), velocity, acceleration }
    }

    /// Second half of the kick of a step, s, with the new acceleration, m/s².
    pub fn kick(&self, step: f64, acceleration: [f64; 3]) -> Self {
        let velocity = std::array::from_fn(|d| self.velocity[d] + 0.5 * step * acceleration[d]);
        Self { velocity, acceleration, ..*self }
    }
}

impl<const D: usize> Contact<D> {
    /// Sets where surfaces with a mass are after their flight; they go there in [`Self::move_surfaces`].
    pub fn fly(&mut self, flights: &[Flight]) {
        let each = self.surfaces.iter_mut().flat_map(|surfaces| &mut surfaces.each);
        each.zip(flights).for_each(|(placed, flight)| {
            placed.flown = std::array::from_fn(|d| flight.moved[d]);
        });
    }

    /// Accelerations, m/s², of surfaces with a mass that push the body with these forces, N, at a load
    /// factor.
    pub fn accelerations(&self, pushing: &[[f64; 3]], factor: f64) -> Vec<[f64; 3]> {
        let accelerate = |(surface, push): (&super::RigidSurface<D>, &[f64; 3])| {
            let Some(Inertia { mass, force }) = surface.inertia else { return [0.0; 3] };
            let multiple = surface.force_factor(factor);
            let own = |d: usize| force.get(d).copied().unwrap_or(0.0);
            std::array::from_fn(|d| (multiple * own(d) - push[d]) / mass)
        };
        self.surfaces().zip(pushing).map(accelerate).collect()
    }

    /// Stiffness of the contact of a surface over its mass, 1/s², the greatest one: it adds to the squared
    /// greatest frequency.
    pub fn striking(&self, displacement: &Field<D>) -> f64 {
        let Some(surfaces) = &self.surfaces else { return 0.0 };
        surfaces.each.iter().map(|placed| surfaces.striking(placed, displacement)).fold(0.0, f64::max)
    }
}

impl<const D: usize> RigidSurfaces<D> {
    fn striking(&self, placed: &MovingSurface<D>, displacement: &Field<D>) -> f64 {
        let Some(inertia) = placed.surface.inertia else { return 0.0 };
        // friction is as stiff along the surface
        let touches = self.near(placed, displacement, 0.0);
        touches.iter().map(|touch| touch.stiffness).sum::<f64>() / inertia.mass
    }
}
