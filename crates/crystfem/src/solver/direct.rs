//! Cholesky factors in the order of nested dissection, for large steps with an unchanged matrix. The analysis
//! is made once per system, factors once per matrix.

use super::{Operator, dissection};
use polycore::numerics::cholesky::{Cholesky, Pattern};

/// No unknown.
const NONE: u32 = u32::MAX;

/// Cholesky factors of the matrix of the free equations.
pub struct Direct {
    /// Equation of each unknown, in the order of elimination.
    order: Vec<u32>,
    /// Unknown of each equation, or [`NONE`].
    unknown: Vec<u32>,
    cholesky: Cholesky,
    values: Vec<f64>,
    right: Vec<f64>,
}

impl Direct {
    /// Analyses the pattern of the equations with `free` ≠ 0, at given positions; `None` if memory does not
    /// suffice.
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
        let mut pattern = Pattern { starts: vec![0], rows: Vec::new() };
        for (column, &equation) in order.iter().enumerate() {
            let first = pattern.rows.len();
            for (other, _) in operator.rows.row(equation as usize, [0.0; 2]) {
                let row = unknown[other] as usize;
                if row <= column {
                    pattern.rows.push(row);
                }
            }
            pattern.rows[first..].sort_unstable();
            pattern.starts.push(pattern.rows.len());
        }
        let right = vec![0.0; order.len()];
        Some(Self { order, unknown, cholesky: Cholesky::analyse(pattern)?, values: Vec::new(), right })
    }

    /// Factors a matrix of the analysed pattern. Returns false if it is not positive definite to working
    /// precision, or memory does not suffice.
    pub fn factor(&mut self, operator: &Operator) -> bool {
        let pattern = self.cholesky.pattern();
        let mut entries = vec![0.0; pattern.rows.len()];
        for (column, &equation) in self.order.iter().enumerate() {
            for (other, value) in operator.rows.row(equation as usize, operator.weights) {
                if let Some(at) = pattern.find(self.unknown[other] as usize, column) {
                    entries[at] = value;
                }
            }
            if let (Some(diagonal), Some(at)) = (operator.diagonal, pattern.find(column, column)) {
                entries[at] += diagonal[equation as usize];
            }
        }
        for face in operator.faces.iter() {
            let nodes = face.equations.len();
            for a in 0..nodes {
                for b in 0..nodes {
                    let [row, column] = [a, b].map(|k| self.unknown[face.equations[k] as usize]);
                    if row <= column
                        && column != NONE
                        && let Some(at) = pattern.find(row as usize, column as usize)
                    {
                        entries[at] += operator.weights[1] * face.values[nodes * a + b];
                    }
                }
            }
        }
        self.cholesky.factor(&entries, &mut self.values)
    }

    /// Solves A x = b with the factors; x is 0 for equations that are not unknowns.
    pub fn solve(&mut self, right: &[f64], solution: &mut [f64]) {
        for (value, &equation) in self.right.iter_mut().zip(&self.order) {
            *value = right[equation as usize];
        }
        self.cholesky.solve(&self.values, &mut self.right);
        solution.fill(0.0);
        for (value, &equation) in self.right.iter().zip(&self.order) {
            solution[equation as usize] = *value;
        }
    }

    /// Number of entries of the factors.
    #[cfg(test)]
    pub fn entries(&self) -> usize {
        self.values.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::{ConductionRows, FaceMatrices};

    /// Solves reproduce a known x for the five-point Laplacian of a grid plus a shift, with one equation
    /// fixed.
    #[test]
    fn solves_reproduce_a_known_vector() {
        let (width, height) = (23_usize, 17);
        let size = width * height;
        let rows = ConductionRows::build(size, false, |row, out| {
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
