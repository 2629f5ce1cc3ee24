//! Linear solvers for one stage of a step, A δ = r with A = D + M + a·(K + faces).

mod aggregation;
mod bicgstab;
mod cached;
mod cg;
mod choice;
mod direct;
mod dissection;
mod multigrid;
mod packed;
mod packed_bands;

pub use cached::Cached;
pub use cg::{PACKED_CHANGE, SolveOutcome, StoppingCriterion};
pub use choice::{LEVELS, LinearMethod, LinearSolver, LinearTask, SolverChoice};
pub use direct::Direct;
pub use multigrid::Multigrid;
pub use packed::PackedRows;

use crate::system::vector::{dot, weighted_square};
use crate::system::{ConductionRows, FaceMatrices};
use bicgstab::BiconjugateGradients;
use cg::ConjugateGradients;

/// Matrix A = D + `weights[0]`·M + `weights[1]`·(K + faces).
#[derive(Clone, Copy)]
pub struct Operator<'a> {
    /// Matrices M and K.
    pub rows: &'a ConductionRows,
    /// Diagonal D, lumped capacity and surfaces; `None` with consistent capacity.
    pub diagonal: Option<&'a [f64]>,
    /// Factors of M and K.
    pub weights: [f64; 2],
    /// Surface matrices with consistent capacity.
    pub faces: &'a FaceMatrices,
    /// Packed single-precision rows for the iterations, if rows are unequal: A with consistent capacity, K
    /// with lumped capacity.
    pub packed: Option<&'a PackedRows>,
}

impl Operator<'_> {
    /// Returns the operator without packed rows.
    pub fn exact(&self) -> Self {
        Self { packed: None, ..*self }
    }

    /// Computes y = A x; returns x·y.
    pub fn product(&self, x: &[f64], y: &mut [f64]) -> f64 {
        let product = match self.packed {
            Some(packed) => {
                let factor = if self.diagonal.is_some() { self.weights[1] } else { 1.0 };
                packed.product(self.rows, self.diagonal, (factor, self.weights), x, y)
            }
            None => self.rows.product(self.diagonal, self.weights, x, y),
        };
        if self.faces.is_empty() {
            return product;
        }
        for face in self.faces.iter() {
            face.add_product(self.weights[1], x, y);
        }
        dot(x, y)
    }
}

/// Iterative methods with their work vectors.
#[derive(Default)]
pub struct Iterative {
    conjugate: ConjugateGradients,
    biconjugate: BiconjugateGradients,
    /// Multigrid preconditioner of symmetric matrices, if used.
    pub multigrid: Cached<Option<Multigrid>>,
}

impl Iterative {
    /// Swaps the work vectors of conjugate gradients, the direction and A times it, with two vectors that are
    /// free until the next call.
    pub fn swap_vectors(&mut self, direction: &mut Vec<f64>, image: &mut Vec<f64>) {
        self.conjugate.swap_vectors(direction, image);
    }

    /// Recomputes the residual of the last solve of a symmetric matrix with A itself, if packed rows served
    /// it.
    pub fn renew(&self, operator: &Operator, inverse: &[f64], residual: &mut [f64], solution: &[f64]) {
        self.conjugate.renew(operator, inverse, residual, solution);
    }

    /// Solves A x = r from x = 0 by the method that suits the matrix. `inverse` is the reciprocal of A's
    /// diagonal, 0 where x stays 0; `residual` becomes r − A x, as tracked by the iteration.
    pub fn solve(
        &mut self,
        operator: &Operator,
        symmetric: bool,
        inverse: &[f64],
        residual: &mut [f64],
        solution: &mut [f64],
        goal: &StoppingCriterion,
    ) -> SolveOutcome {
        let Self { conjugate, biconjugate, multigrid } = self;
        if symmetric {
            conjugate.solve(multigrid.value.as_mut(), operator, inverse, residual, solution, goal)
        } else {
            biconjugate.solve(operator, inverse, residual, solution, goal)
        }
    }
}

/// Squared norm of a residual, Σ r²/D.
pub fn norm_squared(residual: &[f64], inverse: &[f64]) -> f64 {
    weighted_square(residual, inverse)
}
