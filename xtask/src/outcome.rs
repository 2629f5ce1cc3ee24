//! Outcome of a case.

use std::path::{Path, PathBuf};

use harness::report::{Judgement, Report, Value};

/// Outcome of a case.
#[derive(Default)]
pub struct CaseOutcome {
    /// Name: `ch2/plate-with-hole`.
    pub case: String,
    /// Case file, relative to the root if it lies below.
    pub file: String,
    /// Link to the case file from target/validation.
    pub href: String,
    /// Title in the case file.
    pub title: String,
    /// Command line that ran it.
    pub program: String,
    /// Command with which a user runs it.
    pub command: String,
    /// Folder of its results.
    pub output: PathBuf,
    /// Output of the program.
    pub log: PathBuf,
    /// Wall time of the program, s.
    pub seconds: f64,
    /// True if the results of an earlier run are still valid.
    pub kept: bool,
    /// Failure other than an unmet expectation: a crash, no report.
    pub failure: Option<String>,
    /// Report of the run.
    pub report: Option<Report>,
}

impl CaseOutcome {
    /// Creates the outcome of a case that has not run yet.
    pub fn new(case: &str) -> Self {
        Self { case: case.to_owned(), ..Self::default() }
    }

    /// Adds a report; `status` is how the program failed, if it did.
    pub fn judge(&mut self, report: Report, status: Option<String>, quick: bool) {
        let missed = report.expect.iter().any(|judgement| !judgement.pass);
        self.failure = match status {
            // an unmet expectation explains the exit code and has its own row
            Some(_) if missed => None,
            Some(status) if report.non_finite.is_empty() => Some(status),
            _ if !report.non_finite.is_empty() => {
                Some(format!("not finite: {}", report.non_finite.join(", ")))
            }
            None if report.expect.is_empty() && !quick => Some("the case has no expectations".to_owned()),
            status => status,
        };
        self.report = Some(report);
    }

    /// Judged expectations.
    pub fn expect(&self) -> &[Judgement] {
        self.report.as_ref().map_or(&[], |report| &report.expect)
    }

    /// Unit of a scalar in its report.
    pub fn unit(&self, quantity: &str) -> &str {
        match self.report.as_ref().and_then(|report| report.values.get(quantity)) {
            Some(Value::Scalar { unit, .. }) => unit,
            _ => "",
        }
    }

    /// Formats a scalar of the report with its unit.
    pub fn scalar(&self, quantity: &str) -> Option<String> {
        match self.report.as_ref()?.values.get(quantity)? {
            Value::Scalar { value, unit } if unit.is_empty() => Some(format_number(*value)),
            Value::Scalar { value, unit } => Some(format!("{} {unit}", format_number(*value))),
            Value::Curve { .. } => None,
        }
    }

    /// Returns true if the run ended and met every expectation.
    pub fn passed(&self) -> bool {
        self.failure.is_none() && self.expect().iter().all(|judgement| judgement.pass)
    }

    /// Formats verdict, quantity, value, requirement, kind, source of every expectation, and the failure if
    /// there is one.
    pub fn rows(&self) -> impl Iterator<Item = [String; 6]> {
        let failure = self.failure.as_ref().map(|failure| {
            let [verdict, run, empty] = ["FAIL", "(run)", ""].map(str::to_owned);
            [verdict, run, failure.clone(), empty.clone(), empty.clone(), empty]
        });
        let row = |judgement: &Judgement| {
            let [verdict, quantity, value, asked, source] = judgement.row();
            [verdict, quantity, value, asked, judgement.expect.kind.to_string(), source]
        };
        self.expect().iter().map(row).chain(failure)
    }

    /// Lists failures, their amounts, and where to look; empty if there are none.
    pub fn complaint(&self, short: impl Fn(&Path) -> String) -> String {
        let missed = self.expect().iter().filter(|judgement| !judgement.pass);
        let mut lines: Vec<String> = missed
            .map(|judgement| {
                let [_, quantity, value, asked, _] = judgement.row();
                let by = beyond(judgement).map(|by| format!(", off by {by}")).unwrap_or_default();
                format!("{quantity} = {value}, expected {asked}{by}")
            })
            .collect();
        lines.extend(self.failure.clone());
        if !lines.is_empty() {
            lines.push(format!("results: {}, output: {}", short(&self.output), short(&self.log)));
        }
        lines.join("\n")
    }
}

/// Formats four significant digits.
fn format_number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || !(1e-3..1e6).contains(&size) {
        return format!("{value:.3e}");
    }
    let digits = (3 - size.log10().floor() as i32).max(0) as usize;
    format!("{value:.digits$}")
}

/// Returns the amount by which a value lies outside its tolerance.
fn beyond(judgement: &Judgement) -> Option<String> {
    use harness::report::Bound;
    let value = judgement.value.filter(|value| value.is_finite())?;
    let distance = match judgement.expect.bound {
        Bound::Near { reference, tolerance } => (value - reference).abs() - tolerance.distance(reference),
        Bound::Range { at_least, at_most } => {
            let low = at_least.map_or(0.0, |low| low - value);
            low.max(at_most.map_or(0.0, |high| value - high))
        }
    };
    Some(format!("{distance:.3e}"))
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use harness::report::Named;

    /// Text of a report with one expectation: kt = 3 ± 1 %.
    pub fn report(value: f64) -> String {
        let mut report = Report::new("peri", "0", "");
        report.value(Named::new("kt", ""), value);
        let expect = r#"{"quantity": "kt", "reference": 3.0, "tolerance": "1 %",
            "kind": "closed-form", "source": "a | b"}"#;
        report.judge(&[serde_json::from_str(expect).expect("an expectation")], false);
        serde_json::to_string(&report).expect("JSON")
    }

    /// Builds an outcome from a report.
    pub fn outcome(report: &str, status: Option<&str>) -> CaseOutcome {
        let mut outcome = CaseOutcome::new("ch2/plate");
        outcome.judge(serde_json::from_str(report).expect("a report"), status.map(str::to_owned), false);
        outcome
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
    fn complaints_say_what_and_by_how_much() {
        let text = outcome(&report(4.0), None).complaint(|path| path.display().to_string());
        assert!(text.starts_with("kt = 4, expected 3 ± 1 %, off by 9.700e-1\nresults: "), "{text}");
        assert_eq!(outcome(&report(3.0), None).complaint(|_| String::new()), "");
    }
}
