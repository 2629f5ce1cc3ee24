//! Fits of kinetic constants to measurements, by least squares in α, with 95 % confidence intervals.

mod avrami;
mod forecast;
mod heat_flow;
mod least_squares;
mod nakamura;
mod ozawa;
mod part;
mod student;
mod thermogram;

pub use avrami::avrami;
pub use forecast::{ForecastRow, SHARES, forecast};
pub use heat_flow::{Baseline, Peak, interpolate};
pub use nakamura::{FixedConstants, Run, nakamura};
pub use ozawa::{Cooling, ozawa, rates_at};
pub use part::fit_in_part;
pub use student::quantile;
pub use thermogram::{MeasuredPeak, Thermogram};

use crate::error::Error;

/// A fitted law.
#[derive(Clone, Debug, PartialEq)]
pub struct KineticFit {
    /// Fitted constants.
    pub estimates: Vec<Estimate>,
    /// Draws of all constants from their posterior ([`polycore::posterior`]).
    pub draws: Vec<Vec<f64>>,
    /// Root mean square of model minus measurement, in α.
    pub rms: f64,
    /// Number of measurements.
    pub measurements: usize,
    /// Number of evaluations of all residuals, without those for derivatives.
    pub evaluations: usize,
    /// α of the model at the measurements.
    pub model: Vec<f64>,
}

/// A constant with its uncertainty, for independent errors of equal but unknown variance in α.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Name.
    pub name: &'static str,
    /// SI unit.
    pub unit: String,
    /// Best estimate.
    pub value: f64,
    /// Standard error.
    pub standard_error: f64,
    /// Interval with the true value at a probability of 95 %, if the law is nearly linear within it.
    pub interval: [f64; 2],
}

impl KineticFit {
    /// Returns an estimate by name.
    pub fn get(&self, name: &str) -> Option<&Estimate> {
        self.estimates.iter().find(|estimate| estimate.name == name)
    }
}

impl Estimate {
    /// Returns the estimate of a positive constant from its logarithm and the standard error of that; the
    /// interval is symmetric in the logarithm.
    fn of_logarithm(name: &'static str, unit: &str, logarithm: f64, error: f64, degrees: usize) -> Self {
        let (value, reach) = (logarithm.exp(), quantile(degrees) * error);
        Self {
            name,
            unit: unit.to_owned(),
            value,
            standard_error: value * error,
            interval: [(logarithm - reach).exp(), (logarithm + reach).exp()],
        }
    }
}

/// Accepted range of measured α: noise exceeds 0 and 1, and clipping would bias the fit.
pub const DEGREES: [f64; 2] = [-0.2, 1.2];

/// Checks the measured α for a fit of `parameters` parameters.
fn check(what: &str, degrees: &[f64], parameters: usize) -> Result<(), Error> {
    let refuse = |reason: String| Err(Error::Data { what: what.to_owned(), reason });
    let [least, most] = DEGREES;
    if let Some((row, bad)) = degrees.iter().enumerate().find(|(_, a)| !(least..=most).contains(*a)) {
        return refuse(format!("measurement {}: alpha = {bad}; allowed: {least} to {most}", row + 1));
    }
    if degrees.len() <= parameters {
        let count = degrees.len();
        return refuse(format!(
            "{count} measurements for {parameters} parameters; allowed: at least {}",
            parameters + 1
        ));
    }
    let within = degrees.iter().filter(|a| (0.01..=0.99).contains(*a)).count();
    if within < parameters {
        return refuse(format!(
            "{within} measurements of alpha between 0.01 and 0.99; allowed: at least {parameters}, as many \
             as parameters"
        ));
    }
    let [low, high] = degrees.iter().fold([1.0_f64, 0.0_f64], |[low, high], &a| [low.min(a), high.max(a)]);
    if high - low < 0.01 {
        return refuse(format!("alpha is constant, {low} to {high}; allowed: a range of at least 0.01"));
    }
    Ok(())
}

/// Checks that a column is finite and at least `least`.
fn check_finite(what: &str, name: &str, values: &[f64], least: f64) -> Result<(), Error> {
    match values.iter().enumerate().find(|(_, x)| !(x.is_finite() && **x >= least)) {
        None => Ok(()),
        Some((row, bad)) => Err(Error::Data {
            what: what.to_owned(),
            reason: format!("measurement {}: {name} = {bad}; allowed: finite, {least} or above", row + 1),
        }),
    }
}

#[cfg(test)]
mod tests;
