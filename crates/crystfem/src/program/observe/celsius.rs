//! Temperatures as people read them: files, pictures and reports are in °C, all else in K.

/// 0 °C in K.
pub const CELSIUS: f64 = 273.15;

/// Name of the temperature among the fields.
pub const TEMPERATURE: &str = "temperature_degC";

/// Temperatures in °C.
pub fn of_kelvin(kelvin: &[f64]) -> Vec<f64> {
    kelvin.iter().map(|t| t - CELSIUS).collect()
}
