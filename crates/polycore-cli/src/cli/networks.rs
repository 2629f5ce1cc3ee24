//! Tables of networks in scenes: predictions, their deviations, files.

use std::io::Write;
use std::path::{Path, PathBuf};

use harness::output::picture::{LegendPlace, LinePlot, Series};
use harness::report::Report;
use harness::scene::{SceneError, Source};
use polycore::Error;
use polycore::file::atomic_write;
use polycore::network::prediction::{Deviations, NetworkPrediction, PredictionSettings, to_csv};
use polycore::network::table::{Composition, CompositionTable};
use serde::Deserialize;

use super::MPA;
use super::network::{ConversionChoice, NetworkOptions, summary};
use super::quantities as q;

/// Table of networks to predict and to compare with measured moduli.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NetworkSpec {
    /// Name in the report.
    name: String,
    /// Compositions (CSV), relative to the scene.
    file: PathBuf,
    /// Take only rows whose source begins with this text.
    source: Option<String>,
    /// Leave out rows whose source begins with this text.
    without: Option<String>,
    /// Take only measured or only simulated rows.
    kind: Option<NetworkKind>,
    /// Polymer of rows that name none [default: PDMS].
    polymer: Option<String>,
    /// Density [default: that of the polymer].
    density: Option<polycore::units::Density>,
    /// Temperature [default: 298.15 K].
    temperature: Option<polycore::units::Temperature>,
    /// Plateau modulus that entanglements give if all are trapped [default: that of the polymer].
    entanglement_modulus: Option<polycore::units::Stress>,
    /// Choice where both conversion and sol fraction are given [default: best].
    conversion: Option<ConversionChoice>,
    /// Factor of loops in conversions from sol fractions; 0: none [default: 1.6].
    loop_factor: Option<f64>,
}

/// Origin of a modulus.
#[derive(Clone, Copy, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
enum NetworkKind {
    Measured,
    Simulated,
}

/// Checked table of a scene.
pub struct NetworkSet {
    /// Name in the report.
    pub name: String,
    table: CompositionTable,
    settings: PredictionSettings,
}

impl NetworkSpec {
    /// Reads the table.
    ///
    /// # Errors
    /// A name that cannot name a file, a table that cannot be read, settings out of their range, no row.
    pub fn read(
        self,
        source: &Source,
        index: usize,
        others: &[NetworkSet],
    ) -> Result<NetworkSet, SceneError> {
        let key = |field: &str| format!("network[{index}].{field}");
        harness::scene::check_name(source, &key("name"), &self.name)?;
        if others.iter().any(|other| other.name == self.name) {
            return Err(source.error(&key("name"), format!("`{}` a second time", self.name), "another name"));
        }
        let options = NetworkOptions {
            polymer: self.polymer,
            density: self.density,
            temperature: self.temperature,
            entanglement_modulus: self.entanglement_modulus,
            conversion: self.conversion,
            loop_factor: self.loop_factor,
        };
        let settings = options.settings().map_err(|(field, reason)| source.refused(&key(field), reason))?;
        let mut table = CompositionTable::read(source.file(&self.file))
            .map_err(|error| source.refused(&key("file"), error))?;
        let begins = |row: &Composition, with: &Option<String>| {
            with.as_ref().is_some_and(|with| row.source.starts_with(with.as_str()))
        };
        table.rows.retain(|row| {
            let kind = if row.is_simulated { NetworkKind::Simulated } else { NetworkKind::Measured };
            (self.source.is_none() || begins(row, &self.source))
                && !begins(row, &self.without)
                && self.kind.is_none_or(|wanted| wanted == kind)
        });
        if table.rows.is_empty() {
            return Err(source.error(&key("file"), "no row that is asked for", "at least one row"));
        }
        Ok(NetworkSet { name: self.name, table, settings })
    }
}

impl NetworkSet {
    /// Describes what a run will do, in a line.
    pub fn plan(&self) -> String {
        let with = self.table.rows.iter().filter(|row| row.modulus.is_some()).count();
        format!("network {}: {} compositions, {with} with a modulus", self.name, self.table.rows.len())
    }

    /// Lists the names of its scalars.
    pub fn quantities(&self) -> Vec<String> {
        q::NETWORKS.iter().map(|quantity| quantity.named(&[&self.name]).name).collect()
    }

    /// Predicts, records the deviations, writes the predictions, draws them; returns the summary.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn run(&self, directory: &Path, pictures: bool, report: &mut Report) -> Result<String, Error> {
        let predictions: Vec<Result<NetworkPrediction, String>> =
            self.table.rows.iter().map(|row| self.settings.predict(row)).collect();
        let predicted = predictions.iter().filter(|found| found.is_ok()).count();
        report.value(q::PREDICTED.named(&[&self.name]), predicted as f64);
        report.value(q::NOT_PREDICTED.named(&[&self.name]), (predictions.len() - predicted) as f64);
        if let Some(found) = Deviations::of_rows(&self.table, &predictions, |_| true) {
            for (quantity, value) in [
                (q::DEVIATION_MEAN, found.mean),
                (q::DEVIATION_MEDIAN, found.median),
                (q::DEVIATION_RMS, found.rms),
                (q::DEVIATION_LARGEST, found.largest),
            ] {
                report.value(quantity.named(&[&self.name]), value);
            }
        }
        let path = directory.join(format!("{}_networks.csv", self.name));
        atomic_write(path, |file| file.write_all(to_csv(&self.table, &predictions).as_bytes()))?;
        if pictures {
            self.draw(directory, &predictions)?;
        }
        Ok(format!("networks {}\n{}", self.name, summary(&self.table, &predictions)))
    }

    /// Draws predicted over given moduli, a series for each source; nothing without a pair of them.
    fn draw(
        &self,
        directory: &Path,
        predictions: &[Result<NetworkPrediction, String>],
    ) -> Result<(), polycore::Error> {
        let mut sources: Vec<(&str, Vec<f64>, Vec<f64>)> = Vec::new();
        for (row, prediction) in self.table.rows.iter().zip(predictions) {
            let (Some(given), Ok(found)) = (row.modulus, prediction) else { continue };
            let place = sources.iter().position(|(name, ..)| *name == row.source).unwrap_or_else(|| {
                sources.push((&row.source, Vec::new(), Vec::new()));
                sources.len() - 1
            });
            sources[place].1.push(given / MPA);
            sources[place].2.push(found.network.modulus() / MPA);
        }
        let all = || sources.iter().flat_map(|(_, given, found)| given.iter().chain(found)).copied();
        let [least, most] = [all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max)];
        if sources.is_empty() {
            return Ok(());
        }
        let mut plot = LinePlot::new(&format!("Shear moduli of networks: {}", self.name))
            .axes("given, MPa", "predicted from the chemistry, MPa")
            .log_x()
            .log_y()
            .size(760.0, 520.0)
            .legend(LegendPlace::Outside);
        for (name, given, found) in &sources {
            plot = plot.series(Series::markers(name, given, found));
        }
        let plot = plot.series(Series::reference("equal", &[least, most], &[least, most]));
        plot.write(directory.join(format!("{}_networks.png", self.name)))
    }
}
