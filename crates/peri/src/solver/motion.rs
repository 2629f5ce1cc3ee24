//! Where explicit dynamics are: time, steps, and when stretches must be looked at again.

use super::pace::Pace;
use crate::potential::StretchRange;
use serde::{Deserialize, Serialize};

/// Where the dynamics of a state are; all zero for a body at the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Time, s.
    pub time: f64,
    /// Time step, s.
    pub time_step: f64,
    /// Critical time step 2/ω_max of the body at the start, s (sharp).
    pub critical_step: f64,
    /// Lower bound of the critical time step by Gershgorin's theorem for all stretches covered, s.
    pub gershgorin_step: f64,
    /// Estimate of the critical time step for all stretches covered, s: between the two.
    pub covered_step: f64,
    /// Kinetic energy, J.
    pub kinetic: f64,
    /// Energy that the damping has taken, J.
    pub damped: f64,
    /// Energy that friction has taken, J.
    pub rubbed: f64,
    /// Energy of elastic slip in friction, J.
    pub(super) stuck: f64,
    /// How often the greatest frequency was bounded, and how often searched for, since the start; of solids.
    pub bounds: u64,
    /// See `bounds`.
    pub searches: u64,
    pub(super) begun: bool,
    /// Longest step in use, s.
    pub(super) longest: f64,
    /// Start of the run of equal steps under way, their number and how many are done.
    pub(super) origin: f64,
    pub(super) planned: u64,
    pub(super) taken: u64,
    /// Greatest sum of contact stiffness on a particle that is allowed for, N/m⁴.
    pub(super) contact: f64,
    /// Σ-bounds of the unbroken body, see [`Family`].
    pub(super) stiffness: f64,
    pub(super) shortest: f64,
    pub(super) extent: f64,
    /// ω_max² at the start over the law's tangent there.
    pub(super) frequency: f64,
    /// Least energy that the bonds can hold.
    pub(super) floor: f64,
    /// Largest of what was available and what has gone.
    pub(super) turnover: f64,
    /// Of a material whose stiffness is that of a displacement, see [`super::pace`].
    pub(super) pace: Pace,
    /// Stretches at the last look, and how much they may have changed since.
    pub(super) looked: [f64; 2],
    pub(super) slack: f64,
}

impl Motion {
    /// Equal steps from now to `end`, none longer than allowed.
    pub(super) fn plan(&mut self, end: f64) {
        let left = end - self.time;
        self.origin = self.time;
        self.planned = (left / self.longest - 1e-9).ceil().max(1.0) as u64;
        self.taken = 0;
        self.time_step = left / self.planned as f64;
    }

    /// The time at the end of the next step.
    pub(super) fn time_after(&self, end: f64) -> f64 {
        let taken = self.taken + 1;
        if taken == self.planned { end } else { self.origin + taken as f64 * self.time_step }
    }

    /// Notes the stretches of a look.
    pub(super) fn see(&mut self, observed: StretchRange) {
        self.looked = [observed.low, observed.high].map(|e| (1.0 + e).max(0.0).sqrt());
        self.slack = 0.0;
    }

    /// Whether stretches may have left what is fitted, or reached the critical one. A bond's stretch changes by no more
    /// than its ends' increments over its length.
    pub(super) fn must_look(&self, fitted: [f64; 2], critical: Option<f64>) -> bool {
        let [low, high] = [self.looked[0] - self.slack, self.looked[1] + self.slack];
        // NaN looks, too
        let inside = low >= fitted[0] && high <= fitted[1] && critical.is_none_or(|c| high <= c);
        !inside
    }
}
