//! Conversion to °C for files, pictures and reports; the program computes in K.

/// 0 °C in K.
pub const CELSIUS: f64 = 273.15;

/// Name of the temperature field.
pub const TEMPERATURE: &str = "temperature_degC";

/// Converts temperatures from K to °C.
pub fn to_celsius(kelvin: &[f64]) -> Vec<f64> {
    kelvin.iter().map(|t| t - CELSIUS).collect()
}
