//! Standardisation (3.8), also of constant components.

use crate::Error;
use crate::kinematics::NAMES;
use polycore::tensor::Voigt;
use serde::{Deserialize, Serialize};

/// Relative deviation (to the mean or 1) below which a component is constant up to rounding.
const CONSTANT: f64 = 1e-12;

/// Mean μ̂ and standard deviation σ̂ of each component (3.8).
///
/// A component without variance, e.g. C₁₂ = C₁₃ = C₂₃ = 0 from box lengths alone, for which (3.8) divides by
/// zero, maps to 0. [`Standardisation::constant`] names such components; predictions at other values must be
/// flagged.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Standardisation {
    /// Mean μ̂.
    pub mean: [f64; 6],
    /// Standard deviation σ̂ with divisor n; 0 for a component without variance.
    pub deviation: [f64; 6],
}

impl Standardisation {
    /// Identity: mean 0, deviation 1.
    pub const IDENTITY: Self = Self { mean: [0.0; 6], deviation: [1.0; 6] };

    /// Computes mean and deviation of the rows, summed in their order.
    ///
    /// # Errors
    /// Returns [`Error::Data`] for no rows, [`Error::Parameter`] for non-finite numbers.
    pub fn from_rows<'a>(rows: impl Iterator<Item = &'a Voigt> + Clone) -> Result<Self, Error> {
        let count = rows.clone().count();
        if count == 0 {
            let (found, allowed) = ("no row".into(), "at least one row".into());
            return Err(Error::Data { what: "standardisation", found, allowed });
        }
        let mean: Voigt = rows.clone().sum::<Voigt>() / count as f64;
        // the second pass about the mean avoids cancellation
        let square = |row: &Voigt| (row - mean).component_mul(&(row - mean));
        let variance: Voigt = rows.map(square).sum::<Voigt>() / count as f64;
        let mut result = Self::IDENTITY;
        for a in 0..6 {
            if !(mean[a].is_finite() && variance[a].is_finite()) {
                let found =
                    format!("mean {} and variance {} of component {}", mean[a], variance[a], NAMES[a]);
                return Err(Error::parameter("standardisation", found, "finite numbers"));
            }
            let deviation = variance[a].sqrt();
            let constant = deviation <= CONSTANT * mean[a].abs().max(1.0);
            (result.mean[a], result.deviation[a]) = (mean[a], if constant { 0.0 } else { deviation });
        }
        Ok(result)
    }

    /// Returns the names of components without variance.
    pub fn constant(&self) -> Vec<&'static str> {
        (0..6).filter(|&a| self.deviation[a] == 0.0).map(|a| NAMES[a]).collect()
    }

    /// Returns 1/σ̂, or 0 for a component without variance.
    pub fn inverse_deviation(&self, a: usize) -> f64 {
        if self.deviation[a] == 0.0 { 0.0 } else { 1.0 / self.deviation[a] }
    }

    /// Computes (C − μ̂)/σ̂ (3.8).
    pub fn apply(&self, value: &Voigt) -> Voigt {
        Voigt::from_fn(|a, _| (value[a] - self.mean[a]) * self.inverse_deviation(a))
    }

    /// Computes the inverse, μ̂ + σ̂ x; a component without variance becomes its mean.
    pub fn invert(&self, standardised: &Voigt) -> Voigt {
        Voigt::from_fn(|a, _| self.mean[a] + self.deviation[a] * standardised[a])
    }
}
