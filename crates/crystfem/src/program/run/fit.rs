//! Fits to measurements: constants with intervals, tables and pictures.

use super::{fit_part, heat_flow};
use crate::error::Error;
use crate::fit::{FixedConstants, ForecastRow, KineticFit, MeasuredPeak, avrami, forecast, nakamura, ozawa};
use crate::program::observe::celsius::{CELSIUS, to_celsius};
use crate::program::quantities as q;
use crate::program::scene::{FitLaw, FitScene, FitSpec, Job};
use harness::case::Finished;
use harness::output::csv;
use harness::output::picture::{LinePlot, Series};
use harness::report::{Phases, Quantity, Report};
use harness::scene::{Failure, SceneError, Source};
use polycore::file::atomic_write;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

/// A finished fit, with the abscissae of its measurements for each series.
struct FinishedFit {
    name: String,
    fit: KineticFit,
    abscissa: (&'static str, &'static str),
    series: Vec<(String, Vec<f64>, Vec<f64>)>,
    /// Prescribed constants of the kinetics, for `nakamura`.
    known: Option<FixedConstants>,
    /// Predicted coolings: rate, K/s, and rows.
    predicted: Vec<(f64, Vec<ForecastRow>)>,
}

impl FinishedFit {
    /// Returns the fitted kinetics as a key of a material block.
    fn block(&self) -> Option<String> {
        let FixedConstants { equilibrium_melting, frozen, activation_energy } = self.known?;
        let estimate = |name: &str| self.fit.get(name).map(|estimate| estimate.value);
        let [rate, nucleation, n] = ["growth_rate", "nucleation", "avrami_exponent"].map(estimate);
        Some(format!(
            "kinetics = {{ growth_rate = \"{:.6e} 1/s\", nucleation = \"{:.6e} K^2\", activation_energy = \
             \"{activation_energy} J/mol\", equilibrium_melting = \"{equilibrium_melting} K\", frozen = \
             \"{frozen} K\", avrami_exponent = {:.5} }}\n",
            rate?, nucleation?, n?
        ))
    }
}

/// Runs every fit.
pub fn run(
    source: &Source,
    scene: &FitScene,
    run: &mut harness::case::Run,
) -> Result<Finished, Failure<Error>> {
    let (output, quick) = (run.options.output, run.options.quick);
    let jobs = scene.jobs(source)?;
    run.begin()?;
    let mut report = Report::new("crystfem", env!("CARGO_PKG_VERSION"), &source.text);
    let mut phases = Phases::new();
    let mut done = Vec::new();
    for (index, (spec, (job, peaks))) in scene.fit.iter().zip(jobs).enumerate() {
        phases.start("fit");
        let fits = solve(spec, job, run);
        // data that do not determine the constants are an error of the scene, at their key
        let fits = fits.map_err(|failure| match failure {
            Failure::Run(Error::Data { what, reason }) => {
                let single = spec.law == FitLaw::Nakamura && spec.data.len() == 1;
                let hint = if single {
                    "; one cooling rate cannot separate K0 from K_G: add runs at other rates"
                } else {
                    ""
                };
                source.refused(&format!("fit[{index}].data"), format!("{what}: {reason}{hint}")).into()
            }
            other => other,
        })?;
        done.extend(fits);
        heat_flow::record(&mut report, spec, &peaks);
        heat_flow::write(output, spec, &peaks, scene.output.pictures)?;
    }
    phases.start("write");
    for fit in &done {
        record(&mut report, fit);
        write(output, fit)?;
        write_draws(output, fit)?;
        write_predictions(output, fit)?;
        if scene.output.pictures {
            draw(output, fit)?;
        }
    }
    write_estimates(output, &done)?;
    phases.stop();
    report.phases(&phases).threads(1).judge(&scene.expect, quick);
    let mut notes = String::new();
    for (fit, block) in done.iter().filter_map(|fit| Some((fit, fit.block()?))) {
        let path = output.join(format!("{}_kinetics.toml", fit.name));
        atomic_write(&path, |file| file.write_all(block.as_bytes()))?;
        notes += &format!("for the material block of a scene, {}:\n  {block}", path.display());
    }
    let text = report.table() + &notes;
    Ok(Finished::new(report, text).with_notes(&notes))
}

/// Describes the fits of a scene, line by line.
///
/// # Errors
/// Returns an error for an invalid scene or invalid data.
pub fn explain(source: &Source, scene: &FitScene) -> Result<Vec<String>, SceneError> {
    let jobs = scene.jobs(source)?;
    let line = |(spec, (job, peaks)): (&FitSpec, &(Job, Vec<MeasuredPeak>))| {
        let what = match job {
            Job::Avrami(times, _) => format!("k and n from {} measurements", times.len()),
            Job::Ozawa(coolings, temperatures) => {
                format!(
                    "m and χ at {} temperatures from {} cooling rates",
                    temperatures.len(),
                    coolings.len()
                )
            }
            Job::Nakamura(runs, _) => {
                let rows: usize = runs.iter().map(|run| run.degrees.len()).sum();
                format!("K0, K_G and n from {rows} measurements in {} runs", runs.len())
            }
            Job::Part(part) => {
                let (rows, file) = (part.degrees().len(), part.source.path.display());
                format!("K0 and K_G from {rows} measurements; each trial runs {file}")
            }
        };
        let heat = |found: &MeasuredPeak| format!("{:.4} J/g", found.peak.enthalpy / 1e3);
        let heats: Vec<String> = peaks.iter().map(heat).collect();
        let peaks = if heats.is_empty() { String::new() } else { format!("; peaks of {}", heats.join(", ")) };
        format!("fit {}: {:?}, {what}{peaks}", spec.name, spec.law)
    };
    Ok(describe_tables(source, scene).chain(scene.fit.iter().zip(&jobs).map(line)).collect())
}

/// Describes how each table of a scene was read, a line per table.
pub fn describe_tables<'a>(source: &'a Source, scene: &'a FitScene) -> impl Iterator<Item = String> + 'a {
    let tables = scene.fit.iter().flat_map(|spec| &spec.data);
    tables.filter_map(|data| crate::table::describe_format(&source.file(&data.file)))
}

fn solve(spec: &FitSpec, job: Job, run: &mut harness::case::Run) -> Result<Vec<FinishedFit>, Failure<Error>> {
    let name = &spec.name;
    match job {
        Job::Avrami(times, degrees) => {
            let fit = avrami(&times, &degrees)?;
            let series = vec![("measured".to_owned(), times, degrees)];
            Ok(vec![FinishedFit {
                name: name.clone(),
                fit,
                abscissa: ("time", "s"),
                series,
                known: None,
                predicted: Vec::new(),
            }])
        }
        Job::Nakamura(runs, known) => {
            let fit = nakamura(&runs, &known)?;
            let rates = spec.data.iter().filter_map(|data| Some(data.rate?.si()));
            let measured: Vec<_> = rates.zip(&runs).collect();
            let predict = |rate: f64| Ok((rate, forecast(&measured, &known, &fit, rate)?));
            let predicted =
                spec.predict.iter().map(|rate| predict(rate.si())).collect::<Result<_, Error>>()?;
            let series = runs
                .into_iter()
                .zip(&spec.data)
                .map(|(run, data)| (stem(&data.file), to_celsius(&run.temperatures), run.degrees))
                .collect();
            Ok(vec![FinishedFit {
                name: name.clone(),
                fit,
                abscissa: ("temperature", "degC"),
                series,
                known: Some(known),
                predicted,
            }])
        }
        Job::Part(part) => {
            let mut show = |trial: usize| {
                run.show(0.0, &|| format!("fit {name}  trial {trial}"));
                if (run.options.interrupted)() { Err(run.interruption()) } else { Ok(()) }
            };
            let fit = fit_part::solve(&part, &mut show)?;
            let curves = part.curves.into_iter().zip(&spec.data);
            let series =
                curves.map(|((_, times, degrees), data)| (stem(&data.file), times, degrees)).collect();
            Ok(vec![FinishedFit {
                name: name.clone(),
                fit,
                abscissa: ("time", "s"),
                series,
                known: None,
                predicted: Vec::new(),
            }])
        }
        Job::Ozawa(coolings, temperatures) => {
            let mut all = Vec::new();
            for temperature in temperatures {
                let fit = ozawa(&coolings, temperature)?;
                let (rates, degrees) = crate::fit::rates_at(&coolings, temperature);
                let rates: Vec<f64> = rates.iter().map(|q| q * 60.0).collect();
                let name = format!("{name}.{}_degC", ((temperature - CELSIUS) * 100.0).round() / 100.0);
                let series = vec![("measured".to_owned(), rates, degrees)];
                all.push(FinishedFit {
                    name,
                    fit,
                    abscissa: ("cooling_rate", "K/min"),
                    series,
                    known: None,
                    predicted: Vec::new(),
                });
            }
            Ok(all)
        }
    }
}

/// Returns the name of a file without folder and extension.
pub(super) fn stem(file: &Path) -> String {
    file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn record(report: &mut Report, done: &FinishedFit) {
    let FinishedFit { name, fit, .. } = done;
    for estimate in &fit.estimates {
        let value = |quantity: Quantity| quantity.named(&[name, estimate.name]).in_unit(&estimate.unit);
        report.value(value(q::CONSTANT), estimate.value);
        report.value(value(q::STANDARD_ERROR), estimate.standard_error);
        report.value(value(q::LOWER), estimate.interval[0]);
        report.value(value(q::UPPER), estimate.interval[1]);
    }
    report.value(q::FIT_RMS.named(&[name]), fit.rms);
    for (number, (_, rows)) in done.predicted.iter().enumerate() {
        for row in rows {
            let keys = [&name[..], &(number + 1).to_string(), &row.share.to_string()];
            report.value(q::PREDICTED.named(&keys), row.temperature - CELSIUS);
        }
    }
    report.work(&format!("{name}.measurements"), fit.measurements as u64);
    report.work(&format!("{name}.evaluations"), fit.evaluations as u64);
}

/// Writes estimates.csv: one row per constant.
fn write_estimates(output: &Path, all: &[FinishedFit]) -> Result<(), polycore::Error> {
    let mut text = String::from("fit,constant,value,standard_error,lower_95,upper_95,unit\n");
    for FinishedFit { name, fit, .. } in all {
        for e in &fit.estimates {
            let [lower, upper] = e.interval;
            let numbers = format!("{:?},{:?},{lower:?},{upper:?}", e.value, e.standard_error);
            let _ = writeln!(text, "{name},{},{numbers},{}", e.name, e.unit);
        }
    }
    atomic_write(output.join("estimates.csv"), |file| file.write_all(text.as_bytes()))
}

/// Writes NAME.csv: measurements and model.
fn write(output: &Path, done: &FinishedFit) -> Result<(), polycore::Error> {
    let mut columns = [Vec::new(), Vec::new(), Vec::new()];
    for (index, (_, x, data)) in done.series.iter().enumerate() {
        columns[0].extend(std::iter::repeat_n((index + 1) as f64, x.len()));
        columns[1].extend(x);
        columns[2].extend(data);
    }
    let [run, x, data] = &columns;
    let (name, unit) = done.abscissa;
    let columns: [csv::Column; 4] =
        [("run", "", run), (name, unit, x), ("alpha", "", data), ("alpha_model", "", &done.fit.model)];
    csv::write(output.join(format!("{}.csv", done.name)), &columns)
}

/// Writes NAME_posterior.csv: draws of the constants, for `sweep --sample`.
fn write_draws(output: &Path, done: &FinishedFit) -> Result<(), polycore::Error> {
    let fit = &done.fit;
    if fit.draws.is_empty() {
        return Ok(());
    }
    let lists: Vec<Vec<f64>> =
        (0..fit.estimates.len()).map(|i| fit.draws.iter().map(|draw| draw[i]).collect()).collect();
    let columns: Vec<csv::Column> = fit
        .estimates
        .iter()
        .zip(&lists)
        .map(|(estimate, list)| (estimate.name, estimate.unit.as_str(), &list[..]))
        .collect();
    csv::write(output.join(format!("{}_posterior.csv", done.name)), &columns)
}

/// Writes NAME_prediction.csv: temperatures at which shares of α are reached at the predicted rates.
fn write_predictions(output: &Path, done: &FinishedFit) -> Result<(), polycore::Error> {
    if done.predicted.is_empty() {
        return Ok(());
    }
    let column = |value: &dyn Fn(f64, &ForecastRow) -> f64| -> Vec<f64> {
        let all = done.predicted.iter().flat_map(|(rate, rows)| rows.iter().map(move |row| (*rate, row)));
        all.map(|(rate, row)| value(rate, row)).collect()
    };
    let rate = column(&|rate, _| rate * 60.0);
    let share = column(&|_, row| row.share);
    let temperature = column(&|_, row| row.temperature - CELSIUS);
    let [lower, upper] = [0, 1].map(|end| column(&|_, row| row.band[end] - CELSIUS));
    let law = column(&|_, row| row.law - CELSIUS);
    let columns: [csv::Column; 6] = [
        ("cooling_rate", "K/min", &rate),
        ("alpha", "", &share),
        ("temperature", "degC", &temperature),
        ("lower_95", "degC", &lower),
        ("upper_95", "degC", &upper),
        ("law_alone", "degC", &law),
    ];
    csv::write(output.join(format!("{}_prediction.csv", done.name)), &columns)
}

/// Markers of a run at most: more hide the model.
const MARKERS: usize = 200;

/// Draws NAME.png: measurements as markers, evenly picked, the model as a dashed line.
fn draw(output: &Path, done: &FinishedFit) -> Result<(), polycore::Error> {
    let unit = done.abscissa.1.replace("degC", "°C");
    let axis = format!("{} ({unit})", done.abscissa.0.replace('_', " "));
    let mut plot = LinePlot::new(&done.name).axes(&axis, "relative crystallinity α").size(800.0, 460.0);
    let (mut row, mut curve) = (0, [Vec::new(), Vec::new()]);
    for (name, x, data) in &done.series {
        let model = &done.fit.model[row..row + x.len()];
        row += x.len();
        let mut order: Vec<usize> = (0..x.len()).collect();
        order.sort_by(|&a, &b| x[a].total_cmp(&x[b]));
        for index in order {
            curve[0].push(x[index]);
            curve[1].push(model[index]);
        }
        // NaN separates the lines of the runs
        curve.iter_mut().for_each(|values| values.push(f64::NAN));
        let stride = x.len().div_ceil(MARKERS).max(1);
        let picked = |values: &[f64]| values.iter().step_by(stride).copied().collect::<Vec<f64>>();
        plot = plot.series(Series::markers(name, &picked(x), &picked(data)));
    }
    plot = plot.series(Series::reference("model", &curve[0], &curve[1]));
    plot.write(output.join(format!("{}.png", done.name)))
}
