//! Values over time: a constant, a table, a CSV file, a sine, or a setting of a G-code file.

use super::locate_error::{located, located_in};
use super::text_or_table::{self, TextOrTable};
use crate::boundary::Schedule;
use crate::table::{TableColumn, read};
use harness::scene::{SceneError, Source};
use polycore::units::dimension::TimeDimension;
use polycore::units::{Dimension, Quantity, Time};
use serde::{Deserialize, Deserializer};
use std::path::PathBuf;

/// A constant (`"80 degC"`), a table (`{ time = […], value = […] }`), a file (`{ file = "chamber.csv" }`), or
/// a sine (`{ low = …, high = …, period = … }`). Tables are linear between their times and constant outside.
#[derive(Clone, Debug)]
pub enum ScheduleSpec<D> {
    /// Constant value.
    Constant(Quantity<D>),
    /// Values over time.
    Over(TimesSpec<D>),
}

/// Values over time.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, bound = "D: Dimension")]
pub struct TimesSpec<D> {
    /// Times, increasing.
    #[serde(default)]
    pub time: Vec<Time>,
    /// Value at each time.
    #[serde(default)]
    pub value: Vec<Quantity<D>>,
    /// CSV file with the columns `time [unit]` and `value [unit]`, instead of `time` and `value`.
    pub file: Option<PathBuf>,
    /// Lowest value of a sine that passes its mean upwards at t = 0, instead of `time` and `value`.
    pub low: Option<Quantity<D>>,
    /// Highest value of the sine.
    pub high: Option<Quantity<D>>,
    /// Period of the sine.
    pub period: Option<Time>,
    /// Setting of a G-code `file`: temperature of its nozzle or bed, or its fan from `low` (off) to `high`.
    pub of: Option<FileSetting>,
    /// Temperature towards which a bed cools when it is switched off or set lower; default 25 °C.
    pub cools_to: Option<Quantity<D>>,
    /// Time constant of this cooling; default 10 min.
    pub cooling_time: Option<Time>,
}

/// Setting of a G-code file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FileSetting {
    /// Nozzle temperature (M104 and M109).
    Nozzle,
    /// Bed temperature (M140 and M190).
    Bed,
    /// Fan speed (M106 and M107).
    Fan,
}

/// Parameters of a sine and their keys.
const SINE_KEYS: [(&str, &str); 3] = [("low value", "low"), ("high value", "high"), ("period, s", "period")];

impl<D: Dimension + Copy> ScheduleSpec<D> {
    /// Builds the schedule in SI units.
    ///
    /// # Errors
    /// Returns a [`SceneError`] for several of table, file and sine, missing values, times that do not
    /// increase, and unreadable files.
    pub fn build(&self, source: &Source, key: &str) -> Result<Schedule, SceneError> {
        let over = match self {
            Self::Constant(value) => return Ok(Schedule::constant(value.si())),
            Self::Over(over) => over,
        };
        let table = !(over.time.is_empty() && over.value.is_empty());
        if let Some(of) = over.of {
            return over.gcode_schedule(source, key, of, table);
        }
        if over.cools_to.is_some() || over.cooling_time.is_some() {
            let name = if over.cools_to.is_some() { "cools_to" } else { "cooling_time" };
            return Err(source.unexpected(
                &format!("{key}.{name}"),
                "it belongs to `of = \"bed\"` of a G-code file; remove it",
            ));
        }
        if let Some(swing) = over.sine(source, key, table)? {
            return Ok(swing);
        }
        let (times, values) = match &over.file {
            Some(_) if table => {
                let (file, time) = (format!("{key}.file"), format!("{key}.time"));
                return Err(source.conflict(&file, &time, "keep the file or the table"));
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
    /// Returns the sine, if it is one; `table` tells if there is a table beside it.
    fn sine(&self, source: &Source, key: &str, table: bool) -> Result<Option<Schedule>, SceneError> {
        if self.low.is_none() && self.high.is_none() && self.period.is_none() {
            return Ok(None);
        }
        if table || self.file.is_some() {
            let (low, other) = (format!("{key}.low"), if table { "time" } else { "file" });
            let why = "keep the sine, or the table or file";
            return Err(source.conflict(&low, &format!("{key}.{other}"), why));
        }
        let missing =
            |name: &str| source.missing(&format!("{key}.{name}"), "a sine needs `low`, `high` and `period`");
        let low = self.low.ok_or_else(|| missing("low"))?;
        let high = self.high.ok_or_else(|| missing("high"))?;
        let period = self.period.ok_or_else(|| missing("period"))?;
        let swing = Schedule::swing(low.si(), high.si(), period.si());
        swing.map(Some).map_err(|error| located_in(source, key, &SINE_KEYS, &error))
    }
}

impl<D: Dimension> TextOrTable for ScheduleSpec<D> {
    type Table = TimesSpec<D>;

    fn expected() -> String {
        let others = "{ time = […], value = […] }, { file = … }, { file = …, of = \"bed\" } or { low = …, \
            high = …, period = … }";
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
             "description": "constant, or values over time: a table (linear between its times, constant \
                 outside), a file, or a sine",
            "anyOf": [constant, {
                "type": "object",
                "properties": {
                    "time": { "type": "array", "items": time, "description": "Times, increasing." },
                    "value": { "type": "array", "items": constant, "description": "Value at each time." },
                    "file": {
                        "type": "string",
                        "description": "CSV file with the columns `time [unit]` and `value [unit]`, instead \
                            of `time` and `value`.",
                    },
                     "low": {
                                            "anyOf": [constant],
                                            "description": "Lowest value of a sine that passes its mean \
                                                upwards at t = 0.",
                                        },
                    "high": { "anyOf": [constant], "description": "Highest value of the sine." },
                    "period": { "anyOf": [time], "description": "Period of the sine." },
                    "of": {
                        "type": "string",
                        "enum": ["nozzle", "bed", "fan"],
                         "description": "Setting of a G-code `file`: temperature of nozzle or bed, or fan \
                             from `low` (off) to `high`.",
                    },
                    "cools_to": {
                        "anyOf": [constant],
                         "description": "Temperature towards which a bed cools when switched off or set \
                             lower; default 25 °C.",
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
        text_or_table::deserialize(deserializer)
    }
}
