//! Lopez-Pamies' law: a sum of powers of I₁.

use super::descriptor::{ABSENT, Contained, Domain, ModelDescriptor, ModelKind, Parameter};
use super::polynomial::first_invariant_excess;
use super::principal::InvariantDerivatives;
use super::{Error, Hyperelastic, PrincipalResponse, finite, parameter, positive};

/// W = Σᵣ 3^(1−αᵣ)/(2αᵣ) μᵣ (I₁^αᵣ − 3^αᵣ), shear modulus Σμᵣ; doi:10.1016/j.crme.2009.12.007. A term with
/// α = 0 is its limit, (3/2) μ ln(I₁/3).
#[derive(Debug, Clone, PartialEq)]
pub struct LopezPamies {
    terms: Vec<[f64; 2]>,
}

/// The law of two terms.
pub(super) const LOPEZ_PAMIES: ModelDescriptor = ModelDescriptor {
    key: "lopez-pamies",
    kind: ModelKind::Phenomenological,
    parameters: &[
        Parameter { name: "mu_1", unit: "Pa", domain: Domain::Positive },
        Parameter { name: "alpha_1", unit: "1", domain: Domain::Real },
        Parameter { name: "mu_2", unit: "Pa", domain: Domain::Positive },
        Parameter { name: "alpha_2", unit: "1", domain: Domain::Real },
    ],
    build: |p| Ok(Box::new(LopezPamies::new(vec![[p[0], p[1]], [p[2], p[3]]])?)),
    example: &[0.27e6, 0.7, 0.02e6, 3.0],
    starts: |start| {
        let shares = [[0.9, 1.0, 0.1, -2.0], [0.9, 0.8, 0.02, 3.0], [0.5, 0.5, 0.4, -5.0]];
        shares.map(|[a, first, b, second]| vec![a * start.modulus, first, b * start.modulus, second]).to_vec()
    },
    contains: &[Contained {
        key: "neo-hookean",
        embed: |p, _| vec![vec![p[0], 1.0, ABSENT * p[0], 2.0], vec![0.9 * p[0], 1.0, 0.1 * p[0], 2.0]],
    }],
    slopes: None,
    refine: None,
};

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
