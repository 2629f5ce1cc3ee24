//! Several runs side by side: a row for each, with what is left at its end.

use polycore::output::atomic_write;
use polycore::report::{Report, Value};
use std::path::Path;

/// What is told of a field: its mean by volume, its extremes, and its standard deviation, which measures uniformity.
pub const STATISTICS: [&str; 4] = ["mean_", "least_", "largest_", "deviation_of_"];

/// A run among others.
pub struct Row {
    /// Its name.
    pub name: String,
    /// What was set, one text for each heading.
    pub settings: Vec<String>,
    /// Its report, or why there is none.
    pub outcome: Result<Report, String>,
}

/// Runs and the headings of their settings.
pub struct Rows {
    /// Headings.
    pub settings: Vec<String>,
    /// Rows.
    pub rows: Vec<Row>,
}

impl Rows {
    /// Fields whose statistics some run tells, the temperature first.
    pub fn fields(&self) -> Vec<String> {
        let mut fields: Vec<String> = self
            .rows
            .iter()
            .filter_map(|row| row.outcome.as_ref().ok())
            .flat_map(|report| report.values.keys())
            .filter_map(|name| Some(name.strip_prefix(STATISTICS[0])?.to_owned()))
            .collect();
        fields.sort_by_key(|name| (name != "temperature", name.clone()));
        fields.dedup();
        fields
    }

    fn reports(&self) -> impl Iterator<Item = &Report> {
        self.rows.iter().filter_map(|row| row.outcome.as_ref().ok())
    }

    /// `name [unit]`, with the unit that the reports give.
    fn heading(&self, name: &str) -> String {
        let unit =
            self.reports().filter_map(|report| report.values.get(name)).find_map(|value| match value {
                Value::Scalar { unit, .. } if !unit.is_empty() => Some(unit),
                _ => None,
            });
        unit.map_or_else(|| name.to_owned(), |unit| format!("{name} [{unit}]"))
    }

    /// The table to be read: a column for each field, with its mean, extremes and deviation.
    pub fn text(&self) -> String {
        let fields = self.fields();
        let mut head = vec!["run".to_owned()];
        head.extend(self.settings.iter().cloned());
        head.extend(fields.iter().map(|name| format!("{name}: mean (least to largest) ± deviation")));
        head.push("steps".into());
        let mut table = vec![head];
        for row in &self.rows {
            let mut line = vec![row.name.clone()];
            line.extend(row.settings.iter().cloned());
            match &row.outcome {
                Ok(report) => {
                    line.extend(fields.iter().map(|field| {
                        let [mean, least, largest, deviation] = STATISTICS.map(|statistic| {
                            let value = report.scalar(&format!("{statistic}{field}"));
                            value.map_or_else(|| "–".to_owned(), |value| format!("{value:.4}"))
                        });
                        format!("{mean} ({least} to {largest}) ± {deviation}")
                    }));
                    line.push(report.work.get("steps").map(u64::to_string).unwrap_or_default());
                }
                Err(failure) => line.push(failure.lines().next().unwrap_or_default().to_owned()),
            }
            table.push(line);
        }
        // what is long and stands alone may stick out
        let mut widths = vec![0; table[0].len()];
        for line in table.iter().filter(|line| line.len() == table[0].len()) {
            for (width, cell) in widths.iter_mut().zip(line) {
                *width = (*width).max(cell.chars().count());
            }
        }
        let line = |line: &Vec<String>| {
            let cells = line.iter().zip(&widths).map(|(cell, &width)| format!("{cell:<width$}"));
            cells.collect::<Vec<_>>().join("  ").trim_end().to_owned() + "\n"
        };
        table.iter().map(line).collect()
    }

    /// The table as CSV, with all digits; what a run does not tell is empty.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), polycore::Error> {
        let fields = self.fields();
        let values: Vec<String> = fields
            .iter()
            .flat_map(|field| STATISTICS.map(|statistic| format!("{statistic}{field}")))
            .collect();
        let mut head = vec!["run".to_owned()];
        head.extend(self.settings.iter().cloned());
        head.extend(values.iter().map(|name| self.heading(name)));
        head.extend(["steps", "failure"].map(str::to_owned));
        atomic_write(path, |file| {
            let mut writer = csv::Writer::from_writer(file);
            writer.write_record(&head)?;
            for row in &self.rows {
                let report = row.outcome.as_ref().ok();
                let mut line = vec![row.name.clone()];
                line.extend(row.settings.iter().cloned());
                line.extend(values.iter().map(|name| {
                    let value = report.and_then(|report| report.scalar(name));
                    value.map(|value| format!("{value:?}")).unwrap_or_default()
                }));
                let steps = report.and_then(|report| report.work.get("steps"));
                line.push(steps.map(u64::to_string).unwrap_or_default());
                line.push(row.outcome.as_ref().err().cloned().unwrap_or_default());
                writer.write_record(line)?;
            }
            writer.flush()
        })
    }
}
