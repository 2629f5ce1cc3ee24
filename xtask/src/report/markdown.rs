//! docs/validation.md: what stays the same from day to day, without seconds, dates and machines.

use super::Page;
use crate::table::Table;
use crate::validate::outcome::Outcome;

/// Sums, thesis map, cases, fronts, cross-checks.
pub fn text(page: &Page, outcomes: &[Outcome]) -> String {
    let mut text = format!(
        "# Validation\n\nWritten by `cargo xtask validate`: {}.\nThe same with pictures, every number and its source is \
         `target/validation/report.html`.\n",
        page.sums
    );
    let failed: Vec<&Outcome> = outcomes.iter().filter(|outcome| !outcome.passed()).collect();
    for outcome in failed {
        let complaint = outcome.complaint(|path| path.display().to_string());
        text += &format!("\n**{} failed**:\n\n```text\n{complaint}\n```\n", outcome.case);
    }
    text += "\n## Thesis map\n\n";
    let mut table = Table::new(["thesis", "what", "numbers", "verdict"]);
    page.thesis.iter().for_each(|judged| table.push(judged.cells()));
    text += &table.markdown();
    text += "\n## Cases\n\n";
    let mut table = Table::new(["case", "program", "expectations", "not met"]);
    for outcome in outcomes {
        let missed = outcome.expect().iter().filter(|judgement| !judgement.pass).count();
        let counts = [outcome.expect().len(), missed].map(|count| count.to_string());
        let [all, missed] = counts;
        table.push([outcome.case.clone(), outcome.program.clone(), all, missed]);
    }
    text += &table.markdown();
    text += "\n## Error against run time\n\nMethods that nothing measured beats in both error and time.\n\n";
    let mut table = Table::new(["what", "front", "default"]);
    let mut absent = Vec::new();
    for measured in &page.timing {
        match measured.cells() {
            Some(cells) => table.push(cells),
            None => absent.push(measured.absent()),
        }
    }
    if !table.is_empty() {
        text += &table.markdown();
    }
    for [title, command] in absent {
        text += &format!("\n{title}: not measured, run `{command}`.\n");
    }
    text += "\n## Cross-checks\n\n";
    let mut table = Table::new(["engine", "largest difference", "asked for", "verdict"]);
    page.cross.iter().for_each(|crossed| table.push(crossed.cells()));
    text + &table.markdown()
}
