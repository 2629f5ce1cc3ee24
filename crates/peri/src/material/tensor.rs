//! Tensors of a body's dimension.

use nalgebra::{Matrix3, SMatrix, SVector};

/// A tensor in the space of a body.
pub type BodyTensor<const D: usize> = SMatrix<f64, D, D>;

/// A vector in the space of a body.
pub(super) type Vector<const D: usize> = SVector<f64, D>;

/// A tensor embedded in three dimensions.
pub(super) fn embed<const D: usize>(tensor: &BodyTensor<D>, third: f64) -> Matrix3<f64> {
    Matrix3::from_fn(|a, b| match (a < D && b < D, a == b) {
        (true, _) => tensor[(a, b)],
        (false, true) => third,
        (false, false) => 0.0,
    })
}

/// M⁻¹ and the least eigenvalue of M = `shape`, a tensor of trace 1.
pub(super) fn invert<const D: usize>(shape: &BodyTensor<D>) -> (BodyTensor<D>, f64) {
    let values = embed(shape, 1.0).symmetric_eigenvalues();
    // the third of two dimensions is 1, and none of the others is larger
    (shape.try_inverse().unwrap_or_else(BodyTensor::zeros), values.min())
}

/// cof F = J F⁻ᵀ.
pub(crate) fn cofactor<const D: usize>(gradient: &BodyTensor<D>) -> BodyTensor<D> {
    if D == 2 {
        let sign = |i: usize, k: usize| if i == k { 1.0 } else { -1.0 };
        return BodyTensor::from_fn(|i, k| sign(i, k) * gradient[(1 - i, 1 - k)]);
    }
    let full = embed(gradient, 1.0);
    let [a, b, c] = [0, 1, 2].map(|k| full.column(k).into_owned());
    let rows = [b.cross(&c), c.cross(&a), a.cross(&b)];
    BodyTensor::from_fn(|i, k| rows[k][i])
}
