//! Report of a run: values and curves, judged expectations, work, seconds by phase, provenance.
//!
//! [`Report::write`] puts it all into `report.json`, whole or not at all. JSON has no NaN; a non-finite
//! number is written as the string `"NaN"`, `"inf"` or `"-inf"`, listed under `non_finite`, and fails the
//! report.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::{Deserialize, Serialize};

use polycore::Error;

mod expect;
mod number;
mod provenance;
mod quantity;
mod units;

pub use expect::{Bound, Expect, Judgement, Kind, Tolerance};
pub use provenance::{Git, Host, Provenance};
pub use quantity::{Named, Quantity};
pub(crate) use units::RequestedUnit;
pub use units::{SceneUnits, ShownUnit};

/// The name of the file that [`Report::write`] leaves in the output directory.
pub const FILE_NAME: &str = "report.json";

/// A run's result.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Report {
    /// True if all expectations are met and all numbers finite.
    pub passed: bool,
    /// Named scalars and curves.
    pub values: BTreeMap<String, Value>,
    /// The scene's expectations with what was found.
    pub expect: Vec<Judgement>,
    /// Names (and where needed the column) of values that are NaN or infinite.
    pub non_finite: Vec<String>,
    /// Runs of a stability suite.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub trials: Vec<Trial>,
    /// Counts of work: steps, iterations, bond evaluations.
    pub work: BTreeMap<String, u64>,
    /// Seconds by phase.
    #[serde(with = "number::map")]
    pub seconds: BTreeMap<String, f64>,
    /// Program, scene and machine.
    pub provenance: Provenance,
}

/// A named result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// A number.
    Scalar {
        /// Number, in `unit`.
        #[serde(with = "number")]
        value: f64,
        /// Unit, empty if dimensionless.
        unit: String,
    },
    /// Columns of equal length.
    Curve {
        /// Columns in the order given.
        columns: Vec<Column>,
    },
}

/// A column of a curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Column {
    /// Heading.
    pub name: String,
    /// Unit, empty if dimensionless.
    pub unit: String,
    /// Numbers.
    #[serde(with = "number::list")]
    pub data: Vec<f64>,
}

/// A run of a stability suite.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Trial {
    /// Name.
    pub what: String,
    /// Expected behaviour, as the scene has it.
    pub description: String,
    /// Observed behaviour.
    pub observed: String,
    /// Iterations or steps, where they are counted.
    pub iterations: Option<u64>,
    /// True if the run met its expectations.
    pub passed: bool,
}

impl Report {
    /// Returns an empty report; `scene_text` is the scene as it was run (with its defaults resolved, where
    /// known).
    pub fn new(program: &str, version: &str, scene_text: &str) -> Self {
        Self {
            passed: true,
            values: BTreeMap::new(),
            expect: Vec::new(),
            non_finite: Vec::new(),
            trials: Vec::new(),
            work: BTreeMap::new(),
            seconds: BTreeMap::new(),
            provenance: Provenance::new(program, version, scene_text),
        }
    }

    /// Adds or replaces a scalar.
    pub fn value(&mut self, quantity: impl Into<Named>, value: f64) -> &mut Self {
        let Named { name, unit } = quantity.into();
        self.set(&name, Value::Scalar { value, unit })
    }

    /// Adds or replaces a curve of `(column, unit, data)`.
    pub fn curve(&mut self, name: &str, columns: &[(&str, &str, Vec<f64>)]) -> &mut Self {
        let column = |(name, unit, data): &(&str, &str, Vec<f64>)| Column {
            name: (*name).to_owned(),
            unit: (*unit).to_owned(),
            data: data.clone(),
        };
        self.set(name, Value::Curve { columns: columns.iter().map(column).collect() })
    }

    /// Records an amount of work.
    pub fn work(&mut self, name: &str, count: u64) -> &mut Self {
        self.work.insert(name.to_owned(), count);
        self
    }

    /// Adds seconds to a phase.
    pub fn seconds(&mut self, phase: &str, seconds: f64) -> &mut Self {
        *self.seconds.entry(phase.to_owned()).or_default() += seconds;
        self
    }

    /// Adds all phases of a stopwatch.
    pub fn phases(&mut self, phases: &Phases) -> &mut Self {
        for (phase, seconds) in phases.seconds() {
            self.seconds(phase, seconds);
        }
        self
    }

    /// States how many threads computed; otherwise all the machine offers is assumed.
    pub fn threads(&mut self, threads: usize) -> &mut Self {
        self.provenance.host.threads = threads;
        self
    }

    /// Returns a scalar by name.
    pub fn scalar(&self, name: &str) -> Option<f64> {
        match self.values.get(name)? {
            Value::Scalar { value, .. } => Some(*value),
            Value::Curve { .. } => None,
        }
    }

    /// Returns a scalar with six digits, and its unit; empty if there is none of that name.
    pub fn shown(&self, name: &str) -> (String, String) {
        match self.values.get(name) {
            Some(Value::Scalar { value, unit }) => (number::short(*value), unit.clone()),
            _ => Default::default(),
        }
    }

    /// Returns a scalar with six digits in `unit`, and its unit; empty if there is none of that name.
    pub fn shown_in(&self, name: &str, unit: Option<ShownUnit>) -> (String, String) {
        match (self.scalar(name), unit) {
            (Some(value), Some(unit)) => (number::short(value * unit.factor), unit.name.to_owned()),
            _ => self.shown(name),
        }
    }

    /// Judges expectations against the values so far, replacing earlier judgements; with `quick`, those
    /// marked `quick = false` are left out.
    pub fn judge(&mut self, expectations: &[Expect], quick: bool) -> &mut Self {
        let asked = expectations.iter().filter(|expect| expect.quick || !quick);
        self.expect = asked.map(|expect| expect.judge(&self.values)).collect();
        self.refresh()
    }

    /// Records that a run ended with an error: it has not passed.
    pub fn ended(&mut self, what: &str, error: &str) -> &mut Self {
        self.trials.push(Trial {
            what: what.to_owned(),
            description: "runs to its end".to_owned(),
            observed: error.to_owned(),
            iterations: None,
            passed: false,
        });
        self.passed = false;
        self
    }

    /// Returns whether all expectations are met, all trials passed and all numbers are finite.
    pub fn passed(&self) -> bool {
        self.passed
    }

    /// Writes `report.json` into `directory` atomically.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, directory: impl AsRef<Path>) -> Result<PathBuf, Error> {
        let path = directory.as_ref().join(FILE_NAME);
        polycore::file::atomic_write(&path, |file| {
            serde_json::to_writer_pretty(&mut *file, self)?;
            file.write_all(b"\n")
        })?;
        Ok(path)
    }

    /// Reads a `report.json`.
    ///
    /// # Errors
    /// [`Error::Io`], or [`Error::Format`] if it is not a report.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path).map_err(Error::from_io("read", path))?;
        serde_json::from_str(&text).map_err(|error| Error::Format {
            path: path.to_path_buf(),
            format: "report",
            reason: error.to_string(),
        })
    }

    /// Returns the scalars, work, times and judged expectations as text.
    pub fn table(&self) -> String {
        self.table_of(|_| true)
    }

    /// [`Report::table`] with those values alone that are requested by name; the number of the others is
    /// reported.
    pub fn table_of(&self, shown: impl Fn(&str) -> bool) -> String {
        let mut text = String::new();
        let mut rows = Vec::new();
        for (name, value) in self.values.iter().filter(|(name, _)| shown(name)) {
            rows.push(match value {
                Value::Scalar { value, unit } => [name.clone(), number::short(*value), unit.clone()],
                Value::Curve { columns } => {
                    let heads: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
                    let rows = columns.first().map_or(0, |column| column.data.len());
                    [name.clone(), format!("{rows} rows"), format!("({})", heads.join(", "))]
                }
            });
        }
        text += &aligned(&rows);
        if rows.len() < self.values.len() {
            let _ = writeln!(text, "{} more values in {FILE_NAME}", self.values.len() - rows.len());
        }
        let work = self.work.iter().map(|(name, count)| format!("{name} {count}"));
        let seconds = self.seconds.iter().map(|(phase, seconds)| format!("{phase} {seconds:.3} s"));
        let line = work.chain(seconds).collect::<Vec<_>>().join(", ");
        if !line.is_empty() {
            let _ = writeln!(text, "{line}");
        }
        text + &self.verdict()
    }

    /// Returns how many expectations of some quantities are met, and the rows of those that are not.
    pub fn verdict_on(&self, quantities: impl Fn(&str) -> bool) -> (usize, Vec<String>) {
        let of_it = || self.expect.iter().filter(|j| quantities(&j.expect.quantity));
        let missed = of_it().filter(|j| !j.pass).map(|j| j.row()[..].join(" ")).collect();
        (of_it().filter(|j| j.pass).count(), missed)
    }

    /// Returns the judged expectations and what is not finite, as text.
    pub fn verdict(&self) -> String {
        let mut text = String::new();
        text += &aligned(&self.expect.iter().map(Judgement::row).collect::<Vec<_>>());
        for name in &self.non_finite {
            let _ = writeln!(text, "FAIL  {name} is not finite");
        }
        text
    }

    fn set(&mut self, name: &str, value: Value) -> &mut Self {
        self.values.insert(name.to_owned(), value);
        self.refresh()
    }

    fn refresh(&mut self) -> &mut Self {
        self.non_finite.clear();
        for (name, value) in &self.values {
            match value {
                Value::Scalar { value, .. } if value.is_finite() => {}
                Value::Scalar { .. } => self.non_finite.push(name.clone()),
                Value::Curve { columns } => {
                    let bad =
                        columns.iter().filter(|column| column.data.iter().any(|number| !number.is_finite()));
                    self.non_finite.extend(bad.map(|column| format!("{name}.{}", column.name)));
                }
            }
        }
        let judged = self.expect.iter().all(|judgement| judgement.pass);
        self.passed = self.non_finite.is_empty() && judged && self.trials.iter().all(|trial| trial.passed);
        self
    }
}

/// A stopwatch over named phases; a phase may be entered again and adds up.
#[derive(Clone, Debug, Default)]
pub struct Phases {
    done: Vec<(String, f64)>,
    running: Option<(String, Instant)>,
}

impl Phases {
    /// No phase is running.
    pub fn new() -> Self {
        Self::default()
    }

    /// Ends the running phase, if any, and begins another.
    pub fn start(&mut self, phase: &str) {
        self.stop();
        self.running = Some((phase.to_owned(), Instant::now()));
    }

    /// Ends the running phase.
    pub fn stop(&mut self) {
        if let Some((phase, since)) = self.running.take() {
            self.add(&phase, since.elapsed().as_secs_f64());
        }
    }

    /// Runs `work` as a phase of its own; the phase around it goes on afterwards.
    pub fn time<T>(&mut self, phase: &str, work: impl FnOnce() -> T) -> T {
        let around = self.running.as_ref().map(|(phase, _)| phase.clone());
        self.start(phase);
        let result = work();
        self.stop();
        if let Some(around) = around {
            self.start(&around);
        }
        result
    }

    /// Adds seconds measured elsewhere.
    pub fn add(&mut self, phase: &str, seconds: f64) {
        match self.done.iter_mut().find(|(name, _)| name == phase) {
            Some((_, sum)) => *sum += seconds,
            None => self.done.push((phase.to_owned(), seconds)),
        }
    }

    /// Returns the ended phases in order of first appearance.
    pub fn seconds(&self) -> impl Iterator<Item = (&str, f64)> {
        self.done.iter().map(|(phase, seconds)| (phase.as_str(), *seconds))
    }
}

/// Aligns cells in columns that are two blanks apart; rows of another length than the first do not widen
/// them.
pub fn aligned<R: AsRef<[String]>>(rows: &[R]) -> String {
    let columns = rows.first().map_or(0, |row| row.as_ref().len());
    let mut widths = vec![0; columns];
    for row in rows.iter().map(AsRef::as_ref).filter(|row| row.len() == columns) {
        for (width, cell) in widths.iter_mut().zip(row) {
            *width = (*width).max(cell.chars().count());
        }
    }
    let line = |row: &R| {
        let cells = row.as_ref().iter().zip(&widths).map(|(cell, &width)| format!("{cell:<width$}"));
        cells.collect::<Vec<_>>().join("  ").trim_end().to_owned() + "\n"
    };
    rows.iter().map(line).collect()
}

#[cfg(test)]
mod tests;
