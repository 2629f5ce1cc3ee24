//! Values over time: written as a constant, as a table, as a CSV file, or as a swing.

use super::either::{self, TextOrTable};
use super::fault::{located, located_in};
use crate::boundary::Schedule;
use crate::table::{TableColumn, read};
use harness::scene::{SceneError, Source};
use polycore::units::dimension::TimeDimension;
use polycore::units::{Dimension, Quantity, Time};
use serde::{Deserialize, Deserializer};
use std::path::PathBuf;

/// A constant (`"80 degC"`), a table (`{ time = […], value = […] }`) or a file (`{ file = "chamber.csv" }`): linear
/// between the given times and constant outside of them; or a swing (`{ low = …, high = …, period = … }`).
#[derive(Clone, Debug)]
pub enum ScheduleSpec<D> {
    /// The same always.
    Constant(Quantity<D>),
    /// Over time.
    Over(TimesSpec<D>),
}

/// Values over time.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, bound = "D: Dimension")]
pub struct TimesSpec<D> {
    /// Increasing times.
    #[serde(default)]
    pub time: Vec<Time>,
    /// A value for each.
    #[serde(default)]
    pub value: Vec<Quantity<D>>,
    /// Or a CSV file with the columns `time [unit]` and `value [unit]`.
    pub file: Option<PathBuf>,
    /// Or a sine between `low` and `high` that passes their middle upwards at t = 0.
    pub low: Option<Quantity<D>>,
    /// See `low`.
    pub high: Option<Quantity<D>>,
    /// Of the sine.
    pub period: Option<Time>,
    /// Of `file`, where that is G-code: the temperature of its nozzle or bed, or its fan from `low` (off) to `high`.
    pub of: Option<FileSetting>,
    /// Of a bed: what it cools towards once it is switched off or set lower; default 25 °C.
    pub cools_to: Option<Quantity<D>>,
    /// Time constant of this cooling; default 10 min.
    pub cooling_time: Option<Time>,
}

/// What a G-code file sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FileSetting {
    /// M104 and M109.
    Nozzle,
    /// M140 and M190.
    Bed,
    /// M106 and M107.
    Fan,
}

/// Where parameters of a swing stand in its block.
const SWING_KEYS: [(&str, &str); 3] = [("low value", "low"), ("high value", "high"), ("period, s", "period")];

impl<D: Dimension + Copy> ScheduleSpec<D> {
    /// The schedule, in SI units.
    ///
    /// # Errors
    /// Several of table, file and swing, a swing without one of its keys, a table with a gap, times that do not increase, and a file that is no such table.
    pub fn build(&self, source: &Source, key: &str) -> Result<Schedule, SceneError> {
        let over = match self {
            Self::Constant(value) => return Ok(Schedule::constant(value.si())),
            Self::Over(over) => over,
        };
        let table = !(over.time.is_empty() && over.value.is_empty());
        if let Some(of) = over.of {
            return over.of_file(source, key, of, table);
        }
        if over.cools_to.is_some() || over.cooling_time.is_some() {
            let name = if over.cools_to.is_some() { "cools_to" } else { "cooling_time" };
            return Err(source.error(
                &format!("{key}.{name}"),
                "cooling of no bed",
                "`of = \"bed\"` of a G-code file",
            ));
        }
        if let Some(swing) = over.swing(source, key, table)? {
            return Ok(swing);
        }
        let (times, values) = match &over.file {
            Some(_) if table => {
                return Err(source.error(key, "a file beside a table", "one of them"));
            }
            Some(file) => {
                let path = source.file(file);
                let columns = [TableColumn::new::<TimeDimension>("time"), TableColumn::new::<D>("value")];
                let [times, values] =
                    read(&path, columns).map_err(|error| located(source, &format!("{key}.file"), &error))?;
                (times, values)
            }
            None => (over.time.iter().map(|t| t.si()).collect(), over.value.iter().map(|v| v.si()).collect()),
        };
        if times.len() != values.len() {
            let allowed = format!("a value for each of the {} times", times.len());
            return Err(source.error(&format!("{key}.value"), format!("{} values", values.len()), allowed));
        }
        let pairs: Vec<(f64, f64)> = times.into_iter().zip(values).collect();
        let place = if over.file.is_some() { "file" } else { "time" };
        Schedule::linear(&pairs).map_err(|error| located(source, &format!("{key}.{place}"), &error))
    }
}

impl<D: Dimension + Copy> TimesSpec<D> {
    /// The swing, where it is one; `table`: there is a table beside it.
    fn swing(&self, source: &Source, key: &str, table: bool) -> Result<Option<Schedule>, SceneError> {
        if self.low.is_none() && self.high.is_none() && self.period.is_none() {
            return Ok(None);
        }
        if table || self.file.is_some() {
            return Err(source.error(key, "a sine together with a table or a file", "one of them"));
        }
        let missing =
            |name: &str| source.error(&format!("{key}.{name}"), "nothing", "`low`, `high` and `period`");
        let low = self.low.ok_or_else(|| missing("low"))?;
        let high = self.high.ok_or_else(|| missing("high"))?;
        let period = self.period.ok_or_else(|| missing("period"))?;
        let swing = Schedule::swing(low.si(), high.si(), period.si());
        swing.map(Some).map_err(|error| located_in(source, key, &SWING_KEYS, &error))
    }
}

impl<D: Dimension> TextOrTable for ScheduleSpec<D> {
    type Table = TimesSpec<D>;

    fn expected() -> String {
        let others = "{ time = […], value = […] }, { file = … }, { file = …, of = \"bed\" } or { low = …, high = …, period = … }";
        format!("{}, e.g. \"{}\", {others}", D::NAME, D::EXAMPLE)
    }

    fn from_text<E: serde::de::Error>(text: &str) -> Result<Self, E> {
        text.parse().map(Self::Constant).map_err(E::custom)
    }

    fn from_table(table: TimesSpec<D>) -> Self {
        Self::Over(table)
    }
}

impl<D: Dimension> schemars::JsonSchema for ScheduleSpec<D> {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        format!("{}_over_time", Quantity::<D>::schema_name()).into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let constant = generator.subschema_for::<Quantity<D>>();
        let time = generator.subschema_for::<Time>();
        schemars::json_schema!({
            "description": "a constant, or values over time: linear between the times, constant outside of them, or a sine",
            "anyOf": [constant, {
                "type": "object",
                "properties": {
                    "time": { "type": "array", "items": time, "description": "Increasing times." },
                    "value": { "type": "array", "items": constant, "description": "A value for each." },
                    "file": {
                        "type": "string",
                        "description": "Or a CSV file with the columns `time [unit]` and `value [unit]`.",
                    },
                    "low": { "anyOf": [constant], "description": "Or a sine from here to `high`, its middle upwards at t = 0." },
                    "high": { "anyOf": [constant], "description": "Other end of the sine." },
                    "period": { "anyOf": [time], "description": "Of the sine." },
                    "of": {
                        "type": "string",
                        "enum": ["nozzle", "bed", "fan"],
                        "description": "Of a G-code `file`: a temperature that it sets, or its fan from `low` (off) to `high`.",
                    },
                    "cools_to": {
                        "anyOf": [constant],
                        "description": "Of a bed: what it cools towards once it is switched off or set lower; default 25 °C.",
                    },
                    "cooling_time": {
                        "anyOf": [time],
                        "description": "Time constant of this cooling; default 10 min.",
                    },
                },
                "additionalProperties": false,
            }],
        })
    }
}

impl<'de, D: Dimension> Deserialize<'de> for ScheduleSpec<D> {
    fn deserialize<De: Deserializer<'de>>(deserializer: De) -> Result<Self, De::Error> {
        either::deserialize(deserializer)
    }
}
