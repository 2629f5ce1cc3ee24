//! Linear systems of one stage of a step, A δ = r with A = D + M + a·(K + faces).

mod aggregation;
mod bicgstab;
mod cg;
mod choice;
mod direct;
mod dissection;
mod multigrid;
mod packed;

pub use cg::{Ended, Goal};
pub use choice::{Choice, LEVELS, LinearSolver, Method, Task};
pub use direct::Direct;
pub use multigrid::Multigrid;
pub use packed::Packed;

use crate::system::vector::{combine, dot, set, weighted_square};
use crate::system::{FaceMatrices, Rows};
use bicgstab::BiconjugateGradients;
use cg::ConjugateGradients;

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
    /// M and K for the iterations, where rows are unequal: A with consistent capacity, K with lumped one. Rounded to single precision.
    pub packed: Option<&'a Packed>,
}

impl Operator<'_> {
    /// Without packed rows.
    pub fn exact(&self) -> Self {
        Self { packed: None, ..*self }
    }

    /// y = A x; returns x·y.
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

/// Relative change of a solution by packed rows, in the norm of A: 2⁻²⁴ of the terms |a_ij| (x_i − x_j)²/2, which add up to at most about
/// four times xᵀAx, as entries of both signs do.
const PACKED: f64 = 4.0 / 16_777_216.0;
/// Part of the tolerance that it may be.
const UNSEEN: f64 = 0.3;
/// Solutions in a row, each from the residual that the last one left.
const MOST_RESTARTS: usize = 4;

/// The iterative methods with their work space.
#[derive(Default)]
pub struct Iterative {
    right: Vec<f64>,
    restarted: Vec<f64>,
    conjugate: ConjugateGradients,
    biconjugate: BiconjugateGradients,
    /// The preconditioner of symmetric matrices, where it is not the diagonal.
    pub multigrid: Option<Multigrid>,
}

impl Iterative {
    /// Solves A x = r from x = 0 by the method that suits the matrix. `inverse` is one over A's diagonal, 0 where x stays 0;
    /// `residual` becomes r − A x, as the iterations know it.
    pub fn solve(
        &mut self,
        operator: &Operator,
        symmetric: bool,
        inverse: &[f64],
        residual: &mut [f64],
        solution: &mut [f64],
        goal: &Goal,
    ) -> Ended {
        if operator.packed.is_none() {
            return self.once(operator, symmetric, inverse, residual, solution, goal);
        }
        self.right.clear();
        self.right.extend_from_slice(residual);
        let mut ended = self.once(operator, symmetric, inverse, residual, solution, goal);
        let mut rounding = PACKED * ended.size;
        for _ in 0..MOST_RESTARTS {
            if !ended.converged || rounding <= UNSEEN * goal.tolerance {
                break;
            }
            let size = solution.len();
            let mut more = std::mem::take(&mut self.restarted);
            more.resize(size, 0.0);
            operator.exact().product(solution, &mut more);
            let right = &self.right;
            set(residual, |k| if inverse[k] == 0.0 { 0.0 } else { right[k] - more[k] });
            let again = self.once(operator, symmetric, inverse, residual, &mut more, goal);
            combine(solution, |k, own| own + more[k]);
            self.restarted = more;
            rounding = PACKED * again.size;
            ended = Ended { iterations: ended.iterations + again.iterations, size: ended.size, ..again };
        }
        ended
    }

    fn once(
        &mut self,
        operator: &Operator,
        symmetric: bool,
        inverse: &[f64],
        residual: &mut [f64],
        solution: &mut [f64],
        goal: &Goal,
    ) -> Ended {
        let Self { conjugate, biconjugate, multigrid, .. } = self;
        match multigrid {
            _ if !symmetric => biconjugate.solve(operator, inverse, residual, solution, goal),
            Some(levels) => conjugate.solve_with(levels, operator, inverse, residual, solution, goal),
            None => conjugate.solve(operator, inverse, residual, solution, goal),
        }
    }
}

/// Σ r²/D: the square of a residual's norm.
pub fn norm_squared(residual: &[f64], inverse: &[f64]) -> f64 {
    weighted_square(residual, inverse)
}
