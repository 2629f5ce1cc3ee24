//! Adaptive dynamic relaxation: damped pseudo-dynamics with unit time step, a fictitious mass from the bonds'
//! stiffness and a damping from the Rayleigh quotient of the last increment, until the forces balance.
//! Underwood (1983), in Computational Methods for Transient Analysis; Kilic & Madenci (2010), doi:10.1016/j.tafmec.2010.08.001,
//! with the quotient taken on increments (the displacement-weighted form has negative stiffness in many iterations).

use super::load::Loads;
use super::passes::{force_pass, move_pass};
use crate::bonds::{Bonds, StretchRange, stretch_range};
use crate::error::Error;
use crate::field::Field;
use crate::potential::{BondPotential, KernelFit};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Iterations between looks at the stretches.
const LOOK: u64 = 10;
/// Stretches below this are not fitted.
const SMALLEST_STRETCH: f64 = 1e-3;

/// Settings of the method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdaptiveDynamicRelaxation {
    /// Out-of-balance force over reference force at which a step is converged.
    pub tolerance: f64,
    /// Iterations a step may take.
    pub max_iterations: u64,
    /// Factor S on the fictitious mass above the Gershgorin bound.
    pub mass_safety: f64,
    /// Largest error of the fitted bond law, relative.
    pub fit_bound: f64,
}

impl Default for AdaptiveDynamicRelaxation {
    fn default() -> Self {
        Self { tolerance: 1e-3, max_iterations: 100_000, mass_safety: 1.1, fit_bound: 1e-9 }
    }
}

/// Everything an interrupted run needs to go on with the same bits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct State<const D: usize> {
    /// Displacement, m.
    pub displacement: Field<D>,
    pub(super) velocity: Field<D>,
    /// Force density with loads, N/m³: out of balance where free, reaction where held.
    pub force: Field<D>,
    /// Load steps finished.
    pub step: usize,
    /// Iterations of the current step.
    pub iteration: u64,
    /// Iterations of all steps.
    pub total_iterations: u64,
    /// Force evaluations so far.
    pub evaluations: u64,
    /// Stretches [λ_low, λ_high] that the fitted law covers.
    pub fitted: [f64; 2],
    /// Stretches met, as e = λ² − 1.
    pub met: StretchRange,
    /// Largest relative bond tangent max(|t′|, |t|/λ)/kθ over the stretches met.
    tangent: f64,
    /// Running maximum of the reference force.
    reference: f64,
}

impl<const D: usize> State<D> {
    /// The undeformed body.
    pub fn new(slots: usize) -> Self {
        Self {
            displacement: Field::zeros(slots),
            velocity: Field::zeros(slots),
            force: Field::zeros(slots),
            step: 0,
            iteration: 0,
            total_iterations: 0,
            evaluations: 0,
            fitted: [0.95, 1.05],
            met: StretchRange::REST,
            tangent: 0.0,
            reference: 0.0,
        }
    }
}

/// One iteration, for progress bars and logs.
#[derive(Clone, Copy, Debug)]
pub struct Status {
    /// Load step, from 0.
    pub step: usize,
    /// Load steps in all.
    pub steps: usize,
    /// Iterations of this step.
    pub iteration: u64,
    /// Out-of-balance force over its reference.
    pub residual: f64,
    /// The tolerance on it.
    pub tolerance: f64,
    /// Norm of the reactions, N/m³ over all held components.
    pub reaction: f64,
    /// Damping coefficient used.
    pub damping: f64,
}

/// The system under solution.
pub struct System<'a, const D: usize> {
    /// The bonds; their law is set by the solver.
    pub bonds: &'a mut dyn Bonds<D>,
    /// The bond law.
    pub law: &'a dyn BondPotential,
    /// kθ, N/m⁶ (3D) with the dimension's own convention.
    pub modulus: f64,
    /// Loads at factor 1.
    pub loads: &'a Loads<D>,
    /// Load factor at the end of each step.
    pub factors: &'a [f64],
}

impl AdaptiveDynamicRelaxation {
    /// Solves the remaining load steps of `state`. `watch` sees every iteration and may stop the run by an error;
    /// `finished` sees every converged step.
    ///
    /// # Errors
    /// [`Error::NotConverged`], [`Error::NotFinite`], and whatever `watch` and `finished` return.
    pub fn solve<const D: usize>(
        &self,
        system: &mut System<D>,
        state: &mut State<D>,
        watch: &mut dyn FnMut(&Status, &State<D>) -> Result<(), Error>,
        finished: &mut dyn FnMut(&dyn Bonds<D>, &State<D>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let unit_mass = unit_mass(&*system.bonds);
        let predictor = system.loads.affine_predictor(&*system.bonds, system.modulus * system.law.tangent());
        self.fit(system, state)?;
        while state.step < system.factors.len() {
            if state.iteration == 0 {
                let before = state.step.checked_sub(1).map_or(0.0, |s| system.factors[s]);
                predict(system, state, &predictor, system.factors[state.step] - before);
                // the step may leap out of the fitted range: its first force and mass must know
                self.covers_stretches(system, state)?;
            }
            loop {
                let done = self.iterate(system, state, &unit_mass, watch)?;
                if done && self.covers_stretches(system, state)? {
                    break;
                }
            }
            state.step += 1;
            state.iteration = 0;
            finished(&*system.bonds, state)?;
        }
        Ok(())
    }

    /// One iteration; true where the forces balance (the displacement is then left as it is).
    fn iterate<const D: usize>(
        &self,
        system: &mut System<D>,
        state: &mut State<D>,
        unit_mass: &[f64],
        watch: &mut dyn FnMut(&Status, &State<D>) -> Result<(), Error>,
    ) -> Result<bool, Error> {
        // a step's first iterations move farthest: beyond its range a fit must not be followed for long
        let look = state.iteration < LOOK || state.iteration.is_multiple_of(LOOK);
        let factor = system.factors[state.step];
        let mass = 0.5 * self.mass_safety * state.tangent;
        let (sums, met) = force_pass(system, state, unit_mass, mass, factor, look);
        state.evaluations += 1;
        if ![sums.free, sums.held, sums.quotient_top, sums.quotient_bottom].iter().all(|x| x.is_finite()) {
            return Err(not_finite(&*system.bonds, state));
        }
        state.met = state.met.join(met);
        if look {
            // after a refit this force still belongs to the old fit, whose range it left by little: go on
            self.widen(system, state)?;
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
        let status = Status {
            step: state.step,
            steps: system.factors.len(),
            iteration: state.iteration,
            residual,
            tolerance: self.tolerance,
            reaction: sums.held.sqrt(),
            damping,
        };
        if residual <= self.tolerance {
            return Ok(true);
        }
        if state.iteration >= self.max_iterations {
            return Err(Error::NotConverged {
                step: state.step,
                iterations: state.iteration,
                residual,
                needed: self.tolerance,
            });
        }
        move_pass(system.loads, state, unit_mass, mass, damping);
        state.iteration += 1;
        state.total_iterations += 1;
        watch(&status, state)?;
        Ok(false)
    }

    /// After convergence: whether every stretch of the solution lies within the fit; widens it otherwise.
    fn covers_stretches<const D: usize>(
        &self,
        system: &mut System<D>,
        state: &mut State<D>,
    ) -> Result<bool, Error> {
        let met = stretch_range(&*system.bonds, &state.displacement);
        state.evaluations += 1;
        state.met = state.met.join(met);
        Ok(!self.widen(system, state)?)
    }

    /// Widens the fitted range where stretches have left it, and the mass where the tangent grew.
    fn widen<const D: usize>(&self, system: &mut System<D>, state: &mut State<D>) -> Result<bool, Error> {
        // bonds crushed below that are extrapolated: no fit covers l → 0
        let low = (1.0 + state.met.low).max(0.0).sqrt().max(SMALLEST_STRETCH);
        let high = (1.0 + state.met.high).sqrt();
        if low >= state.fitted[0] && high <= state.fitted[1] {
            return Ok(false);
        }
        // twice the strain met, so that a growing load does not refit at every look
        state.fitted[0] = state.fitted[0].min((1.0 - 2.0 * (1.0 - low)).max(0.5 * low)).max(SMALLEST_STRETCH);
        state.fitted[1] = state.fitted[1].max(1.0 + 2.0 * (high - 1.0));
        self.fit(system, state)?;
        Ok(true)
    }

    fn fit<const D: usize>(&self, system: &mut System<D>, state: &mut State<D>) -> Result<(), Error> {
        let fit = KernelFit::new(system.law, state.fitted, self.fit_bound)?;
        system.bonds.set_law(&fit, system.modulus);
        let [low, high] = state.fitted;
        let samples = 200;
        let tangent = (0..=samples)
            .map(|k| {
                let stretch = low + (high - low) * f64::from(k) / f64::from(samples);
                let slope = system.law.tension_derivative(stretch).abs();
                slope.max(system.law.tension(stretch).abs() / stretch)
            })
            .fold(0.0, f64::max);
        state.tangent = tangent * system.modulus;
        Ok(())
    }
}

/// Σ_J (2 w V_J/|ξ|)(1 + max_{d≠e} |n_d n_e|): the Gershgorin sum of a particle for a unit bond tangent.
/// 1 where there is no bond, so that empty slots stay at rest.
fn unit_mass<const D: usize>(bonds: &dyn Bonds<D>) -> Vec<f64> {
    let mut mass = vec![1.0; bonds.slots()];
    let sums: Vec<f64> = bonds
        .particles()
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
    for (&slot, sum) in bonds.particles().iter().zip(sums) {
        mass[slot as usize] = sum;
    }
    mass
}

/// Moves the body with its grips and lets it start from rest.
fn predict<const D: usize>(
    system: &System<D>,
    state: &mut State<D>,
    predictor: &[[f64; 4]; D],
    increment: f64,
) {
    let factor = system.factors[state.step];
    for &slot in system.bonds.particles() {
        let slot = slot as usize;
        let position = system.bonds.position(slot);
        let mut value = state.displacement.get(slot);
        let held = system.loads.held(slot);
        for d in 0..D {
            if held >> d & 1 == 1 {
                value[d] =
                    factor * system.loads.displacement.as_ref().map_or(0.0, |field| field.get(slot)[d]);
            } else {
                let affine: f64 = (0..D).map(|e| predictor[d][e + 1] * position[e]).sum();
                value[d] += increment * (predictor[d][0] + affine);
            }
        }
        state.displacement.set(slot, value);
        state.velocity.set(slot, [0.0; D]);
    }
}

fn not_finite<const D: usize>(bonds: &dyn Bonds<D>, state: &State<D>) -> Error {
    let fields =
        [("displacement", &state.displacement), ("velocity", &state.velocity), ("force", &state.force)];
    for (quantity, field) in fields {
        if let Some((slot, _)) = field.non_finite() {
            let particle = bonds.particles().partition_point(|&s| (s as usize) < slot);
            return Error::NotFinite {
                quantity,
                particle,
                position: bonds.position(slot).to_vec(),
                step: state.step,
                iteration: state.iteration,
            };
        }
    }
    // every entry is finite, their squares are not: the greatest force is to blame
    let size = |slot: u32| state.force.get(slot as usize).iter().fold(0.0_f64, |m, f| m.max(f.abs()));
    let particles = bonds.particles().iter().enumerate();
    let greatest = particles.max_by(|a, b| size(*a.1).total_cmp(&size(*b.1)));
    Error::NotFinite {
        quantity: "sum of squared forces",
        particle: greatest.map_or(0, |(particle, _)| particle),
        position: greatest.map_or_else(Vec::new, |(_, &slot)| bonds.position(slot as usize).to_vec()),
        step: state.step,
        iteration: state.iteration,
    }
}
