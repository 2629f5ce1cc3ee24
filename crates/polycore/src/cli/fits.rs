//! Runs the fits of a case and writes what they give.

use std::fmt::Write as _;
use std::path::Path;

use polycore::Error;
use polycore::hyperelastic::data::Table;
use polycore::hyperelastic::fit::{Fit, fit};
use polycore::hyperelastic::homogeneous;
use polycore::output;
use polycore::report::{Judgement, Phases, Report};

use super::draw;
use super::scene::Case;

/// Everything printed and written is in MPa.
pub const MPA: f64 = 1e6;

/// Fits every law to every table, writes tables, pictures and the report, and prints the summary.
pub fn run(case: &Case, directory: &Path, quick: bool) -> Result<Report, Error> {
    let mut report = Report::new("polycore", env!("CARGO_PKG_VERSION"), &case.source.text);
    let mut phases = Phases::new();
    let mut all: Vec<(&str, &Table, Vec<Fit>)> = Vec::new();
    for (name, table) in &case.data {
        phases.start("fit");
        let mut fits = Vec::new();
        for family in &case.laws {
            fits.push(fit(family, table)?);
        }
        phases.start("output");
        for fit in &fits {
            record(&mut report, name, fit);
        }
        write_states(directory, name, table, &fits)?;
        all.push((name, table, fits));
    }
    write_fits(directory, &all)?;
    if !quick {
        phases.start("pictures");
        for (name, table, fits) in &all {
            draw::pictures(directory, name, table, fits)?;
        }
    }
    phases.stop();
    report.phases(&phases).threads(1).judge(&case.expect, quick);
    report.write(directory)?;
    polycore::command::print(summary(&case.title, &all, &report.expect));
    Ok(report)
}

/// In the unit of the tables: a stress in MPa, numbers as they are.
fn scaled(value: f64, unit: &str) -> (f64, &'static str) {
    if unit == "Pa" { (value / MPA, "MPa") } else { (value, "") }
}

fn record(report: &mut Report, data: &str, fit: &Fit) {
    let key = format!("{data}.{}", fit.family.key);
    report.value(&format!("{key}.shear_modulus"), fit.law.shear_modulus() / MPA, "MPa");
    for parameter in &fit.parameters {
        let (value, unit) = scaled(parameter.value, parameter.unit);
        report.value(&format!("{key}.{}", parameter.name), value, unit);
        if let Some(error) = parameter.standard_error {
            let name = format!("{key}.{}.standard_error", parameter.name);
            report.value(&name, scaled(error, parameter.unit).0, unit);
        }
    }
    report.value(&format!("{key}.rms"), fit.rms / MPA, "MPa");
    report.work(&format!("{key}.evaluations"), fit.iterations as u64);
    report.work(&format!("{key}.starts"), fit.starts.0 as u64);
    report.work(&format!("{key}.starts_that_agree"), fit.starts.1 as u64);
}

/// `fits.csv`: one line for each number, with its standard error where the data determine it.
fn write_fits(directory: &Path, all: &[(&str, &Table, Vec<Fit>)]) -> Result<(), Error> {
    let mut text = String::from("data,law,quantity,value,standard_error,unit\n");
    for (data, _, fits) in all {
        for fit in fits {
            let mut line = |quantity: &str, value: f64, error: Option<f64>, unit: &str| {
                let (value, shown) = scaled(value, unit);
                let error = error.map_or_else(String::new, |error| scaled(error, unit).0.to_string());
                let _ = writeln!(text, "{data},{},{quantity},{value},{error},{shown}", fit.family.key);
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
            columns.push((format!("{}_{}", fit.family.key, i + 1), "MPa", nominal));
        }
    }
    let columns: Vec<output::csv::Column<'_>> =
        columns.iter().map(|(name, unit, data)| (name.as_str(), *unit, data.as_slice())).collect();
    output::csv::write(directory.join(format!("{name}_states.csv")), &columns)
}

/// rms by law and table, then the verdicts.
fn summary(title: &str, all: &[(&str, &Table, Vec<Fit>)], expect: &[Judgement]) -> String {
    let mut text = format!("{title}\nrms of the nominal stress, MPa (parameters)\n");
    let laws = all.first().map_or(0, |(_, _, fits)| fits.len());
    let _ = write!(text, "{:<22}{:>4}", "law", "k");
    for (name, table, _) in all {
        let _ = write!(text, "{:>16}", format!("{name} ({})", table.measurements()));
    }
    text.push('\n');
    for row in 0..laws {
        for (column, (_, _, fits)) in all.iter().enumerate() {
            let fit = &fits[row];
            if column == 0 {
                let _ = write!(text, "{:<22}{:>4}", fit.family.key, fit.parameters.len());
            }
            let _ = write!(text, "{:>16.5}", fit.rms / MPA);
        }
        text.push('\n');
    }
    for judgement in expect {
        let _ = writeln!(text, "{}", judgement.row().join("  "));
    }
    text
}
