//! Linear least squares with nonnegative unknowns.

use nalgebra::{DMatrix, DVector};

/// Minimises |Ax − b| over x ≥ 0 by the active-set method of Lawson and Hanson (*Solving Least Squares
/// Problems*, 1974, chapter 23), with at most 10n exchanges of n unknowns. `None` if A or b is not finite.
pub fn nonnegative_least_squares(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let count = matrix.ncols();
    let mut at = DVector::zeros(count);
    let mut free: Vec<usize> = Vec::new();
    // unknowns that cannot grow: their columns depend on those of the free ones
    let mut barred: Vec<usize> = Vec::new();
    let size = right.norm();
    if !(size.is_finite() && matrix.iter().all(|entry| entry.is_finite())) {
        return None;
    }
    // rounding of each component of the gradient
    let rounding = 10.0 * f64::EPSILON * size * (matrix.nrows().max(count) as f64);
    let limits: Vec<f64> = matrix.column_iter().map(|column| rounding * column.norm()).collect();
    for _ in 0..10 * count {
        let gradient = matrix.tr_mul(&(right - matrix * &at));
        let bound = (0..count).filter(|i| !free.contains(i) && !barred.contains(i));
        let grows = bound.filter(|&i| gradient[i] > limits[i]);
        let Some(enter) = grows.max_by(|&i, &j| gradient[i].total_cmp(&gradient[j])) else {
            return Some(at);
        };
        free.push(enter);
        let mut trial = free_minimum(matrix, right, &free)?;
        if trial[free.len() - 1] <= 0.0 {
            free.pop();
            barred.push(enter);
            continue;
        }
        barred.clear();
        // back to the first bound on the way, until the minimum over the free unknowns is inside
        while let Some((part, leave)) = (0..free.len())
            .filter(|&k| trial[k] <= 0.0)
            .map(|k| (at[free[k]] / (at[free[k]] - trial[k]), k))
            .min_by(|a, b| a.0.total_cmp(&b.0))
        {
            for (k, &i) in free.iter().enumerate() {
                at[i] += part * (trial[k] - at[i]);
            }
            at[free[leave]] = 0.0;
            free.remove(leave);
            trial = free_minimum(matrix, right, &free)?;
        }
        for (k, &i) in free.iter().enumerate() {
            at[i] = trial[k];
        }
    }
    Some(at)
}

/// Minimum over the free unknowns, by a QR factorisation.
fn free_minimum(matrix: &DMatrix<f64>, right: &DVector<f64>, free: &[usize]) -> Option<DVector<f64>> {
    let qr = matrix.select_columns(free).qr();
    qr.r().solve_upper_triangular(&qr.q().tr_mul(right))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Minimum on the edge x₂ = 0: without the bound x = (1, −1), and on the edge x₁ = 0.8 (normal equation 5
    /// x₁ = 4).
    #[test]
    fn a_minimum_on_an_edge() {
        let matrix = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 0.0, 1.0, 2.0, 0.5]);
        let right = &matrix * DVector::from_vec(vec![1.0, -1.0]);
        let found = nonnegative_least_squares(&matrix, &right).unwrap();
        assert!((found[0] - 0.8).abs() < 1e-14 && found[1] == 0.0, "{found}");
    }

    /// Karush–Kuhn–Tucker conditions for a badly conditioned matrix: exponentials of neighbouring rates.
    #[test]
    fn conditions_of_the_minimum() {
        let matrix = DMatrix::from_fn(40, 20, |i, j| (-(0.1 * i as f64) * 1.3_f64.powi(j as i32 - 10)).exp());
        let right = DVector::from_fn(40, |i, _| (1.0 + 0.1 * i as f64).recip());
        let found = nonnegative_least_squares(&matrix, &right).unwrap();
        let gradient = matrix.transpose() * (&right - &matrix * &found);
        for i in 0..20 {
            assert!(found[i] >= 0.0 && gradient[i] < 1e-12, "{i}: {} {}", found[i], gradient[i]);
            assert!(found[i] == 0.0 || gradient[i].abs() < 1e-12, "{i}: {} {}", found[i], gradient[i]);
        }
    }
}
