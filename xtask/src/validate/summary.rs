//! What the suite found, as tables for the terminal.

use std::fmt::Write as _;

use super::outcome::Outcome;
use crate::table::Table;

/// Every expectation of every case, seconds by case, and a last line of sums.
pub fn text(outcomes: &[Outcome]) -> String {
    let mut table = Table::new(["case", "quantity", "value", "asked for", "verdict"]);
    let mut times = Table::new(["case", "program", "seconds", "expectations", "not met"]);
    for outcome in outcomes {
        for [verdict, quantity, value, asked, _] in outcome.rows() {
            table.push([outcome.case.clone(), quantity, value, asked, verdict]);
        }
        let kept = if outcome.kept { " (kept)" } else { "" };
        times.push([
            outcome.case.clone(),
            outcome.program.clone(),
            format!("{:.1}{kept}", outcome.seconds),
            outcome.expect().len().to_string(),
            outcome.expect().iter().filter(|judgement| !judgement.pass).count().to_string(),
        ]);
    }
    let mut text = String::new();
    if !table.is_empty() {
        let _ = writeln!(text, "\n{}", table.text());
    }
    let seconds: f64 = outcomes.iter().map(|outcome| outcome.seconds).sum();
    let _ = write!(text, "{}\n{}; {seconds:.1} s.", times.text(), sums(outcomes));
    text
}

/// `22 cases, 0 failed; 282 expectations, 0 not met`.
pub fn sums(outcomes: &[Outcome]) -> String {
    let failed = outcomes.iter().filter(|outcome| !outcome.passed()).count();
    let judged = || outcomes.iter().flat_map(Outcome::expect);
    let missed = judged().filter(|judgement| !judgement.pass).count();
    let plural = if outcomes.len() == 1 { "" } else { "s" };
    let [cases, expectations] = [outcomes.len(), judged().count()];
    format!("{cases} case{plural}, {failed} failed; {expectations} expectations, {missed} not met")
}

#[cfg(test)]
mod tests {
    use super::super::outcome::tests::{outcome, report};
    use super::*;

    #[test]
    fn tables() {
        let outcomes = [outcome(&report(3.0), None), outcome(&report(4.0), Some("exit code 1"))];
        let text = text(&outcomes);
        assert!(text.contains("2 cases, 1 failed; 2 expectations, 1 not met; 0.0 s."), "{text}");
        assert!(text.contains("ch2/plate  kt        4      3 ± 1 %    FAIL"), "{text}");
    }
}
