//! `polycore network`: predictions for a table of compositions.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use harness::case::terminal;
use polycore::Error;
use polycore::file::{atomic_write, parent, prepare_directory};
use polycore::network::prediction::{
    ConversionSource, Deviations, NetworkPrediction, PredictionSettings, to_csv,
};
use polycore::network::table::{Composition, CompositionTable};
use polycore::units::{Density, Stress, Temperature};

/// Arguments of `polycore network FILE.csv -o OUT.csv`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Compositions (CSV): columns f, r, M_strand_kg_mol and, with empty cells where unknown, p, w_sol,
    /// sol, kind, M_linker_kg_mol, M_mono_kg_mol, b1, polymer, source, G_MPa; other columns are kept.
    file: PathBuf,
    /// Predictions (CSV); default: standard output, and the summary on standard error.
    #[arg(long, short)]
    output: Option<PathBuf>,
    #[command(flatten)]
    settings: NetworkOptions,
}

/// Settings of the predictions, on the command line and in scenes.
#[derive(Clone, Debug, Default, clap::Args, serde::Deserialize, schemars::JsonSchema)]
#[serde(default)]
pub struct NetworkOptions {
    /// Polymer of rows that name none [default: PDMS]
    #[arg(long, value_name = "NAME")]
    pub polymer: Option<String>,
    /// Density [default: that of the polymer]
    #[arg(long, value_name = "QUANTITY")]
    pub density: Option<Density>,
    /// Temperature [default: 298.15 K]
    #[arg(long, value_name = "QUANTITY")]
    pub temperature: Option<Temperature>,
    /// Plateau modulus that entanglements give if all are trapped [default: that of the polymer]
    #[arg(long, value_name = "QUANTITY")]
    pub entanglement_modulus: Option<Stress>,
    /// Choice where both conversion and sol fraction are given [default: best]
    #[arg(long, value_enum)]
    pub conversion: Option<ConversionChoice>,
    /// Factor of loops in conversions from sol fractions; 0: none [default: 1.6]
    #[arg(long, value_name = "NUMBER")]
    pub loop_factor: Option<f64>,
}

/// Choice between conversion and sol fraction where both are given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ConversionChoice {
    /// A conversion of 1 or of a simulation, else the sol fraction.
    Best,
    /// The conversion.
    Given,
    /// The sol fraction.
    Sol,
}

impl NetworkOptions {
    /// Settings of the library.
    ///
    /// # Errors
    /// The name of the option, and what is wrong.
    pub fn settings(&self) -> Result<PredictionSettings, (&'static str, String)> {
        let mut settings = PredictionSettings::default();
        if let Some(name) = &self.polymer {
            settings = settings.polymer(name).map_err(|error| ("polymer", error.to_string()))?;
        }
        let positive = |name, value: f64, allowed: &str| match value.is_finite() && value > 0.0 {
            true => Ok(value),
            false => Err((name, format!("found {value}; allowed: {allowed}"))),
        };
        if let Some(density) = self.density {
            settings.density = Some(positive("density", density.si(), "a positive density")?);
        }
        if let Some(temperature) = self.temperature {
            settings.temperature = positive("temperature", temperature.si(), "above absolute zero")?;
        }
        if let Some(modulus) = self.entanglement_modulus.map(Stress::si) {
            if modulus.is_nan() || modulus < 0.0 {
                let why = format!("found {modulus} Pa; allowed: 0 or a positive stress");
                return Err(("entanglement_modulus", why));
            }
            settings.entanglement_modulus = Some(modulus);
        }
        settings.conversion = match self.conversion {
            None | Some(ConversionChoice::Best) => ConversionSource::Best,
            Some(ConversionChoice::Given) => ConversionSource::Given,
            Some(ConversionChoice::Sol) => ConversionSource::Sol,
        };
        if let Some(factor) = self.loop_factor {
            if !(0.0..=100.0).contains(&factor) {
                return Err(("loop_factor", format!("found {factor}; allowed: 0 to 100")));
            }
            settings.loop_factor = factor;
        }
        Ok(settings)
    }
}

/// Predicts and writes.
///
/// # Errors
/// Options and files that cannot be used; nothing is written then.
pub fn run(arguments: &Arguments) -> Result<bool, Error> {
    let settings = arguments.settings.settings().map_err(|(name, reason)| Error::Option {
        option: format!("--{}", name.replace('_', "-")),
        reason,
    })?;
    let table = CompositionTable::read(&arguments.file)?;
    let predictions: Vec<_> = table.rows.iter().map(|row| settings.predict(row)).collect();
    let csv = to_csv(&table, &predictions);
    let summary = summary(&table, &predictions);
    match &arguments.output {
        None => {
            terminal::print(csv);
            terminal::complain(summary);
        }
        Some(path) => {
            refuse_input(&arguments.file, path)?;
            prepare_directory(parent(path))?;
            atomic_write(path, |file| file.write_all(csv.as_bytes()))?;
            terminal::print(format_args!("{summary}{}\n", path.display()));
        }
    }
    Ok(true)
}

/// Refuses to overwrite the table of compositions.
fn refuse_input(input: &Path, output: &Path) -> Result<(), Error> {
    let same = [input, output].map(|path| std::fs::canonicalize(path).ok());
    match &same {
        [Some(input), Some(output)] if input == output => Err(Error::Option {
            option: "--output".to_owned(),
            reason: "it is the table of compositions; name another file".to_owned(),
        }),
        _ => Ok(()),
    }
}

/// Sums up the deviations by source, and the reasons of rows without a prediction.
pub fn summary(table: &CompositionTable, predictions: &[Result<NetworkPrediction, String>]) -> String {
    let mut text =
        format!("{:<34}{:>6}{:>11}{:>8}{:>8}{:>8}\n", "source", "rows", "predicted", "mean", "median", "rms");
    let mut line = |name: &str, counts: &dyn Fn(&Composition) -> bool| {
        let of_rows = || table.rows.iter().zip(predictions).filter(|(row, _)| counts(row));
        let (rows, predicted) = (of_rows().count(), of_rows().filter(|(_, found)| found.is_ok()).count());
        let name: String = name.chars().take(33).collect();
        let _ = write!(text, "{name:<34}{rows:>6}{predicted:>11}");
        if let Some(Deviations { mean, median, rms, .. }) = Deviations::of_rows(table, predictions, counts) {
            let percent = |value: f64| format!("{:.1} %", 100.0 * value);
            let _ = write!(text, "{:>8}{:>8}{:>8}", percent(mean), percent(median), percent(rms));
        }
        text.push('\n');
    };
    let mut groups: Vec<(&str, bool)> =
        table.rows.iter().map(|row| (row.source.as_str(), row.is_simulated)).collect();
    groups.sort_unstable();
    groups.dedup();
    for &(source, is_simulated) in &groups {
        let name = if source.is_empty() { "(no source)" } else { source };
        let name = if is_simulated { format!("{name}, simulated") } else { name.to_owned() };
        line(&name, &|row| row.source == source && row.is_simulated == is_simulated);
    }
    for (name, is_simulated) in [("all measured", false), ("all simulated", true)] {
        if groups.len() > 1 && groups.iter().any(|group| group.1 == is_simulated) {
            line(name, &|row| row.is_simulated == is_simulated);
        }
    }
    let mut reasons: Vec<(&str, Vec<usize>)> = Vec::new();
    for (row, prediction) in table.rows.iter().zip(predictions) {
        let Err(reason) = prediction else { continue };
        match reasons.iter_mut().find(|(known, _)| known == reason) {
            Some((_, lines)) => lines.push(row.line),
            None => reasons.push((reason, vec![row.line])),
        }
    }
    if !reasons.is_empty() {
        text += "not predicted:\n";
    }
    for (reason, lines) in reasons {
        let plural = if lines.len() == 1 { "" } else { "s" };
        let _ = writeln!(text, "  line{plural} {}: {reason}", ranges(&lines));
    }
    if !table.unused.is_empty() {
        let _ = writeln!(text, "columns not used: {}", table.unused.join(", "));
    }
    text
}

/// Formats rising numbers, neighbours as a range: `3, 7–12`.
fn ranges(numbers: &[usize]) -> String {
    let mut found: Vec<[usize; 2]> = Vec::new();
    for &number in numbers {
        match found.last_mut() {
            Some([_, last]) if *last + 1 == number => *last = number,
            _ => found.push([number; 2]),
        }
    }
    let range = |&[first, last]: &[usize; 2]| match last - first {
        0 => first.to_string(),
        _ => format!("{first}–{last}"),
    };
    found.iter().map(range).collect::<Vec<_>>().join(", ")
}
