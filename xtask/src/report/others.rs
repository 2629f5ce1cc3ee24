//! Comparison with external figures: measurements of all cases, and other figures of those below
//! cases/external.

use harness::report::{Judgement, Kind};
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

/// Comparisons of all cases with measurements.
pub fn measurements(outcomes: &[CaseOutcome]) -> Vec<ExternalFigure> {
    let judged = outcomes.iter().flat_map(|outcome| of_case(outcome, &outcome.case));
    judged.filter(|figure| figure.kind == Kind::Measured).collect()
}

/// Comparisons of all cases in the folder with closed forms, publications and other programs. A regression
/// among them keeps our own distance from a foreign figure, which is therefore missed.
pub fn figures(outcomes: &[CaseOutcome]) -> Vec<ExternalFigure> {
    let of_others = |kind| !matches!(kind, Kind::Measured | Kind::Convergence | Kind::Bound);
    let named = outcomes.iter().filter_map(|outcome| Some((outcome, outcome.case.strip_prefix(FOLDER)?)));
    let judged = named.flat_map(|(outcome, name)| of_case(outcome, name));
    judged.filter(|figure| of_others(figure.kind)).collect()
}

/// Comparisons of one case.
fn of_case<'a>(outcome: &'a CaseOutcome, name: &'a str) -> impl Iterator<Item = ExternalFigure> + 'a {
    outcome.expect().iter().map(move |judgement| comparison(outcome, name, judgement))
}

fn comparison(outcome: &CaseOutcome, name: &str, judgement: &Judgement) -> ExternalFigure {
    let [_, quantity, value, figure, source] = judgement.row();
    let unit = outcome.unit(&judgement.expect.quantity);
    let (verdict, tone) = match (judgement.pass, &outcome.failure) {
        (true, None) if judgement.expect.kind.is_evidence() && !judgement.expect.missed => ("met", "good"),
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

    #[test]
    fn measurements_of_all_cases() {
        let mut outcomes =
            [outcome(&report(3.0).replace("closed-form", "measured"), None), outcome(&report(3.0), None)];
        outcomes[0].case = "external/a".to_owned();
        let cells: Vec<[String; 6]> = measurements(&outcomes).iter().map(ExternalFigure::cells).collect();
        assert_eq!(cells, [["external/a", "kt", "a | b", "3 ± 1 %", "3", "met"]]);
        assert!(figures(&outcomes).is_empty());
    }
}
