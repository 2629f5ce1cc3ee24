//! Softening by the largest strain so far: Ogden and Roxburgh 1999, doi:10.1098/rspa.1999.0431.

use crate::constitutive::Error;
use std::f64::consts::PI;

/// S = ζ S₀ with ζ = 1 − erf((W_max − W₀)/a)/r, a = m + βW_max: S₀, W₀ of the isochoric part of a law and
/// W_max its largest value so far (Abaqus' form).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mullins {
    /// r > 1.
    pub ratio: f64,
    /// m ≥ 0, J/m³.
    pub offset: f64,
    /// β ≥ 0.
    pub slope: f64,
}

impl Mullins {
    /// Checks the constants.
    ///
    /// # Errors
    /// [`Error::Parameter`] outside r > 1, m ≥ 0, β ≥ 0, m and β not both 0.
    pub fn check(&self) -> Result<(), Error> {
        let rule = |parameter: &str, value: f64, valid: bool, allowed| {
            if valid && value.is_finite() {
                Ok(())
            } else {
                Err(Error::Parameter { law: "mullins", parameter: parameter.to_owned(), value, allowed })
            }
        };
        rule("r", self.ratio, self.ratio > 1.0, "(1, ∞)")?;
        rule("m", self.offset, self.offset >= 0.0, "[0, ∞)")?;
        rule("beta", self.slope, self.slope >= 0.0, "[0, ∞)")?;
        rule("m", self.offset, self.offset + self.slope > 0.0, "not 0 with beta = 0")
    }

    /// a = m + βW_max.
    fn width(&self, peak: f64) -> f64 {
        (self.offset + self.slope * peak).max(f64::MIN_POSITIVE)
    }

    /// ζ and dζ/dW₀ at W₀ below its largest value.
    pub fn factor(&self, energy: f64, peak: f64) -> (f64, f64) {
        let width = self.width(peak);
        let u = (peak - energy) / width;
        (1.0 - libm::erf(u) / self.ratio, 2.0 / PI.sqrt() * (-u * u).exp() / (self.ratio * width))
    }

    /// Recoverable energy, and energy dissipated so far, J/m³.
    pub fn energies(&self, energy: f64, peak: f64) -> [f64; 2] {
        let width = self.width(peak);
        let integral = |u: f64| u * libm::erf(u) + (-u * u).exp() / PI.sqrt();
        let top = integral(peak / width);
        let scale = width / self.ratio;
        [energy - scale * (top - integral((peak - energy) / width)), scale * (top - integral(0.0))]
    }
}
