//! Avrami's law of isothermal crystallization.

use super::least_squares::{STEP, minimize};
use super::{Estimate, KineticFit, check, check_finite};
use crate::error::Error;
use crate::kinetics;
use std::f64::consts::LN_2;

/// Fits α = 1 − exp(−k tⁿ), Eq. (4.2), to times, s, from the start of crystallization, and α.
///
/// Estimates: `half_time` t_½ in s, `avrami_exponent` n, `rate_constant` k = ln 2/t_½ⁿ in s⁻ⁿ.
///
/// # Errors
/// [`Error::Data`] for columns of different lengths, negative times, α outside [`super::DEGREES`], NaN, too
/// few or constant measurements, and data that do not determine both constants.
pub fn avrami(times: &[f64], degrees: &[f64]) -> Result<KineticFit, Error> {
    let what = "fit of Avrami's law";
    if times.len() != degrees.len() {
        let reason = format!("{} times and {} values of alpha", times.len(), degrees.len());
        return Err(Error::Data { what: what.to_owned(), reason });
    }
    check_finite(what, "time (s)", times, 0.0)?;
    check(what, degrees, 2)?;
    // parameters: ln t_½ and ln n
    let model = |q: &[f64]| -> Vec<f64> {
        times.iter().map(|&t| kinetics::avrami(t, q[0].exp(), q[1].exp())).collect()
    };
    let residuals = |q: &[f64]| -> Option<Vec<f64>> {
        let valid = q[0].abs() < 200.0 && q[1].abs() < 5.0;
        valid.then(|| model(q).iter().zip(degrees).map(|(model, data)| model - data).collect())
    };
    let near = (0..times.len())
        .filter(|&i| times[i] > 0.0)
        .min_by(|&a, &b| (degrees[a] - 0.5).abs().total_cmp(&(degrees[b] - 0.5).abs()));
    let Some(near) = near else {
        return Err(Error::Data { what: what.to_owned(), reason: "no time above 0 s".to_owned() });
    };
    let half = |n: f64| {
        let power = -(-degrees[near].clamp(1e-3, 1.0 - 1e-3)).ln_1p() / LN_2;
        times[near].ln() - power.ln() / n
    };
    let starts: Vec<Vec<f64>> = [1.0, 2.5, 4.0].iter().map(|&n: &f64| vec![half(n), n.ln()]).collect();
    let minimum = minimize(what, &residuals, times.len(), &starts, STEP)?;
    let [half, exponent] = [minimum.parameters[0], minimum.parameters[1]];
    let n = exponent.exp();
    // ln k = ln ln 2 − n ln t_½
    let estimate = |name, unit: &str, value: f64, gradient: [f64; 2]| {
        Estimate::of_logarithm(name, unit, value, minimum.error_of(&gradient), minimum.degrees)
    };
    Ok(KineticFit {
        estimates: vec![
            estimate("half_time", "s", half, [1.0, 0.0]),
            estimate("avrami_exponent", "", exponent, [0.0, 1.0]),
            estimate("rate_constant", "s^-n", LN_2.ln() - n * half, [-n, -n * half]),
        ],
        draws: minimum.draws(|q| {
            let n = q[1].exp();
            vec![q[0].exp(), n, (LN_2.ln() - n * q[0]).exp()]
        }),
        rms: minimum.rms(),
        measurements: times.len(),
        evaluations: minimum.evaluations,
        model: model(&minimum.parameters),
    })
}
