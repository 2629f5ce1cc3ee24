//! Laws judged on the data of a scene: errors, physics, error against time; figures and tables.

use super::{Failure, Prepared, draw};
use crate::dataset::{Path as Path_, Row, noise};
use crate::error::Error;
use crate::eval::{Errors, Physics, errors, percentage_error, seconds_of_a_stress, within_rates};
use crate::surrogate::{Surrogate, Workspace};
use polycore::output::csv;
use polycore::report::Report;
use std::path::Path;

/// Rows at which physics is measured, at most.
const PROBED: usize = 200;

/// A law with its name.
pub struct Named<'a> {
    /// Of files and values.
    pub name: &'a str,
    /// The law.
    pub law: &'a Surrogate,
    /// How long it was trained, where that is known.
    pub seconds: Option<f64>,
}

/// A held-out run as laws see it.
pub(super) struct Heldout<'a> {
    pub run: &'a Path_,
    /// The axis that is pulled most; of all, where it is not known which ones are.
    pub axis: usize,
    /// Whether its rates lie within those of the training runs, where that is known.
    pub within: Option<bool>,
    /// Of each law: S at the rows.
    pub predicted: Vec<Vec<[f64; 6]>>,
}

/// Judges laws: values into the report, CSV and pictures into `output`; gives a table in lines.
///
/// # Errors
/// A law that overflows at a row; I/O errors.
pub fn judge_laws(
    laws: &[Named],
    data: &Prepared,
    output: &Path,
    report: &mut Report,
) -> Result<Vec<String>, Failure> {
    let floor = noise(&data.set, |row| row.s).map(|noise| noise.floor);
    let test = if data.split.test.is_empty() { &data.split.train } else { &data.split.test };
    let test = data.rows(test);
    let mut table = vec![format!(
        "{:<16} {:>10} {:>12} {:>12} {:>11} {:>10} {:>10} {:>10} {:>10}",
        "law",
        "parameters",
        "test (3.12)",
        "over floor",
        "test (3.13)",
        "|S(I)|",
        "asymmetry",
        "cycle",
        "stress"
    )];
    let (mut losses, mut training, mut inference) = (Vec::new(), Vec::new(), Vec::new());
    for Named { name, law, seconds } in laws {
        let sets = [
            ("training", &data.split.train),
            ("validation", &data.split.validation),
            ("test", &data.split.test),
        ];
        for (set, rows) in sets.into_iter().filter(|(_, rows)| !rows.is_empty()) {
            let found = errors(law, data.rows(rows).into_iter())?;
            record(report, name, set, &found, floor);
        }
        for run in data.heldout.iter().flat_map(|set| &set.paths) {
            let found = errors(law, run.rows.iter())?;
            record(report, name, &format!("heldout {}", run.id), &found, floor);
        }
        let every = test.len().div_ceil(PROBED).max(1);
        let physics = Physics::of(law, &test.iter().step_by(every).copied().collect::<Vec<_>>())?;
        obey(report, name, &physics);
        let stress = seconds_of_a_stress(law, &test)?;
        report.seconds(&format!("one stress of {name}"), stress);
        let found = errors(law, test.iter().copied())?;
        losses.push(found.mean_square() / 1e12);
        training.push(seconds.unwrap_or(f64::NAN));
        inference.push(stress);
        table.push(format!(
            "{:<16} {:>10} {:>8.0} MPa² {:>12} {:>9.1} % {:>6.1} MPa {:>10.1e} {:>10.1e} {:>7.2} µs",
            name,
            law.header().architecture.parameters() * law.header().members,
            found.mean_square() / 1e12,
            floor.map_or("-".into(), |floor| format!("{:.2}", found.mean_square() / floor)),
            found.percentage,
            physics.rest / 1e6,
            physics.asymmetry,
            physics.cycle,
            stress * 1e6
        ));
    }
    let names: Vec<&str> = laws.iter().map(|law| law.name).collect();
    draw::against_time(&names, &losses, &training, &inference, floor.map(|floor| floor / 1e12), output)?;
    let heldout = look_at_heldout(laws, data)?;
    for run in &heldout {
        write_heldout(run, &names, output)?;
        table.push(match run.within {
            Some(true) => format!("held-out run {}: rates within those of the training runs", run.run.id),
            Some(false) => format!("held-out run {}: rates beyond those of the training runs", run.run.id),
            None => {
                format!("held-out run {}: of unknown rates, or of a kind without training runs", run.run.id)
            }
        });
    }
    draw::heldout(&heldout, &names, output)?;
    Ok(table)
}

fn record(report: &mut Report, name: &str, set: &str, errors: &Errors, floor: Option<f64>) {
    report.value(&format!("{name} {set} error (3.12)"), errors.mean_square() / 1e12, "MPa²");
    report.value(&format!("{name} {set} error per component"), errors.mean_square() / 6e12, "MPa²");
    report.value(&format!("{name} {set} percentage error (3.13)"), errors.percentage, "%");
    let outside = errors.flagged as f64 / errors.rows.max(1) as f64;
    report.value(&format!("{name} {set} share outside the training box"), outside, "");
    if let Some(floor) = floor.filter(|floor| *floor > 0.0) {
        report.value(&format!("{name} {set} error over the noise floor"), errors.mean_square() / floor, "");
    }
}

fn obey(report: &mut Report, name: &str, physics: &Physics) {
    report.value(&format!("{name} stress at rest"), physics.rest / 1e6, "MPa");
    report.value(&format!("{name} asymmetry of the tangent"), physics.asymmetry, "");
    report.value(&format!("{name} largest asymmetry of the tangent"), physics.largest_asymmetry, "");
    report.value(&format!("{name} work of a closed cycle"), physics.cycle, "");
    report.value(&format!("{name} lack of objectivity"), physics.objectivity, "");
    report.value(&format!("{name} shear stress where none was seen"), physics.shear_stress / 1e6, "MPa");
    if let Some(share) = physics.shear_flagged {
        report.value(&format!("{name} share of shear flagged"), share, "");
    }
}

fn look_at_heldout<'a>(laws: &[Named], data: &'a Prepared) -> Result<Vec<Heldout<'a>>, Error> {
    let mut memory = Workspace::default();
    let mut seen = Vec::new();
    for run in data.heldout.iter().flat_map(|set| &set.paths) {
        let mut predicted = Vec::new();
        for Named { law, .. } in laws {
            let stress =
                |row: &Row, memory: &mut _| law.stress(&row.c, memory).map(|answer| answer.stress.into());
            let rows = run.rows.iter().map(|row| stress(row, &mut memory));
            predicted.push(rows.collect::<Result<Vec<[f64; 6]>, Error>>()?);
        }
        let reach = |axis: usize| run.rows.iter().map(|row| (row.c[axis] - 1.0).abs()).fold(0.0, f64::max);
        let unknown = run.rates.iter().all(|rate| rate.is_nan());
        let pulled = (0..3).filter(|&axis| unknown || !run.rates[axis].is_nan());
        let axis = pulled.max_by(|&a, &b| reach(a).total_cmp(&reach(b))).unwrap_or(0);
        seen.push(Heldout { run, axis, within: within_rates(run, &data.set), predicted });
    }
    Ok(seen)
}

/// C and S along the axis that is pulled most, measured and predicted, and (3.13).
fn write_heldout(seen: &Heldout, names: &[&str], output: &Path) -> Result<(), Error> {
    let component = crate::kinematics::NAMES[seen.axis];
    let rows = &seen.run.rows;
    let mut columns = vec![
        (format!("C{component}"), "", rows.iter().map(|row| row.c[seen.axis]).collect::<Vec<f64>>()),
        (format!("S{component}"), "MPa", rows.iter().map(|row| row.s[seen.axis] / 1e6).collect()),
    ];
    for (name, predicted) in names.iter().zip(&seen.predicted) {
        let along = predicted.iter().map(|stress| stress[seen.axis] / 1e6).collect();
        columns.push((format!("S{component} of {name}"), "MPa", along));
        columns.push((format!("percentage error of {name}"), "%", percentages(rows, predicted)));
    }
    let columns: Vec<csv::Column> =
        columns.iter().map(|(name, unit, data)| (name.as_str(), *unit, data.as_slice())).collect();
    Ok(csv::write(output.join(format!("heldout-{}.csv", seen.run.id)), &columns)?)
}

/// (3.13) row by row; NaN where there is no stress.
pub(super) fn percentages(rows: &[Row], predicted: &[[f64; 6]]) -> Vec<f64> {
    let error =
        |(row, stress): (&Row, &[f64; 6])| percentage_error(&row.s, &(*stress).into()).unwrap_or(f64::NAN);
    rows.iter().zip(predicted).map(error).collect()
}
