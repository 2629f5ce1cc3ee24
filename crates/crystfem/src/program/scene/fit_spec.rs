//! What a scene of a fit says.

use super::fault::located;
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
    /// Eq. (4.2), from one isothermal run: columns `time` and `alpha`.
    Avrami,
    /// Eq. (4.3), at each of `temperatures`, from runs at constant cooling rates: columns `temperature` and `alpha`.
    Ozawa,
    /// Eqs (4.4) to (4.7): K₀, K_G and n, from runs at constant cooling rates (`rate`; columns `temperature` and `alpha`) or
    /// along any histories that begin in the melt (columns `time`, `temperature` and `alpha`).
    Nakamura,
    /// K₀ and K_G of a part's material, from α at its probes (columns `time` and `alpha`): each trial runs the part.
    Part,
}

/// One fit.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FitSpec {
    /// Its name: the values are `NAME.half_time`, `NAME.half_time.lower` …
    pub name: String,
    /// Law.
    pub law: FitLaw,
    /// Measurements.
    pub data: Vec<DataSpec>,
    /// The files have raw heat flow of a calorimeter: columns `time` and `heat_flow` in place of `alpha`.
    pub heat_flow: Option<HeatFlowSpec>,
    /// Where rates are compared, of `ozawa`.
    #[serde(default)]
    pub temperatures: Vec<Temperature>,
    /// Equilibrium melting temperature T₀, of `nakamura`.
    pub equilibrium_melting: Option<Temperature>,
    /// Temperature T∞ of frozen chains, of `nakamura`.
    pub frozen: Option<Temperature>,
    /// Glass transition T_g, of `nakamura`, instead of `frozen`: T∞ = T_g − 30 K.
    pub glass_transition: Option<Temperature>,
    /// Activation energy U, of `nakamura`; default 6270 J/mol.
    pub activation_energy: Option<MolarEnergy>,
    /// Scene of a part, relative to this scene, of `part`: its constants are the first trial.
    pub part: Option<PathBuf>,
    /// The material of the part whose constants are fitted, of `part`; default the only one that crystallizes.
    pub material: Option<String>,
}

/// A table of measurements.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DataSpec {
    /// CSV file, relative to the scene.
    pub file: PathBuf,
    /// The probe of the part where it was measured, of `part`.
    pub probe: Option<String>,
    /// Cooling rate.
    pub rate: Option<TemperatureRate>,
    /// Mass of the sample, of heat flow in W.
    pub mass: Option<Mass>,
    /// Where the integration of the heat flow begins, a time or a temperature; default the first row.
    #[schemars(with = "Option<String>")]
    pub from: Option<Limit>,
    /// Where it ends; default the last row.
    #[schemars(with = "Option<String>")]
    pub to: Option<Limit>,
}

/// How the heat flows of a fit are to be read.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HeatFlowSpec {
    /// Where exothermal peaks point.
    pub exothermal: Direction,
    /// What is subtracted.
    #[serde(default)]
    pub baseline: Baseline,
    /// Heat of fusion of the perfect crystal: gives the degree of crystallinity.
    pub latent_heat: Option<SpecificEnergy>,
}

/// Direction of a peak.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// Positive values are heat given off.
    Up,
    /// Positive values are heat taken up.
    Down,
}

/// A limit of integration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    /// The time.
    Time(Time),
    /// Where this temperature is passed on cooling.
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

/// Column of α.
pub(super) fn alpha() -> TableColumn {
    TableColumn::new::<RatioDimension>("alpha").within(DEGREES[0], DEGREES[1])
}

/// Reads a table beside the scene.
pub(super) fn table<const N: usize>(
    source: &Source,
    key: &str,
    file: &Path,
    columns: [TableColumn; N],
) -> Result<[Vec<f64>; N], SceneError> {
    read(&source.file(file), columns).map_err(|error| located(source, key, &error))
}
