//! Keys of a fit scene.

use super::locate_error::located;
use crate::fit::{Baseline, DEGREES};
use crate::table::{TableColumn, read};
use harness::scene::{SceneError, Source};
use polycore::units::dimension::{RatioDimension, TemperatureDimension, TimeDimension};
use polycore::units::{Mass, MolarEnergy, SpecificEnergy, Temperature, TemperatureRate, Time};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use std::path::{Path, PathBuf};

/// Laws that can be fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FitLaw {
    /// Avrami's law, Eq. (4.2), from one isothermal run: columns `time` and `alpha`.
    Avrami,
    /// Ozawa's law, Eq. (4.3), at each of `temperatures`, from runs at constant cooling rates: columns
    /// `temperature` and `alpha`.
    Ozawa,
    /// Nakamura's law, Eqs (4.4) to (4.7): K₀, K_G and n, from runs at constant cooling rates (`rate`;
    /// columns `temperature` and `alpha`) or along any histories that begin in the melt (columns `time`,
    /// `temperature` and `alpha`).
    Nakamura,
    /// K₀ and K_G of the material of a part, from α at its probes (columns `time` and `alpha`); each trial
    /// runs the part.
    Part,
}

/// A fit.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FitSpec {
    /// Name of the fit, prefix of its values: `NAME.half_time`, `NAME.half_time.lower`, ….
    pub name: String,
    /// Law to fit.
    pub law: FitLaw,
    /// Files of measurements.
    pub data: Vec<DataSpec>,
    /// Settings for files with the raw heat flow of a calorimeter: columns `time` and `heat_flow` instead of
    /// `alpha`.
    pub heat_flow: Option<HeatFlowSpec>,
    /// Temperatures at which `ozawa` compares the cooling rates.
    #[serde(default)]
    pub temperatures: Vec<Temperature>,
    /// Equilibrium melting temperature T₀, for `nakamura`.
    pub equilibrium_melting: Option<Temperature>,
    /// Temperature T∞ of frozen chains, for `nakamura`.
    pub frozen: Option<Temperature>,
    /// Glass transition T_g, for `nakamura`, instead of `frozen`: T∞ = T_g − 30 K.
    pub glass_transition: Option<Temperature>,
    /// Activation energy U, for `nakamura`; default 6270 J/mol.
    pub activation_energy: Option<MolarEnergy>,
    /// Cooling rates to predict, for `nakamura` with a `rate` for all data.
    #[serde(default)]
    pub predict: Vec<TemperatureRate>,
    /// Scene of the part, relative to this scene, for `part`; its constants are the first trial.
    pub part: Option<PathBuf>,
    /// Material of the part whose constants are fitted, for `part`; default: the only one that crystallizes.
    pub material: Option<String>,
}

/// A file of measurements.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DataSpec {
    /// CSV file, relative to the scene.
    pub file: PathBuf,
    /// Probe of the part at the place of the measurement, for `part`.
    pub probe: Option<String>,
    /// Cooling rate.
    pub rate: Option<TemperatureRate>,
    /// Mass of the sample, for heat flows in W.
    pub mass: Option<Mass>,
    /// Start of the integration of the heat flow, a time or a temperature; default: the first row.
    #[schemars(with = "Option<String>")]
    pub from: Option<Limit>,
    /// End of the integration; default: the last row.
    #[schemars(with = "Option<String>")]
    pub to: Option<Limit>,
}

/// Interpretation of the heat flows of a fit.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HeatFlowSpec {
    /// Direction of exothermal peaks.
    pub exothermal: Direction,
    /// Baseline that is subtracted.
    #[serde(default)]
    pub baseline: Baseline,
    /// Heat of fusion of the perfect crystal, for the degree of crystallinity.
    pub latent_heat: Option<SpecificEnergy>,
}

/// Direction of exothermal peaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// Positive values are released heat.
    Up,
    /// Positive values are absorbed heat.
    Down,
}

/// Limit of the integration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    /// A time.
    Time(Time),
    /// Time at which the cooling passes this temperature.
    Temperature(Temperature),
}

impl<'de> Deserialize<'de> for Limit {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        let temperature = || text.parse().map(Self::Temperature);
        text.parse().map(Self::Time).or_else(|_| temperature()).map_err(|why| {
            D::Error::custom(format!(
                "found `{text}`; allowed: a time, e.g. \"90 s\", or a temperature; {why}"
            ))
        })
    }
}

pub(super) fn time() -> TableColumn {
    TableColumn::new::<TimeDimension>("time")
}

pub(super) fn temperature() -> TableColumn {
    TableColumn::new::<TemperatureDimension>("temperature")
}

/// Column of α, from 0 to 1.
pub(super) fn alpha() -> TableColumn {
    TableColumn::new::<RatioDimension>("alpha").within(DEGREES[0], DEGREES[1])
}

/// Reads a CSV file at a path relative to the scene.
pub(super) fn table<const N: usize>(
    source: &Source,
    key: &str,
    file: &Path,
    columns: [TableColumn; N],
) -> Result<[Vec<f64>; N], SceneError> {
    read(&source.file(file), columns).map_err(|error| located(source, key, &error))
}
