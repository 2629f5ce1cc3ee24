//! Builds the command lines and some examples once and runs them.

use std::collections::HashMap;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Time limit of each program, on a busy machine.
const TIME_LIMIT: Duration = Duration::from_secs(240);

/// Examples that run as programs of their own; others are compiled into the tests of their packages.
pub const EXAMPLES: [&str; 7] =
    ["fit_rubber", "langevin", "network", "own_law", "predict", "rubber_in_time", "time_predictions"];

/// Output of a program.
#[derive(Debug)]
pub struct Ended {
    /// Exit code; `None` if a signal ended the program.
    pub code: Option<i32>,
    /// Standard output.
    pub stdout: String,
    /// Standard error.
    pub stderr: String,
}

/// Root of the workspace.
pub fn workspace() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// Returns the released executable of a package, or an example. Cargo reports its path: target directories
/// can be anywhere.
pub fn executable(package: &str) -> &'static Path {
    static BUILT: OnceLock<HashMap<String, PathBuf>> = OnceLock::new();
    &BUILT.get_or_init(build)[package]
}

fn build() -> HashMap<String, PathBuf> {
    let cargo = std::env::var_os("CARGO").unwrap_or("cargo".into());
    let mut command = Command::new(cargo);
    // the whole workspace: the features of the tests themselves, so that nothing is compiled again
    command.args(["build", "--release", "--quiet", "--workspace", "--bins"]);
    command.args(EXAMPLES.iter().flat_map(|name| ["--example", name]));
    command.arg("--message-format=json-render-diagnostics");
    let output = command.current_dir(workspace()).stderr(Stdio::inherit()).output().unwrap();
    assert!(output.status.success(), "cargo build failed");
    let messages = String::from_utf8(output.stdout).unwrap();
    let artifacts = messages.lines().filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok());
    let executables = artifacts.filter_map(|artifact| {
        let path = artifact["executable"].as_str()?;
        Some((artifact["target"]["name"].as_str()?.to_owned(), PathBuf::from(path)))
    });
    executables.collect()
}

/// Creates a command line, its arguments separated by blanks, in a directory.
pub fn command(package: &str, arguments: &str, directory: &Path) -> Command {
    let mut command = Command::new(executable(package));
    command.args(arguments.split_whitespace()).current_dir(directory);
    command.env("NO_COLOR", "1").env_remove("RUST_BACKTRACE");
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Creates `peri ARGUMENTS` in a directory.
pub fn peri(arguments: &str, directory: &Path) -> Ended {
    finish(command("peri", arguments, directory).spawn().unwrap())
}

/// Waits for the end and checks the rule of every program: no panic.
pub fn finish(mut child: Child) -> Ended {
    let (stdout, stderr) = (child.stdout.take(), child.stderr.take());
    let stdout = std::thread::spawn(|| text(stdout));
    let stderr = std::thread::spawn(|| text(stderr));
    let begun = Instant::now();
    let mut pause = Duration::from_micros(200);
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if begun.elapsed() > TIME_LIMIT {
            child.kill().unwrap();
        }
        std::thread::sleep(pause);
        pause = (2 * pause).min(Duration::from_millis(20));
    };
    let ended = Ended { code: status.code(), stdout: stdout.join().unwrap(), stderr: stderr.join().unwrap() };
    assert!(begun.elapsed() <= TIME_LIMIT, "no end within {TIME_LIMIT:?}: {ended:?}");
    assert!(!ended.stderr.contains("panicked") && ended.code != Some(101), "a panic:\n{}", ended.stderr);
    ended
}

fn text(pipe: Option<impl Read>) -> String {
    let mut bytes = Vec::new();
    // a test may have redirected it
    if let Some(mut pipe) = pipe {
        pipe.read_to_end(&mut bytes).unwrap();
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

impl Ended {
    /// Asserts the exit code; shows the output otherwise.
    #[track_caller]
    pub fn with_code(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "stdout:\n{}\nstderr:\n{}", self.stdout, self.stderr);
        self
    }

    /// Asserts the text of standard error, without quoted lines of the source.
    #[track_caller]
    pub fn tells(&self, expected: &str) {
        assert!(self.message().contains(expected), "`{expected}` is not in\n{}", self.stderr);
    }

    /// Asserts the text of standard output.
    #[track_caller]
    pub fn shows(&self, expected: &str) {
        assert!(self.stdout.contains(expected), "`{expected}` is not in\n{}", self.stdout);
    }

    /// Standard error without quoted lines of a scene: `12 │ spacing = …`.
    pub fn message(&self) -> String {
        let quoted = |line: &&str| {
            let rest = line.trim_start().trim_start_matches(|c: char| c.is_ascii_digit());
            rest.len() < line.trim_start().len() && rest.trim_start().starts_with('│')
        };
        self.stderr.lines().filter(|line| !quoted(line)).collect::<Vec<_>>().join("\n")
    }
}
