//! A plain conductor: Fourier's law, with constant or tabulated properties.

use super::{PointInput, ThermalMaterial, ThermalProperty, ThermalResponse};
use crate::error::Error;
use nalgebra::{Matrix3, Vector3};

/// A conductor without state: U = ∫c dT, f = −k(T) D ∇T, with diagonal D: a part conducts better along its
/// beads.
#[derive(Clone, Debug, PartialEq)]
pub struct Conductor {
    density: f64,
    conductivity: ThermalProperty,
    specific_heat: ThermalProperty,
    /// D, along x, y, z.
    directions: Vector3<f64>,
}

impl Conductor {
    /// Returns a conductor of density, kg/m³, conductivity, W/(m K), and specific heat, J/(kg K).
    ///
    /// # Errors
    /// [`Error::Parameter`] unless the density is above 0 and finite.
    pub fn new(
        density: f64,
        conductivity: ThermalProperty,
        specific_heat: ThermalProperty,
    ) -> Result<Self, Error> {
        if density > 0.0 && density.is_finite() {
            return Ok(Self { density, conductivity, specific_heat, directions: Vector3::repeat(1.0) });
        }
        let allowed = "above 0 and finite".to_owned();
        Err(Error::Parameter { name: "density, kg/m³", found: density, allowed })
    }

    /// Scales the conductivity along x, y and z.
    ///
    /// # Errors
    /// [`Error::Parameter`] unless each is above 0 and finite.
    pub fn with_directions(self, factors: [f64; 3]) -> Result<Self, Error> {
        match factors.into_iter().find(|factor| !(*factor > 0.0 && factor.is_finite())) {
            None => Ok(Self { directions: factors.into(), ..self }),
            Some(found) => {
                let allowed = "above 0 and finite".to_owned();
                Err(Error::Parameter { name: "factor on the conductivity", found, allowed })
            }
        }
    }

    /// ∫c dT from the reference temperature, J/kg.
    pub(super) fn sensible_heat(&self, temperature: f64) -> f64 {
        self.specific_heat.integral(temperature)
    }

    /// [`ThermalMaterial::potential`].
    pub(super) fn heat_potential(&self, temperature: f64) -> Option<[f64; 2]> {
        let conductivity = &self.conductivity;
        conductivity.jumps().then(|| [conductivity.integral(temperature), conductivity.value_at(temperature)])
    }

    /// Returns whether both properties are constant.
    pub(super) fn is_constant(&self) -> bool {
        self.conductivity.is_constant() && self.specific_heat.is_constant()
    }

    /// Computes the response.
    pub(super) fn conduct(&self, at: &PointInput) -> Result<ThermalResponse, Error> {
        let temperature = at.check()?;
        let [conductivity, slope] = self.conductivity.with_slope(temperature);
        let gradient = self.directions.component_mul(&at.gradient);
        Ok(ThermalResponse {
            energy: self.specific_heat.integral(temperature),
            d_energy_d_temperature: self.specific_heat.value_at(temperature),
            flux: -conductivity * gradient,
            d_flux_d_temperature: -slope * gradient,
            d_flux_d_gradient: Matrix3::from_diagonal(&(-conductivity * self.directions)),
            step_ratio: None,
        })
    }
}

impl PointInput {
    /// Returns the temperature at the end of the increment, K, if valid.
    ///
    /// # Errors
    /// [`Error::Parameter`] for temperatures that are not finite and a Δt that is not finite or below 0.
    pub(crate) fn check(&self) -> Result<f64, Error> {
        let end = self.temperature + self.increment;
        let refuse =
            |name, found, allowed: &str| Err(Error::Parameter { name, found, allowed: allowed.to_owned() });
        if !self.temperature.is_finite() {
            return refuse("temperature, K", self.temperature, "a finite number");
        }
        if !end.is_finite() {
            return refuse("increment of temperature, K", self.increment, "a finite number");
        }
        if !(self.dt >= 0.0 && self.dt.is_finite()) {
            return refuse("time increment, s", self.dt, "0 or above, finite");
        }
        Ok(end)
    }
}

impl ThermalMaterial for Conductor {
    fn density(&self) -> f64 {
        self.density
    }

    fn state_names(&self) -> &'static [&'static str] {
        &[]
    }

    fn initial_state(&self, _temperature: f64, _state: &mut [f64]) {}

    fn energy(&self, temperature: f64, _state: &[f64]) -> f64 {
        self.sensible_heat(temperature)
    }

    fn is_linear(&self) -> bool {
        self.is_constant()
    }

    fn constant_conductivity(&self) -> bool {
        self.conductivity.is_constant()
    }

    fn potential(&self, temperature: f64) -> Option<[f64; 2]> {
        self.heat_potential(temperature)
    }

    fn respond(&self, at: &PointInput, _old: &[f64], _new: &mut [f64]) -> Result<ThermalResponse, Error> {
        self.conduct(at)
    }
}
