//! Forecasts of tension curves: scene block, values, files.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use harness::case::Run;
use harness::output::picture::{LinePlot, Series};
use harness::report::Report;
use harness::scene::{SceneError, Source};
use polycore::Error;
use polycore::constitutive::hyperelastic::forecast::{
    Forecast, ForecastPoint, LEAST_CURVES, TensionCurve, forecast,
};
use polycore::constitutive::hyperelastic::{ModelDescriptor, model};
use polycore::file::atomic_write;
use serde::Deserialize;

use super::MPA;
use super::material::digits;
use super::quantities as q;
use super::scene::select_laws;

/// Tension curves whose rest is predicted from their beginning.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ForecastSpec {
    /// Name in the report.
    name: String,
    /// CSV file, relative to the scene.
    file: PathBuf,
    /// Heading of the names of the curves.
    #[serde(default = "material")]
    curves: String,
    /// Share of the strain range that is fitted.
    #[serde(default = "half")]
    share: f64,
    /// Laws, the best of which is taken.
    laws: Option<Vec<String>>,
}

fn material() -> String {
    "material".to_owned()
}

fn half() -> f64 {
    0.5
}

/// Laws of two or three parameters.
const LAWS: [&str; 6] = ["mooney-rivlin", "gent", "eight-chain", "eight-chain-root-i2", "yeoh", "ogden-1"];

/// Checked curves of a scene.
pub struct ForecastSet {
    name: String,
    curves: Vec<TensionCurve>,
    share: f64,
    laws: Vec<&'static ModelDescriptor>,
}

impl ForecastSpec {
    /// Reads the curves.
    ///
    /// # Errors
    /// A name that cannot name a file, a table that cannot be read, fewer than three curves, a share that is
    /// not between 0 and 1, an unknown law.
    pub fn read(
        self,
        source: &Source,
        index: usize,
        others: &[ForecastSet],
    ) -> Result<ForecastSet, SceneError> {
        let key = |field: &str| format!("forecast[{index}].{field}");
        harness::scene::check_name(source, &key("name"), &self.name)?;
        if others.iter().any(|other| other.name == self.name) {
            return Err(source.error(&key("name"), format!("`{}` a second time", self.name), "another name"));
        }
        if !(self.share > 0.0 && self.share < 1.0) {
            return Err(source.error(&key("share"), self.share, "above 0 and below 1"));
        }
        let laws = match &self.laws {
            Some(names) => select_laws(source, &key("laws"), names)?,
            None => LAWS.iter().filter_map(|name| model(name).ok()).collect(),
        };
        let curves = TensionCurve::read(source.file(&self.file), &self.curves)
            .map_err(|error| source.refused(&key("file"), error))?;
        if curves.len() < LEAST_CURVES {
            let allowed = format!("at least {LEAST_CURVES}: the others give the band of one");
            return Err(source.error(&key("file"), format!("{} curves", curves.len()), allowed));
        }
        Ok(ForecastSet { name: self.name, curves, share: self.share, laws })
    }
}

impl ForecastSet {
    /// Describes what a run will do, in a line.
    pub fn plan(&self) -> String {
        let laws: Vec<&str> = self.laws.iter().map(|law| law.key).collect();
        format!("forecast {}: {} curves, {}", self.name, self.curves.len(), laws.join(", "))
    }

    /// Lists the names of its scalars.
    pub fn quantities(&self) -> Vec<String> {
        q::FORECASTS.iter().map(|quantity| quantity.named(&[&self.name]).name).collect()
    }

    /// Predicts the curves, records values, writes files; returns the summary.
    ///
    /// # Errors
    /// Curves that cannot be predicted, a stop by the user, a file that cannot be written.
    pub fn run(&self, run: &Run, report: &mut Report) -> Result<String, Error> {
        let found = match forecast(&self.curves, self.share, &self.laws, run.options.interrupted) {
            Err(polycore::constitutive::Error::Stopped) => return Err(run.interruption()),
            found => found?,
        };
        self.record(&found, report);
        self.write(run.options.output, &found)?;
        if !run.options.quick {
            self.draw(run.options.output, &found)?;
        }
        Ok(self.summary(&found))
    }

    fn record(&self, found: &[Forecast], report: &mut Report) {
        let mean = |list: &mut dyn Iterator<Item = f64>| {
            let (sum, count) = list.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
            sum / f64::max(count, 1.0)
        };
        let share = |list: &mut dyn Iterator<Item = bool>| mean(&mut list.map(|is| f64::from(u8::from(is))));
        let points = || found.iter().flat_map(|one| &one.points);
        let ends = || found.iter().filter_map(|one| one.points.last());
        let mut widths: Vec<f64> = ends().map(|end| (end.band[1] / end.band[0]).sqrt() - 1.0).collect();
        widths.sort_by(f64::total_cmp);
        let error = |end: &ForecastPoint| (end.predicted / end.measured).ln().powi(2);
        let known = || found.iter().filter_map(|one| one.locking_band.zip(one.locking[1]));
        let above = found
            .iter()
            .zip(&self.curves)
            .filter_map(|(one, curve)| one.locking[0].map(|locking| locking > curve.rupture()));
        for (quantity, value) in [
            (q::FORECAST_CURVES, share(&mut found.iter().map(is_inside))),
            (q::FORECAST_POINTS, share(&mut points().map(ForecastPoint::is_inside))),
            (q::FORECAST_COVERAGE, 1.0 - 2.0 / found.len() as f64),
            (q::FORECAST_WIDTH, widths[widths.len() / 2]),
            (q::FORECAST_ERROR, mean(&mut ends().map(error)).sqrt()),
            (q::FORECAST_LOCKING, known().count() as f64),
            (
                q::FORECAST_LOCKING_INSIDE,
                share(&mut known().map(|(band, at)| band[0] <= at && at <= band[1])),
            ),
            (q::FORECAST_LOCKING_ABOVE, share(&mut above.into_iter())),
        ] {
            report.value(quantity.named(&[&self.name]), value);
        }
    }

    fn summary(&self, found: &[Forecast]) -> String {
        let mut text = format!(
            "forecast {}: stress at rupture from the first {} of the strain; band of the others\n\
             {:<30}{:<20}\
             {:>10}{:>10}{:>20}{:>8}{:>16}\n",
            self.name,
            self.share,
            "curve",
            "law",
            "measured",
            "computed",
            "band, MPa",
            "inside",
            "locking stretch"
        );
        for (one, curve) in found.iter().zip(&self.curves) {
            let Some(end) = one.points.last() else { continue };
            let [low, high] = end.band.map(|stress| digits(stress / MPA, 3));
            let [first, whole] = one.locking.map(|at| at.map_or_else(|| "-".to_owned(), |at| digits(at, 3)));
            let _ = writeln!(
                text,
                "{:<30}{:<20}{:>10}{:>10}{:>20}{:>8}{:>16}",
                curve.name,
                one.law,
                digits(end.measured / MPA, 3),
                digits(end.predicted / MPA, 3),
                format!("{low} to {high}"),
                if is_inside(one) { "yes" } else { "no" },
                format!("{first} ({whole})")
            );
        }
        text
    }

    /// Writes `NAME_forecast.csv`.
    fn write(&self, directory: &Path, found: &[Forecast]) -> Result<(), Error> {
        atomic_write(directory.join(format!("{}_forecast.csv", self.name)), |file| {
            writeln!(file, "curve,law,stretch,measured_MPa,predicted_MPa,low_MPa,high_MPa")?;
            for (one, curve) in found.iter().zip(&self.curves) {
                for point in &one.points {
                    let stresses = [point.measured, point.predicted, point.band[0], point.band[1]];
                    let stresses = stresses.map(|stress| digits(stress / MPA, 5)).join(",");
                    writeln!(file, "\"{}\",{},{:.5},{stresses}", curve.name, one.law, point.stretch)?;
                }
            }
            Ok(())
        })
    }

    /// Draws `NAME_forecast.png`, stresses beyond the beginning measured over predicted, with the band.
    fn draw(&self, directory: &Path, found: &[Forecast]) -> Result<(), Error> {
        let points: Vec<&ForecastPoint> = found.iter().flat_map(|one| &one.points).collect();
        let of = |value: fn(&ForecastPoint) -> f64| points.iter().map(|point| value(point) / MPA).collect();
        let (x, y): (Vec<f64>, Vec<f64>) = (of(|point| point.predicted), of(|point| point.measured));
        let (low, high): (Vec<f64>, Vec<f64>) = (of(|point| point.band[0]), of(|point| point.band[1]));
        let most = x.iter().chain(&y).chain(&high).fold(0.0_f64, |a, b| a.max(*b)) * 1.05;
        LinePlot::new(&format!("{}: stresses beyond the beginning", self.name))
            .axes("nominal stress predicted, MPa", "measured and band, MPa")
            .x_range(0.0, most)
            .y_range(0.0, most)
            .series(Series::reference("equal", &[0.0, most], &[0.0, most]))
            .series(Series::markers("band, lower end", &x, &low))
            .series(Series::markers("band, upper end", &x, &high))
            .series(Series::markers("measured", &x, &y))
            .write(directory.join(format!("{}_forecast.png", self.name)))
    }
}

/// Returns true if all points of a curve lie in the band.
fn is_inside(forecast: &Forecast) -> bool {
    forecast.points.iter().all(ForecastPoint::is_inside)
}
