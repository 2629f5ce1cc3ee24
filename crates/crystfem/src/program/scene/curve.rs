//! Error against run time over studies.

use super::{PartScene, check_name};
use harness::report::Report;
use harness::scene::{SceneError, Source};
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
pub struct CurveSpec {
    /// Its name: values are `NAME.error_of_STUDY`.
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

impl CurveSpec {
    /// Root of the mean square of what a study's report differs by from the truth; none where a quantity is missing.
    pub fn error(&self, own: &Report, truth: Option<&Report>) -> Option<f64> {
        let mut sum = 0.0;
        for (k, quantity) in self.quantities.iter().enumerate() {
            let exact = match &self.values {
                Some(values) => *values.get(k)?,
                None => truth?.scalar(quantity)?,
            };
            sum += (own.scalar(quantity)? - exact).powi(2);
        }
        Some((sum / self.quantities.len() as f64).sqrt())
    }
}

impl PartScene {
    /// Checks names and truths.
    ///
    /// # Errors
    /// Names that are taken or that no study has, no quantity, and not one truth for each.
    pub fn check_curves(&self, source: &Source) -> Result<(), SceneError> {
        for (index, spec) in self.error_against_time.iter().enumerate() {
            let key = |of: &str| format!("error_against_time[{index}].{of}");
            check_name(source, &key("name"), &spec.name)?;
            let taken = self.study.iter().map(|study| &study.name);
            let taken = taken.chain(self.convergence.iter().map(|other| &other.name));
            let taken = taken.chain(self.error_against_time[..index].iter().map(|other| &other.name));
            if taken.into_iter().any(|other| *other == spec.name) {
                return Err(source.error(&key("name"), format!("`{}` twice", spec.name), "a unique name"));
            }
            let known = |name: &String| self.study.iter().any(|study| study.name == *name);
            if let Some(name) = spec.studies.iter().find(|name| !known(name)) {
                return Err(source.error(&key("studies"), format!("`{name}`"), "names of studies"));
            }
            if spec.quantities.is_empty() {
                return Err(source.error(&key("quantities"), "nothing", "at least one"));
            }
            match (&spec.truth, &spec.values) {
                (Some(name), None) if !known(name) => {
                    return Err(source.error(&key("truth"), format!("`{name}`"), "the name of a study"));
                }
                (None, Some(values)) if values.len() != spec.quantities.len() => {
                    let allowed = format!("one for each of the {} quantities", spec.quantities.len());
                    return Err(source.error(&key("values"), format!("{} values", values.len()), allowed));
                }
                (Some(_), None) | (None, Some(_)) => {}
                _ => return Err(source.error(&key("truth"), "none or both", "one of `truth` and `values`")),
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use harness::report::Named;

    #[test]
    fn the_error_is_the_rms_over_quantities() {
        let report = |a: f64, b: f64| {
            let mut report = Report::new("crystfem", "0", "");
            report.value(Named::new("a", ""), a).value(Named::new("b", ""), b);
            report
        };
        let mut spec = CurveSpec {
            name: String::new(),
            quantities: vec!["a".into(), "b".into()],
            studies: Vec::new(),
            truth: Some("t".into()),
            values: None,
        };
        let (own, truth) = (report(4.0, 1.0), report(1.0, 5.0));
        assert_eq!(spec.error(&own, Some(&truth)), Some(12.5_f64.sqrt()));
        assert_eq!(spec.error(&own, None), None);
        spec.values = Some(vec![4.0, 1.0]);
        assert_eq!(spec.error(&own, None), Some(0.0));
        spec.quantities.push("c".into());
        assert_eq!(spec.error(&own, None), None);
    }
}
