//! Material block of a scene.

use super::locate_error::{located, located_in};
use super::powder::PowderSpec;
use super::text_or_table::{self, TextOrTable};
use crate::error::Error;
use crate::kinetics::{KineticConstants, Kinetics};
use crate::material::{
    Conductor, Polymer, PublishedSubroutine, Semicrystalline, Sign, ThermalMaterial, ThermalProperty,
};
use crate::melting::Melting;
use harness::scene::{SceneError, Source};
use polycore::units::dimension::{ConductivityDimension, SpecificHeatDimension};
use polycore::units::{
    Density, Dimension, MolarEnergy, PerTemperature, Quantity, Rate, Ratio, SpecificEnergy,
    SquaredTemperature, Temperature,
};
use serde::{Deserialize, Deserializer};

/// Material laws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Law {
    /// Heat conduction only, see [`Conductor`].
    Conductor,
    /// Heat conduction with crystallization, see [`Semicrystalline`].
    Semicrystalline,
    /// Appendix B as coded, see [`PublishedSubroutine`].
    AsPublished,
}

/// A material.
///
/// ```toml
/// [material]
/// law = "semicrystalline"
/// density = "1010 kg/m^3"
/// conductivity = "0.25 W/(m K)"
/// specific_heat = { temperature = ["20 degC", "200 degC"], value = ["1500 J/(kg K)", "2600 J/(kg K)"] }
/// kinetics = "table-4.1-column-1"
/// melting = "pa12"          # default: crystals never melt
/// crystallinity = 0.25
/// latent_heat = "209 J/g"   # default: crystallinity does not affect the temperature
/// ```
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MaterialSpec {
    /// Law of the material.
    pub law: Law,
    /// Density ρ.
    pub density: Density,
    /// Conductivity k.
    pub conductivity: PropertySpec<ConductivityDimension>,
    /// Factors on the conductivity along x, y and z; default 1.
    pub conductivity_factors: Option<[f64; 3]>,
    /// Specific heat c.
    pub specific_heat: PropertySpec<SpecificHeatDimension>,
    /// Powder properties of new material, for `conductor` and `semicrystalline`.
    pub powder: Option<PowderSpec>,
    /// Kinetics, for `semicrystalline`.
    pub kinetics: Option<KineticsSpec>,
    /// Melting, for `semicrystalline`.
    pub melting: Option<MeltingSpec>,
    /// Ultimate crystallinity X∞, for `semicrystalline`.
    pub crystallinity: Option<Ratio>,
    /// Heat of fusion of the crystal ΔH, for `semicrystalline`.
    pub latent_heat: Option<SpecificEnergy>,
    /// Relative crystallinity α of new material, for `semicrystalline`; default 0.
    pub initial_alpha: Option<Ratio>,
    /// Sign of the temperature increment that crystallizes, for `as-published`; default as published.
    pub sign: Option<SignSpec>,
    /// Sets K = 0 outside (T∞, T₀), for `as-published`; default false, as published.
    pub guarded: Option<bool>,
}

/// Sign of the temperature increment that crystallizes, see [`Sign`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SignSpec {
    /// Heating crystallizes.
    AsPublished,
    /// Cooling crystallizes.
    Mended,
}

/// A constant (`"0.25 W/(m K)"`) or a table (`{ temperature = […], value = […] }`).
#[derive(Clone, Debug)]
pub enum PropertySpec<D> {
    /// Constant over temperature.
    Constant(Quantity<D>),
    /// Table over temperature: linear between its rows, constant beyond.
    Table(TableSpec<D>),
}

/// Table of a property.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, bound = "D: Dimension")]
pub struct TableSpec<D> {
    /// Temperatures, increasing.
    pub temperature: Vec<Temperature>,
    /// Value at each temperature.
    pub value: Vec<Quantity<D>>,
}

/// Kinetics by name (`"table-4.1-column-1"`) or by their constants.
#[derive(Clone, Debug)]
pub enum KineticsSpec {
    /// Constants of the thesis.
    Named(KineticConstants),
    /// Constants of the scene.
    Given(GivenKinetics),
}

/// Constants of Eq. (4.7).
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GivenKinetics {
    /// Growth rate constant K₀.
    pub growth_rate: Rate,
    /// Nucleation constant K_G.
    pub nucleation: SquaredTemperature,
    /// Activation energy U; default 6270 J/mol.
    pub activation_energy: Option<MolarEnergy>,
    /// Equilibrium melting temperature T₀.
    pub equilibrium_melting: Temperature,
    /// Temperature T∞ of frozen chains.
    pub frozen: Option<Temperature>,
    /// Glass transition T_g, instead of `frozen`: T∞ = T_g − 30 K.
    pub glass_transition: Option<Temperature>,
    /// Avrami exponent n.
    pub avrami_exponent: f64,
}

/// Melting by name (`"pa12"`) or by its constants.
#[derive(Clone, Debug)]
pub enum MeltingSpec {
    /// Constants of the thesis.
    Named(Melting),
    /// Constants of the scene.
    Given(GivenMelting),
}

/// Constants of Eq. (4.8).
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GivenMelting {
    /// Sharpness k_m.
    pub sharpness: PerTemperature,
    /// Shape d.
    pub shape: f64,
    /// Most probable melting temperature T_p.
    pub peak: Temperature,
}

const KINETICS_NAMES: [&str; 3] = ["table-4.1-column-1", "table-4.1-column-2", "appendix-b"];
const KINETICS: [(&str, KineticConstants); 3] = [
    (KINETICS_NAMES[0], KineticConstants::TABLE_4_1_COLUMN_1),
    (KINETICS_NAMES[1], KineticConstants::TABLE_4_1_COLUMN_2),
    (KINETICS_NAMES[2], KineticConstants::APPENDIX_B),
];

/// Parameters of the kinetics and their keys.
pub(super) const KINETICS_KEYS: [(&str, &str); 6] = [
    ("growth rate constant K0, 1/s", "growth_rate"),
    ("nucleation constant K_G, K²", "nucleation"),
    ("activation energy U, J/mol", "activation_energy"),
    ("temperature of frozen chains, K", "frozen"),
    ("equilibrium melting temperature, K", "equilibrium_melting"),
    ("Avrami exponent n", "avrami_exponent"),
];
/// Parameters of melting and their keys.
const MELTING_KEYS: [(&str, &str); 3] = [
    ("sharpness of melting k_m, 1/K", "sharpness"),
    ("shape of melting d", "shape"),
    ("peak of melting, K", "peak"),
];

impl MaterialSpec {
    /// Builds the material of the block at `key`, e.g. `material`.
    ///
    /// # Errors
    /// Returns a [`SceneError`] for missing keys, keys of another law, and invalid constants.
    pub fn build(&self, source: &Source, key: &str) -> Result<Box<dyn ThermalMaterial>, SceneError> {
        self.check_keys(source, key)?;
        Ok(match self.law {
            Law::Conductor => PowderSpec::wrap(self.powder, source, key, self.conductor(source, key)?)?,
            Law::Semicrystalline => {
                PowderSpec::wrap(self.powder, source, key, self.semicrystalline(source, key)?)?
            }
            Law::AsPublished => {
                let sign = match self.sign {
                    Some(SignSpec::Mended) => Sign::Corrected,
                    _ => Sign::AsPublished,
                };
                Box::new(PublishedSubroutine::new(
                    self.conductor(source, key)?,
                    sign,
                    self.guarded.unwrap_or(false),
                ))
            }
        })
    }

    fn check_keys(&self, source: &Source, key: &str) -> Result<(), SceneError> {
        let crystalline = [
            ("kinetics", self.kinetics.is_some(), true),
            ("crystallinity", self.crystallinity.is_some(), true),
            ("melting", self.melting.is_some(), false),
            ("latent_heat", self.latent_heat.is_some(), false),
            ("initial_alpha", self.initial_alpha.is_some(), false),
        ];
        for (name, given, needed) in crystalline {
            let at = format!("{key}.{name}");
            match self.law {
                Law::Semicrystalline if needed && !given => {
                    return Err(source.missing(&at, "a semicrystalline material needs it"));
                }
                Law::Conductor | Law::AsPublished if given => {
                    let why = "it belongs to `law = \"semicrystalline\"`; remove it or change the law";
                    return Err(source.unexpected(&at, why));
                }
                _ => {}
            }
        }
        if self.powder.is_some() && self.law == Law::AsPublished {
            let why = "the published subroutine has no powder; remove it";
            return Err(source.unexpected(&format!("{key}.powder"), why));
        }
        for (name, given) in [("sign", self.sign.is_some()), ("guarded", self.guarded.is_some())] {
            if given && self.law != Law::AsPublished {
                let why = "it belongs to `law = \"as-published\"`; remove it or change the law";
                return Err(source.unexpected(&format!("{key}.{name}"), why));
            }
        }
        Ok(())
    }

    fn conductor(&self, source: &Source, key: &str) -> Result<Conductor, SceneError> {
        let [conductivity, heat] = self.properties(source, key)?;
        let conductor = Conductor::new(self.density.si(), conductivity, heat);
        let conductor = locate(source, &format!("{key}.density"), conductor)?;
        let factors = format!("{key}.conductivity_factors");
        locate(source, &factors, conductor.with_directions(self.conductivity_factors.unwrap_or([1.0; 3])))
    }

    /// Returns conductivity and specific heat.
    pub(crate) fn properties(&self, source: &Source, key: &str) -> Result<[ThermalProperty; 2], SceneError> {
        let path = |name: &str| format!("{key}.{name}");
        Ok([
            self.conductivity.build(source, &path("conductivity"), "conductivity, W/(m K)")?,
            self.specific_heat.build(source, &path("specific_heat"), "specific heat, J/(kg K)")?,
        ])
    }

    /// Returns the constants of the kinetics.
    ///
    /// # Errors
    /// Returns a [`SceneError`] for missing, or conflicting constants.
    pub(super) fn constants(&self, source: &Source, key: &str) -> Result<KineticConstants, SceneError> {
        match &self.kinetics {
            Some(KineticsSpec::Named(constants)) => Ok(*constants),
            Some(KineticsSpec::Given(given)) => given.constants(source, key),
            None => Err(source.missing(&format!("{key}.kinetics"), "a semicrystalline material needs it")),
        }
    }

    /// Returns the constants of a `semicrystalline` material.
    ///
    /// # Errors
    /// As [`MaterialSpec::build`].
    pub fn polymer(&self, source: &Source, key: &str) -> Result<Polymer, SceneError> {
        self.check_keys(source, key)?;
        let constants = self.constants(source, key)?;
        let melting = match &self.melting {
            Some(MeltingSpec::Named(melting)) => Some(*melting),
            Some(MeltingSpec::Given(given)) => {
                let built = Melting::new(given.sharpness.si(), given.shape, given.peak.si());
                let block = format!("{key}.melting");
                Some(built.map_err(|error| located_in(source, &block, &MELTING_KEYS, &error))?)
            }
            None => None,
        };
        let property = |name: &str| format!("{key}.{name}");
        // checks density, conductivity factors and properties first, so that later errors are those of
        // crystallinity
        self.conductor(source, key)?;
        let [conductivity, specific_heat] = self.properties(source, key)?;
        let kinetics = Kinetics::new(constants)
            .map_err(|error| located_in(source, &property("kinetics"), &KINETICS_KEYS, &error))?;
        Ok(Polymer {
            density: self.density.si(),
            conductivity,
            specific_heat,
            kinetics,
            melting,
            ultimate_crystallinity: self.crystallinity.map_or(0.0, Quantity::si),
            latent_heat: self.latent_heat.map(Quantity::si),
            seed: self.initial_alpha.map_or(0.0, Quantity::si),
        })
    }

    /// Builds a `semicrystalline` material.
    ///
    /// # Errors
    /// As [`MaterialSpec::build`].
    pub fn semicrystalline(&self, source: &Source, key: &str) -> Result<Semicrystalline, SceneError> {
        let built = Semicrystalline::new(self.polymer(source, key)?);
        let factors = self.conductivity_factors.unwrap_or([1.0; 3]);
        built.and_then(|built| built.with_directions(factors)).map_err(|error| {
            let name = match &error {
                Error::Parameter { name: "latent heat, J/kg", .. } => "latent_heat",
                Error::Parameter { name: "initial relative crystallinity", .. } => "initial_alpha",
                _ => "crystallinity",
            };
            located(source, &format!("{key}.{name}"), &error)
        })
    }
}

impl GivenKinetics {
    fn constants(&self, source: &Source, key: &str) -> Result<KineticConstants, SceneError> {
        let frozen = match (self.frozen, self.glass_transition) {
            (Some(frozen), None) => frozen.si(),
            (None, Some(glass)) => glass.si() - 30.0,
            (None, None) => {
                let at = format!("{key}.kinetics.frozen");
                return Err(source.missing(&at, "write `frozen`, or `glass_transition` for T∞ = T_g − 30 K"));
            }
            (Some(_), Some(_)) => {
                let at = format!("{key}.kinetics.glass_transition");
                let frozen = format!("{key}.kinetics.frozen");
                return Err(source.conflict(&at, &frozen, "keep one of them"));
            }
        };
        let energy = KineticConstants::TABLE_4_1_COLUMN_1.activation_energy;
        Ok(KineticConstants {
            growth_rate: self.growth_rate.si(),
            nucleation: self.nucleation.si(),
            activation_energy: self.activation_energy.map_or(energy, Quantity::si),
            equilibrium_melting: self.equilibrium_melting.si(),
            frozen,
            avrami_exponent: self.avrami_exponent,
        })
    }
}

impl<D: Dimension + Copy> PropertySpec<D> {
    fn build(&self, source: &Source, key: &str, name: &'static str) -> Result<ThermalProperty, SceneError> {
        match self {
            Self::Constant(value) => locate(source, key, ThermalProperty::constant(name, value.si())),
            Self::Table(table) => {
                let temperatures = table.temperature.iter().map(|t| t.si()).collect();
                let values = table.value.iter().map(|v| v.si()).collect();
                let keys =
                    [(name, "value"), ("number of values", "value"), ("temperature, K", "temperature")];
                ThermalProperty::table(name, temperatures, values)
                    .map_err(|error| located_in(source, key, &keys, &error))
            }
        }
    }
}

/// Locates the error of a parameter at its key in the scene.
fn locate<T>(source: &Source, key: &str, result: Result<T, Error>) -> Result<T, SceneError> {
    result.map_err(|error| located(source, key, &error))
}

impl<D: Dimension> TextOrTable for PropertySpec<D> {
    type Table = TableSpec<D>;

    fn expected() -> String {
        format!("{}, e.g. \"{}\", or {{ temperature = […], value = […] }}", D::NAME, D::EXAMPLE)
    }

    fn from_text<E: serde::de::Error>(text: &str) -> Result<Self, E> {
        text.parse().map(Self::Constant).map_err(E::custom)
    }

    fn from_table(table: TableSpec<D>) -> Self {
        Self::Table(table)
    }
}

impl TextOrTable for KineticsSpec {
    type Table = GivenKinetics;

    fn expected() -> String {
        let names = KINETICS_NAMES.map(|name| format!("\"{name}\"")).join(", ");
        format!("{names}, or {{ growth_rate = …, nucleation = …, … }}")
    }

    fn from_text<E: serde::de::Error>(text: &str) -> Result<Self, E> {
        let known = KINETICS.iter().find(|(name, _)| *name == text);
        known
            .map(|(_, constants)| Self::Named(*constants))
            .ok_or_else(|| E::unknown_variant(text, &KINETICS_NAMES))
    }

    fn from_table(table: GivenKinetics) -> Self {
        Self::Given(table)
    }
}

impl TextOrTable for MeltingSpec {
    type Table = GivenMelting;

    fn expected() -> String {
        "\"pa12\", or { sharpness = …, shape = …, peak = … }".to_owned()
    }

    fn from_text<E: serde::de::Error>(text: &str) -> Result<Self, E> {
        match text {
            "pa12" => Ok(Self::Named(Melting::PA12)),
            _ => Err(E::unknown_variant(text, &["pa12"])),
        }
    }

    fn from_table(table: GivenMelting) -> Self {
        Self::Given(table)
    }
}

impl<D: Dimension> schemars::JsonSchema for PropertySpec<D> {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        format!("{}_or_table", Quantity::<D>::schema_name()).into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let constant = generator.subschema_for::<Quantity<D>>();
        let temperature = generator.subschema_for::<Temperature>();
        schemars::json_schema!({
            "description": "constant, or table over temperature: linear between its rows, constant beyond",
            "anyOf": [constant, {
                "type": "object",
                "properties": {
                    "temperature": { "type": "array", "items": temperature, "description": "Temperatures, \
                        increasing." },
                    "value": { "type": "array", "items": constant, "description": "Value at each \
                        temperature." },
                },
                "required": ["temperature", "value"],
                "additionalProperties": false,
            }],
        })
    }
}

impl schemars::JsonSchema for KineticsSpec {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Kinetics".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let given = generator.subschema_for::<GivenKinetics>();
        schemars::json_schema!({
            "description": "name of published constants, or the constants",
            "anyOf": [{ "enum": KINETICS_NAMES }, given],
        })
    }
}

impl schemars::JsonSchema for MeltingSpec {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Melting".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let given = generator.subschema_for::<GivenMelting>();
        schemars::json_schema!({
            "description": "name of published constants, or the constants",
            "anyOf": [{ "const": "pa12" }, given],
        })
    }
}

impl<'de, D: Dimension> Deserialize<'de> for PropertySpec<D> {
    fn deserialize<De: Deserializer<'de>>(deserializer: De) -> Result<Self, De::Error> {
        text_or_table::deserialize(deserializer)
    }
}

impl<'de> Deserialize<'de> for KineticsSpec {
    fn deserialize<De: Deserializer<'de>>(deserializer: De) -> Result<Self, De::Error> {
        text_or_table::deserialize(deserializer)
    }
}

impl<'de> Deserialize<'de> for MeltingSpec {
    fn deserialize<De: Deserializer<'de>>(deserializer: De) -> Result<Self, De::Error> {
        text_or_table::deserialize(deserializer)
    }
}
