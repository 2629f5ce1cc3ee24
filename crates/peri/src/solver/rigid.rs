//! Regions that move as a whole: the particles of a region share one unknown displacement in some components,
//! and the forces on them act on the region.
//!
//! With shared components the out-of-balance force density of a particle is the mean Σ V f/Σ V of its region.

use super::load::Loads;
use super::particle_map::ParticleMap;
use super::passes::ForceSums;
use super::state::State;
use super::system::System;
use crate::bonds::BodyGeometry;
use crate::field::Field;

/// Region whose particles share their displacement in some components, relative to where they begin.
#[derive(Clone, Debug, PartialEq)]
pub struct RigidRegion {
    /// Sites of the region.
    pub sites: Vec<u32>,
    /// Bit d: component d is shared.
    pub components: u8,
}

impl RigidRegion {
    fn shares(&self, d: usize) -> bool {
        self.components >> d & 1 == 1
    }

    /// Mean of a field over the region, weighted by volume.
    fn mean<const D: usize>(&self, bonds: &dyn BodyGeometry<D>, field: &Field<D>) -> [f64; D] {
        let (mut sum, mut total) = ([0.0; D], 0.0);
        for &site in &self.sites {
            let (volume, value) = (bonds.volume(site as usize), field.get(site as usize));
            (0..D).for_each(|d| sum[d] += volume * value[d]);
            total += volume;
        }
        sum.map(|x| x / total)
    }

    /// Sets the shared components of a field.
    fn set<const D: usize>(&self, value: [f64; D], field: &mut Field<D>) {
        for &site in &self.sites {
            let own = field.get(site as usize);
            field.set(site as usize, std::array::from_fn(|d| if self.shares(d) { value[d] } else { own[d] }));
        }
    }
}

impl<const D: usize> Loads<D> {
    /// Lets the particles of a region share their displacement in some components, once all other loads are
    /// set.
    pub fn join(&mut self, region: RigidRegion, sites: usize) {
        if self.rigid.is_empty() {
            self.joined.clone_from(&self.constrained);
            self.joined.resize(sites, 0);
        }
        region.sites.iter().for_each(|&site| self.joined[site as usize] |= region.components);
        self.rigid.push(region);
    }

    /// Bits of the components of each site that are constrained or shared; empty without any.
    pub(super) fn bound(&self) -> &[u8] {
        if self.rigid.is_empty() { &self.constrained } else { &self.joined }
    }

    /// Gives the particles of each region the largest of their masses.
    pub(super) fn level_masses(&self, masses: &mut [f64]) {
        for region in &self.rigid {
            let largest = region.sites.iter().map(|&site| masses[site as usize]).fold(0.0, f64::max);
            region.sites.iter().for_each(|&site| masses[site as usize] = largest);
        }
    }
}

impl<const D: usize> System<'_, D> {
    /// Replaces forces in shared components by their means.
    pub(super) fn level_forces(&self, state: &mut State<D>) {
        for region in &self.loads.rigid {
            region.set(region.mean(&*self.bonds, &state.force), &mut state.force);
        }
    }

    /// Replaces velocities in shared components by their means.
    pub(super) fn level_velocities(&self, state: &mut State<D>) {
        for region in &self.loads.rigid {
            region.set(region.mean(&*self.bonds, &state.velocity), &mut state.velocity);
        }
    }

    /// Stops particles without bonds in a search for equilibrium, but not in shared components.
    pub(super) fn stop_detached(&self, state: &mut State<D>) {
        let Some(contact) = self.repulsion() else { return };
        let means: Vec<[f64; D]> =
            self.loads.rigid.iter().map(|region| region.mean(&*self.bonds, &state.velocity)).collect();
        contact.stop_detached(&mut state.velocity);
        for (region, mean) in self.loads.rigid.iter().zip(means) {
            region.set(mean, &mut state.velocity);
        }
    }

    /// Moves regions as a whole from a former displacement: by the mean of the moves of their particles.
    pub(super) fn level_move(&self, state: &mut State<D>, before: &Field<D>) {
        for region in &self.loads.rigid {
            let [start, end] = [before, &state.displacement].map(|field| region.mean(&*self.bonds, field));
            for &site in &region.sites {
                let (own, old) = (state.displacement.get(site as usize), before.get(site as usize));
                let moved = |d: usize| if region.shares(d) { old[d] + end[d] - start[d] } else { own[d] };
                state.displacement.set(site as usize, std::array::from_fn(moved));
            }
        }
    }

    /// Mean forces of the regions, N/m³.
    pub(super) fn shared_forces(&self, state: &State<D>) -> Vec<[f64; D]> {
        self.loads.rigid.iter().map(|region| region.mean(&*self.bonds, &state.force)).collect()
    }

    /// Adds the forces of regions to the sums of dynamic relaxation; `before` are those of the last
    /// iteration.
    pub(super) fn add_shared(
        &self,
        state: &State<D>,
        before: &[[f64; D]],
        masses: &[f64],
        mass: f64,
        sums: &mut ForceSums,
    ) {
        let forces = self.shared_forces(state);
        for ((region, before), force) in self.loads.rigid.iter().zip(before).zip(&forces) {
            for &site in &region.sites {
                let v = state.velocity.get(site as usize);
                for d in (0..D).filter(|&d| region.shares(d)) {
                    sums.free += force[d] * force[d];
                    sums.quotient_top += v[d] * (force[d] - before[d]);
                    sums.quotient_bottom += v[d] * v[d] * masses[site as usize] * mass;
                }
            }
        }
    }

    /// Sets the gradient −V f of the energy in shared components, adds f to the sum of squares, and returns
    /// the slope along a direction.
    pub(super) fn shared_gradient(
        &self,
        state: &State<D>,
        places: &ParticleMap,
        direction: &Field<D>,
        gradient: &mut Field<D>,
        sums: &mut ForceSums,
    ) -> f64 {
        let mut slope = 0.0;
        let forces = self.shared_forces(state);
        for ((region, (_, particles)), force) in self.loads.rigid.iter().zip(places.shared()).zip(&forces) {
            let volumes = region.sites.iter().map(|&site| self.bonds.volume(site as usize));
            let volume = volumes.sum::<f64>() / particles.len() as f64;
            for &particle in particles {
                let along = direction.get(particle);
                let mut value = gradient.get(particle);
                for d in (0..D).filter(|&d| region.shares(d)) {
                    value[d] = -volume * force[d];
                    sums.free += force[d] * force[d];
                    slope += value[d] * along[d];
                }
                gradient.set(particle, value);
            }
        }
        slope
    }
}
