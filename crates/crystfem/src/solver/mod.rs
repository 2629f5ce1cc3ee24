//! Linear systems of one stage of a step, A δ = r with A = D + M + a·(K + faces).

mod aggregation;
mod bicgstab;
mod cg;
mod choice;
mod direct;
mod dissection;
mod multigrid;

pub use bicgstab::BiconjugateGradients;
pub use cg::{ConjugateGradients, Ended};
pub use choice::{Choice, LEVELS, LinearSolver, Method, Task};
pub use direct::Direct;
pub use multigrid::Multigrid;

use crate::system::vector::{sum, weighted_square};
use crate::system::{FaceMatrices, Rows};

/// A = D + `weights[0]`·M + `weights[1]`·(K + faces).
#[derive(Clone, Copy)]
pub struct Operator<'a> {
    /// M and K.
    pub rows: &'a Rows,
    /// D: lumped capacity and surfaces; `None` with consistent capacity.
    pub diagonal: Option<&'a [f64]>,
    /// Factors of M and K.
    pub weights: [f64; 2],
    /// Surfaces with consistent capacity.
    pub faces: &'a FaceMatrices,
}

impl Operator<'_> {
    /// y = A x; returns x·y.
    pub fn product(&self, x: &[f64], y: &mut [f64]) -> f64 {
        let product = self.rows.product(self.diagonal, self.weights, x, y);
        if self.faces.is_empty() {
            return product;
        }
        for face in self.faces.iter() {
            face.add_product(self.weights[1], x, y);
        }
        sum(x.len(), |k| x[k] * y[k])
    }
}

/// Σ r²/D: the square of a residual's norm.
pub fn norm_squared(residual: &[f64], inverse: &[f64]) -> f64 {
    weighted_square(residual, inverse)
}
