//! The harness of the command lines: what a program is, and how one run, a resumed run and a sweep of it are
//! driven.
//!
//! A program implements [`Case`]: it reads a scene, says what it builds, and solves it. Everything around
//! that is here, once: command line, lock and checkpoint of the output directory, progress, interruption,
//! sweeps, the report.

mod cli;
mod folder;
mod inputs;
mod rows;
mod summary;
mod sweep;
pub mod terminal;

pub use cli::{RunArguments, main, solve};
pub use folder::{RunLock, lock_run, prepare_run, remove_unfinished, resume_run, share_run};
pub use inputs::{Input, InputState, attached, input_state, inputs};
pub(crate) use rows::matches_pattern;
pub(crate) use rows::natural;
pub use rows::{Row, Rows, STATISTICS, numeric};
pub(crate) use summary::{Names, main_names};
pub use sweep::{
    OF_SAMPLES, OF_SWEEPS, Part, Sample, Search, Shard, SweepOptions, Vary, drawn, job, search, sweep,
};

use crate::checkpoint::{self, Header, Magic};
use crate::report::{Expect, Quantity, Report};
use crate::scene::{Failure, SceneError, Source};
use polycore::Error;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;
use std::time::{Duration, Instant};

/// Time that an interrupted run may take to reach a state from which it can continue.
const PATIENCE: Duration = Duration::from_secs(5);

/// Name, help texts and checkpoint format of a program.
#[derive(Debug)]
pub struct Program {
    /// Name of the executable.
    pub name: &'static str,
    /// Version.
    pub version: &'static str,
    /// Description in one line.
    pub about: &'static str,
    /// Lines of examples.
    pub examples: &'static str,
    /// First bytes of its checkpoints: program and version of what they hold.
    pub magic: &'static Magic,
    /// Values that a sweep shows of each run, before the columns that the user names; `*` stands for any
    /// text.
    pub columns: &'static [&'static str],
}

/// A program of scenes.
pub trait Case {
    /// Name and help texts.
    const PROGRAM: Program;
    /// Error of a run.
    type Error: Fault;

    /// Returns lines that say what a scene builds and leaves out; `quick` skips what is marked `quick =
    /// false`.
    ///
    /// # Errors
    /// A fault of the scene.
    fn explain(source: &Source, quick: bool) -> Result<Vec<String>, Failure<Self::Error>>;

    /// Runs a scene. It calls [`Run::begin`] when the scene is known to be right, and [`Run::pause`] between
    /// its steps.
    ///
    /// # Errors
    /// [`Failure`].
    fn solve(source: &Source, run: &mut Run) -> Result<Finished, Failure<Self::Error>>;

    /// Keys of a scene that a sweep sets to `false`: what they name is large, and nobody looks at it run by
    /// run.
    fn large_outputs(_source: &Source) -> &'static [&'static str] {
        &[]
    }

    /// Returns the scene of one table, which lies in the scene's folder; `None` if the program has none.
    fn scene_of_table(_table: &Path) -> Option<String> {
        None
    }

    /// Returns the JSON Schema of its scenes.
    fn schema() -> serde_json::Value;
}

/// Refuses an expectation of a scalar that a program does not declare, where it cannot say which of them a
/// scene has.
///
/// # Errors
/// The name, and those that are most like it.
pub fn check_expectations(
    source: &Source,
    expectations: &[Expect],
    declared: &[&[Quantity]],
) -> Result<(), SceneError> {
    let known: Vec<&str> = declared.iter().flat_map(|list| *list).map(|quantity| quantity.name).collect();
    check_quantities(source, expectations, &known, |name| {
        declared.iter().flat_map(|list| *list).any(|quantity| matches_pattern(&quantity.pattern(), name))
    })
}

/// Refuses an expectation of a scalar that is not `known`; `is_known` may know more.
///
/// # Errors
/// As [`check_expectations`].
pub fn check_quantities(
    source: &Source,
    expectations: &[Expect],
    known: &[&str],
    is_known: impl Fn(&str) -> bool,
) -> Result<(), SceneError> {
    for (index, expect) in expectations.iter().enumerate() {
        if let Some(name) = expect.names().find(|name| !(known.contains(name) || is_known(name))) {
            return Err(source.unknown(&format!("expect[{index}].quantity"), name, known));
        }
    }
    Ok(())
}

/// An error that ends a program.
pub trait Fault: std::error::Error + From<Error> + Send + 'static {
    /// 1 for a failed run, 2 for bad input, 130 for an interrupted run.
    fn exit_code(&self) -> u8;

    /// Returns whether the user interrupted the run.
    fn is_interruption(&self) -> bool {
        self.exit_code() == polycore::error::EXIT_INTERRUPTED
    }
}

impl Fault for Error {
    fn exit_code(&self) -> u8 {
        Error::exit_code(self)
    }
}

/// Callback for the fraction done, 0 to 1, and a line about it.
pub type Watcher<'a> = &'a mut (dyn FnMut(f64, &dyn Fn() -> String) + Send);

/// A finished step of a run, for whoever watches it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Step {
    /// Numbers of the step: name, unit, value.
    pub values: Vec<(&'static str, &'static str, f64)>,
    /// Fields at particles or nodes, which do not change their order.
    pub fields: Vec<StepField>,
}

/// A field at a step.
#[derive(Clone, Debug, PartialEq)]
pub struct StepField {
    /// Name.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Components at each place.
    pub components: usize,
    /// Values, the components of a place together.
    pub data: Vec<f64>,
}

/// Callback for each finished step; the run stops if it returns `false`, as on a signal.
pub type StepWatcher<'a> = &'a mut (dyn FnMut(Step) -> bool + Send);

/// Options of a run.
pub struct Options<'a> {
    /// Folder of the results.
    pub output: &'a Path,
    /// Leave out what is marked `quick = false`.
    pub quick: bool,
    /// Continue from the checkpoint in `output`.
    pub resume: bool,
    /// Time between checkpoints.
    pub checkpoint_every: Duration,
    /// Returns true once the user has asked to stop.
    pub interrupted: &'a (dyn Fn() -> bool + Sync),
    /// Callback for progress.
    pub progress: Option<Watcher<'a>>,
    /// Callback for finished steps.
    pub on_step: Option<StepWatcher<'a>>,
}

impl<'a> Options<'a> {
    /// Returns a new, whole run into a directory, which nobody watches.
    pub fn new(output: &'a Path) -> Self {
        Self {
            output,
            quick: false,
            resume: false,
            checkpoint_every: Duration::from_secs(30),
            interrupted: &|| false,
            progress: None,
            on_step: None,
        }
    }
}

/// Finished run.
#[derive(Debug)]
pub struct Finished {
    /// Content of `report.json`.
    pub report: Report,
    /// All values, for `--verbose`.
    pub text: String,
    /// The table of main values, where the harness should not choose it.
    pub table: Option<String>,
    /// Warnings and remarks, which are always shown.
    pub notes: Vec<String>,
}

impl Finished {
    /// Returns a finished run with all its values as text.
    pub fn new(report: Report, text: String) -> Self {
        Self { report, text, table: None, notes: Vec::new() }
    }

    /// Adds the warnings and remarks in the lines of a text, which are part of [`Self::text`] too.
    #[must_use]
    pub fn with_notes(mut self, notes: &str) -> Self {
        self.notes.extend(notes.lines().map(str::to_owned));
        self
    }
}

impl From<Report> for Finished {
    fn from(report: Report) -> Self {
        let text = report.table();
        Self::new(report, text)
    }
}

/// A run under way, and its output directory.
pub struct Run<'a> {
    /// Options.
    pub options: Options<'a>,
    program: &'static Program,
    source: Source,
    header: Header,
    lock: Option<RunLock>,
    saved: Instant,
    asked: Option<Instant>,
    pub(crate) stopped: bool,
    kept: Option<VariantCheckpoint<'a>>,
}

/// Part of a variant in the checkpoint of the whole run.
#[derive(Clone)]
pub(crate) struct VariantCheckpoint<'a> {
    /// Stores the state of the variant.
    pub keep: &'a (dyn Fn(Vec<u8>) -> Result<(), Error> + Sync),
    /// State from the checkpoint, if the whole run is resumed.
    pub reached: Option<Vec<u8>>,
}

impl<'a> Run<'a> {
    /// Returns a run of a scene.
    pub fn new(program: &'static Program, source: &Source, options: Options<'a>) -> Self {
        let header = Header::new(source, options.quick);
        Self {
            options,
            program,
            source: source.clone(),
            header,
            lock: None,
            saved: Instant::now(),
            asked: None,
            stopped: false,
            kept: None,
        }
    }

    /// Returns a run of one variant, into the checkpoint of this one.
    pub(crate) fn of_variant<'b>(&self, options: Options<'b>, kept: VariantCheckpoint<'b>) -> Run<'b> {
        Run { kept: Some(kept), ..Run::new(self.program, &self.source, options) }
    }

    /// Takes the output directory. From here on a new run can be resumed.
    ///
    /// # Errors
    /// The directory cannot be written to, or another run holds it.
    pub fn begin(&mut self) -> Result<(), Error> {
        let directory = self.options.output;
        if self.kept.is_some() {
            let begin = if self.options.resume { resume_run } else { prepare_run };
            self.lock = Some(begin(directory)?);
            return Ok(());
        }
        if self.options.resume {
            self.lock = Some(resume_run(directory)?);
            return Header::read(directory, self.program.magic)?.check(directory);
        }
        self.refuse_another()?;
        self.lock = Some(prepare_run(directory)?);
        self.header.stamp = self.source.stamp(self.options.quick);
        checkpoint::save(directory, self.program.magic, &self.header, None::<&()>)
    }

    /// Refuses a directory with results of another scene, whose file is still there.
    fn refuse_another(&self) -> Result<(), Error> {
        let directory = self.options.output;
        let finished = || Report::read(directory.join(crate::report::FILE_NAME)).ok()?.provenance.path;
        let begun = || Header::read(directory, self.program.magic).ok().map(|header| header.scene_path);
        let file = |path: &Path| std::fs::canonicalize(path).ok();
        match finished().or_else(begun).and_then(|path| file(&path)) {
            Some(other) if file(&self.source.path).is_some_and(|own| own != other) => {
                let reason = format!(
                    "it has the results of another scene, {}; choose another folder with --output, or \
                     remove this one",
                    other.display()
                );
                Err(Error::OutputDirectory { path: directory.to_path_buf(), reason })
            }
            _ => Ok(()),
        }
    }

    /// Returns the state that [`Run::save`] wrote last, if the run is resumed.
    ///
    /// # Errors
    /// The checkpoint cannot be read.
    pub fn reached<T: DeserializeOwned>(&self) -> Result<Option<T>, Error> {
        match &self.kept {
            Some(kept) => kept
                .reached
                .as_deref()
                .map(|bytes| checkpoint::decode(self.options.output, bytes))
                .transpose(),
            None if self.options.resume => checkpoint::resume(self.options.output, self.program.magic),
            None => Ok(None),
        }
    }

    /// Writes the checkpoint.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn save<T: Serialize>(&mut self, state: &T) -> Result<(), Error> {
        self.saved = Instant::now();
        if let Some(kept) = &self.kept {
            return (kept.keep)(checkpoint::encode(self.options.output, state)?);
        }
        self.header.stamp = self.source.stamp(self.options.quick);
        checkpoint::save(self.options.output, self.program.magic, &self.header, Some(state))
    }

    /// Between steps: writes the checkpoint where one is due, and ends the run where the user requested it.
    /// `state` gives nothing at a moment from which the run cannot continue.
    ///
    /// # Errors
    /// [`Error::Interrupted`]; the checkpoint cannot be written.
    pub fn pause<T: Serialize>(&mut self, state: impl FnOnce() -> Option<T>) -> Result<(), Error> {
        let stop = self.stopped || (self.options.interrupted)();
        if !stop && self.saved.elapsed() < self.options.checkpoint_every {
            return Ok(());
        }
        let state = state();
        if let Some(state) = &state {
            self.save(state)?;
        }
        if !stop {
            return Ok(());
        }
        // the last checkpoint will do where the next moment to continue from is far
        let since = *self.asked.get_or_insert_with(Instant::now);
        if state.is_some() || since.elapsed() > PATIENCE { Err(self.interruption()) } else { Ok(()) }
    }

    /// Returns the error of a run that the user stopped.
    pub fn interruption(&self) -> Error {
        Error::Interrupted { program: self.program.name, output: self.options.output.to_path_buf() }
    }

    /// Shows the part done, from 0 to 1, and a line about it.
    pub fn show(&mut self, part: f64, line: &dyn Fn() -> String) {
        if let Some(progress) = &mut self.options.progress {
            progress(part, line);
        }
    }

    /// Shows a finished step where somebody watches; one who wants no more of them stops the run at the next
    /// [`Run::pause`].
    pub fn step(&mut self, step: impl FnOnce() -> Step) {
        if let Some(watcher) = &mut self.options.on_step
            && !self.stopped
        {
            self.stopped = !watcher(step());
        }
    }

    /// Writes the report, the last file of a run, with the stamp of what it was computed from: a directory
    /// with a checkpoint holds an unfinished one.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn finish(&mut self, report: &Report) -> Result<(), Error> {
        let mut report = report.clone();
        report.provenance.path = std::path::absolute(&self.source.path).ok();
        report.provenance.stamp = Some(self.source.stamp(self.options.quick));
        report.write(self.options.output)?;
        let _ = std::fs::remove_file(self.options.output.join(checkpoint::FILE_NAME));
        self.lock = None;
        Ok(())
    }
}

/// Runs a scene to its report.
///
/// # Errors
/// [`Failure`]; nothing half-written remains, and an interrupted run can be resumed.
pub fn run<C: Case>(source: &Source, options: Options) -> Result<Finished, Failure<C::Error>> {
    let mut run = Run::new(const { &C::PROGRAM }, source, options);
    let finished = C::solve(source, &mut run)?;
    run.finish(&finished.report)?;
    Ok(finished)
}
