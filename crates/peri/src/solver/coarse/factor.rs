//! Sparse Cholesky factors of a symmetric positive definite matrix, by faer: one symbolic analysis for each pattern.
//!
//! Always on one thread, so that the factors have the same bits wherever they are made.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

/// Where the entries of an upper triangle are: column by column, rows ascending.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Pattern {
    /// Where each column starts, and the number of entries.
    pub starts: Vec<usize>,
    /// Row of each entry.
    pub rows: Vec<usize>,
}

impl Pattern {
    /// Number of rows and columns.
    pub fn size(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Index of an entry.
    #[cfg(test)]
    fn find(&self, row: usize, column: usize) -> Option<usize> {
        let range = self.starts[column]..self.starts[column + 1];
        self.rows[range.clone()].binary_search(&row).ok().map(|at| range.start + at)
    }
}

/// The factors in single precision, which a preconditioner needs no more than, and the analysis behind them.
pub struct Factor {
    pattern: Pattern,
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f32>,
    /// Power of 2 that the matrix was divided by, so that its entries are about 1.
    scale: f64,
    right: Vec<f32>,
    scratch: MemBuffer,
}

impl Factor {
    /// Factors the matrix with `entries` in the places of `pattern`, in the order of elimination that its rows are in;
    /// goes on from `old` where the pattern has not changed. `None` where the matrix is not positive definite to
    /// double precision, or too large for the memory.
    pub fn new(pattern: Pattern, entries: &[f64], old: Option<Self>) -> Option<Self> {
        let mut factor = match old {
            Some(old) if old.pattern == pattern => old,
            _ => Self::analyse(pattern)?,
        };
        let size = factor.pattern.size();
        let scale = power_of_two(entries);
        let entries: Vec<f64> = entries.iter().map(|x| x / scale).collect();
        let matrix = SparseColMatRef::new(symbolic(&factor.pattern, size), &entries[..]);
        let parameters = Default::default();
        let needed = factor.symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, parameters);
        let mut memory = MemBuffer::try_new(needed).ok()?;
        let mut values = vec![0.0; factor.symbolic.len_val()];
        let none =
            LltRegularization { dynamic_regularization_delta: 0.0, dynamic_regularization_epsilon: 0.0 };
        factor
            .symbolic
            .factorize_numeric_llt(
                &mut values,
                matrix,
                Side::Upper,
                none,
                Par::Seq,
                MemStack::new(&mut memory),
                parameters,
            )
            .ok()?;
        factor.values.clear();
        factor.values.extend(values.iter().map(|&x| x as f32));
        factor.scale = scale;
        factor.values.iter().all(|x| x.is_finite()).then_some(factor)
    }

    fn analyse(pattern: Pattern) -> Option<Self> {
        let parameters = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let order = SymmetricOrdering::Identity;
        let matrix = symbolic(&pattern, pattern.size());
        let symbolic = factorize_symbolic_cholesky(matrix, Side::Upper, order, parameters).ok()?;
        let scratch = MemBuffer::try_new(symbolic.solve_in_place_scratch::<f32>(1, Par::Seq)).ok()?;
        let right = vec![0.0; pattern.size()];
        Some(Self { pattern, symbolic, values: Vec::new(), scale: 1.0, right, scratch })
    }

    /// Overwrites b by A⁻¹ b, to single precision.
    pub fn solve(&mut self, right: &mut [f64]) {
        let scale = power_of_two(right);
        self.right.iter_mut().zip(&*right).for_each(|(single, x)| *single = (x / scale) as f32);
        LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut self.right, right.len(), 1),
            Par::Seq,
            MemStack::new(&mut self.scratch),
        );
        let back = scale / self.scale;
        right.iter_mut().zip(&self.right).for_each(|(x, &single)| *x = back * f64::from(single));
    }

    /// Entries of the factors.
    pub fn entries(&self) -> usize {
        self.values.len()
    }
}

/// The power of 2 at or below the largest magnitude; 1 of nothing.
fn power_of_two(values: &[f64]) -> f64 {
    let largest = values.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    if largest > 0.0 && largest.is_finite() { largest.log2().floor().exp2() } else { 1.0 }
}

fn symbolic(pattern: &Pattern, size: usize) -> SymbolicSparseColMatRef<'_, usize> {
    SymbolicSparseColMatRef::new_checked(size, size, &pattern.starts, None, &pattern.rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The five-point Laplacian of a 7 × 5 grid plus a shift, against its own product.
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
        assert_eq!((pattern.find(3, 3), pattern.find(0, 5)), (Some(6), None));
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
        // from the second time on the analysis is kept; no single number holds these scales
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
