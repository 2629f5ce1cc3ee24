//! Scene of the material alone, at one point.

use super::locate_error::located;
use super::{MaterialSpec, PictureOutput, Program, check_name};
use crate::error::Error;
use crate::history::{Leg, TemperatureHistory};
use crate::point::{Drive, Stepping};
use harness::report::Expect;
use harness::scene::{SceneError, Source};
use polycore::units::{Ratio, Temperature, TemperatureDifference, TemperatureRate, Time};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A scene of points.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointScene {
    /// Program of the scene: `crystfem`.
    pub program: Program,
    /// Title for tables and pictures.
    #[serde(default)]
    pub title: String,
    /// The material.
    pub material: Option<MaterialSpec>,
    /// Several materials by name, instead of `material`.
    #[serde(default)]
    pub materials: BTreeMap<String, MaterialSpec>,
    /// Temperature histories.
    #[serde(default)]
    pub point: Vec<PointSpec>,
    /// Temperatures of nodes from an analysis by another program.
    #[serde(default)]
    pub nodes: Vec<NodesSpec>,
    /// Pairs of materials to compare.
    #[serde(default)]
    pub compare: Vec<CompareSpec>,
    /// Files to write.
    #[serde(default)]
    pub output: PictureOutput,
    /// Expected results.
    #[serde(default)]
    pub expect: Vec<Expect>,
}

/// A pair of materials. `POINT.shift_at_0.5` is the temperature of the first minus that of the second,
/// `POINT.longer_to_0.99` its time over that of the second, minus 1.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CompareSpec {
    /// Name of the first material.
    pub material: String,
    /// Name of the second material.
    pub with: String,
}

/// A point: temperature ramps, a measured temperature history, or a lumped body with or without heat
/// exchange.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointSpec {
    /// Name of the point, prefix of its values: `NAME.alpha`, or `NAME.MATERIAL.alpha` with several
    /// materials.
    pub name: String,
    /// Names of the materials; default: all.
    pub materials: Option<Vec<String>>,
    /// Temperature at the start.
    pub start: Option<Temperature>,
    /// Ramps, holds and jumps of the temperature.
    #[serde(default)]
    pub legs: Vec<LegSpec>,
    /// Number of repetitions of the legs; default 1.
    pub cycles: Option<usize>,
    /// CSV file with the columns `time [unit]` and `temperature [unit]`, instead of `legs`.
    pub history: Option<PathBuf>,
    /// Surroundings of a lumped body, instead of `legs`.
    pub exchange: Option<ExchangeSpec>,
    /// Lumped body without heat exchange, instead of `legs`.
    #[serde(default)]
    pub adiabatic: bool,
    /// Duration of the run of a lumped body.
    pub duration: Option<Time>,
    /// Length of fixed steps; default: adaptive steps.
    pub time_step: Option<Time>,
    /// Temperature change in fixed steps; default: adaptive steps.
    pub temperature_step: Option<TemperatureDifference>,
    /// Largest change of α in an adaptive step; default 0.01.
    pub largest_change: Option<Ratio>,
    /// Largest change of temperature in an adaptive step; default 0.5 K.
    pub largest_temperature_change: Option<TemperatureDifference>,
    /// Requires that a value becomes non-finite; by default a non-finite value ends the run.
    #[serde(default)]
    pub non_finite: bool,
    /// Includes the point in `--quick` runs; default true.
    #[serde(default = "super::default_true")]
    pub quick: bool,
}

/// Nodes of a thermal analysis from another program, each with the material.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NodesSpec {
    /// Name of the analysis, of its values and of `NAME.vtkhdf`.
    pub name: String,
    /// Results file, times in s: `.frd` of CalculiX (ASCII, `NT` for all nodes), `.pvd` or `.vtu` of VTK, or
    /// Exodus II (`.e`, `.ex2`, `.exo`, `.g`).
    pub file: PathBuf,
    /// Name of the temperature array in VTK and Exodus II files; default: the only nodal scalar.
    pub array: Option<String>,
    /// Unit of the temperatures in the file.
    pub unit: NodesUnit,
    /// Temperature of all nodes at t = 0; default: the history starts at the first time of the file.
    pub start: Option<Temperature>,
    /// Name of the material; default: the only one.
    pub material: Option<String>,
    /// Includes the analysis in `--quick` runs; default true.
    #[serde(default = "super::default_true")]
    pub quick: bool,
}

/// Unit of temperatures in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
pub enum NodesUnit {
    /// Kelvin.
    K,
    /// Degrees Celsius.
    #[serde(rename = "degC")]
    Celsius,
}

impl NodesSpec {
    /// Returns the offset of its temperatures from K.
    pub fn zero(&self) -> f64 {
        match self.unit {
            NodesUnit::K => 0.0,
            NodesUnit::Celsius => 273.15,
        }
    }
}

/// Part of a history: a ramp (`to` with `rate` or `duration`), a jump (`to` alone) or a hold (`hold`).
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LegSpec {
    /// Target temperature.
    pub to: Option<Temperature>,
    /// Heating or cooling rate, above 0.
    pub rate: Option<TemperatureRate>,
    /// Duration of the ramp.
    pub duration: Option<Time>,
    /// Duration of the hold.
    pub hold: Option<Time>,
}

/// Newton's law of cooling: dU/dt = −c (T − T_a)/τ.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExchangeSpec {
    /// Temperature of the surroundings T_a.
    pub ambient: Temperature,
    /// Time constant τ.
    pub time_constant: Time,
}

impl PointScene {
    /// Returns name, block and key of each material; a single material has an empty name.
    ///
    /// # Errors
    /// Returns a [`SceneError`] for no materials, for both `material` and `materials`, and for invalid names.
    pub fn materials<'a>(
        &'a self,
        source: &Source,
    ) -> Result<Vec<(String, &'a MaterialSpec, String)>, SceneError> {
        match (&self.material, self.materials.is_empty()) {
            (Some(material), true) => Ok(vec![(String::new(), material, "material".to_owned())]),
            (None, false) => {
                let mut all = Vec::new();
                for (name, material) in &self.materials {
                    check_name(source, &format!("materials.{name}"), name)?;
                    all.push((name.clone(), material, format!("materials.{name}")));
                }
                Ok(all)
            }
            (None, true) => Err(source.missing("material", "the scene needs a block `[material]`")),
            (Some(_), false) => Err(source.conflict("materials", "material", "keep one of them")),
        }
    }

    /// Returns temperature history and time steps of each point, after checking everything that does not need
    /// a run.
    ///
    /// # Errors
    /// Returns a [`SceneError`] with key, value and allowed values.
    pub fn courses(&self, source: &Source) -> Result<Vec<(Drive, Stepping)>, SceneError> {
        if self.point.is_empty() && self.nodes.is_empty() {
            return Err(source.missing("point", "the scene needs at least one [[point]] or [[nodes]]"));
        }
        for (index, nodes) in self.nodes.iter().enumerate() {
            let key = |field: &str| format!("nodes[{index}].{field}");
            check_name(source, &key("name"), &nodes.name)?;
            let names = self.nodes[..index].iter().map(|other| &other.name);
            if names.chain(self.point.iter().map(|point| &point.name)).any(|name| *name == nodes.name) {
                let found = format!("`{}` twice", nodes.name);
                return Err(source.error(
                    &key("name"),
                    found,
                    "a different name for each point and analysis",
                ));
            }
            if !source.file(&nodes.file).is_file() {
                let found = source.file(&nodes.file).display().to_string();
                return Err(source.error(&key("file"), found, "an existing file"));
            }
            match &nodes.material {
                Some(name) => self.check_material(source, &key("material"), name)?,
                None if self.materials.len() > 1 => {
                    let known: Vec<&str> = self.materials.keys().map(String::as_str).collect();
                    return Err(source.missing(&key("material"), format!("name one of {}", known.join(", "))));
                }
                None => {}
            }
        }
        for (index, pair) in self.compare.iter().enumerate() {
            for (field, name) in [("material", &pair.material), ("with", &pair.with)] {
                self.check_material(source, &format!("compare[{index}].{field}"), name)?;
            }
        }
        let mut courses = Vec::new();
        for (index, point) in self.point.iter().enumerate() {
            let key = |field: &str| format!("point[{index}].{field}");
            check_name(source, &key("name"), &point.name)?;
            if self.point[..index].iter().any(|other| other.name == point.name) {
                return Err(source.error(
                    &key("name"),
                    format!("`{}` twice", point.name),
                    "a different name for each point",
                ));
            }
            for (i, name) in point.materials.iter().flatten().enumerate() {
                self.check_material(source, &key(&format!("materials[{i}]")), name)?;
            }
            courses.push((point.drive(source, &key)?, point.stepping(source, &key)?));
        }
        Ok(courses)
    }

    fn check_material(&self, source: &Source, key: &str, name: &str) -> Result<(), SceneError> {
        if self.materials.contains_key(name) {
            return Ok(());
        }
        let known: Vec<&str> = self.materials.keys().map(String::as_str).collect();
        if known.is_empty() {
            return Err(
                source.unexpected(key, "the only material is `[material]`, which has no name; remove it")
            );
        }
        Err(source.unknown(key, name, &known))
    }
}

impl PointSpec {
    fn drive(&self, source: &Source, key: &dyn Fn(&str) -> String) -> Result<Drive, SceneError> {
        let ways = [
            ("legs", !self.legs.is_empty()),
            ("history", self.history.is_some()),
            ("exchange", self.exchange.is_some()),
            ("adiabatic", self.adiabatic),
        ];
        let mut given = ways.iter().filter(|(_, given)| *given).map(|(name, _)| *name);
        let ways_text = "one of `legs`, `history`, `exchange`, `adiabatic`";
        let Some(way) = given.next() else {
            return Err(source.missing(&key("legs"), format!("write {ways_text}")));
        };
        if let Some(other) = given.next() {
            return Err(source.conflict(&key(other), &key(way), format!("keep {ways_text}")));
        }
        let lumped = matches!(way, "exchange" | "adiabatic");
        let needs = [
            ("start", self.start.is_some(), way != "history", way == "history"),
            ("duration", self.duration.is_some(), lumped, !lumped),
            ("cycles", self.cycles.is_some(), false, way != "legs"),
        ];
        for (name, given, needed, refused) in needs {
            if needed && !given {
                return Err(source.missing(&key(name), format!("`{way}` needs it")));
            }
            if refused && given {
                return Err(source.conflict(&key(name), &key(way), format!("remove `{name}`")));
            }
        }
        let start = self.start.map_or(0.0, |t| t.si());
        if lumped {
            let duration = self.duration.map_or(0.0, |t| t.si());
            let exchange = self.exchange.as_ref().map(|e| [e.ambient.si(), e.time_constant.si()]);
            let within = |name: &str, value: f64, unit| {
                if value > 0.0 {
                    Ok(())
                } else {
                    Err(source.error(&key(name), format!("{value} {unit}"), "above 0"))
                }
            };
            within("duration", duration, "s")?;
            within("start", start, "K")?;
            if let Some([ambient, constant]) = exchange {
                within("exchange.ambient", ambient, "K")?;
                within("exchange.time_constant", constant, "s")?;
            }
            return Ok(Drive::Lumped { start, exchange, duration });
        }
        if let Some(file) = &self.history {
            let history = TemperatureHistory::read(&source.file(file));
            return history.map(Drive::Prescribed).map_err(|error| located(source, &key("history"), &error));
        }
        let cycles = self.cycles.unwrap_or(1);
        if !(1..=100_000).contains(&cycles) {
            return Err(source.error(&key("cycles"), cycles, "1 to 100000"));
        }
        let mut legs = Vec::new();
        for (index, leg) in self.legs.iter().enumerate() {
            legs.push(leg.leg(source, &key(&format!("legs[{index}]")))?);
        }
        let legs: Vec<Leg> = std::iter::repeat_n(legs, cycles).flatten().collect();
        TemperatureHistory::from_legs(start, &legs)
            .map(Drive::Prescribed)
            .map_err(|error: Error| located(source, &key("legs"), &error))
    }

    fn stepping(&self, source: &Source, key: &dyn Fn(&str) -> String) -> Result<Stepping, SceneError> {
        let adaptive = [
            ("largest_change", self.largest_change.map(|x| x.si())),
            ("largest_temperature_change", self.largest_temperature_change.map(|x| x.si())),
        ];
        let fixed = [
            ("time_step", self.time_step.map(|x| x.si())),
            ("temperature_step", self.temperature_step.map(|x| x.si())),
        ];
        for (name, value) in adaptive.iter().chain(&fixed) {
            if let Some(value) = value.filter(|value| *value <= 0.0) {
                return Err(source.error(&key(name), value, "above 0"));
            }
        }
        let mut given = fixed.iter().chain(&adaptive).filter(|(_, value)| value.is_some());
        if let (Some((first, _)), Some((second, _))) = (given.next(), given.next())
            && fixed.iter().any(|(name, _)| name == first)
        {
            return Err(source.conflict(&key(second), &key(first), "keep one of them"));
        }
        let Stepping::Adaptive { degree, kelvin } = Stepping::default() else {
            return Ok(Stepping::default());
        };
        Ok(match (fixed[0].1, fixed[1].1) {
            (Some(seconds), _) => Stepping::Seconds(seconds),
            (_, Some(kelvin)) => Stepping::Kelvin(kelvin),
            _ => Stepping::Adaptive {
                degree: adaptive[0].1.unwrap_or(degree),
                kelvin: adaptive[1].1.unwrap_or(kelvin),
            },
        })
    }
}

impl LegSpec {
    fn leg(&self, source: &Source, key: &str) -> Result<Leg, SceneError> {
        let si = (self.to.map(|t| t.si()), self.rate.map(|r| r.si()), self.duration.map(|t| t.si()));
        match (si, self.hold.map(|t| t.si())) {
            ((None, None, None), Some(duration)) => Ok(Leg::Hold { duration }),
            ((Some(to), Some(rate), None), None) => Ok(Leg::Rate { to, rate }),
            ((Some(to), None, duration), None) => Ok(Leg::Time { to, duration: duration.unwrap_or(0.0) }),
            _ => {
                let allowed = "`hold`, or `to` with `rate` or `duration` (without both: a jump)";
                Err(source.error(key, "an invalid combination of keys", allowed))
            }
        }
    }
}
