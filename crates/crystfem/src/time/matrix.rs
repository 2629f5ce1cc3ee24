//! Matrix A = C + M + a (K + faces) of a stage: its diagonal, its sums, the rounding level of a residual.

use crate::solver::{Cached, Operator};
use crate::system::vector::{blend, combine, dot, set};
use crate::system::{Diagonal, Evaluation, FaceMatrices, ThermalSystem};

/// Cache key of values that depend on the matrix.
pub fn key(system: &ThermalSystem, weight: f64) -> (u64, u64) {
    (system.generation, weight.to_bits())
}

/// Diagonal and row sums of A, with derived values.
#[derive(Default)]
pub struct Matrix {
    /// Diagonal of C and of the surfaces, with lumped capacity.
    pub diagonal: Vec<f64>,
    /// Reciprocal of the diagonal of A; 0 at prescribed nodes.
    pub inverse: Vec<f64>,
    /// A·1 over the free nodes with consistent capacity; otherwise it follows from the diagonal and
    /// `free_sums`.
    row_sums: Vec<f64>,
    /// K·1 and M·1 over the free nodes; empty if zero.
    free_sums: Cached<[Vec<f64>; 2]>,
    /// Diagonal of the rows, reused in Newton's iteration.
    rows: Diagonal,
    /// ΣC over the free nodes, J/K.
    pub capacity: f64,
    /// Squared norm of a residual that is due to rounding.
    pub floor: f64,
    /// 1·A·1 over the free nodes, J/K.
    pub sensitivity: f64,
}

impl Matrix {
    /// Invalidates everything made for another system.
    pub fn reset(&mut self) {
        self.free_sums.forget();
    }

    /// Computes everything from the tangents of an evaluation.
    pub fn compute(&mut self, system: &ThermalSystem, evaluation: &Evaluation, weight: f64) {
        let size = system.size();
        let Evaluation { conductance, faces, .. } = evaluation;
        let capacity = evaluation.capacity(system);
        let sums_for = (system.build, system.rows.versions()[1]);
        if !self.free_sums.matches(sums_for) {
            let mut sums = [Vec::new(), Vec::new()];
            // rows of K sum to zero except at prescribed neighbours
            if system.consistent || !system.fixed.is_empty() {
                sums[0].resize(size, 0.0);
                system.rows.product(None, [0.0, 1.0], &system.free, &mut sums[0]);
            }
            if system.consistent {
                sums[1].resize(size, 0.0);
                system.rows.product(None, [1.0, 0.0], &system.free, &mut sums[1]);
            }
            self.free_sums.value = sums;
            self.free_sums.set_key(sums_for);
        }
        // A's diagonal, until it is inverted
        self.inverse.resize(size, 0.0);
        let [conduction, consistent] = &self.free_sums.value;
        let whole = &mut self.inverse;
        let weights = [if system.consistent { 1.0 } else { 0.0 }, weight];
        if system.consistent {
            whole.fill(0.0);
        } else {
            self.diagonal.resize(size, 0.0);
            self.diagonal.copy_from_slice(capacity);
            for &(equation, conductance) in conductance {
                self.diagonal[equation as usize] += weight * conductance;
            }
            whole.copy_from_slice(&self.diagonal);
        }
        if system.is_linear() || !system.general.is_empty() || system.rows.bands().is_some() {
            // also for rows that change in every evaluation, and where diagonals lie side by side
            system.rows.add_diagonal(weights, whole);
        } else {
            let own = self.rows.update(&system.rows, weights);
            combine(whole, |k, whole| whole + own[k]);
        }
        if system.consistent {
            self.row_sums.resize(size, 0.0);
            set(&mut self.row_sums, |k| consistent[k] + weight * conduction[k]);
            for face in faces.iter() {
                face.add_product(weight, &system.free, &mut self.row_sums);
                let diagonal = face.values.iter().step_by(face.equations.len() + 1);
                for (&equation, value) in face.equations.iter().zip(diagonal) {
                    whole[equation as usize] += weight * value;
                }
            }
        }
        // rounding of the residual: 1e-14 of a temperature of 500 K, everywhere
        self.floor = 5e-12_f64.powi(2) * dot(&system.free, whole);
        let inverted = |whole: f64, free: f64, _: f64| if free == 0.0 { 0.0 } else { 1.0 / whole };
        blend(whole, &system.free, &system.free, inverted);
        self.capacity = dot(&system.free, capacity).max(f64::MIN_POSITIVE);
        self.sensitivity = self.column_sums(system, weight, &system.free);
    }

    /// Sums A x over the free nodes, for x that is 0 at all others.
    pub fn column_sums(&self, system: &ThermalSystem, weight: f64, x: &[f64]) -> f64 {
        if system.consistent {
            return dot(&self.row_sums, x);
        }
        let [conduction, _] = &self.free_sums.value;
        dot(&self.diagonal, x) + if conduction.is_empty() { 0.0 } else { weight * dot(conduction, x) }
    }

    /// Returns A, without packed rows.
    pub fn operator<'a>(
        &'a self,
        system: &'a ThermalSystem,
        weight: f64,
        evaluation: &'a Evaluation,
    ) -> Operator<'a> {
        if system.consistent {
            Operator {
                rows: &system.rows,
                diagonal: None,
                weights: [1.0, weight],
                faces: &evaluation.faces,
                packed: None,
            }
        } else {
            Operator {
                rows: &system.rows,
                diagonal: Some(&self.diagonal),
                weights: [0.0, weight],
                faces: FaceMatrices::NONE,
                packed: None,
            }
        }
    }
}
