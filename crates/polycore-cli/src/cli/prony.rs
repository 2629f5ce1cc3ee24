//! Prony series of relaxation tests and oscillations, with master curves of isotherms.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use harness::report::{Quantity, Report};
use harness::scene::{SceneError, Source};
use polycore::Error;
use polycore::constitutive::Error as LawError;
use polycore::constitutive::viscoelastic::Shift;
use polycore::constitutive::viscoelastic::linear::{
    Isotherm, PronyFit, PronySettings, WlfFit, fit_oscillation, fit_relaxation, fit_wlf, shift_isotherms,
};
use polycore::table::Table;
use polycore::units::dimension::{RateDimension, StressDimension, TemperatureDimension, TimeDimension};
use polycore::units::{Dimension, Temperature};
use serde::Deserialize;

use super::MPA;
use super::quantities as q;

/// Celsius zero, K.
pub const CELSIUS: f64 = 273.15;

/// Relaxation test or oscillations to which a Prony series is fitted.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PronySpec {
    /// Name in the report.
    name: String,
    /// CSV file, relative to the scene: `time`, `modulus`; or `frequency`, `storage`, `loss`, and
    /// `temperature` if it has isotherms, each of increasing frequencies.
    file: PathBuf,
    /// Modulus measured.
    modulus: MeasuredModulus,
    /// Temperature of the master curve, for isotherms.
    reference: Option<Temperature>,
    /// Largest number of terms; default: `per_decade` for each decade of the data.
    terms: Option<usize>,
    /// Relaxation times per decade from which the search starts.
    #[serde(default = "per_decade")]
    per_decade: usize,
    /// Weight of a relative deviation of the loss modulus against one of the storage modulus.
    #[serde(default = "loss_weight")]
    loss_weight: f64,
}

/// Modulus of a test.
#[derive(Clone, Copy, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum MeasuredModulus {
    /// E of an incompressible body.
    Tension,
    /// G.
    Shear,
}

fn per_decade() -> usize {
    PronySettings::default().per_decade
}

fn loss_weight() -> f64 {
    PronySettings::default().loss
}

/// Checked block `[[prony]]` with its measurements.
pub struct PronySet {
    pub name: String,
    pub modulus: MeasuredModulus,
    settings: PronySettings,
    data: Measured,
    /// Layout of the file.
    read: String,
}

/// Measurements in SI units.
enum Measured {
    /// Times and moduli.
    Relaxation(Vec<[f64; 2]>),
    /// Frequencies, storage and loss moduli.
    Oscillation(Vec<[f64; 3]>),
    /// Isotherms and the temperature of the master curve.
    Isotherms(Vec<Isotherm>, f64),
}

impl Measured {
    /// Number of points, of the shortest isotherm.
    fn least_points(&self) -> usize {
        match self {
            Self::Relaxation(points) => points.len(),
            Self::Oscillation(points) => points.len(),
            Self::Isotherms(isotherms, _) => isotherms.iter().map(|one| one.points.len()).min().unwrap_or(0),
        }
    }
}

/// Master curve: points of all isotherms at the reference temperature, and the shift of each isotherm.
pub struct MasterCurve {
    pub points: Vec<[f64; 3]>,
    /// Temperature, K, and log₁₀ a_T.
    pub shifts: Vec<[f64; 2]>,
    /// WLF constants, if enough isotherms lie above the reference.
    pub wlf: Option<WlfFit>,
}

impl PronySpec {
    /// Reads the table.
    ///
    /// # Errors
    /// A name that is taken or cannot name a file, settings out of range, a table that cannot be read, and
    /// `reference` without isotherms or isotherms without it.
    pub fn read(self, source: &Source, index: usize, others: &[PronySet]) -> Result<PronySet, SceneError> {
        let key = |field: &str| format!("prony[{index}].{field}");
        let taken = others.iter().map(|other| other.name.as_str());
        super::time::check_own_name(source, &key("name"), &self.name, taken)?;
        for (field, value) in [("terms", self.terms.unwrap_or(1)), ("per_decade", self.per_decade)] {
            if value == 0 {
                return Err(source.error(&key(field), 0, "at least 1"));
            }
        }
        if !(self.loss_weight > 0.0 && self.loss_weight.is_finite()) {
            return Err(source.error(&key("loss_weight"), self.loss_weight, "above 0, finite"));
        }
        let reference = self.reference.map(|reference| reference.si());
        let (data, read) = measured(&source.file(&self.file), reference)
            .map_err(|error| source.refused(&key("file"), error))?;
        match &data {
            Measured::Isotherms(isotherms, reference) => {
                let temperatures = isotherms.iter().map(|isotherm| isotherm.temperature - CELSIUS);
                let low = temperatures.clone().fold(f64::INFINITY, f64::min);
                let high = temperatures.fold(f64::NEG_INFINITY, f64::max);
                let found = reference - CELSIUS;
                if !(low..=high).contains(&found) {
                    let allowed = format!("{low:.2} to {high:.2} degC, the isotherms of the table");
                    return Err(source.error(&key("reference"), format!("{found:.2} degC"), allowed));
                }
            }
            _ if reference.is_some() => {
                let allowed = "no reference, or a table with a column `temperature [degC]`";
                return Err(source.error(&key("reference"), "a temperature", allowed));
            }
            _ => {}
        }
        let least = data.least_points();
        if least < 3 {
            let allowed = "3 or more, in each isotherm";
            return Err(source.error(&key("file"), format!("{least} points"), allowed));
        }
        let settings = PronySettings {
            per_decade: self.per_decade,
            most: self.terms.unwrap_or(usize::MAX),
            loss: self.loss_weight,
        };
        Ok(PronySet { name: self.name, modulus: self.modulus, settings, data, read })
    }
}

/// Reads times and moduli, or frequencies, storage and loss moduli with or without temperatures.
fn measured(path: &Path, reference: Option<f64>) -> Result<(Measured, String), polycore::Error> {
    let table = Table::read(path)?;
    if let [time] = table.matching(&["time", "t"])[..] {
        let modulus = table.require_column(&["modulus", "relaxation modulus", "E", "G", "stress"])?;
        let times = table.column::<TimeDimension>(time, None)?;
        if let Some(row) = times.iter().position(|time| *time < 0.0) {
            return Err(table.refuse_cell(row, time, "0 or later").into());
        }
        let moduli = positive::<StressDimension>(&table, modulus)?;
        let points = times.into_iter().zip(moduli).map(|(time, modulus)| [time, modulus]).collect();
        return Ok((Measured::Relaxation(points), table.describe(&[time, modulus])));
    }
    let frequency = match table.matching(&["frequency", "f", "freq"])[..] {
        [column] => column,
        _ => {
            let allowed = "`time [s]`, `modulus [MPa]`, or `frequency [Hz]`, `storage [MPa]`, `loss [MPa]`";
            return Err(table.refuse_headings(allowed).into());
        }
    };
    let storage =
        table.require_column(&["storage", "storage modulus", "E'", "G'", "E_storage", "G_storage"])?;
    let loss = table.require_column(&["loss", "loss modulus", "E''", "G''", "E_loss", "G_loss"])?;
    let frequencies = positive::<RateDimension>(&table, frequency)?;
    let storages = positive::<StressDimension>(&table, storage)?;
    let losses = table.column::<StressDimension>(loss, None)?;
    let points: Vec<[f64; 3]> =
        (0..table.rows()).map(|row| [frequencies[row], storages[row], losses[row]]).collect();
    let temperature = match table.matching(&["temperature", "T", "temp"])[..] {
        [column] => column,
        _ => return Ok((Measured::Oscillation(points), table.describe(&[frequency, storage, loss]))),
    };
    let used = table.describe(&[temperature, frequency, storage, loss]);
    let Some(reference) = reference else {
        let allowed = "`reference`, the temperature of the master curve, for a table of isotherms";
        return Err(table.refuse_headings(allowed).into());
    };
    positive::<StressDimension>(&table, loss)?;
    let temperatures = table.column::<TemperatureDimension>(temperature, None)?;
    let mut isotherms: Vec<Isotherm> = Vec::new();
    let mut rows = Vec::new();
    for row in 0..points.len() {
        rows.push(row);
        // frequencies begin again with the next isotherm
        if points.get(row + 1).is_none_or(|next| next[0] <= points[row][0]) {
            let mean = rows.iter().map(|&row| temperatures[row]).sum::<f64>() / rows.len() as f64;
            isotherms
                .push(Isotherm { temperature: mean, points: rows.iter().map(|&row| points[row]).collect() });
            rows.clear();
        }
    }
    let count = isotherms.len();
    Ok((Measured::Isotherms(isotherms, reference), format!("{used}; {count} isotherms")))
}

/// Column of numbers above 0, in SI units.
fn positive<D: Dimension>(table: &Table, column: usize) -> Result<Vec<f64>, polycore::Error> {
    let values = table.column::<D>(column, None)?;
    match values.iter().position(|value| *value <= 0.0) {
        Some(row) => Err(table.refuse_cell(row, column, "above 0").into()),
        None => Ok(values),
    }
}

impl MasterCurve {
    fn new(isotherms: &[Isotherm], reference: f64) -> Result<Self, LawError> {
        let logarithms = shift_isotherms(isotherms, reference)?;
        let shifted = |(isotherm, log): (&Isotherm, &f64)| {
            let factor = 10_f64.powf(*log);
            isotherm
                .points
                .iter()
                .map(move |&[f, storage, loss]| [f * factor, storage, loss])
                .collect::<Vec<_>>()
        };
        let mut points: Vec<[f64; 3]> = isotherms.iter().zip(&logarithms).flat_map(shifted).collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let temperatures = isotherms.iter().map(|isotherm| isotherm.temperature);
        let shifts: Vec<[f64; 2]> = temperatures.zip(logarithms).map(|(t, log)| [t, log]).collect();
        let wlf = fit_wlf(&shifts, reference).ok();
        Ok(Self { points, shifts, wlf })
    }
}

impl PronySet {
    /// Describes what a run will do, in a line.
    pub fn plan(&self) -> String {
        let count = match &self.data {
            Measured::Relaxation(points) => points.len(),
            Measured::Oscillation(points) => points.len(),
            Measured::Isotherms(isotherms, _) => isotherms.iter().map(|one| one.points.len()).sum(),
        };
        format!("prony {}: {count} points, {}", self.name, self.read)
    }

    /// Lists the names of its scalars.
    pub fn quantities(&self) -> Vec<String> {
        let mut own = vec![q::TERMS, q::SERIES_RMS, q::EQUILIBRIUM, q::INSTANTANEOUS];
        if !matches!(self.data, Measured::Relaxation(_)) {
            own.push(q::LOSS_RMS);
        }
        if matches!(self.data, Measured::Isotherms(..)) {
            own.extend([q::WLF_FIRST, q::WLF_SECOND, q::WLF_RMS]);
        }
        own.into_iter().map(|quantity| quantity.named(&[&self.name]).name).collect()
    }

    /// Fits, records values, writes the files; returns the summary.
    ///
    /// # Errors
    /// Measurements that no series describes; a file that cannot be written.
    pub fn run(&self, directory: &Path, pictures: bool, report: &mut Report) -> Result<String, Error> {
        let master = match &self.data {
            Measured::Isotherms(isotherms, reference) => Some(MasterCurve::new(isotherms, *reference)?),
            _ => None,
        };
        let found = match (&self.data, &master) {
            (Measured::Relaxation(points), _) => fit_relaxation(points, &self.settings)?,
            (Measured::Oscillation(points), _) => fit_oscillation(points, &self.settings)?,
            (Measured::Isotherms(..), master) => {
                fit_oscillation(master.as_ref().map_or(&[], |master| &master.points), &self.settings)?
            }
        };
        let mut record = |quantity: Quantity, value| {
            report.value(quantity.named(&[&self.name]), value);
        };
        record(q::TERMS, found.series.terms.len() as f64);
        record(q::SERIES_RMS, found.rms[0]);
        found.rms.get(1).into_iter().for_each(|rms| record(q::LOSS_RMS, *rms));
        record(q::EQUILIBRIUM, found.series.equilibrium / MPA);
        record(q::INSTANTANEOUS, found.series.instantaneous() / MPA);
        let wlf = master.as_ref().and_then(|master| master.wlf.as_ref());
        if let Some(WlfFit { shift: Shift::Wlf { constants, .. }, rms, .. }) = wlf {
            record(q::WLF_FIRST, constants[0]);
            record(q::WLF_SECOND, constants[1]);
            record(q::WLF_RMS, *rms);
        }
        self.write(directory, &found, master.as_ref())?;
        if pictures {
            self.draw(directory, &found, master.as_ref())?;
        }
        Ok(self.summary(&found, master.as_ref()))
    }

    /// Measured points of the curve that is fitted: abscissa (s or Hz) and moduli, Pa.
    pub fn curve<'a>(&'a self, master: Option<&'a MasterCurve>) -> Vec<Vec<f64>> {
        match (&self.data, master) {
            (Measured::Relaxation(points), _) => points.iter().map(|point| point.to_vec()).collect(),
            (Measured::Oscillation(points), _) => points.iter().map(|point| point.to_vec()).collect(),
            (_, Some(master)) => master.points.iter().map(|point| point.to_vec()).collect(),
            (Measured::Isotherms(..), None) => Vec::new(),
        }
    }

    /// Moduli of the series at an abscissa, Pa.
    pub fn model(&self, found: &PronyFit, at: f64) -> Vec<f64> {
        match self.data {
            Measured::Relaxation(_) => vec![found.series.relaxation(at)],
            _ => found.series.oscillation(at).to_vec(),
        }
    }

    /// Abscissa with its unit, and names of the moduli.
    pub fn columns(&self) -> ([&'static str; 2], &'static [&'static str]) {
        match self.data {
            Measured::Relaxation(_) => (["time", "s"], &["modulus"]),
            _ => (["frequency", "Hz"], &["storage", "loss"]),
        }
    }

    fn summary(&self, found: &PronyFit, master: Option<&MasterCurve>) -> String {
        let percent: Vec<String> = found.rms.iter().map(|rms| format!("{:.2} %", 100.0 * rms)).collect();
        let kinds = self.columns().1.join(" and ");
        let count = found.series.terms.len();
        let undetermined = found.factors.iter().filter(|factor| factor.is_none()).count();
        let mut text = format!(
            "prony {}: {count} terms, rms of {kinds} {}; constants that the data do not \
             determine: {undetermined}\n",
            self.name,
            percent.join(" and ")
        );
        match master.map(|master| master.wlf.as_ref()) {
            Some(Some(WlfFit {
                shift: Shift::Wlf { reference, constants: [first, second] },
                rms,
                count,
            })) => {
                let celsius = reference - CELSIUS;
                let _ = writeln!(
                    text,
                    "  WLF from {celsius:.1} degC on: c1 = {first:.3}, c2 = {second:.2} K, rms {rms:.3} \
                     decades, {count} isotherms"
                );
            }
            Some(_) => text += "  WLF: fewer than three isotherms above the reference\n",
            None => {}
        }
        text
    }
}
