//! Project tasks, as `cargo xtask TASK`. They run the released command lines: what users run is judged and
//! timed.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

mod bench;
mod dist;
mod licences;
mod outcome;
mod pictures;
mod prose;
mod report;
mod stamp;
mod summary;
mod table;
mod test;
mod tidy;
mod validate;
mod workspace;

use workspace::Repository;

/// Tasks of the polymer-mechanics workspace.
#[derive(Parser)]
#[command(about, after_help = "Exit codes: 0 done, 1 something failed, 2 wrong usage.")]
struct Cli {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Run all tests: the command of the README; lists skipped tests at the end.
    Test {
        /// Arguments passed on to `cargo test`, for example a test's name.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<String>,
    },
    /// Run the cases and judge their expectations; the report is target/validation/report.html.
    Validate(validate::Options),
    /// Measure: `langevin`, `peri-peers`, or a crate that has a `benches/measure.rs` (`peri`).
    Bench(bench::Options),
    /// Make the archive of a release for this system: programs, completions, man pages, licences of
    /// dependencies.
    Dist(dist::Options),
    /// Draw the pictures and tables of README and guide from cases; those that are up to date are kept.
    Pictures(pictures::Options),
    /// Check the tree: wording, lengths of source files, sizes of files in git.
    Tidy,
}

fn main() -> ExitCode {
    let workspace = Repository::new(PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(".."));
    let passed = match Cli::parse().task {
        Task::Test { arguments } => test::run(&workspace, &arguments),
        Task::Validate(options) => validate::run(&workspace, &options),
        Task::Bench(options) => bench::run(&workspace, &options),
        Task::Dist(options) => dist::run(&workspace, &options),
        Task::Pictures(options) => pictures::run(&workspace, &options),
        Task::Tidy => tidy::run(&workspace),
    };
    match passed {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(report) => {
            eprintln!("{report:?}");
            ExitCode::FAILURE
        }
    }
}
