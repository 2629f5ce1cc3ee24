//! The bond law as the kernels need it: q = t/l as a function of e = l² − 1, so that no square root is taken.
//!
//! A stress-free law is q(e) = e·N(e)/D(e), exact at rest; any other N(e)/D(e). The cheapest polynomial or
//! rational fit whose measured error meets the bound is used, or a cubic Hermite table if none does.

use super::{BondPotential, ratio};
use crate::error::Error;
use pulp::Simd;

/// Most lanes of a vector.
const WIDEST: usize = 8;

/// Intervals between the points at which a candidate is tested.
const DENSE: usize = 4096;
/// Stride of the points that are fitted.
const STRIDE: usize = 32;
/// Fewest pieces of a table, and most nodes.
const LEAST_PIECES: usize = 64;
const MOST_NODES: usize = 1 << 17;
/// Cost of a division in multiply-adds, for choosing between candidates.
const DIVISION: usize = 5;
/// Compiled sizes of numerator and denominator (beyond its 1), cheapest first. On common stretch ranges all
/// laws need nearly the same size, hence the choice of ratios.
///
/// (10, 9) is padded to (11, 10): a size larger than needed may have a pole and its zero at the same point.
const CANDIDATES: [(usize, usize); 17] = [
    (3, 0),
    (4, 0),
    (5, 0),
    (6, 0),
    (7, 0),
    (8, 0),
    (9, 0),
    (10, 0),
    (3, 3),
    (12, 0),
    (4, 4),
    (5, 5),
    (7, 6),
    (8, 7),
    (9, 8),
    (10, 9),
    (11, 10),
];

/// A fitted law.
#[derive(Clone, Debug, PartialEq)]
pub struct KernelFit {
    /// Coefficients of N, lowest first; empty for a table.
    pub numerator: Vec<f64>,
    /// Coefficients of D beyond its leading 1.
    pub denominator: Vec<f64>,
    /// True if q has the factor e.
    pub stress_free: bool,
    /// Stretches covered.
    pub range: [f64; 2],
    /// Largest relative error of q over the range, measured.
    pub max_error: f64,
    /// Range of e outside of which q is constant; infinite unless set.
    pub clamp: [f64; 2],
    /// Strain l − 1, tension and its derivative at the nodes.
    table: Vec<[f64; 3]>,
}

impl KernelFit {
    /// Fits `law` over stretches `range` to relative error `bound` of q/e (of q for laws that are not
    /// stress-free).
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
        if bound.is_nan() || bound <= 0.0 {
            let allowed = "above 0".to_owned();
            return Err(Error::Parameter { name: "bound of the fitted law", found: bound, allowed });
        }
        let target =
            Target { law, low: low * low - 1.0, high: high * high - 1.0, stress_free: law.is_stress_free() };
        let dense = target.samples(DENSE)?;
        let sparse: Vec<(f64, f64)> = dense.iter().step_by(STRIDE).copied().collect();
        for (p, q) in CANDIDATES {
            // a little less, for the error between the sparse points
            let Some(ratio) = ratio::fit(&sparse, p, q, 0.97 * bound) else { continue };
            let safe = ratio.has_no_pole(target.low, target.high);
            let ratio::Ratio { numerator, denominator, .. } = ratio;
            let (stress_free, table) = (target.stress_free, Vec::new());
            let mut fit = Self {
                numerator,
                denominator,
                stress_free,
                range,
                max_error: 0.0,
                clamp: [f64::NEG_INFINITY, f64::INFINITY],
                table,
            };
            fit.max_error = fit.error(&dense);
            if fit.max_error <= bound && safe {
                return Ok(fit);
            }
        }
        target.table(range, bound, &dense)
    }

    /// Keeps q constant outside of the range, where the fit must not be extrapolated: bonds beyond it are
    /// about to break, and bonds crushed below it push along ζ with a bounded stiffness, where the law's
    /// direction jumps as ζ passes through 0.
    #[must_use]
    pub fn clamped(mut self) -> Self {
        self.clamp = self.range.map(|stretch| stretch * stretch - 1.0);
        self
    }

    /// Evaluates q(e).
    pub fn value(&self, e: f64) -> f64 {
        let e = e.clamp(self.clamp[0], self.clamp[1]);
        if !self.table.is_empty() {
            let stretch = (1.0 + e).max(0.0).sqrt();
            return self.interpolate(e / (1.0 + stretch)) / stretch.max(f64::MIN_POSITIVE);
        }
        let ratio = horner(&self.numerator, e) / (1.0 + e * horner(&self.denominator, e));
        if self.stress_free { e * ratio } else { ratio }
    }

    /// Evaluates q for several vectors of e.
    #[inline(always)]
    pub(crate) fn vectors<S: Simd, const V: usize>(&self, simd: S, mut e: [S::f64s; V]) -> [S::f64s; V] {
        if !self.table.is_empty() {
            for v in 0..V {
                let mut numbers = [0.0; WIDEST];
                let numbers = &mut numbers[..S::F64_LANES];
                S::as_mut_simd_f64s(numbers).0[0] = e[v];
                for k in 0..S::F64_LANES {
                    numbers[k] = self.value(numbers[k]);
                }
                e[v] = S::as_simd_f64s(numbers).0[0];
            }
            return e;
        }
        let (low, high) = (simd.splat_f64s(self.clamp[0]), simd.splat_f64s(self.clamp[1]));
        let (mut q, mut below) = ([simd.splat_f64s(0.0); V], [simd.splat_f64s(0.0); V]);
        for v in 0..V {
            e[v] = simd.min_f64s(simd.max_f64s(e[v], low), high);
        }
        // iterators, closures and functions of arrays would not be inlined into vector code
        for k in (0..self.numerator.len()).rev() {
            let c = simd.splat_f64s(self.numerator[k]);
            for v in 0..V {
                q[v] = simd.mul_add_f64s(q[v], e[v], c);
            }
        }
        for k in (0..self.denominator.len()).rev() {
            let c = simd.splat_f64s(self.denominator[k]);
            for v in 0..V {
                below[v] = simd.mul_add_f64s(below[v], e[v], c);
            }
        }
        for v in 0..V {
            if !self.denominator.is_empty() {
                let one = simd.splat_f64s(1.0);
                q[v] = simd.div_f64s(q[v], simd.mul_add_f64s(e[v], below[v], one));
            }
            if self.stress_free {
                q[v] = simd.mul_f64s(q[v], e[v]);
            }
        }
        q
    }

    /// Strain l − 1, tension and its derivative at the nodes of a table; none for a ratio of polynomials.
    pub fn nodes(&self) -> &[[f64; 3]] {
        &self.table
    }

    /// Form of the fit: `polynomial of degree 6`, `rational 3/2`, `table of 2000 nodes`.
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

    /// Largest relative error of q over the range in single precision; infinite for a table. The ratio of a
    /// chain law over stretches of 0.1 to 3 loses all digits.
    pub fn single_error(&self) -> f64 {
        if self.numerator.is_empty() {
            return f64::INFINITY;
        }
        let single = |coefficients: &[f64], x: f32| {
            coefficients.iter().rev().fold(0.0, |sum: f32, &c| sum.mul_add(x, c as f32))
        };
        let [low, high] = self.range.map(|stretch| stretch * stretch - 1.0);
        let error = |k: usize| {
            let e = (low + (high - low) * k as f64 / DENSE as f64) as f32;
            let ratio = single(&self.numerator, e) / (1.0 + e * single(&self.denominator, e));
            let found = f64::from(if self.stress_free { e * ratio } else { ratio });
            let exact = self.value(e.into());
            if found == exact { 0.0 } else { (found / exact - 1.0).abs() }
        };
        // NaN is no small error
        (0..=DENSE).map(error).fold(0.0, |most: f64, error| if error <= most { most } else { error })
    }

    /// Largest relative deviation from the samples (e, q or q/e).
    fn error(&self, samples: &[(f64, f64)]) -> f64 {
        samples
            .iter()
            .map(|&(e, exact)| {
                if self.stress_free && e == 0.0 {
                    return 0.0;
                }
                let q = self.value(e);
                let found = if self.stress_free { q / e } else { q };
                let error = ((found - exact) / exact).abs();
                if error.is_nan() { f64::INFINITY } else { error }
            })
            .fold(0.0, f64::max)
    }

    fn interpolate(&self, strain: f64) -> f64 {
        let last = self.table.len() - 2;
        let k = self.table.partition_point(|node| node[0] <= strain).saturating_sub(1).min(last);
        let (left, right) = (&self.table[k], &self.table[k + 1]);
        match strain {
            // beyond the table: the tangent at its end
            below if below < left[0] => left[1] + left[2] * (below - left[0]),
            above if above > right[0] => right[1] + right[2] * (above - right[0]),
            _ => hermite(left, right, strain),
        }
    }
}

/// Evaluates the cubic through two nodes with their slopes.
fn hermite([x0, t0, d0]: &[f64; 3], [x1, t1, d1]: &[f64; 3], strain: f64) -> f64 {
    let width = x1 - x0;
    // both differences, so that neither cancels beside the node at rest
    let (s, r) = ((strain - x0) / width, (x1 - strain) / width);
    (1.0 + 2.0 * s) * r * r * t0 + s * r * r * width * d0 + s * s * (3.0 - 2.0 * s) * t1
        - s * s * r * width * d1
}

fn horner(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// Function to be fitted.
struct Target<'a> {
    law: &'a dyn BondPotential,
    low: f64,
    high: f64,
    stress_free: bool,
}

impl Target<'_> {
    /// q/e, or q for laws that are not stress-free.
    fn exact(&self, e: f64) -> f64 {
        let stretch = (1.0 + e).sqrt();
        // l − 1 = e/(1 + l), without cancellation
        let q = self.law.tension_at_strain(e / (1.0 + stretch)) / stretch;
        match self.stress_free {
            true if e == 0.0 => 0.5 * self.law.tangent(),
            true => q / e,
            false => q,
        }
    }

    /// Samples the function, graded towards both ends.
    fn samples(&self, count: usize) -> Result<Vec<(f64, f64)>, Error> {
        let point = |k: usize| {
            let sine = (0.5 * std::f64::consts::PI * k as f64 / count as f64).sin();
            let e = self.low + (self.high - self.low) * sine * sine;
            (e, self.exact(e))
        };
        let samples: Vec<(f64, f64)> = (0..=count).map(point).collect();
        match samples.iter().find(|(_, exact)| !exact.is_finite() || *exact == 0.0) {
            Some((e, exact)) => Err(Error::Parameter {
                name: "force of the bond law over its stretch",
                found: *exact,
                allowed: format!("finite values other than 0; at the stretch {}", (1.0 + e).sqrt()),
            }),
            None => Ok(samples),
        }
    }

    /// Builds cubic Hermite pieces of t over the strain, halved until each meets the bound at its quarter
    /// points.
    fn table(&self, range: [f64; 2], bound: f64, dense: &[(f64, f64)]) -> Result<KernelFit, Error> {
        let [low, high] = range.map(|stretch| stretch - 1.0);
        let node = |strain: f64| {
            [strain, self.law.tension_at_strain(strain), self.law.tension_derivative(1.0 + strain)]
        };
        let mut pending: Vec<[f64; 3]> = (1..=LEAST_PIECES)
            .rev()
            .map(|k| node(low + (high - low) * k as f64 / LEAST_PIECES as f64))
            .collect();
        if low < 0.0 && high > 0.0 {
            // rest is a node: the error relative to t must not diverge beside its zero
            pending.retain(|[strain, ..]| strain.abs() > 1e-12);
            let after = pending.partition_point(|[strain, ..]| *strain > 0.0);
            pending.insert(after, node(0.0));
        }
        let mut fit = KernelFit {
            numerator: Vec::new(),
            denominator: Vec::new(),
            stress_free: self.stress_free,
            range,
            max_error: 0.0,
            clamp: [f64::NEG_INFINITY, f64::INFINITY],
            table: vec![node(low)],
        };
        while let (Some(&right), Some(&left)) = (pending.last(), fit.table.last()) {
            let error = [0.25, 0.5, 0.75].into_iter().fold(0.0, |largest: f64, part| {
                let strain = left[0] + part * (right[0] - left[0]);
                let exact = self.law.tension_at_strain(strain);
                if exact == 0.0 {
                    largest
                } else {
                    largest.max((hermite(&left, &right, strain) / exact - 1.0).abs())
                }
            });
            if error <= 0.7 * bound {
                fit.max_error = fit.max_error.max(error);
                fit.table.push(right);
                pending.pop();
            } else if fit.table.len() + pending.len() < MOST_NODES {
                pending.push(node(0.5 * (left[0] + right[0])));
            } else {
                break;
            }
        }
        fit.max_error = fit.max_error.max(fit.error(dense));
        if pending.is_empty() && fit.max_error <= bound {
            return Ok(fit);
        }
        Err(Error::Parameter {
            name: "bound of the fitted law",
            found: bound,
            allowed: format!("larger: no fit over the stretches {} to {} reaches it", range[0], range[1]),
        })
    }
}
