//! Values of keys drawn from a table: the uncertainty of a fit, carried through a scene.

use super::Vary;
use crate::case::rows::Rows;
use crate::output::csv;
use crate::report::Report;
use polycore::Error;
use polycore::file::atomic_write;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Draws to run, unless a user says how many.
const DRAWS: usize = 20;

crate::quantities! {
    /// Quantities that sweeps over samples report for each value.
    pub OF_SAMPLES:
    LOWER = "{value}.lower", "*", "2.5 % quantile over the samples of a sweep";
    MEDIAN = "{value}.median", "*", "median over the samples of a sweep";
    UPPER = "{value}.upper", "*", "97.5 % quantile over the samples of a sweep";
}

/// A table of the scene and the file that has a sample of its keys.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Path of the table; empty: the columns are whole paths.
    pub key: String,
    /// CSV with a column `name [unit]` for each key and a row for each draw.
    pub file: PathBuf,
}

impl FromStr for Sample {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let usage = "KEY=FILE, e.g. materials.pa12.kinetics=out/fit/nakamura_posterior.csv; \
                     =FILE if its columns are whole paths";
        match text.split_once('=') {
            Some((key, file)) if !file.trim().is_empty() => {
                Ok(Self { key: key.trim().to_owned(), file: file.trim().into() })
            }
            _ => Err(format!("found `{text}`; allowed: {usage}")),
        }
    }
}

/// Returns the first `count` rows of all samples as values of keys that change together: samples are
/// independent of each other. Without a `count` they are 20, or the rows of the shortest file.
///
/// # Errors
/// A file that is not a table of numbers, or has fewer rows.
pub fn drawn(samples: &[Sample], count: Option<usize>) -> Result<Option<Vary>, Error> {
    let tables = samples.iter().map(|sample| csv::read(&sample.file)).collect::<Result<Vec<_>, _>>()?;
    let shortest = tables.iter().flatten().map(|(_, list)| list.len()).min().unwrap_or(0);
    let count = count.unwrap_or(shortest.clamp(1, DRAWS));
    let (mut keys, mut values) = (Vec::new(), vec![Vec::new(); count]);
    for (sample, columns) in samples.iter().zip(tables) {
        let fault =
            |reason: String| Error::Option { option: format!("--sample {}", sample.file.display()), reason };
        for (heading, list) in columns {
            let (name, unit) = match heading.split_once('[') {
                Some((name, unit)) => (name.trim(), unit.trim_end_matches(']').trim()),
                None => (heading.as_str(), ""),
            };
            if list.len() < count || count == 0 {
                let found = list.len();
                return Err(fault(format!(
                    "found --count {count}; allowed: 1 to {found}, the rows of the file"
                )));
            }
            let path = [sample.key.as_str(), name].into_iter().filter(|part| !part.is_empty());
            keys.push(path.collect::<Vec<_>>().join("."));
            for (values, value) in values.iter_mut().zip(&list) {
                if !value.is_finite() {
                    return Err(fault(format!(
                        "found {value} in column `{heading}`; allowed: finite numbers"
                    )));
                }
                values.push(format!("{value:.6e} {unit}").trim().to_owned());
            }
        }
    }
    let values = values.into_iter().map(|row| row.join(";")).collect();
    Ok((!keys.is_empty()).then(|| Vary { key: keys.join(";"), values, drawn: true }))
}

/// A value over the samples, at one combination of the other keys.
struct Band {
    settings: Vec<String>,
    quantity: String,
    sorted: Vec<f64>,
}

impl Band {
    /// Linear between the order statistics (Hyndman & Fan 1996, type 7).
    fn quantile(&self, share: f64) -> f64 {
        let place = share * (self.sorted.len() - 1) as f64;
        let at = place as usize;
        let next = self.sorted[(at + 1).min(self.sorted.len() - 1)];
        self.sorted[at] + (place - at as f64) * (next - self.sorted[at])
    }

    fn mean(&self) -> f64 {
        self.sorted.iter().sum::<f64>() / self.sorted.len() as f64
    }

    fn deviation(&self) -> f64 {
        let mean = self.mean();
        let squares: f64 = self.sorted.iter().map(|x| (x - mean).powi(2)).sum();
        (squares / (self.sorted.len() - 1).max(1) as f64).sqrt()
    }
}

/// Means, deviations and quantiles of all values over the samples: into the report, a table
/// `sweep_bands.csv`, and as text.
///
/// # Errors
/// A file that cannot be written.
pub(super) fn bands(vary: &[Vary], rows: &Rows, output: &Path, report: &mut Report) -> Result<String, Error> {
    let Some(drawn) = vary.iter().position(|vary| vary.drawn) else { return Ok(String::new()) };
    let others = |settings: &[String]| -> Vec<String> {
        settings.iter().enumerate().filter(|(k, _)| *k != drawn).map(|(_, text)| text.clone()).collect()
    };
    let names = rows.names();
    let mut bands: Vec<Band> = Vec::new();
    for row in &rows.rows {
        let (settings, Ok(run)) = (others(&row.settings), &row.outcome) else { continue };
        for name in &names {
            let Some(value) = run.scalar(name) else { continue };
            match bands.iter_mut().find(|band| band.settings == settings && band.quantity == *name) {
                Some(band) => band.sorted.push(value),
                None => bands.push(Band {
                    settings: settings.clone(),
                    quantity: name.clone(),
                    sorted: vec![value],
                }),
            }
        }
    }
    let mut text = String::new();
    for band in &mut bands {
        band.sorted.sort_by(f64::total_cmp);
        let [low, median, high] = [0.025, 0.5, 0.975].map(|share| band.quantile(share));
        let settings: String = band.settings.iter().map(|text| format!("{text} ")).collect();
        let (name, count) = (format!("{settings}{}", band.quantity), band.sorted.len());
        let _ =
            writeln!(text, "{name}: median {median:.5}, 95 % within {low:.5} and {high:.5}, {count} samples");
        for (quantity, value) in [(LOWER, low), (MEDIAN, median), (UPPER, high)] {
            report.value(quantity.named(&[&name]), value);
        }
    }
    atomic_write(output.join("sweep_bands.csv"), |file| {
        let mut head: Vec<&str> =
            vary.iter().filter(|vary| !vary.drawn).map(|vary| vary.key.as_str()).collect();
        head.extend(["quantity", "samples", "mean", "standard_deviation", "lower_95", "median", "upper_95"]);
        let mut writer = ::csv::Writer::from_writer(file);
        writer.write_record(&head)?;
        for band in &bands {
            let numbers = [
                band.mean(),
                band.deviation(),
                band.quantile(0.025),
                band.quantile(0.5),
                band.quantile(0.975),
            ];
            let mut line = band.settings.clone();
            line.extend([band.quantity.clone(), band.sorted.len().to_string()]);
            line.extend(numbers.map(|number| format!("{number:?}")));
            writer.write_record(line)?;
        }
        writer.flush()
    })?;
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_keys_that_change_together() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("sample.csv");
        std::fs::write(&file, "growth_rate [1/s],n\n1.5,2\n2.5,3\n").unwrap();
        let sample = |key: &str| format!("{key}={}", file.display()).parse::<Sample>().unwrap();
        let vary = drawn(&[sample("a.b"), sample("")], Some(2)).unwrap().unwrap();
        assert_eq!(vary.key, "a.b.growth_rate;a.b.n;growth_rate;n");
        assert_eq!(vary.values[1], "2.500000e0 1/s;3.000000e0;2.500000e0 1/s;3.000000e0");
        assert_eq!(drawn(&[sample("a")], None).unwrap().unwrap().values.len(), 2);
        assert_eq!(drawn(&[], Some(2)).unwrap(), None);
        assert!(drawn(&[sample("a")], Some(3)).unwrap_err().to_string().contains("1 to 2"));
        assert!("a.csv".parse::<Sample>().unwrap_err().contains("allowed"));
    }

    #[test]
    fn quantiles_of_a_hundred_and_one() {
        let sorted = (0..=100).map(f64::from).collect();
        let band = Band { settings: Vec::new(), quantity: String::new(), sorted };
        assert_eq!([0.025, 0.5, 0.975].map(|share| band.quantile(share)), [2.5, 50.0, 97.5]);
        assert!((band.deviation() - (101.0_f64 * 102.0 / 12.0).sqrt()).abs() < 1e-12);
    }
}
