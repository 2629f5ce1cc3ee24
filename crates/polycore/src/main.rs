//! The `polycore` command line: fits hyperelastic laws to the data that a case names, and tabulates laws.

// polycore::say! prints without a panic where nobody reads any more
#![deny(clippy::print_stdout, clippy::print_stderr)]

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};
use polycore::Error;
use polycore::command::{exit, print};
use polycore::scene::Failure;

mod cli {
    pub mod draw;
    pub mod exact;
    pub mod fits;
    pub mod material;
    pub mod scene;
    pub mod trials;
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
    /// Run a case: fits, trials, tables, pictures, report.json.
    Run {
        /// The scene, a TOML file.
        case: PathBuf,
        /// Where the results go; `out/NAME` if not given, NAME being the scene's file, or its folder if the file is `case.toml`.
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

fn main() -> ExitCode {
    let result = match polycore::command::parse::<Arguments>().command {
        Command::Run { case, output, quick } => run(&case, output, quick),
        Command::Check { case } => check(&case),
        Command::Exact(arguments) => match exact::table(&arguments) {
            Ok(text) => show(&text),
            Err(message) => Arguments::command().error(ErrorKind::ValueValidation, message).exit(),
        },
        Command::Completions { shell } => {
            let mut text = Vec::new();
            clap_complete::generate(shell, &mut Arguments::command(), "polycore", &mut text);
            show(&String::from_utf8_lossy(&text))
        }
    };
    exit(result, Error::exit_code)
}

fn run(path: &Path, output: Option<PathBuf>, quick: bool) -> Result<bool, Failure<Error>> {
    let case = Case::read(path)?;
    let directory = output.unwrap_or_else(|| polycore::command::default_output(path));
    let _lock = polycore::output::prepare_run(&directory)?;
    let report = fits::run(&case, &directory, quick)?;
    polycore::say!("{}", directory.join(polycore::report::FILE_NAME).display());
    Ok(report.passed())
}

fn check(path: &Path) -> Result<bool, Failure<Error>> {
    let case = Case::read(path)?;
    show(&case.plan())
}

fn show(text: &str) -> Result<bool, Failure<Error>> {
    print(text);
    Ok(true)
}
