//! Explicit dynamics of a state: time, steps, energies, and when stretches must be looked at again.

use crate::potential::StretchRange;
use serde::{Deserialize, Serialize};

/// Dynamics of a state; all zero for a body at the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Whether dynamics have begun.
    pub(super) begun: bool,
    /// Time, s.
    pub time: f64,
    /// Run of equal time steps under way.
    pub steps: EqualSteps,
    /// Bounds of the time step.
    pub limits: StepLimits,
    /// Energies.
    pub energies: Energies,
    /// Stretches at the last look.
    pub(super) look: StretchLook,
    /// Of a material whose stiffness is that of a displacement, see [`super::pace`].
    pub(super) pace: Pace,
}

/// Run of equal time steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EqualSteps {
    /// Time step, s.
    pub time_step: f64,
    /// Start, s, number of steps and how many are done.
    pub(super) origin: f64,
    pub(super) planned: u64,
    pub(super) taken: u64,
}

/// Bounds of the time step and what they follow from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepLimits {
    /// Critical time step 2/ω_max of the body at the start, s (sharp).
    pub critical_step: f64,
    /// Lower bound of the critical time step by Gershgorin's theorem for all stretches covered, s.
    pub gershgorin_step: f64,
    /// Estimate of the critical time step for all stretches covered, s: between the two.
    pub covered_step: f64,
    /// How often the greatest frequency was bounded, and how often searched for, since the start; of solids.
    pub bounds: u64,
    /// See `bounds`.
    pub searches: u64,
    /// Longest step in use, s.
    pub(super) longest: f64,
    /// Greatest sum of contact stiffness on a particle that is allowed for, N/m⁴.
    pub(super) contact: f64,
    /// ω_max² at the start over the law's tangent there.
    pub(super) frequency: f64,
    /// Sums over the bonds of the unbroken body.
    pub(super) bonds: BondSums,
}

/// Energies of explicit dynamics, J.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Energies {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Energy that the damping has taken.
    pub damped: f64,
    /// Energy that friction has taken.
    pub rubbed: f64,
    /// Energy of elastic slip in friction.
    pub(super) stuck: f64,
    /// Least energy that the bonds can hold.
    pub(super) floor: f64,
    /// Largest of what was available and what has gone.
    pub(super) turnover: f64,
}

/// Stretches at the last look, and how much they may have changed since.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct StretchLook {
    pub stretches: [f64; 2],
    pub slack: f64,
}

/// What bounds the frequencies of a body, and what its bonds can store at most and least.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BondSums {
    /// max_I Σ_J 2 w V_J/|ξ|: the stiffness of a particle's bonds for a unit tangent kθ t′, m.
    pub stiffness: f64,
    /// Shortest bond, m; ∞ without bonds.
    pub shortest: f64,
    /// Σ_I V_I Σ_J w V_J |ξ|: the energy of all bonds for kθ φ = 1.
    pub extent: f64,
}

/// Greatest frequency, as far as it is known, see [`super::pace`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pace {
    /// m when ω² was last measured, N/m⁴, and r.
    pub(super) bound: f64,
    pub(super) part: f64,
    /// ρω² that steps are made for, without the margin.
    pub(super) covered: f64,
    /// m at the last look, steps between it and the next, and steps until then; looks since steps were changed.
    pub(super) last: f64,
    pub(super) every: u32,
    pub(super) due: u32,
    pub(super) looks: u32,
    /// Strain since the last look, at most.
    pub(super) strain: f64,
    /// Least and greatest stretch for which r holds, and whether a look has met others.
    pub(super) known: [f64; 2],
    pub(super) outgrown: bool,
}

impl Motion {
    /// Plans equal steps from now to `end`, none longer than allowed.
    pub(super) fn plan(&mut self, end: f64) {
        let left = end - self.time;
        let planned = (left / self.limits.longest - 1e-9).ceil().max(1.0) as u64;
        self.steps = EqualSteps { time_step: left / planned as f64, origin: self.time, planned, taken: 0 };
    }
}

impl EqualSteps {
    /// The time at the end of the next step.
    pub(super) fn time_after(&self, end: f64) -> f64 {
        let taken = self.taken + 1;
        if taken == self.planned { end } else { self.origin + taken as f64 * self.time_step }
    }
}

impl StretchLook {
    /// Notes the stretches of a look.
    pub fn new(observed: StretchRange) -> Self {
        let stretches = [observed.low, observed.high].map(|e| (1.0 + e).max(0.0).sqrt());
        Self { stretches, slack: 0.0 }
    }

    /// By how much stretches may change before [`Self::is_due`].
    #[cfg(feature = "gpu")]
    pub fn room(&self, fitted: [f64; 2], critical: Option<f64>) -> f64 {
        let high = fitted[1].min(critical.unwrap_or(f64::INFINITY));
        (self.stretches[0] - fitted[0]).min(high - self.stretches[1]) - self.slack
    }

    /// Whether stretches may have left what is fitted, or reached the critical one. A bond's stretch changes by no more
    /// than its ends' increments over its length.
    pub fn is_due(&self, fitted: [f64; 2], critical: Option<f64>) -> bool {
        let [low, high] = [self.stretches[0] - self.slack, self.stretches[1] + self.slack];
        // NaN looks, too
        let inside = low >= fitted[0] && high <= fitted[1] && critical.is_none_or(|c| high <= c);
        !inside
    }
}
