//! The `polycore` command line: fits hyperelastic laws to the data that a case names, and tabulates laws.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};
use polycore::Error;
use polycore::scene::{EXIT_BAD_INPUT, SceneError};

mod cli {
    pub mod draw;
    pub mod exact;
    pub mod fits;
    pub mod scene;
}

use cli::{exact, fits, scene::Case};

/// Hyperelastic laws: fits to data, tables, checks.
#[derive(Parser)]
#[command(version, about, after_help = "Exit codes: 0 ok, 1 an expectation or the run failed, 2 bad input.")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run a case: fits, tables, pictures, report.json.
    Run {
        /// The scene, a TOML file.
        case: PathBuf,
        /// Where the results go; `out/<folder of the case>` if not given.
        #[arg(long, short)]
        output: Option<PathBuf>,
        /// Fit and judge, but draw no pictures.
        #[arg(long)]
        quick: bool,
    },
    /// Validate a case and print what `run` would do, without running it.
    Check {
        /// The scene, a TOML file.
        case: PathBuf,
    },
    /// Tabulate the nominal stress of an incompressible law, as CSV that a case can read back as data.
    Exact(exact::Arguments),
    /// Print a completion script for a shell.
    Completions {
        /// bash, zsh, fish, elvish or powershell.
        shell: clap_complete::Shell,
    },
}

/// What ends a run early.
enum Failure {
    Scene(SceneError),
    Run(Error),
    /// A command-line value.
    Input(String),
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        Self::Scene(error)
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::Run(error)
    }
}

fn main() -> ExitCode {
    let outcome = match Arguments::parse().command {
        Command::Run { case, output, quick } => run(&case, output, quick),
        Command::Check { case } => check(&case),
        Command::Exact(arguments) => exact::table(&arguments).map_err(Failure::Input).map(|text| show(&text)),
        Command::Completions { shell } => {
            let mut text = Vec::new();
            clap_complete::generate(shell, &mut Arguments::command(), "polycore", &mut text);
            Ok(show(&String::from_utf8_lossy(&text)))
        }
    };
    match outcome {
        Ok(code) => code,
        Err(Failure::Scene(error)) => {
            let code = error.exit_code();
            eprint!("{}", error.render());
            code.into()
        }
        Err(Failure::Run(error)) => {
            eprintln!("error: {error}");
            error.exit_code().into()
        }
        Err(Failure::Input(message)) => {
            eprintln!("error: {message}");
            EXIT_BAD_INPUT.into()
        }
    }
}

fn run(path: &Path, output: Option<PathBuf>, quick: bool) -> Result<ExitCode, Failure> {
    let case = Case::read(path)?;
    let directory = output.unwrap_or_else(|| Path::new("out").join(case.name()));
    polycore::output::prepare_directory(&directory)?;
    let report = fits::run(&case, &directory, quick)?;
    println!("{}", directory.join(polycore::report::FILE_NAME).display());
    Ok(if report.passed() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn check(path: &Path) -> Result<ExitCode, Failure> {
    let case = Case::read(path)?;
    Ok(show(&case.plan()))
}

/// A closed pipe is no reason to fail.
fn show(text: &str) -> ExitCode {
    let _ = std::io::stdout().write_all(text.as_bytes());
    ExitCode::SUCCESS
}
