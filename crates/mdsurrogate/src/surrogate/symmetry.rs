//! What an energy may depend on under a material symmetry: polynomials in the six components of C.
//!
//! Invariants are written as sums of monomials in [C₁₁, C₂₂, C₃₃, C₁₂, C₁₃, C₂₃] in the material's own axes, whose
//! derivatives are then exact by rule. Bases: Boehler 1987 (<https://doi.org/10.1007/978-3-7091-2810-7>),
//! Smith 1962 (<https://doi.org/10.1007/BF00281203>) for monoclinic and orthotropic.

use crate::Error;
use crate::network::Real;
use polycore::tensor::{Tensor, Voigt6x6, voigt};
use serde::{Deserialize, Serialize};

/// A monomial: coefficient, and the components that are multiplied.
type Monomial<'a> = (f64, &'a [usize]);

/// A symmetry of the crystal, the third of the material axes being the special one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Symmetry {
    /// No symmetry: the six components of C.
    Triclinic,
    /// A two-fold axis along the third material axis, as γ-PA12's unique axis b along the chains (point group 2/m).
    Monoclinic,
    /// Three perpendicular two-fold axes.
    Orthotropic,
    /// All rotations about the third axis, and its reversal.
    Transverse,
    /// All rotations.
    Isotropic,
}

// positions of the components
const A: usize = 0;
const B: usize = 1;
const C: usize = 2;
const D: usize = 3; // 12
const E: usize = 4; // 13
const F: usize = 5; // 23

const FIRST: &[Monomial<'static>] = &[(1.0, &[A]), (1.0, &[B]), (1.0, &[C])];
const SECOND: &[Monomial<'static>] =
    &[(1.0, &[A, B]), (1.0, &[A, C]), (1.0, &[B, C]), (-1.0, &[D, D]), (-1.0, &[E, E]), (-1.0, &[F, F])];
const THIRD: &[Monomial<'static>] =
    &[(1.0, &[A, B, C]), (2.0, &[D, E, F]), (-1.0, &[A, F, F]), (-1.0, &[B, E, E]), (-1.0, &[C, D, D])];

impl Symmetry {
    /// All of them, from none to all rotations.
    pub const ALL: [Self; 5] =
        [Self::Triclinic, Self::Monoclinic, Self::Orthotropic, Self::Transverse, Self::Isotropic];

    /// The invariants: of isotropy I₁, I₂, I₃ (1.7)–(1.9), of transverse isotropy also a·Ca and a·C²a.
    pub(crate) fn invariants(self) -> &'static [&'static [Monomial<'static>]] {
        match self {
            Self::Triclinic => &[
                &[(1.0, &[A])],
                &[(1.0, &[B])],
                &[(1.0, &[C])],
                &[(1.0, &[D])],
                &[(1.0, &[E])],
                &[(1.0, &[F])],
            ],
            Self::Monoclinic => &[
                &[(1.0, &[A])],
                &[(1.0, &[B])],
                &[(1.0, &[C])],
                &[(1.0, &[D])],
                &[(1.0, &[E, E])],
                &[(1.0, &[F, F])],
                &[(1.0, &[E, F])],
            ],
            Self::Orthotropic => &[
                &[(1.0, &[A])],
                &[(1.0, &[B])],
                &[(1.0, &[C])],
                &[(1.0, &[D, D])],
                &[(1.0, &[E, E])],
                &[(1.0, &[F, F])],
                &[(1.0, &[D, E, F])],
            ],
            Self::Transverse => {
                &[FIRST, SECOND, THIRD, &[(1.0, &[C])], &[(1.0, &[C, C]), (1.0, &[E, E]), (1.0, &[F, F])]]
            }
            Self::Isotropic => &[FIRST, SECOND, THIRD],
        }
    }

    /// Values of the invariants at c.
    pub fn values<T: Real>(self, c: &[T; 6], out: &mut [T]) {
        for (value, invariant) in out.iter_mut().zip(self.invariants()) {
            *value = polynomial(invariant, c);
        }
    }

    /// ∂x_k/∂c_a, c₁₂ counted once.
    pub(super) fn gradient<T: Real>(self, c: &[T; 6], index: usize) -> [T; 6] {
        let mut gradient = [T::ZERO; 6];
        for (coefficient, factors) in self.invariants()[index] {
            for (place, &a) in factors.iter().enumerate() {
                gradient[a] += T::from_f64(*coefficient) * product(factors, c, place, usize::MAX);
            }
        }
        gradient
    }

    /// Adds weight · ∂²x_k/∂c_a∂c_b.
    pub(super) fn add_curvature<T: Real>(self, c: &[T; 6], index: usize, weight: T, to: &mut [[T; 6]; 6]) {
        for (coefficient, factors) in self.invariants()[index] {
            for (first, &a) in factors.iter().enumerate() {
                for (second, &b) in factors.iter().enumerate() {
                    if first != second {
                        to[a][b] += weight * T::from_f64(*coefficient) * product(factors, c, first, second);
                    }
                }
            }
        }
    }
}

fn polynomial<T: Real>(monomials: &[Monomial<'_>], c: &[T; 6]) -> T {
    let mut sum = T::ZERO;
    for (coefficient, factors) in monomials {
        sum += T::from_f64(*coefficient) * product(factors, c, usize::MAX, usize::MAX);
    }
    sum
}

/// The product of a monomial's components but those at two places.
fn product<T: Real>(factors: &[usize], c: &[T; 6], without: usize, and: usize) -> T {
    let mut product = T::ONE;
    for (place, &a) in factors.iter().enumerate() {
        if place != without && place != and {
            product = product * c[a];
        }
    }
    product
}

/// The matrix T of C' = T C (as vectors), C' in the material axes, which are the rows of `axes`.
///
/// # Errors
/// [`Error::Parameter`] unless the axes are orthonormal to 1e-9 and right-handed.
pub(super) fn into_material_axes(axes: &[[f64; 3]; 3]) -> Result<Voigt6x6, Error> {
    let q = Tensor::from_fn(|i, j| axes[i][j]);
    let fault = (q * q.transpose() - Tensor::identity()).amax();
    // also catches NaN
    if fault < 1e-9 && q.determinant() > 0.0 {
        Ok(voigt::stress_transformation(&q))
    } else {
        let allowed = "three orthonormal, right-handed rows";
        Err(Error::parameter("material axes", format!("{axes:?}"), allowed))
    }
}

/// The terms of a polynomial, or of its derivative by the components `by`, as C expressions in `c[…]`.
pub(super) fn terms(monomials: &[Monomial<'_>], by: &[usize]) -> Vec<String> {
    let Some((&a, rest)) = by.split_first() else {
        let text = |(coefficient, factors): &Monomial<'_>| {
            let product: String = factors.iter().map(|a| format!(" * c[{a}]")).collect();
            format!("({coefficient:e}){product}")
        };
        return monomials.iter().map(text).collect();
    };
    let mut all = Vec::new();
    for (coefficient, factors) in monomials {
        for place in (0..factors.len()).filter(|&place| factors[place] == a) {
            let mut left = factors.to_vec();
            left.remove(place);
            all.extend(terms(&[(*coefficient, &left)], rest));
        }
    }
    all
}
