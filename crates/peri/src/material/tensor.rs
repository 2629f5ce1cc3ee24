//! Tensors of a body's dimension.

use nalgebra::{Matrix3, SMatrix};

/// A tensor in the space of a body.
pub type Tensor<const D: usize> = SMatrix<f64, D, D>;

/// A tensor embedded in three dimensions.
pub(super) fn embed<const D: usize>(tensor: &Tensor<D>, third: f64) -> Matrix3<f64> {
    Matrix3::from_fn(|a, b| match (a < D && b < D, a == b) {
        (true, _) => tensor[(a, b)],
        (false, true) => third,
        (false, false) => 0.0,
    })
}

/// M⁻¹ and the least eigenvalue of M = `shape`, a tensor of trace 1.
pub(super) fn invert<const D: usize>(shape: &Tensor<D>) -> (Tensor<D>, f64) {
    let values = embed(shape, 1.0).symmetric_eigenvalues();
    // the third of two dimensions is 1, and none of the others is larger
    (shape.try_inverse().unwrap_or_else(Tensor::zeros), values.min())
}
