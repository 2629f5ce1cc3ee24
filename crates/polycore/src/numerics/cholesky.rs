//! Supernodal Cholesky factors of a sparse symmetric positive definite matrix, by faer: one symbolic analysis
//! for each pattern. Always on one thread, so that the factors have the same bits wherever they are made.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::traits::ComplexField;
use faer::{Conj, MatMut, Par, Side};

/// Places of the entries of an upper triangle: column by column, rows ascending.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Pattern {
    /// Start of each column, and the number of entries.
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
    pub fn find(&self, row: usize, column: usize) -> Option<usize> {
        let range = self.starts[column]..self.starts[column + 1];
        self.rows[range.clone()].binary_search(&row).ok().map(|at| range.start + at)
    }

    fn symbolic(&self) -> SymbolicSparseColMatRef<'_, usize> {
        SymbolicSparseColMatRef::new_checked(self.size(), self.size(), &self.starts, None, &self.rows)
    }
}

/// The analysis of a pattern.
pub struct Cholesky {
    pattern: Pattern,
    symbolic: SymbolicCholesky<usize>,
    scratch: MemBuffer,
}

impl Cholesky {
    /// Analyses a pattern, in the order of elimination of its rows; `None` if memory does not suffice.
    pub fn analyse(pattern: Pattern) -> Option<Self> {
        Self::analyse_in_order(pattern, SymmetricOrdering::Identity)
    }

    /// Analyses a pattern, in an order of elimination by approximate minimum degree.
    pub fn analyse_reordered(pattern: Pattern) -> Option<Self> {
        Self::analyse_in_order(pattern, SymmetricOrdering::Amd)
    }

    fn analyse_in_order(pattern: Pattern, order: SymmetricOrdering<usize>) -> Option<Self> {
        let parameters = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let symbolic =
            factorize_symbolic_cholesky(pattern.symbolic(), Side::Upper, order, parameters).ok()?;
        let scratch = MemBuffer::try_new(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq)).ok()?;
        Some(Self { pattern, symbolic, scratch })
    }

    /// The pattern.
    pub fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    /// Computes the factors of the matrix with `entries` in the places of the pattern; false if it is not
    /// positive definite to working precision, or memory does not suffice.
    pub fn factor(&self, entries: &[f64], factors: &mut Vec<f64>) -> bool {
        let parameters = Default::default();
        let needed = self.symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, parameters);
        let size = self.symbolic.len_val();
        let (Ok(mut memory), Ok(())) =
            (MemBuffer::try_new(needed), factors.try_reserve_exact(size.saturating_sub(factors.len())))
        else {
            return false;
        };
        factors.resize(size, 0.0);
        let none =
            LltRegularization { dynamic_regularization_delta: 0.0, dynamic_regularization_epsilon: 0.0 };
        let factored = self.symbolic.factorize_numeric_llt(
            factors,
            SparseColMatRef::new(self.pattern.symbolic(), entries),
            Side::Upper,
            none,
            Par::Seq,
            MemStack::new(&mut memory),
            parameters,
        );
        factored.is_ok() && factors.iter().all(|value| value.is_finite())
    }

    /// Overwrites b by A⁻¹ b with factors in double or single precision.
    pub fn solve<T: ComplexField>(&mut self, factors: &[T], right: &mut [T]) {
        let size = right.len();
        LltRef::new(&self.symbolic, factors).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(right, size, 1),
            Par::Seq,
            MemStack::new(&mut self.scratch),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// −u″ = 1 on a line with fixed ends: u = ½x(n + 1 − x) at the nodes; and what is not positive definite.
    #[test]
    fn a_parabola() {
        let n = 30;
        let mut pattern = Pattern { starts: vec![0, 1], rows: vec![0] };
        let mut entries = vec![2.0];
        for column in 1..n {
            pattern.rows.extend([column - 1, column]);
            entries.extend([-1.0, 2.0]);
            pattern.starts.push(pattern.rows.len());
        }
        assert_eq!((pattern.find(3, 3), pattern.find(0, 5), pattern.size()), (Some(6), None, n));
        let mut cholesky = Cholesky::analyse(pattern).unwrap();
        let (mut factors, mut right) = (Vec::new(), vec![1.0; n]);
        assert!(cholesky.factor(&entries, &mut factors));
        cholesky.solve(&factors, &mut right);
        let single: Vec<f32> = factors.iter().map(|&x| x as f32).collect();
        let mut rounded = vec![1.0_f32; n];
        cholesky.solve(&single, &mut rounded);
        for k in 0..n {
            let x = (k + 1) as f64;
            let exact = 0.5 * x * ((n + 1) as f64 - x);
            // condition about (2n/π)² = 365
            assert!((right[k] / exact - 1.0).abs() < 365.0 * f64::EPSILON, "{k} {}", right[k]);
            assert!((f64::from(rounded[k]) / exact - 1.0).abs() < 365.0 * 6e-8, "{k} {}", rounded[k]);
        }
        let negative: Vec<f64> = entries.iter().map(|x| -x).collect();
        assert!(!cholesky.factor(&negative, &mut factors));
    }
}
