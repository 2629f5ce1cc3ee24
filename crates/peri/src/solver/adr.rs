//! Adaptive dynamic relaxation: damped pseudo-dynamics with unit time step, a fictitious mass from the bonds'
//! stiffness and a damping from the Rayleigh quotient of the last increment, until the forces balance.
//! Underwood (1983), in Computational Methods for Transient Analysis; Kilic & Madenci (2010), doi:10.1016/j.tafmec.2010.08.001,
//! with the quotient taken on increments (the displacement-weighted form has negative stiffness in many iterations).

use super::march::{Equilibrium, Watch, march};
use super::passes::{force_pass, move_pass};
use super::system::{State, Status, System};
use crate::bonds::Bonds;
use crate::error::Error;
use rayon::prelude::*;

/// Iterations between looks at the stretches.
const LOOK: u64 = 10;

/// Settings of the method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdaptiveDynamicRelaxation {
    /// Out-of-balance force over reference force at which a step is converged.
    pub tolerance: f64,
    /// Iterations that a search for equilibrium may take.
    pub max_iterations: u64,
    /// Factor S on the fictitious mass above the Gershgorin bound.
    pub mass_safety: f64,
}

impl Default for AdaptiveDynamicRelaxation {
    fn default() -> Self {
        Self { tolerance: 1e-3, max_iterations: 100_000, mass_safety: 1.1 }
    }
}

impl AdaptiveDynamicRelaxation {
    /// Solves the remaining load steps of `state`. `watch` sees every iteration and may stop the run by an error;
    /// `finished` sees every finished step.
    ///
    /// # Errors
    /// [`Error::NotConverged`], [`Error::NotFinite`], and whatever `watch` and `finished` return.
    pub fn solve<const D: usize>(
        &self,
        system: &mut System<D>,
        state: &mut State<D>,
        watch: &mut Watch<D>,
        finished: &mut dyn FnMut(&dyn Bonds<D>, &State<D>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        march(&mut Relaxation::new(*self), system, state, watch, finished)
    }
}

/// The method at work.
pub struct Relaxation {
    settings: AdaptiveDynamicRelaxation,
    /// Gershgorin sums for a unit bond tangent; made when first needed.
    unit_mass: Vec<f64>,
}

impl Relaxation {
    /// Nothing is computed yet.
    pub fn new(settings: AdaptiveDynamicRelaxation) -> Self {
        Self { settings, unit_mass: Vec::new() }
    }

    /// One iteration; true where the forces balance (the displacement is then left as it is).
    fn iterate<const D: usize>(
        &mut self,
        system: &mut System<D>,
        state: &mut State<D>,
        watch: &mut Watch<D>,
    ) -> Result<bool, Error> {
        let settings = self.settings;
        // a step's first iterations move farthest: beyond its range a fit must not be followed for long
        let look =
            system.breaks_on_the_way() || state.iteration < LOOK || state.iteration.is_multiple_of(LOOK);
        let factor = system.factors[state.step];
        let mass = 0.5 * settings.mass_safety * state.tangent;
        let (sums, met) = force_pass(system, state, &self.unit_mass, mass, factor, look);
        system.count_evaluation(state);
        if ![sums.free, sums.held, sums.quotient_top, sums.quotient_bottom].iter().all(|x| x.is_finite()) {
            return Err(system.not_finite(state));
        }
        state.met = state.met.join(met);
        let mut broken = false;
        if look {
            // after a refit this force still belongs to the old fit, whose range it left by little: go on
            system.widen(state)?;
            if system.breaks_on_the_way() && system.is_overstretched(met) {
                let slots = system.break_bonds(state);
                broken = !slots.is_empty();
                Equilibrium::broke(self, system, &slots);
            }
        }
        let reference = sums.held.sqrt().max(sums.external.sqrt());
        state.reference = state.reference.max(reference);
        let reference = reference.max(0.05 * state.reference);
        let residual =
            if sums.free == 0.0 { 0.0 } else { sums.free.sqrt() / reference.max(f64::MIN_POSITIVE) };
        let quotient = if state.iteration > 0 && sums.quotient_bottom > 0.0 {
            -sums.quotient_top / sums.quotient_bottom
        } else {
            0.0
        };
        let damping = (2.0 * quotient.max(0.0).sqrt()).clamp(0.0, 1.9);
        state.residual = residual;
        if residual <= settings.tolerance && !broken {
            return Ok(true);
        }
        if state.iteration >= settings.max_iterations {
            return Err(Error::NotConverged {
                step: state.step,
                iterations: state.iteration,
                residual,
                needed: settings.tolerance,
            });
        }
        move_pass(&system.loads, state, &self.unit_mass, mass, damping);
        state.iteration += 1;
        state.step_iterations += 1;
        state.total_iterations += 1;
        let status = Status {
            step: state.step,
            steps: system.factors.len(),
            iteration: state.iteration,
            residual,
            tolerance: settings.tolerance,
            reaction: sums.held.sqrt(),
            damping,
            broken: state.broken,
            restartable: true,
        };
        watch(&status, state)?;
        Ok(false)
    }
}

impl<const D: usize> Equilibrium<D> for Relaxation {
    fn equilibrate(
        &mut self,
        system: &mut System<D>,
        state: &mut State<D>,
        watch: &mut Watch<D>,
    ) -> Result<(), Error> {
        if self.unit_mass.len() != system.bonds.slots() {
            self.unit_mass = vec![1.0; system.bonds.slots()];
            let particles = system.bonds.particles();
            update_unit_mass(&*system.bonds, particles, &mut self.unit_mass);
        }
        while !self.iterate(system, state, watch)? {}
        Ok(())
    }

    fn broke(&mut self, system: &System<D>, slots: &[u32]) {
        update_unit_mass(&*system.bonds, slots, &mut self.unit_mass);
    }
}

/// Σ_J (2 w V_J/|ξ|)(1 + max_{d≠e} |n_d n_e|): the Gershgorin sum of a particle for a unit bond tangent.
/// 1 where there is no bond, so that empty slots and detached particles stay at rest.
fn update_unit_mass<const D: usize>(bonds: &dyn Bonds<D>, slots: &[u32], mass: &mut [f64]) {
    let sums: Vec<f64> = slots
        .par_iter()
        .map(|&slot| {
            let mut sum = 0.0;
            bonds.neighbours(slot as usize, &mut |bond| {
                let cosine: [f64; D] = bond.bond.map(|x| (x / bond.length).abs());
                let mixed = (0..D).flat_map(|d| (0..d).map(move |e| (d, e)));
                let mixed = mixed.map(|(d, e)| cosine[d] * cosine[e]).fold(0.0, f64::max);
                sum += 2.0 * bond.weight / bond.length * (1.0 + mixed);
            });
            if sum > 0.0 { sum } else { 1.0 }
        })
        .collect();
    for (&slot, sum) in slots.iter().zip(sums) {
        mass[slot as usize] = sum;
    }
}
