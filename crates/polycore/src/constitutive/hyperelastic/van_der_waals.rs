//! Law of Kilian ("van der Waals"), in the form of Abaqus.

use super::descriptor::{Contained, Domain, ModelDescriptor, ModelKind, Parameter, UNLIMITED};
use super::principal::InvariantDerivatives;
use super::{Error, Hyperelastic, PrincipalResponse, finite, parameter, positive};
use crate::tensor::Invariants;
use crate::tensor::deformation::check_stretches;

/// W = μ{−(λ_m² − 3)[ln(1 − η) + η] − ⅔a(x/2)^(3/2)}, x = (1 − β)Ī₁ + βĪ₂ − 3, η² = x/(λ_m² − 3) (Kilian,
/// doi:10.1016/0032-3861(81)90200-7; Abaqus Theory Guide 4.6.1). Shear modulus μ. The invariants are those
/// of J^(−2/3) C: with the full ones the law had no tangent at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VanDerWaals {
    modulus: f64,
    limit: f64,
    attraction: f64,
    share: f64,
}

pub(super) const VAN_DER_WAALS: ModelDescriptor = ModelDescriptor {
    key: "van-der-waals",
    kind: ModelKind::Micromechanical,
    parameters: &[
        Parameter { name: "mu", unit: "Pa", domain: Domain::Positive },
        Parameter { name: "lambda_m", unit: "1", domain: Domain::Above(least_root) },
        Parameter { name: "a", unit: "1", domain: Domain::Real },
        Parameter { name: "beta", unit: "1", domain: Domain::Positive },
    ],
    build: |p| Ok(Box::new(VanDerWaals::new(p[0], p[1], p[2], p[3])?)),
    // λ_m² − 3 = 2/a²: W has then no term in x^(3/2), and its tangent is smooth at rest
    example: &[0.4e6, 11.445_523_142_259_598, 0.125, 0.1],
    starts: |start| {
        let invariants = start.table.states.iter().filter_map(|state| state.principal_stretches().ok());
        let invariants: Vec<_> = invariants.map(Invariants::from_stretches).collect();
        let farthest = |beta: f64| {
            let mixed = invariants.iter().map(|i| (1.0 - beta) * i.first + beta * i.second);
            mixed.fold(4.0, f64::max).sqrt()
        };
        let at = |beta, share, a| vec![start.modulus, share * farthest(beta), a, beta];
        let shares = |beta| [at(beta, 1.05, 0.3), at(beta, 1.3, 0.2), at(beta, 2.0, 0.0)];
        [1e-3, 0.3, 0.9].into_iter().flat_map(shares).collect()
    },
    contains: &[Contained {
        key: "neo-hookean",
        embed: |p, start| vec![vec![p[0], UNLIMITED * start.limits[1], 0.0, 1e-12]],
    }],
    slopes: None,
    refine: None,
};

/// Lower limit of λ_m for the best β: the root of the smaller invariant.
fn least_root(stretches: [f64; 3]) -> f64 {
    let invariants = Invariants::from_stretches(stretches);
    invariants.first.min(invariants.second).sqrt()
}

impl VanDerWaals {
    const NAME: &'static str = "van der Waals";

    /// Builds the law from μ > 0 in Pa, λ_m > √3, a of any sign, and β in [0, 1].
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn new(modulus: f64, limit: f64, attraction: f64, share: f64) -> Result<Self, Error> {
        positive(Self::NAME, "mu", modulus)?;
        parameter(Self::NAME, "lambda_m", limit, limit * limit > 3.0, "(√3, ∞)")?;
        parameter(Self::NAME, "a", attraction, true, "(−∞, ∞)")?;
        parameter(Self::NAME, "beta", share, (0.0..=1.0).contains(&share), "[0, 1]")?;
        Ok(Self { modulus, limit, attraction, share })
    }

    /// λ̄ᵢ, x and η, or the error if that has reached 1. The logarithms of λ̄ sum to zero, which keeps the
    /// digits of a small x.
    fn invariant(&self, stretches: [f64; 3]) -> Result<([f64; 3], f64, f64), Error> {
        check_stretches(&stretches)?;
        let logs = stretches.map(f64::ln);
        let mean = logs.iter().sum::<f64>() / 3.0;
        let logs = logs.map(|log| log - mean);
        let excess = |sign: f64| logs.iter().map(|log| (2.0 * sign * log).exp_m1()).sum::<f64>();
        let x = ((1.0 - self.share) * excess(1.0) + self.share * excess(-1.0)).max(0.0);
        let limit = self.limit * self.limit - 3.0;
        match x < limit {
            true => Ok((logs.map(f64::exp), x, (x / limit).sqrt())),
            false => Err(Error::Locked { law: Self::NAME, quantity: "I - 3", value: x, limit }),
        }
    }
}

impl Hyperelastic for VanDerWaals {
    fn name(&self) -> String {
        Self::NAME.into()
    }

    fn parameters(&self) -> Vec<(String, f64)> {
        let values = [self.modulus, self.limit, self.attraction, self.share];
        ["mu", "lambda_m", "a", "beta"].map(String::from).into_iter().zip(values).collect()
    }

    fn shear_modulus(&self) -> f64 {
        self.modulus
    }

    fn energy_at(&self, stretches: [f64; 3]) -> Result<f64, Error> {
        let (_, x, ratio) = self.invariant(stretches)?;
        // ln(1 − η) + η = −Σ η^k/k from k = 2 on
        let chains = match ratio < 0.02 {
            true => (2..12).rev().fold(0.0, |sum, k| (sum + 1.0 / f64::from(k)) * ratio) * ratio,
            false => -(-ratio).ln_1p() - ratio,
        };
        let limit = self.limit * self.limit - 3.0;
        let attraction = 2.0 / 3.0 * self.attraction * (0.5 * x).powf(1.5);
        finite(Self::NAME, stretches, self.modulus * (limit * chains - attraction))
    }

    fn response_at(&self, stretches: [f64; 3]) -> Result<PrincipalResponse, Error> {
        let (kept, x, ratio) = self.invariant(stretches)?;
        let limit = self.limit * self.limit - 3.0;
        let slope = 0.5 * self.modulus * (1.0 / (1.0 - ratio) - self.attraction * (0.5 * x).sqrt());
        // grows as 1/√x, but its factor falls as x
        let curvature = match x > 0.0 {
            true => {
                let chains = 1.0 / (2.0 * limit.sqrt() * (1.0 - ratio) * (1.0 - ratio));
                0.5 * self.modulus / x.sqrt() * (chains - self.attraction / 8.0_f64.sqrt())
            }
            false => 0.0,
        };
        let [first, second] = [1.0 - self.share, self.share];
        let w = InvariantDerivatives {
            first: first * slope,
            second: second * slope,
            first_first: first * first * curvature,
            second_second: second * second * curvature,
            mixed: first * second * curvature,
        };
        PrincipalResponse::from_invariants(kept, w).isochoric(stretches).finite(Self::NAME, stretches)
    }
}
