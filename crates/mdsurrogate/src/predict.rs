//! `mdsurrogate predict`: what a law answers at the strains of a table.

use mdsurrogate::Error;
use mdsurrogate::dataset::read_strains;
use mdsurrogate::kinematics::NAMES;
use mdsurrogate::surrogate::{Flags, Prediction, Surrogate, Workspace};
use polycore::output::csv;
use polycore::tensor::Voigt;
use std::path::{Path, PathBuf};

/// Pascals in a megapascal.
const MEGA: f64 = 1e6;

/// A law and where it is asked.
#[derive(clap::Args)]
pub struct Predict {
    /// The law (safetensors).
    law: PathBuf,
    /// The strains (CSV): columns C11, C22, C33 and, where there is shear, C12, C13, C23 (C = FᵀF; C12 counted once), or
    /// stretch_1, stretch_2, stretch_3 as in tables of data; other columns are left alone.
    table: PathBuf,
    /// The answers (CSV): S and its spread in MPa, W in MJ/m³ of an energy, and a 1 for each doubt.
    #[arg(long, short)]
    output: PathBuf,
    /// Also the 36 components of 2 ∂S/∂C.
    #[arg(long)]
    tangent: bool,
}

impl Predict {
    /// Predictions and writes.
    pub fn print(self) -> Result<bool, Error> {
        let law = Surrogate::<f64>::read(&self.law)?;
        let points = read_strains(&self.table)?;
        let mut answers = vec![Prediction::default(); points.len()];
        let mut memory = Workspace::default();
        let asked = if self.tangent {
            law.tangents(&points, &mut memory, &mut answers)
        } else {
            law.stresses(&points, &mut memory, &mut answers)
        };
        asked.map_err(|error| match Error::from(error) {
            Error::Parameter { name, found, allowed } => {
                Error::File { path: self.table.clone(), found: format!("{name}: {found}"), allowed }
            }
            other => other,
        })?;
        let finite = |answer: &Prediction<f64>| {
            let tangent = answer.tangent.is_none_or(|tangent| tangent.iter().all(|x| x.is_finite()));
            answer.stress.iter().all(|x| x.is_finite()) && answer.energy.is_none_or(f64::is_finite) && tangent
        };
        if let Some(row) = answers.iter().position(|answer| !finite(answer)) {
            let place = format!("row {} of {}", row + 1, self.table.display());
            return Err(Error::NotFinite { quantity: "the answer", place });
        }
        write(&self.output, &points, &answers)?;
        let doubtful = answers.iter().filter(|answer| answer.flags.any()).count();
        polycore::say!(
            "{} answers, {doubtful} of them with a doubt: {}",
            answers.len(),
            self.output.display()
        );
        Ok(true)
    }
}

fn write(path: &Path, points: &[Voigt], answers: &[Prediction<f64>]) -> Result<(), Error> {
    let column = |value: &dyn Fn(&Prediction<f64>) -> f64| answers.iter().map(value).collect::<Vec<f64>>();
    let mut columns: Vec<(String, &str, Vec<f64>)> = Vec::new();
    for (a, name) in NAMES.iter().enumerate() {
        columns.push((format!("C{name}"), "", points.iter().map(|point| point[a]).collect()));
    }
    for (a, name) in NAMES.iter().enumerate() {
        columns.push((format!("S{name}"), "MPa", column(&|answer| answer.stress[a] / MEGA)));
    }
    if answers.iter().any(|answer| answer.energy.is_some()) {
        columns.push(("W".into(), "MJ/m³", column(&|answer| answer.energy.unwrap_or(f64::NAN) / MEGA)));
    }
    columns.push(("spread".into(), "MPa", column(&|answer| answer.spread / MEGA)));
    let mut doubt = |name: &str, raised: &dyn Fn(&Flags) -> bool| {
        let values = column(&|answer| f64::from(u8::from(raised(&answer.flags))));
        columns.push((name.into(), "", values));
    };
    doubt("outside the box", &|flags| flags.outside.contains(&true));
    for (a, name) in NAMES.iter().enumerate() {
        doubt(&format!("C{name} outside"), &|flags| flags.outside[a]);
    }
    doubt("never seen", &|flags| flags.unseen.contains(&true));
    doubt("far from the data", &|flags| flags.far);
    doubt("members disagree", &|flags| flags.spread);
    if answers.iter().any(|answer| answer.tangent.is_some()) {
        for (a, row) in NAMES.iter().enumerate() {
            for (b, name) in NAMES.iter().enumerate() {
                let value = |answer: &Prediction<f64>| answer.tangent.map_or(f64::NAN, |t| t[(a, b)] / MEGA);
                columns.push((format!("tangent {row} {name}"), "MPa", column(&value)));
            }
        }
    }
    let columns: Vec<csv::Column> =
        columns.iter().map(|(name, unit, values)| (name.as_str(), *unit, &values[..])).collect();
    Ok(csv::write(path, &columns)?)
}
