//! Comparisons with other programs. A missing comparison is listed with the command that makes it.

use std::fs;

use miette::{IntoDiagnostic, Result, WrapErr};
use serde::{Deserialize, Serialize};

use crate::bench::{self, Bench, Row};
use crate::test::{self, TestRecord};
use crate::workspace::Repository;

/// File of the comparisons.
const FILE: &str = "cases/peers.toml";

#[derive(Deserialize)]
struct Checks {
    bench: Vec<BenchCheck>,
    test: Vec<TestCheck>,
}

/// Comparison by a bench.
#[derive(Deserialize)]
struct BenchCheck {
    title: String,
    /// Rows of target/bench/NAME.json …
    bench: String,
    /// … one of which contains all of these words.
    words: Vec<String>,
    /// Largest number that counts as agreement; `None` if the difference has a stated cause.
    agree: f64,
    command: String,
    needs: String,
}

/// Comparison by a test that runs the other program.
#[derive(Deserialize)]
struct TestCheck {
    title: String,
    /// Name of its number in crate `evidence`.
    record: String,
    needs: String,
}

/// Comparison, or the reason for which it is missing.
#[derive(Serialize)]
pub struct CrossCheck {
    title: String,
    what: String,
    value: String,
    asked: String,
    /// Date, machine and commit of the measurement.
    measured: String,
    verdict: &'static str,
    tone: &'static str,
    command: String,
    needs: String,
}

impl CrossCheck {
    /// Cells of the row in docs/validation.md.
    pub fn cells(&self) -> [String; 5] {
        [&self.title, &self.value, &self.asked, self.verdict, &self.measured].map(str::to_owned)
    }
}

/// Collects all comparisons, from rows of benches and numbers of tests.
pub fn checked(workspace: &Repository) -> Result<Vec<CrossCheck>> {
    let checks = read(workspace)?;
    let made = |check: &BenchCheck| {
        let bench = bench::read(workspace, &check.bench);
        let fresh = bench.as_ref().is_some_and(|bench| bench.stamp.fresh(workspace.root()));
        check.judge(bench.as_ref(), fresh)
    };
    let records = test::read(workspace);
    let tested = |tested: &TestCheck| {
        let record = records.get(&tested.record);
        let stamp = record.and_then(|record| record.stamp.as_ref());
        tested.judge(record, stamp.is_some_and(|stamp| stamp.fresh(workspace.root())))
    };
    Ok(checks.bench.iter().map(made).chain(checks.test.iter().map(tested)).collect())
}

fn read(workspace: &Repository) -> Result<Checks> {
    let text = fs::read_to_string(workspace.root().join(FILE)).into_diagnostic().wrap_err(FILE)?;
    toml::from_str(&text).into_diagnostic().wrap_err(FILE)
}

/// Returns verdict and tone.
fn judged(agrees: bool, fresh: bool) -> (&'static str, &'static str) {
    match (agrees, fresh) {
        (false, _) => ("disagrees", "bad"),
        (true, false) => ("stale", "open"),
        (true, true) => ("agrees", "good"),
    }
}

impl TestCheck {
    fn judge(&self, record: Option<&TestRecord>, fresh: bool) -> CrossCheck {
        let [value, asked] = record.map(TestRecord::cells).unwrap_or_default();
        let (verdict, tone) = record.map_or(("skipped", "open"), |record| judged(record.met, fresh));
        let stamp = record.and_then(|record| record.stamp.as_ref());
        CrossCheck {
            title: self.title.clone(),
            what: record.map(|record| record.test.clone()).unwrap_or_default(),
            value,
            asked,
            measured: stamp.map(ToString::to_string).unwrap_or_default(),
            verdict,
            tone,
            command: "cargo xtask test".to_owned(),
            needs: self.needs.clone(),
        }
    }
}

impl BenchCheck {
    /// Judges the comparison; `fresh`: the sources that the bench measured have not changed.
    fn judge(&self, bench: Option<&Bench>, fresh: bool) -> CrossCheck {
        let is_it = |row: &&Row| {
            let what = row.what.to_lowercase();
            self.words.iter().all(|word| what.contains(&word.to_lowercase()))
        };
        let worst = bench
            .iter()
            .flat_map(|bench| &bench.rows)
            .filter(is_it)
            // a number that JSON cannot represent is no agreement
            .map(|row| (row, row.value.unwrap_or(f64::NAN)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        let (what, value, verdict, tone) = match worst {
            Some((row, value)) => {
                let (verdict, tone) = judged(value <= self.agree, fresh);
                (row.what.clone(), format!("{value:.2e} {}", row.unit), verdict, tone)
            }
            None => (String::new(), String::new(), "skipped", "open"),
        };
        CrossCheck {
            title: self.title.clone(),
            what,
            value: value.trim_end().to_owned(),
            asked: format!("≤ {:e}", self.agree),
            measured: bench.map(|bench| bench.stamp.to_string()).unwrap_or_default(),
            verdict,
            tone,
            command: self.command.clone(),
            needs: self.needs.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stamp::SourceStamp;

    #[test]
    fn made_skipped_disagreeing_and_stale() {
        let workspace = Repository::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..").into());
        let check = &read(&workspace).expect(FILE).bench[0];
        assert_eq!(check.judge(None, false).verdict, "skipped");
        let root = tempfile::tempdir().expect("a folder");
        let bench = |value: f64| {
            let what = "forces, partial volumes: max |Δf|/rms f".to_owned();
            let row = Row { what, size: 1, threads: 1, value: Some(value), unit: String::new() };
            Bench { stamp: SourceStamp::new(root.path(), &[]).expect("a stamp"), rows: vec![row] }
        };
        let verdict = |value, fresh| check.judge(Some(&bench(value)), fresh).verdict;
        assert_eq!(verdict(3.4e-10, true), "agrees");
        assert_eq!(verdict(1e-3, true), "disagrees");
        assert_eq!(verdict(f64::NAN, true), "disagrees");
        assert_eq!(verdict(3.4e-10, false), "stale");
        assert!(check.judge(Some(&bench(1.0)), true).measured.contains(", commit "));
    }
}
