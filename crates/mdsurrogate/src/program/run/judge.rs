//! Evaluation of laws on the data of a scene: errors, physics, error against time; figures and tables.

use super::heldout::{Heldout, percentages};
use super::{Prepared, draw, short};
use crate::dataset::{DataRow, SplitMethod, noise};
use crate::error::Error;
use crate::eval::{
    Ellipticity, Errors, FLAGS, FlagStatistics, PhysicsChecks, agreement, answers_along, errors,
    errors_along, time_per_stress, within_rates,
};
use crate::program::quantities as q;
use crate::surrogate::{Prediction, Surrogate};
use harness::output::csv;
use harness::report::Report;
use harness::scene::Failure;
use polycore::constitutive::viscoelastic::Branch;
use std::path::Path;

/// Largest number of rows for the physics checks.
const MOST_PHYSICS_ROWS: usize = 200;

/// Largest number of strains for the ellipticity scan.
const MOST_SCANNED_STRAINS: usize = 500;

/// A warning follows if the mean square error exceeds both this multiple of the noise …
const FAR_ABOVE_NOISE: f64 = 100.0;
/// … and this fraction of the mean square stress.
const FAR_FROM_STRESS: f64 = 0.01;

/// A law with its name.
pub struct NamedLaw<'a> {
    /// Name, in files and values.
    pub name: &'a str,
    /// The law.
    pub law: &'a Surrogate,
    /// Branches beside the law.
    pub branches: &'a [Branch],
    /// Names of its training runs; empty for all.
    pub runs: &'a [String],
    /// Training time, s, if known.
    pub seconds: Option<f64>,
    /// Method of its split, if different from the scene's.
    pub split: Option<SplitMethod>,
}

/// Evaluates laws: reports values, writes CSV files and pictures to `output`, and returns a table, line by
/// line.
///
/// # Errors
/// Returns an error for a law that overflows, and I/O errors.
pub fn judge_laws(
    laws: &[NamedLaw],
    data: &Prepared,
    output: &Path,
    report: &mut Report,
) -> Result<Vec<String>, Failure<Error>> {
    // rounding errors of smooth data are not noise
    let largest = data.set.rows().map(|row| row.s.norm_squared()).fold(0.0, f64::max);
    let floor =
        noise(&data.set, |row| row.s).map(|noise| noise.floor).filter(|floor| *floor > 1e-24 * largest);
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
    let mut warnings = Vec::new();
    let (mut losses, mut training, mut inference) = (Vec::new(), Vec::new(), Vec::new());
    let mut unseen = Vec::new();
    // noise of a row: root of the floor, which is a sum over components
    let chance = floor.unwrap_or(0.0).sqrt();
    for NamedLaw { name, law, branches, runs, seconds, split } in laws {
        let relieved;
        let data = if branches.is_empty() {
            data
        } else {
            relieved = data.without_stress_of(branches)?;
            &relieved
        };
        let split = data.split_of(*split);
        let test = data.rows(if split.test.is_empty() { &split.train } else { &split.test });
        let stress_square =
            test.iter().map(|row| row.s.norm_squared()).sum::<f64>() / test.len().max(1) as f64;
        let sets = [("training", &split.train), ("validation", &split.validation), ("test", &split.test)];
        for (set, rows) in sets.into_iter().filter(|(_, rows)| !rows.is_empty()) {
            // the test includes all rows, also of runs that are not in its training
            let rows = if set == "test" { data.rows(rows) } else { data.rows_of(rows, runs) };
            let found = errors(law, rows.iter().copied())?;
            record(report, name, set, &found, floor);
            if set == "test" {
                record_uncertainty(
                    report,
                    name,
                    set,
                    law,
                    &FlagStatistics::count(law, rows.into_iter(), chance)?,
                );
            }
        }
        if data.set.is_nominal() {
            table.extend(by_mode(report, name, law, runs, data)?);
        }
        for run in data.heldout.iter().flat_map(|set| &set.paths) {
            let found = errors_along(law, branches, run)?;
            let set = format!("heldout.{}", run.id);
            if law.header().softening.is_some() {
                let ratio = errors(law, run.rows.iter())?.mean_square() / found.mean_square();
                report.value(q::ERROR_WITHOUT_SOFTENING.named(&[name, &set]), ratio);
            }
            record(report, name, &set, &found, floor);
            record_uncertainty(
                report,
                name,
                &set,
                law,
                &FlagStatistics::count(law, run.rows.iter(), chance)?,
            );
        }
        let every = test.len().div_ceil(MOST_PHYSICS_ROWS).max(1);
        let physics = PhysicsChecks::measure(law, &test.iter().step_by(every).copied().collect::<Vec<_>>())?;
        record_physics(report, name, &physics);
        // an incompressible body has no longitudinal waves, and these laws lack its pressure
        if !data.set.is_nominal() {
            let learnt = data.rows_of(&split.train, runs);
            let every = learnt.len().div_ceil(MOST_SCANNED_STRAINS).max(1);
            let strains: Vec<_> = learnt.iter().step_by(every).map(|row| row.c).collect();
            warnings.extend(record_ellipticity(report, name, Ellipticity::scan(*law, &strains)?));
        }
        let stress = time_per_stress(law, &test)?;
        report.seconds(&format!("one stress of {name}"), stress);
        let found = errors(law, test.iter().copied())?;
        losses.push(found.mean_square() / 1e12);
        let others = data.rows(&split.validation).into_iter().chain(data.rows(&split.test));
        unseen.push(errors(law, others)?.mean_square());
        draw::predicted(name, law, &test, output)?;
        training.push(seconds.unwrap_or(f64::NAN));
        inference.push(stress);
        table.push(format!(
            "{:<16} {:>10} {:>8} MPa² {:>12} {:>9.1} % {:>6} MPa {:>10.1e} {:>10.1e} {:>7.2} µs",
            name,
            law.header().architecture.parameters() * law.header().members,
            short(found.mean_square() / 1e12),
            floor.map_or("-".into(), |floor| short(found.mean_square() / floor)),
            found.percentage,
            short(physics.rest / 1e6),
            physics.asymmetry,
            physics.cycle,
            stress * 1e6
        ));
        let far = floor.is_some_and(|floor| found.mean_square() > FAR_ABOVE_NOISE * floor);
        if far && found.mean_square() > FAR_FROM_STRESS * stress_square {
            warnings.push(format!(
                "{name}: the error on the test rows is {} times the noise and {} of the stress; the model \
                  has not learnt the data",
                short(found.mean_square() / floor.unwrap_or(f64::NAN)),
                short((found.mean_square() / stress_square).sqrt())
            ));
        }
    }
    table.append(&mut warnings);
    leaks(laws, &unseen, report);
    let names: Vec<&str> = laws.iter().map(|law| law.name).collect();
    draw::against_time(&names, &losses, &training, &inference, floor.map(|floor| floor / 1e12), output)?;
    let heldout = predict_heldout(laws, data)?;
    for run in &heldout {
        write_heldout(run, &names, output)?;
        table.push(match run.within {
            Some(true) => format!("held-out run {}: rates within those of the training runs", run.run.id),
            Some(false) => format!("held-out run {}: rates outside those of the training runs", run.run.id),
            None => {
                format!("held-out run {}: unknown rates, or no training runs of its kind", run.run.id)
            }
        });
    }
    draw::heldout(&heldout, &names, output)?;
    for held in &heldout {
        record_bounds(report, held, floor);
    }
    draw::binned(report, &heldout, &names, output)?;
    Ok(table)
}

/// Reports R² and mean absolute error for each run with nominal stresses and for all; returns lines of a
/// table.
fn by_mode(
    report: &mut Report,
    name: &str,
    law: &Surrogate,
    runs: &[String],
    data: &Prepared,
) -> Result<Vec<String>, Error> {
    let mut lines = Vec::new();
    let whole = ("all_runs".to_owned(), data.set.paths.iter().collect::<Vec<_>>());
    let single = data.set.paths.iter().map(|path| (format!("run.{}", path.id), vec![path]));
    for (what, paths) in single.chain([whole]) {
        let rows = || paths.iter().flat_map(|path| &path.rows);
        let Some(found) = agreement(law, rows())? else { continue };
        let uncertainty = FlagStatistics::count(law, rows(), 0.0)?;
        record_uncertainty(report, name, &what, law, &uncertainty);
        let flagged = (uncertainty.caught[0] + uncertainty.alarms[0]) as f64
            / (uncertainty.bad + uncertainty.good) as f64;
        report.value(q::SHARE_FLAGGED.named(&[name, &what]), flagged);
        report.value(q::MEAN_ABSOLUTE_ERROR.named(&[name, &what]), found.absolute / 1e6);
        let rms = (found.squares / found.count as f64).sqrt() / 1e6;
        report.value(q::RMS.named(&[name, &what]), rms);
        if let Some(r2) = found.r2 {
            report.value(q::R2.named(&[name, &what]), r2);
        }
        let learnt = paths.iter().all(|path| runs.is_empty() || runs.contains(&path.id));
        lines.push(format!(
            "{name:<16} {what:<18} R² {:>9}  mean |P − P̂| {:>9} MPa  {}flagged {:.0} %",
            found.r2.map_or("-".into(), |r2| format!("{r2:.5}")),
            short(found.absolute / 1e6),
            if learnt { "learnt, " } else { "" },
            100.0 * flagged
        ));
    }
    Ok(lines)
}

/// Reports the error on validation and test rows of a law trained on another split, over that of the same
/// network on the scene's split: the effect of neighbouring training rows.
fn leaks(laws: &[NamedLaw], unseen: &[f64], report: &mut Report) {
    for (other, loss) in laws.iter().zip(unseen).filter(|(law, _)| law.split.is_some()) {
        let same = |law: &&NamedLaw| {
            let [a, b] = [law.law, other.law].map(Surrogate::header);
            law.split.is_none() && (&a.kind, &a.architecture) == (&b.kind, &b.architecture)
        };
        let reference = laws.iter().zip(unseen).find(|(law, _)| same(law));
        if let Some((law, own)) = reference.filter(|(_, own)| **own > 0.0) {
            report.value(q::UNSEEN_ERROR_RATIO.named(&[other.name, law.name]), loss / own);
        }
    }
}

/// Reports (3.13) for zero stress, 100 % by definition, and for the noise, the average of a perfect law.
fn record_bounds(report: &mut Report, held: &Heldout, floor: Option<f64>) {
    let zero = vec![[0.0; 6]; held.run.rows.len()];
    let mean = |values: Vec<f64>| {
        let known: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
        known.iter().sum::<f64>() / known.len().max(1) as f64
    };
    let set = format!("heldout.{}", held.run.id);
    let zero_error = mean(percentages(&held.run.rows, &zero));
    report.value(q::PERCENTAGE_ERROR.named(&["zero_stress", &set]), zero_error);
    if let Some(floor) = floor {
        let noise = held.run.rows.iter().map(|row| 100.0 * floor.sqrt() / row.s.norm()).collect();
        report.value(q::PERCENTAGE_ERROR.named(&["noise", &set]), mean(noise));
    }
}

fn record(report: &mut Report, name: &str, set: &str, errors: &Errors, floor: Option<f64>) {
    report.value(q::MEAN_SQUARE_ERROR.named(&[name, set]), errors.mean_square() / 1e12);
    report.value(q::COMPONENT_ERROR.named(&[name, set]), errors.mean_square() / 6e12);
    report.value(q::PERCENTAGE_ERROR.named(&[name, set]), errors.percentage);
    let outside = errors.flagged as f64 / errors.rows.max(1) as f64;
    report.value(q::SHARE_OUTSIDE.named(&[name, set]), outside);
    if let Some(floor) = floor {
        report.value(q::ERROR_OVER_NOISE.named(&[name, set]), errors.mean_square() / floor);
    }
}

/// Reports fractions of bad predictions, of those with flags, and of false alarms.
fn record_uncertainty(
    report: &mut Report,
    name: &str,
    set: &str,
    law: &Surrogate,
    uncertainty: &FlagStatistics,
) {
    let share = |part: usize, all: usize| part as f64 / all.max(1) as f64;
    let rows = uncertainty.bad + uncertainty.good;
    report.value(q::SHARE_BADLY_WRONG.named(&[name, set]), share(uncertainty.bad, rows));
    let known = if law.header().spread_limit.is_some() { 4 } else { 3 };
    for (place, flag) in FLAGS.iter().enumerate().take(known) {
        let flag = &flag.trim_start_matches("the ").replace(' ', "_");
        if uncertainty.bad > 0 {
            let caught = share(uncertainty.caught[place], uncertainty.bad);
            report.value(q::CAUGHT_BY.named(&[name, set, flag]), caught);
        }
        if uncertainty.good > 0 {
            let alarms = share(uncertainty.alarms[place], uncertainty.good);
            report.value(q::FALSE_ALARMS.named(&[name, set, flag]), alarms);
        }
    }
    if let Some(correlation) = uncertainty.correlation {
        report.value(q::RANK_CORRELATION.named(&[name, set]), correlation);
    }
    for (component, within) in crate::kinematics::NAMES.iter().zip(uncertainty.within) {
        for (count, share) in ["1", "2"].into_iter().zip(within.into_iter().flatten()) {
            report.value(q::WITHIN.named(&[name, set, count, component]), share);
        }
    }
}

/// Reports the slowest wave; returns a warning if ellipticity is lost.
fn record_ellipticity(report: &mut Report, name: &str, found: Option<Ellipticity>) -> Option<String> {
    let Ellipticity { states, lost, least, at, direction } = found?;
    report.value(q::LEAST_WAVE.named(&[name]), least / 1e6);
    for (component, value) in crate::kinematics::NAMES.iter().zip(&at) {
        report.value(q::LEAST_WAVE_AT.named(&[name, component]), *value);
    }
    report.value(q::NOT_ELLIPTIC.named(&[name]), lost as f64 / states as f64);
    let numbers =
        |values: &[f64]| values.iter().map(|value| format!("{value:.4}")).collect::<Vec<_>>().join(", ");
    (lost > 0).then(|| {
        format!(
            "{name}: loses ellipticity at {lost} of {states} training strains; the worst has C = ({}) and \
              waves along N = ({}): {} MPa. Finite elements localise there; `polyconvex` excludes it",
            numbers(at.as_slice()),
            numbers(&direction),
            short(least / 1e6)
        )
    })
}

fn record_physics(report: &mut Report, name: &str, physics: &PhysicsChecks) {
    report.value(q::STRESS_AT_REST.named(&[name]), physics.rest / 1e6);
    report.value(q::ASYMMETRY.named(&[name]), physics.asymmetry);
    report.value(q::LARGEST_ASYMMETRY.named(&[name]), physics.largest_asymmetry);
    report.value(q::CYCLE.named(&[name]), physics.cycle);
    report.value(q::OBJECTIVITY.named(&[name]), physics.objectivity);
    report.value(q::UNSEEN_SHEAR.named(&[name]), physics.shear_stress / 1e6);
    if let Some(share) = physics.shear_flagged {
        report.value(q::SHEAR_FLAGGED.named(&[name]), share);
    }
}

fn predict_heldout<'a>(laws: &[NamedLaw], data: &'a Prepared) -> Result<Vec<Heldout<'a>>, Error> {
    let mut seen = Vec::new();
    for run in data.heldout.iter().flat_map(|set| &set.paths) {
        let mut predicted = Vec::new();
        for NamedLaw { law, branches, .. } in laws {
            let stress = |(row, answer): (&DataRow, Prediction)| row.compared(&answer.stress)[1].into();
            predicted.push(answers_along(law, branches, run)?.into_iter().map(stress).collect());
        }
        let reach = |axis: usize| run.rows.iter().map(|row| (row.c[axis] - 1.0).abs()).fold(0.0, f64::max);
        let unknown = run.rates.iter().all(|rate| rate.is_nan());
        let pulled = (0..3).filter(|&axis| unknown || !run.rates[axis].is_nan());
        let axis = pulled.max_by(|&a, &b| reach(a).total_cmp(&reach(b))).unwrap_or(0);
        seen.push(Heldout { run, axis, within: within_rates(run, &data.set), predicted });
    }
    Ok(seen)
}

/// Writes C and S along the axis of the largest deformation, measured and predicted, and (3.13).
fn write_heldout(seen: &Heldout, names: &[&str], output: &Path) -> Result<(), Error> {
    let component = crate::kinematics::NAMES[seen.axis];
    let rows = &seen.run.rows;
    let (stress, measured) = seen.measured();
    let mut columns = vec![
        (format!("C{component}"), "", rows.iter().map(|row| row.c[seen.axis]).collect::<Vec<f64>>()),
        (stress.clone(), "MPa", measured),
    ];
    for (name, predicted) in names.iter().zip(&seen.predicted) {
        let along = predicted.iter().map(|stress| stress[seen.axis] / 1e6).collect();
        columns.push((format!("{stress} of {name}"), "MPa", along));
        columns.push((format!("percentage error of {name}"), "%", percentages(rows, predicted)));
    }
    let columns: Vec<csv::Column> =
        columns.iter().map(|(name, unit, data)| (name.as_str(), *unit, data.as_slice())).collect();
    Ok(csv::write(output.join(format!("heldout-{}.csv", seen.run.id)), &columns)?)
}
