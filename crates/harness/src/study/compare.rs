//! Errors of variants against one of them, or against a number, over their run times.

use super::Solved;
use crate::report::{Quantity, Report};
use crate::scene::{SceneError, Source};
use serde::Deserialize;
use std::collections::BTreeMap;

/// A reference for one result: that of a variant, or a number.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Compare {
    /// The result, such as `peak_load`.
    pub quantity: String,
    /// Name of the reference variant.
    pub variant: Option<String>,
    /// The reference value, in SI units.
    pub value: Option<f64>,
}

impl Compare {
    /// Checks it against the names of all variants.
    ///
    /// # Errors
    /// Not one reference, a value that is no reference, an unknown variant.
    pub fn check(&self, source: &Source, variants: &[&str]) -> Result<(), SceneError> {
        let found = match (&self.variant, self.value) {
            (Some(_), Some(_)) => "both `variant` and `value`",
            (None, None) => "neither `variant` nor `value`",
            (None, Some(value)) if !(value.is_finite() && value != 0.0) => {
                "a value with which nothing compares"
            }
            (Some(name), None) if !variants.contains(&name.as_str()) => {
                return Err(source.unknown("output.compare.variant", name, variants));
            }
            _ => return Ok(()),
        };
        let allowed = "`variant`, the name of one, or `value`, a number in SI units other than 0";
        Err(source.error("output.compare", found, allowed))
    }

    /// Adds to a report the error |q/q₀ − 1| of every variant but the reference, under `error` of quantity
    /// and variant, and a curve of errors over run time for each `method`.
    pub fn add<S: Solved>(
        &self,
        report: &mut Report,
        solved: &[S],
        error: Quantity,
        method: impl Fn(&S) -> String,
    ) {
        let truth = solved.iter().find(|one| Some(one.name()) == self.variant.as_deref());
        let exact = truth.map_or(self.value, |truth| truth.scalar(&self.quantity).map(|(value, _)| value));
        let Some(exact) = exact else { return };
        let mut curves: BTreeMap<String, [Vec<f64>; 2]> = BTreeMap::new();
        for one in solved.iter().filter(|one| truth.is_none_or(|truth| truth.name() != one.name())) {
            let Some((value, _)) = one.scalar(&self.quantity) else { continue };
            let distance = (value / exact - 1.0).abs();
            report.value(error.named(&[&self.quantity, one.name()]), distance);
            let [seconds, errors] = curves.entry(method(one)).or_default();
            seconds.push(one.solve_seconds());
            errors.push(distance);
        }
        for (method, [seconds, errors]) in curves {
            let name = format!("error_against_time_{}[{method}]", self.quantity);
            report.curve(&name, &[("seconds", "s", seconds), ("error", "", errors)]);
        }
    }
}
