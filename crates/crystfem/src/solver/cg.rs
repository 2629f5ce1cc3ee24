//! Conjugate gradients with the diagonal or a multigrid cycle as preconditioner, matrix-free if the mesh has
//! equal rows.
//!
//! The error stops the iteration, not the residual: eᵀAe after k steps is Σ_{j≥k} α_j (r_j·z_j) (Hestenes &
//! Stiefel 1952, doi:10.6028/jres.049.044), extrapolated here as a geometric series; and eᵀAe ≥ eᵀCe, C the
//! capacity, so that √(eᵀAe/ΣC) bounds the capacity-weighted rms error of temperature.

use super::Operator;
use super::multigrid::Multigrid;
use crate::solver::norm_squared;
use crate::system::vector::{advance, blend, dot, turn};

/// Outcome of an iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolveOutcome {
    /// Number of iterations.
    pub iterations: usize,
    /// Estimated rms error, K.
    pub error: f64,
    /// True if the error is below the tolerance, or at rounding.
    pub converged: bool,
}

/// Stopping criterion of an iteration.
#[derive(Clone, Copy)]
pub struct StoppingCriterion<'a> {
    /// ΣC, J/K.
    pub capacity: f64,
    /// Tolerance of the error, K.
    pub tolerance: f64,
    /// Square of the residual norm that is due to rounding.
    pub floor: f64,
    /// Limit on iterations.
    pub limit: usize,
    /// Requests a stop.
    pub stop: &'a (dyn Fn() -> bool + Sync),
}

/// Relative change of a solution by packed rows, in the norm of A: 2⁻²⁴ of the terms |a_ij| (x_i − x_j)²/2,
/// whose sum is at most about four times xᵀAx, since entries have both signs.
pub const PACKED_CHANGE: f64 = 4.0 / 16_777_216.0;
/// Fraction of the remaining error that packed rows may cause.
const PACKED_ERROR: f64 = 0.03;
/// Fraction of the tolerance that packed rows may cause.
const PACKED_ERROR_AT_END: f64 = 0.3;

/// Error estimate: the last four terms of eᵀAe, from which the remaining sum is extrapolated.
struct ErrorEstimate {
    terms: [f64; 4],
    /// xᵀAx of the changes of the solution since its residual was computed with A itself.
    since: f64,
}

/// Action after an iteration.
enum NextAction {
    Iterate,
    /// Recompute the residual with A itself first.
    Renew,
    End(SolveOutcome),
}

impl ErrorEstimate {
    fn new() -> Self {
        Self { terms: [f64::INFINITY; 4], since: 0.0 }
    }

    /// Adds a term, and returns the next action.
    fn next(&mut self, term: f64, iterations: usize, goal: &StoppingCriterion, packed: bool) -> NextAction {
        self.since += term;
        let Some(left) = self.remaining(term) else { return NextAction::Iterate };
        let wanted = goal.tolerance * goal.tolerance * goal.capacity;
        let rounded = if packed { PACKED_CHANGE * PACKED_CHANGE * self.since } else { 0.0 };
        let most =
            (PACKED_ERROR * PACKED_ERROR * left).max(PACKED_ERROR_AT_END * PACKED_ERROR_AT_END * wanted);
        if rounded > most {
            self.since = left;
            return NextAction::Renew;
        }
        if left > wanted {
            return NextAction::Iterate;
        }
        let error = (left / goal.capacity).sqrt();
        NextAction::End(SolveOutcome { iterations, error, converged: true })
    }

    /// Returns the outcome at the iteration limit.
    fn at_limit(&self, goal: &StoppingCriterion) -> SolveOutcome {
        let error = (self.terms[3] / goal.capacity).sqrt();
        SolveOutcome { iterations: goal.limit, error, converged: false }
    }

    /// Estimates the sum of later terms, K²·J/K; `None` if unknown yet.
    fn remaining(&mut self, term: f64) -> Option<f64> {
        let terms = &mut self.terms;
        let first = terms[3] == f64::INFINITY;
        terms.rotate_left(1);
        terms[3] = term;
        // terms decrease by ρ each, over three iterations and over the last one
        let ratio = |from: usize| if terms[from] < f64::INFINITY { terms[3] / terms[from] } else { 1.0 };
        let rho = if terms[0] < f64::INFINITY { ratio(0).cbrt().max(ratio(2)) } else { ratio(2) };
        (!first && rho < 0.9999).then(|| terms[3] * rho / (1.0 - rho))
    }
}

/// Work vectors of conjugate gradients.
#[derive(Clone, Debug, Default)]
pub struct ConjugateGradients {
    direction: Vec<f64>,
    image: Vec<f64>,
    conditioned: Vec<f64>,
    /// Initial residual, kept if products are rounded.
    right: Vec<f64>,
}

impl ConjugateGradients {
    /// Swaps work vectors, see [`super::Iterative::swap_vectors`].
    pub fn swap_vectors(&mut self, direction: &mut Vec<f64>, image: &mut Vec<f64>) {
        std::mem::swap(&mut self.direction, direction);
        std::mem::swap(&mut self.image, image);
    }

    /// Recomputes the residual of the last solution with A itself, if its products were rounded.
    pub fn renew(&self, operator: &Operator, inverse: &[f64], residual: &mut [f64], solution: &[f64]) {
        if !self.right.is_empty() {
            renew(operator, &self.right, inverse, residual, solution);
        }
    }

    /// Solves A x = r from x = 0, preconditioned by a multigrid cycle or the diagonal. `inverse` is the
    /// reciprocal of A's diagonal, 0 where x stays 0; `residual` becomes r − A x.
    pub fn solve(
        &mut self,
        mut multigrid: Option<&mut Multigrid>,
        operator: &Operator,
        inverse: &[f64],
        residual: &mut [f64],
        solution: &mut [f64],
        goal: &StoppingCriterion,
    ) -> SolveOutcome {
        let size = residual.len();
        self.direction.resize(size, 0.0);
        self.image.resize(size, 0.0);
        self.conditioned.resize(if multigrid.is_some() { size } else { 0 }, 0.0);
        self.direction.fill(0.0);
        solution.fill(0.0);
        self.save_residual(operator, residual);
        let Self { direction, image, conditioned, right } = self;
        let mut estimate = ErrorEstimate::new();
        let mut last = f64::INFINITY;
        let mut norm = norm_squared(residual, inverse);
        for iteration in 0..goal.limit {
            if norm <= goal.floor || norm == 0.0 {
                return SolveOutcome { iterations: iteration, error: 0.0, converged: true };
            }
            let square = match &mut multigrid {
                Some(multigrid) => {
                    multigrid.apply(operator, inverse, residual, conditioned);
                    let square = dot(residual, conditioned);
                    let factor = square / last;
                    blend(direction, conditioned, conditioned, |own, z, _| z + factor * own);
                    square
                }
                None => {
                    turn(norm / last, direction, residual, inverse);
                    norm
                }
            };
            last = square;
            let curvature = operator.product(direction, image);
            if (goal.stop)() || !(curvature > 0.0 && curvature.is_finite() && square > 0.0) {
                return SolveOutcome { iterations: iteration, error: f64::NAN, converged: false };
            }
            let length = square / curvature;
            norm = advance(length, solution, residual, direction, image, inverse);
            match estimate.next(length * square, iteration + 1, goal, operator.packed.is_some()) {
                NextAction::End(ended) => return ended,
                NextAction::Renew => {
                    renew(operator, right, inverse, residual, solution);
                    norm = norm_squared(residual, inverse);
                }
                NextAction::Iterate => {}
            }
        }
        estimate.at_limit(goal)
    }

    fn save_residual(&mut self, operator: &Operator, residual: &[f64]) {
        self.right.clear();
        if operator.packed.is_some() {
            self.right.extend_from_slice(residual);
        }
    }
}

/// Recomputes r = right − A x with A itself; the search directions are kept (van der Vorst & Ye 2000,
/// doi:10.1137/S1064827599353865).
fn renew(operator: &Operator, right: &[f64], inverse: &[f64], residual: &mut [f64], solution: &[f64]) {
    operator.exact().product(solution, residual);
    blend(residual, right, inverse, |image, right, inverse| if inverse == 0.0 { 0.0 } else { right - image });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::{ConductionRows, FaceMatrices};

    /// Estimate bounds the true error for a known x on a line of 500 with diagonal 2 + 1e-3.
    #[test]
    fn the_error_is_below_the_tolerance() {
        let size = 500;
        let rows = ConductionRows::build(size, false, |row, out| {
            out.begin(std::iter::empty());
            out.add(0, 2.0, 0.0);
            if row > 0 {
                out.add(-1, -1.0, 0.0);
            }
            if row + 1 < size {
                out.add(1, -1.0, 0.0);
            }
        });
        let capacity = vec![1e-3; size];
        let operator = Operator {
            rows: &rows,
            diagonal: Some(&capacity),
            weights: [0.0, 1.0],
            faces: FaceMatrices::NONE,
            packed: None,
        };
        let exact: Vec<f64> = (0..size).map(|k| 300.0 + (0.1 * k as f64).sin()).collect();
        let mut residual = vec![0.0; size];
        operator.product(&exact, &mut residual);
        let mut solution = vec![0.0; size];
        let inverse = vec![1.0 / 2.001; size];
        for tolerance in [1e-2, 1e-5, 1e-8] {
            let mut right = residual.clone();
            let ended = ConjugateGradients::default().solve(
                None,
                &operator,
                &inverse,
                &mut right,
                &mut solution,
                &StoppingCriterion { capacity: 0.5, tolerance, floor: 0.0, limit: 1000, stop: &|| false },
            );
            let error = solution.iter().zip(&exact).map(|(s, e)| (s - e) * (s - e)).sum::<f64>();
            assert!(ended.converged, "{ended:?}");
            assert!((error / size as f64).sqrt() < tolerance, "{ended:?}, {error}");
        }
    }

    #[test]
    fn an_indefinite_matrix_and_a_short_limit_are_reported() {
        let rows = ConductionRows::build(2, false, |_, out| {
            out.begin(std::iter::empty());
            out.add(0, -1.0, 0.0);
        });
        let operator = Operator {
            rows: &rows,
            diagonal: None,
            weights: [0.0, 1.0],
            faces: FaceMatrices::NONE,
            packed: None,
        };
        let mut solution = [0.0; 2];
        let mut solve = |limit| {
            let (mut residual, mut cg) = ([1.0, 2.0], ConjugateGradients::default());
            let goal =
                StoppingCriterion { capacity: 1.0, tolerance: 1e-9, floor: 0.0, limit, stop: &|| false };
            cg.solve(None, &operator, &[1.0; 2], &mut residual, &mut solution, &goal)
        };
        assert!(!solve(10).converged);
        assert!(!solve(0).converged);
    }
}
