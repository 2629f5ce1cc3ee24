//! Stabilized biconjugate gradients for matrices that are not symmetric, with the diagonal as right
//! preconditioner (van der Vorst 1992, doi:10.1137/0913035).

use super::{Operator, SolveOutcome, StoppingCriterion, norm_squared};
use crate::system::vector::{set, sum};

/// Work vectors of stabilized biconjugate gradients.
#[derive(Clone, Debug, Default)]
pub struct BiconjugateGradients {
    shadow: Vec<f64>,
    direction: Vec<f64>,
    scaled: Vec<f64>,
    image: Vec<f64>,
    second: Vec<f64>,
}

impl BiconjugateGradients {
    /// Solves A x = r from x = 0; arguments as for [`super::ConjugateGradients::solve`]. Converged when the
    /// residual √(Σ r²/diagonal / `capacity`) is below `tolerance`.
    pub fn solve(
        &mut self,
        operator: &Operator,
        inverse: &[f64],
        residual: &mut [f64],
        solution: &mut [f64],
        &StoppingCriterion { capacity, tolerance, floor, limit, stop }: &StoppingCriterion,
    ) -> SolveOutcome {
        let size = residual.len();
        let Self { shadow, direction, scaled, image, second } = self;
        for vector in [&mut *direction, &mut *scaled, &mut *image, &mut *second] {
            vector.clear();
            vector.resize(size, 0.0);
        }
        solution.fill(0.0);
        let goal = (tolerance * tolerance * capacity).max(floor);
        // 0 restarts along the residual, with the residual as shadow
        let (mut rho, mut alpha, mut omega) = (0.0, 0.0, 0.0);
        for iteration in 0..limit {
            if stop() {
                return SolveOutcome { iterations: iteration, error: f64::NAN, converged: false };
            }
            let square = norm_squared(residual, inverse);
            let error = (square / capacity).sqrt();
            if !square.is_finite() {
                return SolveOutcome { iterations: iteration, error: f64::NAN, converged: false };
            }
            if square <= goal {
                return SolveOutcome { iterations: iteration, error, converged: true };
            }
            let last = rho;
            rho = if last == 0.0 { 0.0 } else { sum(size, |k| inverse[k] * shadow[k] * residual[k]) };
            if last == 0.0 || rho.abs() <= 1e-14 * square {
                shadow.clear();
                shadow.extend_from_slice(residual);
                direction.copy_from_slice(residual);
                rho = square;
            } else {
                let beta = rho / last * alpha / omega;
                for ((p, r), v) in direction.iter_mut().zip(residual.iter()).zip(image.iter()) {
                    *p = r + beta * (*p - omega * v);
                }
            }
            set(scaled, |k| inverse[k] * direction[k]);
            operator.product(scaled, image);
            alpha = rho / sum(size, |k| inverse[k] * shadow[k] * image[k]);
            for k in 0..size {
                solution[k] += alpha * scaled[k];
                residual[k] -= alpha * image[k];
            }
            set(scaled, |k| inverse[k] * residual[k]);
            operator.product(scaled, second);
            let own = sum(size, |k| inverse[k] * second[k] * second[k]);
            omega = if own > 0.0 { sum(size, |k| inverse[k] * second[k] * residual[k]) / own } else { 0.0 };
            for k in 0..size {
                solution[k] += omega * scaled[k];
                residual[k] -= omega * second[k];
            }
            if omega == 0.0 || !alpha.is_finite() {
                rho = 0.0;
            }
        }
        let error = (norm_squared(residual, inverse) / capacity).sqrt();
        SolveOutcome { iterations: limit, error, converged: false }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::{ConductionRows, FaceMatrices};

    /// Solves for a known x on a line of 300 whose columns are scaled by 1 or 10.
    #[test]
    fn a_matrix_with_scaled_columns() {
        let size = 300;
        let scale = |k: usize| if k < 120 { 1.0 } else { 10.0 };
        let rows = ConductionRows::build(size, false, |row, out| {
            out.begin(std::iter::empty());
            out.add(0, 2.0 * scale(row), 0.0);
            if row > 0 {
                out.add(-1, -scale(row - 1), 0.0);
            }
            if row + 1 < size {
                out.add(1, -scale(row + 1), 0.0);
            }
        });
        let capacity = vec![1e-2; size];
        let operator = Operator {
            rows: &rows,
            diagonal: Some(&capacity),
            weights: [0.0, 1.0],
            faces: FaceMatrices::NONE,
            packed: None,
        };
        let exact: Vec<f64> = (0..size).map(|k| 300.0 + (0.1 * k as f64).sin()).collect();
        let inverse: Vec<f64> = (0..size).map(|k| 1.0 / (2.0 * scale(k) + 1e-2)).collect();
        let mut residual = vec![0.0; size];
        operator.product(&exact, &mut residual);
        let mut solution = vec![0.0; size];
        let solve = |limit, solution: &mut [f64]| {
            let goal =
                StoppingCriterion { capacity: 3.0, tolerance: 1e-10, floor: 0.0, limit, stop: &|| false };
            let mut right = residual.clone();
            BiconjugateGradients::default().solve(&operator, &inverse, &mut right, solution, &goal)
        };
        let ended = solve(3000, &mut solution);
        let error = solution.iter().zip(&exact).map(|(s, e)| (s - e).abs()).fold(0.0, f64::max);
        // the inverse has entries up to 1/1e-2
        assert!(ended.converged && error < 1e-7, "{ended:?}, {error}");
        assert!(!solve(3, &mut solution).converged);
    }
}
