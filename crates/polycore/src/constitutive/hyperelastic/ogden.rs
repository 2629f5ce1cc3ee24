//! Ogden's law in powers of the principal stretches.

use super::descriptor::{Contained, Domain, ModelDescriptor, ModelKind, Parameter};
use super::ogden_project::projected;
use super::{Error, Hyperelastic, PrincipalResponse, finite, ogden_starts, parameter, positive};

/// W = Σᵢ cᵢ (λ₁^αᵢ + λ₂^αᵢ + λ₃^αᵢ − 3) (1.24); doi:10.1098/rspa.1972.0026.
#[derive(Debug, Clone, PartialEq)]
pub struct Ogden {
    convention: OgdenConvention,
    /// μᵢ, αᵢ.
    terms: Vec<(f64, f64)>,
}

/// Convention for μᵢ in the prefactor cᵢ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OgdenConvention {
    /// cᵢ = 2μᵢ/αᵢ, as (1.24) prints it: the shear modulus is Σμᵢαᵢ.
    #[default]
    Thesis,
    /// cᵢ = 2μᵢ/αᵢ², as in Abaqus: the shear modulus is Σμᵢ.
    Abaqus,
    /// cᵢ = μᵢ/αᵢ, as in Ogden's paper: the shear modulus is ½Σμᵢαᵢ.
    Original,
}

/// Domains: αᵢ and μᵢ > 0 in Abaqus' convention, so that every term is stable on its own.
const fn parameters<const N: usize>(names: [(&'static str, &'static str); N]) -> [[Parameter; 2]; N] {
    let blank = Parameter { name: "", unit: "", domain: Domain::Real };
    let mut all = [[blank, blank]; N];
    let mut i = 0;
    while i < N {
        all[i] = [
            Parameter { name: names[i].0, unit: "Pa", domain: Domain::Positive },
            Parameter { name: names[i].1, unit: "1", domain: Domain::Real },
        ];
        i += 1;
    }
    all
}

const PARAMETERS: [[Parameter; 2]; 3] =
    parameters([("mu_1", "alpha_1"), ("mu_2", "alpha_2"), ("mu_3", "alpha_3")]);

fn build(p: &[f64]) -> Result<Box<dyn Hyperelastic>, Error> {
    let terms: Vec<_> = p.chunks_exact(2).map(|pair| (pair[0], pair[1])).collect();
    Ok(Box::new(Ogden::new(OgdenConvention::Abaqus, &terms)?))
}

pub(super) const OGDEN_1: ModelDescriptor = ModelDescriptor {
    key: "ogden-1",
    kind: ModelKind::Phenomenological,
    parameters: PARAMETERS.as_flattened().split_at(2).0,
    build,
    example: &[0.4e6, 2.2],
    starts: ogden_starts::starts::<1>,
    contains: &[Contained { key: "neo-hookean", embed: |p, _| vec![vec![p[0], 2.0]] }],
    slopes: Some(ogden_starts::slopes),
    refine: Some(projected),
};

pub(super) const OGDEN_2: ModelDescriptor = ModelDescriptor {
    key: "ogden-2",
    kind: ModelKind::Phenomenological,
    parameters: PARAMETERS.as_flattened().split_at(4).0,
    build,
    example: &[0.4e6, 1.3, 2e3, 5.0],
    starts: ogden_starts::starts::<2>,
    contains: &[
        Contained { key: "ogden-1", embed: ogden_starts::grown },
        Contained { key: "mooney-rivlin", embed: |p, _| vec![vec![2.0 * p[0], 2.0, 2.0 * p[1], -2.0]] },
    ],
    slopes: Some(ogden_starts::slopes),
    refine: Some(projected),
};

pub(super) const OGDEN_3: ModelDescriptor = ModelDescriptor {
    key: "ogden-3",
    kind: ModelKind::Phenomenological,
    parameters: PARAMETERS.as_flattened(),
    build,
    // Ogden's own values for Treloar's rubber (1.3, 5.0, −2.0; 0.63, 0.0012, −0.01 MPa), as μᵢαᵢ/2
    example: &[0.4095e6, 1.3, 0.003e6, 5.0, 0.01e6, -2.0],
    starts: ogden_starts::starts::<3>,
    contains: &[Contained { key: "ogden-2", embed: ogden_starts::grown }],
    slopes: Some(ogden_starts::slopes),
    refine: Some(projected),
};

impl Ogden {
    const NAME: &'static str = "Ogden";

    /// Builds the law from pairs (μᵢ in Pa, αᵢ ≠ 0); the shear modulus, their sum, must be positive.
    ///
    /// # Errors
    /// [`Error::Parameter`], also for an empty list.
    pub fn new(convention: OgdenConvention, terms: &[(f64, f64)]) -> Result<Self, Error> {
        for (i, &(modulus, exponent)) in terms.iter().enumerate() {
            parameter(Self::NAME, &format!("mu_{}", i + 1), modulus, true, "(−∞, ∞)")?;
            // c = 2μ/α has no limit at α = 0
            parameter(
                Self::NAME,
                &format!("alpha_{}", i + 1),
                exponent,
                exponent != 0.0,
                "(−∞, 0) or (0, ∞)",
            )?;
        }
        let law = Self { convention, terms: terms.to_vec() };
        positive(Self::NAME, "shear modulus", law.shear_modulus())?;
        Ok(law)
    }

    /// Returns the same law with its μᵢ in another convention.
    pub fn in_convention(&self, convention: OgdenConvention) -> Self {
        let terms = self
            .terms
            .iter()
            .map(|&(modulus, exponent)| {
                (modulus * self.convention.moment(exponent) / convention.moment(exponent), exponent)
            })
            .collect();
        Self { convention, terms }
    }

    /// The pairs (μᵢ, αᵢ).
    pub fn terms(&self) -> &[(f64, f64)] {
        &self.terms
    }

    /// mᵢ = αᵢ²cᵢ/2, the term's share of the shear modulus, and αᵢ.
    fn moments(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.terms.iter().map(|&(modulus, exponent)| (modulus * self.convention.moment(exponent), exponent))
    }
}

impl OgdenConvention {
    /// Share of the shear modulus per unit of μᵢ.
    fn moment(self, exponent: f64) -> f64 {
        match self {
            Self::Thesis => exponent,
            Self::Abaqus => 1.0,
            Self::Original => 0.5 * exponent,
        }
    }
}

impl Hyperelastic for Ogden {
    fn name(&self) -> String {
        format!("{} {}", Self::NAME, self.terms.len())
    }

    fn parameters(&self) -> Vec<(String, f64)> {
        let pairs = self.terms.iter().enumerate();
        pairs
            .flat_map(|(i, &(modulus, exponent))| {
                [(format!("mu_{}", i + 1), modulus), (format!("alpha_{}", i + 1), exponent)]
            })
            .collect()
    }

    fn shear_modulus(&self) -> f64 {
        self.moments().map(|(moment, _)| moment).sum()
    }

    fn energy_at(&self, stretches: [f64; 3]) -> Result<f64, Error> {
        let logs = stretches.map(f64::ln);
        let energy = self
            .moments()
            .map(|(m, a)| 2.0 * m / a / a * logs.iter().map(|log| (a * log).exp_m1()).sum::<f64>())
            .sum();
        finite(Self::NAME, stretches, energy)
    }

    fn response_at(&self, stretches: [f64; 3]) -> Result<PrincipalResponse, Error> {
        // w = (2m/α²)(λ^α − 1)
        let law = |l: f64| {
            self.moments().fold((0.0, 0.0), |(first, second), (m, a)| {
                let slope = 2.0 * m / a * l.powf(a - 1.0);
                (first + slope, second + (a - 1.0) * slope / l)
            })
        };
        let steepest = self.terms.iter().fold(1.0_f64, |most, (_, a)| most.max(0.25 * a.abs()));
        PrincipalResponse::separable(stretches, law, |l| l / steepest).finite(Self::NAME, stretches)
    }
}
