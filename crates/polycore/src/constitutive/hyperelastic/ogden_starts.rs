//! Where fits of Ogden's law start. The sum of squares has many minima in the exponents, but for given exponents the
//! stress is linear in the moduli: all subsets of a grid of exponents are solved exactly, and the best become starts.

use nalgebra::{DMatrix, DVector};

use super::{Ogden, OgdenConvention};
use crate::constitutive::hyperelastic::descriptor::Start;
use crate::constitutive::hyperelastic::homogeneous;

/// |α| of the grid; both signs are tried.
const EXPONENTS: [f64; 14] = [0.3, 0.6, 1.0, 1.5, 2.0, 2.7, 3.6, 4.8, 6.5, 9.0, 12.0, 17.0, 24.0, 34.0];

/// Starts that are handed to the optimiser.
const KEPT: usize = 8;

/// Parameter sets [μ₁, α₁, …] in Abaqus' convention, best first, no two of them neighbours on the grid.
pub(super) fn starts<const TERMS: usize>(start: &Start<'_>) -> Vec<Vec<f64>> {
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
        if kept.len() == KEPT {
            break;
        }
    }
    let parameters = kept.iter().map(|(subset, moduli)| {
        let term = |i: usize| [start.modulus * moduli[i] / norms[subset[i]], exponents[subset[i]]];
        (0..TERMS).flat_map(term).collect()
    });
    parameters.collect()
}

/// The exponents whose stresses are finite in the data, those stresses in units of the modulus, and the data.
fn columns(start: &Start<'_>) -> (Vec<f64>, Vec<DVector<f64>>, DVector<f64>) {
    let measured = |of: &dyn Fn([f64; 2]) -> Option<[f64; 2]>| -> Option<DVector<f64>> {
        let mut values = Vec::new();
        for state in &start.table.states {
            let found = of(state.stretches)?;
            let pairs = found.into_iter().zip(state.nominal).filter(|(_, data)| *data != 0.0);
            values.extend(pairs.map(|(value, _)| value));
        }
        Some(DVector::from_vec(values))
    };
    let (mut exponents, mut columns) = (Vec::new(), Vec::new());
    for exponent in EXPONENTS.iter().rev().map(|a| -a).chain(EXPONENTS) {
        let Ok(law) = Ogden::new(OgdenConvention::Abaqus, &[(1.0, exponent)]) else { continue };
        let nominal = measured(&|[a, b]| homogeneous::biaxial(&law, a, b).ok());
        if let Some(column) = nominal.filter(|column| column.norm().is_finite()) {
            exponents.push(exponent);
            columns.push(column);
        }
    }
    let data = start.table.states.iter().flat_map(|state| state.nominal).filter(|data| *data != 0.0);
    let data = DVector::from_iterator(start.table.measurements(), data) / start.modulus;
    (exponents, columns, data)
}

/// The next ascending choice out of `count`; false after the last.
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
