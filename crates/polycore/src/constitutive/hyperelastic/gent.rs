//! Gent's law of limited chain extensibility.

use super::descriptor::{Contained, Domain, ModelDescriptor, ModelKind, Parameter, UNLIMITED};
use super::polynomial::first_invariant_excess;
use super::principal::InvariantDerivatives;
use super::{Error, Hyperelastic, PrincipalResponse, finite, positive};
use crate::tensor::deformation::check_stretches;

/// W = −½μJ_m ln(1 − (I₁ − 3)/J_m) (1.22), for I₁ < J_m + 3; doi:10.5254/1.3538357.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gent {
    shear_modulus: f64,
    limit: f64,
}

pub(super) const GENT: ModelDescriptor = ModelDescriptor {
    key: "gent",
    kind: ModelKind::Phenomenological,
    parameters: &[
        Parameter { name: "shear_modulus", unit: "Pa", domain: Domain::Positive },
        Parameter { name: "J_m", unit: "1", domain: Domain::Above(first_invariant_excess) },
    ],
    build: |p| Ok(Box::new(Gent::new(p[0], p[1])?)),
    example: &[0.3e6, 75.0],
    starts: |start| [1.02, 1.3, 3.0].map(|r| vec![0.8 * start.modulus, r * start.limits[1]]).to_vec(),
    contains: &[Contained {
        key: "neo-hookean",
        embed: |p, start| vec![vec![p[0], UNLIMITED * start.limits[1]]],
    }],
    slopes: None,
    refine: None,
};

impl Gent {
    const NAME: &'static str = "Gent";

    /// μ > 0 in Pa, J_m > 0: the limit of I₁ − 3.
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn new(shear_modulus: f64, limit: f64) -> Result<Self, Error> {
        Ok(Self {
            shear_modulus: positive(Self::NAME, "shear_modulus", shear_modulus)?,
            limit: positive(Self::NAME, "J_m", limit)?,
        })
    }

    /// I₁ − 3, or the error if it has reached J_m.
    fn excess(&self, stretches: [f64; 3]) -> Result<f64, Error> {
        check_stretches(&stretches)?;
        let excess = first_invariant_excess(stretches);
        if excess < self.limit {
            Ok(excess)
        } else {
            Err(Error::Locked { law: Self::NAME, quantity: "I1 - 3", value: excess, limit: self.limit })
        }
    }
}

impl Hyperelastic for Gent {
    fn name(&self) -> String {
        Self::NAME.into()
    }

    fn parameters(&self) -> Vec<(String, f64)> {
        vec![("shear_modulus".into(), self.shear_modulus), ("J_m".into(), self.limit)]
    }

    fn shear_modulus(&self) -> f64 {
        self.shear_modulus
    }

    fn energy_at(&self, stretches: [f64; 3]) -> Result<f64, Error> {
        let excess = self.excess(stretches)?;
        let energy = -0.5 * self.shear_modulus * self.limit * (-excess / self.limit).ln_1p();
        finite(Self::NAME, stretches, energy)
    }

    fn response_at(&self, stretches: [f64; 3]) -> Result<PrincipalResponse, Error> {
        let room = self.limit - self.excess(stretches)?;
        let first = 0.5 * self.shear_modulus * (self.limit / room);
        let w = InvariantDerivatives { first, first_first: first / room, ..Default::default() };
        PrincipalResponse::from_invariants(stretches, w).finite(Self::NAME, stretches)
    }

    fn published_coupling(&self) -> Option<f64> {
        Some(self.shear_modulus) // (1.23), which has no U(J)
    }
}
