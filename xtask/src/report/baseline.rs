//! Differences from an earlier report.json.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use miette::{IntoDiagnostic, Result, WrapErr, miette};
use serde::{Deserialize, Serialize};

use crate::outcome::CaseOutcome;

/// Relative changes below which a difference is rounding of another machine or instruction set.
const ROUNDING: f64 = 1e-6;

/// Part of an earlier report.json that is compared.
#[derive(Deserialize)]
pub struct EarlierReport {
    commit: Option<String>,
    date: Option<String>,
    cases: Vec<OldCase>,
}

#[derive(Deserialize)]
struct OldCase {
    case: String,
    passed: bool,
    seconds: f64,
    expect: Vec<OldJudgement>,
    work: BTreeMap<String, u64>,
}

#[derive(Deserialize)]
struct OldJudgement {
    quantity: String,
    value: Option<serde_json::Value>,
    pass: bool,
}

/// Difference between two reports.
#[derive(Serialize)]
pub struct ReportDifference {
    commit: String,
    date: String,
    moved: Vec<QuantityChange>,
    /// Number of compared quantities.
    compared: usize,
}

/// Changed number.
#[derive(Serialize)]
pub struct QuantityChange {
    case: String,
    what: String,
    before: String,
    now: String,
    change: String,
    tone: &'static str,
}

impl EarlierReport {
    /// Reads a report.json of `cargo xtask validate`.
    pub fn read(path: &Path) -> Result<Self> {
        let text = fs::read_to_string(path).into_diagnostic().wrap_err_with(|| path.display().to_string())?;
        serde_json::from_str(&text).map_err(|error| {
            miette!("{} is not a report.json of `cargo xtask validate`: {error}", path.display())
        })
    }

    /// Compares everything that both reports have; seconds only if they have doubled or halved.
    pub fn compare(&self, outcomes: &[CaseOutcome]) -> ReportDifference {
        let (mut moved, mut compared) = (Vec::new(), 0);
        for outcome in outcomes {
            let mut push = |what: &str, before: String, now: String, change: String, tone| {
                moved.push(QuantityChange {
                    case: outcome.case.clone(),
                    what: what.to_owned(),
                    before,
                    now,
                    change,
                    tone,
                });
            };
            let Some(old) = self.cases.iter().find(|old| old.case == outcome.case) else {
                push("the case", "absent".to_owned(), "present".to_owned(), String::new(), "fair");
                continue;
            };
            let word = |passed: bool| if passed { "passed" } else { "failed" }.to_owned();
            if old.passed != outcome.passed() {
                let tone = if outcome.passed() { "good" } else { "bad" };
                push("verdict", word(old.passed), word(outcome.passed()), String::new(), tone);
            }
            for judgement in outcome.expect() {
                let before = old.expect.iter().find(|old| old.quantity == judgement.expect.quantity);
                let (Some(before), Some(now)) = (before, judgement.value) else { continue };
                compared += 1;
                let Some(value) = before.value.as_ref().and_then(serde_json::Value::as_f64) else { continue };
                let change = (now - value).abs() / value.abs().max(now.abs()).max(f64::MIN_POSITIVE);
                if change > ROUNDING || now.is_nan() || before.pass != judgement.pass {
                    let tone = match (before.pass, judgement.pass) {
                        (true, false) => "bad",
                        (false, true) => "good",
                        _ => "fair",
                    };
                    let change = format!("{:+.2e} ({:+.2} %)", now - value, percent(value, now));
                    push(
                        &judgement.expect.quantity,
                        format!("{value:.6}"),
                        format!("{now:.6}"),
                        change,
                        tone,
                    );
                }
            }
            for (name, &now) in outcome.report.iter().flat_map(|report| &report.work) {
                let Some(&before) = old.work.get(name) else { continue };
                compared += 1;
                if before != now {
                    let change = format!("{:+.2} %", percent(before as f64, now as f64));
                    push(&format!("work: {name}"), before.to_string(), now.to_string(), change, "fair");
                }
            }
            let ratio = outcome.seconds / old.seconds.max(1e-3);
            if !(0.5..=2.0).contains(&ratio) && outcome.seconds.max(old.seconds) > 1.0 {
                let shown = |seconds: f64| format!("{seconds:.1} s");
                push("seconds", shown(old.seconds), shown(outcome.seconds), format!("× {ratio:.2}"), "fair");
            }
        }
        let text = |text: &Option<String>| text.clone().unwrap_or_else(|| "unknown".to_owned());
        ReportDifference { commit: text(&self.commit), date: text(&self.date), moved, compared }
    }
}

fn percent(before: f64, now: f64) -> f64 {
    100.0 * (now - before) / before.abs().max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::tests::{outcome, report};

    #[test]
    fn what_moved() {
        let old = |value: f64, pass: bool| -> EarlierReport {
            serde_json::from_str(&format!(
                r#"{{"commit": "abc", "cases": [{{"case": "ch2/plate", "passed": {pass}, "seconds": 0,
                "work": {{}},
                    "expect": [{{"quantity": "kt", "value": {value}, "pass": {pass}}}]}}]}}"#
            ))
            .expect("a baseline")
        };
        let now = [outcome(&report(3.0), None)];
        assert!(old(3.0 + 1e-9, true).compare(&now).moved.is_empty());
        let difference = old(2.0, false).compare(&now);
        let moved: Vec<_> =
            difference.moved.iter().map(|m| (m.what.as_str(), m.change.as_str(), m.tone)).collect();
        assert_eq!(moved, [("verdict", "", "good"), ("kt", "+1.00e0 (+50.00 %)", "good")]);
        assert_eq!(difference.compared, 1);
    }
}
