//! Runs a fit with time and writes its results.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use harness::case::Run;
use harness::output;
use harness::report::Report;
use polycore::Error;
use polycore::constitutive::hyperelastic::fit::Agreement;
use polycore::constitutive::viscoelastic::Pace;
use polycore::constitutive::viscoelastic::fit::{
    FitSettings, FittedConstant, LeftOut, TimeFit, fit_until, leave_out,
};
use polycore::file::atomic_write;

use super::MPA;
use super::material::{DIGITS, digits, in_megapascals, stress};
use super::quantities as q;
use super::table_fits::unit_of;
use super::time::TimeCase;
use super::{time_block, time_card};

/// Name of the values of all runs together.
pub const ALL: &str = "all";

/// Name of the values of the runs left out.
pub const LEFT_OUT: &str = "left-out";

/// Largest local error of predictions over the largest measured stress.
const ERROR: f64 = 1e-4;

/// Fits the law, records values, writes files; returns the table of the run.
pub fn run(case: &TimeCase, run: &mut Run, report: &mut Report) -> Result<String, Error> {
    let settings = FitSettings { starts: case.starts, pace: case.pace, ..FitSettings::default() };
    let stop = run.options.interrupted;
    run.show(0.0, &|| "fit with time".to_owned());
    let stopped = |error| match error {
        polycore::constitutive::Error::Stopped => run.interruption(),
        error => Error::from(error),
    };
    let found = fit_until(&case.form, &case.runs, &settings, stop).map_err(stopped)?;
    for (run, agreement) in case.runs.iter().zip(&found.runs) {
        record(report, &run.name, agreement);
    }
    record(report, ALL, &found.pooled);
    for constant in &found.constants {
        let (value, unit) = in_megapascals(constant.value, constant.constant.unit);
        report.value(q::TIME_CONSTANT.named(&[&constant.constant.name]).in_unit(unit), value);
    }
    report.work("time.evaluations", found.evaluations as u64);
    report.work("time.starts", found.starts.0 as u64);
    report.work("time.starts_that_agree", found.starts.1 as u64);
    let mut text = table(case, &found);
    if let Some(rate) = case.leave_out {
        let again = FitSettings { starts: 1, first: Some(found.values()), ..settings };
        let left = leave_out(&case.form, &case.runs, |run| run.rate == rate, &again, stop);
        let LeftOut { pooled, .. } = left.map_err(stopped)?;
        record(report, LEFT_OUT, &pooled);
        let r2 = pooled.r2.map_or_else(String::new, |r2| format!("{r2:.4}"));
        let rms = stress(pooled.rms, 4);
        let _ = writeln!(text, "{rate} /s, predicted by a fit to the other rates: {rms}  {r2}");
    }
    text += &constants(&found);
    let directory = run.options.output;
    write_runs(directory, case, &found)?;
    let block = time_block::block(&found)?;
    atomic_write(directory.join("time_material.toml"), |file| file.write_all(block.as_bytes()))?;
    let states = time_card::write(directory, &found)?;
    let _ = writeln!(text, "user material for Abaqus and CalculiX: {states} state variables (*DEPVAR)");
    write_predictions(directory, case, &found)?;
    Ok(text)
}

fn record(report: &mut Report, name: &str, found: &Agreement) {
    report.value(q::TIME_RMS.named(&[name]), found.rms / MPA);
    if let Some(r2) = found.r2 {
        report.value(q::TIME_R2.named(&[name]), r2);
    }
}

/// rms and R² of each run.
fn table(case: &TimeCase, found: &TimeFit) -> String {
    let mut text = String::new();
    for line in &case.read {
        let _ = writeln!(text, "{line}");
    }
    let names = case.runs.iter().map(|run| run.name.as_str()).chain([ALL]);
    let width = names.clone().map(str::len).max().unwrap_or(0).max(3);
    let _ = writeln!(text, "{:<width$}  {:>12}  {:>8}", "run", "rms", "R²");
    for (name, agreement) in names.zip(found.runs.iter().chain([&found.pooled])) {
        let r2 = agreement.r2.map_or_else(|| "-".to_owned(), |r2| format!("{r2:.4}"));
        let _ = writeln!(text, "{name:<width$}  {:>12}  {r2:>8}", stress(agreement.rms, 4));
    }
    text
}

/// Constants with their intervals; the fixed ones by name, with the reason.
fn constants(found: &TimeFit) -> String {
    let mut text = "constants, 95 %\n".to_owned();
    for constant in &found.constants {
        let name = &constant.constant.name;
        let _ = match (constant.constant.fixed, constant.interval) {
            (Some((_, reason)), _) => writeln!(text, "  {name} = {}, fixed: {reason}", shown(constant)),
            (None, None) => writeln!(text, "  {name} = {}, not determined", shown(constant)),
            (None, Some([low, high])) => {
                let scale = constant.value / in_megapascals(constant.value, constant.constant.unit).0;
                let [low, high] = [low / scale, high / scale].map(|end| digits(end, 4));
                writeln!(text, "  {name} = {}, {low} to {high}", shown(constant))
            }
        };
    }
    let values: Vec<String> = found.singular_values.iter().map(|value| digits(*value, 3)).collect();
    let _ = writeln!(text, "singular values over the noise: {}", values.join(" "));
    let _ = writeln!(text, "starts that agree: {} of {}", found.starts.1, found.starts.0);
    text
}

fn shown(constant: &FittedConstant) -> String {
    let (value, unit) = in_megapascals(constant.value, constant.constant.unit);
    format!("{} {unit}", digits(value, DIGITS)).trim_end().to_owned()
}

/// Writes `time_runs.csv`: measured and computed stresses of all points.
fn write_runs(directory: &Path, case: &TimeCase, found: &TimeFit) -> Result<(), Error> {
    let law = found.law()?;
    let mut text = String::from("run,time_s,strain,nominal_MPa,model_MPa\n");
    for run in &case.runs {
        for (point, model) in run.points().iter().zip(run.stresses(&law, case.pace)?) {
            let numbers = [point.time, point.strain, point.nominal / MPA, model / MPA];
            let numbers = numbers.map(|number| digits(number, DIGITS)).join(",");
            let _ = writeln!(text, "{},{numbers}", run.name);
        }
    }
    atomic_write(directory.join("time_runs.csv"), |file| file.write_all(text.as_bytes()))
}

/// Writes `NAME_prediction.csv` of each program.
fn write_predictions(directory: &Path, case: &TimeCase, found: &TimeFit) -> Result<(), Error> {
    let law = found.law()?;
    let points = case.runs.iter().flat_map(|run| run.points());
    let largest = points.map(|point| point.nominal.abs()).fold(0.0, f64::max);
    for program in &case.programs {
        let stresses = program.test.follow(&law, &program.path, Pace::Within(ERROR * largest))?;
        let (unit, scale) = unit_of(largest);
        let times: Vec<f64> = program.path.iter().map(|point| point[0]).collect();
        let strains: Vec<f64> = program.path.iter().map(|point| point[1]).collect();
        let stresses: Vec<f64> = stresses.iter().map(|stress| stress / scale).collect();
        let columns: [output::csv::Column<'_>; 3] =
            [("time", "s", &times), ("strain", "", &strains), ("nominal", unit, &stresses)];
        output::csv::write(directory.join(format!("{}_prediction.csv", program.name)), &columns)?;
    }
    Ok(())
}
