//! Vectors of L-BFGS on the host, over particles.

use super::lbfgs::{Lbfgs, LinePoint, SearchVectors};
use super::lbfgs_memory::LbfgsMemory;
use super::particle_map::ParticleMap;
use super::passes::gradient_pass;
use super::preconditioner::Preconditioner;
use super::state::State;
use super::system::System;
use crate::bonds::stretch_range;
use crate::contact::Contact;
use crate::error::Error;
use crate::field::Field;

/// Largest change of a bond over its length in a step with softening bonds, so that none jumps over its
/// energy's maximum.
pub(super) const LARGEST_CHANGE: f64 = 0.3;
/// Scale at which a direction exceeds the bonds by far; a power of 2, so that nothing is rounded.
pub(super) const HUGE_SCALE: f64 = (1_u64 << 40) as f64;

/// Vectors of a search, with a preconditioner of two levels.
pub struct HostVectors<const D: usize> {
    preconditioner: Preconditioner<D>,
    memory: LbfgsMemory<D>,
    /// Positions of particles in storage: all fields below are over particles.
    places: ParticleMap,
    /// Gradients −V F of the energy at the iterate and at the trial, 0 where constrained.
    gradient: Field<D>,
    trial: Field<D>,
    /// z = B g at both.
    image: Field<D>,
    trial_image: Field<D>,
    direction: Field<D>,
    /// True if the coarse level is left out because it gave no descent direction.
    local_only: bool,
}

impl<const D: usize> HostVectors<D> {
    /// Creates vectors without any computed data, for `memory` pairs.
    pub fn new(memory: usize) -> Self {
        Self {
            preconditioner: Preconditioner::new(),
            memory: LbfgsMemory::new(memory),
            places: ParticleMap::default(),
            gradient: Field::zeros(0),
            trial: Field::zeros(0),
            image: Field::zeros(0),
            trial_image: Field::zeros(0),
            direction: Field::zeros(0),
            local_only: false,
        }
    }

    /// Degrees of freedom of the coarse level and entries of its factors.
    pub fn coarse_size(&self) -> [usize; 2] {
        self.preconditioner.coarse_size()
    }

    fn apply(&mut self) {
        self.preconditioner.apply(&self.places, &self.gradient, &mut self.image, self.local_only);
    }
}

impl<const D: usize> SearchVectors<D> for HostVectors<D> {
    const HOLDS: bool = true;

    fn build(&mut self, system: &mut System<D>, state: &State<D>, settings: &Lbfgs) -> Result<(), Error> {
        let particles = system.bonds.particles().len();
        let fields = [
            &mut self.gradient,
            &mut self.trial,
            &mut self.image,
            &mut self.trial_image,
            &mut self.direction,
        ];
        if fields[0].sites() != particles {
            fields.into_iter().for_each(|field| *field = Field::zeros(particles));
            self.places = ParticleMap::new(&*system.bonds, &system.loads);
        }
        self.memory.clear(true);
        self.local_only = false;
        let coarsening = Some(settings.coarsening.max(2.0)).filter(|edge| edge.is_finite());
        self.preconditioner.build(system, state, settings.weight, coarsening);
        Ok(())
    }

    fn is_built(&self) -> bool {
        self.preconditioner.is_built()
    }

    fn take(&mut self, _: &mut System<D>, _: &State<D>) -> Result<(), Error> {
        Ok(())
    }

    fn give(&self, _: &mut System<D>, _: &mut State<D>) -> Result<(), Error> {
        Ok(())
    }

    /// The gradient goes to `trial`.
    fn evaluate(&mut self, system: &mut System<D>, state: &mut State<D>) -> Result<LinePoint, Error> {
        let factor = system.loads.force_factor(system.factors[state.step]);
        system.prepare(&mut state.displacement);
        system.follow(&state.displacement);
        let body = (&self.places, self.preconditioner.volumes());
        let (sums, observed, slope) =
            gradient_pass(system, state, body, &self.direction, factor, &mut self.trial);
        system.count_evaluation(state);
        Ok(LinePoint { sums, observed, slope })
    }

    fn rounding(&mut self, system: &System<D>, state: &State<D>) -> Result<(f64, f64), Error> {
        Ok((system.scale.moved(&state.displacement), f64::EPSILON))
    }

    fn step(&mut self, state: &mut State<D>, step: f64) {
        self.places.add_scaled(&mut state.displacement, step, &self.direction);
    }

    /// Limited if bonds soften, or particles are in contact: the energy is not convex there.
    fn longest_step(&mut self, system: &System<D>, state: &State<D>, most: f64) -> Result<f64, Error> {
        let softens = system.material.softens_at((1.0 + most).sqrt());
        if !softens && system.repulsion().is_none() {
            return Ok(f64::INFINITY);
        }
        let spread = |factor: f64| {
            let mut field = Field::zeros(state.displacement.sites());
            self.places.add_scaled(&mut field, factor, &self.direction);
            field
        };
        let touching =
            |contact: &Contact<D>| contact.longest_step(&*system.bonds, &state.displacement, &spread(1.0));
        let longest = system.repulsion().map_or(f64::INFINITY, touching);
        if !softens {
            return Ok(longest);
        }
        let range = stretch_range(&*system.bonds, &spread(HUGE_SCALE));
        Ok((LARGEST_CHANGE * HUGE_SCALE / (1.0 + range.high).sqrt()).min(longest))
    }

    fn direct(&mut self) -> Result<f64, Error> {
        Ok(self.memory.direction(&self.gradient, &self.image, &mut self.direction))
    }

    fn direct_anew(&mut self) -> Result<f64, Error> {
        self.apply();
        self.direct()
    }

    fn accept(&mut self, step: f64, least: f64) -> Result<(), Error> {
        std::mem::swap(&mut self.gradient, &mut self.trial);
        self.preconditioner.apply(&self.places, &self.gradient, &mut self.trial_image, self.local_only);
        self.memory.add(
            step,
            &self.direction,
            (&self.trial, &self.image),
            (&self.gradient, &self.trial_image),
            least,
        );
        std::mem::swap(&mut self.image, &mut self.trial_image);
        Ok(())
    }

    fn arrive(&mut self) {
        std::mem::swap(&mut self.gradient, &mut self.trial);
        self.apply();
    }

    fn forget(&mut self, scale_too: bool) {
        self.memory.clear(scale_too);
    }

    fn simplify(&mut self) {
        self.local_only = self.memory.is_empty() && !self.local_only;
        self.memory.clear(true);
    }

    fn bonds_broke(&mut self, system: &System<D>, sites: &[u32]) {
        self.preconditioner.bonds_broke(&*system.bonds, sites);
    }
}
