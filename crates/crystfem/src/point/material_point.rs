//! A material along a piecewise linear temperature history.

use crate::error::Error;
use crate::material::{PointInput, ThermalMaterial};
use nalgebra::Vector3;

/// Largest change of temperature in a step, K.
const STEP: f64 = 0.25;
/// Limit on steps between two times.
const MAX_STEPS: f64 = 10_000.0;

/// A material point, and the temperatures at which its first field, α, reached `N` values.
#[derive(Clone, Debug)]
pub struct MaterialPoint<const N: usize> {
    /// Temperature, K.
    pub temperature: f64,
    /// States of the material.
    pub state: Vec<f64>,
    /// Fields of the material.
    pub fields: Vec<f64>,
    /// Temperature at which each of the values was reached, K; NaN before.
    pub reached: [f64; N],
    values: [f64; N],
}

impl<const N: usize> MaterialPoint<N> {
    /// Returns fresh material at a temperature, K.
    pub fn new(material: &dyn ThermalMaterial, temperature: f64, values: [f64; N]) -> Self {
        let mut state = vec![0.0; material.state_names().len()];
        material.initial_state(temperature, &mut state);
        let mut fields = vec![0.0; material.field_names().len()];
        material.fields(&state, &mut fields);
        Self { temperature, state, fields, reached: [f64::NAN; N], values }
    }

    /// Integrates over a linear change of temperature to `to`, K, in `duration`, s.
    ///
    /// # Errors
    /// Errors of the material.
    pub fn advance(&mut self, material: &dyn ThermalMaterial, to: f64, duration: f64) -> Result<(), Error> {
        let change = to - self.temperature;
        let steps = (change.abs() / STEP).ceil().clamp(1.0, MAX_STEPS);
        for _ in 0..steps as usize {
            let (increment, dt) = (change / steps, duration / steps);
            let at = PointInput { temperature: self.temperature, increment, gradient: Vector3::zeros(), dt };
            let (old, before) = (self.state.clone(), self.fields[0]);
            material.respond(&at, &old, &mut self.state)?;
            material.fields(&self.state, &mut self.fields);
            for (reached, value) in self.reached.iter_mut().zip(self.values) {
                if reached.is_nan() && self.fields[0] >= value {
                    *reached = self.temperature + increment * share(before, self.fields[0], value);
                }
            }
            self.temperature += increment;
        }
        self.temperature = to;
        Ok(())
    }
}

/// Fraction of the way between two α at which a value lies, by interpolation in ln(−ln(1 − α)), which
/// Avrami's law makes linear in ln t.
fn share(before: f64, after: f64, value: f64) -> f64 {
    let of = |alpha: f64| (-(-alpha).ln_1p()).ln();
    let share = (of(value) - of(before)) / (of(after) - of(before));
    if share.is_finite() { share } else { (value - before) / (after - before) }
}
