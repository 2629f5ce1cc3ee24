//! The bond law as the kernels need it: q = t/l as a function of e = l² − 1, so that no square root is taken.
//!
//! A stress-free law is q(e) = e·N(e)/D(e), exact at rest; any other N(e)/D(e). The cheapest polynomial or rational fit
//! whose measured error meets the bound is taken, a cubic Hermite table where none does.

use super::BondPotential;
use crate::error::Error;
use nalgebra::{DMatrix, DVector};

/// Points at which a candidate is judged.
const DENSE: usize = 4000;
/// Points at which it is judged first.
const SPARSE: usize = 200;
/// Cost of a division in multiply-adds, for choosing between candidates.
const DIVISION: usize = 5;
/// Numerator and denominator sizes worth trying (those that the kernels are compiled for), cheapest first.
const CANDIDATES: [(usize, usize); 16] = [
    (3, 0),
    (4, 0),
    (5, 0),
    (6, 0),
    (7, 0),
    (8, 0),
    (10, 0),
    (3, 2),
    (12, 0),
    (4, 3),
    (5, 4),
    (16, 0),
    (6, 5),
    (8, 7),
    (25, 0),
    (11, 10),
];

/// A fitted law.
#[derive(Clone, Debug, PartialEq)]
pub struct KernelFit {
    /// Coefficients of N, lowest first; empty for a table.
    pub numerator: Vec<f64>,
    /// Coefficients of D beyond its leading 1.
    pub denominator: Vec<f64>,
    /// Whether q carries the factor e.
    pub stress_free: bool,
    /// Stretches covered.
    pub range: [f64; 2],
    /// Largest relative error of q over the range, measured.
    pub max_error: f64,
    table: Vec<[f64; 3]>,
}

impl KernelFit {
    /// Fits `law` over stretches `range` to relative error `bound` of q/e (q for laws that are not stress-free).
    ///
    /// # Errors
    /// [`Error::Parameter`] for an empty range or a bound that even the table misses.
    pub fn new(law: &dyn BondPotential, range: [f64; 2], bound: f64) -> Result<Self, Error> {
        let [low, high] = range;
        if !(low > 0.0 && low < high && high.is_finite()) {
            return Err(Error::Parameter {
                name: "stretch range of the fitted law",
                found: if low > 0.0 { high } else { low },
                allowed: "0 < low < high".to_owned(),
            });
        }
        let target =
            Target { law, low: low * low - 1.0, high: high * high - 1.0, stress_free: law.is_stress_free() };
        let (sparse, dense) = (target.samples(SPARSE), target.samples(DENSE));
        for (p, q) in CANDIDATES {
            let Some(mut fit) = target.rational(p, q, range) else { continue };
            if fit.error(&sparse) > bound {
                continue;
            }
            fit.max_error = fit.error(&dense);
            if fit.max_error <= bound && fit.denominator_is_safe(&dense) {
                return Ok(fit);
            }
        }
        for nodes in [500, 2_000, 8_000, 32_000, 128_000] {
            let mut fit = target.table(nodes, range);
            fit.max_error = fit.error(&dense);
            if fit.max_error <= bound {
                return Ok(fit);
            }
        }
        Err(Error::Parameter {
            name: "bound of the fitted law",
            found: bound,
            allowed: format!("larger: no fit over the stretches {low} to {high} reaches it"),
        })
    }

    /// q(e).
    pub fn value(&self, e: f64) -> f64 {
        if !self.table.is_empty() {
            let stretch = (1.0 + e).max(0.0).sqrt();
            return self.interpolate(stretch) / stretch.max(f64::MIN_POSITIVE);
        }
        let ratio = horner(&self.numerator, e) / (1.0 + e * horner(&self.denominator, e));
        if self.stress_free { e * ratio } else { ratio }
    }

    /// What is fitted: `polynomial of degree 6`, `rational 3/2`, `table of 2000 nodes`.
    pub fn kind(&self) -> String {
        if !self.table.is_empty() {
            format!("table of {} nodes", self.table.len())
        } else if self.denominator.is_empty() {
            format!("polynomial of degree {}", self.numerator.len() - 1)
        } else {
            format!("rational {}/{}", self.numerator.len() - 1, self.denominator.len())
        }
    }

    /// Multiply-adds of one evaluation, a division counted as five.
    pub fn cost(&self) -> usize {
        self.numerator.len() + self.denominator.len() + if self.denominator.is_empty() { 0 } else { DIVISION }
    }

    /// Largest relative deviation from the samples (e, q or q/e).
    fn error(&self, samples: &[(f64, f64)]) -> f64 {
        samples
            .iter()
            .map(|&(e, exact)| {
                let q = self.value(e);
                let found = if self.stress_free { q / e } else { q };
                let error = ((found - exact) / exact).abs();
                if error.is_nan() { f64::INFINITY } else { error }
            })
            .fold(0.0, f64::max)
    }

    /// No pole within the range or near it.
    fn denominator_is_safe(&self, samples: &[(f64, f64)]) -> bool {
        samples.iter().all(|&(e, _)| 1.0 + e * horner(&self.denominator, e) > 1e-3)
    }

    fn interpolate(&self, stretch: f64) -> f64 {
        let last = self.table.len() - 2;
        let k = self.table.partition_point(|node| node[0] <= stretch).saturating_sub(1).min(last);
        let ([x0, t0, d0], [x1, t1, d1]) = (self.table[k], self.table[k + 1]);
        let width = x1 - x0;
        let s = (stretch - x0) / width;
        if !(0.0..=1.0).contains(&s) {
            // beyond the table: the tangent at its end
            let (x, t, d) = if s < 0.0 { (x0, t0, d0) } else { (x1, t1, d1) };
            return t + d * (stretch - x);
        }
        let r = 1.0 - s;
        (1.0 + 2.0 * s) * r * r * t0 + s * r * r * width * d0 + s * s * (3.0 - 2.0 * s) * t1
            - s * s * r * width * d1
    }
}

fn horner(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// What is to be fitted.
struct Target<'a> {
    law: &'a dyn BondPotential,
    low: f64,
    high: f64,
    stress_free: bool,
}

impl Target<'_> {
    /// q/e, or q.
    fn exact(&self, e: f64) -> f64 {
        let stretch = (1.0 + e).sqrt();
        let q = self.law.tension(stretch) / stretch;
        if self.stress_free { q / e } else { q }
    }

    /// Samples graded towards both ends; those near rest, where q/e is a quotient of roundings, are left out.
    fn samples(&self, count: usize) -> Vec<(f64, f64)> {
        let least = if self.stress_free { 1e-4 } else { 0.0 };
        (0..=count)
            .map(|k| {
                let angle = std::f64::consts::PI * k as f64 / count as f64;
                0.5 * (self.low + self.high) - 0.5 * (self.high - self.low) * angle.cos()
            })
            .filter(|e| e.abs() >= least)
            .map(|e| (e, self.exact(e)))
            .collect()
    }

    /// Least squares for N − R·D = 0, relative to R and reweighted by the last D (Sanathanan & Koerner 1963,
    /// doi:10.1109/TAC.1963.1105517), in Chebyshev polynomials of the range, converted to powers of e.
    fn rational(&self, p: usize, q: usize, range: [f64; 2]) -> Option<KernelFit> {
        let samples = self.samples(8 * (p + q) + 16);
        let (centre, half) = (0.5 * (self.low + self.high), 0.5 * (self.high - self.low));
        // the extra point keeps the ends from being extrapolated by rounding
        let basis = |e: f64, k: usize| (k as f64 * ((e - centre) / half).clamp(-1.0, 1.0).acos()).cos();
        let mut weights = vec![1.0; samples.len()];
        let mut solution = DVector::zeros(p + q);
        for _ in 0..if q == 0 { 1 } else { 6 } {
            let matrix = DMatrix::from_fn(samples.len(), p + q, |row, column| {
                let (e, exact) = samples[row];
                let value = if column < p { basis(e, column) / exact } else { -basis(e, column - p + 1) };
                value * weights[row]
            });
            let right = DVector::from_fn(samples.len(), |row, _| weights[row]);
            solution = matrix.svd(true, true).solve(&right, 1e-15).ok()?;
            for (weight, &(e, _)) in weights.iter_mut().zip(&samples) {
                let d = 1.0 + (0..q).map(|k| solution[p + k] * basis(e, k + 1)).sum::<f64>();
                *weight = 1.0 / d.abs().max(1e-6);
            }
        }
        let numerator = powers(&solution.as_slice()[..p], centre, half);
        let mut tail = vec![1.0];
        tail.extend_from_slice(&solution.as_slice()[p..]);
        let denominator = powers(&tail, centre, half);
        // D(0) = 1
        let lead = denominator[0];
        let fit = KernelFit {
            numerator: numerator.iter().map(|c| c / lead).collect(),
            denominator: denominator[1..].iter().map(|c| c / lead).collect(),
            stress_free: self.stress_free,
            range,
            max_error: f64::INFINITY,
            table: Vec::new(),
        };
        fit.numerator.iter().chain(&fit.denominator).all(|c| c.is_finite()).then_some(fit)
    }

    /// Cubic Hermite in l, nodes dense where the force is steep: equal steps of ∫ √(1 + |t′|) dl.
    fn table(&self, nodes: usize, range: [f64; 2]) -> KernelFit {
        let [low, high] = range;
        let fine = 4 * nodes;
        let at = |k: usize| low + (high - low) * k as f64 / fine as f64;
        let density = |l: f64| (1.0 + self.law.tension_derivative(l).abs()).powf(0.25);
        let mut total = vec![0.0];
        for k in 0..fine {
            let step = 0.5 * (density(at(k)) + density(at(k + 1)));
            total.push(total[k] + step);
        }
        let whole = total[fine];
        let mut table: Vec<[f64; 3]> = (0..=nodes)
            .map(|node| {
                let aim = whole * node as f64 / nodes as f64;
                let k = total.partition_point(|&t| t < aim).clamp(1, fine) - 1;
                let l = at(k)
                    + (at(k + 1) - at(k)) * ((aim - total[k]) / (total[k + 1] - total[k])).clamp(0.0, 1.0);
                [l, self.law.tension(l), self.law.tension_derivative(l)]
            })
            .collect();
        if self.stress_free && low < 1.0 && high > 1.0 {
            // rest is a node: the error relative to t must not blow up beside its zero
            table.push([1.0, 0.0, self.law.tangent()]);
            table.sort_by(|a, b| a[0].total_cmp(&b[0]));
            table.dedup_by(|a, b| a[0] - b[0] < 1e-12);
        }
        KernelFit {
            numerator: Vec::new(),
            denominator: Vec::new(),
            stress_free: self.stress_free,
            range,
            max_error: f64::INFINITY,
            table,
        }
    }
}

/// Powers of e of Σ c_k T_k((e − centre)/half).
fn powers(chebyshev: &[f64], centre: f64, half: f64) -> Vec<f64> {
    let length = chebyshev.len();
    let (slope, shift) = (1.0 / half, -centre / half);
    let times_x = |poly: &[f64]| {
        let mut product = vec![0.0; length];
        for (k, &c) in poly.iter().enumerate() {
            product[k] += shift * c;
            if k + 1 < length {
                product[k + 1] += slope * c;
            }
        }
        product
    };
    let mut previous = vec![0.0; length];
    previous[0] = 1.0;
    let mut sum: Vec<f64> = previous.iter().map(|t| t * chebyshev[0]).collect();
    let mut current = times_x(&previous);
    for &coefficient in &chebyshev[1..] {
        for (s, t) in sum.iter_mut().zip(&current) {
            *s += coefficient * t;
        }
        let next = times_x(&current).iter().zip(&previous).map(|(a, b)| 2.0 * a - b).collect();
        previous = std::mem::replace(&mut current, next);
    }
    sum
}
