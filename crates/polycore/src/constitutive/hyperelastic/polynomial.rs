//! Neo-Hookean and Mooney–Rivlin: linear in the invariants.

use super::descriptor::{ABSENT, Contained, Domain, ModelDescriptor, ModelKind, Parameter};
use super::principal::InvariantDerivatives;
use super::{Error, Hyperelastic, PrincipalResponse, finite, parameter, positive};

/// W = ½μ(I₁ − 3) (1.18).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NeoHookean {
    shear_modulus: f64,
}

/// W = C₁(I₁ − 3) + C₂(I₂ − 3) (1.20); shear modulus 2(C₁ + C₂).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MooneyRivlin {
    first: f64,
    second: f64,
}

pub(super) const NEO_HOOKEAN: ModelDescriptor = ModelDescriptor {
    key: "neo-hookean",
    kind: ModelKind::Phenomenological,
    parameters: &[Parameter { name: "shear_modulus", unit: "Pa", domain: Domain::Positive }],
    build: |p| Ok(Box::new(NeoHookean::new(p[0])?)),
    example: &[0.4e6],
    starts: |start| vec![vec![start.modulus]],
    contains: &[],
    slopes: None,
    refine: None,
};

pub(super) const MOONEY_RIVLIN: ModelDescriptor = ModelDescriptor {
    key: "mooney-rivlin",
    kind: ModelKind::Phenomenological,
    parameters: &[
        // fits keep to the polyconvex quadrant: the best fit to Treloar's bar, 0.39 and −0.72 MPa, has a
        // negative shear modulus
        Parameter { name: "C1", unit: "Pa", domain: Domain::Positive },
        Parameter { name: "C2", unit: "Pa", domain: Domain::Positive },
    ],
    build: |p| Ok(Box::new(MooneyRivlin::new(p[0], p[1])?)),
    example: &[0.15e6, 0.02e6],
    starts: |start| {
        [[0.45, 0.05], [0.05, 0.45]].map(|share| share.map(|c| c * start.modulus).to_vec()).to_vec()
    },
    contains: &[Contained { key: "neo-hookean", embed: |p, _| vec![vec![0.5 * p[0], ABSENT * p[0]]] }],
    slopes: None,
    refine: None,
};

impl NeoHookean {
    const NAME: &'static str = "neo-Hookean";

    /// μ > 0 in Pa.
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn new(shear_modulus: f64) -> Result<Self, Error> {
        Ok(Self { shear_modulus: positive(Self::NAME, "shear_modulus", shear_modulus)? })
    }
}

impl Hyperelastic for NeoHookean {
    fn name(&self) -> String {
        Self::NAME.into()
    }

    fn parameters(&self) -> Vec<(String, f64)> {
        vec![("shear_modulus".into(), self.shear_modulus)]
    }

    fn shear_modulus(&self) -> f64 {
        self.shear_modulus
    }

    fn energy_at(&self, stretches: [f64; 3]) -> Result<f64, Error> {
        finite(Self::NAME, stretches, 0.5 * self.shear_modulus * first_invariant_excess(stretches))
    }

    fn response_at(&self, stretches: [f64; 3]) -> Result<PrincipalResponse, Error> {
        let w = InvariantDerivatives { first: 0.5 * self.shear_modulus, ..Default::default() };
        PrincipalResponse::from_invariants(stretches, w).finite(Self::NAME, stretches)
    }

    fn published_coupling(&self) -> Option<f64> {
        Some(self.shear_modulus) // (1.19)
    }
}

impl MooneyRivlin {
    const NAME: &'static str = "Mooney-Rivlin";

    /// Builds the law from C₁, C₂ in Pa; either may be negative, but C₁ + C₂ > 0.
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn new(first: f64, second: f64) -> Result<Self, Error> {
        parameter(Self::NAME, "C1", first, true, "(−∞, ∞)")?;
        parameter(Self::NAME, "C2", second, true, "(−∞, ∞)")?;
        positive(Self::NAME, "C1 + C2", first + second)?;
        Ok(Self { first, second })
    }
}

impl Hyperelastic for MooneyRivlin {
    fn name(&self) -> String {
        Self::NAME.into()
    }

    fn parameters(&self) -> Vec<(String, f64)> {
        vec![("C1".into(), self.first), ("C2".into(), self.second)]
    }

    fn shear_modulus(&self) -> f64 {
        2.0 * (self.first + self.second)
    }

    fn energy_at(&self, stretches: [f64; 3]) -> Result<f64, Error> {
        let energy =
            self.first * first_invariant_excess(stretches) + self.second * second_invariant_excess(stretches);
        finite(Self::NAME, stretches, energy)
    }

    fn response_at(&self, stretches: [f64; 3]) -> Result<PrincipalResponse, Error> {
        let w = InvariantDerivatives { first: self.first, second: self.second, ..Default::default() };
        PrincipalResponse::from_invariants(stretches, w).finite(Self::NAME, stretches)
    }

    fn published_coupling(&self) -> Option<f64> {
        // (1.21) prints C₁, which leaves S(1) = C₁ + 4C₂; 2(C₁ + 2C₂) is stress free
        Some(self.first)
    }
}

/// I₁ − 3 = Σ (λᵢ − 1)(λᵢ + 1), without the cancellation of the sum.
pub(super) fn first_invariant_excess(stretches: [f64; 3]) -> f64 {
    stretches.iter().map(|l| (l - 1.0) * (l + 1.0)).sum()
}

/// I₂ − 3 = Σ (λᵢλⱼ − 1)(λᵢλⱼ + 1) over i < j, with λᵢλⱼ − 1 = (λᵢ − 1) + (λⱼ − 1) + (λᵢ − 1)(λⱼ − 1).
pub(super) fn second_invariant_excess(stretches: [f64; 3]) -> f64 {
    let [a, b, c] = stretches.map(|l| l - 1.0);
    [(a, b), (b, c), (c, a)]
        .into_iter()
        .map(|(x, y)| {
            let excess = x + y + x * y;
            excess * (excess + 2.0)
        })
        .sum()
}
