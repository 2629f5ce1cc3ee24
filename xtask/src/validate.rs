//! Runs the cases with the released command lines and judges all their expectations.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};

use harness::case::Shard;
use harness::scene::Source;
use miette::{IntoDiagnostic, Result, WrapErr, miette};

use crate::outcome::CaseOutcome;
use crate::report;
use crate::summary;
use crate::table::print;
use crate::workspace::Repository;

mod execute;

use execute::{Settings, run_case};

/// Number of lines of a failed case's output that are shown.
const SHOWN_LINES: usize = 30;

/// Options of `validate`.
#[derive(clap::Args)]
pub struct Options {
    /// Only cases in this folder of cases/, for example `ch2`; may be repeated.
    #[arg(long, value_name = "CHAPTER")]
    only: Vec<String>,
    /// Skip everything marked `quick = false`; run as many cases at once as there are cores.
    #[arg(long)]
    quick: bool,
    /// Only this case: its folder or file, also one outside cases/; may be repeated.
    #[arg(long, value_name = "PATH")]
    case: Vec<PathBuf>,
    /// Keep the results of cases that have not changed since they ran, and continue an interrupted one.
    #[arg(long)]
    resume: bool,
    /// Run only part I of N of the cases (a case that reads results of others belongs to their part), and
    /// write no report: `--resume` then combines the results of all parts in target/validation.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Compare with the report.json of an earlier run: changed numbers, and their amounts.
    #[arg(long, value_name = "OLD.json")]
    baseline: Option<PathBuf>,
    /// Seconds after which a case is killed and counts as failed.
    #[arg(long, default_value_t = 3600.0, value_name = "SECONDS")]
    timeout: f64,
}

/// Case file and its name, the folder below cases/.
pub struct CaseFile {
    name: String,
    file: PathBuf,
    /// Folder of all cases.
    root: PathBuf,
}

impl CaseFile {
    /// Returns names and files of the scenes whose results it reads; its program reports errors in them.
    fn named_inputs(&self) -> Vec<(String, PathBuf)> {
        let Ok(source) = Source::read(&self.file) else { return Vec::new() };
        let inputs = source.inputs().unwrap_or_default().into_iter();
        let file = |path: PathBuf| source.folder().join(path).canonicalize();
        inputs.filter_map(|(name, path)| Some((name, file(path).ok()?))).collect()
    }

    fn inputs(&self) -> Vec<PathBuf> {
        self.named_inputs().into_iter().map(|(_, file)| file).collect()
    }

    /// Resolves the name of another case.
    fn name_of(&self, file: &Path) -> String {
        name(&self.root, file)
    }
}

/// Sorts cases after those whose results they read; otherwise keeps their order. Cases in a cycle come last:
/// their program reports it.
fn sort_by_inputs(cases: Vec<CaseFile>) -> Vec<CaseFile> {
    let mut waiting = cases;
    let mut ordered: Vec<CaseFile> = Vec::new();
    loop {
        let files: Vec<PathBuf> = waiting.iter().map(|case| case.file.clone()).collect();
        let is_ready = |case: &CaseFile| case.inputs().iter().all(|input| !files.contains(input));
        let (ready, rest): (Vec<CaseFile>, Vec<CaseFile>) = waiting.into_iter().partition(is_ready);
        if ready.is_empty() {
            ordered.extend(rest);
            return ordered;
        }
        ordered.extend(ready);
        waiting = rest;
    }
}

/// Numbers the cases, from 0, so that cases that read results of each other have the same number.
fn chains(cases: &[CaseFile]) -> Vec<usize> {
    let mut of: Vec<usize> = (0..cases.len()).collect();
    for (index, case) in cases.iter().enumerate() {
        for input in case.inputs() {
            let Some(other) = cases.iter().position(|case| case.file == input) else { continue };
            let [from, to] = [of[index], of[other]];
            of.iter_mut().filter(|chain| **chain == from).for_each(|chain| *chain = to);
        }
    }
    let mut known = of.clone();
    known.sort_unstable();
    known.dedup();
    of.iter().map(|chain| known.partition_point(|other| other < chain)).collect()
}

/// Runs, prints, writes target/validation/{report.html, report.json}; returns true if every case passed.
pub fn run(workspace: &Repository, options: &Options) -> Result<bool> {
    let mut cases = find(workspace, options)?;
    if let Some(shard) = options.shard {
        let mut chains = chains(&cases).into_iter();
        cases.retain(|_| chains.next().is_some_and(|chain| shard.contains(chain)));
    }
    // read before the long run begins
    let map = report::Sources::read(workspace, options.baseline.as_deref())?;
    let settings = Settings {
        folder: workspace.results("validate")?,
        quick: options.quick,
        resume: options.resume || options.shard.is_some(),
        timeout: options.timeout,
    };
    let outcomes = run_cases(workspace, &settings, &cases);
    print(&format!("{}\n", summary::text(&outcomes)));
    if options.shard.is_some() {
        return Ok(outcomes.iter().all(CaseOutcome::passed));
    }
    let everything = options.only.is_empty() && options.case.is_empty();
    let tier = report::Tier { quick: options.quick, everything };
    for path in report::write(workspace, &map, &outcomes, tier)? {
        print(&format!("written: {}\n", workspace.short(&path)));
    }
    Ok(outcomes.iter().all(CaseOutcome::passed))
}

/// Runs the cases and prints their verdicts. The quick tier, whose run times are no figures, runs a case on
/// each core, a case after those whose results it reads.
fn run_cases(workspace: &Repository, settings: &Settings, cases: &[CaseFile]) -> Vec<CaseOutcome> {
    let built = Mutex::new(BTreeMap::new());
    let release = |program: &str| {
        let build = || workspace.build_program(program).map_err(|error| error.to_string());
        let mut built = built.lock().unwrap_or_else(PoisonError::into_inner);
        let executable = built.entry(program.to_owned()).or_insert_with(build).clone();
        executable.map_err(|reason| miette!("{reason}"))
    };
    let run = |case: &CaseFile| {
        let mut outcome = run_case(settings, case, &mut |program| release(program));
        outcome.file = workspace.short(&case.file).to_string();
        outcome.href = report::link(workspace, &case.file);
        outcome.command = command(&outcome, settings.quick);
        let verdict = if outcome.passed() { "passed" } else { "FAILED" };
        let kept = if outcome.kept { " (kept)" } else { "" };
        eprintln!("{verdict}  {:<40} {:8.1} s{kept}", outcome.case, outcome.seconds);
        if !outcome.passed() {
            eprintln!("{}", outcome.complaint(|path| workspace.short(path).to_string()));
            show_tail(&outcome.log);
        }
        outcome
    };
    let chains = chains(cases);
    let workers =
        if settings.quick { std::thread::available_parallelism().map_or(1, usize::from) } else { 1 };
    let outcomes: Vec<OnceLock<CaseOutcome>> = cases.iter().map(|_| OnceLock::new()).collect();
    let next = AtomicUsize::new(0);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                loop {
                    let chain = next.fetch_add(1, Ordering::Relaxed);
                    if chain >= cases.len() {
                        return;
                    }
                    for (index, case) in cases.iter().enumerate().filter(|(index, _)| chains[*index] == chain)
                    {
                        outcomes[index].get_or_init(|| run(case));
                    }
                }
            });
        }
    });
    outcomes.into_iter().filter_map(OnceLock::into_inner).collect()
}

/// Command with which a user runs a case.
fn command(outcome: &CaseOutcome, quick: bool) -> String {
    let quick = if quick { " --quick" } else { "" };
    format!("cargo run --release --bin {} -- run {}{quick}", outcome.program, outcome.file)
}

/// Finds the requested cases, in alphabetical order, each after those whose results it reads.
fn find(workspace: &Repository, options: &Options) -> Result<Vec<CaseFile>> {
    let all = workspace.root().join("cases");
    let mut files = Vec::new();
    for path in &options.case {
        let file = if path.is_dir() { path.join("case.toml") } else { path.clone() };
        files.push(file.canonicalize().into_diagnostic().wrap_err_with(|| file.display().to_string())?);
    }
    if options.case.is_empty() || !options.only.is_empty() {
        let folders = match options.only.as_slice() {
            [] => vec![all.clone()],
            only => only.iter().map(|chapter| all.join(chapter)).collect(),
        };
        for folder in folders {
            walk(&folder, &mut files).into_diagnostic().wrap_err_with(|| folder.display().to_string())?;
        }
    }
    files.sort();
    files.dedup();
    if files.is_empty() {
        return Err(miette!("no case.toml found; cases live in {}", workspace.short(&all)));
    }
    let case = |file: PathBuf| CaseFile { name: name(&all, &file), file, root: all.clone() };
    Ok(sort_by_inputs(files.into_iter().map(case).collect()))
}

fn walk(folder: &Path, files: &mut Vec<PathBuf>) -> std::io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            walk(&path, files)?;
        } else if path.file_name().is_some_and(|name| name == "case.toml") {
            files.push(path);
        }
    }
    Ok(())
}

/// Name of a case: cases/ch2/plate/case.toml → ch2/plate; elsewhere the name of the folder.
fn name(cases: &Path, file: &Path) -> String {
    let folder = file.parent().unwrap_or(file);
    let below = folder.strip_prefix(cases).ok().or_else(|| folder.file_name().map(Path::new));
    below.unwrap_or(folder).to_string_lossy().replace('\\', "/")
}

fn show_tail(log: &Path) {
    let text = fs::read_to_string(log).unwrap_or_default();
    let lines: Vec<&str> = text.lines().collect();
    for line in &lines[lines.len().saturating_sub(SHOWN_LINES)..] {
        eprintln!("    {line}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names() {
        let cases = Path::new("/p/cases");
        assert_eq!(name(cases, Path::new("/p/cases/ch2/plate/case.toml")), "ch2/plate");
        assert_eq!(name(cases, Path::new("/elsewhere/mine/case.toml")), "mine");
    }

    #[test]
    fn cases_come_behind_their_inputs() {
        let root = tempfile::tempdir().expect("a folder");
        let root = root.path().canonicalize().expect("a folder");
        let case = |name: &str, input: Option<&str>| {
            let folder = root.join(name);
            fs::create_dir(&folder).expect("a folder");
            let file = folder.join("case.toml");
            let text = input.map_or(String::new(), |input| format!("[inputs]\na = '../{input}/case.toml'"));
            fs::write(&file, text).expect("a scene");
            CaseFile { name: name.to_owned(), file, root: root.clone() }
        };
        let cases = vec![
            case("a", Some("c")),
            case("b", None),
            case("c", Some("d")),
            case("d", None),
            case("e", Some("e")),
        ];
        // a → c → d, b and e
        assert_eq!(chains(&cases), [1, 0, 1, 1, 2]);
        let names: Vec<String> = sort_by_inputs(cases).into_iter().map(|case| case.name).collect();
        assert_eq!(names, ["b", "d", "c", "a", "e"]);
    }
}
