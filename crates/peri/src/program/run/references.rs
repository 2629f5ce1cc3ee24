//! Errors against the references of a scene over the spacing, beside the run times that they took.

use super::outcome::{VariantOutcome, families};
use harness::output::picture::{LinePlot, Series};
use harness::report::{Bound, Expect, Kind, Report};
use polycore::Error;
use std::path::Path;

/// Errors of one quantity over variants that differ in spacing only, coarse to fine.
pub struct ReferenceErrors {
    /// Quantity and family: `peak_load[m=3.015]`.
    pub name: String,
    /// Spacings, m.
    pub spacing: Vec<f64>,
    /// Seconds of the solutions.
    pub seconds: Vec<f64>,
    /// Relative errors |q/q₀ − 1|.
    pub error: Vec<f64>,
}

/// Collects the quantities that an expectation of independent evidence compares with a `reference`: their
/// errors at all spacings of the study, those without an expectation too. Leaves out references of 0, and
/// families with fewer than two values.
pub fn reference_errors(expect: &[Expect], outcomes: &[VariantOutcome]) -> Vec<ReferenceErrors> {
    let mut found = Vec::new();
    for (family, members) in families(outcomes) {
        let own = |member: &VariantOutcome| -> Vec<(&str, f64)> {
            expect.iter().filter_map(|one| reference(one, &member.name)).collect()
        };
        let known: Vec<Vec<(&str, f64)>> = members.iter().map(|member| own(member)).collect();
        let mut quantities: Vec<&str> = Vec::new();
        for (quantity, _) in known.iter().flatten() {
            if !quantities.contains(quantity) {
                quantities.push(quantity);
            }
        }
        for quantity in quantities {
            let given = |own: &[(&str, f64)]| own.iter().find(|one| one.0 == quantity).map(|one| one.1);
            let all: Vec<f64> = known.iter().filter_map(|own| given(own)).collect();
            // one reference for all spacings, or one for each
            let common = all.iter().all(|reference| *reference == all[0]).then_some(all[0]);
            let mut errors = ReferenceErrors {
                name: format!("{quantity}[{family}]"),
                spacing: Vec::new(),
                seconds: Vec::new(),
                error: Vec::new(),
            };
            for (member, own) in members.iter().zip(&known) {
                let Some((value, exact)) = member.get(quantity).zip(given(own).or(common)) else { continue };
                errors.spacing.push(member.spacing);
                errors.seconds.push(member.seconds_of("solve"));
                errors.error.push((value / exact - 1.0).abs());
            }
            if errors.spacing.len() > 1 {
                found.push(errors);
            }
        }
    }
    found
}

/// Returns the quantity and the reference of an expectation on a value of a variant.
fn reference<'a>(expect: &'a Expect, variant: &str) -> Option<(&'a str, f64)> {
    let Bound::Near { reference, .. } = expect.bound else { return None };
    let independent = [Kind::Measured, Kind::ClosedForm, Kind::Published, Kind::IndependentProgram];
    let (quantity, rest) = expect.quantity.split_once('[')?;
    let same = rest.strip_suffix(']') == Some(variant);
    (same && reference != 0.0 && independent.contains(&expect.kind)).then_some((quantity, reference))
}

/// Adds the errors to a report as curves `reference_error_QUANTITY[FAMILY]`.
pub fn add(report: &mut Report, errors: &[ReferenceErrors]) {
    for ReferenceErrors { name, spacing, seconds, error } in errors {
        let columns = [
            ("spacing", "m", spacing.clone()),
            ("seconds", "s", seconds.clone()),
            ("error", "", error.clone()),
        ];
        report.curve(&format!("reference_error_{name}"), &columns);
    }
}

/// Draws the errors over the run times.
///
/// # Errors
/// A file that cannot be written.
pub fn draw(errors: &[ReferenceErrors], output: &Path) -> Result<(), Error> {
    let mut plot = LinePlot::new("Errors against references, each point a spacing").log_x().log_y();
    plot = plot.axes("solve (s)", "|value / reference - 1|").size(1000.0, 560.0);
    for ReferenceErrors { name, seconds, error, .. } in errors {
        // an error of 0 has no place on a logarithmic axis
        let (seconds, error): (Vec<f64>, Vec<f64>) =
            seconds.iter().zip(error).filter(|(s, e)| **s > 0.0 && **e > 0.0).unzip();
        plot = plot.series(Series::marked_line(name, &seconds, &error));
    }
    if errors.is_empty() { Ok(()) } else { plot.write(output.join("reference_errors.png")) }
}
