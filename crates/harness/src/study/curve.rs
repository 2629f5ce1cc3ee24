//! Error against run time over studies.

use super::{ERROR_OF, Solved};
use crate::report::Report;
use crate::scene::{SceneError, Source};
use serde::Deserialize;

/// Studies that solve one problem at different cost, and a reference.
///
/// ```toml
/// [[error_against_time]]
/// name = "tr-bdf2"
/// quantities = ["layer-1.mean_alpha", "layer-2.mean_alpha"]
/// studies = ["step-4s", "step-2s", "step-1s"]
/// truth = "step-0.01s"
/// ```
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ErrorAgainstTime {
    /// Name: values are `NAME.error_of_STUDY`.
    pub name: String,
    /// Quantities, without the study's name; the error is the root of the mean of their squared differences.
    pub quantities: Vec<String>,
    /// Studies, from cheap to exact.
    pub studies: Vec<String>,
    /// A study that is much more exact.
    pub truth: Option<String>,
    /// Or the reference of each quantity, in the report's unit (degC for temperatures).
    pub values: Option<Vec<f64>>,
}

impl ErrorAgainstTime {
    /// Root mean square of the differences between a study and the truth; none where a quantity is missing.
    pub fn error<S: Solved>(&self, own: &S, truth: Option<&S>) -> Option<f64> {
        let mut sum = 0.0;
        for (k, quantity) in self.quantities.iter().enumerate() {
            let exact = match &self.values {
                Some(values) => *values.get(k)?,
                None => truth?.scalar(quantity)?.0,
            };
            sum += (own.scalar(quantity)?.0 - exact).powi(2);
        }
        Some((sum / self.quantities.len() as f64).sqrt())
    }

    pub(super) fn check(&self, source: &Source, index: usize, known: &[&str]) -> Result<(), SceneError> {
        let fault = |of: &str, found: String, allowed: &str| {
            Err(source.error(&format!("error_against_time[{index}].{of}"), found, allowed))
        };
        let known = |name: &&String| !known.contains(&name.as_str());
        if let Some(name) = self.studies.iter().find(known) {
            return fault("studies", format!("`{name}`"), "names of studies");
        }
        let count = self.quantities.len();
        match (&self.truth, &self.values) {
            _ if count == 0 => fault("quantities", "an empty list".to_owned(), "at least one"),
            (Some(name), None) if known(&name) => fault("truth", format!("`{name}`"), "the name of a study"),
            (None, Some(values)) if values.len() != count => {
                let allowed = format!("one for each of the {count} quantities");
                fault("values", format!("{} values", values.len()), &allowed)
            }
            (Some(_), None) | (None, Some(_)) => Ok(()),
            _ => fault("truth", "none or both".to_owned(), "one of `truth` and `values`"),
        }
    }

    pub(super) fn add<'a, S: Solved + 'a>(&self, report: &mut Report, of: impl Fn(&String) -> Option<&'a S>) {
        let truth = self.truth.as_ref().and_then(&of);
        let (mut seconds, mut errors) = (Vec::new(), Vec::new());
        for study in &self.studies {
            if let Some((own, error)) = of(study).and_then(|own| Some((own, self.error(own, truth)?))) {
                report.value(ERROR_OF.named(&[&self.name, study]), error);
                seconds.push(own.solve_seconds());
                errors.push(error);
            }
        }
        if !errors.is_empty() {
            let columns = [("seconds", "s", seconds), ("error", "", errors)];
            report.curve(&format!("error_against_time_{}", self.name), &columns);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Row;
    use crate::report::Named;

    #[test]
    fn the_error_is_the_rms_over_quantities() {
        let row = |a: f64, b: f64| {
            let mut report = Report::new("crystfem", "0", "");
            report.value(Named::new("a", ""), a).value(Named::new("b", ""), b);
            Row { name: String::new(), settings: Vec::new(), outcome: Ok(report) }
        };
        let mut spec = ErrorAgainstTime {
            name: String::new(),
            quantities: vec!["a".into(), "b".into()],
            studies: Vec::new(),
            truth: Some("t".into()),
            values: None,
        };
        let (own, truth) = (row(4.0, 1.0), row(1.0, 5.0));
        assert_eq!(spec.error(&own, Some(&truth)), Some(12.5_f64.sqrt()));
        assert_eq!(spec.error(&own, None), None);
        spec.values = Some(vec![4.0, 1.0]);
        assert_eq!(spec.error(&own, None), Some(0.0));
        spec.quantities.push("c".into());
        assert_eq!(spec.error(&own, None), None);
    }
}
