//! Charts of values of reports.

use std::path::Path;

use harness::output::picture::{LinePlot, Series};
use miette::{IntoDiagnostic, Result, WrapErr, miette};
use serde::{Deserialize, Serialize};

use super::fill;

/// Size of a chart, pixels.
const SIZE: (f64, f64) = (800.0, 480.0);

/// Curves and points over one axis.
#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Chart {
    title: String,
    /// Labels of the axes.
    axes: [String; 2],
    /// True for a logarithmic x axis.
    #[serde(default)]
    log_x: bool,
    series: Vec<ChartSeries>,
}

/// A curve of a chart: points if a value comes from a case, else a line, the reference.
#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct ChartSeries {
    name: String,
    x: Vec<f64>,
    /// Numbers, or placeholders as in tables: `{case > quantity > decimals > factor}`.
    y: Vec<String>,
}

impl Chart {
    /// Returns the cases whose values the chart shows.
    pub fn cases(&self) -> Vec<&str> {
        let texts = self.series.iter().flat_map(|series| &series.y);
        let mut cases: Vec<&str> =
            texts.flat_map(|text| fill::placeholders(text)).map(|[case, ..]| case).collect();
        cases.sort_unstable();
        cases.dedup();
        cases
    }

    /// Writes the chart as PNG.
    ///
    /// # Errors
    /// An unknown value, text that is not a number, x and y of different lengths, a file that cannot be
    /// written.
    pub fn write(&self, path: &Path, value: impl Fn(&str, &str) -> Option<f64>) -> Result<()> {
        let mut plot = LinePlot::new(&self.title).axes(&self.axes[0], &self.axes[1]).size(SIZE.0, SIZE.1);
        for series in &self.series {
            plot = plot.series(series.plot(&value).wrap_err_with(|| series.name.clone())?);
        }
        let plot = if self.log_x { plot.log_x() } else { plot };
        plot.write(path).into_diagnostic().wrap_err_with(|| path.display().to_string())
    }
}

impl ChartSeries {
    fn plot(&self, value: impl Fn(&str, &str) -> Option<f64>) -> Result<Series> {
        let number = |text: &String| -> Result<f64> {
            let text = fill::fill(text, &value)?.replace('−', "-");
            text.parse().map_err(|_| miette!("`{text}`: not a number"))
        };
        let y: Vec<f64> = self.y.iter().map(number).collect::<Result<_>>()?;
        if y.len() != self.x.len() {
            return Err(miette!("{} x and {} y", self.x.len(), y.len()));
        }
        let computed = self.y.iter().any(|text| fill::placeholders(text).next().is_some());
        let draw = if computed { Series::markers } else { Series::line };
        Ok(draw(&self.name, &self.x, &y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_reports_in_a_chart() {
        let text = "title = 't'\naxes = ['x', 'y']\nlog_x = true\n[[series]]\nname = 'a'\nx = [1, 10]\n\
            y = ['{strip > peak > 3 > 2}', '-1.5']\n[[series]]\nname = 'b'\nx = [1]\ny = ['0.5']\n";
        let mut chart: Chart = toml::from_str(text).expect("a chart");
        assert_eq!(chart.cases(), ["strip"]);
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("chart.png");
        let value = |case: &str, name: &str| (case == "strip" && name == "peak").then_some(-0.25);
        chart.write(&path, value).expect("a picture");
        assert!(path.is_file());
        assert!(chart.write(&path, |_, _| None).is_err());
        chart.series[1].x.push(2.0);
        let error = chart.write(&path, value).expect_err("lengths");
        assert_eq!(error.chain().last().expect("a cause").to_string(), "2 x and 1 y");
    }
}
