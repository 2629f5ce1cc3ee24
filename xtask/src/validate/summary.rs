//! What the suite found: a table for the terminal, JSON for programs, Markdown for the documentation.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use miette::{IntoDiagnostic, Result};
use polycore::output::atomic_write;
use polycore::report::{Judgement, Provenance, Report};
use serde::Serialize;

use crate::table::Table;

/// What became of a case.
#[derive(Serialize)]
pub struct Outcome {
    /// `ch2/plate-with-hole`.
    pub case: String,
    /// The command line that ran it.
    pub program: String,
    /// Wall time of the whole program.
    pub seconds: f64,
    /// Why it failed other than by its expectations: a crash, no report.
    pub failure: Option<String>,
    expect: Vec<Judgement>,
    work: BTreeMap<String, u64>,
    phases: BTreeMap<String, f64>,
    provenance: Option<Provenance>,
}

impl Outcome {
    /// Of a case that has not run yet.
    pub fn new(case: &str) -> Self {
        Self {
            case: case.to_owned(),
            program: String::new(),
            seconds: 0.0,
            failure: None,
            expect: Vec::new(),
            work: BTreeMap::new(),
            phases: BTreeMap::new(),
            provenance: None,
        }
    }

    /// Takes over a report; `status` is how the program failed, if it did.
    pub fn judge(&mut self, report: Report, status: Option<String>, quick: bool) {
        let missed = report.expect.iter().any(|judgement| !judgement.pass);
        self.failure = match status {
            // an unmet expectation explains the exit code and has its own row
            Some(_) if missed => None,
            Some(status) if report.non_finite.is_empty() => Some(status),
            _ if !report.non_finite.is_empty() => {
                Some(format!("not finite: {}", report.non_finite.join(", ")))
            }
            None if report.expect.is_empty() && !quick => Some("the case expects nothing".to_owned()),
            status => status,
        };
        self.expect = report.expect;
        self.work = report.work;
        self.phases = report.seconds;
        self.provenance = Some(report.provenance);
    }

    /// It ran to its end and met every expectation.
    pub fn passed(&self) -> bool {
        self.failure.is_none() && self.expect.iter().all(|judgement| judgement.pass)
    }

    /// Verdict, quantity, value, requirement, source of every expectation, and the failure if there is one.
    fn rows(&self) -> impl Iterator<Item = [String; 5]> {
        let failure = self.failure.as_ref().map(|failure| {
            let [verdict, empty] = ["FAIL", ""].map(str::to_owned);
            [verdict, "(run)".to_owned(), failure.clone(), empty.clone(), empty]
        });
        self.expect.iter().map(Judgement::row).chain(failure)
    }
}

/// Every expectation of every case, seconds by case, and a last line of sums.
pub fn text(outcomes: &[Outcome]) -> String {
    let mut table = Table::new(["case", "quantity", "value", "asked for", "verdict"]);
    let mut times = Table::new(["case", "program", "seconds", "expectations", "not met"]);
    for outcome in outcomes {
        for [verdict, quantity, value, asked, _] in outcome.rows() {
            table.push([outcome.case.clone(), quantity, value, asked, verdict]);
        }
        times.push([
            outcome.case.clone(),
            outcome.program.clone(),
            format!("{:.1}", outcome.seconds),
            outcome.expect.len().to_string(),
            outcome.expect.iter().filter(|judgement| !judgement.pass).count().to_string(),
        ]);
    }
    let mut text = String::new();
    if !table.is_empty() {
        let _ = writeln!(text, "\n{}", table.text());
    }
    let _ = write!(text, "{}\n{}", times.text(), sums(outcomes));
    text
}

/// summary.json and validation.md.
pub fn write(folder: &Path, outcomes: &[Outcome], quick: bool) -> Result<[PathBuf; 2]> {
    let paths = ["summary.json", "validation.md"].map(|name| folder.join(name));
    atomic_write(&paths[0], |file| {
        serde_json::to_writer_pretty(&mut *file, outcomes)?;
        file.write_all(b"\n")
    })
    .into_diagnostic()?;
    atomic_write(&paths[1], |file| file.write_all(markdown(outcomes, quick).as_bytes())).into_diagnostic()?;
    Ok(paths)
}

fn markdown(outcomes: &[Outcome], quick: bool) -> String {
    let task = if quick { "cargo xtask validate --quick" } else { "cargo xtask validate" };
    let mut text = format!("# Validation\n\nWritten by `{task}`: {}\n", sums(outcomes));
    if let Some(provenance) = outcomes.iter().find_map(|outcome| outcome.provenance.as_ref()) {
        let host = &provenance.host;
        let commit = provenance.git.as_ref().map_or("unknown", |git| git.hash.as_str());
        let _ = writeln!(
            text,
            "Commit {commit}, {}, on {} ({}, {} cores).",
            provenance.date, host.cpu, host.system, host.cores
        );
    }
    for outcome in outcomes {
        let verdict = if outcome.passed() { "passed" } else { "failed" };
        let _ = writeln!(
            text,
            "\n## {}\n\n`{}`, {:.1} s, {verdict}.\n",
            outcome.case, outcome.program, outcome.seconds
        );
        let mut table = Table::new(["verdict", "quantity", "value", "asked for", "source"]);
        outcome.rows().for_each(|row| table.push(row));
        if !table.is_empty() {
            text += &table.markdown();
        }
    }
    text
}

fn sums(outcomes: &[Outcome]) -> String {
    let failed = outcomes.iter().filter(|outcome| !outcome.passed()).count();
    let expectations: usize = outcomes.iter().map(|outcome| outcome.expect.len()).sum();
    let missed =
        outcomes.iter().flat_map(|outcome| &outcome.expect).filter(|judgement| !judgement.pass).count();
    let seconds: f64 = outcomes.iter().map(|outcome| outcome.seconds).sum();
    format!(
        "{} cases, {failed} failed; {expectations} expectations, {missed} not met; {seconds:.1} s.",
        outcomes.len()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(report: &str, status: Option<&str>) -> Outcome {
        let mut outcome = Outcome::new("ch2/plate");
        outcome.judge(serde_json::from_str(report).expect("a report"), status.map(str::to_owned), false);
        outcome
    }

    fn report(value: f64) -> String {
        let mut report = Report::new("peri", "0", "");
        report.value("kt", value, "");
        let expect = r#"{"quantity": "kt", "reference": 3.0, "tolerance": "1 %", "source": "a | b"}"#;
        report.judge(&[serde_json::from_str(expect).expect("an expectation")], false);
        serde_json::to_string(&report).expect("JSON")
    }

    #[test]
    fn verdicts() {
        assert!(outcome(&report(3.0), None).passed());
        let missed = outcome(&report(4.0), Some("exit code 1"));
        assert!(!missed.passed() && missed.failure.is_none());
        assert_eq!(
            outcome(&report(3.0), Some("killed by signal 9")).failure.as_deref(),
            Some("killed by signal 9")
        );
        assert!(outcome(&report(f64::NAN), Some("exit code 1")).rows().any(|row| row[2].contains("NaN")));
        let empty = serde_json::to_string(&Report::new("peri", "0", "")).expect("JSON");
        assert!(!outcome(&empty, None).passed());
    }

    #[test]
    fn pages() {
        let outcomes = [outcome(&report(3.0), None), outcome(&report(4.0), Some("exit code 1"))];
        assert!(text(&outcomes).contains("2 cases, 1 failed; 2 expectations, 1 not met"));
        let page = markdown(&outcomes, false);
        assert!(page.contains("| FAIL | kt | 4 | 3 ± 1 % | a \\| b |"), "{page}");
        let folder = std::env::temp_dir();
        assert!(write(&folder.join("no/such/folder"), &outcomes, false).is_err());
    }
}
