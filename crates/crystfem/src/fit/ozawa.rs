//! Ozawa's law of crystallization at constant cooling rates.

use super::least_squares::{STEP, minimize};
use super::{Estimate, KineticFit, check, check_finite};
use crate::error::Error;

/// α over temperature at a constant cooling rate.
#[derive(Clone, Debug, PartialEq)]
pub struct Cooling {
    /// Cooling rate q, K/s.
    pub rate: f64,
    /// Temperatures, K, falling.
    pub temperatures: Vec<f64>,
    /// Measured α.
    pub degrees: Vec<f64>,
}

impl Cooling {
    /// Interpolates α at a temperature; `None` outside the measurements.
    fn degree_at(&self, temperature: f64) -> Option<f64> {
        (1..self.temperatures.len()).find_map(|i| {
            let [above, below] = [self.temperatures[i - 1], self.temperatures[i]];
            let within = below <= temperature && temperature <= above;
            let share = if above > below { (above - temperature) / (above - below) } else { 0.0 };
            within.then(|| self.degrees[i - 1] + share * (self.degrees[i] - self.degrees[i - 1]))
        })
    }
}

/// Returns the rates, K/s, of the curves with 0.01 ≤ α ≤ 0.99 at a temperature, and α there.
pub fn rates_at(coolings: &[Cooling], temperature: f64) -> (Vec<f64>, Vec<f64>) {
    let found = |cooling: &Cooling| {
        let degree = cooling.degree_at(temperature).filter(|a| (0.01..=0.99).contains(a))?;
        Some((cooling.rate, degree))
    };
    coolings.iter().filter_map(found).unzip()
}

/// Fits α = 1 − exp(−χ/qᵐ) at one temperature to α at several cooling rates. This is Ozawa's form, DOI
/// 10.1016/0032-3861(71)90041-3; Eq. (4.3) writes ψ^m for q^{−m}. By Nakamura's theory m = n.
///
/// Estimates: `ozawa_exponent` m, `cooling_function` χ in (K/s)ᵐ.
///
/// # Errors
/// [`Error::Data`] for rates that are not above 0, fewer than three rates with 0.01 ≤ α ≤ 0.99 at this
/// temperature, and data that do not determine both constants.
pub fn ozawa(coolings: &[Cooling], temperature: f64) -> Result<KineticFit, Error> {
    let what = format!("fit of Ozawa's law at {temperature} K ({:.2} degC)", temperature - 273.15);
    let refuse = |reason: String| Error::Data { what: what.clone(), reason };
    for cooling in coolings {
        check_finite(&what, "temperature (K)", &cooling.temperatures, 0.0)?;
        check_finite(&what, "alpha", &cooling.degrees, super::DEGREES[0])?;
        if cooling.degrees.len() != cooling.temperatures.len() {
            let [degrees, temperatures] = [cooling.degrees.len(), cooling.temperatures.len()];
            return Err(refuse(format!("{temperatures} temperatures and {degrees} values of alpha")));
        }
        if !(cooling.rate > 0.0 && cooling.rate.is_finite()) {
            return Err(refuse(format!("cooling rate {} K/s; allowed: above 0", cooling.rate)));
        }
    }
    let (rates, degrees) = rates_at(coolings, temperature);
    if rates.len() < 3 {
        let found = rates.len();
        return Err(refuse(format!(
            "{found} rates with alpha between 0.01 and 0.99 there; allowed: at least 3"
        )));
    }
    check(&what, &degrees, 2)?;
    // parameters: m and ln χ − m ln q̄, with the geometric mean q̄, to be nearly uncorrelated
    let middle = rates.iter().map(|q| q.ln()).sum::<f64>() / rates.len() as f64;
    let model = |p: &[f64]| -> Vec<f64> {
        rates.iter().map(|q| -(-(p[1] - p[0] * (q.ln() - middle)).exp()).exp_m1()).collect()
    };
    let residuals = |p: &[f64]| -> Option<Vec<f64>> {
        let found: Vec<f64> = model(p).iter().zip(&degrees).map(|(model, data)| model - data).collect();
        found.iter().all(|r| r.is_finite()).then_some(found)
    };
    // initial values: a straight line of ln(−ln(1−α)) over ln q
    let points: Vec<[f64; 2]> =
        rates.iter().zip(&degrees).map(|(q, a)| [q.ln() - middle, (-(-a).ln_1p()).ln()]).collect();
    let squares: f64 = points.iter().map(|p| p[0] * p[0]).sum();
    if squares < 1e-6 {
        return Err(refuse("all cooling rates are the same; allowed: different ones".to_owned()));
    }
    let slope = points.iter().map(|p| p[0] * p[1]).sum::<f64>() / squares;
    let mean = points.iter().map(|p| p[1]).sum::<f64>() / points.len() as f64;
    let minimum = minimize(&what, &residuals, rates.len(), &[vec![-slope, mean]], STEP)?;
    let [exponent, level] = [minimum.parameters[0], minimum.parameters[1]];
    let error = minimum.error_of(&[1.0, 0.0]);
    let reach = super::quantile(minimum.degrees) * error;
    let estimates = vec![
        Estimate {
            name: "ozawa_exponent",
            unit: String::new(),
            value: exponent,
            standard_error: error,
            interval: [exponent - reach, exponent + reach],
        },
        Estimate::of_logarithm(
            "cooling_function",
            "(K/s)^m",
            level + exponent * middle,
            minimum.error_of(&[middle, 1.0]),
            minimum.degrees,
        ),
    ];
    Ok(KineticFit {
        estimates,
        draws: minimum.draws(|p| vec![p[0], (p[1] + p[0] * middle).exp()]),
        rms: minimum.rms(),
        measurements: rates.len(),
        evaluations: minimum.evaluations,
        model: model(&minimum.parameters),
    })
}
