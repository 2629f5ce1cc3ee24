//! Error against run time, from measurements of `cargo xtask bench` and from cases that time themselves.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use harness::output::picture::{LinePlot, Series};
use miette::{IntoDiagnostic, Result, WrapErr};
use serde::{Deserialize, Serialize};

use super::pictures;
use super::points::{pairs, read_curve_points, read_table_points};
use crate::bench;
use crate::outcome::CaseOutcome;
use crate::stamp::SourceStamp;
use crate::workspace::Repository;

/// File of the alternatives: cases/timing.toml.
const FILE: &str = "cases/timing.toml";

/// Source of the points of a subject.
#[derive(Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
enum PointSource {
    /// Rows of target/bench/NAME.json: words that distinguish rows of errors and of times; the rest of a name
    /// is the point.
    Bench { name: String, error: String, time: String },
    /// Table among a case's results: one method per row, its name in the first column; columns of error and
    /// time, and a factor of the times.
    Table { case: String, file: String, error: usize, time: usize, scale: f64 },
    /// Curves of a case's report: columns `seconds` and, last, errors.
    Case { name: String, curves: String },
}

#[derive(Deserialize)]
struct Subjects {
    subject: Vec<Subject>,
}

/// Alternatives for one task.
#[derive(Deserialize)]
struct Subject {
    title: String,
    #[serde(flatten)]
    source: PointSource,
    /// Separator of method and setting in a point's name.
    #[serde(default = "line_break")]
    split: String,
    /// Method by default.
    default: String,
    axes: [String; 2],
    /// Command that measures it.
    command: String,
    #[serde(default)]
    note: String,
}

/// Separator that occurs in no name.
fn line_break() -> String {
    "\n".to_owned()
}

/// Measured subject.
#[derive(Serialize)]
pub struct TimingSubject {
    title: String,
    axes: [String; 2],
    default: String,
    command: String,
    note: String,
    points: Vec<TimingPoint>,
    /// True if a point of the default is on the front.
    default_on_front: bool,
    /// Provenance of a bench's measurement; `None` for measurements of this run's cases.
    #[serde(skip_serializing_if = "Option::is_none")]
    measured: Option<String>,
    /// True if the sources that the bench measured have changed.
    stale: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    picture: Option<String>,
}

/// Method with one setting.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TimingPoint {
    method: String,
    name: String,
    time: f64,
    error: f64,
    /// True if no measured point is both faster and more accurate.
    front: bool,
    default: bool,
    /// Values formatted for readers.
    shown: [String; 2],
}

impl TimingSubject {
    /// Removes the picture, which is for the page only.
    pub fn without_picture(mut self) -> Self {
        self.picture = None;
        self
    }

    /// Cells for docs/validation.md: the subject, the methods on its front, the place of the default, and the
    /// measurement.
    pub fn cells(&self) -> Option<[String; 4]> {
        let mut front: Vec<&str> =
            self.points.iter().filter(|p| p.front).map(|p| p.method.as_str()).collect();
        front.sort_unstable();
        front.dedup();
        let verdict = if self.default_on_front { "on the front" } else { "not on the front" };
        let stale = if self.stale { "stale; " } else { "" };
        let measured = self.measured.as_deref().unwrap_or("this run");
        let cells = [
            self.title.clone(),
            front.join(", "),
            format!("{stale}{}: {verdict}", self.default),
            measured.to_owned(),
        ];
        (!self.points.is_empty()).then_some(cells)
    }

    /// Names what was not measured, and the command that measures it.
    pub fn missing_row(&self) -> [&str; 2] {
        [&self.title, &self.command]
    }
}

/// Collects all measurements, and the commands for missing ones; writes pictures to `folder`.
pub fn measured(
    workspace: &Repository,
    folder: &Path,
    outcomes: &[CaseOutcome],
) -> Result<Vec<TimingSubject>> {
    let path = workspace.root().join(FILE);
    let text = fs::read_to_string(&path).into_diagnostic().wrap_err(FILE)?;
    let subjects: Subjects = toml::from_str(&text).into_diagnostic().wrap_err(FILE)?;
    subjects.subject.into_iter().map(|subject| subject.measured(workspace, folder, outcomes)).collect()
}

impl Subject {
    fn measured(
        self,
        workspace: &Repository,
        folder: &Path,
        outcomes: &[CaseOutcome],
    ) -> Result<TimingSubject> {
        let mut stamp: Option<SourceStamp> = None;
        let points = match &self.source {
            PointSource::Bench { name, error, time } => {
                let bench = bench::read(workspace, name);
                stamp = bench.as_ref().map(|bench| bench.stamp.clone());
                pairs(bench.as_ref().map_or(&[], |bench| &bench.rows), error, time)
            }
            PointSource::Table { case, file, error, time, scale } => {
                let outcome = outcomes.iter().find(|outcome| outcome.case == *case);
                let path = outcome.map(|outcome| outcome.output.join(file));
                let text = path.and_then(|path| fs::read_to_string(path).ok()).unwrap_or_default();
                read_table_points(&text, *error, *time, *scale)
            }
            PointSource::Case { name, curves } => outcomes
                .iter()
                .find(|outcome| outcome.case == *name)
                .map_or_else(Vec::new, |outcome| read_curve_points(outcome, curves)),
        };
        let mut points: Vec<TimingPoint> = points
            .into_iter()
            .filter(|(_, time, error)| time.is_finite() && error.is_finite() && *time > 0.0)
            .map(|(name, time, error)| {
                let method = name.split(&self.split).next().unwrap_or(&name).to_owned();
                let default = method == self.default;
                let shown = [time, error].map(|number| format!("{number:.2e}"));
                TimingPoint { method, name, time, error, front: false, default, shown }
            })
            .collect();
        front(&mut points);
        let picture = if points.is_empty() { None } else { Some(self.draw(&points, folder)?) };
        let default_on_front = points.iter().any(|point| point.front && point.default);
        Ok(TimingSubject {
            title: self.title,
            axes: self.axes,
            default: self.default,
            command: self.command,
            note: self.note,
            points,
            default_on_front,
            stale: stamp.as_ref().is_some_and(|stamp| !stamp.fresh(workspace.root())),
            measured: stamp.as_ref().map(SourceStamp::to_string),
            picture,
        })
    }

    fn draw(&self, points: &[TimingPoint], folder: &Path) -> Result<String> {
        // an error of 0 has no place on a logarithmic axis
        let y = |point: &TimingPoint| point.error.max(1e-17);
        let mut plot =
            LinePlot::new(&self.title).axes(&self.axes[0], &self.axes[1]).log_x().log_y().size(900.0, 520.0);
        let mut methods: BTreeMap<&str, Vec<&TimingPoint>> = BTreeMap::new();
        for point in points {
            methods.entry(&point.method).or_default().push(point);
        }
        for (method, mut points) in methods {
            points.sort_by(|a, b| a.time.total_cmp(&b.time));
            let xs: Vec<f64> = points.iter().map(|point| point.time).collect();
            let ys: Vec<f64> = points.iter().map(|point| y(point)).collect();
            let name = if method == self.default { format!("{method} (default)") } else { method.to_owned() };
            plot = plot.series(Series::markers(&name, &xs, &ys));
        }
        let mut on: Vec<&TimingPoint> = points.iter().filter(|point| point.front).collect();
        on.sort_by(|a, b| a.time.total_cmp(&b.time));
        let xs: Vec<f64> = on.iter().map(|point| point.time).collect();
        let ys: Vec<f64> = on.iter().map(|point| y(point)).collect();
        plot = plot.series(Series::reference("Pareto front", &xs, &ys));
        let stem = self.title.to_lowercase().replace(|c: char| !c.is_ascii_alphanumeric(), "-");
        let path = folder.join(format!("{stem}.svg"));
        plot.write(&path).into_diagnostic()?;
        Ok(pictures::embed(&path).unwrap_or_default())
    }
}

/// Marks the points that no other point beats in both.
fn front(points: &mut [TimingPoint]) {
    let all: Vec<(f64, f64)> = points.iter().map(|point| (point.time, point.error)).collect();
    for point in points {
        let beaten = |&(time, error): &(f64, f64)| {
            time <= point.time && error <= point.error && (time < point.time || error < point.error)
        };
        point.front = !all.iter().any(beaten);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_is_what_nothing_beats() {
        let point = |time, error| TimingPoint {
            method: String::new(),
            name: String::new(),
            time,
            error,
            front: false,
            default: false,
            shown: [String::new(), String::new()],
        };
        let mut points =
            [point(1.0, 1.0), point(2.0, 0.5), point(3.0, 0.6), point(2.0, 0.7), point(0.5, 2.0)];
        front(&mut points);
        assert_eq!(points.map(|point| point.front), [true, true, false, false, true]);
    }
}
