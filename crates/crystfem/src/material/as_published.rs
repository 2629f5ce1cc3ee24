//! The subroutine of Appendix B as coded, for comparison: Algorithm 1 by Euler's method, from a seed of 1e-3.

use super::{Conductor, PointInput, ThermalMaterial, ThermalResponse};
use crate::error::Error;

/// Sign of the temperature increment that crystallizes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// `DTEMP > 0`, as printed: heating crystallizes and cooling melts.
    AsPublished,
    /// `DTEMP < 0`, corrected.
    Corrected,
}

/// Appendix B with its three missing parentheses. The arithmetic is the printed one, in single precision for
/// `REAL` variables; temperatures are those at the start of the increment. The state holds its α, infinite
/// and NaN included; energy and flux do not depend on it.
#[derive(Clone, Debug, PartialEq)]
pub struct PublishedSubroutine {
    conductor: Conductor,
    sign: Sign,
    guarded: bool,
}

const SEED: f32 = 1e-3;
const ALPHA_MAX: f32 = 0.25;
const T0: f32 = 466.0;
const T_INF: f32 = 294.0;

impl PublishedSubroutine {
    /// Returns the material; with `guarded`, K = 0 outside (T∞, T₀), otherwise the exponential overflows
    /// above T₀.
    pub fn new(conductor: Conductor, sign: Sign, guarded: bool) -> Self {
        Self { conductor, sign, guarded }
    }

    /// Rate from THALF, KT and DALPHADT.
    fn rate(&self, old: f32, kelvin: f32) -> f32 {
        if self.guarded && !(kelvin > T_INF && kelvin < T0) {
            return 0.0;
        }
        let (k0, kg, u, r, n) = (3.787e4_f32, 136_235.0_f32, 6270.0_f32, 8.314_f32, 2.678_f32);
        let jump = k0 * (-u / (r * (kelvin - T_INF))).exp();
        let barrier =
            f64::from(-kg * (kelvin + T0)) / (2.0 * f64::from(T0 - kelvin) * f64::from(kelvin).powi(2));
        let half = (f64::from(jump) * barrier.exp()) as f32;
        let exponent = f64::from(n);
        let rate = (2.0_f64.ln().powf(1.0 / exponent) * f64::from(half)) as f32;
        let left = 1.0 - f64::from(old);
        (f64::from(n * rate) * left * (1.0 / left).ln().powf((exponent - 1.0) / exponent)) as f32
    }

    /// α at the end of an increment, from a temperature in K.
    fn alpha(&self, old: f32, temperature: f64, increment: f64, dt: f64) -> f32 {
        let kelvin = kelvin(temperature);
        let crystallizing = match self.sign {
            Sign::AsPublished => increment,
            Sign::Corrected => -increment,
        };
        if crystallizing > 0.0 {
            return (f64::from(old) + dt * f64::from(self.rate(old, kelvin))) as f32;
        }
        if crystallizing == 0.0 {
            return old;
        }
        if kelvin > 460.0 {
            SEED
        } else if kelvin > 420.0 {
            let (k_m, d) = (0.965_f32, 8.58_f32);
            let e = (-k_m * (kelvin - 450.0)).exp();
            let d = f64::from(d);
            let melt = (f64::from(k_m * e) * (1.0 + (d - 1.0) * f64::from(e)).powf(d / (1.0 - d))) as f32;
            let molten = (f64::from(melt) * increment.abs()) as f32;
            SEED.max(old - molten * ALPHA_MAX)
        } else {
            old
        }
    }
}

/// TEMPK = TEMP + 273.D0, where TEMP is in °C.
fn kelvin(temperature: f64) -> f32 {
    (temperature - 273.15 + 273.0) as f32
}

impl ThermalMaterial for PublishedSubroutine {
    fn density(&self) -> f64 {
        self.conductor.density()
    }

    fn state_names(&self) -> &'static [&'static str] {
        &["alpha"]
    }

    fn initial_state(&self, _temperature: f64, state: &mut [f64]) {
        state[0] = f64::from(SEED);
    }

    fn field_names(&self) -> &'static [&'static str] {
        &["alpha", "crystallinity"]
    }

    fn fields(&self, state: &[f64], fields: &mut [f64]) {
        (fields[0], fields[1]) = (state[0], state[0] * f64::from(ALPHA_MAX));
    }

    fn crystallization_rate(&self, temperature: f64, state: &[f64]) -> f64 {
        f64::from(self.rate(state[0] as f32, kelvin(temperature)))
    }

    fn energy(&self, temperature: f64, _state: &[f64]) -> f64 {
        self.conductor.sensible_heat(temperature)
    }

    fn is_linear(&self) -> bool {
        self.conductor.is_constant()
    }

    fn potential(&self, temperature: f64) -> Option<[f64; 2]> {
        self.conductor.heat_potential(temperature)
    }

    fn respond(&self, at: &PointInput, old: &[f64], new: &mut [f64]) -> Result<ThermalResponse, Error> {
        let response = self.conductor.conduct(at)?;
        new[0] = f64::from(self.alpha(old[0] as f32, at.temperature, at.increment, at.dt));
        Ok(response)
    }
}
