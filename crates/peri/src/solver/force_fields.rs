//! Body forces that depend on the displacement, or on place and time at once: they are computed anew, with
//! the loads that follow curves, and act in full.

use super::curves::FixedForces;
use super::load::Loads;
use super::state::State;
use super::system::System;
use crate::amplitude::Amplitude;
use crate::bonds::{BodyGeometry, Property};
use crate::field::{CHUNK, Field};
use crate::parallel;
use rayon::prelude::*;
use std::fmt;

/// Points of a work item.
const BATCH: usize = 256;

/// Body force as a function of the part τ of the whole time and of the displacement.
pub trait ForceField<const D: usize>: fmt::Debug + Send + Sync {
    /// Adds `share` times the force density in the reference volume, N/m³, of each particle.
    fn add(
        &self,
        bonds: &dyn BodyGeometry<D>,
        displacement: &Field<D>,
        part: f64,
        share: f64,
        force: &mut Field<D>,
    );

    /// Returns true if the force depends on the displacement.
    fn follows(&self) -> bool {
        false
    }
}

/// Centrifugal force ρω²(1 − aaᵀ)(X + u − c) in a frame that rotates about the axis a through c.
#[derive(Clone, Debug)]
pub struct Centrifugal<const D: usize> {
    /// Density ρ of the undeformed body, kg/m³.
    pub density: Property,
    /// Angular velocity ω at a multiple of 1, rad/s.
    pub angular_velocity: f64,
    /// Point c of the axis, m.
    pub centre: [f64; D],
    /// Direction a of the axis, of length 1; across the plane of a plane body.
    pub axis: [f64; 3],
    /// Multiple of ω.
    pub amplitude: Amplitude,
}

impl<const D: usize> ForceField<D> for Centrifugal<D> {
    fn add(
        &self,
        bonds: &dyn BodyGeometry<D>,
        displacement: &Field<D>,
        part: f64,
        share: f64,
        force: &mut Field<D>,
    ) {
        let speed = self.angular_velocity * self.amplitude.multiple(part);
        add_to_particles(bonds, force, |site| {
            let (place, moved) = (bonds.position(site), displacement.get(site));
            let from: [f64; D] = std::array::from_fn(|d| place[d] + moved[d] - self.centre[d]);
            let along: f64 = (0..D).map(|d| self.axis[d] * from[d]).sum();
            let factor = share * self.density.value_at(site) * speed * speed;
            std::array::from_fn(|d| factor * (from[d] - along * self.axis[d]))
        });
    }

    fn follows(&self) -> bool {
        true
    }
}

/// Force density s f(X, τ) on some particles, with a place X and a share s of each.
pub struct PlacedForce<const D: usize> {
    points: Vec<(u32, [f64; D], f64)>,
    density: Box<PlaceDensity<D>>,
}

/// Vector at a place, m, and a τ.
type PlaceDensity<const D: usize> = dyn Fn([f64; D], f64) -> [f64; D] + Send + Sync;

impl<const D: usize> PlacedForce<D> {
    /// Creates a force from sites, places (m) and shares, and from f.
    pub fn new(
        points: Vec<(u32, [f64; D], f64)>,
        density: impl Fn([f64; D], f64) -> [f64; D] + Send + Sync + 'static,
    ) -> Self {
        Self { points, density: Box::new(density) }
    }
}

impl<const D: usize> fmt::Debug for PlacedForce<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "PlacedForce({} points)", self.points.len())
    }
}

impl<const D: usize> ForceField<D> for PlacedForce<D> {
    fn add(&self, _: &dyn BodyGeometry<D>, _: &Field<D>, part: f64, share: f64, force: &mut Field<D>) {
        let value = |(_, place, own): &(u32, [f64; D], f64)| {
            (self.density)(*place, part).map(|density| share * own * density)
        };
        let values: Vec<[f64; D]> = self.points.par_iter().with_min_len(BATCH).map(value).collect();
        for (&(site, ..), value) in self.points.iter().zip(values) {
            let old = force.get(site as usize);
            force.set(site as usize, std::array::from_fn(|d| old[d] + value[d]));
        }
    }
}

/// Adds a force density to each particle.
fn add_to_particles<const D: usize>(
    bonds: &dyn BodyGeometry<D>,
    force: &mut Field<D>,
    density: impl Fn(usize) -> [f64; D] + Sync,
) {
    let particles = bonds.particles();
    parallel::for_items(force.chunks_mut(), |chunk, mut force| {
        let (start, length) = (chunk * CHUNK, force[0].len());
        let at = |end: usize| particles.partition_point(|&site| (site as usize) < end);
        for &site in &particles[at(start)..at(start + length)] {
            let value = density(site as usize);
            (0..D).for_each(|d| force[d][site as usize - start] += value[d]);
        }
    });
}

impl<const D: usize> Loads<D> {
    /// Returns true if a body force depends on the displacement.
    pub fn follows(&self) -> bool {
        self.curved.iter().flat_map(|curved| &curved.fields).any(|field| field.follows())
    }

    /// Computes the body forces at a displacement, at the mean of two τ as [`Self::set_forces`].
    pub fn update_forces(&mut self, parts: [f64; 2], bonds: &dyn BodyGeometry<D>, displacement: &Field<D>) {
        let add = |field: &dyn ForceField<D>, force: &mut Field<D>| match parts {
            [before, after] if before == after => field.add(bonds, displacement, after, 1.0, force),
            parts => parts.iter().for_each(|&part| field.add(bonds, displacement, part, 0.5, force)),
        };
        // what does not follow the displacement is computed once at a time
        let fixed = self.curved.as_mut().and_then(|curved| curved.fixed.take());
        let fixed = fixed.filter(|fixed| {
            fixed.parts == parts && self.curved.as_ref().is_some_and(|own| own.bare.len() == fixed.bare)
        });
        if fixed.is_none() {
            self.set_forces(parts);
        }
        let follows = self.follows();
        let (Some(force), Some(curved)) = (self.body_force.as_mut(), &mut self.curved) else { return };
        curved.part = parts[1];
        match &fixed {
            Some(fixed) => force.clone_from(&fixed.force),
            None => {
                curved.fields.iter().filter(|field| !field.follows()).for_each(|field| add(&**field, force))
            }
        }
        if follows {
            let new = || FixedForces { parts, bare: curved.bare.len(), force: force.clone() };
            curved.fixed = Some(fixed.unwrap_or_else(new));
            curved.fields.iter().filter(|field| field.follows()).for_each(|field| add(&**field, force));
        }
        if !curved.fields.is_empty() {
            curved.bare.iter().for_each(|&site| force.set(site as usize, [0.0; D]));
        }
    }
}

impl<const D: usize> System<'_, D> {
    /// Sets the body forces of curves and fields at τ and a displacement.
    pub(super) fn set_forces(&mut self, part: f64, displacement: &Field<D>) {
        self.set_mean_forces([part; 2], displacement);
    }

    /// Sets the body forces of curves and fields at a displacement, at the mean of two τ.
    pub(super) fn set_mean_forces(&mut self, parts: [f64; 2], displacement: &Field<D>) {
        if self.loads.curved.is_some() {
            self.loads.to_mut().update_forces(parts, &*self.bonds, displacement);
            self.contact.iter_mut().for_each(|contact| contact.set_weights(parts));
        }
    }

    /// Renews the body forces that depend on the displacement.
    pub(super) fn follow(&mut self, displacement: &Field<D>) {
        if self.loads.follows() {
            let part = self.loads.curved.as_ref().map_or(1.0, |curved| curved.part);
            self.set_forces(part, displacement);
        }
    }

    /// Keeps body force and displacement of an equilibrium, if the forces depend on the displacement.
    pub(super) fn keep_forces(&self, state: &mut State<D>) {
        if let Some(force) = self.loads.body_force.as_ref().filter(|_| self.loads.follows()) {
            state.control.pushed = Some(Box::new([force.clone(), state.displacement.clone()]));
        }
    }

    /// Work of the present body forces since those kept, J: Σ ½(b + b′)·(u − u′) V.
    pub(super) fn work_of_followers(&self, state: &State<D>) -> f64 {
        let (Some(kept), Some(force)) = (&state.control.pushed, &self.loads.body_force) else { return 0.0 };
        let [before, from] = &**kept;
        let of = |sites: &[u32]| {
            let each = sites.iter().map(|&site| {
                let site = site as usize;
                let (old, new) = (before.get(site), force.get(site));
                let (start, end) = (from.get(site), state.displacement.get(site));
                let work: f64 = (0..D).map(|d| 0.5 * (old[d] + new[d]) * (end[d] - start[d])).sum();
                work * self.bonds.volume(site)
            });
            each.sum::<f64>()
        };
        self.bonds.particles().chunks(CHUNK).map(of).sum()
    }
}
