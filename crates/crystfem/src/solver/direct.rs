//! Supernodal Cholesky factors by faer, in the order of nested dissection: for large steps with an unchanged matrix.
//!
//! The analysis is made once for a system, factors once for a matrix. Always on one thread, so that the factors have
//! the same bits on any number of them.

use super::{Operator, dissection};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

/// Not among the unknowns.
const NONE: u32 = u32::MAX;

/// Factors of the free equations' matrix.
pub struct Direct {
    /// Equation of each unknown, in the order of elimination.
    order: Vec<u32>,
    /// Unknown of each equation, or [`NONE`].
    unknown: Vec<u32>,
    /// The upper triangle, column by column.
    starts: Vec<usize>,
    rows: Vec<usize>,
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
    scratch: MemBuffer,
    right: Vec<f64>,
}

impl Direct {
    /// Analyses the pattern of the equations with `free` ≠ 0 at these places; `None` where memory does not suffice.
    pub fn analyse(operator: &Operator, free: &[f64], place: impl Fn(u32) -> [f64; 3]) -> Option<Self> {
        let size = free.len();
        let equations: Vec<u32> = (0..size as u32).filter(|&e| free[e as usize] != 0.0).collect();
        let neighbours = |equation: u32, visit: &mut dyn FnMut(u32)| {
            for (other, _) in operator.rows.row(equation as usize, [0.0; 2]) {
                visit(other as u32);
            }
        };
        let order = dissection::order(equations, size, place, neighbours);
        let mut unknown = vec![NONE; size];
        for (k, &equation) in order.iter().enumerate() {
            unknown[equation as usize] = k as u32;
        }
        let (mut starts, mut rows) = (vec![0], Vec::new());
        for (column, &equation) in order.iter().enumerate() {
            let first = rows.len();
            for (other, _) in operator.rows.row(equation as usize, [0.0; 2]) {
                let row = unknown[other] as usize;
                if row <= column {
                    rows.push(row);
                }
            }
            rows[first..].sort_unstable();
            starts.push(rows.len());
        }
        let parameters = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let pattern = SymbolicSparseColMatRef::new_checked(order.len(), order.len(), &starts, None, &rows);
        let ordering = SymmetricOrdering::Identity;
        let symbolic = factorize_symbolic_cholesky(pattern, Side::Upper, ordering, parameters).ok()?;
        let mut values = Vec::new();
        values.try_reserve_exact(symbolic.len_val()).ok()?;
        values.resize(symbolic.len_val(), 0.0);
        let scratch = MemBuffer::try_new(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq)).ok()?;
        let right = vec![0.0; order.len()];
        Some(Self { order, unknown, starts, rows, symbolic, values, scratch, right })
    }

    /// Factors a matrix of the analysed pattern. False where it is not positive definite to working precision, or
    /// memory does not suffice.
    pub fn factor(&mut self, operator: &Operator) -> bool {
        let mut entries = vec![0.0; self.rows.len()];
        for (column, &equation) in self.order.iter().enumerate() {
            let range = self.starts[column]..self.starts[column + 1];
            let rows = &self.rows[range.clone()];
            for (other, value) in operator.rows.row(equation as usize, operator.weights) {
                if let Ok(at) = rows.binary_search(&(self.unknown[other] as usize)) {
                    entries[range.start + at] = value;
                }
            }
            if let (Some(diagonal), Some(last)) = (operator.diagonal, range.last()) {
                entries[last] += diagonal[equation as usize];
            }
        }
        for face in operator.faces.iter() {
            let nodes = face.equations.len();
            for a in 0..nodes {
                for b in 0..nodes {
                    let [row, column] = [a, b].map(|k| self.unknown[face.equations[k] as usize]);
                    if row <= column && column != NONE {
                        let range = self.starts[column as usize]..self.starts[column as usize + 1];
                        if let Ok(at) = self.rows[range.clone()].binary_search(&(row as usize)) {
                            entries[range.start + at] += operator.weights[1] * face.values[nodes * a + b];
                        }
                    }
                }
            }
        }
        let size = self.order.len();
        let pattern = SymbolicSparseColMatRef::new_checked(size, size, &self.starts, None, &self.rows);
        let parameters = Default::default();
        let needed = self.symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, parameters);
        let Ok(mut memory) = MemBuffer::try_new(needed) else { return false };
        let none =
            LltRegularization { dynamic_regularization_delta: 0.0, dynamic_regularization_epsilon: 0.0 };
        let factored = self.symbolic.factorize_numeric_llt(
            &mut self.values,
            SparseColMatRef::new(pattern, &entries),
            Side::Upper,
            none,
            Par::Seq,
            MemStack::new(&mut memory),
            parameters,
        );
        factored.is_ok() && self.values.iter().all(|value| value.is_finite())
    }

    /// Solves A x = b with the factors; x is 0 where an equation is not among the unknowns.
    pub fn solve(&mut self, right: &[f64], solution: &mut [f64]) {
        for (value, &equation) in self.right.iter_mut().zip(&self.order) {
            *value = right[equation as usize];
        }
        let size = self.right.len();
        LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut self.right, size, 1),
            Par::Seq,
            MemStack::new(&mut self.scratch),
        );
        solution.fill(0.0);
        for (value, &equation) in self.right.iter().zip(&self.order) {
            solution[equation as usize] = *value;
        }
    }

    /// Entries of the factors.
    #[cfg(test)]
    pub fn entries(&self) -> usize {
        self.values.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::{FaceMatrices, Rows};

    /// The five-point Laplacian of a grid plus a shift, one equation fixed: solves what its product gives.
    #[test]
    fn it_solves_what_it_factors() {
        let (width, height) = (23_usize, 17);
        let size = width * height;
        let rows = Rows::build(size, false, |row, out| {
            out.begin(std::iter::empty());
            out.add(0, 4.0, 0.0);
            for (other, there) in [
                (-1, row % width > 0),
                (1, row % width + 1 < width),
                (-(width as i32), row >= width),
                (width as i32, row + width < size),
            ] {
                if there {
                    out.add(other, -1.0, 0.0);
                }
            }
        });
        let diagonal = vec![0.1; size];
        let mut free = vec![1.0; size];
        free[40] = 0.0;
        for weight in [1.0, 3.0] {
            let operator = Operator {
                rows: &rows,
                diagonal: Some(&diagonal),
                weights: [0.0, weight],
                faces: FaceMatrices::NONE,
                packed: None,
            };
            let exact: Vec<f64> = (0..size).map(|k| free[k] * (k as f64).sin()).collect();
            let mut right = vec![0.0; size];
            operator.product(&exact, &mut right);
            let place = |e: u32| [(e as usize % width) as f64, (e as usize / width) as f64, 0.0];
            let mut direct = Direct::analyse(&operator, &free, place).unwrap();
            assert!(direct.factor(&operator) && direct.entries() >= size);
            let mut found = vec![0.0; size];
            direct.solve(&right, &mut found);
            // condition below 250
            assert!(found.iter().zip(&exact).all(|(f, e)| (f - e).abs() < 1e-13), "{found:?}");
        }
        let negative = Operator {
            rows: &rows,
            diagonal: None,
            weights: [0.0, -1.0],
            faces: FaceMatrices::NONE,
            packed: None,
        };
        let mut direct = Direct::analyse(&negative, &free, |e| [f64::from(e), 0.0, 0.0]).unwrap();
        assert!(!direct.factor(&negative));
    }
}
