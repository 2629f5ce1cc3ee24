//! Runs the fits and trials of a case and writes what they give.

use std::fmt::Write as _;
use std::path::Path;

use polycore::Error;
use polycore::case::{Finished, Run};
use polycore::constitutive;
use polycore::constitutive::hyperelastic::data::{State, Table};
use polycore::constitutive::hyperelastic::fit::{Agreement, Fit, Fitted, fit};
use polycore::constitutive::hyperelastic::{Hyperelastic, homogeneous};
use polycore::output;
use polycore::report::{Phases, Report};

use super::MPA;
use super::quantities as q;
use super::scene::Case;
use super::{card, draw, material, trials};

/// Fits every law to every table, writes tables and pictures.
pub fn run(case: &Case, run: &mut Run) -> Result<Finished, Error> {
    let (directory, quick) = (run.options.output, run.options.quick);
    run.begin()?;
    let mut report = Report::new("polycore", env!("CARGO_PKG_VERSION"), &case.source.text);
    let mut phases = Phases::new();
    let mut all: Vec<(&str, &Table, Vec<Fit>)> = Vec::new();
    for (name, table) in &case.data {
        phases.start("fit");
        let mut fits = Vec::new();
        for model in &case.laws {
            fits.push(fit(model, table)?);
        }
        phases.start("output");
        for fit in &fits {
            record(&mut report, name, table, fit)?;
            for (other, table) in case.data.iter().filter(|(other, _)| case.cross && other != name) {
                judge_on(&mut report, &format!("{name}.{}.{other}", fit.model.key), &fit.law, table)?;
            }
        }
        write_states(directory, name, table, &fits)?;
        fits.iter().try_for_each(|fit| write_draws(directory, name, fit))?;
        all.push((name, table, fits));
    }
    if !all.is_empty() {
        write_fits(directory, &all)?;
        material::write(directory, &all)?;
        card::write(directory, &all)?;
    }
    phases.start("trials");
    for trial in &case.trials {
        trials::run(trial, &mut report)?;
    }
    if !quick {
        phases.start("pictures");
        for (name, table, fits) in &all {
            draw::pictures(directory, name, table, fits)?;
        }
    }
    phases.stop();
    report.phases(&phases).threads(1).judge(&case.expect, quick);
    trials::judge(&case.trials, &mut report);
    let mut text = summary(&case.title, &all, &report);
    for name in &report.non_finite {
        let _ = writeln!(text, "FAIL  {name} is not finite");
    }
    Ok(Finished { report, text })
}

/// In the unit of the tables: a stress in MPa, numbers as they are.
fn scaled(value: f64, unit: &str) -> (f64, &'static str) {
    if unit == "Pa" { (value / MPA, "MPa") } else { (value, "") }
}

/// rms, mean absolute error and R² of a law on another table than that of its fit; where it locks, how often.
fn judge_on(report: &mut Report, key: &str, law: &dyn Hyperelastic, table: &Table) -> Result<(), Error> {
    let locks = |state: &&State| {
        let [a, b] = state.stretches;
        matches!(homogeneous::biaxial(law, a, b), Err(constitutive::Error::Locked { .. }))
    };
    let locked = table.states.iter().filter(locks).count();
    report.value(q::LOCKED.of(&[key]), locked as f64);
    if locked == 0 {
        agree(report, key, &Agreement::of(law, table)?);
    }
    Ok(())
}

fn agree(report: &mut Report, key: &str, found: &Agreement) {
    report.value(q::RMS.of(&[key]), found.rms / MPA);
    report.value(q::MAE.of(&[key]), found.mae / MPA);
    if let Some(r2) = found.r2 {
        report.value(q::R2.of(&[key]), r2);
    }
}

fn record(report: &mut Report, data: &str, table: &Table, fit: &Fit) -> Result<(), Error> {
    let key = format!("{data}.{}", fit.model.key);
    report.value(q::SHEAR_MODULUS.of(&[&key]), fit.law.shear_modulus() / MPA);
    for parameter in &fit.parameters {
        let (value, unit) = scaled(parameter.value, parameter.unit);
        report.value(q::PARAMETER.of(&[&key, parameter.name]).in_unit(unit), value);
        if let Some(error) = parameter.standard_error {
            let quantity = q::STANDARD_ERROR.of(&[&key, parameter.name]).in_unit(unit);
            report.value(quantity, scaled(error, parameter.unit).0);
        }
    }
    agree(report, &key, &Agreement::of(&fit.law, table)?);
    report.work(&format!("{key}.evaluations"), fit.iterations as u64);
    report.work(&format!("{key}.starts"), fit.starts.0 as u64);
    report.work(&format!("{key}.starts_that_agree"), fit.starts.1 as u64);
    Ok(())
}

/// `fits.csv`: one line for each number, with its standard error where the data determine it.
fn write_fits(directory: &Path, all: &[(&str, &Table, Vec<Fit>)]) -> Result<(), Error> {
    let mut text = String::from("data,law,quantity,value,standard_error,unit\n");
    for (data, _, fits) in all {
        for fit in fits {
            let mut line = |quantity: &str, value: f64, error: Option<f64>, unit: &str| {
                let (value, shown) = scaled(value, unit);
                let error = error.map_or_else(String::new, |error| scaled(error, unit).0.to_string());
                let _ = writeln!(text, "{data},{},{quantity},{value},{error},{shown}", fit.model.key);
            };
            line("rms", fit.rms, None, "Pa");
            for parameter in &fit.parameters {
                line(parameter.name, parameter.value, parameter.standard_error, parameter.unit);
            }
            if fit.parameters.iter().all(|parameter| parameter.name != "shear_modulus") {
                line("shear_modulus", fit.law.shear_modulus(), None, "Pa");
            }
        }
    }
    output::atomic_write(directory.join("fits.csv"), |file| std::io::Write::write_all(file, text.as_bytes()))
}

/// `<data>_<law>_posterior.csv`: draws of the parameters, for `sweep --sample`.
fn write_draws(directory: &Path, name: &str, fit: &Fit) -> Result<(), Error> {
    if fit.draws.is_empty() {
        return Ok(());
    }
    let unit = |parameter: &Fitted| scaled(0.0, parameter.unit).1;
    let column = |(i, parameter): (usize, &Fitted)| {
        fit.draws.iter().map(|draw| scaled(draw[i], parameter.unit).0).collect()
    };
    let lists: Vec<Vec<f64>> = fit.parameters.iter().enumerate().map(column).collect();
    let columns: Vec<output::csv::Column> =
        fit.parameters.iter().zip(&lists).map(|(one, list)| (one.name, unit(one), &list[..])).collect();
    output::csv::write(directory.join(format!("{name}_{}_posterior.csv", fit.model.key)), &columns)
}

/// `<data>_states.csv`: the measured states, and beside them what every law makes of them.
fn write_states(directory: &Path, name: &str, table: &Table, fits: &[Fit]) -> Result<(), Error> {
    let mut columns: Vec<(String, &str, Vec<f64>)> = Vec::new();
    for i in [0, 1] {
        let stretches = table.states.iter().map(|state| state.stretches[i]).collect();
        columns.push((format!("stretch_{}", i + 1), "", stretches));
    }
    for i in [0, 1] {
        let nominal = table.states.iter().map(|state| state.nominal[i] / MPA).collect();
        columns.push((format!("nominal_{}", i + 1), "MPa", nominal));
    }
    for fit in fits {
        let mut found = Vec::new();
        for state in &table.states {
            found.push(homogeneous::biaxial(&fit.law, state.stretches[0], state.stretches[1])?);
        }
        for i in [0, 1] {
            let nominal = found.iter().map(|nominal| nominal[i] / MPA).collect();
            columns.push((format!("{}_{}", fit.model.key, i + 1), "MPa", nominal));
        }
    }
    let columns: Vec<output::csv::Column<'_>> =
        columns.iter().map(|(name, unit, data)| (name.as_str(), *unit, data.as_slice())).collect();
    output::csv::write(directory.join(format!("{name}_states.csv")), &columns)
}

/// rms by law and table, the parameters, a block for `peri`, trials, then the verdicts.
fn summary(title: &str, all: &[(&str, &Table, Vec<Fit>)], report: &Report) -> String {
    let mut text = format!("{title}\n");
    let laws = all.first().map_or(0, |(_, _, fits)| fits.len());
    if laws > 0 {
        text += "rms of the nominal stress in MPa, over the measured stresses (their number in brackets); k: parameters\n";
        let _ = write!(text, "{:<22}{:>4}", "law", "k");
        for (name, table, _) in all {
            let _ = write!(text, "{:>18}", format!("{name} ({})", table.measurements()));
        }
        text.push('\n');
    }
    for row in 0..laws {
        for (column, (_, _, fits)) in all.iter().enumerate() {
            let fit = &fits[row];
            if column == 0 {
                let _ = write!(text, "{:<22}{:>4}", fit.model.key, fit.parameters.len());
            }
            let _ = write!(text, "{:>18.5}", fit.rms / MPA);
        }
        text.push('\n');
    }
    for (name, _, fits) in all {
        let _ =
            writeln!(text, "parameters on {name} (± standard error, - where the data do not determine it)");
        for fit in fits {
            let list: Vec<String> = fit.parameters.iter().map(shown).collect();
            let _ = writeln!(text, "  {:<22}{}", fit.model.key, list.join(", "));
        }
        text += &material::best(name, fits);
    }
    for trial in &report.trials {
        let verdict = if trial.passed { "pass" } else { "FAIL" };
        let _ = writeln!(
            text,
            "{verdict}  {}: expected: {}; observed: {}",
            trial.what, trial.description, trial.observed
        );
    }
    for judgement in &report.expect {
        let _ = writeln!(text, "{}", judgement.row().join("  "));
    }
    text
}

/// `links 25.46 ± 0.13`.
fn shown(parameter: &Fitted) -> String {
    let (value, unit) = scaled(parameter.value, parameter.unit);
    let number = |value: f64| match value.abs() {
        size if (1e-3..1e5).contains(&size) || size == 0.0 => format!("{value:.5}"),
        _ => format!("{value:.4e}"),
    };
    let error = parameter.standard_error.map(|error| number(scaled(error, parameter.unit).0));
    let error = error.unwrap_or_else(|| "-".to_owned());
    format!("{} {} ± {error} {unit}", parameter.name, number(value)).trim_end().to_owned()
}
