//! Yeoh's law, the reduced polynomial of third order.

use super::descriptor::{Contained, Domain, ModelDescriptor, ModelKind, Parameter};
use super::polynomial::first_invariant_excess;
use super::principal::InvariantDerivatives;
use super::{Error, Hyperelastic, PrincipalResponse, finite, parameter, positive};

/// W = C₁(I₁ − 3) + C₂(I₁ − 3)² + C₃(I₁ − 3)³; shear modulus 2C₁; doi:10.5254/1.3538343.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Yeoh {
    coefficients: [f64; 3],
}

pub(super) const YEOH: ModelDescriptor = ModelDescriptor {
    key: "yeoh",
    kind: ModelKind::Phenomenological,
    parameters: &[
        Parameter { name: "C1", unit: "Pa", domain: Domain::Positive },
        Parameter { name: "C2", unit: "Pa", domain: Domain::Real },
        Parameter { name: "C3", unit: "Pa", domain: Domain::Real },
    ],
    build: |p| Ok(Box::new(Yeoh::new([p[0], p[1], p[2]])?)),
    example: &[0.2e6, 2e3, 50.0],
    starts: |start| vec![vec![0.5 * start.modulus, 0.0, 0.0]],
    contains: &[Contained { key: "neo-hookean", embed: |p, _| vec![vec![0.5 * p[0], 0.0, 0.0]] }],
    slopes: None,
    refine: None,
};

impl Yeoh {
    const NAME: &'static str = "Yeoh";

    /// Builds the law from C₁ > 0 and C₂, C₃ of any sign, in Pa. If W falls with I₁ the law is unstable.
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn new(coefficients: [f64; 3]) -> Result<Self, Error> {
        positive(Self::NAME, "C1", coefficients[0])?;
        parameter(Self::NAME, "C2", coefficients[1], true, "(−∞, ∞)")?;
        parameter(Self::NAME, "C3", coefficients[2], true, "(−∞, ∞)")?;
        Ok(Self { coefficients })
    }
}

impl Hyperelastic for Yeoh {
    fn name(&self) -> String {
        Self::NAME.into()
    }

    fn parameters(&self) -> Vec<(String, f64)> {
        (1..).zip(self.coefficients).map(|(i, value)| (format!("C{i}"), value)).collect()
    }

    fn shear_modulus(&self) -> f64 {
        2.0 * self.coefficients[0]
    }

    fn energy_at(&self, stretches: [f64; 3]) -> Result<f64, Error> {
        let x = first_invariant_excess(stretches);
        let [a, b, c] = self.coefficients;
        finite(Self::NAME, stretches, x * (a + x * (b + x * c)))
    }

    fn response_at(&self, stretches: [f64; 3]) -> Result<PrincipalResponse, Error> {
        let x = first_invariant_excess(stretches);
        let [a, b, c] = self.coefficients;
        let w = InvariantDerivatives {
            first: a + x * (2.0 * b + 3.0 * c * x),
            first_first: 2.0 * b + 6.0 * c * x,
            ..Default::default()
        };
        PrincipalResponse::from_invariants(stretches, w).finite(Self::NAME, stretches)
    }
}
