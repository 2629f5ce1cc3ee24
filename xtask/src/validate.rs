//! Runs the cases with the released command lines and judges everything that they expect.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::Instant;

use miette::{IntoDiagnostic, Result, WrapErr, miette};
use polycore::report::{FILE_NAME, Report};

use crate::table::print;
use crate::workspace::Workspace;

mod summary;

use summary::Outcome;

/// Lines of a failed case's output that are shown.
const TAIL: usize = 30;

/// What to run.
#[derive(clap::Args)]
pub struct Options {
    /// Only cases in this folder of cases/, for example `ch2`; may be repeated.
    #[arg(long, value_name = "CHAPTER")]
    only: Vec<String>,
    /// Leave out what the cases mark `quick = false`.
    #[arg(long)]
    quick: bool,
    /// Only this case: its folder or file; may be repeated.
    #[arg(long, value_name = "PATH")]
    case: Vec<PathBuf>,
}

/// A case file and its name, the folder below cases/.
struct Case {
    name: String,
    file: PathBuf,
}

/// Runs, prints, writes target/validate/{summary.json, validation.md}; passes if every case did.
pub fn run(workspace: &Workspace, options: &Options) -> Result<bool> {
    let cases = find(workspace, options)?;
    let folder = workspace.results("validate")?;
    let mut built = BTreeMap::new();
    let mut release = |program: &str| {
        let build = || workspace.release(program).map_err(|error| error.to_string());
        let executable = built.entry(program.to_owned()).or_insert_with(build).clone();
        executable.map_err(|reason| miette!("{reason}"))
    };
    let mut outcomes = Vec::new();
    for case in &cases {
        let outcome = run_case(&folder, case, options.quick, &mut release);
        let verdict = if outcome.passed() { "passed" } else { "FAILED" };
        eprintln!("{verdict}  {:<40} {:8.1} s", outcome.case, outcome.seconds);
        if !outcome.passed() {
            show_tail(&log_file(&folder, case));
        }
        outcomes.push(outcome);
    }
    print(&format!("{}\n", summary::text(&outcomes)));
    for path in summary::write(&folder, &outcomes, options.quick)? {
        print(&format!("written: {}\n", workspace.short(&path)));
    }
    Ok(outcomes.iter().all(Outcome::passed))
}

/// The cases asked for, in alphabetical order.
fn find(workspace: &Workspace, options: &Options) -> Result<Vec<Case>> {
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
    Ok(files.into_iter().map(|file| Case { name: name(&all, &file), file }).collect())
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

/// cases/ch2/plate/case.toml → ch2/plate; elsewhere the folder's name.
fn name(cases: &Path, file: &Path) -> String {
    let folder = file.parent().unwrap_or(file);
    let below = folder.strip_prefix(cases).ok().or_else(|| folder.file_name().map(Path::new));
    below.unwrap_or(folder).to_string_lossy().replace('\\', "/")
}

/// Never an error: whatever goes wrong is the outcome of this case.
fn run_case(
    folder: &Path,
    case: &Case,
    quick: bool,
    release: &mut dyn FnMut(&str) -> Result<PathBuf>,
) -> Outcome {
    let mut outcome = Outcome::new(&case.name);
    let result = (|| {
        outcome.program = program_of(&case.file)?;
        let executable = release(&outcome.program)?;
        let output = folder.join(&case.name);
        let since = Instant::now();
        let status = start(&executable, case, folder, &output, quick);
        outcome.seconds = since.elapsed().as_secs_f64();
        let status = status?;
        let report = Report::read(output.join(FILE_NAME));
        let failed = describe(status);
        match (report, failed) {
            (Ok(report), failed) => outcome.judge(report, failed, quick),
            (Err(_), Some(failed)) => outcome.failure = Some(failed),
            (Err(error), None) => outcome.failure = Some(error.to_string()),
        }
        Ok(())
    })();
    if let Err(error) = result {
        let error: miette::Report = error;
        outcome.failure = Some(error.to_string());
    }
    outcome
}

/// The key that every case has: `program = "peri"`.
fn program_of(file: &Path) -> Result<String> {
    let text = fs::read_to_string(file).into_diagnostic()?;
    let table: toml::Table = toml::from_str(&text).map_err(|error| miette!("{}", error.message()))?;
    let program = table.get("program").and_then(toml::Value::as_str);
    program.map(str::to_owned).ok_or_else(|| miette!("the case names no program (program = \"peri\")"))
}

fn log_file(folder: &Path, case: &Case) -> PathBuf {
    folder.join(format!("{}.log", case.name))
}

/// `PROGRAM run CASE --output FOLDER [--quick]`, its output in FOLDER.log.
fn start(executable: &Path, case: &Case, folder: &Path, output: &Path, quick: bool) -> Result<ExitStatus> {
    // an old report must not be judged
    if output.exists() {
        fs::remove_dir_all(output).into_diagnostic()?;
    }
    fs::create_dir_all(output).into_diagnostic()?;
    let log = File::create(log_file(folder, case)).into_diagnostic()?;
    let mut command = Command::new(executable);
    command.arg("run").arg(&case.file).arg("--output").arg(output);
    if quick {
        command.arg("--quick");
    }
    command.stdin(Stdio::null()).stdout(log.try_clone().into_diagnostic()?).stderr(log);
    command.status().into_diagnostic().wrap_err_with(|| format!("cannot start {}", executable.display()))
}

fn describe(status: ExitStatus) -> Option<String> {
    #[cfg(unix)]
    if let Some(signal) = std::os::unix::process::ExitStatusExt::signal(&status) {
        return Some(format!("killed by signal {signal}"));
    }
    (!status.success()).then(|| match status.code() {
        Some(code) => format!("exit code {code}"),
        None => status.to_string(),
    })
}

fn show_tail(log: &Path) {
    let text = fs::read_to_string(log).unwrap_or_default();
    let lines: Vec<&str> = text.lines().collect();
    for line in &lines[lines.len().saturating_sub(TAIL)..] {
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

    /// A case run by a shell script in place of a program.
    #[cfg(unix)]
    fn outcome(case: &str, script: &str) -> Outcome {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().expect("a folder");
        let (file, program) = (folder.path().join("case.toml"), folder.path().join("program"));
        fs::write(&file, case).expect("a case");
        fs::write(&program, format!("#!/bin/sh\n{script}\n")).expect("a script");
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).expect("permissions");
        let case = Case { name: "ch9/it".to_owned(), file };
        run_case(folder.path(), &case, true, &mut |_| Ok(program.clone()))
    }

    #[test]
    #[cfg(unix)]
    fn whatever_a_program_does_is_an_outcome() {
        let case = "program = \"peri\"";
        let failure = |case: &str, script: &str| outcome(case, script).failure.unwrap_or_default();
        assert_eq!(failure(case, "kill -9 $$"), "killed by signal 9");
        assert_eq!(failure(case, "exit 101"), "exit code 101");
        assert!(failure(case, "exit 0").contains("report.json"));
        assert!(failure(case, "echo '{' > $4/report.json").contains("not a valid report"));
        assert!(failure("program = 3", "exit 0").contains("names no program"));
        assert!(!failure("program = ", "exit 0").is_empty());
        let report = serde_json::to_string(&Report::new("peri", "0", "")).expect("JSON");
        let good = format!("[ $1$3$5 = run--output--quick ] && echo '{report}' > $4/report.json");
        assert!(outcome(case, &good).passed());
    }
}
