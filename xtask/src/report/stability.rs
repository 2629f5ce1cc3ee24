//! Stiff, extreme and degenerate runs: expected and observed behaviour, and cost.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use harness::report::Judgement;
use serde::{Deserialize, Serialize};

use crate::outcome::CaseOutcome;

/// Words in the names of cases that consist of such runs, though their scenes have no `description`.
const WORDS: [&str; 2] = ["stability", "extremes"];

/// Result of a run.
#[derive(Serialize)]
pub struct StabilityTrial {
    case: String,
    what: String,
    description: String,
    observed: String,
    iterations: String,
    passed: bool,
}

/// Collects the trials of reports; for cases without trials, one for each group of expectations.
pub fn trials(outcomes: &[CaseOutcome]) -> Vec<StabilityTrial> {
    let mut trials = Vec::new();
    for outcome in outcomes {
        let Some(report) = &outcome.report else { continue };
        let case = outcome.case.clone();
        trials.extend(report.trials.iter().map(|trial| StabilityTrial {
            case: case.clone(),
            what: trial.what.clone(),
            description: trial.description.clone(),
            observed: trial.observed.clone(),
            iterations: trial.iterations.map(|count| count.to_string()).unwrap_or_default(),
            passed: trial.passed,
        }));
        let name = case.rsplit('/').next().unwrap_or(&case);
        let listed = suite_trials(&case, &outcome.output);
        if !listed.is_empty() {
            trials.extend(listed);
        } else if report.trials.is_empty() && WORDS.iter().any(|word| name.contains(word)) {
            trials
                .extend(groups(&report.expect).into_iter().map(|(what, judged)| trial(&case, what, &judged)));
        }
    }
    trials
}

/// Row of suite.json, which some programs write beside their report.
#[derive(Deserialize)]
struct StabilityRow {
    case: String,
    description: String,
    observed: String,
    pass: bool,
    steps: Option<u64>,
}

fn suite_trials(case: &str, output: &Path) -> Vec<StabilityTrial> {
    let text = fs::read_to_string(output.join("suite.json")).unwrap_or_default();
    let rows: Vec<StabilityRow> = serde_json::from_str(&text).unwrap_or_default();
    let trial = |row: StabilityRow| StabilityTrial {
        case: case.to_owned(),
        what: row.case,
        description: row.description,
        observed: row.observed,
        iterations: row.steps.map(|steps| steps.to_string()).unwrap_or_default(),
        passed: row.pass,
    };
    rows.into_iter().map(trial).collect()
}

/// Groups `run.quantity` and `quantity[run]` by their runs.
fn groups(expect: &[Judgement]) -> BTreeMap<&str, Vec<&Judgement>> {
    let mut groups = BTreeMap::<&str, Vec<&Judgement>>::new();
    for judgement in expect {
        groups.entry(parts(&judgement.expect.quantity).0).or_default().push(judgement);
    }
    groups
}

/// Splits a quantity into the run and its own name.
fn parts(quantity: &str) -> (&str, &str) {
    match quantity.split_once('[').and_then(|(name, rest)| Some((rest.strip_suffix(']')?, name))) {
        Some(parts) => parts,
        None => quantity.rsplit_once('.').unwrap_or(("", quantity)),
    }
}

fn trial(case: &str, what: &str, judged: &[&Judgement]) -> StabilityTrial {
    let (mut description, mut observed) = (Vec::new(), Vec::new());
    for judgement in judged {
        let [_, quantity, value, asked, _] = judgement.row();
        let name = parts(&quantity).1.replace('_', " ");
        description.push(format!("{name} {asked}"));
        observed.push(format!("{name} {value}"));
    }
    StabilityTrial {
        case: case.to_owned(),
        what: what.to_owned(),
        description: description.join(", "),
        observed: observed.join(", "),
        iterations: String::new(),
        passed: judged.iter().all(|judgement| judgement.pass),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_a_suite() {
        let folder = tempfile::tempdir().expect("a folder");
        assert!(suite_trials("ch4/x", folder.path()).is_empty());
        let rows = r#"[{"case": "a", "description": "end", "observed": "ended", "pass": true,
            "steps": 7, "seconds": 0.1}]"#;
        fs::write(folder.path().join("suite.json"), rows).expect("a suite");
        let trials = suite_trials("ch4/x", folder.path());
        assert_eq!(
            (trials[0].what.as_str(), trials[0].iterations.as_str(), trials[0].passed),
            ("a", "7", true)
        );
    }

    #[test]
    fn runs_of_quantities() {
        assert_eq!(parts("one-step-1e-3.final_alpha"), ("one-step-1e-3", "final_alpha"));
        assert_eq!(parts("peak[dx=2.5mm m=3.015]"), ("dx=2.5mm m=3.015", "peak"));
        assert_eq!(parts("rows"), ("", "rows"));
    }
}
