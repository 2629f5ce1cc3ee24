//! Invariants of each material symmetry, as polynomials in the six components of C.
//!
//! Invariants are written as sums of monomials in [C₁₁, C₂₂, C₃₃, C₁₂, C₁₃, C₂₃] in the material's own axes,
//! whose derivatives are then exact by rule. Bases: Boehler 1987
//! (<https://doi.org/10.1007/978-3-7091-2810-7>), Smith 1962 (<https://doi.org/10.1007/BF00281203>) for
//! monoclinic and orthotropic.

use crate::constitutive::Error;
use crate::tensor::{Tensor, Voigt6x6, voigt};
use serde::{Deserialize, Serialize};

/// A monomial: coefficient, and the components that are multiplied.
pub type Monomial<'a> = (f64, &'a [usize]);

/// Symmetry of the crystal; the third of the material axes is the special one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Symmetry {
    /// No symmetry: the six components of C.
    Triclinic,
    /// A two-fold axis along the third material axis, as γ-PA12's unique axis b along the chains (point group
    /// 2/m).
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

const COFACTOR_3: &[Monomial<'static>] = &[(1.0, &[A, B]), (-1.0, &[D, D])];

impl Symmetry {
    /// All of them, from none to all rotations.
    pub const ALL: [Self; 5] =
        [Self::Triclinic, Self::Monoclinic, Self::Orthotropic, Self::Transverse, Self::Isotropic];

    /// Material axes of two-fold symmetry.
    pub fn two_fold_axes(self) -> &'static [usize] {
        match self {
            Self::Triclinic => &[],
            Self::Monoclinic => &[2],
            Self::Orthotropic | Self::Transverse | Self::Isotropic => &[0, 1, 2],
        }
    }

    /// The invariants: of isotropy I₁, I₂, I₃ (1.7)–(1.9), of transverse isotropy also a·Ca and a·C²a.
    pub fn invariants(self) -> &'static [&'static [Monomial<'static>]] {
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

    /// Invariants that are convex in (F, cof F, J): |F aᵢ|² = aᵢ·C aᵢ and |cof F aᵢ|² = aᵢ·cof C aᵢ or their
    /// sums, and last J² (whose root is the input). `None` if too few are known: triclinic and monoclinic.
    ///
    /// Schröder & Neff 2003, <https://doi.org/10.1016/S0020-7683(02)00458-4>.
    pub fn polyconvex_invariants(self) -> Option<&'static [&'static [Monomial<'static>]]> {
        match self {
            Self::Triclinic | Self::Monoclinic => None,
            Self::Orthotropic => Some(&[
                &[(1.0, &[A])],
                &[(1.0, &[B])],
                &[(1.0, &[C])],
                &[(1.0, &[B, C]), (-1.0, &[F, F])],
                &[(1.0, &[A, C]), (-1.0, &[E, E])],
                COFACTOR_3,
                THIRD,
            ]),
            Self::Transverse => Some(&[FIRST, SECOND, &[(1.0, &[C])], COFACTOR_3, THIRD]),
            Self::Isotropic => Some(&[FIRST, SECOND, THIRD]),
        }
    }

    /// Names of the invariants, in the material axes.
    pub fn names(self, polyconvex: bool) -> &'static [&'static str] {
        match (self, polyconvex) {
            (Self::Triclinic, _) => &["C11", "C22", "C33", "C12", "C13", "C23"],
            (Self::Monoclinic, _) => &["C11", "C22", "C33", "C12", "C13²", "C23²", "C13 C23"],
            (Self::Orthotropic, false) => &["C11", "C22", "C33", "C12²", "C13²", "C23²", "C12 C13 C23"],
            (Self::Orthotropic, true) => &["C11", "C22", "C33", "cof C11", "cof C22", "cof C33", "J"],
            (Self::Transverse, false) => &["I1", "I2", "I3", "C33", "(C²)33"],
            (Self::Transverse, true) => &["I1", "I2", "C33", "cof C33", "J"],
            (Self::Isotropic, false) => &["I1", "I2", "I3"],
            (Self::Isotropic, true) => &["I1", "I2", "J"],
        }
    }

    /// Terms with which a polyconvex energy removes its stress at rest, of the form p 1 + Σ s a⊗a in the
    /// material axes.
    pub fn stress_at_rest(self) -> StressAtRest {
        match self {
            Self::Orthotropic => StressAtRest {
                spherical: [0.0; 3],
                along: &[([1.0, 0.0, 0.0], 0, 3), ([0.0, 1.0, 0.0], 1, 4), ([0.0, 0.0, 1.0], 2, 5)],
            },
            Self::Transverse => {
                StressAtRest { spherical: [1.0, 0.0, 0.0], along: &[([-1.0, 0.0, 1.0], 2, 3)] }
            }
            _ => StressAtRest { spherical: [1.0, 0.0, 0.0], along: &[] },
        }
    }
}

/// The parts of S(I) = p 1 + Σ s a⊗a as sums over S₁₁, S₂₂, S₃₃.
#[derive(Debug, Clone, Copy)]
pub struct StressAtRest {
    /// p.
    pub spherical: [f64; 3],
    /// Factor s for each direction a, and the indices of a·Ca and a·cof C a among the polyconvex invariants.
    pub along: &'static [([f64; 3], usize, usize)],
}

/// Matrix T of C' = T C (as vectors), C' in the material axes, which are the rows of `axes`.
///
/// # Errors
/// [`Error::Invalid`] unless the axes are orthonormal to 1e-9 and right-handed.
pub(super) fn into_material_axes(axes: &[[f64; 3]; 3]) -> Result<Voigt6x6, Error> {
    let q = Tensor::from_fn(|i, j| axes[i][j]);
    let fault = (q * q.transpose() - Tensor::identity()).amax();
    // also catches NaN
    if fault < 1e-9 && q.determinant() > 0.0 {
        Ok(voigt::stress_transformation(&q))
    } else {
        let allowed = "three orthonormal, right-handed rows";
        Err(Error::invalid("material axes", format!("{axes:?}"), allowed))
    }
}
