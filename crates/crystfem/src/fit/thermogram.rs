//! Thermograms of a calorimeter, as measurements for a fit.

use super::{Baseline, Peak, Run, interpolate};
use crate::error::Error;

/// A measured heat flow.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Thermogram {
    /// Times, s, ascending.
    pub times: Vec<f64>,
    /// Temperatures, K; empty for an isothermal run.
    pub temperatures: Vec<f64>,
    /// Heat flow given off by the sample, W/kg.
    pub flows: Vec<f64>,
}

/// A peak and the temperatures around it.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredPeak {
    /// Peak between the limits.
    pub peak: Peak,
    /// Temperatures of the peak, K; empty for an isothermal run.
    pub temperatures: Vec<f64>,
    /// Times, s, and temperatures, K, of earlier rows, from the last one above melting.
    pub history: Vec<[f64; 2]>,
}

impl Thermogram {
    /// Returns the first time from `start` on, s, at which cooling passes a temperature, K.
    pub fn first_crossing(&self, temperature: f64, start: f64) -> Option<f64> {
        (1..self.temperatures.len()).find_map(|row| {
            let [above, below] = [self.temperatures[row - 1], self.temperatures[row]];
            let share = (above - temperature) / (above - below);
            let time = self.times[row - 1] + share * (self.times[row] - self.times[row - 1]);
            (above >= temperature && temperature >= below && above > below && time >= start).then_some(time)
        })
    }

    /// Integrates the peak between two times, s, of a material that cannot crystallize at or above `melting`,
    /// K.
    ///
    /// # Errors
    /// Errors of [`Peak::integrate`].
    pub fn peak(&self, limits: [f64; 2], baseline: Baseline, melting: f64) -> Result<MeasuredPeak, Error> {
        let peak = Peak::integrate(&self.times, &self.flows, limits, baseline)?;
        let along = |time: &f64| interpolate(&self.times, &self.temperatures, *time);
        let temperatures = match self.temperatures.is_empty() {
            true => Vec::new(),
            false => peak.times.iter().map(along).collect(),
        };
        let rows = self.times.iter().zip(&self.temperatures).map(|(&time, &kelvin)| [time, kelvin]);
        let mut history: Vec<[f64; 2]> = rows.take_while(|[time, _]| *time <= limits[0]).collect();
        let molten = history.iter().rposition(|[_, kelvin]| *kelvin >= melting).unwrap_or(0);
        history.drain(..molten);
        Ok(MeasuredPeak { peak, temperatures, history })
    }
}

impl MeasuredPeak {
    /// Returns the measurement for [`nakamura`](super::nakamura).
    pub fn run(&self) -> Run {
        Run {
            times: self.peak.times.clone(),
            temperatures: self.temperatures.clone(),
            degrees: self.peak.degrees.clone(),
            history: self.history.clone(),
        }
    }
}
