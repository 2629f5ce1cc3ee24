//! Ratios of polynomials with least relative error.

use nalgebra::{DMatrix, Schur};

/// Number of linearisations of the denominator about its last value.
const LINEARISATIONS: usize = 5;

/// Rounds from least squares towards the least maximum, tried if they might meet the bound.
const REWEIGHTINGS: usize = 12;
const WORTH_REWEIGHTING: f64 = 8.0;

/// N(x)/D(x) in powers of x.
pub(super) struct Ratio {
    /// Coefficients of N, constant first.
    pub numerator: Vec<f64>,
    /// Coefficients of D beyond its constant 1.
    pub denominator: Vec<f64>,
    /// Largest relative error at the samples.
    pub error: f64,
}

impl Ratio {
    /// Returns true if every zero of D keeps a distance from [low, high]: 2 % of its width, or a quarter of
    /// that to the singular point −1.
    pub fn has_no_pole(&self, low: f64, high: f64) -> bool {
        let width = high - low;
        let margin = (0.02 * width).min(0.25 * (low + 1.0));
        // in units of the width, which balances the companion matrix
        let scaled: Vec<f64> = self.denominator.iter().zip(1..).map(|(d, k)| d * width.powi(k)).collect();
        let Some(degree) = (1..=scaled.len()).rev().find(|k| scaled[k - 1].abs() > 1e-14) else {
            return true;
        };
        let companion = DMatrix::from_fn(degree, degree, |row, column| {
            let below = if row == column + 1 { 1.0 } else { 0.0 };
            let lower = if row == 0 { 1.0 } else { scaled[row - 1] };
            if column + 1 == degree { -lower / scaled[degree - 1] } else { below }
        });
        if companion.iter().any(|entry| !entry.is_finite()) {
            return false;
        }
        let Some(schur) = Schur::try_new(companion, f64::EPSILON, 10_000) else { return false };
        schur.complex_eigenvalues().iter().all(|zero| {
            let re = zero.re * width;
            (low - re).max(re - high).max(0.0).hypot(zero.im * width) > margin
        })
    }
}

/// Finds the ratio with `p` coefficients of N and `q` of D beyond its 1 of nearly least relative error at the
/// samples (x, f), if its error can be brought below `bound`.
///
/// Sanathanan and Koerner's iteration (1963, doi:10.1109/TAC.1963.1105517), with N and D in polynomials
/// orthogonal under the current weights, so that neither a wide range nor a steep D costs digits; then
/// Lawson's reweighting.
pub(super) fn fit(samples: &[(f64, f64)], p: usize, q: usize, bound: f64) -> Option<Ratio> {
    let at: Vec<f64> = samples.iter().map(|(x, _)| *x).collect();
    let mut weights = vec![1.0; at.len()];
    let mut divisor = vec![1.0; at.len()];
    let linearisations = if q == 0 { 1 } else { LINEARISATIONS };
    for round in 0..linearisations + REWEIGHTINGS {
        let step = step(samples, &at, &weights, &divisor, p, q)?;
        let ratio = step.ratio;
        if ratio.error <= bound {
            return Some(ratio);
        }
        divisor = step.divisor;
        // a fit gains about two digits from one linearisation to the next
        let hopeless = if round + 1 < linearisations { 1e9 } else { WORTH_REWEIGHTING };
        if ratio.error.is_nan() || ratio.error > hopeless * bound {
            return None;
        }
        if round + 1 >= linearisations {
            for (weight, error) in weights.iter_mut().zip(&step.errors) {
                *weight *= (error.abs() / ratio.error).sqrt().max(1e-3);
            }
            let largest = weights.iter().copied().fold(0.0, f64::max);
            weights.iter_mut().for_each(|weight| *weight /= largest);
        }
    }
    None
}

struct FitStep {
    ratio: Ratio,
    /// |D| at the samples.
    divisor: Vec<f64>,
    /// Relative errors at the samples.
    errors: Vec<f64>,
}

/// Solves the least squares of w(N − fD)/(fD₀) with the previous D₀.
fn step(
    samples: &[(f64, f64)],
    at: &[f64],
    weights: &[f64],
    divisor: &[f64],
    p: usize,
    q: usize,
) -> Option<FitStep> {
    let rows = at.len();
    let scale: Vec<f64> = (0..rows).map(|i| weights[i] / divisor[i]).collect();
    let above = Orthogonal::new(at, (0..rows).map(|i| scale[i] / samples[i].1).collect(), p)?;
    let below = Orthogonal::new(at, scale.clone(), q + 1)?;
    // part of f·D outside the space of N
    let mut overlap = above.columns.tr_mul(&below.columns);
    let mut rest = &below.columns - &above.columns * &overlap;
    let again = above.columns.tr_mul(&rest);
    rest -= &above.columns * &again;
    overlap += again;
    let b = if q == 0 {
        DMatrix::from_element(1, 1, 1.0)
    } else {
        let svd = rest.qr().r().try_svd(false, true, f64::EPSILON, 10_000)?;
        let least = svd.singular_values.imin();
        svd.v_t?.row(least).transpose().into_owned().resize(q + 1, 1, 0.0)
    };
    let a = &overlap * &b;
    let (n, d) = (&above.columns * &a, &below.columns * &b);
    let mut divided: Vec<f64> = (0..rows).map(|i| d[i] / scale[i]).collect();
    let errors: Vec<f64> = (0..rows).map(|i| n[i] / d[i] - 1.0).collect();
    let error = errors
        .iter()
        .fold(0.0, |largest: f64, error| if error.is_nan() { *error } else { largest.max(error.abs()) });
    let (numerator, denominator) = (above.powers(a.as_slice()), below.powers(b.as_slice()));
    let constant = denominator[0];
    let one_sign = divided.iter().all(|value| value * constant > 0.0);
    let floor = 1e-9 * divided.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    divided.iter_mut().for_each(|value| *value = (*value / constant).abs().max(floor / constant.abs()));
    let ratio = Ratio {
        numerator: numerator.iter().map(|c| c / constant).collect(),
        denominator: denominator[1..].iter().map(|c| c / constant).collect(),
        // a change of sign is a pole: worse than any error, but it may vanish in the next step
        error: if one_sign { error } else { error.max(1e-3) },
    };
    Some(FitStep { ratio, divisor: divided, errors })
}

/// Polynomials orthonormal under weights on points, by Arnoldi's recurrence (Brubeck, Nakatsukasa and
/// Trefethen 2021, doi:10.1137/19M130100X).
struct Orthogonal {
    /// Column k: weight × polynomial of degree k at the points.
    columns: DMatrix<f64>,
    /// Row k: the polynomial of degree k in powers of x.
    powers: Vec<Vec<f64>>,
}

impl Orthogonal {
    fn new(at: &[f64], weights: Vec<f64>, count: usize) -> Option<Self> {
        let mut columns = DMatrix::from_fn(at.len(), count, |_, _| 0.0);
        let mut powers: Vec<Vec<f64>> = Vec::with_capacity(count);
        let mut vector = nalgebra::DVector::from_vec(weights);
        let mut power = vec![0.0; count];
        power[0] = 1.0;
        for k in 0..count {
            // twice is enough
            for _ in 0..2 {
                for j in 0..k {
                    let share = columns.column(j).dot(&vector);
                    vector.axpy(-share, &columns.column(j), 1.0);
                    for (c, lower) in power.iter_mut().zip(&powers[j]) {
                        *c -= share * lower;
                    }
                }
            }
            let norm = vector.norm();
            if !(norm > 0.0 && norm.is_finite()) {
                return None;
            }
            vector /= norm;
            power.iter_mut().for_each(|c| *c /= norm);
            columns.set_column(k, &vector);
            for (entry, x) in vector.iter_mut().zip(at) {
                *entry *= x;
            }
            powers.push(power.clone());
            power.rotate_right(1);
            power[0] = 0.0;
        }
        Some(Self { columns, powers })
    }

    /// Σ c_k p_k in powers of x.
    fn powers(&self, coefficients: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; coefficients.len()];
        for (c, power) in coefficients.iter().zip(&self.powers) {
            for (s, entry) in sum.iter_mut().zip(power) {
                *s += c * entry;
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ratio is its own best fit.
    #[test]
    fn finds_a_ratio_again() {
        let exact = |x: f64| (2.0 + x - 0.1 * x * x) / (1.0 + 0.3 * x + 0.05 * x * x);
        let samples: Vec<_> =
            (0..=128).map(|k| -0.5 + 3.5 * f64::from(k) / 128.0).map(|x| (x, exact(x))).collect();
        let ratio = fit(&samples, 3, 2, 1e-13).unwrap();
        // rounding, amplified by the condition of the problem
        for (found, exact) in
            ratio.numerator.iter().chain(&ratio.denominator).zip([2.0, 1.0, -0.1, 0.3, 0.05])
        {
            assert!((found - exact).abs() < 1e-11, "{found} {exact}");
        }
        assert!(ratio.has_no_pole(-0.5, 3.0));
    }

    #[test]
    fn poles_are_seen() {
        let ratio = |zero: f64| Ratio { numerator: vec![1.0], denominator: vec![-1.0 / zero], error: 0.0 };
        for (zero, clear) in
            [(1.5, false), (3.01, false), (-0.501, false), (3.1, true), (-0.9, true), (-2.0, true)]
        {
            assert_eq!(ratio(zero).has_no_pole(-0.5, 3.0), clear, "{zero}");
        }
        // a pair beside the range: 1 − 2x/|z|² Re z + x²/|z|², z = 1 ± 0.01i
        let square = 1.0 + 1e-4;
        let pair = Ratio { numerator: vec![1.0], denominator: vec![-2.0 / square, 1.0 / square], error: 0.0 };
        assert!(!pair.has_no_pole(-0.5, 3.0));
    }
}
