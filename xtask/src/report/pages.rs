//! Result pages of cases whose bodies are worth rotating: those that tear, and those that are printed.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use harness::view;

use crate::outcome::CaseOutcome;

/// Writes the page of a case with fields of a fracture or a print, if its results are newer, and returns its
/// path; `None` if there is no body.
pub fn page(outcome: &CaseOutcome) -> Option<PathBuf> {
    let report = outcome.report.as_ref()?;
    let of_it =
        |key: &str| ["broken_bonds", "birth_energy"].iter().any(|name| key.split('[').next() == Some(name));
    let worth =
        report.values.keys().any(|key| of_it(key) && report.scalar(key).is_some_and(|value| value != 0.0));
    let entries = std::fs::read_dir(&outcome.output).ok()?.flatten();
    let fields = entries.filter(|entry| entry.path().extension().is_some_and(|end| end == "vtkhdf")).count();
    if !worth || fields == 0 {
        return None;
    }
    let path = outcome.output.join(view::FILE_NAME);
    let age =
        |path: &Path| path.metadata().and_then(|file| file.modified()).unwrap_or(SystemTime::UNIX_EPOCH);
    if age(&path) < age(&outcome.output.join(harness::report::FILE_NAME)) {
        view::write(&outcome.output, None).ok()?;
    }
    Some(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use harness::output::vtkhdf::ParticleSeries;
    use harness::report::{Named, Report};

    #[test]
    fn only_what_tears_or_is_printed_has_a_page() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut outcome = CaseOutcome::new("ch9/it");
        outcome.output = folder.path().join("ch9/it");
        std::fs::create_dir_all(&outcome.output).expect("a folder");
        let points: Vec<[f64; 3]> = (0..9).map(|k| [f64::from(k % 3), f64::from(k / 3), 0.0]).collect();
        let mut series = ParticleSeries::create(outcome.output.join("a.vtkhdf")).expect("a series");
        series.step(1.0, &points, &[("damage", 1, &[0.5; 9])]).expect("a step");
        series.finish().expect("a file");
        let mut judged = |name: &str, value: f64| {
            let mut report = Report::new("peri", "0", "");
            report.value(Named { name: name.to_owned(), unit: String::new() }, value);
            report.write(&outcome.output).expect("a report");
            outcome.report = Some(report);
            page(&outcome)
        };
        let path = judged("broken_bonds[a]", 3.0).expect("a page");
        assert_eq!([judged("broken_bonds", 0.0), judged("broken", 3.0)], [None, None]);
        let written = std::fs::read_to_string(path).expect("a page");
        assert!(written.contains("damage"));
    }
}
