//! Runs one case with the released command line. An error is the outcome of this case and of no other.

use std::fs::{self, File};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use harness::report::{FILE_NAME, Report};
use harness::scene::Stamp;
use miette::{IntoDiagnostic, Result, WrapErr, miette};
use polycore::file::atomic_write;
use serde::{Deserialize, Serialize};

use super::CaseFile;
use crate::outcome::CaseOutcome;

/// Settings for running cases.
pub struct Settings {
    /// Folder of the results.
    pub folder: PathBuf,
    /// Leave out parts marked `quick = false`.
    pub quick: bool,
    /// Keep the results of cases that have not changed.
    pub resume: bool,
    /// Seconds after which a program is killed.
    pub timeout: f64,
}

impl Settings {
    /// Folder of the results of a case's input: in the same relation to the results of the case as the
    /// scenes.
    fn results(&self, case: &CaseFile, input: &Path) -> PathBuf {
        self.folder.join(case.name_of(input))
    }
}

/// Provenance of a case's results, stored beside them: FOLDER.run.json.
#[derive(Serialize, Deserialize)]
struct CaseStamp {
    /// Hash of the case's folder, the executable and the tier.
    fingerprint: String,
    /// Duration and failure; `None` while the case runs.
    ended: Option<RunEnd>,
}

#[derive(Clone, Serialize, Deserialize)]
struct RunEnd {
    seconds: f64,
    failure: Option<String>,
}

/// Runs the case. Never fails: an error is the outcome of this case.
pub fn run_case(
    settings: &Settings,
    case: &CaseFile,
    release: &mut dyn FnMut(&str) -> Result<PathBuf>,
) -> CaseOutcome {
    let mut outcome = CaseOutcome::new(&case.name);
    outcome.output = settings.folder.join(&case.name);
    outcome.log = settings.folder.join(format!("{}.log", case.name));
    if let Err(error) = attempt(settings, case, release, &mut outcome) {
        outcome.failure = Some(error.to_string());
    }
    outcome
}

fn attempt(
    settings: &Settings,
    case: &CaseFile,
    release: &mut dyn FnMut(&str) -> Result<PathBuf>,
    outcome: &mut CaseOutcome,
) -> Result<()> {
    (outcome.program, outcome.title) = heading(&case.file)?;
    let executable = release(&outcome.program)?;
    for input in case.inputs() {
        release(&heading(&input)?.0)?;
    }
    let path = settings.folder.join(format!("{}.run.json", case.name));
    let fingerprint = fingerprint(settings, case, &executable).into_diagnostic()?;
    let before =
        fs::read_to_string(&path).ok().and_then(|text| serde_json::from_str::<CaseStamp>(&text).ok());
    let before = before.filter(|stamp| settings.resume && stamp.fingerprint == fingerprint);
    let (ended, unfinished) = match before {
        Some(CaseStamp { ended: Some(ended), .. }) => (Some(ended), false),
        Some(CaseStamp { ended: None, .. }) => (None, outcome.output.join("checkpoint.bin").is_file()),
        None => (None, false),
    };
    outcome.kept = ended.is_some();
    let ended = match ended {
        Some(ended) => ended,
        None => {
            if !unfinished {
                // an old report must not be judged
                clear(&outcome.output)?;
            }
            write(&path, &CaseStamp { fingerprint: fingerprint.clone(), ended: None })?;
            let since = Instant::now();
            let failure = start(&executable, case, settings, outcome, unfinished)?;
            let ended = RunEnd { seconds: since.elapsed().as_secs_f64(), failure };
            // an aborted case is not kept
            let keep = outcome.output.join(FILE_NAME).is_file();
            write(&path, &CaseStamp { fingerprint, ended: keep.then(|| ended.clone()) })?;
            ended
        }
    };
    outcome.seconds = ended.seconds;
    match (Report::read(outcome.output.join(FILE_NAME)), ended.failure) {
        (Ok(report), failed) => outcome.judge(report, failed, settings.quick),
        (Err(_), Some(failed)) => outcome.failure = Some(failed),
        (Err(error), None) => outcome.failure = Some(error.to_string()),
    }
    Ok(())
}

/// Reads the keys that every case has: `program = "peri"`, `title = "…"`.
fn heading(file: &Path) -> Result<(String, String)> {
    let text = fs::read_to_string(file).into_diagnostic()?;
    let table: toml::Table = toml::from_str(&text).map_err(|error| miette!("{}", error.message()))?;
    let word = |key: &str| table.get(key).and_then(toml::Value::as_str).map(str::to_owned);
    let program = word("program").ok_or_else(|| miette!("the case names no program (program = \"peri\")"))?;
    Ok((program, word("title").unwrap_or_default()))
}

/// Hashes the case file, the files beside it, the executable, the tier, and the results of its inputs.
fn fingerprint(settings: &Settings, case: &CaseFile, executable: &Path) -> std::io::Result<String> {
    let mut hasher = DefaultHasher::new();
    (fs::read(&case.file)?, settings.quick).hash(&mut hasher);
    for input in case.inputs() {
        Stamp::identity_of(&settings.results(case, &input)).hash(&mut hasher);
    }
    let changed = |path: &Path| {
        let metadata = fs::metadata(path)?;
        std::io::Result::Ok((metadata.len(), metadata.modified()?))
    };
    let beside = case.file.parent().unwrap_or(Path::new("."));
    let mut files: Vec<PathBuf> = fs::read_dir(beside)?.flatten().map(|entry| entry.path()).collect();
    files.retain(|path| path.is_file());
    files.sort();
    files.push(executable.to_path_buf());
    for path in files {
        (changed(&path)?, path).hash(&mut hasher);
    }
    Ok(format!("{:016x}", hasher.finish()))
}

fn write(path: &Path, stamp: &CaseStamp) -> Result<()> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).into_diagnostic()?;
    }
    atomic_write(path, |file| Ok(serde_json::to_writer(file, stamp)?)).into_diagnostic()
}

fn clear(folder: &Path) -> Result<()> {
    if folder.exists() {
        fs::remove_dir_all(folder).into_diagnostic()?;
    }
    fs::create_dir_all(folder).into_diagnostic()
}

/// Runs `PROGRAM run CASE --output FOLDER [--quick]` or `PROGRAM resume FOLDER`, its output in FOLDER.log;
/// returns how it failed.
fn start(
    executable: &Path,
    case: &CaseFile,
    settings: &Settings,
    outcome: &CaseOutcome,
    resume: bool,
) -> Result<Option<String>> {
    let log = File::create(&outcome.log).into_diagnostic()?;
    let mut command = Command::new(executable);
    if resume {
        command.arg("resume").arg(&outcome.output);
    } else {
        command.arg("run").arg(&case.file).arg("--output").arg(&outcome.output);
        if settings.quick {
            command.arg("--quick");
        }
        let inputs = case.named_inputs();
        if !inputs.is_empty() {
            command.arg("--with-inputs");
        }
        for (name, path) in inputs {
            let mut placed = std::ffi::OsString::from(format!("{name}="));
            placed.push(settings.results(case, &path));
            command.arg("--input").arg(placed);
        }
    }
    if settings.quick {
        // cases run side by side
        command.args(["--threads", "1"]);
    }
    command.stdin(Stdio::null()).stdout(log.try_clone().into_diagnostic()?).stderr(log);
    let child = command.spawn().into_diagnostic();
    let child = child.wrap_err_with(|| format!("cannot start {}", executable.display()))?;
    match wait(child, settings.timeout).into_diagnostic()? {
        Some(status) => Ok(describe(status)),
        None => Ok(Some(format!("killed after {} s (--timeout)", settings.timeout))),
    }
}

/// Waits for a program; returns its exit status, or `None` if it was killed after the time limit.
fn wait(mut child: Child, timeout: f64) -> std::io::Result<Option<ExitStatus>> {
    let since = Instant::now();
    let mut pause = Duration::from_millis(2);
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        if since.elapsed().as_secs_f64() > timeout {
            child.kill()?;
            child.wait()?;
            return Ok(None);
        }
        std::thread::sleep(pause);
        pause = (pause * 2).min(Duration::from_millis(200));
    }
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

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    /// Case run by a shell script instead of a program.
    struct Stage {
        folder: tempfile::TempDir,
        case: CaseFile,
        settings: Settings,
    }

    impl Stage {
        fn new(case: &str) -> Self {
            let folder = tempfile::tempdir().expect("a folder");
            fs::create_dir(folder.path().join("case")).expect("a folder");
            let file = folder.path().join("case/case.toml");
            fs::write(&file, case).expect("a case");
            let settings =
                Settings { folder: folder.path().join("results"), quick: true, resume: false, timeout: 60.0 };
            let root = folder.path().to_path_buf();
            Self { folder, case: CaseFile { name: "ch9/it".to_owned(), file, root }, settings }
        }

        fn program(&self, script: &str) -> PathBuf {
            use std::os::unix::fs::PermissionsExt;
            let program = self.folder.path().join("program");
            fs::write(&program, format!("#!/bin/sh\n{script}\n")).expect("a script");
            fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).expect("permissions");
            program
        }

        fn run(&self, script: &str) -> CaseOutcome {
            let program = self.program(script);
            run_case(&self.settings, &self.case, &mut |_| Ok(program.clone()))
        }
    }

    const CASE: &str = "program = \"peri\"\ntitle = \"It\"";

    fn good() -> String {
        let report = serde_json::to_string(&Report::new("peri", "0", "")).expect("JSON");
        format!("[ $1$3$5 = run--output--quick ] && echo '{report}' > $4/report.json")
    }

    #[test]
    fn whatever_a_program_does_is_an_outcome() {
        let failure = |case: &str, script: &str| Stage::new(case).run(script).failure.unwrap_or_default();
        assert_eq!(failure(CASE, "kill -9 $$"), "killed by signal 9");
        assert_eq!(failure(CASE, "exit 101"), "exit code 101");
        assert!(failure(CASE, "exit 0").contains("report.json"));
        assert!(failure(CASE, "echo '{' > $4/report.json").contains("not a valid report"));
        assert!(failure("program = 3", "exit 0").contains("names no program"));
        assert!(!failure("program = ", "exit 0").is_empty());
        let outcome = Stage::new(CASE).run(&good());
        assert!(outcome.passed() && outcome.title == "It");
    }

    #[test]
    fn a_program_that_never_ends_is_killed() {
        let mut stage = Stage::new(CASE);
        stage.settings.timeout = 0.2;
        let outcome = stage.run("exec sleep 600");
        assert_eq!(outcome.failure.as_deref(), Some("killed after 0.2 s (--timeout)"));
        assert!(outcome.seconds < 60.0);
    }

    #[test]
    fn results_are_kept_while_nothing_has_changed() {
        let mut stage = Stage::new(CASE);
        let program = stage.program(&format!("{}\necho x >> $4/../../count", good()));
        let run = |stage: &Stage| run_case(&stage.settings, &stage.case, &mut |_| Ok(program.clone()));
        let count =
            |stage: &Stage| fs::read(stage.settings.folder.join("count")).map_or(0, |text| text.len() / 2);
        assert!(!run(&stage).kept);
        stage.settings.resume = true;
        let second = run(&stage);
        assert!(second.kept && second.passed());
        assert_eq!(count(&stage), 1);
        fs::write(&stage.case.file, format!("{CASE}\n# changed")).expect("a case");
        assert!(!run(&stage).kept);
        assert_eq!(count(&stage), 2);
        stage.settings.quick = false;
        assert!(!run(&stage).kept, "another tier is another run");
    }

    #[test]
    fn an_interrupted_case_goes_on_from_its_checkpoint() {
        let mut stage = Stage::new(CASE);
        let report = serde_json::to_string(&Report::new("peri", "0", "")).expect("JSON");
        let script = format!(
            "if [ $1 = resume ]; then [ -f $2/checkpoint.bin ] && echo '{report}' > $2/report.json\n\
             else touch $4/checkpoint.bin; kill -9 $$; fi"
        );
        let program = stage.program(&script);
        let run = |stage: &Stage| run_case(&stage.settings, &stage.case, &mut |_| Ok(program.clone()));
        assert_eq!(run(&stage).failure.as_deref(), Some("killed by signal 9"));
        stage.settings.resume = true;
        assert!(run(&stage).passed());
    }
}
