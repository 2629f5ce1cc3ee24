//! Chains of scenes: whether the results that a scene reads are there and still hold, and how they are
//! computed first.

use super::Case;
use super::terminal::{default_output, interrupted};
use crate::checkpoint::{Header, Magic, PROGRAMS};
use crate::report::{FILE_NAME, Provenance, Report};
use crate::scene::{Failure, INPUTS, InputStamp, SceneError, Source};
use polycore::Error;
use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::str::FromStr;
use std::time::{Duration, Instant};

/// Time after which an input that does not stop is killed; its checkpoint remains.
const PATIENCE: Duration = Duration::from_secs(20);

/// Folders of the results of inputs.
#[derive(Clone, Debug, Default, clap::Args)]
pub(super) struct InputArguments {
    /// Folder of the results of an input, where it is not beside this run's own; may be repeated.
    #[arg(long = "input", value_name = "NAME=FOLDER")]
    inputs: Vec<PlacedInput>,
}

#[derive(Clone, Debug)]
struct PlacedInput {
    name: String,
    output: PathBuf,
}

impl FromStr for PlacedInput {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once('=') {
            Some((name, output)) if !name.is_empty() && !output.is_empty() => {
                Ok(Self { name: name.to_owned(), output: output.into() })
            }
            _ => Err(format!("found `{text}`; allowed: NAME=FOLDER, e.g. print=out/printed-bar")),
        }
    }
}

/// A scene that another one names in `[inputs]`.
#[derive(Clone, Debug)]
pub struct Input {
    /// Name in `[inputs]`.
    pub name: String,
    /// The scene.
    pub source: Source,
    /// Program that runs the scene.
    pub program: &'static str,
    /// The folder of its results.
    pub output: PathBuf,
}

/// State of the results of an input.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum InputState {
    /// Results agree with the scene, its files and its own inputs.
    Current {
        /// The [`identity`](crate::scene::Stamp::identity).
        identity: String,
        /// True if all expectations are met.
        passed: bool,
    },
    /// No results.
    Missing,
    /// The run was interrupted.
    Unfinished,
    /// The results no longer hold.
    Stale(String),
}

impl fmt::Display for InputState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Current { passed: true, .. } => write!(f, "current"),
            Self::Current { passed: false, .. } => write!(f, "current, but not all its expectations hold"),
            Self::Missing => write!(f, "missing"),
            Self::Unfinished => write!(f, "not finished"),
            Self::Stale(why) => write!(f, "stale: {why}"),
        }
    }
}

impl Input {
    /// Returns the command that computes the input.
    fn command(&self, quick: bool) -> String {
        let quick = if quick { " --quick" } else { "" };
        let (scene, output) = (self.source.path.display(), self.output.display());
        format!("{} run {scene} --output {output} --with-inputs{quick}", self.program)
    }
}

/// Returns the scenes that a scene names, whose results lie beside `output`, the folder of its own, or where
/// `placed` says.
///
/// # Errors
/// A scene that is missing or names no program; one that, by way of others, needs its own results.
pub fn inputs(
    source: &Source,
    output: &Path,
    placed: &BTreeMap<String, PathBuf>,
) -> Result<Vec<Input>, SceneError> {
    refuse_cycle(source, source, &mut vec![(canonical(&source.path), source.path.clone())])?;
    let mut inputs = Vec::new();
    for (name, path) in source.inputs()? {
        let key = format!("{INPUTS}.{name}");
        let named = Source::read(source.folder().join(path)).map_err(|error| source.refused(&key, error))?;
        let known = PROGRAMS.map(|(_, program)| program);
        let Some(program) = known.into_iter().find(|known| named.program().as_deref() == Some(*known)) else {
            let found = named.program().map_or("no `program`".to_owned(), |name| format!("program `{name}`"));
            let found = format!("{} with {found}", named.path.display());
            return Err(source.error(&key, found, format!("a scene of {}", known.join(", "))));
        };
        let beside = || {
            let name = default_output(&named.path);
            output.parent().unwrap_or(Path::new("")).join(name.file_name().unwrap_or_default())
        };
        let output = placed.get(&name).cloned().unwrap_or_else(beside);
        inputs.push(Input { name, source: named, program, output });
    }
    if let Some(name) = placed.keys().find(|name| !inputs.iter().any(|input| input.name == **name)) {
        let known: Vec<&str> = inputs.iter().map(|input| input.name.as_str()).collect();
        return Err(source.unknown(INPUTS, name, &known));
    }
    Ok(inputs)
}

fn canonical(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_path_buf())
}

/// Follows the inputs of `at`; `way` leads there from `first`, with canonical paths and those to show.
fn refuse_cycle(first: &Source, at: &Source, way: &mut Vec<(PathBuf, PathBuf)>) -> Result<(), SceneError> {
    // what cannot be read has its error where it is needed
    for (name, path) in at.inputs().unwrap_or_default() {
        let path = at.folder().join(path);
        let place = canonical(&path);
        if let Some(begin) = way.iter().position(|(other, _)| *other == place) {
            let mut names: Vec<String> = way[begin..].iter().map(|(_, path)| tidy(path)).collect();
            names.push(tidy(&path));
            let key = if way.len() == 1 { format!("{INPUTS}.{name}") } else { INPUTS.to_owned() };
            let found = format!("a cycle: {}", names.join(" → "));
            return Err(first.error(&key, found, "scenes that do not need their own results"));
        }
        if let Ok(next) = Source::read(&path) {
            way.push((place, path));
            refuse_cycle(first, &next, way)?;
            way.pop();
        }
    }
    Ok(())
}

/// `cases/a/../b/case.toml` → `cases/b/case.toml`.
fn tidy(path: &Path) -> String {
    let mut parts: Vec<std::path::Component> = Vec::new();
    for part in path.components() {
        match (part, parts.last()) {
            (std::path::Component::ParentDir, Some(std::path::Component::Normal(_))) => {
                parts.pop();
            }
            _ => parts.push(part),
        }
    }
    parts.into_iter().collect::<PathBuf>().display().to_string()
}

/// Returns the state of the results of an input; a `quick` run may use results of quick runs.
pub fn input_state(input: &Input, quick: bool) -> InputState {
    let stale = |why: String| InputState::Stale(why);
    if input.output.join(crate::checkpoint::FILE_NAME).is_file() {
        return InputState::Unfinished;
    }
    let Ok(report) = Report::read(input.output.join(FILE_NAME)) else { return InputState::Missing };
    let Provenance { program, version, stamp, .. } = &report.provenance;
    let Some(stamp) = stamp.as_ref().filter(|_| program == input.program) else {
        return stale(format!("of {program} {version}, without what they were computed from"));
    };
    let own = env!("CARGO_PKG_VERSION");
    if version != own {
        return stale(format!("of {program} {version}, this is {own}"));
    }
    if stamp.scene != input.source.stamp(quick).scene {
        return stale("its scene has changed".to_owned());
    }
    if stamp.quick && !quick {
        return stale("of a run with --quick".to_owned());
    }
    if let Some(changed) = stamp.changed(&input.source.path) {
        return stale(changed.to_string());
    }
    // results of its inputs are as they were; they may no longer hold
    let placed = stamp.inputs.iter().map(|(name, input)| (name.clone(), input.output.clone())).collect();
    match inputs(&input.source, &input.output, &placed) {
        Err(error) => return stale(error.to_string()),
        Ok(inputs) => {
            for input in inputs {
                let state = input_state(&input, quick);
                if !matches!(state, InputState::Current { .. }) {
                    return stale(format!("its input `{}` is {state}", input.name));
                }
            }
        }
    }
    InputState::Current { identity: stamp.identity(program, version), passed: report.passed() }
}

impl InputArguments {
    fn placed(&self) -> BTreeMap<String, PathBuf> {
        self.inputs.iter().map(|placed| (placed.name.clone(), placed.output.clone())).collect()
    }

    fn list(&self, source: &Source, output: &Path) -> Result<Vec<Input>, SceneError> {
        inputs(source, output, &self.placed())
    }
}

/// Prints the inputs of a scene and their state.
pub(super) fn describe(
    source: &Source,
    output: &Path,
    quick: bool,
    arguments: &InputArguments,
) -> Result<(), SceneError> {
    let inputs = arguments.list(source, output)?;
    if !inputs.is_empty() {
        crate::say!("inputs");
    }
    for input in inputs {
        let (scene, output) = (tidy(&input.source.path), input.output.display());
        crate::say!("  {:<10} {scene}, results in {output}: {}", input.name, input_state(&input, quick));
    }
    Ok(())
}

/// Returns a scene with the results of its inputs; `with_inputs`: those that are not current are computed
/// first.
///
/// # Errors
/// Results that are missing or stale, with the command that computes them; an input that fails.
pub(super) fn attach<C: Case>(
    source: Source,
    output: &Path,
    quick: bool,
    arguments: &InputArguments,
    with_inputs: bool,
) -> Result<Source, Failure<C::Error>> {
    attached::<C::Error>(source, output, quick, &arguments.placed(), with_inputs)
}

/// Returns a scene with the results of its inputs, which lie beside `output` or where `placed` says;
/// `with_inputs`: those that are not current are computed first, by the programs beside this one.
///
/// # Errors
/// Results that are missing or stale, with the command that computes them; an input that fails.
pub fn attached<E: From<Error>>(
    source: Source,
    output: &Path,
    quick: bool,
    placed: &BTreeMap<String, PathBuf>,
    with_inputs: bool,
) -> Result<Source, Failure<E>> {
    let mut attached = BTreeMap::new();
    let mut refused: Vec<(String, String)> = Vec::new();
    for input in inputs(&source, output, placed)? {
        let mut state = input_state(&input, quick);
        if with_inputs && !matches!(state, InputState::Current { .. }) {
            crate::say!("input `{}` is {state}: {}", input.name, input.command(quick));
            compute(&source, &input, quick, &state)?;
            state = input_state(&input, quick);
        }
        let InputState::Current { identity, .. } = state else {
            let (results, mend) = (input.output.display(), input.command(quick));
            let reason = format!("its results in {results} are {state}; `{mend}` computes them");
            refused.push((input.name, reason));
            continue;
        };
        let output = std::path::absolute(&input.output).unwrap_or(input.output);
        attached.insert(input.name, InputStamp { output, identity });
    }
    if let Some((first, reason)) = refused.first() {
        let mut told = reason.clone();
        for (name, reason) in &refused[1..] {
            told += &format!("; input `{name}`: {reason}");
        }
        told += "; so does this scene with `run --with-inputs`";
        return Err(source.refused(&format!("{INPUTS}.{first}"), told).into());
    }
    Ok(source.with_inputs(attached))
}

/// Runs an input by its program, or goes on with it.
fn compute<E: From<Error>>(
    source: &Source,
    input: &Input,
    quick: bool,
    state: &InputState,
) -> Result<(), Failure<E>> {
    let executable = sibling(input.program).map_err(|found| {
        source.error(&format!("{INPUTS}.{}", input.name), found, "the programs in one folder")
    })?;
    let threads = rayon::current_num_threads().to_string();
    let wait = |command: &mut Command| match finished(command.args(["--threads", &threads]))? {
        Some(status) => Ok(status),
        None => Err(Error::SweepInterrupted(input.output.clone())),
    };
    if *state == InputState::Unfinished && continues(input, quick) {
        let status = wait(Command::new(&executable).arg("resume").arg(&input.output))?;
        // what cannot be resumed is run again
        if status.code() != Some(i32::from(polycore::error::EXIT_BAD_INPUT)) {
            return Ok(());
        }
    }
    let mut command = Command::new(&executable);
    command.arg("run").arg(&input.source.path).arg("--output").arg(&input.output).arg("--with-inputs");
    if quick {
        command.arg("--quick");
    }
    wait(&mut command)?;
    Ok(())
}

/// Returns whether an unfinished run is one of the scene and the files as they are now.
fn continues(input: &Input, quick: bool) -> bool {
    let directory = &input.output;
    let file = File::open(directory.join(crate::checkpoint::FILE_NAME));
    // whatever program it belongs to: `resume` refuses those of others and of other versions
    let mut magic = Magic::default();
    file.and_then(|mut file| file.read_exact(&mut magic)).is_ok()
        && Header::read(directory, &magic).is_ok_and(|header| {
            header.scene == input.source.text && (quick || !header.quick) && header.check(directory).is_ok()
        })
}

/// Returns the executable beside this one.
fn sibling(program: &str) -> Result<PathBuf, String> {
    let own = std::env::current_exe().map_err(|error| format!("no place of this program: {error}"))?;
    let path = own.with_file_name(program).with_extension(std::env::consts::EXE_EXTENSION);
    if path.is_file() { Ok(path) } else { Err(format!("no program {}", path.display())) }
}

/// Waits for a program; nothing where the user stopped it. One that leaves no results explains itself on
/// standard error.
fn finished(command: &mut Command) -> Result<Option<ExitStatus>, Error> {
    let asked = interrupted();
    let program = PathBuf::from(command.get_program());
    let mut child = command.stdin(Stdio::null()).spawn().map_err(Error::from_io("start", &program))?;
    let mut since = None;
    let mut pause = Duration::from_millis(2);
    loop {
        if let Some(status) = child.try_wait().map_err(Error::from_io("wait for", &program))? {
            let stopped = status.code() == Some(i32::from(polycore::error::EXIT_INTERRUPTED));
            return Ok((!stopped && since.is_none()).then_some(status));
        }
        // a signal from the terminal reaches both
        if asked() && since.get_or_insert_with(Instant::now).elapsed() > PATIENCE {
            let _ = child.kill();
        }
        std::thread::sleep(pause);
        pause = (pause * 2).min(Duration::from_millis(100));
    }
}
