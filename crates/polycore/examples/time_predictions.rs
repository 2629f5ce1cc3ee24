//! Blind predictions of `docs/predictions`: fits laws with time of several forms to cycles, judges them on
//! data left out, and predicts a test that none of them saw. `cargo run --release --example
//! time_predictions -- vhb4910 TABLE OUTPUT` (or `hnbr50`). The tables are not part of this repository; the
//! README of `docs/predictions` says where they are from.

use std::error::Error;
use std::fs;

use polycore::constitutive::hyperelastic::model;
use polycore::constitutive::viscoelastic::fit::{
    BranchForm, FitSettings, Form, MeasuredRun, Measurement, SpringForm, Test, TimeFit, ViscosityForm, fit,
    leave_out, rates,
};
use polycore::constitutive::viscoelastic::{Pace, Viscoelastic};

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Forms: equilibrium law, spring and viscosity of all branches, their number.
const CONSTANT: ViscosityForm = ViscosityForm::Constant;
const KLP: ViscosityForm = ViscosityForm::KumarLopezPamies;
const BB: ViscosityForm = ViscosityForm::BergstromBoyce;
const NEO: SpringForm = SpringForm::NeoHookean;
type Choice = (&'static str, SpringForm, ViscosityForm, usize);
const VHB: [Choice; 9] = [
    ("mooney-rivlin", NEO, CONSTANT, 2),
    ("mooney-rivlin", NEO, CONSTANT, 3),
    ("lopez-pamies", NEO, CONSTANT, 2),
    ("lopez-pamies", NEO, CONSTANT, 3),
    ("neo-hookean", NEO, CONSTANT, 2),
    ("mooney-rivlin", NEO, BB, 2),
    ("mooney-rivlin", NEO, BB, 1),
    ("mooney-rivlin", NEO, KLP, 1),
    ("lopez-pamies", SpringForm::LopezPamies(2), KLP, 1),
];
const HNBR: [Choice; 10] = [
    ("lopez-pamies", NEO, BB, 1),
    ("lopez-pamies", NEO, CONSTANT, 2),
    ("lopez-pamies", NEO, CONSTANT, 3),
    ("lopez-pamies", NEO, BB, 2),
    ("lopez-pamies", NEO, BB, 3),
    ("lopez-pamies", NEO, KLP, 2),
    ("lopez-pamies", NEO, ViscosityForm::Eyring, 2),
    ("mooney-rivlin", NEO, BB, 2),
    ("eight-chain-root-i2", NEO, BB, 2),
    ("ogden-2", NEO, BB, 2),
];

/// Factor on the least error of the data left out up to which a form belongs to the band.
const BAND: f64 = 1.5;

/// Steps of predictions: a local error of 1 Pa in 10 kPa.
const FINE: Pace = Pace::Within(10.0);

fn main() -> Outcome<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.as_slice() {
        [case, table, output] if case == "vhb4910" => predict(&runs(table, true)?, &VHB, output, relaxations),
        [case, table, output] if case == "hnbr50" => predict(&runs(table, false)?, &HNBR, output, cycle),
        _ => {
            println!("arguments: vhb4910 or hnbr50, the table of measurements, the file to write");
            Ok(())
        }
    }
}

/// Runs of a table: VHB has the columns test, rate, largest stretch before time, stretch, stress (kPa); HNBR
/// the rate (MPa).
fn runs(path: &str, is_vhb: bool) -> Outcome<Vec<MeasuredRun>> {
    let text = fs::read_to_string(path)?;
    let rows = text.lines().filter(|line| line.starts_with(if is_vhb { "cycle," } else { "0." }));
    let mut runs: Vec<(String, f64, Vec<Measurement>)> = Vec::new();
    for row in rows {
        let cells: Vec<&str> = row.split(',').collect();
        let (head, numbers) = cells.split_at(cells.len() - 3);
        let numbers: Vec<f64> = numbers.iter().map(|cell| cell.parse()).collect::<Result<_, _>>()?;
        let name = head.join(" ");
        if runs.last().is_none_or(|run| run.0 != name) {
            runs.push((name, head[usize::from(is_vhb)].parse()?, Vec::new()));
        }
        let nominal = numbers[2] * if is_vhb { 1e3 } else { 1e6 };
        if let Some(run) = runs.last_mut() {
            run.2.push(Measurement { time: numbers[0], strain: numbers[1], nominal });
        }
    }
    let built =
        runs.into_iter().map(|(name, rate, points)| MeasuredRun::new(&name, rate, Test::Uniaxial, points));
    Ok(built.collect::<Result<_, _>>()?)
}

/// Row of a prediction: its columns before the stress, and the stress, Pa.
type Row = (Vec<f64>, f64);
/// Heading and rows of a prediction by a law.
type Program = fn(&Viscoelastic) -> Outcome<(&'static str, f64, Vec<Row>)>;

/// Ramps at 0.25 /s to six stretches, held for 400 s.
fn relaxations(law: &Viscoelastic) -> Outcome<(&'static str, f64, Vec<Row>)> {
    const RATE: f64 = 0.25;
    let mut rows = Vec::new();
    for stretch in [1.5, 2.0, 3.0, 4.0, 5.0, 6.0] {
        let ramp = (stretch - 1.0) / RATE;
        let held: Vec<f64> = (0..=30).map(|k| 0.5 * 800_f64.powf(f64::from(k) / 30.0)).collect();
        let path: Vec<[f64; 2]> = [[0.0, 1.0], [ramp, stretch]]
            .into_iter()
            .chain(held.iter().map(|t| [ramp + t, stretch]))
            .collect();
        let found = Test::Uniaxial.follow(law, &path, FINE)?;
        rows.extend(held.iter().zip(&found[2..]).map(|(t, stress)| (vec![stretch, *t, ramp + t], *stress)));
    }
    Ok(("stretch,time_s,time_from_start_s,nominal_kPa,low_kPa,high_kPa", 1e3, rows))
}

/// A cycle 1, 2, 0.75, 1 at 8.6e-3 /s.
fn cycle(law: &Viscoelastic) -> Outcome<(&'static str, f64, Vec<Row>)> {
    const RATE: f64 = 8.6e-3;
    let mut path = vec![[0.0, 1.0]];
    for (from, to, count) in [(1.0, 2.0, 40), (2.0, 0.75, 50), (0.75, 1.0, 10)] {
        let start = path[path.len() - 1][0];
        for k in 1..=count {
            let part = f64::from(k) / f64::from(count) * (to - from);
            path.push([start + f64::abs(part) / RATE, from + part]);
        }
    }
    let found = Test::Uniaxial.follow(law, &path, FINE)?;
    let rows = path.iter().zip(found).map(|(point, stress)| (point.to_vec(), stress)).collect();
    Ok(("time_s,stretch,nominal_MPa,low_MPa,high_MPa", 1e6, rows))
}

/// Measurements that are left out together.
struct Group {
    name: String,
    left: Left,
    /// True if the choice of a form rests on the runs left out: two rates two decades apart do not determine
    /// a law of one.
    counts: bool,
}

enum Left {
    /// Runs of these names.
    Runs(Vec<String>),
    /// All that follows the first cycle: a path of this strain.
    Later(f64),
    /// Nothing: stresses at a rate between two, linear in its logarithm, over a path of this strain. A law
    /// with a hole in its spectrum is far from them.
    Between { rate: f64, path: f64 },
}

/// A fitted form and its errors.
struct Candidate {
    name: String,
    fit: TimeFit,
    /// Root mean square of each group left out, Pa.
    left: Vec<f64>,
    /// Mean of those that count, Pa.
    score: f64,
}

fn predict(runs: &[MeasuredRun], choices: &[Choice], output: &str, program: Program) -> Outcome<()> {
    let groups = groups(runs);
    let names: Vec<&str> = groups.iter().map(|group| group.name.as_str()).collect();
    println!(
        "form; constants fitted; rms of the fit; without {}; mean of those that count, kPa",
        names.join("; without ")
    );
    let mut candidates = Vec::new();
    for &(equilibrium, spring, viscosity, count) in choices {
        let form = Form::new(model(equilibrium)?, vec![BranchForm { spring, viscosity }; count]);
        let name = format!("{equilibrium}, {count} × {spring:?}, {viscosity:?}");
        let settings = FitSettings { starts: 3, reach: 1.5, ..Default::default() };
        match candidate(name.clone(), &form, runs, &groups, &settings) {
            Ok(found) => {
                let free = found.fit.constants.iter().filter(|c| c.constant.fixed.is_none()).count();
                let left: Vec<String> = found.left.iter().map(|rms| format!("{:.3}", rms / 1e3)).collect();
                let (rms, score) = (found.fit.pooled.rms / 1e3, found.score / 1e3);
                println!("{name}; {free}; {rms:.3}; {}; {score:.3}", left.join("; "));
                candidates.push(found);
            }
            Err(error) => println!("{name}; {error}"),
        }
    }
    candidates.sort_by(|a, b| a.score.total_cmp(&b.score));
    let best = candidates.first().ok_or("no form fits")?;
    report(best, runs);
    let (heading, unit, rows) = program(&best.fit.law()?)?;
    let mut low: Vec<f64> = rows.iter().map(|row| row.1).collect();
    let mut high = low.clone();
    for other in candidates.iter().filter(|other| other.score <= BAND * best.score) {
        println!("band: {}", other.name);
        for (k, row) in program(&other.fit.law()?)?.2.iter().enumerate() {
            (low[k], high[k]) = (low[k].min(row.1), high[k].max(row.1));
        }
    }
    let mut text = format!("{heading}\n");
    for (k, (columns, stress)) in rows.iter().enumerate() {
        columns.iter().for_each(|value| text += &format!("{value:.4},"));
        text += &format!("{:.4},{:.4},{:.4}\n", stress / unit, low[k] / unit, high[k] / unit);
    }
    Ok(fs::write(output, text)?)
}

/// Runs left out together: those of each rate, and those beyond two stretches where there are several; the
/// second cycles where runs have two.
fn groups(runs: &[MeasuredRun]) -> Vec<Group> {
    let named = |keep: &dyn Fn(&MeasuredRun) -> bool| -> Vec<String> {
        runs.iter().filter(|run| keep(run)).map(|run| run.name.clone()).collect()
    };
    let rates = rates(runs);
    let counts = rates.len() > 2;
    let group = |name, names| Group { name, left: Left::Runs(names), counts };
    let mut groups: Vec<Group> =
        rates.iter().map(|rate| group(format!("{rate} /s"), named(&|run| run.rate == *rate))).collect();
    let most = |run: &MeasuredRun| run.points().iter().map(|point| point.strain).fold(1.0, f64::max);
    for limit in [2.1, 2.6] {
        let beyond = named(&|run| most(run) > limit);
        if !beyond.is_empty() {
            groups.push(group(format!("stretches above {limit}"), beyond));
        }
    }
    if !counts {
        // 1, 2, 0.75, 1
        groups.push(Group { name: "second cycles".to_owned(), left: Left::Later(2.5), counts: true });
        let left = Left::Between { rate: 8.6e-3, path: 2.5 };
        groups.push(Group { name: "any between 0.00107 and 0.08333 /s".to_owned(), left, counts: true });
    }
    groups
}

fn candidate(
    name: String,
    form: &Form,
    runs: &[MeasuredRun],
    groups: &[Group],
    settings: &FitSettings,
) -> Outcome<Candidate> {
    let found = fit(form, runs, settings)?;
    let warm = FitSettings { starts: 1, first: Some(found.values()), ..settings.clone() };
    let mut left = Vec::new();
    for group in groups {
        left.push(match &group.left {
            Left::Runs(names) => {
                leave_out(form, runs, |run| names.contains(&run.name), &warm, &|| false)?.pooled.rms
            }
            Left::Later(path) => later(form, runs, *path, &warm)?,
            Left::Between { rate, path } => between(&found.law()?, runs, *rate, *path)?,
        });
    }
    let counted: Vec<f64> =
        groups.iter().zip(&left).filter(|(group, _)| group.counts).map(|(_, rms)| *rms).collect();
    let score = counted.iter().sum::<f64>() / counted.len() as f64;
    Ok(Candidate { name, fit: found, left, score })
}

/// Root mean square of what follows a path of strain, from a fit to what precedes it, Pa.
fn later(form: &Form, runs: &[MeasuredRun], path: f64, settings: &FitSettings) -> Outcome<f64> {
    let end = |run: &MeasuredRun| path / run.rate;
    let early = runs.iter().map(|run| {
        let points = run.points().iter().filter(|point| point.time <= end(run)).copied().collect();
        MeasuredRun::new(&run.name, run.rate, run.test, points)
    });
    let law = fit(form, &early.collect::<Result<Vec<_>, _>>()?, settings)?.law()?;
    let (mut sum, mut count) = (0.0, 0);
    for run in runs {
        let found = run.stresses(&law, settings.pace)?;
        for (point, stress) in run.points().iter().zip(found).filter(|(point, _)| point.time > end(run)) {
            (sum, count) = (sum + (stress - point.nominal).powi(2), count + 1);
        }
    }
    Ok((sum / f64::from(count)).sqrt())
}

/// Root mean square of a law minus the interpolation between the slowest and the fastest run, Pa.
fn between(law: &Viscoelastic, runs: &[MeasuredRun], rate: f64, path: f64) -> Outcome<f64> {
    let (slow, fast) = (&runs[0], &runs[runs.len() - 1]);
    let share = (rate / slow.rate).ln() / (fast.rate / slow.rate).ln();
    // strain and stress of a run after a path
    let at = |run: &MeasuredRun, path: f64| -> [f64; 2] {
        let (points, time) = (run.points(), path / run.rate);
        let after = points.partition_point(|point| point.time < time).clamp(1, points.len() - 1);
        let [a, b] = [points[after - 1], points[after]];
        let part = (time - a.time) / (b.time - a.time);
        [a.strain + part * (b.strain - a.strain), a.nominal + part * (b.nominal - a.nominal)]
    };
    let mixed = |path: f64| {
        let [slow, fast] = [at(slow, path), at(fast, path)];
        [0, 1].map(|i| slow[i] + share * (fast[i] - slow[i]))
    };
    let point = |k: u32| {
        let path = path * f64::from(k) / 100.0;
        let [strain, nominal] = mixed(path);
        Measurement { time: path / rate, strain, nominal }
    };
    let run = MeasuredRun::new("between", rate, Test::Uniaxial, (1..=100).map(point).collect())?;
    Ok(run.agreement(law, FINE)?.rms)
}

fn report(best: &Candidate, runs: &[MeasuredRun]) {
    let fit = &best.fit;
    println!("\nchosen: {}", best.name);
    for found in &fit.constants {
        let (constant, value) = (&found.constant, found.value);
        let interval = match (found.interval, constant.fixed) {
            (Some([low, high]), _) => format!("{low:.4e} to {high:.4e}"),
            (None, Some((_, reason))) => format!("fixed: {reason}"),
            (None, None) => "not determined".to_owned(),
        };
        println!("{} = {value:.6e} {}; {interval}", constant.name, constant.unit);
    }
    println!("singular values {:.3?}", fit.singular_values);
    for (run, agreement) in runs.iter().zip(&fit.runs) {
        println!("{}: rms {:.3} kPa, R2 {:.4}", run.name, agreement.rms / 1e3, agreement.r2.unwrap_or(0.0));
    }
    println!("all: rms {:.3} kPa, R2 {:.4}", fit.pooled.rms / 1e3, fit.pooled.r2.unwrap_or(0.0));
}
