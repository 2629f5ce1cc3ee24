//! Law of Arruda and Boyce as finite-element programs have it: five terms of the series.

use super::descriptor::{Contained, Domain, ModelDescriptor, ModelKind, Parameter, UNLIMITED};
use super::polynomial::first_invariant_excess;
use super::principal::InvariantDerivatives;
use super::{Error, Hyperelastic, PrincipalResponse, finite, positive};

/// W = μ Σᵢ Cᵢ/λ_m^(2i−2) (I₁^i − 3^i), i = 1 … 5: the eight-chain law with 𝓛⁻¹ cut after its fifth term
/// (doi:10.1016/0022-5096(93)90013-6; Abaqus Theory Guide 4.6.1). It does not lock: near I₁ = 3λ_m² it is
/// too soft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArrudaBoyce {
    modulus: f64,
    limit: f64,
}

/// Cᵢ of the series.
const SERIES: [f64; 5] = [0.5, 1.0 / 20.0, 11.0 / 1050.0, 19.0 / 7000.0, 519.0 / 673_750.0];

pub(super) const ARRUDA_BOYCE: ModelDescriptor = ModelDescriptor {
    key: "arruda-boyce",
    kind: ModelKind::Micromechanical,
    parameters: &[
        Parameter { name: "mu", unit: "Pa", domain: Domain::Positive },
        Parameter { name: "lambda_m", unit: "1", domain: Domain::Positive },
    ],
    build: |p| Ok(Box::new(ArrudaBoyce::new(p[0], p[1])?)),
    example: &[0.27e6, 5.0],
    starts: |start| [2.0, 5.0, 15.0].map(|limit| vec![0.8 * start.modulus, limit]).to_vec(),
    contains: &[Contained { key: "neo-hookean", embed: |p, _| vec![vec![p[0], UNLIMITED]] }],
    slopes: None,
    refine: None,
};

impl ArrudaBoyce {
    const NAME: &'static str = "Arruda-Boyce, five terms";

    /// Builds the law from μ > 0 in Pa and the locking stretch λ_m > 0.
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn new(modulus: f64, limit: f64) -> Result<Self, Error> {
        Ok(Self {
            modulus: positive(Self::NAME, "mu", modulus)?,
            limit: positive(Self::NAME, "lambda_m", limit)?,
        })
    }

    /// μCᵢ/λ_m^(2i−2) with i.
    fn coefficients(&self) -> impl Iterator<Item = (i32, f64)> {
        (1..).zip(SERIES.map(|c| self.modulus * c)).map(|(i, c)| (i, c / self.limit.powi(2 * i - 2)))
    }
}

impl Hyperelastic for ArrudaBoyce {
    fn name(&self) -> String {
        Self::NAME.into()
    }

    fn parameters(&self) -> Vec<(String, f64)> {
        vec![("mu".into(), self.modulus), ("lambda_m".into(), self.limit)]
    }

    fn shear_modulus(&self) -> f64 {
        2.0 * self.coefficients().map(|(i, c)| c * f64::from(i) * 3.0_f64.powi(i - 1)).sum::<f64>()
    }

    fn energy_at(&self, stretches: [f64; 3]) -> Result<f64, Error> {
        let excess = first_invariant_excess(stretches);
        // I₁^i − 3^i = (I₁ − 3) Σₖ I₁^k 3^(i−1−k)
        let quotient = |i: i32| (0..i).map(|k| (3.0 + excess).powi(k) * 3.0_f64.powi(i - 1 - k)).sum::<f64>();
        finite(Self::NAME, stretches, self.coefficients().map(|(i, c)| c * excess * quotient(i)).sum())
    }

    fn response_at(&self, stretches: [f64; 3]) -> Result<PrincipalResponse, Error> {
        let first = 3.0 + first_invariant_excess(stretches);
        let mut w = InvariantDerivatives::default();
        for (i, c) in self.coefficients() {
            w.first += c * f64::from(i) * first.powi(i - 1);
            w.first_first += if i > 1 { c * f64::from(i * (i - 1)) * first.powi(i - 2) } else { 0.0 };
        }
        PrincipalResponse::from_invariants(stretches, w).finite(Self::NAME, stretches)
    }
}
