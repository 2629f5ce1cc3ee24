//! Evidence of a verdict: quantities by which cases are judged, or numbers that tests have measured.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use harness::report::{Expect, Kind};
use miette::{Result, miette};
use serde::{Deserialize, Serialize};

use crate::outcome::CaseOutcome;
use crate::test::Records;
use crate::workspace::Repository;

/// Quantity of a case, as named in cases/thesis.toml.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CaseNumber {
    /// Quantity with an `[[expect]]` in its case, unless `judged` is false.
    pub quantity: String,
    /// False for a number that is only shown: a loading for which the thesis prints no figure.
    #[serde(default = "default_true")]
    pub judged: bool,
    /// Description with the unit.
    pub what: String,
    /// Case, if it is not that of the row.
    pub case: Option<String>,
    /// Figure of the thesis, if it prints one.
    pub thesis: Option<String>,
}

fn default_true() -> bool {
    true
}

/// Number that a test measures, as named in cases/thesis.toml.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TestNumber {
    /// Name in crate `evidence`.
    pub record: String,
    /// Description with the unit.
    pub what: String,
    /// Figure of the thesis, if it prints one.
    pub thesis: Option<String>,
}

/// Row of a number: description, value, requirement, state.
#[derive(Clone, Debug, Serialize)]
pub struct NumberRow {
    /// Description.
    pub what: String,
    /// Value found.
    pub value: String,
    /// Value that the case requires.
    pub asked: String,
    /// Figure of the thesis, if any.
    pub thesis: String,
    /// Source: a case's quantity, or a test.
    pub from: String,
    /// State of the number.
    pub state: NumberState,
}

/// State of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NumberState {
    /// Within its tolerance.
    Met,
    /// Within the tolerance of our own earlier figure, which is no evidence.
    Regression,
    /// Measured by this run, without a requirement.
    Found,
    /// Outside its tolerance; or the case failed.
    Missed,
    /// Measured by a test whose sources have changed since.
    Stale,
    /// Not in this run.
    NotRun,
}

/// Returns a verdict on numbers, with a tone for the page: a missed one fails, a met one supports, the others
/// do not.
pub fn verdict(findings: &[NumberRow]) -> Option<(&'static str, &'static str)> {
    let has = |state| findings.iter().any(|finding| finding.state == state);
    match () {
        () if has(NumberState::Missed) => Some(("failed", "bad")),
        () if has(NumberState::Met) => None,
        () if has(NumberState::Stale) => Some(("stale", "open")),
        () if has(NumberState::Regression) => Some(("no evidence", "bad")),
        () => Some(("not in this run", "open")),
    }
}

impl CaseNumber {
    /// Evaluates the number in this run.
    pub fn find(&self, row: Option<&str>, outcomes: &[CaseOutcome]) -> NumberRow {
        let case = self.case.as_deref().or(row).unwrap_or_default();
        let from = format!("{case}: {}", self.quantity);
        let empty = |state, value: &str| NumberRow {
            what: self.what.clone(),
            value: value.to_owned(),
            asked: String::new(),
            thesis: self.thesis.clone().unwrap_or_default(),
            from: from.clone(),
            state,
        };
        let Some(outcome) = outcomes.iter().find(|outcome| outcome.case == case) else {
            return empty(NumberState::NotRun, "not in this run");
        };
        if !self.judged {
            return match outcome.scalar(&self.quantity) {
                Some(value) => empty(NumberState::Found, &value),
                None => empty(NumberState::NotRun, "not in this tier"),
            };
        }
        let judged: Vec<_> = outcome.expect().iter().filter(|j| j.expect.quantity == self.quantity).collect();
        let Some(last) = judged.last() else {
            return match &outcome.failure {
                Some(failure) => empty(NumberState::Missed, failure),
                None => empty(NumberState::NotRun, "not in this tier"),
            };
        };
        let [_, _, value, _, _] = last.row();
        let asked: Vec<String> = judged.iter().map(|judgement| judgement.row()[3].clone()).collect();
        let met = judged.iter().all(|judgement| judgement.pass && !judgement.expect.missed)
            && outcome.failure.is_none();
        let unit = outcome.unit(&self.quantity);
        let value = if unit.is_empty() { value } else { format!("{value} {unit}") };
        let evidence = judged.iter().any(|judgement| judgement.expect.kind.is_evidence());
        let state = match (met, evidence) {
            (true, true) => NumberState::Met,
            (true, false) => NumberState::Regression,
            (false, _) => NumberState::Missed,
        };
        NumberRow { asked: asked.join(", "), ..empty(state, &value) }
    }
}

impl TestNumber {
    /// Evaluates the number in the records of the tests.
    pub fn find(&self, records: &Records, root: &Path) -> NumberRow {
        let empty = |state, from: String| NumberRow {
            what: self.what.clone(),
            value: "not in this run".to_owned(),
            asked: String::new(),
            thesis: self.thesis.clone().unwrap_or_default(),
            from,
            state,
        };
        let Some(record) = records.get(&self.record) else {
            return empty(NumberState::NotRun, "cargo xtask test".to_owned());
        };
        let fresh = record.stamp.as_ref().is_some_and(|stamp| stamp.fresh(root));
        let state = match (record.met, fresh) {
            (false, _) => NumberState::Missed,
            (true, true) => NumberState::Met,
            (true, false) => NumberState::Stale,
        };
        let when = record.stamp.as_ref().map(ToString::to_string).unwrap_or_default();
        let from = format!("test {} in {}, {when}", record.test, record.file);
        let [value, asked] = record.cells();
        NumberRow { value, asked, ..empty(state, from) }
    }
}

/// Numbers of this run's cases and of the last run of the tests.
pub struct MeasuredNumbers<'a> {
    /// Outcomes of the cases.
    pub outcomes: &'a [CaseOutcome],
    /// Records of the tests.
    pub records: &'a Records,
    /// Root of the repository.
    pub root: &'a Path,
}

impl MeasuredNumbers<'_> {
    /// Evaluates numbers.
    pub fn findings(
        &self,
        case: Option<&str>,
        numbers: &[CaseNumber],
        tests: &[TestNumber],
    ) -> Vec<NumberRow> {
        let found = numbers.iter().map(|number| number.find(case, self.outcomes));
        found.chain(tests.iter().map(|test| test.find(self.records, self.root))).collect()
    }
}

/// Adds defects of numbers and tests to `faults`.
pub fn check(
    workspace: &Repository,
    case: Option<&str>,
    numbers: &[CaseNumber],
    tests: &[TestNumber],
    fault: &mut dyn FnMut(String),
) {
    let (mut evidence, mut regressions) = (tests.len(), 0);
    for number in numbers {
        let Some(case) = number.case.as_deref().or(case) else {
            fault(format!("`{}` names no case", number.quantity));
            continue;
        };
        match expected(workspace, case) {
            Err(error) => fault(error.to_string()),
            Ok(kinds) if number.judged => match kinds.get(&number.quantity) {
                None => fault(format!("{case} expects no `{}`", number.quantity)),
                Some(kinds) if kinds.iter().any(|kind| kind.is_evidence()) => evidence += 1,
                Some(_) => regressions += 1,
            },
            Ok(_) => {}
        }
    }
    if evidence == 0 && regressions > 0 {
        fault("rests only on our own earlier figures (kind = \"regression\")".to_owned());
    }
    for test in tests {
        if !has_source(workspace, &test.record) {
            fault(format!("no test in crates/ measures \"{}\"", test.record));
        }
    }
}

/// Lists the quantities that a case expects, and their kinds.
fn expected(workspace: &Repository, case: &str) -> Result<BTreeMap<String, Vec<Kind>>> {
    let path = workspace.root().join("cases").join(case).join("case.toml");
    let text = fs::read_to_string(&path).map_err(|error| miette!("cases/{case}/case.toml: {error}"))?;
    let table: toml::Table = toml::from_str(&text).map_err(|error| miette!("{case}: {error}"))?;
    let mut kinds = BTreeMap::<String, Vec<Kind>>::new();
    for expect in table.get("expect").and_then(toml::Value::as_array).into_iter().flatten() {
        let expect: Expect = expect.clone().try_into().map_err(|error| miette!("{case}: {error}"))?;
        kinds.entry(expect.quantity).or_default().push(expect.kind);
    }
    Ok(kinds)
}

/// Returns true if a file below crates/ or tests/ names the record: a link, not a proof.
fn has_source(workspace: &Repository, record: &str) -> bool {
    let name = format!("\"{record}\"");
    let mut folders = vec![workspace.root().join("crates"), workspace.root().join("tests")];
    while let Some(folder) = folders.pop() {
        for path in fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()) {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs")
                && fs::read_to_string(&path).is_ok_and(|text| text.contains(&name))
            {
                return true;
            }
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stamp::SourceStamp;

    #[test]
    fn records_of_tests() {
        let root = tempfile::tempdir().expect("a folder");
        std::fs::write(root.path().join("source"), "1").expect("a source");
        let text = r#"{"name": "n", "value": 0.5, "at_most": 1, "met": true, "test": "t",
            "file": "f", "stamp": null}"#;
        let mut record: crate::test::TestRecord = serde_json::from_str(text).expect("a record");
        record.stamp = Some(SourceStamp::new(root.path(), &["source".to_owned()]).expect("a stamp"));
        let row = TestNumber { record: "n".to_owned(), what: "w".to_owned(), thesis: None };
        let state = |record: &crate::test::TestRecord| {
            let records = Records::from([("n".to_owned(), record.clone())]);
            row.find(&records, root.path()).state
        };
        assert_eq!(state(&record), NumberState::Met);
        assert_eq!(row.find(&Records::new(), root.path()).state, NumberState::NotRun);
        std::fs::write(root.path().join("source"), "2").expect("a source");
        assert_eq!(state(&record), NumberState::Stale);
        record.met = false;
        assert_eq!(state(&record), NumberState::Missed);
    }

    #[test]
    fn verdicts() {
        let of = |states: &[NumberState]| {
            let [what, value, asked, thesis, from] = [""; 5].map(str::to_owned);
            let finding = NumberRow { what, value, asked, thesis, from, state: NumberState::Met };
            let findings: Vec<NumberRow> =
                states.iter().map(|&state| NumberRow { state, ..finding.clone() }).collect();
            verdict(&findings).map(|(verdict, _)| verdict)
        };
        assert_eq!(of(&[NumberState::Met, NumberState::Stale, NumberState::Regression]), None);
        assert_eq!(of(&[NumberState::Met, NumberState::Missed]), Some("failed"));
        assert_eq!(of(&[NumberState::Regression, NumberState::Found]), Some("no evidence"));
        assert_eq!(of(&[NumberState::Regression, NumberState::Stale]), Some("stale"));
        assert_eq!(of(&[NumberState::Found, NumberState::NotRun]), Some("not in this run"));
    }
}
