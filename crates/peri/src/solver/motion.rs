//! Explicit dynamics of a state: time, steps, energies, and the next check of stretches.

use crate::potential::StretchRange;
use serde::{Deserialize, Serialize};

/// Dynamics of a state; all zero at the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// True once dynamics has begun.
    pub(super) begun: bool,
    /// Time steps of the run before it.
    pub(super) earlier: u64,
    /// Time, s.
    pub time: f64,
    /// Present sequence of equal time steps.
    pub steps: EqualSteps,
    /// Bounds of the time step.
    pub limits: StepLimits,
    /// Energies.
    pub energies: DynamicEnergies,
    /// Stretches at the last check.
    pub(super) look: StretchLook,
    /// Stiffness control of materials whose stiffness depends on the displacement, see
    /// [`super::stiffness_control`].
    pub(super) pace: StiffnessControl,
}

/// Sequence of equal time steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EqualSteps {
    /// Time step, s.
    pub time_step: f64,
    /// Start, s, number of steps planned and taken.
    pub(super) origin: f64,
    pub(super) planned: u64,
    pub(super) taken: u64,
}

/// Bounds of the time step and their causes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepLimits {
    /// Critical time step 2/ω_max of the body at the start, s (sharp).
    pub critical_step: f64,
    /// Lower bound of the critical time step by Gershgorin's theorem for all stretches covered, s.
    pub gershgorin_step: f64,
    /// Estimate of the critical time step for all stretches covered, s: between the two.
    pub covered_step: f64,
    /// Number of bounds of the greatest frequency computed since the start, for solids.
    pub bounds: u64,
    /// Number of searches for the greatest frequency since the start, for solids.
    pub searches: u64,
    /// Longest step in use, s.
    pub(super) longest: f64,
    /// Greatest sum of contact stiffness on a particle included in the limits, N/m⁴.
    pub(super) contact: f64,
    /// Stiffness of the contact of a rigid surface over its mass included in the limits, 1/s².
    pub(super) striking: f64,
    /// ω_max² at the start over the law's tangent there.
    pub(super) frequency: f64,
    /// Sums over the bonds of the unbroken body.
    pub(super) bonds: BondSums,
}

/// Energies of explicit dynamics, J.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DynamicEnergies {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Energy dissipated by damping.
    pub damped: f64,
    /// Energy dissipated by friction.
    pub rubbed: f64,
    /// Energy of elastic slip in friction.
    pub(super) stuck: f64,
    /// Least energy that the bonds can hold.
    pub(super) floor: f64,
    /// Largest energy so far, of that available and that dissipated.
    pub(super) turnover: f64,
}

/// Stretches at the last check, and how much they may have changed since.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct StretchLook {
    pub stretches: [f64; 2],
    pub slack: f64,
}

/// Sums that bound the frequencies of a body and the energy of its bonds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BondSums {
    /// max_I Σ_J 2 w V_J/|ξ|: the stiffness of a particle's bonds for a unit tangent kθ t′, m.
    pub stiffness: f64,
    /// Shortest bond, m; ∞ without bonds.
    pub shortest: f64,
    /// Σ_I V_I Σ_J w V_J |ξ|: the energy of all bonds for kθ φ = 1.
    pub extent: f64,
}

/// Greatest frequency, as far as known, see [`super::stiffness_control`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StiffnessControl {
    /// m when ω² was last measured, N/m⁴, and r.
    pub(super) bound: f64,
    pub(super) part: f64,
    /// ρω² covered by the present steps, without the margin.
    pub(super) covered: f64,
    /// m at the last check, steps between it and the next, and steps until then; checks since steps were
    /// changed.
    pub(super) last: f64,
    pub(super) every: u32,
    pub(super) due: u32,
    pub(super) looks: u32,
    /// Upper bound of the strain since the last check.
    pub(super) strain: f64,
    /// Least and greatest stretch for which r holds, and whether a check has found others.
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
    /// Time at the end of the next step.
    pub(super) fn time_after(&self, end: f64) -> f64 {
        let taken = self.taken + 1;
        if taken == self.planned { end } else { self.origin + taken as f64 * self.time_step }
    }
}

impl StretchLook {
    /// Records the stretches of a check.
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

    /// Returns true if stretches may have left the fitted range or reached the critical one. A bond's stretch
    /// changes by no more than its ends' increments over its length.
    pub fn is_due(&self, fitted: [f64; 2], critical: Option<f64>) -> bool {
        let [low, high] = [self.stretches[0] - self.slack, self.stretches[1] + self.slack];
        // NaN counts as due
        let inside = low >= fitted[0] && high <= fitted[1] && critical.is_none_or(|c| high <= c);
        !inside
    }
}
