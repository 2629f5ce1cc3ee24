//! When forces balance, for every method alike: ‖F_free‖₂ against the reactions, or the body forces where they are
//! larger, but not against less than a twentieth of what these have been.

use super::passes::Sums;
use super::system::State;
use crate::error::Error;

/// Part of the greatest reference so far below which a reference does not fall.
const LEAST_REFERENCE: f64 = 0.05;

/// How well forces must balance, and how long a search may take.
#[derive(Clone, Copy, Debug)]
pub struct Goal {
    /// Out-of-balance force over reference force.
    pub tolerance: f64,
    /// Iterations.
    pub max_iterations: u64,
    /// Residual that will do where all iterations are used.
    pub accept: f64,
}

impl Sums {
    /// Whether every sum is finite.
    pub fn is_finite(&self) -> bool {
        let sums = [self.free, self.held, self.external, self.quotient_top, self.quotient_bottom];
        sums.iter().all(|x| x.is_finite())
    }

    /// Reference force of these sums alone.
    fn reference(&self) -> f64 {
        self.held.sqrt().max(self.external.sqrt())
    }

    /// Out-of-balance force over its reference, with `greatest` the greatest so far.
    pub fn residual(&self, greatest: f64) -> f64 {
        let reference = self.reference().max(LEAST_REFERENCE * greatest);
        if self.free == 0.0 { 0.0 } else { self.free.sqrt() / reference.max(f64::MIN_POSITIVE) }
    }
}

impl<const D: usize> State<D> {
    /// Takes note of an iterate's sums: its residual, and the greatest reference.
    pub(super) fn note(&mut self, sums: &Sums) {
        self.reference = self.reference.max(sums.reference());
        self.residual = sums.residual(self.reference);
    }

    /// Whether the search is over; an iterate in which bonds have just `broken` never ends it.
    ///
    /// # Errors
    /// [`Error::NotConverged`].
    pub(super) fn is_balanced(&mut self, goal: &Goal, broken: bool) -> Result<bool, Error> {
        if self.residual <= goal.tolerance && !broken {
            return Ok(true);
        }
        if self.iteration < goal.max_iterations {
            return Ok(false);
        }
        if self.residual <= goal.accept && !broken {
            self.unconverged += 1;
            return Ok(true);
        }
        Err(Error::NotConverged {
            step: self.step,
            iterations: self.iteration,
            residual: self.residual,
            needed: goal.tolerance,
        })
    }
}
