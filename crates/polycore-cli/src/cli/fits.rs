//! Runs the fits and trials of a case and writes the results.

use std::fmt::Write as _;
use std::path::Path;

use harness::case::{Finished, Run};
use harness::output;
use harness::report::{Phases, Report};
use polycore::Error;
use polycore::constitutive;
use polycore::constitutive::hyperelastic::data::{TestData, TestState};
use polycore::constitutive::hyperelastic::fit::{
    Agreement, Fit, FittedParameter, Identifiability, fit_until,
};
use polycore::constitutive::hyperelastic::{Coverage, Hyperelastic, TwistedCylinder, stability};

use super::MPA;
use super::data::DataSet;
use super::material::{DIGITS, digits};
use super::quantities as q;
use super::scene::FitCase;
use super::table_fits::{TableFits, unit_of};
use super::verdict::FitVerdict;
use super::volumetric::VolumetricSet;
use super::{card, draw, material, ranking, time_fits, trials};

/// Fits every law to every table; writes tables and pictures. A law that cannot be fitted is reported, the
/// others are kept. If the run is stopped, finished fits are written.
pub fn run(case: &FitCase, run: &mut Run) -> Result<Finished, Error> {
    let (directory, quick) = (run.options.output, run.options.quick);
    run.begin()?;
    let mut report = Report::new("polycore", env!("CARGO_PKG_VERSION"), &case.source.text);
    let mut phases = Phases::new();
    let mut all: Vec<TableFits> = Vec::new();
    let total = (case.data.len() * case.laws.len()).max(1) as f64;
    let mut done = 0.0;
    let mut stopped = false;
    for own @ DataSet { name, table, read, .. } in &case.data {
        phases.start("fit");
        let mut set = TableFits {
            name,
            table,
            read,
            fits: Vec::new(),
            verdicts: Vec::new(),
            failed: Vec::new(),
            crossed: Vec::new(),
            outside: Vec::new(),
            ranked: Vec::new(),
            bulk: case.bulk(own),
        };
        for model in &case.laws {
            run.show(done / total, &|| format!("fit {name}  {}", model.key));
            match fit_until(model, table, run.options.interrupted) {
                Ok(fit) => {
                    set.verdicts.push(FitVerdict::new(&fit, table));
                    set.fits.push(fit);
                }
                Err(constitutive::Error::Stopped) => stopped = true,
                Err(error) => set.failed.push((model.key, error.to_string())),
            }
            if stopped {
                break;
            }
            done += 1.0;
        }
        if !own.modes.is_empty() && !stopped {
            phases.start("ranking");
            run.show(done / total, &|| format!("rank the laws on {name}"));
            match ranking::rank(own, set.judged(), run) {
                Ok(laws) => set.ranked = laws,
                Err(_) => stopped = true,
            }
        }
        phases.start("output");
        let coverage = Coverage::new(table)?;
        for other in case.others(own) {
            let stretches = other.table.states.iter().map(TestState::principal_stretches);
            let stretches = stretches.collect::<Result<Vec<_>, _>>()?;
            let outside = stretches.iter().filter(|stretches| !coverage.contains(**stretches)).count();
            set.outside.push((&other.name, stretches.len(), outside));
        }
        for (fit, verdict) in set.fits.iter().zip(&set.verdicts) {
            record_fit(&mut report, name, table, fit, verdict)?;
            for (other, (_, _, outside)) in case.others(own).zip(&set.outside) {
                let key = format!("{name}.{}.{}", fit.model.key, other.name);
                report.value(q::OUTSIDE.named(&[&key]), *outside as f64);
                let found = record_cross(&mut report, &key, &fit.law, &other.table)?;
                set.crossed.push((fit.model.key, &other.name, found));
            }
        }
        for (law, _) in &set.failed {
            report.value(q::FAILED.named(&[&format!("{name}.{law}")]), 1.0);
        }
        if let (true, false, Some((law, why))) = (set.fits.is_empty(), stopped, set.failed.first()) {
            let reason = format!("no law can be fitted; {law}: {why}");
            return Err(constitutive::Error::Data { what: (*name).clone(), reason }.into());
        }
        if !set.ranked.is_empty() {
            ranking::record(own, &set.ranked, &mut report);
            ranking::write(directory, own, &set.ranked)?;
        }
        write_states(directory, name, table, &set.fits)?;
        set.fits.iter().try_for_each(|fit| write_draws(directory, name, fit))?;
        all.push(set);
        if stopped {
            break;
        }
    }
    if !all.is_empty() {
        write_fits(directory, &all)?;
        material::write(directory, &all)?;
        card::write(directory, &all)?;
        card::write_hosts(directory, &all, &case.cards)?;
    }
    if stopped {
        return Err(run.interruption());
    }
    let mut timed = String::new();
    if let Some(time) = &case.time {
        phases.start("fit with time");
        timed = time_fits::run(time, run, &mut report)?;
    }
    phases.start("prony");
    let series = case.prony.iter().map(|set| set.run(directory, !quick, &mut report));
    let series = series.collect::<Result<Vec<_>, _>>()?;
    phases.start("trials");
    for trial in &case.trials {
        trials::run(trial, &mut report)?;
    }
    let volumes = case.volumetric.iter().map(|set| set.run(directory, &mut report));
    let volumes = volumes.collect::<Result<Vec<_>, _>>()?;
    let networks = case.networks.iter().map(|set| set.run(directory, !quick, &mut report));
    let networks = networks.collect::<Result<Vec<_>, _>>()?;
    if !case.foams.is_empty() {
        phases.start("foams");
    }
    let foams = case.foams.iter().map(|set| set.run(run, &mut report)).collect::<Result<Vec<_>, _>>()?;
    if !case.forecasts.is_empty() {
        phases.start("forecasts");
    }
    let forecasts = case.forecasts.iter().map(|set| set.run(run, &mut report));
    let forecasts = forecasts.collect::<Result<Vec<_>, _>>()?;
    if !quick {
        phases.start("pictures");
        for (own, set) in case.data.iter().zip(&all) {
            draw::pictures(directory, set.name, set.table, &set.fits)?;
            let best = ranking::best(&set.ranked).map(|law| law.key);
            if let Some(fit) = set.fits.iter().find(|fit| Some(fit.model.key) == best) {
                draw::every_mode(directory, set.name, &own.modes, fit, set.table.deviation)?;
            }
        }
    }
    phases.stop();
    report.phases(&phases).threads(1).judge(&case.expect, quick);
    trials::judge(&case.trials, &mut report);
    let mut text = summary(case, &all, &timed, &report);
    series
        .iter()
        .chain(&volumes)
        .chain(&networks)
        .chain(&foams)
        .chain(&forecasts)
        .for_each(|part| text += part);
    for name in &report.non_finite {
        let _ = writeln!(text, "FAIL  {name} is not finite");
    }
    let mut finished = Finished::new(report, text);
    finished.table = (!all.is_empty()).then(|| errors(case, &all));
    let warnings = case.data.iter().flat_map(DataSet::warnings);
    let warnings = warnings.chain(case.volumetric.iter().flat_map(VolumetricSet::warnings));
    let warnings: String = warnings.map(|line| line + "\n").collect();
    // the first line of each has K; the others are among the warnings
    let moduli: String =
        volumes.iter().filter_map(|text| text.lines().next()).map(|line| format!("{line}\n")).collect();
    Ok(finished.with_notes(&(warnings + &moduli + &remarks(case, &all))))
}

/// Converts a value to the unit of the tables: stresses to MPa, numbers unchanged.
fn scaled(value: f64, unit: &str) -> (f64, &'static str) {
    if unit == "Pa" { (value / MPA, "MPa") } else { (value, "") }
}

/// Records rms, mean absolute error and R² of a law on another table than that of its fit; if it locks there,
/// how often.
fn record_cross(
    report: &mut Report,
    key: &str,
    law: &dyn Hyperelastic,
    table: &TestData,
) -> Result<Option<Agreement>, Error> {
    let locks = |state: &&TestState| matches!(state.predict(law), Err(constitutive::Error::Locked { .. }));
    let locked = table.states.iter().filter(locks).count();
    report.value(q::LOCKED.named(&[key]), locked as f64);
    if locked > 0 {
        return Ok(None);
    }
    let found = Agreement::new(law, table)?;
    record_agreement(report, key, &found);
    Ok(Some(found))
}

fn record_agreement(report: &mut Report, key: &str, found: &Agreement) {
    report.value(q::RMS.named(&[key]), found.rms / MPA);
    report.value(q::MAE.named(&[key]), found.mae / MPA);
    if let Some(r2) = found.r2 {
        report.value(q::R2.named(&[key]), r2);
    }
}

fn record_fit(
    report: &mut Report,
    data: &str,
    table: &TestData,
    fit: &Fit,
    verdict: &FitVerdict,
) -> Result<(), Error> {
    let key = format!("{data}.{}", fit.model.key);
    report.value(q::SHEAR_MODULUS.named(&[&key]), fit.law.shear_modulus() / MPA);
    for parameter in &fit.parameters {
        let (value, unit) = scaled(parameter.value, parameter.unit);
        report.value(q::PARAMETER.named(&[&key, parameter.name]).in_unit(unit), value);
        if let Some(error) = parameter.standard_error {
            let quantity = q::STANDARD_ERROR.named(&[&key, parameter.name]).in_unit(unit);
            report.value(quantity, scaled(error, parameter.unit).0);
        }
    }
    record_agreement(report, &key, &Agreement::new(&fit.law, table)?);
    if let Some(chi) = fit.chi {
        report.value(q::CHI.named(&[&key]), chi);
    }
    report.value(q::STABLE.named(&[&key]), f64::from(u8::from(verdict.instability.is_none())));
    report.work(&format!("{key}.evaluations"), fit.iterations as u64);
    report.work(&format!("{key}.starts"), fit.starts.0 as u64);
    report.work(&format!("{key}.starts_that_agree"), fit.starts.1 as u64);
    Ok(())
}

/// Writes `fits.csv`: one line for each number, with its standard error if the data determine it; stresses of
/// a table in one unit.
fn write_fits(directory: &Path, all: &[TableFits]) -> Result<(), Error> {
    let mut text = String::from("data,law,quantity,value,standard_error,unit\n");
    for set in all {
        let (in_unit, pascals) = set.unit();
        for fit in &set.fits {
            let mut line = |quantity: &str, value: f64, error: Option<f64>, unit: &str| {
                let (shown, scale) = if unit == "Pa" { (in_unit, pascals) } else { ("", 1.0) };
                let error = error.map_or_else(String::new, |error| digits(error / scale, DIGITS));
                let (data, law, value) = (set.name, fit.model.key, digits(value / scale, DIGITS));
                let _ = writeln!(text, "{data},{law},{quantity},{value},{error},{shown}");
            };
            line("rms", fit.rms, None, "Pa");
            if let Some(chi) = fit.chi {
                line("chi", chi, None, "");
            }
            if let Some(r2) = Agreement::new(&fit.law, set.table)?.r2 {
                line("r2", r2, None, "");
            }
            for (_, other, found) in set.crossed.iter().filter(|crossed| crossed.0 == fit.model.key) {
                if let Some(r2) = found.and_then(|found| found.r2) {
                    line(&format!("r2.{other}"), r2, None, "");
                }
            }
            for parameter in
                fit.parameters.iter().filter(|parameter| parameter.identifiability != Identifiability::Absent)
            {
                line(parameter.name, parameter.value, parameter.standard_error, parameter.unit);
            }
            if fit.parameters.iter().all(|parameter| parameter.name != "shear_modulus") {
                line("shear_modulus", fit.law.shear_modulus(), None, "Pa");
            }
        }
    }
    polycore::file::atomic_write(directory.join("fits.csv"), |file| {
        std::io::Write::write_all(file, text.as_bytes())
    })
}

/// Writes `<data>_<law>_posterior.csv`: draws of the parameters, for `sweep --sample`.
fn write_draws(directory: &Path, name: &str, fit: &Fit) -> Result<(), Error> {
    if fit.draws.is_empty() {
        return Ok(());
    }
    let unit = |parameter: &FittedParameter| scaled(0.0, parameter.unit).1;
    let column = |(i, parameter): (usize, &FittedParameter)| {
        fit.draws.iter().map(|draw| scaled(draw[i], parameter.unit).0).collect()
    };
    let lists: Vec<Vec<f64>> = fit.parameters.iter().enumerate().map(column).collect();
    let columns: Vec<output::csv::Column> =
        fit.parameters.iter().zip(&lists).map(|(one, list)| (one.name, unit(one), &list[..])).collect();
    output::csv::write(directory.join(format!("{name}_{}_posterior.csv", fit.model.key)), &columns)
}

/// Writes `<data>_states.csv`: the measured states, and beside them the predictions of every law; of torsion
/// the stretches at the surface, the shear there, 2M/(πR³) and N/(πR²).
fn write_states(directory: &Path, name: &str, table: &TestData, fits: &[Fit]) -> Result<(), Error> {
    let mut columns: Vec<(String, &str, Vec<f64>)> = Vec::new();
    for i in [0, 1] {
        let stretches = table.states.iter().map(|state| state.stretches[i]).collect();
        columns.push((format!("stretch_{}", i + 1), "", stretches));
    }
    let cylinders: Vec<Option<TwistedCylinder>> = table.states.iter().map(TestState::cylinder).collect();
    if cylinders.iter().any(Option::is_some) {
        let shears = cylinders.iter().map(|one| one.map_or(f64::NAN, |one| one.shear)).collect();
        columns.push(("shear".to_owned(), "", shears));
    }
    for i in [0, 1] {
        let nominal = table.states.iter().map(|state| state.nominal[i] / MPA).collect();
        columns.push((format!("nominal_{}", i + 1), "MPa", nominal));
    }
    for fit in fits {
        let mut found = Vec::new();
        for state in &table.states {
            found.push(state.predict(&fit.law)?);
        }
        for i in [0, 1] {
            let nominal = found.iter().map(|nominal| nominal[i] / MPA).collect();
            columns.push((format!("{}_{}", fit.model.key, i + 1), "MPa", nominal));
        }
    }
    let columns: Vec<output::csv::Column<'_>> =
        columns.iter().map(|(name, unit, data)| (name.as_str(), *unit, data.as_slice())).collect();
    output::csv::write_with_gaps(directory.join(format!("{name}_states.csv")), &columns)
}

/// Summary of a run: layout of the files, rms by law and table, verdicts, parameters, a material block for
/// `peri`, trials, then the expectations.
fn summary(case: &FitCase, all: &[TableFits], timed: &str, report: &Report) -> String {
    let mut text = format!("{}\n{timed}", case.title);
    for set in all {
        set.read.iter().for_each(|line| text += &format!("{}: {line}\n", set.name));
    }
    if !all.is_empty() {
        text += &errors(case, all);
    }
    for set in all {
        for (law, why) in &set.failed {
            let _ = writeln!(text, "failed  {law} on {}: {why}", set.name);
        }
    }
    for (own, set) in case.data.iter().zip(all) {
        text += &verdicts(set);
        if !set.ranked.is_empty() {
            text += &ranking::table(own, &set.ranked);
            text += &ranking::advice(own, &set.ranked);
        }
        let _ = writeln!(text, "parameters on {} (± standard error, if the data determine it)", set.name);
        for fit in &set.fits {
            let list: Vec<String> = fit.parameters.iter().map(format_parameter).collect();
            let _ = writeln!(text, "  {:<22}{}", fit.model.key, list.join(", "));
        }
        text += &material::doubts(set);
        text += &material::best(set);
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

/// Returns the table of the errors of all laws on all tables.
fn errors(case: &FitCase, all: &[TableFits]) -> String {
    let mut text =
        "rms of the nominal stress, over the measured stresses (their number in brackets); k: parameters\n"
            .to_owned();
    let _ = write!(text, "{:<22}{:>4}", "law", "k");
    for set in all {
        let head = format!("{} ({}), {}", set.name, set.table.measurements(), set.unit().0);
        let _ = write!(text, "{head:>24}");
    }
    text.push('\n');
    for model in &case.laws {
        let _ = write!(text, "{:<22}{:>4}", model.key, model.parameters.len());
        for set in all {
            let fit = set.fits.iter().find(|fit| fit.model.key == model.key);
            let rms = fit.map(|fit| digits(fit.rms / set.unit().1, 5));
            let _ = write!(text, "{:>24}", rms.unwrap_or_else(|| "failed".to_owned()));
        }
        text.push('\n');
    }
    text
}

/// Returns the laws that failed, the law to take and the block of the best law, by table.
fn remarks(case: &FitCase, all: &[TableFits]) -> String {
    let mut text = String::new();
    for (own, set) in case.data.iter().zip(all) {
        let named = set.read.iter().filter(|line| line.starts_with("test: "));
        named.for_each(|line| text += &format!("{}: {line}\n", set.name));
        text += &ranking::advice(own, &set.ranked);
        for (law, why) in &set.failed {
            let _ = writeln!(text, "failed  {law} on {}: {why}", set.name);
        }
        text += &transfer(set);
        text += &material::doubts(set);
        text += &material::best(set);
    }
    text
}

/// Names the laws of a table that hold in all other tables, R² at least [`SAFE_R2`], and those that do not;
/// empty without `cross`.
fn transfer(set: &TableFits) -> String {
    if set.crossed.is_empty() {
        return String::new();
    }
    let names = |safe: bool| {
        let held = |key: &str| {
            set.crossed.iter().filter(|crossed| crossed.0 == key).all(|crossed| holds(&crossed.2))
        };
        let those: Vec<&str> =
            set.fits.iter().map(|fit| fit.model.key).filter(|key| held(key) == safe).collect();
        if those.is_empty() { "none".to_owned() } else { those.join(", ") }
    };
    format!("{}: safe outside: {}; unsafe: {}\n", set.name, names(true), names(false))
}

/// Returns true for a law that agrees with another table.
fn holds(found: &Option<Agreement>) -> bool {
    found.is_some_and(|found| found.r2.is_none_or(|r2| r2 >= SAFE_R2))
}

/// R² in the own and in other tables below which a law is unsafe there.
const SAFE_R2: f64 = 0.9;

/// Lists R² of each law in its table and in the others, whether it is safe there, and where it is unstable.
fn verdicts(set: &TableFits) -> String {
    let [low, high] = stability::range(set.table);
    let mut text = format!(
        "R² of laws fitted to {}; stability (Drucker) in uniaxial, equibiaxial and pure shear tests at \
         stretches {low:.3} to {high:.3}\n",
        set.name
    );
    for (other, states, outside) in set.outside.iter().filter(|(_, _, outside)| *outside > 0) {
        let _ = writeln!(text, "  out of distribution: {outside} of {states} states of {other}");
    }
    for (fit, verdict) in set.judged() {
        let key = fit.model.key;
        let shown = |r2: Option<f64>| match r2 {
            Some(r2) if r2 > -100.0 => format!("{r2:.4}"),
            Some(r2) => format!("{r2:.0e}"),
            None => "-".to_owned(),
        };
        let own = Agreement::new(&fit.law, set.table).ok().and_then(|found| found.r2);
        let _ = write!(text, "  {key:<22}{}", shown(own));
        let crossed: Vec<_> = set.crossed.iter().filter(|crossed| crossed.0 == key).collect();
        for (_, other, found) in &crossed {
            let r2 = found.map_or_else(|| "locked".to_owned(), |found| shown(found.r2));
            let _ = write!(text, ", {other} {r2}");
        }
        if !crossed.is_empty() {
            let safe = crossed.iter().all(|(_, _, found)| holds(found));
            let verdict = if safe { "safe outside" } else { "unsafe outside" };
            let _ = write!(text, "; {verdict} {}", set.name);
        }
        if let Some(chi) = fit.chi {
            let _ = write!(text, "; χ {}", digits(chi, 3));
        }
        if let Some(lost) = verdict.without_ellipticity() {
            let _ = write!(text, "; {lost}");
        }
        let unstable = verdict.without_stability();
        let _ = writeln!(text, "; {}", unstable.as_deref().unwrap_or("stable"));
    }
    text
}

/// Formats a parameter: `links 25.46 ± 0.13`; without a standard error only its value.
pub fn format_parameter(parameter: &FittedParameter) -> String {
    let name = parameter.name;
    let (unit, scale) = if parameter.unit == "Pa" { unit_of(parameter.value) } else { ("", 1.0) };
    let number = |value: f64| digits(value / scale, 6);
    match parameter.identifiability {
        Identifiability::Absent => format!("{name} absent"),
        Identifiability::Undetermined => format!("{name} not determined"),
        Identifiability::Determined => {
            let error = parameter.standard_error.map(|error| format!(" ± {}", digits(error / scale, 2)));
            let error = error.unwrap_or_default();
            format!("{name} {}{error} {unit}", number(parameter.value)).trim_end().to_owned()
        }
    }
}
