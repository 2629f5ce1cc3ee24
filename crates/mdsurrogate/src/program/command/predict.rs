//! `mdsurrogate predict`: predictions of a law at the strains of a table.

use crate::Error;
use crate::dataset::read_strains;
use crate::kinematics::NAMES;
use crate::surrogate::{Flags, Prediction, Surrogate, Workspace};
use harness::output::csv;
use polycore::tensor::Voigt;
use std::path::{Path, PathBuf};

/// Pascals per megapascal.
const MEGA: f64 = 1e6;

/// Predict stress, tangent and uncertainty.
#[derive(clap::Args)]
pub struct Predict {
    /// Law (safetensors).
    law: PathBuf,
    /// Strains (CSV): columns C11, C22, C33 and, with shear, C12, C13, C23 (C = FᵀF; C12 counted once), or
    /// stretch_1, stretch_2, stretch_3; other columns are ignored.
    table: PathBuf,
    /// Predictions (CSV): S in MPa, standard deviations and their norm (`spread`) for an ensemble, W in MJ/m³
    /// for an energy, and flags.
    #[arg(long, short)]
    output: PathBuf,
    /// Also write the 36 components of 2 ∂S/∂C.
    #[arg(long)]
    tangent: bool,
}

impl Predict {
    /// Predicts and writes.
    pub fn print(self) -> Result<bool, Error> {
        let law = Surrogate::<f64>::read(&self.law)?;
        let points = read_strains(&self.table)?;
        let mut predictions = vec![Prediction::default(); points.len()];
        let mut memory = Workspace::default();
        let asked = if self.tangent {
            law.tangents(&points, &mut memory, &mut predictions)
        } else {
            law.stresses(&points, &mut memory, &mut predictions)
        };
        asked.map_err(|error| match Error::from(error) {
            Error::Parameter { name, found, allowed } => {
                Error::File { path: self.table.clone(), found: format!("{name}: {found}"), allowed }
            }
            other => other,
        })?;
        let finite = |prediction: &Prediction<f64>| {
            let tangent = prediction.tangent.is_none_or(|tangent| tangent.iter().all(|x| x.is_finite()));
            prediction.stress.iter().all(|x| x.is_finite())
                && prediction.energy.is_none_or(f64::is_finite)
                && tangent
        };
        if let Some(row) = predictions.iter().position(|prediction| !finite(prediction)) {
            let place = format!("row {} of {}", row + 1, self.table.display());
            return Err(Error::NotFinite { quantity: "the prediction", place });
        }
        write(&self.output, &points, &predictions, law.header().members > 1)?;
        let flagged = predictions.iter().filter(|prediction| prediction.flags.any()).count();
        harness::say!(
            "{} predictions, {flagged} of them flagged: {}",
            predictions.len(),
            self.output.display()
        );
        Ok(true)
    }
}

fn write(
    path: &Path,
    points: &[Voigt],
    predictions: &[Prediction<f64>],
    is_ensemble: bool,
) -> Result<(), Error> {
    let column =
        |value: &dyn Fn(&Prediction<f64>) -> f64| predictions.iter().map(value).collect::<Vec<f64>>();
    let mut columns: Vec<(String, &str, Vec<f64>)> = Vec::new();
    for (a, name) in NAMES.iter().enumerate() {
        columns.push((format!("C{name}"), "", points.iter().map(|point| point[a]).collect()));
    }
    for (a, name) in NAMES.iter().enumerate() {
        columns.push((format!("S{name}"), "MPa", column(&|prediction| prediction.stress[a] / MEGA)));
        if is_ensemble {
            let deviation = column(&|prediction| prediction.deviation[a] / MEGA);
            columns.push((format!("S{name} std"), "MPa", deviation));
        }
    }
    if predictions.iter().any(|prediction| prediction.energy.is_some()) {
        columns.push((
            "W".into(),
            "MJ/m³",
            column(&|prediction| prediction.energy.unwrap_or(f64::NAN) / MEGA),
        ));
    }
    columns.push(("spread".into(), "MPa", column(&|prediction| prediction.spread / MEGA)));
    let mut flag = |name: &str, raised: &dyn Fn(&Flags) -> bool| {
        let values = column(&|prediction| f64::from(u8::from(raised(&prediction.flags))));
        columns.push((name.into(), "", values));
    };
    flag("outside the box", &|flags| flags.outside.contains(&true));
    for (a, name) in NAMES.iter().enumerate() {
        flag(&format!("C{name} outside"), &|flags| flags.outside[a]);
    }
    flag("never seen", &|flags| flags.unseen.contains(&true));
    flag("far from the data", &|flags| flags.far);
    flag("members disagree", &|flags| flags.spread);
    if predictions.iter().any(|prediction| prediction.tangent.is_some()) {
        for (a, row) in NAMES.iter().enumerate() {
            for (b, name) in NAMES.iter().enumerate() {
                let value =
                    |prediction: &Prediction<f64>| prediction.tangent.map_or(f64::NAN, |t| t[(a, b)] / MEGA);
                columns.push((format!("tangent {row} {name}"), "MPa", column(&value)));
            }
        }
    }
    let columns: Vec<csv::Column> =
        columns.iter().map(|(name, unit, values)| (name.as_str(), *unit, &values[..])).collect();
    Ok(csv::write(path, &columns)?)
}
