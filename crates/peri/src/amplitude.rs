//! Multiples of loads over the part τ of the time of a run.

use std::fmt;
use std::sync::Arc;

/// Parts of the time at which the largest multiple is sought.
const MOMENTS: u32 = 256;

/// Multiple of a load over τ, and its rate.
#[derive(Clone)]
pub struct Amplitude(Arc<dyn Fn(f64) -> (f64, f64) + Send + Sync>);

impl fmt::Debug for Amplitude {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Amplitude(0: {:?}, 1: {:?})", self.multiple(0.0), self.multiple(1.0))
    }
}

/// Amplitudes are equal if they share their function.
impl PartialEq for Amplitude {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl Amplitude {
    /// Creates an amplitude from a function of τ.
    pub fn new(amplitude: impl Fn(f64) -> (f64, f64) + Send + Sync + 'static) -> Self {
        Self(Arc::new(amplitude))
    }

    /// Multiple of the load at τ.
    pub fn multiple(&self, part: f64) -> f64 {
        (self.0)(part).0
    }

    /// Rate of the multiple at τ.
    pub fn rate(&self, part: f64) -> f64 {
        (self.0)(part).1
    }

    /// Mean rate between two τ; at one τ the rate there.
    pub fn secant(&self, before: f64, after: f64) -> f64 {
        if before == after {
            return self.rate(after);
        }
        (self.multiple(after) - self.multiple(before)) / (after - before)
    }

    /// Multiple of the largest size, with its sign.
    pub fn largest(&self) -> f64 {
        let each = (0..=MOMENTS).map(|k| self.multiple(f64::from(k) / f64::from(MOMENTS)));
        each.fold(0.0, |most: f64, multiple| if multiple.abs() > most.abs() { multiple } else { most })
    }
}
