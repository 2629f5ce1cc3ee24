//! V-cycle of smoothed aggregation as preconditioner: the number of iterations depends neither on the mesh
//! nor on the step.
//!
//! On each level A = D + a K, with D lumped and restricted like a residual, so that another step length or
//! capacity needs no new levels.

use super::Operator;
use super::aggregation::{Sparse, Transfer, levels};
use crate::system::vector::{blend, combine, set};

/// Damping of the Jacobi smoother, for λ of D⁻¹A up to 2.
const DAMPING: f64 = 2.0 / 3.0;

/// Multigrid levels for the matrix of a stage.
pub struct Multigrid {
    transfers: Vec<Transfer>,
    levels: Vec<Level>,
    /// Work vectors of the finest level.
    smoothed: Vec<f64>,
    left: Vec<f64>,
    bottom: CoarsestLevel,
}

/// A level below the finest.
#[derive(Default)]
struct Level {
    /// Matrix A, in the pattern of the level's conduction.
    values: Vec<f64>,
    lumped: Vec<f64>,
    /// Damped 1/diagonal.
    inverse: Vec<f64>,
    right: Vec<f64>,
    found: Vec<f64>,
    left: Vec<f64>,
}

/// Dense Cholesky factors of the last level.
#[derive(Default)]
struct CoarsestLevel {
    factor: Vec<f64>,
}

impl Multigrid {
    /// Builds the levels for the conduction matrix of an operator; `free` is 0 at prescribed equations.
    pub fn new(operator: &Operator, free: &[f64], place: impl Fn(usize) -> [f64; 3]) -> Self {
        let transfers = levels(free, place, |row, visit: &mut dyn FnMut(usize, f64)| {
            operator.rows.row(row, [0.0, 1.0]).for_each(|(column, value)| visit(column, value));
        });
        let levels = transfers.iter().map(|_| Level::default()).collect();
        Self { transfers, levels, smoothed: Vec::new(), left: Vec::new(), bottom: CoarsestLevel::default() }
    }

    /// Updates the matrices of all levels, from the row sums `lumped` of capacity and surfaces, and the
    /// factor of conduction.
    pub fn set(&mut self, lumped: &[f64], weight: f64) {
        for level in 0..self.levels.len() {
            let (before, rest) = self.levels.split_at_mut(level);
            let (transfer, own) = (&self.transfers[level], &mut rest[0]);
            let above = before.last().map_or(lumped, |above| &above.lumped);
            let count = transfer.restriction.rows();
            for field in [&mut own.lumped, &mut own.inverse, &mut own.right, &mut own.found, &mut own.left] {
                field.resize(count, 0.0);
            }
            set(&mut own.lumped, |row| transfer.restriction.dot(row, above).max(0.0));
            let conduction = &transfer.conduction;
            own.values.clear();
            own.values.extend(conduction.values.iter().map(|value| weight * value));
            for row in 0..count {
                let range = conduction.starts[row] as usize..conduction.starts[row + 1] as usize;
                let at = conduction.columns[range.clone()].iter().position(|&column| column as usize == row);
                if let Some(at) = at {
                    own.values[range.start + at] += own.lumped[row];
                    own.inverse[row] = DAMPING / own.values[range.start + at];
                }
            }
        }
        if let (Some(last), Some(transfer)) = (self.levels.last(), self.transfers.last()) {
            self.bottom = CoarsestLevel::new(&transfer.conduction, &last.values);
        }
    }

    /// Applies the preconditioner, z = B r; `inverse` is the reciprocal of the operator's diagonal, 0 if not
    /// free.
    pub fn apply(&mut self, operator: &Operator, inverse: &[f64], residual: &[f64], z: &mut [f64]) {
        let size = residual.len();
        let (smoothed, left) = (&mut self.smoothed, &mut self.left);
        smoothed.resize(size, 0.0);
        left.resize(size, 0.0);
        blend(z, inverse, residual, |_, inverse, r| DAMPING * inverse * r);
        if let (Some(transfer), Some(level)) = (self.transfers.first(), self.levels.first_mut()) {
            operator.product(z, left);
            blend(smoothed, residual, left, |_, r, left| r - left);
            set(&mut level.right, |row| transfer.restriction.dot(row, smoothed));
            cycle(&self.transfers, &mut self.levels, &self.bottom);
            let found = &self.levels[0].found;
            let prolongation = &transfer.prolongation;
            combine(z, |k, own| own + prolongation.dot(k, found));
        }
        operator.product(z, left);
        blend(left, residual, inverse, |left, r, inverse| DAMPING * inverse * (r - left));
        blend(z, left, left, |own, more, _| own + more);
    }
}

/// Solves from the first of these levels down.
fn cycle(transfers: &[Transfer], levels: &mut [Level], bottom: &CoarsestLevel) {
    let Some((own, below)) = levels.split_first_mut() else { return };
    let matrix = &transfers[0].conduction;
    if below.is_empty() {
        bottom.solve(&own.right, &mut own.found);
        return;
    }
    let Level { values, inverse, right, found, left, .. } = own;
    let product = |x: &[f64], row: usize| -> f64 {
        let range = matrix.starts[row] as usize..matrix.starts[row + 1] as usize;
        let columns = matrix.columns[range.clone()].iter();
        columns.zip(&values[range]).map(|(&column, value)| value * x[column as usize]).sum()
    };
    set(found, |row| inverse[row] * right[row]);
    set(left, |row| right[row] - product(found, row));
    let next = &transfers[1];
    set(&mut below[0].right, |row| next.restriction.dot(row, left));
    cycle(&transfers[1..], below, bottom);
    combine(found, |row, own| own + next.prolongation.dot(row, &below[0].found));
    set(left, |row| right[row] - product(found, row));
    combine(found, |row, own| own + inverse[row] * left[row]);
}

impl CoarsestLevel {
    /// Factors the matrix; a vanishing pivot, of a body without support and capacity, is left out.
    fn new(pattern: &Sparse, values: &[f64]) -> Self {
        let size = pattern.rows();
        let mut factor = vec![0.0; size * size];
        for row in 0..size {
            let range = pattern.starts[row] as usize..pattern.starts[row + 1] as usize;
            for at in range {
                factor[row * size + pattern.columns[at] as usize] = values[at];
            }
        }
        for row in 0..size {
            for column in 0..=row {
                let (a, b) = (row * size, column * size);
                let dot: f64 = (0..column).map(|k| factor[a + k] * factor[b + k]).sum();
                let left = factor[a + column] - dot;
                factor[a + column] = if column < row {
                    if factor[b + column] > 0.0 { left / factor[b + column] } else { 0.0 }
                } else if left > 1e-12 * factor[a + column] {
                    left.sqrt()
                } else {
                    0.0
                };
            }
        }
        Self { factor }
    }

    fn solve(&self, right: &[f64], found: &mut [f64]) {
        let size = right.len();
        let pivot = |row: usize| self.factor[row * size + row];
        found.copy_from_slice(right);
        for row in 0..size {
            let dot: f64 = (0..row).map(|k| self.factor[row * size + k] * found[k]).sum();
            found[row] = if pivot(row) > 0.0 { (found[row] - dot) / pivot(row) } else { 0.0 };
        }
        for row in (0..size).rev() {
            let dot: f64 = (row + 1..size).map(|k| self.factor[k * size + row] * found[k]).sum();
            found[row] = if pivot(row) > 0.0 { (found[row] - dot) / pivot(row) } else { 0.0 };
        }
    }
}
