//! Extended tube law of Kaliske and Heinrich.

use super::descriptor::{ABSENT, Contained, Domain, ModelDescriptor, ModelKind, Parameter};
use super::polynomial::first_invariant_excess;
use super::principal::InvariantDerivatives;
use super::{Error, Hyperelastic, Ogden, OgdenConvention, PrincipalResponse, finite, parameter, positive};
use crate::tensor::deformation::check_stretches;

/// W = ½G_c [(1 − δ²)x/(1 − δ²x) + ln(1 − δ²x)] + 2G_e/β² Σ (λᵢ^(−β) − 1), x = I₁ − 3 < 1/δ²
/// (doi:10.5254/1.3538822): cross-links of limited extensibility, and a tube of entanglements. Shear modulus
/// G_c(1 − 2δ²) + G_e.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtendedTube {
    crosslinks: f64,
    inextensibility: f64,
    tube: Ogden,
}

pub(super) const EXTENDED_TUBE: ModelDescriptor = ModelDescriptor {
    key: "extended-tube",
    kind: ModelKind::Micromechanical,
    parameters: &[
        Parameter { name: "G_c", unit: "Pa", domain: Domain::Positive },
        Parameter { name: "delta", unit: "1", domain: Domain::Positive },
        Parameter { name: "G_e", unit: "Pa", domain: Domain::Positive },
        Parameter { name: "beta", unit: "1", domain: Domain::Positive },
    ],
    build: |p| Ok(Box::new(ExtendedTube::new(p[0], p[1], p[2], p[3])?)),
    // of FElupe's documentation, for Treloar's rubber
    example: &[0.1867e6, 0.09693, 0.2169e6, 0.2],
    starts: |start| {
        let states = start.table.states.iter().filter_map(|state| state.principal_stretches().ok());
        let farthest = states.map(first_invariant_excess).fold(1.0, f64::max);
        // shares of the modulus and of the largest δ, and β
        let shares = [[0.5, 0.95, 0.2], [0.5, 0.95, 1.0], [0.5, 0.7, 0.2], [0.5, 0.3, 0.5], [0.2, 0.8, 4.0]];
        let at = |[part, delta, beta]: [f64; 3]| {
            let [chains, tube] = [part, 1.0 - part].map(|part| part * start.modulus);
            vec![chains, delta / farthest.sqrt(), tube, beta]
        };
        shares.map(at).to_vec()
    },
    contains: &[Contained { key: "neo-hookean", embed: |p, _| vec![vec![p[0], 1e-6, ABSENT * p[0], 1.0]] }],
    slopes: None,
    refine: None,
};

impl ExtendedTube {
    const NAME: &'static str = "extended tube";

    /// Builds the law from G_c, G_e > 0 in Pa, δ in (0, 1/√2) and β > 0.
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn new(crosslinks: f64, inextensibility: f64, tube: f64, beta: f64) -> Result<Self, Error> {
        positive(Self::NAME, "G_c", crosslinks)?;
        let valid = inextensibility > 0.0 && 2.0 * inextensibility * inextensibility < 1.0;
        parameter(Self::NAME, "delta", inextensibility, valid, "(0, 1/√2)")?;
        positive(Self::NAME, "G_e", tube)?;
        positive(Self::NAME, "beta", beta)?;
        let tube = Ogden::new(OgdenConvention::Abaqus, &[(tube, -beta)])?;
        Ok(Self { crosslinks, inextensibility, tube })
    }

    /// I₁ − 3 and 1 − δ²(I₁ − 3), or the error if that has reached zero.
    fn room(&self, stretches: [f64; 3]) -> Result<[f64; 2], Error> {
        check_stretches(&stretches)?;
        let (x, limit) = (first_invariant_excess(stretches), self.inextensibility.powi(-2));
        let room = 1.0 - x / limit;
        match room > 0.0 {
            true => Ok([x, room]),
            false => Err(Error::Locked { law: Self::NAME, quantity: "I1 - 3", value: x, limit }),
        }
    }
}

impl Hyperelastic for ExtendedTube {
    fn name(&self) -> String {
        Self::NAME.into()
    }

    fn parameters(&self) -> Vec<(String, f64)> {
        let (tube, exponent) = self.tube.terms()[0];
        let values = [self.crosslinks, self.inextensibility, tube, -exponent];
        ["G_c", "delta", "G_e", "beta"].map(String::from).into_iter().zip(values).collect()
    }

    fn shear_modulus(&self) -> f64 {
        self.crosslinks * (1.0 - 2.0 * self.inextensibility.powi(2)) + self.tube.shear_modulus()
    }

    fn energy_at(&self, stretches: [f64; 3]) -> Result<f64, Error> {
        let [x, room] = self.room(stretches)?;
        let square = self.inextensibility.powi(2);
        let chains = 0.5 * self.crosslinks * ((1.0 - square) * x / room + (-square * x).ln_1p());
        finite(Self::NAME, stretches, chains + self.tube.energy_at(stretches)?)
    }

    fn response_at(&self, stretches: [f64; 3]) -> Result<PrincipalResponse, Error> {
        let [_, room] = self.room(stretches)?;
        let square = self.inextensibility.powi(2);
        let w = InvariantDerivatives {
            first: 0.5 * self.crosslinks * ((1.0 - square) / room - square) / room,
            first_first: 0.5 * self.crosslinks * square * (2.0 * (1.0 - square) / room - square)
                / room
                / room,
            ..Default::default()
        };
        PrincipalResponse::from_invariants(stretches, w)
            .plus(&self.tube.response_at(stretches)?)
            .finite(Self::NAME, stretches)
    }
}
