//! Ogden's law in its exponents alone: for given exponents the best moduli ≥ 0 follow by linear least
//! squares, so that the search runs along the valleys in which a modulus and its exponent make up for each
//! other ("variable projection"; Golub & Pereyra, doi:10.1137/0710036, with Kaufman's derivative,
//! doi:10.1007/BF01932995).

use nalgebra::{DMatrix, DVector};

use super::data::TestState;
use super::descriptor::{ABSENT, FitStart};
use super::ogden_starts::slopes;
use crate::numerics::least_squares::levenberg_marquardt;

/// Moves a start to the best exponents; returns it unchanged if the search fails.
pub(super) fn projected(p: &[f64], start: &FitStart<'_>) -> Vec<f64> {
    let data = start.table.states.iter().flat_map(TestState::targets);
    let data = DVector::from_iterator(start.table.measurements(), data) / start.modulus;
    let exponents = DVector::from_iterator(p.len() / 2, p.chunks_exact(2).map(|term| term[1]));
    let problem = Projected { start, data };
    let (residuals, jacobian) = (|at: &_| Some(problem.residuals(at)), |at: &_| problem.jacobian(at));
    let exponents = levenberg_marquardt(exponents, 100, residuals, jacobian).at;
    let Some(best) =
        problem.solve(&exponents).filter(|best| best.moduli.iter().any(|modulus| *modulus > 0.0))
    else {
        return p.to_vec();
    };
    let least = ABSENT * best.moduli.sum();
    let term = |i: usize| [start.modulus * best.moduli[i].max(least), exponents[i]];
    (0..exponents.len()).flat_map(term).collect()
}

struct Projected<'a> {
    start: &'a FitStart<'a>,
    /// Measured stresses in units of the modulus.
    data: DVector<f64>,
}

/// Best moduli, in units of the modulus; 0 for terms that only a negative modulus would improve.
struct OgdenModuli {
    moduli: DVector<f64>,
    /// Orthonormal basis of the stresses of the terms that are present.
    basis: DMatrix<f64>,
    residuals: DVector<f64>,
}

impl Projected<'_> {
    /// Stresses of each term of unit modulus, and their derivatives with respect to its exponent.
    fn columns(&self, exponents: &DVector<f64>) -> Option<[DMatrix<f64>; 2]> {
        let terms = exponents.len();
        let unit: Vec<f64> = exponents.iter().flat_map(|exponent| [1.0, *exponent]).collect();
        let mut all = [DMatrix::zeros(self.data.len(), terms), DMatrix::zeros(self.data.len(), terms)];
        let mut found = vec![[0.0; 2]; 2 * terms];
        let mut row = 0;
        for state in &self.start.table.states {
            slopes(&unit, state.stretches, &mut found);
            for axis in (0..2).filter(|&axis| state.nominal[axis] != 0.0) {
                for term in 0..terms {
                    all[0][(row, term)] = state.factor(axis) * found[2 * term][axis];
                    all[1][(row, term)] = state.factor(axis) * found[2 * term + 1][axis];
                }
                row += 1;
            }
        }
        all.iter().flat_map(|matrix| matrix.iter()).all(|value| value.is_finite()).then_some(all)
    }

    fn solve(&self, exponents: &DVector<f64>) -> Option<OgdenModuli> {
        let [columns, _] = self.columns(exponents)?;
        let terms = exponents.len();
        let mut best: Option<(f64, OgdenModuli)> = None;
        for present in 1_usize..1 << terms {
            let those: Vec<usize> = (0..terms).filter(|i| present >> i & 1 == 1).collect();
            let norms: Vec<f64> = those.iter().map(|&i| columns.column(i).norm()).collect();
            let scaled: Vec<DVector<f64>> =
                those.iter().zip(&norms).map(|(&i, norm)| columns.column(i) / *norm).collect();
            let (basis, triangle) = DMatrix::from_columns(&scaled).qr().unpack();
            let Some(solved) = triangle.solve_upper_triangular(&basis.tr_mul(&self.data)) else { continue };
            if solved.iter().any(|modulus| modulus.is_nan() || *modulus <= 0.0) {
                continue;
            }
            let residuals = &basis * basis.tr_mul(&self.data) - &self.data;
            let misfit = residuals.norm_squared();
            if best.as_ref().is_none_or(|(least, _)| misfit < *least) {
                let mut moduli = DVector::zeros(terms);
                those.iter().zip(&norms).enumerate().for_each(|(k, (&i, norm))| moduli[i] = solved[k] / norm);
                best = Some((misfit, OgdenModuli { moduli, basis, residuals }));
            }
        }
        best.map(|(_, found)| found)
    }

    fn residuals(&self, exponents: &DVector<f64>) -> DVector<f64> {
        // nothing fits: as without any term, so that a trial there is rejected
        self.solve(exponents).map_or_else(|| -&self.data, |found| found.residuals)
    }

    fn jacobian(&self, exponents: &DVector<f64>) -> Option<DMatrix<f64>> {
        // nothing ends the search
        if (self.start.stop)() {
            return None;
        }
        let [_, mut slopes] = self.columns(exponents)?;
        let found = self.solve(exponents)?;
        for (i, mut column) in slopes.column_iter_mut().enumerate() {
            column *= found.moduli[i];
        }
        Some(&slopes - &found.basis * found.basis.tr_mul(&slopes))
    }
}
