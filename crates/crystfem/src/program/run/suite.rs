//! Studies of a scene: each runs in its own folder; all are compared and judged together.

use super::part;
use crate::error::Error;
use crate::program::observe::observers;
use crate::program::quantities as q;
use crate::program::scene::{NAMING, PartScene};
use harness::case::{Fault, Finished, Row, Rows, Run};
use harness::output::csv;
use harness::output::picture::{LinePlot, Series};
use harness::report::{Named, Phases, Report, Trial, Value};
use harness::scene::{Failure, SceneError, Source};
use harness::study::{self, SuiteRow, Variant};
use polycore::file::atomic_write;
use std::collections::BTreeMap;
use std::path::Path;

/// Largest number of drawn points per curve.
const POINTS: usize = 4000;

/// Runs all studies, or resumes with the remaining ones.
pub fn run(source: &Source, scene: &PartScene, run: &mut Run) -> Result<Finished, Failure<Error>> {
    let (output, quick) = (run.options.output, run.options.quick);
    let studies = scene.variants(source, quick)?;
    // build every problem before anything is computed or written, so that errors appear at once
    if run.options.resume {
        run.begin()?;
    } else {
        let mut names = Vec::new();
        for study in studies.iter().filter(|study| study.expect_error.is_none()) {
            let scene = PartScene::from_variant(study)?;
            let task = scene.task(&study.source, scene.mesh.build(&study.source)?)?;
            names.extend(prefix_names(&study.name, observers(&scene, &task).names()));
        }
        check_expectations(source, scene, &studies, names)?;
        run.begin()?;
        // results of an earlier run must not pass for this one
        for study in &studies {
            drop(harness::case::prepare_run(output.join(&study.name))?);
        }
    }
    let names: Vec<String> = studies.iter().map(|study| study.name.clone()).collect();
    let refusals = study::solve(run, NAMING, &names, 1, |index, own| {
        let Variant { name, source, expect_error, .. } = &studies[index];
        let outcome = PartScene::from_variant(&studies[index]).map_err(Failure::from).and_then(|scene| {
            let report = part::run_scene(source, &scene, true, own)?;
            Ok(own.finish(&report)?)
        });
        match study::expected(outcome, expect_error.as_deref()) {
            Err(Failure::Run(error)) if !error.is_interruption() => {
                Err(Error::Study { name: name.clone(), error: Box::new(error) }.into())
            }
            outcome => outcome.map(Result::err),
        }
    })?;
    let row = |(name, refusal): (&String, Option<String>)| {
        let outcome = match refusal {
            Some(refusal) => Err(refusal),
            None => Ok(Report::read(output.join(name).join(harness::report::FILE_NAME))?),
        };
        Ok(Row { name: name.clone(), settings: Vec::new(), outcome })
    };
    let rows = names.iter().zip(refusals).map(row).collect::<Result<_, polycore::Error>>()?;
    let rows = Rows { settings: Vec::new(), columns: Vec::new(), rows };
    let mut report = together(source, scene, &studies, &rows);
    let mut phases = Phases::new();
    phases.start("write");
    rows.write(&output.join("studies.csv"))?;
    if scene.output.pictures {
        phases.start("draw");
        compare(scene, &rows, output)?;
    }
    phases.stop();
    report.phases(&phases).threads(rayon::current_num_threads()).judge(&scene.expect, quick);
    // a study that must fail, but does not, fails the scene even without an expectation
    let mut survivors = String::new();
    for study in studies.iter().filter(|study| study.expect_error.is_some()) {
        if report.scalar(&q::FAILED_AS_EXPECTED.named(&[&study.name]).name) == Some(0.0) {
            report.passed = false;
            survivors += &format!("FAIL  study {} succeeded, but must fail\n", study.name);
        }
    }
    table(&report, &studies, &rows, output)?;
    let notes = survivors + &part::warnings(&report);
    let text = rows.text() + &report.verdict() + &notes;
    Ok(Finished::new(report, text).with_notes(&notes))
}

fn prefix_names(study: &str, quantities: Vec<Named>) -> impl Iterator<Item = Named> {
    let prefixed = move |quantity: Named| Named { name: NAMING.value(study, &quantity.name), ..quantity };
    quantities.into_iter().map(prefixed)
}

/// Refuses expectations of quantities that neither the studies (`names`) nor their comparisons report.
fn check_expectations(
    source: &Source,
    scene: &PartScene,
    studies: &[Variant],
    mut names: Vec<Named>,
) -> Result<(), SceneError> {
    let failing = studies.iter().filter(|study| study.expect_error.is_some());
    names.extend(failing.map(|study| q::FAILED_AS_EXPECTED.named(&[&study.name])));
    names.extend(scene.comparisons().names());
    let all = scene.variants(source, false)?;
    let absent: Vec<&str> = all.iter().map(|study| study.name.as_str()).collect();
    let is_absent = |name: &&str| !studies.iter().any(|study| study.name == *name);
    scene.check_expectations(source, &names, &absent.into_iter().filter(is_absent).collect::<Vec<_>>())
}

/// Collects all values, prefixed by the name of their study.
fn together(source: &Source, scene: &PartScene, studies: &[Variant], rows: &Rows) -> Report {
    let mut report = Report::new("crystfem", env!("CARGO_PKG_VERSION"), &source.text);
    for (study, Row { name, outcome, .. }) in studies.iter().zip(&rows.rows) {
        if study.expect_error.is_some() {
            report.value(q::FAILED_AS_EXPECTED.named(&[name]), f64::from(u8::from(outcome.is_err())));
        }
        let Ok(own) = outcome else { continue };
        for (key, value) in &own.values {
            if let Value::Scalar { value, unit } = value {
                report.value(Named { name: NAMING.value(name, key), unit: unit.clone() }, *value);
            }
        }
        for (key, count) in &own.work {
            report.work(&NAMING.value(name, key), *count);
        }
        for (phase, seconds) in &own.seconds {
            report.seconds(phase, *seconds);
        }
    }
    scene.comparisons().add(&mut report, &rows.rows);
    report
}

/// Writes suite.md and suite.json: expected and observed behaviour and cost of each study.
fn table(report: &Report, studies: &[Variant], rows: &Rows, output: &Path) -> Result<(), polycore::Error> {
    let observed = |own: &Report| {
        let value = |name: &str| own.scalar(name).unwrap_or(f64::NAN);
        let [low, high] = [value("least_temperature"), value("largest_temperature")];
        let mut observed = format!("ends at {low:.3} to {high:.3} °C");
        if let [Some(low), Some(high)] = ["least_alpha", "largest_alpha"].map(|name| own.scalar(name)) {
            observed += &format!(", α {low:.4} to {high:.4}");
        }
        observed + &format!("; energy balance {:.0e}", value("worst_balance"))
    };
    let rows = studies.iter().zip(&rows.rows).map(|(study, Row { name, outcome, .. })| {
        let own = outcome.as_ref().ok();
        SuiteRow {
            name,
            description: study.description.as_deref(),
            observed: outcome.as_ref().map(observed).map_err(String::as_str),
            count: own.and_then(|own| own.work.get("steps")).copied().unwrap_or(0),
            seconds: own.and_then(|own| own.seconds.get("solve")).copied().unwrap_or(0.0),
        }
    });
    let suite: Vec<SuiteRow> = rows.collect();
    let trials = study::suite(report, NAMING, "steps", &suite, output)?;
    if trials.is_empty() {
        return Ok(());
    }
    let json = |(Trial { what, description, observed, iterations, passed }, row): (&Trial, &SuiteRow)| {
        let seconds = row.seconds;
        serde_json::json!({
             "case": what, "description": description, "observed": observed, "pass": passed,
                        "steps": iterations, "seconds": seconds,
        })
    };
    let list: Vec<serde_json::Value> = trials.iter().zip(&suite).map(json).collect();
    atomic_write(output.join("suite.json"), |file| Ok(serde_json::to_writer_pretty(file, &list)?))
}

/// Draws probe_NAME_QUANTITY.png: records of the probes with this name in all studies.
fn compare(scene: &PartScene, rows: &Rows, output: &Path) -> Result<(), polycore::Error> {
    /// Curves by probe name and column heading.
    type Curves = BTreeMap<(String, String), Vec<Series>>;
    let mut curves = Curves::new();
    for row in rows.rows.iter().filter(|row| row.outcome.is_ok()) {
        // a study may have its own probes
        let folder = output.join(&row.name);
        let entries = std::fs::read_dir(&folder).map_err(polycore::Error::from_io("read", &folder))?;
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

/// Describes each study, line by line.
///
/// # Errors
/// Returns an error for an invalid scene.
pub fn explain(source: &Source, scene: &PartScene, quick: bool) -> Result<Vec<String>, Failure<Error>> {
    let (mut lines, mut names) = (Vec::new(), Vec::new());
    let studies = scene.variants(source, quick)?;
    for study in &studies {
        lines.push(format!("study {}", study.name));
        if let Some(error) = &study.expect_error {
            lines.push(format!("  expects    an error that contains `{error}`"));
            continue;
        }
        let (own, quantities) =
            super::explain::explain_scene(&study.source, &PartScene::from_variant(study)?)?;
        names.extend(prefix_names(&study.name, quantities));
        lines.extend(own.iter().map(|line| format!("  {line}")));
    }
    check_expectations(source, scene, &studies, names)?;
    Ok(lines)
}
