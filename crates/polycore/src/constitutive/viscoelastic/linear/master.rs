//! Master curves: isotherms shifted along the logarithm of frequency, and their WLF constants.

use nalgebra::{DMatrix, DVector};

use super::super::Shift;
use crate::constitutive::Error;
use crate::numerics::least_squares::levenberg_marquardt;

/// Frequency sweep at one temperature.
#[derive(Debug, Clone, PartialEq)]
pub struct Isotherm {
    /// Temperature, K.
    pub temperature: f64,
    /// Frequency, Hz, storage and loss modulus, Pa; in the order of frequency.
    pub points: Vec<[f64; 3]>,
}

/// WLF constants of shifts.
#[derive(Debug, Clone, PartialEq)]
pub struct WlfFit {
    /// The shift, at the reference temperature of the isotherms.
    pub shift: Shift,
    /// Root mean square of model minus data, in log₁₀ a_T.
    pub rms: f64,
    /// Number of temperatures, those from the reference on.
    pub count: usize,
}

/// Computes log₁₀ a_T of isotherms, in their order, 0 at that whose temperature is closest to `reference`,
/// K. From there, each isotherm is moved by the mean distance of its storage modulus from that of its
/// neighbour, in log₁₀ of frequency at equal modulus, over the range of moduli that both have. The loss does
/// not enter: in a glass it is the loss of the instrument. Where neighbours have no modulus in common, the
/// chords of their ends are prolonged.
///
/// # Errors
/// [`Error::Data`] for no isotherm, fewer than three points in one, or moduli that are not above 0.
pub fn shift_isotherms(isotherms: &[Isotherm], reference: f64) -> Result<Vec<f64>, Error> {
    for Isotherm { temperature, points } in isotherms {
        let refuse =
            |reason: String| Err(Error::Data { what: format!("isotherm at {temperature} K"), reason });
        if points.len() < 3 {
            return refuse(format!("{} points; it needs three or more", points.len()));
        }
        let positive = |point: &&[f64; 3]| !point.iter().all(|x| *x > 0.0 && x.is_finite());
        if let Some([f, storage, loss]) = points.iter().find(positive) {
            return refuse(format!("storage {storage} and loss {loss} Pa at {f} Hz must be above 0"));
        }
        if points.windows(2).any(|pair| pair[1][0] <= pair[0][0]) {
            return refuse("frequencies must increase".to_owned());
        }
    }
    let mut order: Vec<usize> = (0..isotherms.len()).collect();
    order.sort_by(|a, b| isotherms[*a].temperature.total_cmp(&isotherms[*b].temperature));
    let away = |i: usize| (isotherms[order[i]].temperature - reference).abs();
    let Some(start) = (0..order.len()).min_by(|a, b| away(*a).total_cmp(&away(*b))) else {
        return Err(Error::Data { what: "isotherms".to_owned(), reason: "none given".to_owned() });
    };
    let mut shifts = vec![0.0; isotherms.len()];
    let up = (start + 1..order.len()).map(|k| (k - 1, k));
    let down = (0..start).rev().map(|k| (k + 1, k));
    for (known, next) in up.chain(down) {
        let [known, next] = [order[known], order[next]];
        shifts[next] = shifts[known] + relative_shift(&isotherms[known], &isotherms[next]);
    }
    Ok(shifts)
}

/// log₁₀ of the factor on the frequencies of `next` that lays it on `known`.
fn relative_shift(known: &Isotherm, next: &Isotherm) -> f64 {
    let curve = |isotherm: &Isotherm| -> Vec<[f64; 2]> {
        let mut points: Vec<[f64; 2]> =
            isotherm.points.iter().map(|point| [point[1].ln(), point[0].log10()]).collect();
        // scatter: a modulus that falls with frequency
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        points
    };
    let (known, next) = (curve(known), curve(next));
    let [low, high] = [known[0][0].max(next[0][0]), known[known.len() - 1][0].min(next[next.len() - 1][0])];
    // midpoints of equal parts of the common range; of a gap, its middle alone
    let count = if high > low { LEVELS } else { 1 };
    let level = |k: usize| low + (high - low) * (k as f64 + 0.5) / count as f64;
    let distance = |k: usize| interpolate(&known, level(k)) - interpolate(&next, level(k));
    (0..count).map(distance).sum::<f64>() / count as f64
}

/// Number of moduli at which two sweeps are compared.
const LEVELS: usize = 64;

/// log₁₀ of the frequency of a modulus, linear in its logarithm; beyond the ends on the last chord.
fn interpolate(curve: &[[f64; 2]], level: f64) -> f64 {
    let after = curve.partition_point(|point| point[0] < level).clamp(1, curve.len() - 1);
    let [a, b] = [curve[after - 1], curve[after]];
    let rise = b[0] - a[0];
    if rise > 0.0 { a[1] + (b[1] - a[1]) * (level - a[0]) / rise } else { 0.5 * (a[1] + b[1]) }
}

/// Fits the WLF constants to [temperature (K), log₁₀ a_T] from the reference on: below the glass transition
/// the equation does not hold.
///
/// # Errors
/// [`Error::Data`] for fewer than three temperatures above the reference; [`Error::NoConvergence`] if no
/// constants above 0 fit.
pub fn fit_wlf(shifts: &[[f64; 2]], reference: f64) -> Result<WlfFit, Error> {
    let above: Vec<[f64; 2]> =
        shifts.iter().map(|s| [s[0] - reference, s[1]]).filter(|s| s[0] > 0.0).collect();
    if above.len() < 3 {
        let reason = format!("{} temperatures above {reference} K; three or more are needed", above.len());
        return Err(Error::Data { what: "fit of WLF constants".to_owned(), reason });
    }
    let residuals = |q: &DVector<f64>| {
        let [first, second] = [q[0].exp(), q[1].exp()];
        let found = above.iter().map(|[x, log]| -first * x / (second + x) - log);
        Some(DVector::from_iterator(above.len(), found))
    };
    let jacobian = |q: &DVector<f64>| {
        let [first, second] = [q[0].exp(), q[1].exp()];
        Some(DMatrix::from_fn(above.len(), 2, |i, j| {
            let x = above[i][0];
            if j == 0 { -first * x / (second + x) } else { first * second * x / (second + x).powi(2) }
        }))
    };
    // universal constants
    let start = DVector::from_vec(vec![17.44_f64.ln(), 51.6_f64.ln()]);
    let end = levenberg_marquardt(start, 100, residuals, jacobian);
    let rms = (2.0 * end.objective / above.len() as f64).sqrt();
    if !rms.is_finite() {
        return Err(Error::NoConvergence { iteration: "the WLF constants", steps: 100, residual: rms });
    }
    let shift = Shift::Wlf { reference, constants: [end.at[0].exp(), end.at[1].exp()] };
    Ok(WlfFit { shift, rms, count: above.len() })
}
