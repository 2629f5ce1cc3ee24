//! Law of compressible foams by Ogden and Hill, in the form of Abaqus' `*HYPERFOAM`.

use super::descriptor::{Domain, ModelDescriptor, ModelKind, Parameter};
use super::{Error, Hyperelastic, PrincipalResponse, finite, parameter, positive};
use crate::tensor::deformation::check_stretches;

/// W = Σᵢ 2μᵢ/αᵢ² [λ₁^αᵢ + λ₂^αᵢ + λ₃^αᵢ − 3 + (J^(−αᵢβᵢ) − 1)/βᵢ] (Hill, doi:10.1016/S0065-2156(08)70264-3;
/// Storåkers, doi:10.1016/0022-5096(86)90033-5; Abaqus Theory Guide 4.6.2). The shear modulus is
/// Σμᵢ, the bulk modulus Σ2μᵢ(⅓ + βᵢ); with one β a free bar has λ₂ = λ₁^(−ν), ν = β/(1 + 2β).
#[derive(Debug, Clone, PartialEq)]
pub struct Hyperfoam {
    terms: Vec<FoamTerm>,
}

/// Term of [`Hyperfoam`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoamTerm {
    /// μ, Pa.
    pub modulus: f64,
    /// α ≠ 0.
    pub exponent: f64,
    /// β > −1/3.
    pub beta: f64,
}

const PARAMETERS: [Parameter; 9] = [
    Parameter { name: "mu_1", unit: "Pa", domain: Domain::Real },
    Parameter { name: "alpha_1", unit: "1", domain: Domain::Real },
    Parameter { name: "beta_1", unit: "1", domain: Domain::Real },
    Parameter { name: "mu_2", unit: "Pa", domain: Domain::Real },
    Parameter { name: "alpha_2", unit: "1", domain: Domain::Real },
    Parameter { name: "beta_2", unit: "1", domain: Domain::Real },
    Parameter { name: "mu_3", unit: "Pa", domain: Domain::Real },
    Parameter { name: "alpha_3", unit: "1", domain: Domain::Real },
    Parameter { name: "beta_3", unit: "1", domain: Domain::Real },
];

pub(super) const HYPERFOAM_1: ModelDescriptor = ModelDescriptor {
    key: "hyperfoam-1",
    kind: ModelKind::Compressible,
    parameters: PARAMETERS.split_at(3).0,
    build: |p| {
        let term = |p: &[f64]| FoamTerm { modulus: p[0], exponent: p[1], beta: p[2] };
        Ok(Box::new(Hyperfoam::new(&p.chunks_exact(3).map(term).collect::<Vec<_>>())?))
    },
    example: &[0.1e6, 8.0, 0.1],
    // `foam` has its own
    starts: |_| Vec::new(),
    contains: &[],
    slopes: None,
    refine: None,
};

pub(super) const HYPERFOAM_2: ModelDescriptor = ModelDescriptor {
    key: "hyperfoam-2",
    parameters: PARAMETERS.split_at(6).0,
    example: &[0.1e6, 8.0, 0.1, 0.05e6, -2.5, 0.6],
    ..HYPERFOAM_1
};

pub(super) const HYPERFOAM_3: ModelDescriptor = ModelDescriptor {
    key: "hyperfoam-3",
    parameters: &PARAMETERS,
    example: &[0.1e6, 8.0, 0.1, 0.05e6, -2.5, 0.6, 0.02e6, 3.0, 0.0],
    ..HYPERFOAM_1
};

impl FoamTerm {
    /// ν = β/(1 + 2β), as Abaqus takes it; Poisson's ratio at rest of a law with one term.
    pub fn poisson_ratio(&self) -> f64 {
        self.beta / (1.0 + 2.0 * self.beta)
    }
}

impl Hyperfoam {
    const NAME: &'static str = "hyperfoam";

    /// Builds the law from its terms; the shear modulus, the sum of μᵢ, must be positive.
    ///
    /// # Errors
    /// [`Error::Parameter`], also for an empty list.
    pub fn new(terms: &[FoamTerm]) -> Result<Self, Error> {
        for (i, &FoamTerm { modulus, exponent, beta }) in terms.iter().enumerate() {
            let name = |name: &str| format!("{name}_{}", i + 1);
            parameter(Self::NAME, &name("mu"), modulus, true, "(−∞, ∞)")?;
            parameter(Self::NAME, &name("alpha"), exponent, exponent != 0.0, "(−∞, 0) or (0, ∞)")?;
            parameter(Self::NAME, &name("beta"), beta, beta > -1.0 / 3.0, "(−1/3, ∞)")?;
        }
        positive(Self::NAME, "shear modulus", terms.iter().map(|term| term.modulus).sum())?;
        Ok(Self { terms: terms.to_vec() })
    }

    /// Terms, in the order of the constructor.
    pub fn terms(&self) -> &[FoamTerm] {
        &self.terms
    }

    /// Bulk modulus at rest, Σ2μᵢ(⅓ + βᵢ), Pa.
    pub fn bulk_modulus(&self) -> f64 {
        self.terms.iter().map(|term| 2.0 * term.modulus * (1.0 / 3.0 + term.beta)).sum()
    }
}

impl Hyperelastic for Hyperfoam {
    fn name(&self) -> String {
        format!("{} {}", Self::NAME, self.terms.len())
    }

    fn parameters(&self) -> Vec<(String, f64)> {
        let named = |(i, term): (usize, &FoamTerm)| {
            [("mu", term.modulus), ("alpha", term.exponent), ("beta", term.beta)]
                .map(|(name, value)| (format!("{name}_{}", i + 1), value))
        };
        self.terms.iter().enumerate().flat_map(named).collect()
    }

    fn shear_modulus(&self) -> f64 {
        self.terms.iter().map(|term| term.modulus).sum()
    }

    fn energy_at(&self, stretches: [f64; 3]) -> Result<f64, Error> {
        check_stretches(&stretches)?;
        let logs = stretches.map(f64::ln);
        let volume: f64 = logs.iter().sum();
        let energy = |&FoamTerm { modulus, exponent, beta }: &FoamTerm| {
            let shape: f64 = logs.iter().map(|log| (exponent * log).exp_m1()).sum();
            let bulk =
                if beta == 0.0 { -exponent * volume } else { (-exponent * beta * volume).exp_m1() / beta };
            2.0 * modulus / exponent / exponent * (shape + bulk)
        };
        finite(Self::NAME, stretches, self.terms.iter().map(energy).sum())
    }

    fn response_at(&self, stretches: [f64; 3]) -> Result<PrincipalResponse, Error> {
        check_stretches(&stretches)?;
        // w′ = 2μ/α λ^(α − 1); h = J dU/dJ = −Σ2μ/α J^(−αβ), J dh/dJ = Σ2μβ J^(−αβ)
        let law = |l: f64| {
            self.terms.iter().fold((0.0, 0.0), |(first, second), term| {
                let slope = 2.0 * term.modulus / term.exponent * l.powf(term.exponent - 1.0);
                (first + slope, second + (term.exponent - 1.0) * slope / l)
            })
        };
        let volume: f64 = stretches.iter().map(|l| l.ln()).sum();
        let (h, slope) = self.terms.iter().fold((0.0, 0.0), |(h, slope), term| {
            let power = 2.0 * term.modulus * (-term.exponent * term.beta * volume).exp();
            (h - power / term.exponent, slope + term.beta * power)
        });
        let steepest = self.terms.iter().fold(1.0_f64, |most, term| most.max(0.25 * term.exponent.abs()));
        PrincipalResponse::separable(stretches, law, |l| l / steepest)
            .plus(&PrincipalResponse::volumetric(stretches, h, slope))
            .finite(Self::NAME, stretches)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::hyperelastic::homogeneous::free_bar;
    use crate::constitutive::verify::{Deviations, deformations};
    use crate::constitutive::{Law, Workspace};

    fn example() -> Hyperfoam {
        let term = |modulus, exponent, beta| FoamTerm { modulus, exponent, beta };
        Hyperfoam::new(&[term(0.1e6, 8.0, 0.1), term(0.05e6, -2.5, 0.6), term(0.02e6, 3.0, 0.0)]).unwrap()
    }

    /// 2e-8: truncation of the differences; roundings of the rest.
    #[test]
    fn derivatives_symmetry_objectivity_rest() {
        let law = example();
        let found = Deviations::measure(&law, &deformations()).unwrap();
        evidence::at_most("∂W/∂C of hyperfoam against its stress", found.stress.unwrap(), 2e-8);
        evidence::at_most("∂S/∂C of hyperfoam against its tangent", found.tangent, 2e-8);
        assert!(found.objectivity < 1e-12 && found.bits == 0.0 && found.asymmetry < 1e-14, "{found:?}");
        assert!(found.energy_at_rest.unwrap() < 1e-12 && found.stress_at_rest < 1e-15, "{found:?}");
        let moduli = law.moduli(&mut Workspace::default()).unwrap();
        assert!((moduli.shear / law.shear_modulus() - 1.0).abs() < 1e-12, "{moduli:?}");
        assert!((moduli.bulk / law.bulk_modulus() - 1.0).abs() < 1e-12, "{moduli:?}");
    }

    /// With one term: λ₂ = λ₁^(−ν) and P = 2μ/(αλ₁) (λ₁^α − J^(−αβ)) (Abaqus Theory Guide 4.6.2).
    #[test]
    fn a_free_bar_in_closed_form() {
        let term = FoamTerm { modulus: 0.2e6, exponent: 7.0, beta: 0.4 };
        let law = Hyperfoam::new(&[term]).unwrap();
        let (mut lateral, mut nominal): (f64, f64) = (0.0, 0.0);
        for stretch in [0.2_f64, 0.7, 1.0, 1.3, 3.0] {
            let found = free_bar(&law, stretch).unwrap();
            let second = stretch.powf(-term.poisson_ratio());
            let volume = stretch * second * second;
            let expected = 2.0 * term.modulus / term.exponent / stretch
                * (stretch.powf(term.exponent) - volume.powf(-term.exponent * term.beta));
            lateral = lateral.max((found.lateral / second - 1.0).abs());
            nominal = nominal.max((found.nominal - expected).abs() / (term.modulus + expected.abs()));
        }
        evidence::at_most("lateral stretch of a foam bar − λ^(−ν)", lateral, 1e-12);
        evidence::at_most("nominal stress of a foam bar, closed form", nominal, 1e-12);
    }

    #[test]
    fn parameters_are_checked() {
        let term = |modulus, exponent, beta| [FoamTerm { modulus, exponent, beta }];
        for (terms, part) in [
            (term(1.0, 0.0, 0.1), "alpha_1 = 0"),
            (term(1.0, 2.0, -0.4), "beta_1 = -0.4"),
            (term(-1.0, 2.0, 0.1), "shear modulus = -1"),
            (term(f64::NAN, 2.0, 0.1), "mu_1 = NaN"),
        ] {
            let error = Hyperfoam::new(&terms).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
        assert!(Hyperfoam::new(&[]).is_err());
    }
}
