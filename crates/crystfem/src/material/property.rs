//! Properties that depend on temperature: constant, or a table.

use crate::error::Error;

/// Reference temperature of energies, K: U(T_ref) = 0 for amorphous material.
pub const REFERENCE_TEMPERATURE: f64 = 273.15;

/// Relative change within 1 K above which a property counts as a jump.
const JUMP_CHANGE: f64 = 0.1;

/// A positive, temperature-dependent property.
#[derive(Clone, Debug, PartialEq)]
pub enum ThermalProperty {
    /// A constant.
    Constant(f64),
    /// Linear between given values, constant outside.
    Table(PropertyTable),
}

/// Temperatures and values of a [`ThermalProperty`].
#[derive(Clone, Debug, PartialEq)]
pub struct PropertyTable {
    temperatures: Vec<f64>,
    values: Vec<f64>,
    /// Integrals from the first temperature to each.
    integrals: Vec<f64>,
    /// Integral from the first temperature to the reference.
    offset: f64,
    /// Steep change, see [`ThermalProperty::jumps`].
    jumps: bool,
}

impl ThermalProperty {
    /// Returns a constant; `name` is for the error.
    ///
    /// # Errors
    /// [`Error::Parameter`] unless it is above 0 and finite.
    pub fn constant(name: &'static str, value: f64) -> Result<Self, Error> {
        positive(name, value)?;
        Ok(Self::Constant(value))
    }

    /// Returns a table of temperatures, K, and values.
    ///
    /// # Errors
    /// [`Error::Parameter`] for no rows or columns of different lengths (with the number of rows),
    /// temperatures that do not increase, and values that are not above 0 and finite.
    pub fn table(name: &'static str, temperatures: Vec<f64>, values: Vec<f64>) -> Result<Self, Error> {
        let refuse = |name, found, allowed: String| Err(Error::Parameter { name, found, allowed });
        if temperatures.is_empty() || temperatures.len() != values.len() {
            let allowed =
                format!("a value for each of the {} temperatures, at least one", temperatures.len());
            return refuse("number of values", values.len() as f64, allowed);
        }
        for &value in &values {
            positive(name, value)?;
        }
        for (index, &temperature) in temperatures.iter().enumerate() {
            let before = if index > 0 { temperatures[index - 1] } else { f64::NEG_INFINITY };
            if !(temperature > before && temperature.is_finite()) {
                let allowed = format!("temperatures that increase, above {before} K here");
                return refuse("temperature, K", temperature, allowed);
            }
        }
        let mut integrals = vec![0.0];
        for i in 1..values.len() {
            let area = 0.5 * (values[i] + values[i - 1]) * (temperatures[i] - temperatures[i - 1]);
            integrals.push(integrals[i - 1] + area);
        }
        let jumps = temperatures.windows(2).zip(values.windows(2)).any(|(t, v)| {
            let change = (v[1] - v[0]).abs() / v[0].min(v[1]);
            change > JUMP_CHANGE * (t[1] - t[0])
        });
        let mut table = PropertyTable { temperatures, values, integrals, offset: 0.0, jumps };
        table.offset = table.integral(REFERENCE_TEMPERATURE);
        Ok(Self::Table(table))
    }

    /// Returns the value at a temperature, K.
    #[inline]
    pub fn value_at(&self, temperature: f64) -> f64 {
        self.with_slope(temperature)[0]
    }

    /// Returns the value and its derivative (the right one at a table row).
    #[inline]
    pub fn with_slope(&self, temperature: f64) -> [f64; 2] {
        match self {
            Self::Constant(value) => [*value, 0.0],
            Self::Table(table) => table.with_slope(temperature),
        }
    }

    /// Integrates from [`REFERENCE_TEMPERATURE`] to a temperature, exactly for a table too.
    #[inline]
    pub fn integral(&self, temperature: f64) -> f64 {
        match self {
            Self::Constant(value) => value * (temperature - REFERENCE_TEMPERATURE),
            Self::Table(table) => table.integral(temperature) - table.offset,
        }
    }

    /// Returns true if it changes by more than a tenth within 1 K somewhere.
    pub fn jumps(&self) -> bool {
        matches!(self, Self::Table(table) if table.jumps)
    }

    /// Returns true for a constant.
    pub fn is_constant(&self) -> bool {
        match self {
            Self::Constant(_) => true,
            Self::Table(table) => table.values.iter().all(|&value| value == table.values[0]),
        }
    }
}

impl PropertyTable {
    /// Rows of temperature, K, and value.
    pub fn rows(&self) -> impl Iterator<Item = [f64; 2]> {
        self.temperatures.iter().zip(&self.values).map(|(&temperature, &value)| [temperature, value])
    }

    /// Index of the row at or before a temperature within the table.
    fn row(&self, temperature: f64) -> usize {
        self.temperatures.partition_point(|&t| t <= temperature) - 1
    }

    fn with_slope(&self, temperature: f64) -> [f64; 2] {
        let last = self.values.len() - 1;
        if temperature < self.temperatures[0] {
            return [self.values[0], 0.0];
        }
        if temperature >= self.temperatures[last] {
            return [self.values[last], 0.0];
        }
        let i = self.row(temperature);
        let slope = (self.values[i + 1] - self.values[i]) / (self.temperatures[i + 1] - self.temperatures[i]);
        [self.values[i] + slope * (temperature - self.temperatures[i]), slope]
    }

    /// Integrates from the first temperature.
    fn integral(&self, temperature: f64) -> f64 {
        let last = self.values.len() - 1;
        if temperature < self.temperatures[0] {
            return self.values[0] * (temperature - self.temperatures[0]);
        }
        let i = if temperature >= self.temperatures[last] { last } else { self.row(temperature) };
        let mean = 0.5 * (self.values[i] + self.with_slope(temperature)[0]);
        self.integrals[i] + mean * (temperature - self.temperatures[i])
    }
}

fn positive(name: &'static str, value: f64) -> Result<(), Error> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(Error::Parameter { name, found: value, allowed: "above 0 and finite".to_owned() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(temperatures: &[f64], values: &[f64]) -> Result<ThermalProperty, Error> {
        ThermalProperty::table("specific heat, J/(kg K)", temperatures.to_vec(), values.to_vec())
    }

    /// A parabola is the integral of a straight line: 1000 + 2 (T − 300) between 300 and 400 K, constant
    /// outside.
    #[test]
    fn integral_is_exact() {
        let heat = table(&[300.0, 350.0, 400.0], &[1000.0, 1100.0, 1200.0]).unwrap();
        let from = |a: f64, b: f64| heat.integral(b) - heat.integral(a);
        assert!((from(300.0, 400.0) - 110_000.0).abs() < 1e-9);
        assert!((from(310.0, 390.0) - 80.0 * 1100.0).abs() < 1e-9);
        assert!((from(200.0, 300.0) - 100_000.0).abs() < 1e-9);
        assert!((from(400.0, 1400.0) - 1_200_000.0).abs() < 1e-8);
        assert_eq!(heat.integral(REFERENCE_TEMPERATURE), 0.0);
        assert_eq!(heat.with_slope(325.0), [1050.0, 2.0]);
        assert_eq!((heat.with_slope(299.0), heat.with_slope(400.0)), ([1000.0, 0.0], [1200.0, 0.0]));
        assert!(!heat.is_constant());
        let single = table(&[300.0], &[7.0]).unwrap();
        assert_eq!((single.value_at(0.0), single.value_at(300.0), single.value_at(1e4)), (7.0, 7.0, 7.0));
        assert!(single.is_constant() && (single.integral(373.15) - 700.0).abs() < 1e-10);
    }

    /// The value is the derivative of the integral, across all rows.
    #[test]
    fn value_is_slope_of_integral() {
        let heat = table(&[250.0, 300.0, 320.0, 500.0], &[900.0, 2500.0, 1800.0, 2600.0]).unwrap();
        for step in 0..400 {
            let t = 200.5 + f64::from(step);
            let difference = (heat.integral(t + 1e-3) - heat.integral(t - 1e-3)) / 2e-3;
            assert!((difference - heat.value_at(t)).abs() < 1e-5 * heat.value_at(t), "{t}");
        }
    }

    #[test]
    fn refusals_name_what_was_found() {
        let message =
            |temperatures: &[f64], values: &[f64]| table(temperatures, values).unwrap_err().to_string();
        assert!(message(&[], &[]).contains("at least one"));
        assert!(message(&[300.0, 400.0], &[1.0]).contains("found 1"));
        assert!(
            message(&[300.0, 300.0], &[1.0, 2.0]).contains("found 300; allowed: temperatures that increase")
        );
        assert!(message(&[300.0, f64::NAN], &[1.0, 2.0]).contains("found NaN"));
        assert!(message(&[300.0, 400.0], &[1.0, 0.0]).contains("found 0; allowed: above 0"));
        assert!(ThermalProperty::constant("k", f64::INFINITY).is_err());
    }
}
