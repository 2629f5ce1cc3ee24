//! Several runs side by side: a row for each, with what is left at its end.

use crate::report::{Report, Value, aligned};
use crate::study::Solved;
use polycore::file::atomic_write;
use std::path::Path;

/// Statistics of a field: its mean by volume, its extremes, and its standard deviation, which measures
/// uniformity.
pub const STATISTICS: [&str; 4] = ["mean_", "least_", "largest_", "deviation_of_"];

/// Rows of the short table at most.
const SHOWN: usize = 15;

/// Heading of the column that says whether a run meets the scene's expectations.
const ENDS: &str = "passed";

/// A run among others.
pub struct Row {
    /// Name.
    pub name: String,
    /// Values that were set, one for each heading.
    pub settings: Vec<String>,
    /// Report, or the error that ended the run.
    pub outcome: Result<Report, String>,
}

impl Solved for Row {
    fn name(&self) -> &str {
        &self.name
    }

    fn scalar(&self, quantity: &str) -> Option<(f64, &str)> {
        match self.outcome.as_ref().ok()?.values.get(quantity)? {
            Value::Scalar { value, unit } => Some((*value, unit)),
            Value::Curve { .. } => None,
        }
    }

    fn solve_seconds(&self) -> f64 {
        let own = self.outcome.as_ref().ok();
        own.and_then(|own| own.seconds.get("solve")).copied().unwrap_or(f64::NAN)
    }
}

/// Runs and the headings of their settings.
pub struct Rows {
    /// Headings.
    pub settings: Vec<String>,
    /// Further values that are requested, by name; `*` stands for any text.
    pub columns: Vec<String>,
    /// Rows.
    pub rows: Vec<Row>,
}

impl Rows {
    /// Returns whether every run has ended without an error.
    pub fn passed(&self) -> bool {
        self.rows.iter().all(|row| row.outcome.is_ok())
    }

    /// Returns whether some run has a value.
    pub fn has_value(&self, name: &str) -> bool {
        self.reports().any(|report| report.scalar(name).is_some())
    }

    /// Fields whose statistics some run tells, the temperature first.
    pub fn fields(&self) -> Vec<String> {
        let mut fields: Vec<String> = self
            .reports()
            .flat_map(|report| report.values.keys())
            .filter_map(|name| Some(name.strip_prefix(STATISTICS[0])?.to_owned()))
            .collect();
        fields.sort_by_key(|name| (name != "temperature", name.clone()));
        fields.dedup();
        fields
    }

    /// Returns names of values that the further columns ask for, in the order of the columns, numbers by
    /// their size.
    pub fn requested(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for pattern in &self.columns {
            let fit = |name: &&String| matches_pattern(pattern, name);
            let mut found: Vec<&String> =
                self.reports().flat_map(|report| report.values.keys()).filter(fit).collect();
            found.sort_by_key(|name| natural(name));
            found.dedup();
            names.extend(found.into_iter().filter(|name| !names.contains(name)).cloned().collect::<Vec<_>>());
        }
        // statistics have columns of their own
        let fields = self.fields();
        let is_statistic = |name: &String| {
            STATISTICS
                .iter()
                .any(|s| name.strip_prefix(s).is_some_and(|rest| fields.iter().any(|f| f == rest)))
        };
        names.retain(|name| !is_statistic(name));
        names
    }

    /// Returns names of all values that the table shows: the statistics of each field, and what further
    /// columns ask for.
    pub fn names(&self) -> Vec<String> {
        let fields = self.fields();
        let statistics = fields.iter().flat_map(|field| STATISTICS.map(|name| format!("{name}{field}")));
        statistics.chain(self.requested()).collect()
    }

    /// Returns whether some run has expectations.
    fn judged(&self) -> bool {
        self.reports().any(|report| !report.expect.is_empty())
    }

    fn reports(&self) -> impl Iterator<Item = &Report> {
        self.rows.iter().filter_map(|row| row.outcome.as_ref().ok())
    }

    /// Returns `name [unit]`, with the unit that the reports give.
    pub fn heading(&self, name: &str) -> String {
        let unit =
            self.reports().filter_map(|report| report.values.get(name)).find_map(|value| match value {
                Value::Scalar { unit, .. } if !unit.is_empty() => Some(unit),
                _ => None,
            });
        unit.map_or_else(|| name.to_owned(), |unit| format!("{name} [{unit}]"))
    }

    /// Returns heading and cells of each setting: `key [unit]` and numbers where all values are numbers
    /// with one unit written to them, such as `10s`.
    fn setting_columns(&self) -> Vec<(String, Vec<&str>)> {
        let column = |(index, key): (usize, &String)| {
            let cells: Vec<&str> = self.rows.iter().map(|row| row.settings[index].as_str()).collect();
            let split: Option<Vec<_>> = cells.iter().map(|cell| number_and_unit(cell)).collect();
            match split.as_deref() {
                Some([(_, unit), rest @ ..])
                    if !unit.is_empty() && rest.iter().all(|(_, own)| own == unit) =>
                {
                    let numbers = cells.iter().map(|cell| &cell[..cell.len() - unit.len()]);
                    (format!("{key} [{unit}]"), numbers.collect())
                }
                _ => (key.clone(), cells),
            }
        };
        self.settings.iter().enumerate().map(column).collect()
    }

    /// Returns the table to be read: a column for each field, with its mean, extremes and deviation.
    pub fn text(&self) -> String {
        aligned(&self.table())
    }

    /// Returns the first rows and columns of the table, as many as a screen holds.
    pub fn short_text(&self, width: usize) -> String {
        let mut table = self.table();
        let hidden_rows = table.len().saturating_sub(1 + SHOWN);
        table.truncate(1 + SHOWN);
        let fixed = 1 + self.settings.len();
        let (mut text, mut hidden) = (aligned(&table), 0);
        while text.lines().any(|line| line.chars().count() > width) && table[0].len() > fixed + 1 {
            // values go before the verdict and the steps
            let ends = 1 + usize::from(self.judged());
            let at =
                if table[0].len() > fixed + ends { table[0].len() - ends - 1 } else { table[0].len() - 1 };
            let columns = table[0].len();
            table.iter_mut().filter(|row| row.len() == columns).for_each(|row| drop(row.remove(at)));
            hidden += 1;
            text = aligned(&table);
        }
        let plural = |count: usize| if count == 1 { "" } else { "s" };
        if hidden_rows > 0 {
            text += &format!("… {hidden_rows} more run{} in the table\n", plural(hidden_rows));
        }
        if hidden > 0 {
            text += &format!("… {hidden} more column{} in the table\n", plural(hidden));
        }
        text
    }

    fn table(&self) -> Vec<Vec<String>> {
        let (fields, settings) = (self.fields(), self.setting_columns());
        let mut head = vec!["run".to_owned()];
        head.extend(settings.iter().map(|(heading, _)| heading.clone()));
        head.extend(fields.iter().map(|name| format!("{name}: mean (least to largest) ± deviation")));
        let asked = self.requested();
        head.extend(asked.iter().map(|name| self.heading(name)));
        if self.judged() {
            head.push(ENDS.into());
        }
        head.push("steps".into());
        let mut table = vec![head];
        for (index, row) in self.rows.iter().enumerate() {
            let mut line = vec![row.name.clone()];
            line.extend(settings.iter().map(|(_, cells)| cells[index].to_owned()));
            match &row.outcome {
                Ok(report) => {
                    line.extend(fields.iter().map(|field| {
                        let [mean, least, largest, deviation] =
                            STATISTICS.map(|statistic| shown(report, &format!("{statistic}{field}")));
                        format!("{mean} ({least} to {largest}) ± {deviation}")
                    }));
                    line.extend(asked.iter().map(|name| shown(report, name)));
                    if self.judged() {
                        let missed = report.expect.iter().filter(|one| !one.pass).count();
                        line.push(if missed == 0 {
                            "yes".to_owned()
                        } else {
                            format!("no: {missed} missed")
                        });
                    }
                    line.push(report.work.get("steps").map(u64::to_string).unwrap_or_default());
                }
                Err(failure) => line.push(failure.lines().next().unwrap_or_default().to_owned()),
            }
            table.push(line);
        }
        table
    }

    /// The table as CSV, with all digits; what a run does not tell is empty.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), polycore::Error> {
        let (values, settings) = (self.names(), self.setting_columns());
        let mut head = vec!["run".to_owned()];
        head.extend(settings.iter().map(|(heading, _)| heading.clone()));
        head.extend(values.iter().map(|name| self.heading(name)));
        if self.judged() {
            head.push(ENDS.to_owned());
        }
        head.extend(["steps", "failure"].map(str::to_owned));
        atomic_write(path, |file| {
            let mut writer = csv::Writer::from_writer(file);
            writer.write_record(&head)?;
            for (index, row) in self.rows.iter().enumerate() {
                let report = row.outcome.as_ref().ok();
                let mut line = vec![row.name.clone()];
                line.extend(settings.iter().map(|(_, cells)| cells[index].to_owned()));
                line.extend(values.iter().map(|name| {
                    let value = report.and_then(|report| report.scalar(name));
                    value.map(|value| format!("{value:?}")).unwrap_or_default()
                }));
                if self.judged() {
                    line.push(report.map(verdict).unwrap_or_default());
                }
                let steps = report.and_then(|report| report.work.get("steps"));
                line.push(steps.map(u64::to_string).unwrap_or_default());
                line.push(row.outcome.as_ref().err().cloned().unwrap_or_default());
                writer.write_record(line)?;
            }
            writer.flush()
        })
    }
}

/// Splits `10s` into its number and unit, the text as it stands; `None` for a text that begins with no
/// number or has a blank between both.
pub(crate) fn number_and_unit(text: &str) -> Option<(f64, &str)> {
    let end = text.find(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c))).unwrap_or(text.len());
    let unit = &text[end..];
    let number = text[..end].parse().ok()?;
    (!unit.contains([' ', ';', ',', '"'])).then_some((number, unit))
}

/// Returns the numbers of values that have one unit, and the unit.
pub fn numeric(values: &[String]) -> Option<(Vec<f64>, String)> {
    let split = |text: &String| -> Option<(f64, String)> {
        // of keys that change together the first
        let text: String = text.split(';').next()?.split_whitespace().collect();
        number_and_unit(&text).map(|(number, unit)| (number, unit.to_owned()))
    };
    let all: Vec<(f64, String)> = values.iter().map(split).collect::<Option<_>>()?;
    let unit = all.first()?.1.clone();
    all.iter().all(|(_, other)| *other == unit).then(|| (all.iter().map(|(x, _)| *x).collect(), unit))
}

/// Splits a heading `key [unit]` into key and unit.
pub(crate) fn key_and_unit(heading: &str) -> (&str, &str) {
    heading.strip_suffix(']').and_then(|rest| rest.rsplit_once(" [")).unwrap_or((heading, ""))
}

/// A value as it is read, `–` if the run has none.
fn shown(report: &Report, name: &str) -> String {
    let (number, _) = report.shown(name);
    if number.is_empty() { "–".to_owned() } else { number }
}

/// `yes`, or the quantities that miss what the scene expects of them.
fn verdict(report: &Report) -> String {
    let missed: Vec<&str> =
        report.expect.iter().filter(|one| !one.pass).map(|one| one.expect.quantity.as_str()).collect();
    if missed.is_empty() { "yes".to_owned() } else { format!("no: {}", missed.join(" ")) }
}

/// Returns whether a name matches_pattern a pattern in which `*` stands for any text.
pub(crate) fn matches_pattern(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == name,
        Some((before, after)) => name.strip_prefix(before).is_some_and(|rest| {
            (0..=rest.len())
                .filter(|&at| rest.is_char_boundary(at))
                .any(|at| matches_pattern(after, &rest[at..]))
        }),
    }
}

/// Returns a name's pieces of text and numbers, so that `layer-10` comes after `layer-9`.
pub(crate) fn natural(name: &str) -> Vec<(String, u64)> {
    let mut pieces = Vec::new();
    let mut rest = name;
    while !rest.is_empty() {
        let digits = rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len());
        let end = rest[digits..].find(|c: char| !c.is_ascii_digit()).map_or(rest.len(), |end| digits + end);
        pieces.push((rest[..digits].to_owned(), rest[digits..end].parse().unwrap_or(0)));
        rest = &rest[end..];
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_and_their_order() {
        assert!(
            matches_pattern("layer-*.mean_alpha", "layer-12.mean_alpha")
                && matches_pattern("a", "a")
                && matches_pattern("*", "")
        );
        assert!(
            !matches_pattern("layer-*.mean_alpha", "layer-1.least_alpha")
                && !matches_pattern("a", "ab")
                && !matches_pattern("a*b", "a")
        );
        let mut names = ["layer-10.x", "layer-9.x", "layer-9.a"];
        names.sort_by_key(|name| natural(name));
        assert_eq!(names, ["layer-9.a", "layer-9.x", "layer-10.x"]);
    }

    #[test]
    fn a_short_table_fits_a_screen() {
        let row = |index: usize| {
            let mut report = Report::new("test", "1", "");
            for k in 0..9 {
                let name = format!("a_long_name_of_a_value_{k}");
                report.value(crate::report::Named::new(name, "N"), index as f64);
            }
            Row { name: format!("run-{index}"), settings: vec![index.to_string()], outcome: Ok(report) }
        };
        let mut rows = Rows {
            settings: vec!["key".into()],
            columns: vec!["a_long*".into()],
            rows: (0..20).map(row).collect(),
        };
        let text = rows.short_text(100);
        assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
        assert!(text.contains("run-14") && text.contains("… 5 more runs in the table"), "{text}");
        assert!(text.contains("_value_1 [N]") && text.contains("… 7 more columns in the table"), "{text}");
        rows.rows.truncate(1);
        rows.columns = vec!["a_long_name_of_a_value_3".into()];
        assert_eq!(rows.short_text(100), rows.text());
    }
}
