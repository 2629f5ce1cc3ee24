//! Results of the validation, as tables for the terminal.

use std::fmt::Write as _;

use harness::report::Kind;

use crate::outcome::CaseOutcome;
use crate::table::TextTable;

/// Formats every expectation of every case, seconds by case, and a last line with totals.
pub fn text(outcomes: &[CaseOutcome]) -> String {
    let mut table = TextTable::new(["case", "quantity", "value", "expected", "kind", "verdict"]);
    let mut times = TextTable::new(["case", "program", "seconds", "expectations", "not satisfied"]);
    for outcome in outcomes {
        for [verdict, quantity, value, asked, kind, _] in outcome.rows() {
            table.push([outcome.case.clone(), quantity, value, asked, kind, verdict]);
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

/// Last line of the summary: `22 cases, 0 failed; 282 expectations, 0 not satisfied: 120 closed-form, …`.
pub fn sums(outcomes: &[CaseOutcome]) -> String {
    let failed = outcomes.iter().filter(|outcome| !outcome.passed()).count();
    let judged = || outcomes.iter().flat_map(CaseOutcome::expect);
    let missed = judged().filter(|judgement| !judgement.pass).count();
    let known = judged().filter(|judgement| judgement.is_known_miss()).count();
    let plural = if outcomes.len() == 1 { "" } else { "s" };
    let [cases, expectations] = [outcomes.len(), judged().count()];
    let (evidence, regressions): (Vec<_>, Vec<_>) =
        kinds(outcomes).into_iter().partition(|(kind, _)| kind.is_evidence());
    let of = |list: &[(Kind, usize)]| {
        list.iter().map(|(kind, count)| format!("{count} {kind}")).collect::<Vec<_>>().join(", ")
    };
    let mut text =
        format!("{cases} case{plural}, {failed} failed; {expectations} expectations, {missed} not satisfied");
    if known > 0 {
        text += &format!(", {known} missed as stated");
    }
    if !evidence.is_empty() {
        text += &format!(": {}", of(&evidence));
    }
    if !regressions.is_empty() {
        text += &format!("; {} (no evidence)", of(&regressions));
    }
    text
}

/// Counts the expectations of each kind.
pub fn kinds(outcomes: &[CaseOutcome]) -> Vec<(Kind, usize)> {
    let count = |kind: Kind| {
        let judged = outcomes.iter().flat_map(CaseOutcome::expect);
        (kind, judged.filter(|judgement| judgement.expect.kind == kind).count())
    };
    Kind::ALL.map(count).into_iter().filter(|(_, count)| *count > 0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::tests::{outcome, report};

    #[test]
    fn tables() {
        let outcomes = [outcome(&report(3.0), None), outcome(&report(4.0), Some("exit code 1"))];
        let text = text(&outcomes);
        assert!(
            text.contains("2 cases, 1 failed; 2 expectations, 1 not satisfied: 2 closed-form; 0.0 s."),
            "{text}"
        );
        assert!(text.contains("ch2/plate  kt        4      3 ± 1 %   closed-form  FAIL"), "{text}");
    }

    #[test]
    fn kinds_are_counted() {
        let ours = report(3.0).replace("closed-form", "regression");
        let outcomes = [outcome(&report(3.0), None), outcome(&report(3.0), None), outcome(&ours, None)];
        let text = sums(&outcomes);
        assert!(
            text.ends_with("3 expectations, 0 not satisfied: 2 closed-form; 1 regression (no evidence)"),
            "{text}"
        );
        assert!(sums(&[outcome(&ours, None)]).ends_with("0 not satisfied; 1 regression (no evidence)"));
    }
}
