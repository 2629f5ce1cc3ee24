//! The scene of the material alone, at one point.

use super::fault::located;
use super::{MaterialSpec, OutputSpec, Program, check_name};
use crate::error::Error;
use crate::history::{Leg, TemperatureHistory};
use crate::point::{Drive, Stepping};
use harness::report::Expect;
use harness::scene::{SceneError, Source};
use polycore::units::{Ratio, Temperature, TemperatureDifference, TemperatureRate, Time};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A whole scene.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointScene {
    /// The program that runs it: `crystfem`.
    pub program: Program,
    /// One line for tables and pictures.
    #[serde(default)]
    pub title: String,
    /// The material.
    pub material: Option<MaterialSpec>,
    /// Several, by name, instead.
    #[serde(default)]
    pub materials: BTreeMap<String, MaterialSpec>,
    /// Temperature histories.
    #[serde(default)]
    pub point: Vec<PointSpec>,
    /// Temperatures of nodes that another program computed.
    #[serde(default)]
    pub nodes: Vec<NodesSpec>,
    /// Pairs of materials whose events are compared.
    #[serde(default)]
    pub compare: Vec<CompareSpec>,
    /// Files to write.
    #[serde(default)]
    pub output: OutputSpec,
    /// Expected results.
    #[serde(default)]
    pub expect: Vec<Expect>,
}

/// Two materials: `POINT.shift_at_0.5` is the temperature of the first less that of the second, and
/// `POINT.longer_to_0.99` its time over that of the second, less 1.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CompareSpec {
    /// Name of the first material.
    pub material: String,
    /// Name of the second.
    pub with: String,
}

/// One run: legs or a table of temperatures, or a lumped body that exchanges heat or none.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointSpec {
    /// Its name: the values are `NAME.alpha`, or `NAME.MATERIAL.alpha` with several materials.
    pub name: String,
    /// Names of materials; default: all.
    pub materials: Option<Vec<String>>,
    /// Temperature at the start.
    pub start: Option<Temperature>,
    /// Ramps, holds and jumps.
    #[serde(default)]
    pub legs: Vec<LegSpec>,
    /// Number of repetitions of the legs; default 1.
    pub cycles: Option<usize>,
    /// CSV file with the columns `time [unit]` and `temperature [unit]`, instead of legs.
    pub history: Option<PathBuf>,
    /// Surroundings of a lumped body, instead of legs.
    pub exchange: Option<ExchangeSpec>,
    /// A lumped body that exchanges no heat, instead of legs.
    #[serde(default)]
    pub adiabatic: bool,
    /// Duration, for a lumped body.
    pub duration: Option<Time>,
    /// Steps of the same time; default: adaptive.
    pub time_step: Option<Time>,
    /// Steps of the same change of temperature; default: adaptive.
    pub temperature_step: Option<TemperatureDifference>,
    /// Largest change of α in an adaptive step; default 0.01.
    pub largest_change: Option<Ratio>,
    /// Largest change of temperature in an adaptive step; default 0.5 K.
    pub largest_temperature_change: Option<TemperatureDifference>,
    /// Whether some value must become non-finite; otherwise the first such value ends the run.
    #[serde(default)]
    pub non_finite: bool,
    /// Part of `--quick` runs.
    #[serde(default = "yes")]
    pub quick: bool,
}

fn yes() -> bool {
    true
}

/// The material at every node of a thermal analysis of another program.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NodesSpec {
    /// Its name: of `NAME.vtkhdf` and of the values.
    pub name: String,
    /// `.frd` of CalculiX (ASCII, with `NT` of all nodes), `.pvd` or `.vtu` of VTK, or Exodus II (`.e`, `.ex2`, `.exo`, `.g`); times in s.
    pub file: PathBuf,
    /// Name of the temperature in VTK's files and Exodus II; default: the only scalar of nodes.
    pub array: Option<String>,
    /// Unit of its temperatures.
    pub unit: NodesUnit,
    /// Temperature of all nodes at t = 0; default: the history begins at the first time of the file.
    pub start: Option<Temperature>,
    /// Name of the material; default: the only one.
    pub material: Option<String>,
    /// Part of `--quick` runs.
    #[serde(default = "yes")]
    pub quick: bool,
}

/// Units of temperature in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
pub enum NodesUnit {
    /// Kelvin.
    K,
    /// Degrees Celsius.
    #[serde(rename = "degC")]
    Celsius,
}

impl NodesSpec {
    /// What is added to its temperatures, K.
    pub fn zero(&self) -> f64 {
        match self.unit {
            NodesUnit::K => 0.0,
            NodesUnit::Celsius => 273.15,
        }
    }
}

/// A ramp (`to` with `rate` or `duration`), a jump (`to` alone) or a hold (`hold`).
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LegSpec {
    /// Target temperature.
    pub to: Option<Temperature>,
    /// Rate, above 0 for both heating and cooling.
    pub rate: Option<TemperatureRate>,
    /// Duration.
    pub duration: Option<Time>,
    /// Duration at constant temperature.
    pub hold: Option<Time>,
}

/// Newton's cooling: dU/dt = −c (T − T_a)/τ.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExchangeSpec {
    /// Temperature of the surroundings T_a.
    pub ambient: Temperature,
    /// Time constant τ.
    pub time_constant: Time,
}

impl PointScene {
    /// The materials by name; a single one has the name ``.
    ///
    /// # Errors
    /// A [`SceneError`] for none, for both ways to give them, and for what [`MaterialSpec::build`] refuses.
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
            (None, true) => Err(source.error("material", "nothing", "a block `[material]`")),
            (Some(_), false) => {
                Err(source.error("materials", "`materials` together with `material`", "one of them"))
            }
        }
    }

    /// What drives each point and how its time is divided, after a check of all that can be judged without running.
    ///
    /// # Errors
    /// A [`SceneError`] that names the key, the value found and what is allowed.
    pub fn courses(&self, source: &Source) -> Result<Vec<(Drive, Stepping)>, SceneError> {
        if self.point.is_empty() && self.nodes.is_empty() {
            return Err(source.error("point", "nothing", "at least one [[point]] or [[nodes]]"));
        }
        for (index, nodes) in self.nodes.iter().enumerate() {
            let key = |field: &str| format!("nodes[{index}].{field}");
            check_name(source, &key("name"), &nodes.name)?;
            let names = self.nodes[..index].iter().map(|other| &other.name);
            if names.chain(self.point.iter().map(|point| &point.name)).any(|name| *name == nodes.name) {
                let found = format!("`{}` a second time", nodes.name);
                return Err(source.error(&key("name"), found, "another name"));
            }
            if !source.file(&nodes.file).is_file() {
                let found = source.file(&nodes.file).display().to_string();
                return Err(source.error(&key("file"), found, "a file that is there"));
            }
            match &nodes.material {
                Some(name) => self.check_material(source, &key("material"), name)?,
                None if self.materials.len() > 1 => {
                    let known: Vec<&str> = self.materials.keys().map(String::as_str).collect();
                    return Err(source.error(&key("material"), "nothing", known.join(", ")));
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
                    format!("`{}` a second time", point.name),
                    "another name",
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
            return Err(source.error(key, format!("`{name}`"), "nothing: there is only `[material]`"));
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
        let allowed = "one of `legs`, `history`, `exchange`, `adiabatic`";
        let Some(way) = given.next() else {
            return Err(source.error(&key("legs"), "nothing that drives the temperature", allowed));
        };
        if let Some(other) = given.next() {
            return Err(source.error(&key(other), format!("`{other}` together with `{way}`"), allowed));
        }
        let lumped = matches!(way, "exchange" | "adiabatic");
        let needs = [
            ("start", self.start.is_some(), way != "history", way == "history"),
            ("duration", self.duration.is_some(), lumped, !lumped),
            ("cycles", self.cycles.is_some(), false, way != "legs"),
        ];
        for (name, given, needed, refused) in needs {
            if needed && !given {
                return Err(source.error(&key(name), "nothing", format!("`{name}`: `{way}` needs it")));
            }
            if refused && given {
                return Err(source.error(&key(name), format!("`{name}` together with `{way}`"), "nothing"));
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
            let found = format!("`{second}` together with `{first}`");
            return Err(source.error(&key(second), found, "one of them"));
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
                let allowed = "`hold`, or `to` with `rate` or `duration` (or neither: a jump)";
                Err(source.error(key, "another set of keys", allowed))
            }
        }
    }
}
