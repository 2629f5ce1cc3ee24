//! Comparison with external figures: the cases below cases/external.

use harness::report::Kind;
use serde::Serialize;

use crate::outcome::CaseOutcome;

/// Folder of cases/.
const FOLDER: &str = "external/";

/// External figure and ours.
#[derive(Serialize)]
pub struct ExternalFigure {
    case: String,
    anchor: String,
    title: String,
    quantity: String,
    source: String,
    kind: Kind,
    figure: String,
    ours: String,
    verdict: &'static str,
    tone: &'static str,
}

impl ExternalFigure {
    /// Cells of the row in docs/validation.md: case, quantity, source, figure with its tolerance, ours,
    /// verdict.
    pub fn cells(&self) -> [String; 6] {
        [&self.case, &self.quantity, &self.source, &self.figure, &self.ours, self.verdict].map(str::to_owned)
    }
}

/// Comparisons of all cases in the folder with closed forms, publications and other programs. A regression
/// among them keeps our own distance from a foreign figure, which is therefore missed.
pub fn figures(outcomes: &[CaseOutcome]) -> Vec<ExternalFigure> {
    let of_others = |kind| !matches!(kind, Kind::Convergence | Kind::Bound);
    let mut figures = Vec::new();
    for outcome in outcomes.iter().filter(|outcome| outcome.case.starts_with(FOLDER)) {
        let name = outcome.case.strip_prefix(FOLDER).unwrap_or(&outcome.case);
        let judged = outcome.expect().iter().filter(|judgement| of_others(judgement.expect.kind));
        figures.extend(judged.map(|judgement| {
            let [_, quantity, value, figure, source] = judgement.row();
            let unit = outcome.unit(&judgement.expect.quantity);
            let (verdict, tone) = match (judgement.pass, &outcome.failure) {
                (true, None) if judgement.expect.kind.is_evidence() && !judgement.expect.missed => {
                    ("met", "good")
                }
                _ => ("missed", "bad"),
            };
            ExternalFigure {
                case: name.to_owned(),
                anchor: super::anchor(&outcome.case),
                title: outcome.title.clone(),
                quantity,
                source,
                kind: judgement.expect.kind,
                figure,
                ours: if unit.is_empty() { value } else { format!("{value} {unit}") },
                verdict,
                tone,
            }
        }));
    }
    figures
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::tests::{outcome, report};

    #[test]
    fn figures_of_cases_in_the_folder() {
        let mut outcomes =
            [outcome(&report(3.0), None), outcome(&report(4.0), None), outcome(&report(3.0), None)];
        for (outcome, case) in outcomes.iter_mut().zip(["external/a", "external/b", "ch2/c"]) {
            outcome.case = case.to_owned();
        }
        let cells: Vec<[String; 6]> = figures(&outcomes).iter().map(ExternalFigure::cells).collect();
        assert_eq!(cells[0], ["a", "kt", "a | b", "3 ± 1 %", "3", "met"]);
        assert_eq!(cells[1], ["b", "kt", "a | b", "3 ± 1 %", "4", "missed"]);
        assert_eq!(cells.len(), 2);
        let mut ours = outcome(&report(3.0).replace("closed-form", "regression"), None);
        ours.case = "external/d".to_owned();
        assert_eq!(figures(&[ours])[0].verdict, "missed");
    }
}
