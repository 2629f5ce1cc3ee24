//! Errors against references over the spacing, from the reports of cases with several spacings.

use harness::report::{Column, Value};
use serde::Serialize;

use crate::outcome::CaseOutcome;

/// Start of the names of such curves.
const CURVES: &str = "reference_error_";

/// Errors of one quantity of a case, coarse to fine.
#[derive(Serialize)]
pub struct ReferenceSeries {
    case: String,
    quantity: String,
    /// Spacing, mm, seconds and relative error, formatted.
    points: Vec<[String; 3]>,
    /// Observed order between the first spacing and the last; `None` if one of the errors is 0.
    order: Option<String>,
}

impl ReferenceSeries {
    /// Cells for docs/validation.md, without seconds.
    pub fn cells(&self) -> [String; 4] {
        let points: Vec<String> =
            self.points.iter().map(|[spacing, _, error]| format!("{spacing} mm: {error}")).collect();
        [self.case.clone(), self.quantity.clone(), points.join("; "), self.order.clone().unwrap_or_default()]
    }
}

/// Collects all series.
pub fn series(outcomes: &[CaseOutcome]) -> Vec<ReferenceSeries> {
    let mut found = Vec::new();
    for outcome in outcomes {
        for (name, value) in outcome.report.iter().flat_map(|report| &report.values) {
            let (Some(name), Value::Curve { columns }) = (name.strip_prefix(CURVES), value) else { continue };
            let [spacing, seconds, error] = columns.as_slice() else { continue };
            found.push(ReferenceSeries {
                case: outcome.case.clone(),
                quantity: name.replace('[', " ["),
                points: points(spacing, seconds, error),
                order: order(&spacing.data, &error.data).map(|order| format!("{order:.1}")),
            });
        }
    }
    found
}

fn points(spacing: &Column, seconds: &Column, error: &Column) -> Vec<[String; 3]> {
    let rows = spacing.data.iter().zip(&seconds.data).zip(&error.data);
    let digits = |value: f64| format!("{}", (value * 1e6).round() / 1e6);
    let percent = |error: f64| {
        let share = 100.0 * error;
        if share < 0.01 { format!("{share:.0e} %") } else { format!("{share:.2} %") }
    };
    rows.map(|((dx, s), e)| [digits(1e3 * dx), format!("{s:.2}"), percent(*e)]).collect()
}

/// Slope of ln error over ln spacing between the first point and the last.
fn order(spacing: &[f64], error: &[f64]) -> Option<f64> {
    let ends = |data: &[f64]| Some(data.first()? / data.last()?);
    let order = ends(error)?.ln() / ends(spacing)?.ln();
    order.is_finite().then_some(order)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_between_the_ends() {
        let order_of = |error: [f64; 3]| order(&[4.0, 2.0, 1.0], &error);
        assert_eq!(order_of([0.16, 0.08, 0.01]), Some(2.0));
        assert_eq!(order_of([0.16, 0.08, 0.0]), None);
    }

    #[test]
    fn texts_of_points() {
        let column = |name: &str, data: &[f64]| Column {
            name: name.to_owned(),
            unit: String::new(),
            data: data.to_vec(),
        };
        let [spacing, seconds, error] =
            [("spacing", [1e-3, 5e-4]), ("seconds", [0.5, 4.0]), ("error", [0.0421, 3e-6])]
                .map(|(name, data)| column(name, &data));
        let texts = points(&spacing, &seconds, &error);
        assert_eq!(texts, [["1", "0.50", "4.21 %"], ["0.5", "4.00", "3e-4 %"]]);
    }
}
