//! Writes docs/validation.md: the results that do not change from day to day, without seconds; dates and
//! machines are those of benches.

use harness::report::Kind;

use super::Page;
use super::others::ExternalFigure;
use crate::outcome::CaseOutcome;
use crate::summary;
use crate::table::TextTable;

/// Formats totals, thesis map, links between scales, cases, fronts, cross-checks.
pub fn text(page: &Page, outcomes: &[CaseOutcome]) -> String {
    let mut text = format!(
        "# Validation\n\nWritten by `cargo xtask validate`: {}.\nThe same with pictures, every number and \
         its source is \
         `target/validation/report.html`.\n",
        page.sums
    );
    let failed: Vec<&CaseOutcome> = outcomes.iter().filter(|outcome| !outcome.passed()).collect();
    for outcome in failed {
        let complaint = outcome.complaint(|path| path.display().to_string());
        text += &format!("\n**{} failed**:\n\n```text\n{complaint}\n```\n", outcome.case);
    }
    text += "\n## Kinds of evidence\n\n";
    let mut table = TextTable::new(["kind", "expectations", "meaning"]);
    for (kind, count) in summary::kinds(outcomes) {
        table.push([kind.to_string(), count.to_string(), meaning(kind).to_owned()]);
    }
    text += &table.markdown();
    let what = "Quantities of nature beside ours, and who measured them.";
    text += &figures("Measurements", what, "measured", &page.measurements);
    text += "\n## Thesis map\n\n";
    let mut table = TextTable::new(["thesis", "what", "numbers", "verdict"]);
    page.thesis.iter().for_each(|judged| table.push(judged.cells()));
    text += &table.markdown();
    text += "\n## Across scales\n\n";
    let mut table = TextTable::new(["link", "what", "numbers", "verdict"]);
    page.links.iter().for_each(|judged| table.push(judged.cells()));
    text += &table.markdown();
    let what = "Figures of other authors beside ours (cases below `cases/external`).";
    text += &figures("Others' figures", what, "figure", &page.others);
    text += "\n## Cases\n\n";
    let mut table = TextTable::new([
        "case",
        "program",
        "expectations",
        "of them regressions",
        "not satisfied",
        "missed as stated",
    ]);
    for outcome in outcomes {
        let missed = outcome.expect().iter().filter(|judgement| !judgement.pass).count();
        let ours = outcome.expect().iter().filter(|judgement| !judgement.expect.kind.is_evidence()).count();
        let known = outcome.expect().iter().filter(|judgement| judgement.is_known_miss()).count();
        let counts = [outcome.expect().len(), ours, missed, known].map(|count| count.to_string());
        let [all, ours, missed, known] = counts;
        table.push([outcome.case.clone(), outcome.program.clone(), all, ours, missed, known]);
    }
    text += &table.markdown();
    text += "\n## Error against run time\n\nMethods that no other measured method beats in both error and \
             time.\n\n";
    let mut table = TextTable::new(["what", "front", "default", "measured"]);
    let mut absent = Vec::new();
    for measured in &page.timing {
        match measured.cells() {
            Some(cells) => table.push(cells),
            None => absent.push(measured.missing_row()),
        }
    }
    if !table.is_empty() {
        text += &table.markdown();
    }
    for [title, command] in absent {
        text += &format!("\n{title}: not measured, run `{command}`.\n");
    }
    if !page.references.is_empty() {
        text += "\n## References over the spacing\n\nErrors of values that a closed form, a measurement, a \
                 publication or another program gives, at each spacing of a case, and the observed \
                 order.\n\n";
        let mut table = TextTable::new(["case", "value", "errors", "order"]);
        page.references.iter().for_each(|series| table.push(series.cells()));
        text += &table.markdown();
    }
    text += "\n## Cross-checks\n\n";
    let mut table = TextTable::new(["engine", "largest difference", "expected", "verdict", "measured"]);
    page.cross.iter().for_each(|crossed| table.push(crossed.cells()));
    text + &table.markdown()
}

/// Formats a section of figures beside ours; empty without any.
fn figures(title: &str, what: &str, heading: &'static str, found: &[ExternalFigure]) -> String {
    if found.is_empty() {
        return String::new();
    }
    let mut table = TextTable::new(["case", "what", "source", heading, "ours", "verdict"]);
    found.iter().for_each(|figure| table.push(figure.cells()));
    format!("\n## {title}\n\n{what}\n\n{}", table.markdown())
}

fn meaning(kind: Kind) -> &'static str {
    match kind {
        Kind::Measured => "a measurement",
        Kind::ClosedForm => "a formula, a series, or a count that follows from the problem",
        Kind::Published => "a figure of the literature or of a benchmark",
        Kind::IndependentProgram => "a figure of a program that shares no code with ours",
        Kind::Convergence => "an observed order, a change under refinement",
        Kind::Bound => "an inequality that any correct result satisfies",
        Kind::Regression => "our own earlier figure: it detects changes and is no evidence",
    }
}
