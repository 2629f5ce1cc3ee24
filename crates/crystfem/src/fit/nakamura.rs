//! Nakamura's theory with the rate of Hoffman and Lauritzen, fitted to any temperature histories.

use super::least_squares::{STEP, minimize};
use super::{Estimate, KineticFit, check, check_finite};
use crate::error::Error;
use crate::kinetics::{GAS_CONSTANT, KineticConstants, Kinetics};
use std::f64::consts::LN_2;

/// Temperature step, K, for the integration of K: the error in α is below 1e-7.
const INTEGRATION_STEP: f64 = 1.0;

/// Constants that are not fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixedConstants {
    /// Equilibrium melting temperature T₀, K.
    pub equilibrium_melting: f64,
    /// Temperature T∞ of frozen chains, K.
    pub frozen: f64,
    /// Activation energy U, J/mol.
    pub activation_energy: f64,
}

impl FixedConstants {
    /// Returns the kinetics with K₀, 1/s, K_G, K², and n.
    ///
    /// # Errors
    /// [`Error::Parameter`] for constants out of their domain.
    pub fn kinetics(
        &self,
        growth_rate: f64,
        nucleation: f64,
        avrami_exponent: f64,
    ) -> Result<Kinetics, Error> {
        Kinetics::new(KineticConstants {
            growth_rate,
            nucleation,
            activation_energy: self.activation_energy,
            equilibrium_melting: self.equilibrium_melting,
            frozen: self.frozen,
            avrami_exponent,
        })
    }
}

/// A measurement: α along a temperature history that begins in the melt.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Times, s, increasing.
    pub times: Vec<f64>,
    /// Temperatures, K, linear in between.
    pub temperatures: Vec<f64>,
    /// Measured α.
    pub degrees: Vec<f64>,
    /// History before the first measurement: times, s, increasing, and temperatures, K, linear in between.
    pub history: Vec<[f64; 2]>,
}

impl Run {
    /// Returns a measurement at a constant cooling rate, K/s, from T₀.
    ///
    /// # Errors
    /// [`Error::Data`] unless the rate is above 0 and the temperatures, K, fall from T₀ or below.
    pub fn cooling(
        rate: f64,
        temperatures: Vec<f64>,
        degrees: Vec<f64>,
        known: &FixedConstants,
    ) -> Result<Self, Error> {
        let refuse = |reason: String| Err(Error::Data { what: "cooling curve".to_owned(), reason });
        if !(rate > 0.0 && rate.is_finite()) {
            return refuse(format!("cooling rate {rate} K/s; allowed: above 0"));
        }
        let start = temperatures.iter().fold(known.equilibrium_melting, |high, &t| high.max(t));
        let mut before = f64::INFINITY;
        for (row, &temperature) in temperatures.iter().enumerate() {
            if !(temperature <= before && temperature.is_finite()) {
                let allowed = format!("allowed: {before} or below, on cooling");
                return refuse(format!("measurement {}: temperature = {temperature} K; {allowed}", row + 1));
            }
            before = temperature;
        }
        let times = temperatures.iter().map(|t| (start - t) / rate).collect();
        Ok(Self { times, temperatures, degrees, history: vec![[0.0, start]] })
    }

    /// z at each measurement.
    pub(super) fn integrals(&self, kinetics: &Kinetics) -> Vec<f64> {
        let rows = self.times.iter().zip(&self.temperatures).map(|(&time, &temperature)| [time, temperature]);
        let mut all = self.history.iter().copied().chain(rows);
        let Some([mut time, mut temperature]) = all.next() else { return Vec::new() };
        let mut z = 0.0;
        let mut found: Vec<f64> = if self.history.is_empty() { vec![z] } else { Vec::new() };
        let later = all.map(|[next, end]| {
            let parts = ((end - temperature).abs() / INTEGRATION_STEP).ceil().clamp(1.0, 1000.0);
            for part in 0..parts as usize {
                let [a, b] = [part, part + 1].map(|k| temperature + (end - temperature) * (k as f64 / parts));
                z += kinetics.growth(a, b, (next - time) / parts).z;
            }
            (time, temperature) = (next, end);
            z
        });
        found.extend(later.skip(self.history.len().saturating_sub(1)));
        found
    }

    fn check(&self, what: &str) -> Result<(), Error> {
        let rows = self.degrees.len();
        if self.times.len() != rows || self.temperatures.len() != rows {
            let (times, temperatures) = (self.times.len(), self.temperatures.len());
            let reason = format!("{times} times, {temperatures} temperatures and {rows} values of alpha");
            return Err(Error::Data { what: what.to_owned(), reason });
        }
        check_finite(what, "time (s)", &self.times, f64::MIN)?;
        check_finite(what, "temperature (K)", &self.temperatures, 0.0)?;
        let [times, temperatures] = [0, 1].map(|k| self.history.iter().map(|row| row[k]).collect::<Vec<_>>());
        check_finite(what, "time (s) of the history", &times, f64::MIN)?;
        check_finite(what, "temperature (K) of the history", &temperatures, 0.0)?;
        if let Some(row) = (1..times.len()).find(|&row| times[row] < times[row - 1]) {
            let (time, before) = (times[row], times[row - 1]);
            let reason =
                format!("row {} of the history: time = {time} s; allowed: {before} or later", row + 1);
            return Err(Error::Data { what: what.to_owned(), reason });
        }
        let mut before = times.last().copied().unwrap_or(f64::NEG_INFINITY);
        for (row, &time) in self.times.iter().enumerate() {
            if time < before {
                let reason = format!("measurement {}: time = {time} s; allowed: {before} or later", row + 1);
                return Err(Error::Data { what: what.to_owned(), reason });
            }
            before = time;
        }
        Ok(())
    }
}

/// Fits K₀, K_G and n of Eqs (4.4), (4.6) and (4.7) to α along temperature histories.
///
/// Estimates: `growth_rate` K₀ in 1/s, `nucleation` K_G in K², `avrami_exponent` n.
///
/// # Errors
/// [`Error::Data`] as for [`avrami`](super::avrami), for times that decrease, and data that do not determine
/// all three (one isothermal run, for example); [`Error::Parameter`] for known constants out of their domain.
pub fn nakamura(runs: &[Run], known: &FixedConstants) -> Result<KineticFit, Error> {
    let what = "fit of Nakamura's and Hoffman–Lauritzen's constants";
    for run in runs {
        run.check(what)?;
    }
    let degrees: Vec<f64> = runs.iter().flat_map(|run| run.degrees.iter().copied()).collect();
    check(what, &degrees, 3)?;
    known.kinetics(1.0, 1.0, 2.0)?;
    let Some(middle) = middle(runs, known) else {
        let reason =
            "no alpha between 0.01 and 0.99 at a temperature between that of frozen chains and melting";
        return Err(Error::Data { what: what.to_owned(), reason: reason.to_owned() });
    };
    // parameters: ln of K at the middle, of K_G and of n. K₀ itself would be nearly collinear with K_G.
    let barrier = {
        let (t, t0) = (middle, known.equilibrium_melting);
        (t + t0) / (2.0 * t * t * (t0 - t))
    };
    let jump = known.activation_energy / (GAS_CONSTANT * (middle - known.frozen));
    let logarithm = |q: &[f64]| q[0] + jump + q[1].exp() * barrier - LN_2.ln() / q[2].exp();
    let kinetics = |q: &[f64]| known.kinetics(logarithm(q).exp(), q[1].exp(), q[2].exp()).ok();
    let model = |kinetics: &Kinetics| -> Vec<f64> {
        runs.iter().flat_map(|run| run.integrals(kinetics)).map(|z| kinetics.degree(z)).collect()
    };
    let residuals = |q: &[f64]| -> Option<Vec<f64>> {
        let found = model(&kinetics(q)?);
        Some(found.iter().zip(&degrees).map(|(model, data)| model - data).collect())
    };
    // z at α = 1/2 is (ln 2)^{1/n}, and z is proportional to K at the middle
    let half = (0..degrees.len())
        .min_by(|&a, &b| (degrees[a] - 0.5).abs().total_cmp(&(degrees[b] - 0.5).abs()))
        .unwrap_or(0);
    let scale = known.equilibrium_melting.powi(2);
    let mut starts = Vec::new();
    for nucleation in [0.1, 0.3, 0.6, 1.2, 2.4].map(|part: f64| part * scale) {
        let mut start = vec![0.0, nucleation.ln(), 2.5_f64.ln()];
        let Some(unit) = kinetics(&start) else { continue };
        let z = runs.iter().flat_map(|run| run.integrals(&unit)).nth(half).unwrap_or(0.0);
        if z > 0.0 && z.is_finite() {
            start[0] = (LN_2.powf(0.4) / z).ln();
            starts.push(start);
        }
    }
    let minimum = minimize(what, &residuals, degrees.len(), &starts, STEP)?;
    let q = &minimum.parameters;
    let gradient = [1.0, q[1].exp() * barrier, LN_2.ln() / q[2].exp()];
    let estimate = |name, unit: &str, value: f64, gradient: [f64; 3]| {
        Estimate::of_logarithm(name, unit, value, minimum.error_of(&gradient), minimum.degrees)
    };
    Ok(KineticFit {
        estimates: vec![
            estimate("growth_rate", "1/s", logarithm(q), gradient),
            estimate("nucleation", "K^2", q[1], [0.0, 1.0, 0.0]),
            estimate("avrami_exponent", "", q[2], [0.0, 0.0, 1.0]),
        ],
        draws: minimum.draws(|q| vec![logarithm(q).exp(), q[1].exp(), q[2].exp()]),
        rms: minimum.rms(),
        measurements: degrees.len(),
        evaluations: minimum.evaluations,
        model: minimum.residuals.iter().zip(&degrees).map(|(residual, data)| residual + data).collect(),
    })
}

/// Returns the mean temperature of measurements with 0.01 ≤ α ≤ 0.99 between T∞ and T₀.
fn middle(runs: &[Run], known: &FixedConstants) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for run in runs {
        for (&temperature, &degree) in run.temperatures.iter().zip(&run.degrees) {
            let inside = temperature > known.frozen && temperature < known.equilibrium_melting;
            if inside && (0.01..=0.99).contains(&degree) {
                sum += temperature;
                count += 1.0;
            }
        }
    }
    (count > 0.0).then(|| sum / count)
}
