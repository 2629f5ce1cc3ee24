//! Lopez-Pamies' law: a sum of powers of I₁.

use super::polynomial::first_invariant_excess;
use super::principal::InvariantDerivatives;
use super::{Error, Hyperelastic, PrincipalResponse, finite, parameter, positive};

/// W = Σᵣ 3^(1−αᵣ)/(2αᵣ) μᵣ (I₁^αᵣ − 3^αᵣ), shear modulus Σμᵣ; doi:10.1016/j.crme.2009.12.007. A term with
/// α = 0 is its limit, (3/2) μ ln(I₁/3).
#[derive(Debug, Clone, PartialEq)]
pub struct LopezPamies {
    terms: Vec<[f64; 2]>,
}

impl LopezPamies {
    const NAME: &'static str = "Lopez-Pamies";

    /// Builds the law of terms [μᵣ, αᵣ], μᵣ > 0 in Pa, αᵣ of any sign.
    ///
    /// # Errors
    /// [`Error::Parameter`]; also for no term.
    pub fn new(terms: Vec<[f64; 2]>) -> Result<Self, Error> {
        parameter(Self::NAME, "number of terms", terms.len() as f64, !terms.is_empty(), "1 or more")?;
        for (r, [modulus, exponent]) in (1..).zip(&terms) {
            positive(Self::NAME, &format!("mu{r}"), *modulus)?;
            parameter(Self::NAME, &format!("alpha{r}"), *exponent, true, "(−∞, ∞)")?;
        }
        Ok(Self { terms })
    }

    /// W at x = I₁ − 3, J/m³.
    pub(crate) fn energy_above(&self, x: f64) -> f64 {
        let growth = (x / 3.0).ln_1p();
        let term = |&[modulus, exponent]: &[f64; 2]| match exponent {
            0.0 => 1.5 * modulus * growth,
            _ => 1.5 * modulus / exponent * (exponent * growth).exp_m1(),
        };
        self.terms.iter().map(term).sum()
    }

    /// dW/dI₁ and d²W/dI₁² at x = I₁ − 3, Pa.
    pub(crate) fn slopes(&self, x: f64) -> [f64; 2] {
        let growth = (x / 3.0).ln_1p();
        self.terms.iter().fold([0.0; 2], |[first, second], [modulus, exponent]| {
            let slope = 0.5 * modulus * ((exponent - 1.0) * growth).exp();
            [first + slope, second + slope * (exponent - 1.0) / (3.0 + x)]
        })
    }
}

impl Hyperelastic for LopezPamies {
    fn name(&self) -> String {
        Self::NAME.into()
    }

    fn parameters(&self) -> Vec<(String, f64)> {
        let named = |(r, [modulus, exponent]): (usize, &[f64; 2])| {
            [(format!("mu{r}"), *modulus), (format!("alpha{r}"), *exponent)]
        };
        (1..).zip(&self.terms).flat_map(named).collect()
    }

    fn shear_modulus(&self) -> f64 {
        self.terms.iter().map(|[modulus, _]| modulus).sum()
    }

    fn energy_at(&self, stretches: [f64; 3]) -> Result<f64, Error> {
        finite(Self::NAME, stretches, self.energy_above(first_invariant_excess(stretches)))
    }

    fn response_at(&self, stretches: [f64; 3]) -> Result<PrincipalResponse, Error> {
        let [first, first_first] = self.slopes(first_invariant_excess(stretches));
        let w = InvariantDerivatives { first, first_first, ..Default::default() };
        PrincipalResponse::from_invariants(stretches, w).finite(Self::NAME, stretches)
    }
}
