//! The studies of a scene: each in a folder of its own, compared and judged together.

use super::{Crystfem, Failure, part};
use crate::error::Error;
use crate::program::observe::observers;
use crate::program::quantities as q;
use crate::program::scene::PartScene;
use harness::case::{Case, Fault, Finished, Options, Row, Rows, Run};
use harness::output::csv;
use harness::output::picture::{LinePlot, Series};
use harness::report::{Named, Phases, Report, Value};
use harness::scene::Source;
use polycore::file::atomic_write;
use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::Path;

/// Points of a curve that are drawn at most.
const POINTS: usize = 4000;

/// Runs every study, or resumes with the remaining ones.
pub fn run(source: &Source, scene: &PartScene, run: &mut Run) -> Result<Finished, Failure> {
    let (output, quick) = (run.options.output, run.options.quick);
    let studies = scene.studies(source, quick)?;
    // every problem is built once before anything is computed or written: faults show at once
    if run.options.resume {
        run.begin()?;
    } else {
        let mut names = scene.quantities_of_studies();
        for &index in &studies {
            let study = &scene.study[index];
            if study.expect_error.is_none() {
                let (source, scene) = scene.of_study(source, index)?;
                let task = scene.task(&source, scene.mesh.build(&source)?)?;
                names.extend(of_study(&study.name, observers(&scene, &task).names()));
            }
        }
        scene.check_expectations(source, &names, &left_out(scene, &studies))?;
        run.begin()?;
        for &index in &studies {
            // each run takes its own when it begins
            drop(harness::case::prepare_run(output.join(&scene.study[index].name))?);
        }
    }
    let mut rows = Rows { settings: Vec::new(), columns: Vec::new(), rows: Vec::new() };
    for (place, &index) in studies.iter().enumerate() {
        let name = scene.study[index].name.clone();
        let outcome = study(source, scene, index, [place, studies.len()], run)?;
        rows.rows.push(Row { name, settings: Vec::new(), outcome });
    }
    let mut report = together(source, scene, &rows);
    let mut phases = Phases::new();
    phases.start("write");
    rows.write(&output.join("studies.csv"))?;
    if scene.output.pictures {
        phases.start("draw");
        compare(scene, &rows, output)?;
    }
    phases.stop();
    report.phases(&phases).threads(rayon::current_num_threads()).judge(&scene.expect, quick);
    // of a study that must fail and does not there need be no expectation
    let mut survivors = String::new();
    for study in scene.study.iter().filter(|study| study.expect_error.is_some()) {
        if report.scalar(&q::FAILED_AS_EXPECTED.of(&[&study.name]).name) == Some(0.0) {
            report.passed = false;
            survivors += &format!("FAIL  study {} did not fail\n", study.name);
        }
    }
    table(&report, scene, &rows, output)?;
    let text = rows.text() + &report.verdict() + &survivors + &part::warnings(&report);
    Ok(Finished { report, text })
}

fn of_study(study: &str, quantities: Vec<Named>) -> impl Iterator<Item = Named> {
    let of = move |quantity: Named| Named { name: format!("{study}.{}", quantity.name), ..quantity };
    quantities.into_iter().map(of)
}

/// Studies that a quick run leaves out.
fn left_out<'a>(scene: &'a PartScene, studies: &[usize]) -> Vec<&'a str> {
    let absent = (0..scene.study.len()).filter(|index| !studies.contains(index));
    absent.map(|index| scene.study[index].name.as_str()).collect()
}

/// One study: its report, or the failure that the scene asks for.
fn study(
    source: &Source,
    scene: &PartScene,
    index: usize,
    [place, of]: [usize; 2],
    whole: &mut Run,
) -> Result<Result<Report, String>, Failure> {
    let spec = &scene.study[index];
    let output = &whole.options.output.join(&spec.name);
    if whole.options.resume
        && let Ok(report) = Report::read(output.join(harness::report::FILE_NAME))
    {
        return Ok(Ok(report));
    }
    let interruption = whole.interruption();
    let resume = whole.options.resume && output.join(harness::checkpoint::FILE_NAME).is_file();
    let Options { quick, checkpoint_every, interrupted, .. } = whole.options;
    let mut progress = |part: f64, line: &dyn Fn() -> String| {
        let line = || format!("run {} of {of}  {}", place + 1, line());
        whole.show((place as f64 + part) / of as f64, &line);
    };
    let progress = Some(&mut progress as _);
    let options = Options { quick, resume, checkpoint_every, interrupted, progress, ..Options::new(output) };
    let mut own = Run::new(const { &Crystfem::PROGRAM }, source, Some(&spec.name), options);
    let outcome = scene.of_study(source, index).map_err(Failure::from).and_then(|(source, scene)| {
        let report = part::one(&source, &scene, true, &mut own)?;
        own.finish(&report)?;
        Ok(report)
    });
    match (outcome, &spec.expect_error) {
        (Err(Failure::Run(error)), _) if error.is_interruption() => Err(interruption.into()),
        (Err(failure), Some(expected)) if failure.to_string().contains(expected.as_str()) => {
            Ok(Err(failure.to_string()))
        }
        (Err(Failure::Run(error)), _) => {
            Err(Error::Study { name: spec.name.clone(), error: Box::new(error) }.into())
        }
        (other, _) => other.map(Ok),
    }
}

/// All values, with the study's name before each.
fn together(source: &Source, scene: &PartScene, rows: &Rows) -> Report {
    let mut report = Report::new("crystfem", env!("CARGO_PKG_VERSION"), &source.text);
    for row in &rows.rows {
        let name = &row.name;
        if scene.study.iter().any(|study| study.name == *name && study.expect_error.is_some()) {
            let failed = f64::from(u8::from(row.outcome.is_err()));
            report.value(q::FAILED_AS_EXPECTED.of(&[name]), failed);
        }
        let Ok(own) = &row.outcome else { continue };
        for (key, value) in &own.values {
            if let Value::Scalar { value, unit } = value {
                report.value(Named { name: format!("{name}.{key}"), unit: unit.clone() }, *value);
            }
        }
        for (key, count) in &own.work {
            report.work(&format!("{name}.{key}"), *count);
        }
        for (phase, seconds) in &own.seconds {
            report.seconds(phase, *seconds);
        }
    }
    for spec in &scene.convergence {
        let of = |name: &String| {
            let own = rows.rows.iter().find(|row| row.name == *name)?.outcome.as_ref().ok()?;
            own.values.get(&spec.quantity).and_then(|value| match value {
                Value::Scalar { value, unit } => Some((*value, unit)),
                _ => None,
            })
        };
        let [Some((coarse, unit)), Some((middle, _)), Some((fine, _))] = spec.studies.each_ref().map(of)
        else {
            continue;
        };
        let [limit, order] = spec.limit_and_order([coarse, middle, fine]);
        report.value(q::LIMIT.of(&[&spec.name]).in_unit(unit), limit);
        // of equal values there is none
        if order.is_finite() {
            report.value(q::ORDER.of(&[&spec.name]), order);
        }
    }
    let of = |name: &String| rows.rows.iter().find(|row| row.name == *name)?.outcome.as_ref().ok();
    for spec in &scene.error_against_time {
        let truth = spec.truth.as_ref().and_then(of);
        let mut points = Vec::new();
        for study in &spec.studies {
            let Some(own) = of(study) else { continue };
            if let Some(error) = spec.error(own, truth) {
                report.value(q::ERROR_OF.of(&[&spec.name, study]), error);
                points.push((own.seconds.get("solve").copied().unwrap_or(f64::NAN), error));
            }
        }
        if points.is_empty() {
            continue;
        }
        let (seconds, errors): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
        let columns = [("seconds", "s", seconds), ("error", "", errors)];
        report.curve(&format!("error_against_time_{}", spec.name), &columns);
    }
    report
}

/// suite.md and suite.json: each study, its expected and observed behaviour, and its cost.
fn table(report: &Report, scene: &PartScene, rows: &Rows, output: &Path) -> Result<(), polycore::Error> {
    if scene.study.iter().all(|study| study.description.is_none()) {
        return Ok(());
    }
    let mut text = String::from("| case | expected | observed | steps | seconds |\n|---|---|---|---|---|\n");
    let mut list = Vec::new();
    for row in &rows.rows {
        let name = &row.name;
        let study = scene.study.iter().find(|study| study.name == *name);
        let description = study.and_then(|study| study.description.as_deref()).unwrap_or_default();
        let (held, missed) = report.verdict_on(|quantity| {
            quantity.strip_prefix(name.as_str()).is_some_and(|rest| rest.starts_with('.'))
        });
        let observed = match &row.outcome {
            Err(failure) => format!("refused: {}", failure.lines().next().unwrap_or_default()),
            Ok(_) if !missed.is_empty() => format!("missed: {}", missed.join(", ")),
            Ok(own) => {
                let value = |name: &str| own.scalar(name).unwrap_or(f64::NAN);
                let [low, high] = [value("least_temperature"), value("largest_temperature")];
                let mut observed = format!("ends at {low:.3} to {high:.3} °C");
                if let [Some(low), Some(high)] = ["least_alpha", "largest_alpha"].map(|name| own.scalar(name))
                {
                    observed += &format!(", α {low:.4} to {high:.4}");
                }
                observed
                    + &format!(
                        "; energy balance {:.0e}; {held} expectations satisfied",
                        value("worst_balance")
                    )
            }
        };
        let own = row.outcome.as_ref().ok();
        let steps = own.and_then(|own| own.work.get("steps")).copied().unwrap_or(0);
        let seconds = own.and_then(|own| own.seconds.get("solve")).copied().unwrap_or(0.0);
        text += &format!("| {name} | {description} | {observed} | {steps} | {seconds:.2} |\n");
        let pass = missed.is_empty();
        list.push(serde_json::json!({
            "case": name, "description": description, "observed": observed, "pass": pass, "steps": steps, "seconds": seconds,
        }));
    }
    atomic_write(output.join("suite.md"), |file| file.write_all(text.as_bytes()))?;
    atomic_write(output.join("suite.json"), |file| Ok(serde_json::to_writer_pretty(file, &list)?))
}

/// probe_NAME_QUANTITY.png: what a probe of the same name saw in each study.
fn compare(scene: &PartScene, rows: &Rows, output: &Path) -> Result<(), polycore::Error> {
    /// Curves by probe and heading.
    type Curves = BTreeMap<(String, String), Vec<Series>>;
    let mut curves = Curves::new();
    for row in rows.rows.iter().filter(|row| row.outcome.is_ok()) {
        // what is there, study by study: a study may have probes of its own
        let folder = output.join(&row.name);
        let entries = std::fs::read_dir(&folder).map_err(polycore::Error::io("read", &folder))?;
        let names = entries.flatten().filter_map(|entry| entry.file_name().into_string().ok());
        for file in names.filter(|name| name.starts_with("probe_") && name.ends_with(".csv")) {
            let columns = csv::read(folder.join(&file))?;
            let Some(((_, time), rest)) = columns.split_first().filter(|((_, t), _)| t.len() > 1) else {
                continue;
            };
            let every = time.len().div_ceil(POINTS);
            let thin = |list: &[f64]| -> Vec<f64> { list.iter().copied().step_by(every).collect() };
            let probe = file.trim_start_matches("probe_").trim_end_matches(".csv");
            for (heading, values) in rest.iter().filter(|(_, values)| values.iter().any(|x| x.is_finite())) {
                let series = Series::line(&row.name, &thin(time), &thin(values));
                curves.entry((probe.to_owned(), heading.clone())).or_default().push(series);
            }
        }
    }
    for ((probe, heading), series) in curves.into_iter().filter(|(_, series)| series.len() > 1) {
        let title =
            [scene.title.as_str(), &probe].iter().filter(|s| !s.is_empty()).copied().collect::<Vec<_>>();
        let plot = LinePlot::new(&title.join(", ")).axes("t [s]", &heading.replace("degC", "°C"));
        let plot = series.into_iter().fold(plot, LinePlot::series);
        let name = heading.split(' ').next().unwrap_or_default();
        plot.write(output.join(format!("probe_{probe}_{name}.png")))?;
    }
    Ok(())
}

/// What each study builds and leaves out.
///
/// # Errors
/// A fault of the scene.
pub fn explain(source: &Source, scene: &PartScene, quick: bool) -> Result<Vec<String>, Failure> {
    let (mut lines, mut names) = (Vec::new(), scene.quantities_of_studies());
    let studies = scene.studies(source, quick)?;
    for &index in &studies {
        let study = &scene.study[index];
        lines.push(format!("study {}", study.name));
        if let Some(error) = &study.expect_error {
            lines.push(format!("  expects    an error that contains `{error}`"));
            continue;
        }
        let (source, scene) = scene.of_study(source, index)?;
        let (own, quantities) = super::explain::one(&source, &scene)?;
        names.extend(of_study(&study.name, quantities));
        lines.extend(own.iter().map(|line| format!("  {line}")));
    }
    scene.check_expectations(source, &names, &left_out(scene, &studies))?;
    Ok(lines)
}
