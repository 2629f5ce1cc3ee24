//! Fit of a Prony series: nonnegative least squares on a grid of times, neighbours merged, all constants
//! refined.

use nalgebra::{DMatrix, DVector};

use super::{Prony, PronyTerm, oscillation};
use crate::constitutive::Error;
use crate::constitutive::viscoelastic::fit::uncertainty;
use crate::numerics::least_squares::levenberg_marquardt;
use crate::numerics::nonnegative::nonnegative_least_squares;

/// Relative deviation of a trial whose relaxation times lie too far from the data.
const REJECTED: f64 = 1e6;

/// Settings of a fit of a Prony series.
#[derive(Debug, Clone, PartialEq)]
pub struct PronySettings {
    /// Times of the grid per decade.
    pub per_decade: usize,
    /// Largest number of terms; the weakest neighbours are merged until it is kept.
    pub most: usize,
    /// Weight of a relative deviation of the loss modulus against one of the storage modulus.
    pub loss: f64,
}

impl Default for PronySettings {
    /// Two times a decade, as many terms as the grid has, a weight of 0.1 for the loss.
    fn default() -> Self {
        Self { per_decade: 2, most: usize::MAX, loss: 0.1 }
    }
}

/// Fitted Prony series.
#[derive(Debug, Clone, PartialEq)]
pub struct PronyFit {
    /// The series.
    pub series: Prony,
    /// Root mean square of model/data − 1: of the relaxation modulus, or of storage and loss.
    pub rms: Vec<f64>,
    /// Factors on the equilibrium modulus, then on modulus and time of each term, that bound its interval of
    /// 95 %: value/factor to value·factor; `None` where the data do not determine it.
    pub factors: Vec<Option<f64>>,
    /// Singular values of the Jacobian in the logarithms of the constants, over the noise, from the largest.
    pub singular_values: Vec<f64>,
}

/// Measured quantity.
#[derive(Clone, Copy, PartialEq)]
enum Modulus {
    Relaxation,
    Storage,
    Loss,
}

/// Measured value: what, at which time (s) or angular frequency (1/s).
struct ModulusPoint {
    kind: Modulus,
    at: f64,
    measured: f64,
    /// Weight of its relative deviation.
    weight: f64,
}

impl ModulusPoint {
    /// Value of a term of modulus 1, and its derivative by ln τ.
    fn unit(&self, time: f64) -> [f64; 2] {
        let x = self.at * time;
        match self.kind {
            Modulus::Relaxation => {
                let x = self.at / time;
                [(-x).exp(), x * (-x).exp()]
            }
            Modulus::Storage => {
                let [storage, loss] = oscillation(x);
                [storage, 2.0 * loss * loss]
            }
            Modulus::Loss => {
                let [storage, loss] = oscillation(x);
                [loss, loss * (1.0 - 2.0 * storage)]
            }
        }
    }

    /// Share of the equilibrium modulus.
    fn rest(&self) -> f64 {
        if self.kind == Modulus::Loss { 0.0 } else { 1.0 }
    }
}

/// Fits a Prony series to [time (s), modulus (Pa)] after a step of strain, in relative deviations. Points at
/// 0 s are left out: no series determines them.
///
/// # Errors
/// [`Error::Data`] for fewer than three points, or values that are not above 0.
pub fn fit_relaxation(data: &[[f64; 2]], settings: &PronySettings) -> Result<PronyFit, Error> {
    let points = data.iter().filter(|point| point[0] != 0.0);
    let values = points
        .map(|&[at, measured]| ModulusPoint { kind: Modulus::Relaxation, at, measured, weight: 1.0 })
        .collect();
    fit(values, &[Modulus::Relaxation], settings)
}

/// Fits a Prony series to [frequency (Hz), storage, loss (Pa)], in relative deviations of both moduli. Points
/// whose loss is 0 or less count with their storage only.
///
/// # Errors
/// As [`fit_relaxation`].
pub fn fit_oscillation(data: &[[f64; 3]], settings: &PronySettings) -> Result<PronyFit, Error> {
    let mut values = Vec::new();
    for &[frequency, storage, loss] in data {
        let at = std::f64::consts::TAU * frequency;
        values.push(ModulusPoint { kind: Modulus::Storage, at, measured: storage, weight: 1.0 });
        if loss > 0.0 {
            values.push(ModulusPoint { kind: Modulus::Loss, at, measured: loss, weight: settings.loss });
        }
    }
    fit(values, &[Modulus::Storage, Modulus::Loss], settings)
}

fn fit(values: Vec<ModulusPoint>, kinds: &[Modulus], settings: &PronySettings) -> Result<PronyFit, Error> {
    let refuse = |reason: String| Err(Error::Data { what: "fit of a Prony series".to_owned(), reason });
    if values.len() < 3 {
        return refuse(format!("{} values; it needs three or more", values.len()));
    }
    for ModulusPoint { at, measured, .. } in &values {
        if !(*at > 0.0 && at.is_finite() && *measured > 0.0 && measured.is_finite()) {
            return refuse(format!("the modulus {measured} Pa at {at}: both must be above 0 and finite"));
        }
    }
    let start = merged(on_grid(&values, settings.per_decade.max(1)), settings.most.min(values.len() / 2));
    let (series, jacobian) = refined(&values, start);
    let deviation = |value: &ModulusPoint| model(&series, value) / value.measured - 1.0;
    let rms = kinds.iter().map(|kind| {
        let own: Vec<f64> =
            values.iter().filter(|value| value.kind == *kind).map(|v| deviation(v).powi(2)).collect();
        (own.iter().sum::<f64>() / own.len() as f64).sqrt()
    });
    let rms = rms.collect();
    let squares: f64 = values.iter().map(|value| (value.weight * deviation(value)).powi(2)).sum();
    let degrees = values.len().saturating_sub(jacobian.ncols()).max(1) as f64;
    let noise = (squares / degrees).sqrt().max(f64::EPSILON);
    let (singular_values, errors) = uncertainty(jacobian / noise);
    let mut factors: Vec<Option<f64>> =
        errors.into_iter().map(|error| error.map(|error| (1.96 * error).exp())).collect();
    if series.equilibrium == 0.0 {
        factors.insert(0, None);
    }
    Ok(PronyFit { series, rms, factors, singular_values })
}

fn model(series: &Prony, value: &ModulusPoint) -> f64 {
    let terms = series.terms.iter().map(|term| term.modulus * value.unit(term.time)[0]);
    series.equilibrium * value.rest() + terms.sum::<f64>()
}

/// Shortest and longest time of the data, s; 1/ω of oscillations.
fn times_of(values: &[ModulusPoint]) -> [f64; 2] {
    let time = |value: &ModulusPoint| match value.kind {
        Modulus::Relaxation => value.at,
        _ => value.at.recip(),
    };
    values.iter().map(time).fold([f64::INFINITY, 0.0], |[a, b]: [f64; 2], t| [a.min(t), b.max(t)])
}

/// Series of a grid of times over those of the data, half a decade wider.
fn on_grid(values: &[ModulusPoint], per_decade: usize) -> Prony {
    let [least, most] = times_of(values);
    let first = least.log10() - 0.5;
    let count = ((most.log10() + 0.5 - first) * per_decade as f64).ceil() as usize + 1;
    let times: Vec<f64> = (0..count).map(|k| 10_f64.powf(first + k as f64 / per_decade as f64)).collect();
    let entry = |i: usize, j: usize| {
        let value = &values[i];
        let unit = if j == 0 { value.rest() } else { value.unit(times[j - 1])[0] };
        value.weight * unit / value.measured
    };
    // columns of one length: moduli of any unit
    let matrix = DMatrix::from_fn(values.len(), count + 1, entry);
    let lengths: Vec<f64> = matrix.column_iter().map(|c| c.norm().max(f64::MIN_POSITIVE)).collect();
    let scaled = DMatrix::from_fn(values.len(), count + 1, |i, j| matrix[(i, j)] / lengths[j]);
    let weights = DVector::from_fn(values.len(), |i, _| values[i].weight);
    let found = nonnegative_least_squares(&scaled, &weights).unwrap_or_else(|| DVector::zeros(count + 1));
    let modulus = |j: usize| found[j] / lengths[j];
    let terms = (0..count).filter(|&k| found[k + 1] > 0.0);
    Prony {
        equilibrium: modulus(0),
        terms: terms.map(|k| PronyTerm { modulus: modulus(k + 1), time: times[k] }).collect(),
    }
}

/// Merges the pair of neighbours whose moments change least, until there are at most so many terms: a gap of
/// the grid keeps its two terms, one time between two points of the grid becomes one term.
fn merged(mut series: Prony, most: usize) -> Prony {
    // neighbours of the grid, closer than a factor of 4, that are alone stand for one time between them
    let mut k = 0;
    while k + 1 < series.terms.len() {
        let gap = |k: usize| series.terms[k + 1].time / series.terms[k].time;
        let alone = (k == 0 || gap(k - 1) > 4.0) && (k + 2 >= series.terms.len() || gap(k + 1) > 4.0);
        if gap(k) < 4.0 && alone {
            merge(&mut series, k);
        }
        k += 1;
    }
    while series.terms.len() > most.max(1) {
        let cost = |k: usize| {
            let [a, b] = [series.terms[k], series.terms[k + 1]];
            a.modulus * b.modulus / (a.modulus + b.modulus) * (b.time / a.time).ln().powi(2)
        };
        let pairs = 0..series.terms.len() - 1;
        let Some(least) = pairs.min_by(|&i, &j| cost(i).total_cmp(&cost(j))) else { break };
        merge(&mut series, least);
    }
    series
}

/// Replaces terms k and k + 1 by one with their sum, at the mean of ln τ.
fn merge(series: &mut Prony, k: usize) {
    let [a, b] = [series.terms[k], series.terms[k + 1]];
    let modulus = a.modulus + b.modulus;
    let time = ((a.modulus * a.time.ln() + b.modulus * b.time.ln()) / modulus).exp();
    series.terms[k] = PronyTerm { modulus, time };
    series.terms.remove(k + 1);
}

/// Refines the logarithms of all constants, relaxation times within a decade of those of the data: beyond,
/// only ντ or ν of a term is determined. Returns the Jacobian of the relative deviations by the logarithms,
/// too.
fn refined(values: &[ModulusPoint], start: Prony) -> (Prony, DMatrix<f64>) {
    let has_rest = start.equilibrium > 0.0;
    let offset = usize::from(has_rest);
    let series = |q: &DVector<f64>| {
        let term =
            |k: usize| PronyTerm { modulus: q[offset + 2 * k].exp(), time: q[offset + 2 * k + 1].exp() };
        Prony {
            equilibrium: if has_rest { q[0].exp() } else { 0.0 },
            terms: (0..(q.len() - offset) / 2).map(term).collect(),
        }
    };
    let [least, most] = times_of(values);
    let allowed = 0.1 * least..=10.0 * most;
    let residuals = |q: &DVector<f64>| {
        let series = series(q);
        if !series.terms.iter().all(|term| allowed.contains(&term.time)) {
            return Some(DVector::repeat(values.len(), REJECTED));
        }
        let found = values.iter().map(|v| v.weight * (model(&series, v) / v.measured - 1.0));
        Some(DVector::from_iterator(values.len(), found))
    };
    let jacobian = |q: &DVector<f64>| {
        let series = series(q);
        Some(DMatrix::from_fn(values.len(), q.len(), |i, j| {
            let value = &values[i];
            let slope = if j < offset {
                series.equilibrium * value.rest()
            } else {
                let term = series.terms[(j - offset) / 2];
                term.modulus * value.unit(term.time)[(j - offset) % 2]
            };
            value.weight * slope / value.measured
        }))
    };
    let mut q = Vec::new();
    if has_rest {
        q.push(start.equilibrium.ln());
    }
    q.extend(start.terms.iter().flat_map(|term| [term.modulus.ln(), term.time.ln()]));
    let before = residuals(&DVector::from_vec(q.clone())).map_or(f64::INFINITY, |r| r.norm_squared());
    let from = DVector::from_vec(q);
    let end = levenberg_marquardt(from.clone(), 5, residuals, jacobian).at;
    let after = residuals(&end).map_or(f64::NAN, |r| r.norm_squared());
    let mut best = if after <= before { end } else { from };
    let mut terms: Vec<[f64; 2]> = best.as_slice()[offset..].chunks_exact(2).map(|q| [q[0], q[1]]).collect();
    terms.sort_by(|a, b| a[1].total_cmp(&b[1]));
    best.as_mut_slice()[offset..].copy_from_slice(terms.as_flattened());
    let slopes = jacobian(&best).unwrap_or_else(|| DMatrix::zeros(values.len(), best.len()));
    (series(&best), slopes)
}
