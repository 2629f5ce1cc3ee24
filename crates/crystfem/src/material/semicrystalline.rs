//! A semicrystalline polymer: Fourier's law, crystallization and melting, optional latent heat.

use super::{Conductor, Crystallization, PointInput, ThermalMaterial, ThermalProperty, ThermalResponse};
use crate::error::Error;
use crate::kinetics::{KineticConstants, Kinetics};
use crate::melting::Melting;

/// Change of α per increment at which the suggested step equals the present one.
pub const LARGEST_CHANGE: f64 = 0.1;
/// Largest suggested ratio of next to present step.
pub(super) const MAX_STEP_RATIO: f64 = 10.0;

/// Names of the constants of growth and melting in exports, in the order of [`Polymer::growth_and_melting`].
pub const CONSTANT_NAMES: [&str; 9] = [
    "growth_rate",
    "nucleation",
    "activation_energy",
    "equilibrium_melting",
    "frozen",
    "avrami_exponent",
    "melting_sharpness",
    "melting_shape",
    "melting_peak",
];

/// Constants of a [`Semicrystalline`] material, SI.
#[derive(Clone, Debug, PartialEq)]
pub struct Polymer {
    /// Density ρ, kg/m³.
    pub density: f64,
    /// Conductivity k, W/(m K).
    pub conductivity: ThermalProperty,
    /// Specific heat c, J/(kg K).
    pub specific_heat: ThermalProperty,
    /// Kinetics of crystallization.
    pub kinetics: Kinetics,
    /// Melting on heating; `None` if crystals never melt.
    pub melting: Option<Melting>,
    /// Ultimate crystallinity X∞: the mass fraction of crystals at α = 1.
    pub ultimate_crystallinity: f64,
    /// Heat of fusion of the crystal ΔH, J/kg; `None` uncouples temperature from crystallinity, as in the
    /// thesis.
    pub latent_heat: Option<f64>,
    /// Relative crystallinity α of fresh material.
    pub seed: f64,
}

impl Polymer {
    /// Constants of growth and melting, SI, in the order of [`CONSTANT_NAMES`]; 0, 0, 0 if crystals never
    /// melt.
    pub fn growth_and_melting(&self) -> [f64; 9] {
        let of = self.kinetics.constants();
        let [sharpness, shape, peak] = self.melting.map_or([0.0; 3], |melting| melting.constants());
        [
            of.growth_rate,
            of.nucleation,
            of.activation_energy,
            of.equilibrium_melting,
            of.frozen,
            of.avrami_exponent,
            sharpness,
            shape,
            peak,
        ]
    }
}

/// A semicrystalline material. Its state is z = \[−ln(1−α)\]^{1/n}; with latent heat U = ∫c dT − ΔH X∞ α.
#[derive(Clone, Debug, PartialEq)]
pub struct Semicrystalline {
    conductor: Conductor,
    crystallization: Crystallization,
    ultimate_crystallinity: f64,
    /// ΔH X∞, J/kg.
    latent: Option<f64>,
    initial: f64,
}

impl Semicrystalline {
    /// Builds the material from its constants.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a density ≤ 0, X∞ outside (0, 1], ΔH < 0, a seed outside \[0, 1), and values
    /// that are not finite.
    pub fn new(polymer: Polymer) -> Result<Self, Error> {
        let Polymer { ultimate_crystallinity, latent_heat, seed, kinetics, melting, .. } = polymer;
        let check = |name, found: f64, good: bool, allowed: &str| {
            if good && found.is_finite() {
                Ok(())
            } else {
                Err(Error::Parameter { name, found, allowed: allowed.to_owned() })
            }
        };
        let whole = 0.0..=1.0;
        let some = ultimate_crystallinity > 0.0 && whole.contains(&ultimate_crystallinity);
        check("ultimate crystallinity", ultimate_crystallinity, some, "above 0, up to 1")?;
        if let Some(latent) = latent_heat {
            check("latent heat, J/kg", latent, latent >= 0.0, "0 or above")?;
        }
        check("initial relative crystallinity", seed, (0.0..1.0).contains(&seed), "0 or above, below 1")?;
        Ok(Self {
            conductor: Conductor::new(polymer.density, polymer.conductivity, polymer.specific_heat)?,
            crystallization: Crystallization { kinetics, melting },
            ultimate_crystallinity,
            latent: latent_heat.map(|heat| heat * ultimate_crystallinity),
            initial: kinetics.z_of_degree(seed),
        })
    }

    /// PA12 of Chapter 4: k = 0.25 W/(m K), ρ = 1010 kg/m³, c = 2200 J/(kg K), kinetics of column 1 of Table
    /// 4.1, X∞ = 0.25, 209 J/g of crystal.
    ///
    /// # Errors
    /// Errors of [`Self::new`]; none for these constants.
    pub fn pa12() -> Result<Self, Error> {
        Self::new(Polymer {
            density: 1010.0,
            conductivity: ThermalProperty::Constant(0.25),
            specific_heat: ThermalProperty::Constant(2200.0),
            kinetics: Kinetics::new(KineticConstants::TABLE_4_1_COLUMN_1)?,
            melting: Some(Melting::PA12),
            ultimate_crystallinity: 0.25,
            latent_heat: Some(209e3),
            seed: 0.0,
        })
    }

    /// Scales the conductivity along x, y and z.
    ///
    /// # Errors
    /// [`Error::Parameter`] unless each is above 0 and finite.
    pub fn with_directions(self, factors: [f64; 3]) -> Result<Self, Error> {
        Ok(Self { conductor: self.conductor.with_directions(factors)?, ..self })
    }

    /// Growth and melting of crystals.
    pub fn crystallization(&self) -> &Crystallization {
        &self.crystallization
    }

    /// Kinetics of crystallization.
    pub fn kinetics(&self) -> &Kinetics {
        &self.crystallization.kinetics
    }
}

impl ThermalMaterial for Semicrystalline {
    fn density(&self) -> f64 {
        self.conductor.density()
    }

    fn state_names(&self) -> &'static [&'static str] {
        &["z"]
    }

    fn initial_state(&self, _temperature: f64, state: &mut [f64]) {
        state[0] = self.initial;
    }

    fn field_names(&self) -> &'static [&'static str] {
        &["alpha", "crystallinity"]
    }

    /// Returns α and X = X∞ α.
    fn fields(&self, state: &[f64], fields: &mut [f64]) {
        fields[0] = self.kinetics().degree(state[0]);
        fields[1] = self.ultimate_crystallinity * fields[0];
    }

    fn crystallization_rate(&self, temperature: f64, state: &[f64]) -> f64 {
        self.kinetics().degree_slope(state[0]) * self.kinetics().rate(temperature)
    }

    fn energy(&self, temperature: f64, state: &[f64]) -> f64 {
        let sensible = self.conductor.sensible_heat(temperature);
        self.latent.map_or(sensible, |latent| sensible - latent * self.kinetics().degree(state[0]))
    }

    fn is_linear(&self) -> bool {
        self.latent.is_none() && self.conductor.is_constant()
    }

    fn constant_conductivity(&self) -> bool {
        self.conductor.constant_conductivity()
    }

    fn potential(&self, temperature: f64) -> Option<[f64; 2]> {
        self.conductor.heat_potential(temperature)
    }

    fn crystals(&self) -> Option<&Crystallization> {
        Some(&self.crystallization)
    }

    fn respond(&self, at: &PointInput, old: &[f64], new: &mut [f64]) -> Result<ThermalResponse, Error> {
        let mut response = self.conductor.conduct(at)?;
        let grown =
            self.crystallization.advance(old[0], at.temperature, at.temperature + at.increment, at.dt);
        new[0] = grown.z;
        let kinetics = self.kinetics();
        if grown.z == old[0] && self.latent.is_none() {
            return Ok(response);
        }
        // |∂α/∂z| ≤ n: small growth suggests the longest step without evaluating α
        if self.latent.is_none()
            && grown.z < 1.0
            && kinetics.constants().avrami_exponent * (grown.z - old[0]).abs()
                <= LARGEST_CHANGE / MAX_STEP_RATIO
        {
            response.step_ratio = Some(MAX_STEP_RATIO);
            return Ok(response);
        }
        let [after, slope] = kinetics.degree_and_slope(grown.z);
        if grown.z != old[0] {
            let change = (after - kinetics.degree(old[0])).abs();
            response.step_ratio =
                (change > 0.0).then(|| (LARGEST_CHANGE / change).clamp(0.1, MAX_STEP_RATIO));
        }
        if let Some(latent) = self.latent {
            response.energy -= latent * after;
            response.d_energy_d_temperature -= latent * slope * grown.slope;
        }
        Ok(response)
    }
}
