//! Kinematics and stress of finite deformation in three dimensions.
//!
//! [`DeformationGradient`] is a 3×3 matrix that was checked: every component is finite and det F > 0.
//! Everything else follows from it without further errors: Cauchy–Green tensors, invariants, principal
//! stretches, and the conversions between the four [`StressMeasure`]s. Voigt vectors and 6×6 tangents, with
//! their factor-2 rules, are in [`voigt`].
//!
//! Accuracy. The determinant is summed in doubled precision and the cofactors with fused multiply–add, so
//! that neither loses digits to cancellation; the principal stretches come from a one-sided Jacobi
//! decomposition of F itself (never of C, whose eigenvalues carry the square of the condition number).
//! Repeated stretches need no special case.

pub mod deformation;
pub mod stress;
pub mod voigt;

mod decomposition;

pub use decomposition::PrincipalFrame;
pub use deformation::{DeformationGradient, Invariants};
pub use stress::{StressMeasure, von_mises};
pub use voigt::{Voigt, Voigt6x6};

/// A second-order tensor in three dimensions, row i and column j its component ij.
pub type Tensor = nalgebra::Matrix3<f64>;
/// A second-order tensor in two dimensions.
pub type Tensor2 = nalgebra::Matrix2<f64>;

/// Error of a matrix that is no deformation gradient.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A component is NaN or infinite.
    #[error("component {row}{column} of the deformation gradient is {value}")]
    NotFinite {
        /// Row, from 1.
        row: usize,
        /// Column, from 1.
        column: usize,
        /// Value of the component.
        value: f64,
    },
    /// det F ≤ 0: the material is inverted or has no volume.
    #[error("the deformation gradient has determinant {determinant:e}; it must be positive")]
    Inverted {
        /// det F.
        determinant: f64,
    },
    /// det F is beyond the range of `f64`.
    #[error("the determinant of the deformation gradient leaves the range of f64 ({determinant})")]
    OutOfRange {
        /// Value of det F.
        determinant: f64,
    },
    /// A stretch is not a positive finite number.
    #[error("stretch {index} is {value}; a stretch must be positive and finite")]
    Stretch {
        /// Index of the stretch, from 1.
        index: usize,
        /// The value given.
        value: f64,
    },
    /// C is not finite or not positive definite.
    #[error("C = {c:?} is not positive definite")]
    NotPositiveDefinite {
        /// C₁₁, C₂₂, C₃₃, C₁₂, C₁₃, C₂₃.
        c: [f64; 6],
    },
}
