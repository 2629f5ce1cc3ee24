//! Runs of scenes, as on the command lines.

use crate::error::failure;
use crate::watch::{RunLink, Watchers, left_alone, watched};
use crystfem::program::run::Crystfem;
use harness::case::{self, Case, Fault, Finished, Options, Part, Step, SweepOptions, Vary};
use harness::checkpoint::Header;
use harness::report::Report;
use harness::scene::{Failure, Source};
use peri::program::run::Peri;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Calls a function that is generic in the program.
macro_rules! of_program {
    ($program:expr, $function:ident($($argument:expr),*)) => {
        match $program {
            "peri" => $function::<Peri>($($argument),*),
            "crystfem" => $function::<Crystfem>($($argument),*),
            other => Err(PyValueError::new_err(format!("program: found {other:?}; allowed: \"peri\", \
                \"crystfem\""))),
        }
    };
}

/// Options of a run.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct RunOptions {
    output: PathBuf,
    quick: bool,
    checkpoint_every: f64,
    threads: Option<usize>,
    inputs: BTreeMap<String, PathBuf>,
    progress: Option<Py<PyAny>>,
    on_step: Option<Py<PyAny>>,
}

impl RunOptions {
    fn watchers(&mut self) -> Watchers {
        Watchers { progress: self.progress.take(), on_step: self.on_step.take() }
    }

    fn every(&self) -> PyResult<Duration> {
        Duration::try_from_secs_f64(self.checkpoint_every).map_err(crate::error::value)
    }
}

/// Runs a scene into a folder; returns the text of `report.json` and the terminal output.
#[pyfunction]
pub fn run(
    py: Python<'_>,
    program: &str,
    text: String,
    path: PathBuf,
    how: RunOptions,
) -> PyResult<(String, String)> {
    of_program!(program, run_of(py, Source::new(path, text), how, false))
}

/// Resumes a stopped run; for a finished run, returns its report.
#[pyfunction]
pub fn resume(py: Python<'_>, program: &str, how: RunOptions) -> PyResult<(String, String)> {
    of_program!(program, resume_of(py, how))
}

fn resume_of<C: Case>(py: Python<'_>, how: RunOptions) -> PyResult<(String, String)> {
    let output = &how.output;
    let there = |name: &str| output.join(name).is_file();
    if !there(harness::checkpoint::FILE_NAME) && there(harness::report::FILE_NAME) {
        let report =
            Report::read(output.join(harness::report::FILE_NAME)).map_err(|e| crate::error::file(&e))?;
        return describe(&report.clone().into());
    }
    let header = Header::read(output, C::PROGRAM.magic)
        .and_then(|header| header.check(output).map(|()| header))
        .map_err(|error| crate::error::fault(&error))?;
    let source = Source::new(header.scene_path, header.scene).with_inputs(header.stamp.inputs);
    let how = RunOptions { quick: header.quick, ..how };
    run_of::<C>(py, source, how, true)
}

fn run_of<C: Case>(
    py: Python<'_>,
    source: Source,
    mut how: RunOptions,
    resume: bool,
) -> PyResult<(String, String)> {
    let (watchers, every) = (how.watchers(), how.every()?);
    let RunOptions { output, quick, threads, inputs, .. } = &how;
    let finished = watched(py, &watchers, *threads, |line| {
        let source = match resume {
            true => source,
            false => case::attached::<C::Error>(source, output, *quick, inputs, false)?,
        };
        run_with::<C>(&source, output, (*quick, resume, every), line)
    })?;
    describe(&finished.map_err(|error| failure(py, error, output))?)
}

fn run_with<C: Case>(
    source: &Source,
    output: &Path,
    (quick, resume, checkpoint_every): (bool, bool, Duration),
    mut line: RunLink<'_>,
) -> Result<Finished, Failure<C::Error>> {
    let stop = line.stop();
    let steps = line.steps();
    let mut on_step = |step: Step| steps.step(step);
    let mut progress = |part: f64, text: &dyn Fn() -> String| line.progress(part, text);
    let options = Options {
        quick,
        resume,
        checkpoint_every,
        interrupted: &|| stop.load(Ordering::Relaxed),
        progress: Some(&mut progress),
        on_step: if steps.wants_steps() { Some(&mut on_step) } else { None },
        ..Options::new(output)
    };
    case::run::<C>(source, options)
}

fn describe(finished: &Finished) -> PyResult<(String, String)> {
    let report = serde_json::to_string(&finished.report).map_err(crate::error::value)?;
    Ok((report, finished.text.clone()))
}

/// Describes in lines what a scene builds and what it omits.
#[pyfunction]
pub fn check(
    py: Python<'_>,
    program: &str,
    text: String,
    path: PathBuf,
    how: RunOptions,
) -> PyResult<Vec<String>> {
    of_program!(program, check_of(py, Source::new(path, text), how))
}

fn check_of<C: Case>(py: Python<'_>, source: Source, how: RunOptions) -> PyResult<Vec<String>> {
    let RunOptions { output, quick, inputs, .. } = how;
    let place = output.clone();
    // a check writes nothing
    let lines = left_alone(py, move || {
        let source = case::attached::<C::Error>(source, &place, quick, &inputs, false)?;
        C::explain(&source, quick)
    })?;
    lines.map_err(|error| failure(py, error, &output))
}

/// Runs a scene once for every combination of values; arguments and errors are those of [`run`].
#[pyfunction]
pub fn sweep(
    py: Python<'_>,
    program: &str,
    text: String,
    path: PathBuf,
    vary: Vec<(String, Vec<String>)>,
    columns: Vec<String>,
    how: RunOptions,
) -> PyResult<(String, String)> {
    let vary: Vec<Vary> = vary.into_iter().map(|(key, values)| Vary { key, values, drawn: false }).collect();
    of_program!(program, sweep_of(py, Source::new(path, text), vary, columns, how))
}

fn sweep_of<C: Case>(
    py: Python<'_>,
    source: Source,
    vary: Vec<Vary>,
    columns: Vec<String>,
    mut how: RunOptions,
) -> PyResult<(String, String)> {
    let (watchers, checkpoint_every) = (how.watchers(), how.every()?);
    let RunOptions { output, quick, threads, inputs, .. } = &how;
    let finished = watched(py, &watchers, *threads, |mut line: RunLink<'_>| {
        let source = case::attached::<C::Error>(source, output, *quick, inputs, false)?;
        let stop = line.stop();
        let interrupted = &|| stop.load(Ordering::Relaxed);
        let mut progress = |done: usize, all: usize, last: &str| {
            line.progress(done as f64 / all as f64, &|| {
                format!("{done} of {all} runs are done, last {last}")
            });
        };
        let mut options = SweepOptions {
            output,
            columns: &columns,
            quick: *quick,
            part: Part::Whole,
            checkpoint_every,
            interrupted,
            progress: &mut progress,
        };
        case::sweep::<C>(&source, &vary, &mut options)
    })?;
    describe(&finished.map_err(|error| failure(py, error, output))?)
}

/// Returns the JSON Schema of a program's scenes.
#[pyfunction]
pub fn schema(program: &str) -> PyResult<String> {
    fn schema_of<C: Case>() -> PyResult<String>
    where
        C::Error: Fault,
    {
        Ok(C::schema().to_string())
    }
    of_program!(program, schema_of())
}

/// Creates the page of a run in a folder, as HTML.
#[pyfunction]
pub fn view(py: Python<'_>, folder: PathBuf) -> PyResult<String> {
    py.detach(|| harness::view::view(folder)).map_err(|error| crate::error::file(&error))
}
