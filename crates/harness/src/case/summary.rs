//! Summary of a finished run: what was solved, its main values, the verdict, where the results are.

use super::rows::natural;
use super::terminal::TerminalStyle;
use super::{Finished, Program, matches_pattern};
use crate::report::{FILE_NAME, Kind, Report, SceneUnits, ShownUnit, Value, aligned};
use crate::scene::Source;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::Duration;

/// Rows of variants at most.
const ROWS: usize = 8;
/// Columns of variants at most.
const COLUMNS: usize = 5;
/// Single values at most, without and with a table of variants above them.
const SINGLE: [usize; 2] = [10, 4];
/// Amounts of work that the second line states, where the report has them.
const WORK: [&str; 6] = ["particles", "elements", "samples", "epochs", "steps", "iterations"];

/// Returns the summary of a run that took `wall` time.
pub(super) fn summary(
    program: &Program,
    source: &Source,
    finished: &Finished,
    output: &Path,
    wall: Duration,
    style: &TerminalStyle,
) -> String {
    let report = &finished.report;
    let mut text = String::new();
    let title = source.title().unwrap_or_else(|| source.path.display().to_string());
    text += &format!("{}\n{}\n", style.bold(&title), style.fitted(&solved(program, report, wall)));
    let table = match &finished.table {
        Some(table) => table.clone(),
        None => main_values(report, &source.report_values(), program.columns, style.width),
    };
    if !table.is_empty() {
        text += &format!("\n{table}");
    }
    text += &format!("\n{}", verdict(report, style));
    for note in &finished.notes {
        text += &match note.starts_with(' ') {
            // a block to be copied
            true => format!("{note}\n"),
            false if note.starts_with("warning") => style.yellow(&style.wrapped(note)),
            false if note.starts_with("FAIL") => style.red(&style.wrapped(note)),
            false => style.wrapped(note),
        };
    }
    text + &files(output, style)
}

/// `peri 0.9.0: 5 variants, 60012 particles, 480 iterations in 41 s on 2 threads`.
fn solved(program: &Program, report: &Report, wall: Duration) -> String {
    let mut parts = Vec::new();
    let variants: BTreeSet<&str> =
        report.work.keys().filter_map(|name| bracketed(name)).map(|p| p.1).collect();
    if variants.len() > 1 {
        parts.push(format!("{} variants", variants.len()));
    }
    for name in WORK {
        let own =
            report.work.iter().filter(|(key, _)| bracketed(key).map_or(&***key, |parts| parts.0) == name);
        let sum: u64 = own.map(|(_, count)| count).sum();
        if sum > 0 {
            parts.push(format!("{sum} {name}"));
        }
    }
    let threads = report.provenance.host.threads;
    let on = if threads == 1 { "1 thread".to_owned() } else { format!("{threads} threads") };
    let seconds = wall.as_secs_f64();
    let digits = usize::from(seconds < 10.0);
    let list = if parts.is_empty() { "solved".to_owned() } else { parts.join(", ") };
    format!("{} {}: {list} in {seconds:.digits$} s on {on}", program.name, program.version)
}

/// Splits `VALUE[VARIANT]`.
fn bracketed(name: &str) -> Option<(&str, &str)> {
    name.strip_suffix(']')?.split_once('[')
}

/// The scalars of a report by variant and quantity.
pub(crate) struct Names<'a> {
    report: &'a Report,
    /// Quantities that several folders have, `FOLDER.QUANTITY`.
    shared: BTreeSet<&'a str>,
}

impl<'a> Names<'a> {
    pub(crate) fn new(report: &'a Report) -> Self {
        let mut owners: BTreeMap<&str, usize> = BTreeMap::new();
        for (_, quantity) in report.values.keys().filter_map(|name| name.split_once('.')) {
            *owners.entry(quantity).or_default() += 1;
        }
        let shared = owners.into_iter().filter(|own| own.1 > 1).map(|own| own.0).collect();
        Self { report, shared }
    }

    /// Returns the unit for all values of a list.
    fn unit(&self, units: &SceneUnits, names: &[&str]) -> Option<ShownUnit> {
        let scalars = || {
            names.iter().filter_map(|name| match self.report.values.get(*name)? {
                Value::Scalar { value, unit } => Some((value.abs(), unit)),
                Value::Curve { .. } => None,
            })
        };
        let unit = scalars().map(|own| own.1).find(|unit| !unit.is_empty())?;
        let largest = scalars().map(|own| own.0).filter(|value| value.is_finite()).fold(0.0, f64::max);
        units.shown(unit, largest)
    }

    /// Quantity and variant of a name; the variant is empty where there is none.
    pub(crate) fn split<'n>(&self, name: &'n str) -> (&'n str, &'n str) {
        if let Some(parts) = bracketed(name) {
            return parts;
        }
        match name.split_once('.') {
            Some((variant, quantity)) if self.shared.contains(quantity) => (quantity, variant),
            _ => (name, ""),
        }
    }

    /// Scalars that fit patterns, in the order of these; a pattern also stands for its values of all
    /// variants.
    fn fitting<'p>(&self, patterns: impl Iterator<Item = &'p str>) -> Vec<&'a str> {
        let mut found: Vec<&str> = Vec::new();
        for pattern in patterns {
            let mut own: Vec<&str> = self.scalars().filter(|name| self.is_like(pattern, name)).collect();
            own.sort_by_key(|name| natural(name));
            own.retain(|name| !found.contains(name));
            found.extend(own);
        }
        found
    }

    /// Scalars of the first quantities that expectations name, of the variants that the first of them has.
    fn of_expectations(&self, expected: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
        let mut quantities: Vec<&str> = Vec::new();
        for quantity in expected.map(|name| self.split(name).0) {
            if !quantities.contains(&quantity) && quantities.len() < COLUMNS {
                quantities.push(quantity);
            }
        }
        let mut found = self.fitting(quantities.into_iter());
        let variants = |quantity: &str| -> BTreeSet<&str> {
            let own = found.iter().map(|name| self.split(name)).filter(|own| own.0 == quantity);
            own.map(|own| own.1).collect()
        };
        let first = found.first().map(|name| variants(self.split(name).0)).unwrap_or_default();
        found.retain(|name| first.contains(self.split(name).1) || self.split(name).1.is_empty());
        found
    }

    fn is_like(&self, pattern: &str, name: &str) -> bool {
        matches_pattern(pattern, name) || matches_pattern(pattern, self.split(name).0)
    }

    fn scalars(&self) -> impl Iterator<Item = &'a str> {
        self.report.values.keys().map(String::as_str).filter(|name| self.report.scalar(name).is_some())
    }
}

/// Returns names of the values that matter: those that `[report]` lists, otherwise those of the first
/// expectations, otherwise the main values of the program, otherwise the first. Bounds that the program adds
/// to a scene without expectations come after the main values.
pub(crate) fn main_names(report: &Report, listed: &[String], columns: &[&str]) -> Vec<String> {
    let names = Names::new(report);
    let mut found = names.fitting(listed.iter().map(String::as_str));
    if found.is_empty() {
        let expected = report.expect.iter().filter(|one| one.expect.kind != Kind::Regression);
        let expected = names.of_expectations(expected.flat_map(|one| one.expect.names()));
        let is_expecting = Source::new("scene", report.provenance.scene.as_str()).has_expectations();
        if expected.is_empty() || !is_expecting {
            found = names.fitting(columns.iter().copied());
        }
        let new: Vec<&str> = expected.into_iter().filter(|name| !found.contains(name)).collect();
        found.extend(new);
    }
    if found.is_empty() {
        found = names.scalars().take(SINGLE[0]).collect();
    }
    found.into_iter().map(str::to_owned).collect()
}

/// Returns the table of the main values: a row for each variant, then single values.
fn main_values(report: &Report, listed: &[String], columns: &[&str], width: usize) -> String {
    let names = Names::new(report);
    let shown = main_names(report, listed, columns);
    let (single, several): (Vec<&str>, Vec<&str>) =
        shown.iter().map(String::as_str).partition(|name| names.split(name).1.is_empty());
    let units = SceneUnits::from_scene(&report.provenance.scene);
    let mut text = String::new();
    if !several.is_empty() {
        text += &by_variant(&names, &units, &several, width);
    }
    let most = SINGLE[usize::from(!several.is_empty())];
    let row = |name: &&str| {
        let (value, unit) = report.shown_in(name, names.unit(&units, &[name]));
        [(*name).to_owned(), value, unit]
    };
    text += &aligned(&single.iter().take(most).map(row).collect::<Vec<_>>());
    if single.len() > most {
        text += &format!("… {} more in {FILE_NAME}\n", single.len() - most);
    }
    text
}

fn by_variant(names: &Names, units: &SceneUnits, shown: &[&str], width: usize) -> String {
    let (mut quantities, mut variants): (Vec<&str>, Vec<&str>) = (Vec::new(), Vec::new());
    // expectations stand in the order of the studies
    let expected = names.report.expect.iter().flat_map(|one| one.expect.names());
    let order: Vec<&str> = expected.map(|name| names.split(name).1).collect();
    for name in shown {
        let (quantity, variant) = names.split(name);
        if !quantities.contains(&quantity) {
            quantities.push(quantity);
        }
        if !variants.contains(&variant) {
            variants.push(variant);
        }
    }
    variants.sort_by_key(|variant| order.iter().position(|other| other == variant).unwrap_or(usize::MAX));
    let of =
        |quantity: &str, variant: &str| shown.iter().find(|name| names.split(name) == (quantity, variant));
    let mut columns =
        vec![("variant".to_owned(), variants.iter().map(|v| (*v).to_owned()).collect::<Vec<_>>())];
    for quantity in quantities.iter().take(COLUMNS) {
        let own: Vec<Option<&str>> = variants.iter().map(|variant| of(quantity, variant).copied()).collect();
        let unit = names.unit(units, &own.iter().flatten().copied().collect::<Vec<_>>());
        let cell = |name: Option<&str>| name.map(|name| names.report.shown_in(name, unit));
        let cells: Vec<Option<(String, String)>> = own.into_iter().map(cell).collect();
        let unit = cells.iter().flatten().map(|cell| cell.1.as_str()).find(|unit| !unit.is_empty());
        let head = unit.map_or_else(|| (*quantity).to_owned(), |unit| format!("{quantity} [{unit}]"));
        columns.push((head, cells.into_iter().map(|cell| cell.map_or("–".into(), |cell| cell.0)).collect()));
    }
    let table = |columns: &[(String, Vec<String>)]| {
        let row = |index: usize| columns.iter().map(|column| column.1[index].clone()).collect::<Vec<_>>();
        let head = columns.iter().map(|column| column.0.clone()).collect::<Vec<_>>();
        let rows = (0..variants.len().min(ROWS)).map(row);
        aligned(&std::iter::once(head).chain(rows).collect::<Vec<_>>())
    };
    let mut text = table(&columns);
    while columns.len() > 2 && text.lines().any(|line| line.chars().count() > width) {
        columns.pop();
        text = table(&columns);
    }
    let left = variants.len().saturating_sub(ROWS);
    text + &if left > 0 { format!("… {left} more variants in {FILE_NAME}\n") } else { String::new() }
}

/// Returns the number of expectations that are met, by kind of evidence, and all that are not.
fn verdict(report: &Report, style: &TerminalStyle) -> String {
    let known = report.expect.iter().filter(|one| one.is_known_miss()).count();
    let met = report.expect.iter().filter(|one| one.pass).count() - known;
    let all = report.expect.len();
    let mut text = String::new();
    if all > 0 {
        let count = |kind: Kind| report.expect.iter().filter(|one| one.expect.kind == kind).count();
        let kinds = Kind::ALL.map(|kind| (count(kind), kind.name())).into_iter().filter(|own| own.0 > 0);
        let kinds: Vec<String> = kinds.map(|(count, kind)| format!("{count} {kind}")).collect();
        let missed = if known > 0 { format!(", {known} missed as stated") } else { String::new() };
        let line = format!("{met} of {all} expectations met{missed}");
        let line = if met + known == all { style.green(&line) } else { style.red(&line) };
        text += &format!("{line} ({})\n", kinds.join(", "));
    } else if report.passed() {
        text += "no expectations: the scene has no [[expect]]\n";
    }
    let failed: Vec<_> = report.expect.iter().filter(|one| !one.pass).map(|one| one.row()).collect();
    let mut lines: String = aligned(&failed);
    for trial in report.trials.iter().filter(|trial| !trial.passed) {
        lines += &format!("FAIL  {}: {}\n", trial.what, trial.observed);
    }
    for name in &report.non_finite {
        lines += &format!("FAIL  {name} is not finite\n");
    }
    text + &style.red(&lines)
}

/// Returns the paths of the results, and the next command.
fn files(output: &Path, style: &TerminalStyle) -> String {
    let entries = std::fs::read_dir(output).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.sort_by_key(|name| natural(name));
    let ending =
        |end: &str| names.iter().filter(move |name| name.ends_with(end)).cloned().collect::<Vec<_>>();
    let count = |count: usize, one: &str| match count {
        0 => String::new(),
        1 => format!(", 1 {one}"),
        many => format!(", {many} {one}s"),
    };
    let [pictures, tables, fields] = [".png", ".csv", ".vtkhdf"].map(ending);
    let films = [".gif", ".mp4"].map(ending).concat();
    let mut text = format!(
        "results in {}: {FILE_NAME}{}{}{}{}\n",
        output.display(),
        count(tables.len(), "table"),
        count(fields.len(), "field file"),
        count(pictures.len(), "picture"),
        count(films.len(), "animation"),
    );
    for pair in pictures.chunks(2).take(3) {
        let paths = pair.iter().map(|name| output.join(name).display().to_string()).collect::<Vec<_>>();
        text += &style.wrapped(&format!("  {}", paths.join("  ")));
    }
    if pictures.len() > 6 {
        text += &format!("  … {} more pictures\n", pictures.len() - 6);
    }
    text + &format!("next: {} view {}   # one page with all of it\n", invocation(), output.display())
}

/// Returns the words with which this program was called, without its arguments.
fn invocation() -> String {
    let called = std::env::args().next().unwrap_or_default();
    let name = Path::new(&called).file_stem().unwrap_or_default().to_string_lossy().into_owned();
    match std::env::var_os("CARGO_PKG_NAME") {
        Some(_) => format!("cargo run --release --bin {name} --"),
        None => name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(expectations: &str) -> Report {
        #[derive(serde::Deserialize)]
        struct Scene {
            #[serde(default)]
            expect: Vec<crate::report::Expect>,
        }
        let mut report = Report::new("test", "1", expectations);
        for (variant, value) in [("dx=10mm", 2.0), ("dx=5mm", 2.5), ("dx=1mm", 2.9)] {
            report.value(crate::report::Named::new(format!("peak[{variant}]"), "N"), value);
            report.value(crate::report::Named::new(format!("error[{variant}]"), ""), 3.0 - value);
            report.work(&format!("particles[{variant}]"), 10);
        }
        report.value(crate::report::Named::new("balance", ""), 1e-12);
        report.judge(&toml::from_str::<Scene>(expectations).unwrap().expect, false);
        report
    }

    fn expect(quantity: &str, bound: &str) -> String {
        format!("[[expect]]\nquantity = \"{quantity}\"\n{bound}\nkind = \"bound\"\nsource = \"s\"\n")
    }

    #[test]
    fn a_row_for_each_variant_in_the_order_of_the_studies() {
        let three =
            ["peak[dx=10mm]", "peak[dx=5mm]", "balance"].map(|name| expect(name, "at_most = 9")).concat();
        let report = report(&three);
        let table = main_values(&report, &[], &[], 100);
        let rows: Vec<&str> = table.lines().collect();
        assert_eq!(rows[0], "variant  peak [N]", "{table}");
        assert_eq!([rows[1], rows[2], rows[3]], ["dx=10mm  2", "dx=5mm   2.5", "dx=1mm   2.9"]);
        assert!(rows[4].starts_with("balance  1"), "{table}");
        let listed = main_values(&report, &["error".to_owned()], &[], 100);
        assert!(listed.starts_with("variant  error\n") && !listed.contains("balance"), "{listed}");
        assert!(verdict(&report, &TerminalStyle::plain()).starts_with("3 of 3 expectations met (3 bound)"));
    }

    /// Expectations of the scene come first, those that the program adds after its own values; regressions
    /// show nothing.
    #[test]
    fn values_of_the_program_beside_expectations() {
        let errors = ["error[dx=1mm]", "error[dx=5mm]", "error[dx=10mm]"];
        let mut own = report(&expect("balance", "at_most = 9"));
        assert_eq!(main_names(&own, &[], &["error*"]), ["balance"]);
        own.provenance.scene = "# [[expect]] of the program\n".to_owned();
        assert_eq!(main_names(&own, &[], &["error*"]), [&errors[..], &["balance"]].concat());
        let earlier = report(&expect("balance", "at_most = 9").replace("\"bound\"", "\"regression\""));
        assert_eq!(main_names(&earlier, &[], &["error*"]), errors);
    }

    #[test]
    fn failures_are_shown_in_full() {
        let report = report(&[expect("balance", "at_least = 1"), expect("gone", "at_most = 1")].concat());
        let text = verdict(&report, &TerminalStyle::plain());
        assert!(text.starts_with("0 of 2 expectations met"), "{text}");
        assert!(text.contains("FAIL  balance") && text.contains("FAIL  gone"), "{text}");
    }

    #[test]
    fn a_summary_is_small() {
        let mut finished = Finished::from(report(&expect("peak[dx=1mm]", "at_most = 9")));
        for k in 0..200 {
            finished.report.value(crate::report::Named::new(format!("a{k}[dx={k}mm]"), "m"), 1.0);
        }
        let folder = tempfile::tempdir().unwrap();
        for k in 0..20 {
            std::fs::write(folder.path().join(format!("p{k}.png")), "").unwrap();
        }
        let source =
            Source::new("s.toml", "version = 1\ntitle = \"T\"\n[report]\nvalues = [\"a*\", \"peak\"]\n");
        let program =
            Program { name: "test", version: "1", about: "", examples: "", magic: b"test-001", columns: &[] };
        let style = TerminalStyle::plain();
        let text = summary(&program, &source, &finished, folder.path(), Duration::from_secs(3), &style);
        assert!(text.lines().count() <= 25, "{text}");
        assert!(text.starts_with("T\ntest 1: 3 variants, 30 particles in 3.0 s on "), "{text}");
        let table = main_values(&finished.report, &source.report_values(), &[], 100);
        assert!(table.lines().all(|line| line.chars().count() <= 100), "{table}");
    }
}
