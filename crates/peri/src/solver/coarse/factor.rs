//! Cholesky factors in single precision, which suffices for a preconditioner.

use polycore::numerics::cholesky::Cholesky;
pub use polycore::numerics::cholesky::Pattern;

/// Factors and their symbolic analysis.
pub struct Factor {
    cholesky: Cholesky,
    values: Vec<f32>,
    /// Power of 2 that the matrix was divided by, so that its entries are about 1.
    scale: f64,
    right: Vec<f32>,
}

impl Factor {
    /// Factors the matrix with `entries` at the positions of `pattern`, whose rows are in elimination order;
    /// reuses `old` if the pattern has not changed. `None` if the matrix is not positive definite in double
    /// precision, or too large for the memory.
    pub fn new(pattern: Pattern, entries: &[f64], old: Option<Self>) -> Option<Self> {
        let mut factor = match old {
            Some(old) if *old.cholesky.pattern() == pattern => old,
            _ => {
                let right = vec![0.0; pattern.size()];
                Self { cholesky: Cholesky::analyse(pattern)?, values: Vec::new(), scale: 1.0, right }
            }
        };
        let scale = power_of_two(entries);
        let entries: Vec<f64> = entries.iter().map(|x| x / scale).collect();
        let mut values = Vec::new();
        if !factor.cholesky.factor(&entries, &mut values) {
            return None;
        }
        factor.values.clear();
        factor.values.extend(values.iter().map(|&x| x as f32));
        factor.scale = scale;
        factor.values.iter().all(|x| x.is_finite()).then_some(factor)
    }

    /// Overwrites b by A⁻¹ b, to single precision.
    pub fn solve(&mut self, right: &mut [f64]) {
        let scale = power_of_two(right);
        self.right.iter_mut().zip(&*right).for_each(|(single, x)| *single = (x / scale) as f32);
        self.cholesky.solve(&self.values, &mut self.right);
        let back = scale / self.scale;
        right.iter_mut().zip(&self.right).for_each(|(x, &single)| *x = back * f64::from(single));
    }

    /// Entries of the factors.
    pub fn entries(&self) -> usize {
        self.values.len()
    }
}

/// Returns the power of 2 at or below the largest magnitude; 1 for no values.
fn power_of_two(values: &[f64]) -> f64 {
    let largest = values.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    if largest > 0.0 && largest.is_finite() { largest.log2().floor().exp2() } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with the product of the five-point Laplacian of a 7 × 5 grid plus a shift.
    #[test]
    fn solves_what_it_factors() {
        let (width, height) = (7_usize, 5);
        let size = width * height;
        let mut pattern = Pattern { starts: vec![0], rows: Vec::new() };
        let mut entries = Vec::new();
        for column in 0..size {
            for (row, value) in
                [(column.wrapping_sub(width), -1.0), (column.wrapping_sub(1), -1.0), (column, 4.1)]
            {
                if row < size && !(row + 1 == column && column % width == 0) {
                    pattern.rows.push(row);
                    entries.push(value);
                }
            }
            pattern.starts.push(pattern.rows.len());
        }
        let exact: Vec<f64> = (0..size).map(|k| (k as f64).sin()).collect();
        let product = |entries: &[f64]| {
            let mut product = vec![0.0; size];
            for column in 0..size {
                for at in pattern.starts[column]..pattern.starts[column + 1] {
                    let row = pattern.rows[at];
                    product[row] += entries[at] * exact[column];
                    if row != column {
                        product[column] += entries[at] * exact[row];
                    }
                }
            }
            product
        };
        let mut factor = None;
        // the analysis is reused from the second time on; no single number holds these scales
        for scale in [1.0, 3e60, 3e-60] {
            let scaled: Vec<f64> = entries.iter().map(|x| scale * x).collect();
            let mut found = product(&scaled);
            let mut made = Factor::new(pattern.clone(), &scaled, factor.take()).unwrap();
            made.solve(&mut found);
            // condition below 100, in single precision
            assert!(found.iter().zip(&exact).all(|(f, e)| (f - e).abs() < 1e-5), "{found:?}");
            factor = Some(made);
        }
        let negative: Vec<f64> = entries.iter().map(|x| -x).collect();
        assert!(Factor::new(pattern, &negative, factor).is_none());
    }
}
