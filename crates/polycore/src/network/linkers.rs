//! Cross-linkers: functionalities, the recursion of Miller and Macosko, effective strands of a junction.

use super::{Error, positive};
use crate::numerics::bisected;

/// Largest functionality: binomial coefficients beyond it leave the range of `f64`.
const LARGEST: u32 = 1000;

/// Cross-linkers of one or several functionalities.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkerMix {
    /// Functionality f and its share a_f of all groups A; the shares sum up to 1.
    shares: Vec<(u32, f64)>,
}

impl LinkerMix {
    /// Creates cross-linkers from functionalities and their shares of the groups A, in any unit.
    ///
    /// # Errors
    /// Functionalities outside 1 to 1000, shares that are not positive, no cross-linker.
    pub fn new(shares: &[(u32, f64)]) -> Result<Self, Error> {
        let mut sum = 0.0;
        for &(functionality, share) in shares {
            if !(1..=LARGEST).contains(&functionality) {
                let value = f64::from(functionality);
                return Err(Error::Domain { quantity: "functionality", value, allowed: "1 to 1000" });
            }
            sum += positive("share of the groups A", share)?;
        }
        positive("sum of the shares of the groups A", sum)?;
        Ok(Self { shares: shares.iter().map(|&(f, share)| (f, share / sum)).collect() })
    }

    /// Creates cross-linkers of a mean functionality (groups A per cross-linker) from the two whole numbers
    /// beside it.
    ///
    /// # Errors
    /// A mean outside 1 to 1000.
    pub fn mean(functionality: f64) -> Result<Self, Error> {
        if !(1.0..=f64::from(LARGEST)).contains(&functionality) {
            return Err(Error::Domain {
                quantity: "functionality",
                value: functionality,
                allowed: "1 to 1000",
            });
        }
        let whole = functionality.floor();
        let (low, rest) = (whole as u32, functionality - whole);
        if rest == 0.0 {
            return Self::new(&[(low, 1.0)]);
        }
        // rest is the share of cross-linkers; they have whole + 1 groups each
        Self::new(&[(low, whole * (1.0 - rest)), (low + 1, (whole + 1.0) * rest)])
    }

    /// Functionalities and their shares of the groups A.
    pub fn shares(&self) -> &[(u32, f64)] {
        &self.shares
    }

    fn sum(&self, of: impl Fn(u32) -> f64) -> f64 {
        self.shares.iter().map(|&(f, share)| share * of(f)).sum()
    }

    /// Cross-linkers per group A, Σ a_f/f.
    pub fn per_group(&self) -> f64 {
        self.sum(|f| 1.0 / f64::from(f))
    }

    /// Returns Σ a_f (f − 1), the further groups behind a group A.
    pub fn branching(&self) -> f64 {
        self.sum(|f| f64::from(f - 1))
    }

    /// Returns α, the probability that the way out from a group A leads to a finite piece, for s = p_A p_B
    /// (1 − b₁): the root below 1 of s Σ a_f (1 + α + … + α^(f−2)) = 1, the recursion divided by 1 − α.
    /// `None` if there is none: no gel.
    pub(super) fn extinction(&self, s: f64) -> Option<f64> {
        if s * self.branching() <= 1.0 {
            return None;
        }
        let excess = |alpha: f64| {
            // Horner's rule
            let powers = |f: u32| (1..f).fold(0.0, |sum, _| sum * alpha + 1.0);
            s * self.sum(powers) - 1.0
        };
        match excess(0.0) < 0.0 {
            true => Some(bisected(0.0, 1.0, 2000, |alpha| excess(alpha) < 0.0)),
            false => Some(0.0),
        }
    }

    /// Returns Σ a_f α^(f−1), the probability that all further ways of a cross-linker are finite.
    pub(super) fn ends(&self, alpha: f64) -> f64 {
        self.sum(|f| power(alpha, f - 1))
    }

    /// Returns the share of cross-linkers in the sol, per group A: Σ a_f α^f/f.
    pub(super) fn soluble(&self, alpha: f64) -> f64 {
        self.sum(|f| power(alpha, f) / f64::from(f))
    }

    /// Returns strands that end at junctions of `least` or more ways to the gel, and these junctions, per
    /// group A: Σ a_f/f Σ_m (m/2) P_m and Σ a_f/f Σ_m P_m with P_m = C(f,m) α^(f−m) (1 − α)^m.
    pub(super) fn effective(&self, alpha: f64, least: u32) -> [f64; 2] {
        let mut found = [0.0; 2];
        for &(f, share) in &self.shares {
            let mut choices = 1.0;
            for m in 0..=f {
                if m > 0 {
                    choices *= f64::from(f - m + 1) / f64::from(m);
                }
                if m >= least {
                    let probability = choices * power(alpha, f - m) * power(1.0 - alpha, m);
                    let junctions = share / f64::from(f) * probability;
                    found[0] += junctions * f64::from(m) / 2.0;
                    found[1] += junctions;
                }
            }
        }
        found
    }
}

/// Returns a power of a whole exponent up to [`LARGEST`].
fn power(base: f64, exponent: u32) -> f64 {
    base.powi(i32::try_from(exponent).unwrap_or(i32::MAX))
}
