//! Runs whole scenes: measures data, trains, evaluates, draws; `report.json` is written last.

mod crystal;
mod data;
mod draw;
mod heldout;
mod judge;
mod program;
mod search;
mod searched;
mod training;
mod trials;
mod uniaxial;

pub use data::{Prepared, describe, load};
pub use judge::{NamedLaw, judge_laws};
pub use program::Mdsurrogate;

use crate::cell::ATOMS_OF_MONOMER;
use crate::error::Error;
use crate::program::scene::{CrystalSpec, Scene};
use harness::case::{Finished, Run};
use harness::report::{Phases, Report};
use harness::scene::{Failure, Source};

/// Runs a scene; [`Run::finish`] writes `report.json`.
///
/// # Errors
/// Returns a [`Failure`] for an invalid scene or a failed run; no partial files remain.
pub fn run(source: &Source, run: &mut Run) -> Result<Finished, Failure<Error>> {
    let (output, quick) = (run.options.output, run.options.quick);
    let scene = source.parse::<Scene>()?;
    scene.check(source)?;
    let mut phases = Phases::new();
    phases.start("read");
    let data = scene.data.as_ref().map(|_| Prepared::new(source, &scene)).transpose()?;
    run.begin()?;
    let mut report = Report::new("mdsurrogate", env!("CARGO_PKG_VERSION"), &source.text);
    let mut remarks = Vec::new();
    if let Some(spec) = &scene.crystal {
        phases.start("build");
        crystal::measure(spec, output, &mut report)?;
    }
    if let Some(data) = &data {
        learn(source, &scene, data, run, &mut phases, &mut report, &mut remarks)?;
    }
    phases.stop();
    report.phases(&phases).threads(1).judge(&scene.expect, quick);
    let notes: String = remarks.iter().map(|line| format!("{line}\n")).collect();
    let text = report.table() + &notes;
    Ok(Finished::new(report, text).with_notes(&notes))
}

/// Measures the data, trains and evaluates laws, and searches hyperparameters.
fn learn(
    source: &Source,
    scene: &Scene,
    data: &Prepared,
    run: &mut Run,
    phases: &mut Phases,
    report: &mut Report,
    remarks: &mut Vec<String>,
) -> Result<(), Failure<Error>> {
    phases.start("measure");
    remarks.extend(data.measure(report)?);
    report.work("rows", data.set.len() as u64).work("paths", data.set.paths.len() as u64);
    let models: Vec<_> = scene.model.iter().filter(|model| model.quick || !run.options.quick).collect();
    if !scene.trial.is_empty() {
        phases.start("trials");
        trials::run(source, scene, run, report)?;
    } else if !models.is_empty() {
        phases.start("train");
        let trained = training::train(scene, &models, data, run)?;
        phases.start("judge");
        training::record(&trained, run.options.output, report)?;
        remarks.extend(training::remarks(&trained, data));
        let laws: Vec<judge::NamedLaw> = trained.iter().map(training::Trained::named).collect();
        remarks.extend(judge_laws(&laws, data, run.options.output, report)?);
    }
    if let Some(spec) = &scene.search {
        phases.start("search");
        remarks.extend(search::search(scene, spec, data, run, report)?);
    }
    phases.start("write");
    Ok(data.write(run.options.output)?)
}

/// Formats a number with three significant digits.
fn short(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    if !(1e-2..1e5).contains(&size) {
        return format!("{value:.2e}");
    }
    let digits = (2.0 - size.log10().floor()).max(0.0);
    format!("{value:.*}", digits as usize)
}

/// Describes a scene, line by line.
///
/// # Errors
/// Returns an error for an invalid scene or invalid data.
pub fn explain(source: &Source) -> Result<Vec<String>, Failure<Error>> {
    let scene = source.parse::<Scene>()?;
    scene.check(source)?;
    let mut lines = Vec::new();
    if let Some(CrystalSpec { cells: [x, y, z], levels }) = scene.crystal {
        let atoms = 4 * ATOMS_OF_MONOMER * x * y * z;
        lines.push(format!(
            "builds     {x} × {y} × {z} cells of γ-PA12, {atoms} atoms; a grid with {levels} levels of rate"
        ));
    }
    if scene.data.is_none() {
        lines.push("leaves out data and training".into());
        return Ok(lines);
    }
    let data = Prepared::new(source, &scene)?;
    let (set, split) = (&data.set, &data.split);
    lines.push(format!(
        "reads      {} rows of {} runs: {} for training, {} for validation, {} for test",
        set.len(),
        set.paths.len(),
        split.train.len(),
        split.validation.len(),
        split.test.len()
    ));
    match &data.heldout {
        Some(heldout) => lines.push(format!("reads      {} held-out runs", heldout.paths.len())),
        None => lines.push("leaves out held-out runs".into()),
    }
    for model in &scene.model {
        let settings = model.training.combine(&scene.training, false);
        lines.push(format!(
            "trains     {}: {} with {} parameters, {} epochs of {} steps",
            model.title(),
            if model.members == 1 { "a network".into() } else { format!("{} networks", model.members) },
            model.architecture().parameters(),
            settings.epochs,
            split.train.len().div_ceil(settings.batch)
        ));
    }
    if let Some(search) = &scene.search {
        let names: Vec<&str> = search.methods.iter().map(|method| method.name()).collect();
        lines.push(format!("searches   by {}, at most {} epochs", names.join(" and "), search.epochs));
    }
    if scene.model.is_empty() {
        lines.push("leaves out training".into());
    }
    lines.push(format!("needs      {}", polycore::memory::needs(scene.memory(set.len()))));
    Ok(lines)
}

#[cfg(test)]
mod tests {
    use super::short;

    #[test]
    fn three_digits_of_any_size() {
        for (value, text) in [
            (0.0, "0"),
            (1.2345e-7, "1.23e-7"),
            (0.012345, "0.0123"),
            (-2.0, "-2.00"),
            (310_512.0, "3.11e5"),
            (12_345.6, "12346"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(short(value), text);
        }
    }
}
