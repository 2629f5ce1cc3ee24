//! Polynomials in I₁ − 3 and I₂ − 3 of any terms.

use super::descriptor::{Contained, Domain, ModelDescriptor, ModelKind, Parameter};
use super::polynomial::{first_invariant_excess, second_invariant_excess};
use super::principal::InvariantDerivatives;
use super::{Error, Hyperelastic, PrincipalResponse, finite, parameter, positive};

/// W = Σ C_ij (I₁ − 3)^i (I₂ − 3)^j; shear modulus 2(C₁₀ + C₀₁); Rivlin, doi:10.1098/rsta.1948.0024.
#[derive(Debug, Clone, PartialEq)]
pub struct Polynomial {
    /// i, j, C_ij.
    terms: Vec<(i32, i32, f64)>,
}

/// Exponents of each term, in the order of the parameters.
type Exponents = &'static [(i32, i32)];

const SECOND_ORDER: Exponents = &[(1, 0), (0, 1), (2, 0), (1, 1), (0, 2)];
const REDUCED: Exponents = &[(1, 0), (2, 0)];
const BIDERMAN: Exponents = &[(1, 0), (0, 1), (2, 0), (3, 0)];
const REDUCED_OF_SIX: Exponents = &[(1, 0), (2, 0), (3, 0), (4, 0), (5, 0), (6, 0)];
const THIRD_ORDER: Exponents = &[(1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3)];

const fn coefficient(name: &'static str) -> Parameter {
    Parameter { name, unit: "Pa", domain: Domain::Real }
}

/// C₁₀ of the neo-Hookean law, all others 0.
fn linear<const N: usize>(modulus: f64) -> Vec<f64> {
    std::iter::once(0.5 * modulus).chain(std::iter::repeat_n(0.0, N - 1)).collect()
}

pub(super) const POLYNOMIAL_2: ModelDescriptor = ModelDescriptor {
    key: "polynomial-2",
    kind: ModelKind::Phenomenological,
    parameters: &[
        coefficient("C10"),
        coefficient("C01"),
        coefficient("C20"),
        coefficient("C11"),
        coefficient("C02"),
    ],
    build: |p| build(SECOND_ORDER, p),
    example: &[0.15e6, 0.02e6, 1e3, 100.0, 50.0],
    starts: |start| vec![linear::<5>(start.modulus)],
    contains: &[
        Contained { key: "mooney-rivlin", embed: |p, _| vec![vec![p[0], p[1], 0.0, 0.0, 0.0]] },
        Contained { key: "reduced-polynomial-2", embed: |p, _| vec![vec![p[0], 0.0, p[1], 0.0, 0.0]] },
    ],
    slopes: None,
    refine: None,
};

pub(super) const REDUCED_POLYNOMIAL_2: ModelDescriptor = ModelDescriptor {
    key: "reduced-polynomial-2",
    kind: ModelKind::Phenomenological,
    parameters: &[coefficient("C10"), coefficient("C20")],
    build: |p| build(REDUCED, p),
    example: &[0.2e6, 2e3],
    starts: |start| vec![linear::<2>(start.modulus)],
    contains: &[Contained { key: "neo-hookean", embed: |p, _| vec![linear::<2>(p[0])] }],
    slopes: None,
    refine: None,
};

/// Law of Biderman (1958): Yeoh's with a term in I₂.
pub(super) const BIDERMAN_4: ModelDescriptor = ModelDescriptor {
    key: "biderman",
    kind: ModelKind::Phenomenological,
    parameters: &[coefficient("C10"), coefficient("C01"), coefficient("C20"), coefficient("C30")],
    build: |p| build(BIDERMAN, p),
    example: &[0.15e6, 0.02e6, 1e3, 50.0],
    starts: |start| vec![linear::<4>(start.modulus)],
    contains: &[
        Contained { key: "mooney-rivlin", embed: |p, _| vec![vec![p[0], p[1], 0.0, 0.0]] },
        Contained { key: "yeoh", embed: |p, _| vec![vec![p[0], 0.0, p[1], p[2]]] },
    ],
    slopes: None,
    refine: None,
};

const REDUCED_COEFFICIENTS: &[Parameter] = &[
    coefficient("C10"),
    coefficient("C20"),
    coefficient("C30"),
    coefficient("C40"),
    coefficient("C50"),
    coefficient("C60"),
];

/// Plausible C_i0 for a rubber.
const REDUCED_EXAMPLE: &[f64] = &[0.2e6, 2e3, 50.0, 2.0, 0.1, 5e-3];

/// Reduced polynomial of so many terms, which contains the law `inner` of one less.
const fn reduced<const N: usize>(key: &'static str, inner: &'static [Contained]) -> ModelDescriptor {
    ModelDescriptor {
        key,
        kind: ModelKind::Phenomenological,
        parameters: REDUCED_COEFFICIENTS.split_at(N).0,
        build: |p| build(REDUCED_OF_SIX, p),
        example: REDUCED_EXAMPLE.split_at(N).0,
        starts: |start| vec![linear::<N>(start.modulus)],
        contains: inner,
        slopes: None,
        refine: None,
    }
}

/// Parameters of a reduced polynomial and a term of 0.
fn with_absent_term(p: &[f64]) -> Vec<Vec<f64>> {
    vec![p.iter().copied().chain([0.0]).collect()]
}

pub(super) const REDUCED_POLYNOMIAL_4: ModelDescriptor =
    reduced::<4>("reduced-polynomial-4", &[Contained { key: "yeoh", embed: |p, _| with_absent_term(p) }]);

pub(super) const REDUCED_POLYNOMIAL_5: ModelDescriptor = reduced::<5>(
    "reduced-polynomial-5",
    &[Contained { key: "reduced-polynomial-4", embed: |p, _| with_absent_term(p) }],
);

pub(super) const REDUCED_POLYNOMIAL_6: ModelDescriptor = reduced::<6>(
    "reduced-polynomial-6",
    &[Contained { key: "reduced-polynomial-5", embed: |p, _| with_absent_term(p) }],
);

pub(super) const POLYNOMIAL_3: ModelDescriptor = ModelDescriptor {
    key: "polynomial-3",
    kind: ModelKind::Phenomenological,
    parameters: &[
        coefficient("C10"),
        coefficient("C01"),
        coefficient("C20"),
        coefficient("C11"),
        coefficient("C02"),
        coefficient("C30"),
        coefficient("C21"),
        coefficient("C12"),
        coefficient("C03"),
    ],
    build: |p| build(THIRD_ORDER, p),
    example: &[0.15e6, 0.02e6, 1e3, 100.0, 50.0, 50.0, 2.0, 1.0, 0.5],
    starts: |start| vec![linear::<9>(start.modulus)],
    contains: &[
        Contained {
            key: "polynomial-2",
            embed: |p, _| vec![vec![p[0], p[1], p[2], p[3], p[4], 0.0, 0.0, 0.0, 0.0]],
        },
        Contained {
            key: "biderman",
            embed: |p, _| vec![vec![p[0], p[1], p[2], 0.0, 0.0, p[3], 0.0, 0.0, 0.0]],
        },
    ],
    slopes: None,
    refine: None,
};

/// Builds the law of the first terms, one for each parameter.
fn build(exponents: Exponents, p: &[f64]) -> Result<Box<dyn Hyperelastic>, Error> {
    let terms = exponents.iter().zip(p).map(|(&(i, j), &value)| (i, j, value)).collect();
    Ok(Box::new(Polynomial::new(terms)?))
}

impl Polynomial {
    const NAME: &'static str = "polynomial";

    /// Builds the law of terms (i, j, C_ij in Pa), i, j ≥ 0, i + j ≥ 1; C₁₀ + C₀₁ > 0.
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn new(terms: Vec<(i32, i32, f64)>) -> Result<Self, Error> {
        for &(i, j, value) in &terms {
            parameter(Self::NAME, &format!("C{i}{j}"), value, true, "(−∞, ∞)")?;
            let exponents = f64::from(i.min(j).min(i.saturating_add(j) - 1));
            parameter(Self::NAME, "exponent", exponents, exponents >= 0.0, "i, j ≥ 0, i + j ≥ 1")?;
        }
        let law = Self { terms };
        positive(Self::NAME, "C10 + C01", 0.5 * law.shear_modulus())?;
        Ok(law)
    }
}

impl Hyperelastic for Polynomial {
    fn name(&self) -> String {
        format!("{} of {} terms", Self::NAME, self.terms.len())
    }

    fn parameters(&self) -> Vec<(String, f64)> {
        self.terms.iter().map(|(i, j, value)| (format!("C{i}{j}"), *value)).collect()
    }

    fn shear_modulus(&self) -> f64 {
        2.0 * self.terms.iter().filter(|(i, j, _)| i + j == 1).map(|term| term.2).sum::<f64>()
    }

    fn energy_at(&self, stretches: [f64; 3]) -> Result<f64, Error> {
        let (x, y) = (first_invariant_excess(stretches), second_invariant_excess(stretches));
        finite(Self::NAME, stretches, self.terms.iter().map(|(i, j, c)| c * x.powi(*i) * y.powi(*j)).sum())
    }

    fn response_at(&self, stretches: [f64; 3]) -> Result<PrincipalResponse, Error> {
        let (x, y) = (first_invariant_excess(stretches), second_invariant_excess(stretches));
        // xⁱ, its first and its second derivative
        let powers = |x: f64, i: i32| {
            let of =
                |order: i32, factor: i32| if order < 0 { 0.0 } else { f64::from(factor) * x.powi(order) };
            [of(i, 1), of(i - 1, i), of(i - 2, i * (i - 1))]
        };
        let mut w = InvariantDerivatives::default();
        for &(i, j, c) in &self.terms {
            let (of_x, of_y) = (powers(x, i), powers(y, j));
            w.first += c * of_x[1] * of_y[0];
            w.second += c * of_x[0] * of_y[1];
            w.first_first += c * of_x[2] * of_y[0];
            w.second_second += c * of_x[0] * of_y[2];
            w.mixed += c * of_x[1] * of_y[1];
        }
        PrincipalResponse::from_invariants(stretches, w).finite(Self::NAME, stretches)
    }
}
