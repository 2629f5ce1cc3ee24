//! Balance of forces, for all methods: ‖F_free‖₂ against a reference R, the greatest of
//!
//! - the reactions ‖F_held‖₂ and the body forces ‖b‖₂;
//! - a twentieth of their greatest value in any equilibrium so far, for torn bodies;
//! - a hundredth of what bonds at the grips would pull if the body were strained by min(U/L, 1): δ‖s_held‖₂,
//!   with U the largest prescribed displacement, L the body's diagonal and s = Σ_J 2kθK w V_J/|ξ|, for bodies
//!   that grips move without resistance;
//! - what rounding of displacements alone makes of forces, 4ε‖s u‖₂, over the tolerance.

use super::force_scale::Balance;
use super::passes::ForceSums;
use super::state::State;
use super::system::System;
use crate::error::Error;
use crate::field::CHUNK;
use crate::parallel;

/// Lower limit of a reference over the greatest reference of an equilibrium.
const LEAST_REFERENCE: f64 = 0.05;
/// Rounding of displacements, in units of the last place, tolerated in forces.
const ROUNDING: f64 = 4.0;
/// Iterations between updates of the rounding of displacements.
const CHECK_INTERVAL: u64 = 50;

/// Required balance of forces, and limits of a search.
#[derive(Clone, Copy, Debug)]
pub struct SearchLimits {
    /// Out-of-balance force over reference force.
    pub tolerance: f64,
    /// Limit of iterations.
    pub max_iterations: u64,
    /// Residual accepted if all iterations are used.
    pub accept: f64,
}

impl ForceSums {
    /// Returns true if every sum is finite.
    pub fn is_finite(&self) -> bool {
        let sums = [self.free, self.constrained, self.external, self.quotient_top, self.quotient_bottom];
        sums.iter().all(|x| x.is_finite())
    }

    /// Reference force of these sums only.
    fn reference(&self) -> f64 {
        self.constrained.sqrt().max(self.external.sqrt())
    }

    /// Out-of-balance force over its reference, which is at least `floor`.
    pub fn residual(&self, floor: f64) -> f64 {
        let reference = self.reference().max(floor);
        if self.free == 0.0 { 0.0 } else { self.free.sqrt() / reference.max(f64::MIN_POSITIVE) }
    }
}

impl<const D: usize> State<D> {
    /// Returns true if the rounding of displacements is measured in this iteration.
    pub(super) fn measures_rounding(&self) -> bool {
        self.counts.iteration.is_multiple_of(CHECK_INTERVAL) || self.convergence.floor == 0.0
    }

    /// Records the sums of an iterate: its residual, relative to the floor of its reference.
    pub(super) fn record_sums(&mut self, system: &System<D>, sums: &ForceSums, goal: &SearchLimits) {
        let moved = self.measures_rounding().then(|| system.scale.moved(&self.displacement));
        self.record_measured(system, sums, goal, (f64::EPSILON, moved));
    }

    /// Records the sums of an iterate whose displacements have the precision `epsilon`, with ‖s u‖₂, N/m³,
    /// where [`Self::measures_rounding`].
    pub(super) fn record_measured(
        &mut self,
        system: &System<D>,
        sums: &ForceSums,
        goal: &SearchLimits,
        (epsilon, moved): (f64, Option<f64>),
    ) {
        if let Some(moved) = moved {
            let (scale, factor) = (&system.scale, system.factors[self.step]);
            let rounding = ROUNDING * epsilon * moved / goal.tolerance;
            let strained = scale.strain(factor) * scale.constrained;
            self.convergence.floor =
                (LEAST_REFERENCE * self.convergence.reference).max(strained).max(rounding);
        }
        self.convergence.present = sums.reference();
        self.convergence.residual = sums.residual(self.convergence.floor);
    }

    /// Returns true if the search is over; an iterate in which bonds have just `broken` never ends it.
    ///
    /// # Errors
    /// [`Error::NotConverged`] if all iterations are used.
    pub(super) fn is_balanced(&mut self, goal: &SearchLimits, broken: bool) -> Result<bool, Error> {
        let balanced = self.convergence.residual <= goal.tolerance.max(self.contact.loose);
        let spent = self.counts.iteration >= goal.max_iterations;
        if !broken && (balanced || (spent && self.convergence.residual <= goal.accept)) {
            self.counts.unconverged += u64::from(!balanced);
            self.convergence.reference = self.convergence.reference.max(self.convergence.present);
            return Ok(true);
        }
        if !spent {
            return Ok(false);
        }
        Err(Error::NotConverged {
            step: self.step,
            iterations: self.counts.iteration,
            residual: self.convergence.residual,
            needed: goal.tolerance,
        })
    }
}

impl Balance {
    /// Sums the forces of a state in equilibrium.
    pub(super) fn new<const D: usize>(system: &System<D>, state: &State<D>) -> Self {
        let (bonds, factor) = (&*system.bonds, system.factors[state.step]);
        let (particles, loading) = (bonds.particles(), system.loads.force_factor(factor));
        let middle: [f64; D] = match (particles.first(), particles.last()) {
            (Some(&a), Some(&b)) => {
                let ends = [a, b].map(|site| bonds.position(site as usize));
                std::array::from_fn(|d| 0.5 * (ends[0][d] + ends[1][d]))
            }
            _ => [0.0; D],
        };
        let rigid = system.repulsion().and_then(|contact| contact.surface_forces(state.displacement.sites()));
        // force, external force, moment (yz, zx, xy), size
        let of = |sites: &[u32]| {
            let mut sums = [0.0; 10];
            for &site in sites {
                let site = site as usize;
                let (volume, constrained) = (bonds.volume(site), system.loads.constrained(site));
                let body = system.loads.body_force.as_ref().map_or([0.0; D], |b| b.get(site));
                let (total, position, moved) =
                    (state.force.get(site), bonds.position(site), state.displacement.get(site));
                let plane = rigid.as_ref().map_or([0.0; D], |field| field.get(site));
                let internal: [f64; D] =
                    std::array::from_fn(|d| volume * (total[d] - loading * body[d] - plane[d]));
                let arm: [f64; D] = std::array::from_fn(|d| position[d] + moved[d] - middle[d]);
                for d in 0..D {
                    sums[d] += internal[d];
                    let reaction = if constrained >> d & 1 == 1 { total[d] } else { 0.0 };
                    sums[3 + d] += volume * (loading * body[d] + plane[d] - reaction);
                    for e in 0..d {
                        sums[5 + d + e] += arm[e] * internal[d] - arm[d] * internal[e];
                    }
                }
                sums[9] += 0.5 * internal.iter().map(|x| x * x).sum::<f64>().sqrt();
            }
            sums
        };
        let parts: Vec<[f64; 10]> = parallel::map_chunks(particles, CHUNK, of);
        let sum = |k: usize| parts.iter().map(|part| part[k]).sum::<f64>();
        let norm = |from: usize| (from..from + 3).map(|k| sum(k).powi(2)).sum::<f64>().sqrt();
        let least = system.scale.strain(factor) * system.scale.held_sum;
        Self {
            force: norm(0),
            external: norm(3),
            moment: norm(6),
            size: sum(9).max(least),
            arm: 0.5 * system.scale.diagonal,
        }
    }
}
