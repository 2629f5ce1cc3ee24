//! Starting points for fits of Ogden's law. The sum of squares has many minima in the exponents, but for
//! given exponents the stress is linear in the moduli: all subsets of a grid of exponents are solved exactly,
//! and the best become starting points.

use nalgebra::{DMatrix, DVector};

use super::data::TestState;
use super::descriptor::{ABSENT, FitStart};

/// Grid of |α|; both signs are tried.
const EXPONENTS: [f64; 14] = [0.3, 0.6, 1.0, 1.5, 2.0, 2.7, 3.6, 4.8, 6.5, 9.0, 12.0, 17.0, 24.0, 34.0];

/// Number of starts handed to the optimiser.
const SELECTED_STARTS: usize = 8;

/// Number of starts from the optimum of the law with one term less.
const EXTENDED_STARTS: usize = 3;

/// Parameter sets [μ₁, α₁, …] in Abaqus' convention, best first, no two of them neighbours on the grid.
pub(super) fn starts<const TERMS: usize>(start: &FitStart<'_>) -> Vec<Vec<f64>> {
    let (exponents, mut columns, data) = columns(start);
    if exponents.len() < TERMS {
        return Vec::new();
    }
    // the columns span thirty decades: solve for moduli in units of their norms
    let norms: Vec<f64> = columns.iter_mut().map(|column| column.normalize_mut()).collect();
    let all = DMatrix::from_columns(&columns);
    let gram = all.tr_mul(&all);
    let onto = all.tr_mul(&data);

    let mut found: Vec<(f64, [usize; TERMS], DVector<f64>)> = Vec::new();
    let mut chosen: [usize; TERMS] = std::array::from_fn(|i| i);
    loop {
        let normal = DMatrix::from_fn(TERMS, TERMS, |i, j| gram[(chosen[i], chosen[j])]);
        let right = DVector::from_fn(TERMS, |i, _| onto[chosen[i]]);
        if let Some(moduli) = normal.cholesky().map(|factor| factor.solve(&right))
            && moduli.iter().all(|modulus| *modulus > 0.0)
        {
            found.push((-moduli.dot(&right), chosen, moduli));
        }
        if !next_subset(&mut chosen, exponents.len()) {
            break;
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));

    let mut kept: Vec<(&[usize; TERMS], &DVector<f64>)> = Vec::new();
    for (_, subset, moduli) in &found {
        let near = |other: &[usize; TERMS]| subset.iter().zip(other).all(|(a, b)| a.abs_diff(*b) <= 1);
        if !kept.iter().any(|(other, _)| near(other)) {
            kept.push((subset, moduli));
        }
        if kept.len() == SELECTED_STARTS {
            break;
        }
    }
    let parameters = kept.iter().map(|(subset, moduli)| {
        let term = |i: usize| [start.modulus * moduli[i] / norms[subset[i]], exponents[subset[i]]];
        (0..TERMS).flat_map(term).collect()
    });
    parameters.collect()
}

/// Starts from a law with one term less: its new term absent, and the best three with a new term whose
/// exponent of the grid lowers the misfit.
pub(super) fn grown(smaller: &[f64], start: &FitStart<'_>) -> Vec<Vec<f64>> {
    let total: f64 = smaller.chunks_exact(2).map(|term| term[0]).sum();
    let mut all = vec![[smaller, &[ABSENT * total, 1.0]].concat()];
    let present: Vec<usize> = (0..smaller.len() / 2).filter(|i| smaller[2 * i] > 1e-12 * total).collect();
    let (exponents, grid, data) = columns(start);
    let own: Vec<DVector<f64>> =
        present.iter().filter_map(|&i| column(start, smaller[2 * i + 1])).map(|c| c.normalize()).collect();
    if own.len() != present.len() {
        return all;
    }
    let mut found: Vec<(f64, Vec<f64>)> = Vec::new();
    for (exponent, new) in exponents.iter().zip(&grid) {
        let list: Vec<DVector<f64>> = own.iter().cloned().chain([new.normalize()]).collect();
        let matrix = DMatrix::from_columns(&list);
        let onto = matrix.tr_mul(&data);
        let Some(moduli) = matrix.tr_mul(&matrix).cholesky().map(|factor| factor.solve(&onto)) else {
            continue;
        };
        if moduli.iter().any(|modulus| *modulus <= 0.0) {
            continue;
        }
        let mut parameters = smaller.to_vec();
        let scale = |k: usize, norm: f64| start.modulus * moduli[k] / norm;
        for (k, &i) in present.iter().enumerate() {
            let norm = column(start, smaller[2 * i + 1]).map_or(1.0, |c| c.norm());
            parameters[2 * i] = scale(k, norm);
        }
        parameters.extend([scale(present.len(), new.norm()), *exponent]);
        found.push((-moduli.dot(&onto), parameters));
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    all.extend(found.into_iter().take(EXTENDED_STARTS).map(|(_, parameters)| parameters));
    all
}

/// Stresses of one term of unit modulus, if they are finite.
fn column(start: &FitStart<'_>, exponent: f64) -> Option<DVector<f64>> {
    let mut values = Vec::with_capacity(start.table.measurements());
    for state in &start.table.states {
        let found = state.predict_slopes(slopes, &[1.0, exponent], &mut [[0.0; 2]; 2]);
        let measured = (0..2).filter(|&axis| state.nominal[axis] != 0.0);
        values.extend(measured.map(|axis| state.factor(axis) * found[axis]));
    }
    Some(DVector::from_vec(values)).filter(|column| column.norm().is_finite() && column.norm() > 0.0)
}

/// Exponents whose stresses are finite in the data, those stresses of unit moduli, and the data in units of
/// the modulus.
fn columns(start: &FitStart<'_>) -> (Vec<f64>, Vec<DVector<f64>>, DVector<f64>) {
    let grid = EXPONENTS.iter().rev().map(|a| -a).chain(EXPONENTS);
    let (exponents, columns) =
        grid.filter_map(|exponent| column(start, exponent).map(|column| (exponent, column))).unzip();
    let data = start.table.states.iter().flat_map(TestState::targets);
    let data = DVector::from_iterator(start.table.measurements(), data) / start.modulus;
    (exponents, columns, data)
}

/// Advances to the next ascending choice out of `count`; returns false after the last.
fn next_subset(chosen: &mut [usize], count: usize) -> bool {
    let terms = chosen.len();
    for i in (0..terms).rev() {
        // room for it and for those after it
        if chosen[i] + terms - i < count {
            chosen[i] += 1;
            for j in i + 1..terms {
                chosen[j] = chosen[j - 1] + 1;
            }
            return true;
        }
    }
    false
}

/// Pᵢ = Σ 2μ/α (λᵢ^α − λ₃^α)/λᵢ with λ₃ = 1/(λ₁λ₂), in Abaqus' convention, and its derivatives.
pub(super) fn slopes(p: &[f64], stretches: [f64; 2], slopes: &mut [[f64; 2]]) -> [f64; 2] {
    let logs = stretches.map(f64::ln);
    let third = -(logs[0] + logs[1]);
    let mut nominal = [0.0; 2];
    for (k, term) in p.chunks_exact(2).enumerate() {
        let (modulus, exponent) = (term[0], term[1]);
        let thin = (exponent * third).exp();
        for i in [0, 1] {
            let factor = 2.0 / exponent / stretches[i];
            // thick − thin without cancellation
            let difference = thin * (exponent * (logs[i] - third)).exp_m1();
            let unit = factor * difference;
            let thick = difference + thin;
            nominal[i] += modulus * unit;
            slopes[2 * k][i] = unit;
            slopes[2 * k + 1][i] = modulus * (factor * (logs[i] * thick - third * thin) - unit / exponent);
        }
    }
    nominal
}
