//! Ogden's law in its exponents alone: for given exponents the best moduli ≥ 0 follow by linear least
//! squares, so that the search runs along the valleys in which a modulus and its exponent make up for each
//! other ("variable projection"; Golub & Pereyra, doi:10.1137/0710036, with Kaufman's derivative,
//! doi:10.1007/BF01932995).

use std::cell::RefCell;
use std::rc::Rc;

use nalgebra::{DMatrix, DVector};

use super::data::TestState;
use super::descriptor::{ABSENT, FitStart};
use super::fit_map::LARGEST_LOG;
use super::ogden_starts::slopes;
use crate::numerics::least_squares::levenberg_marquardt;

/// Moves a start to the best exponents; returns it unchanged if the search fails.
pub(super) fn projected(p: &[f64], start: &FitStart<'_>) -> Vec<f64> {
    let data = start.table.states.iter().flat_map(TestState::targets);
    let data = DVector::from_iterator(start.table.measurements(), data) / start.modulus;
    let exponents = DVector::from_iterator(p.len() / 2, p.chunks_exact(2).map(|term| term[1]));
    let problem = Projected { start, data, last: RefCell::default() };
    let (residuals, jacobian) = (|at: &_| Some(problem.residuals(at)), |at: &_| problem.jacobian(at));
    let exponents = levenberg_marquardt(exponents, 100, residuals, jacobian).at;
    let Some(best) = problem.solve(&exponents) else {
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
    /// Exponents of the last residuals, whose derivatives are asked for next.
    last: RefCell<(DVector<f64>, Option<Rc<OgdenModuli>>)>,
}

/// Best moduli, in units of the modulus.
struct OgdenModuli {
    moduli: DVector<f64>,
    /// Orthonormal basis of the stresses of the terms above the least modulus.
    basis: DMatrix<f64>,
    /// Derivatives of the stresses of unit moduli with respect to the exponents.
    slopes: DMatrix<f64>,
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
            state.predict_slopes(slopes, &unit, &mut found);
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

    fn solve(&self, exponents: &DVector<f64>) -> Option<Rc<OgdenModuli>> {
        let mut last = self.last.borrow_mut();
        if last.0 != *exponents {
            *last = (exponents.clone(), self.solved(exponents).map(Rc::new));
        }
        last.1.clone()
    }

    /// Solves for the best moduli above the least one of the search in all parameters. Each subset of terms
    /// may lie above it; the problem is convex, so the least misfit is the solution. Columns enter by their
    /// triangular factor alone.
    fn solved(&self, exponents: &DVector<f64>) -> Option<OgdenModuli> {
        self.start.evaluations.update(|count| count + 1);
        let [mut columns, slopes] = self.columns(exponents)?;
        let terms = exponents.len();
        let norms: Vec<f64> = columns.column_iter_mut().map(|mut column| column.normalize_mut()).collect();
        let (all, triangle) = columns.qr().unpack();
        let bound = DVector::from_fn(terms, |i, _| (-LARGEST_LOG).exp() * norms[i]);
        let onto = all.tr_mul(&self.data) - &triangle * &bound;
        let mut best: Option<(f64, DVector<f64>, DMatrix<f64>)> = None;
        for present in 0_usize..1 << terms {
            let those: Vec<usize> = (0..terms).filter(|i| present >> i & 1 == 1).collect();
            let (basis, factor) = triangle.select_columns(&those).qr().unpack();
            let Some(excess) = factor.solve_upper_triangular(&basis.tr_mul(&onto)) else { continue };
            let misfit = (&basis * basis.tr_mul(&onto) - &onto).norm_squared();
            let feasible = excess.iter().all(|excess| *excess > 0.0);
            if feasible && best.as_ref().is_none_or(|(least, ..)| misfit < *least) {
                let mut loads = bound.clone();
                those.iter().zip(&excess).for_each(|(&i, excess)| loads[i] += excess);
                best = Some((misfit, loads, basis));
            }
        }
        let (_, loads, basis) = best?;
        let residuals = &all * (triangle * &loads) - &self.data;
        let moduli = DVector::from_fn(terms, |i, _| loads[i] / norms[i]);
        Some(OgdenModuli { moduli, basis: all * basis, slopes, residuals })
    }

    fn residuals(&self, exponents: &DVector<f64>) -> DVector<f64> {
        // stresses overflow: as without any term, so that a trial there is rejected
        self.solve(exponents).map_or_else(|| -&self.data, |found| found.residuals.clone())
    }

    fn jacobian(&self, exponents: &DVector<f64>) -> Option<DMatrix<f64>> {
        // nothing ends the search
        if (self.start.stop)() {
            return None;
        }
        let found = self.solve(exponents)?;
        let mut slopes = found.slopes.clone();
        for (i, mut column) in slopes.column_iter_mut().enumerate() {
            column *= found.moduli[i];
        }
        Some(&slopes - &found.basis * found.basis.tr_mul(&slopes))
    }
}
