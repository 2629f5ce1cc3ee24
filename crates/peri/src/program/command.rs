//! The `peri` command line. It is a part of the library, so that the solvers are compiled once for all commands.

// harness::say! prints without a panic where nobody reads any more
#![deny(clippy::print_stdout, clippy::print_stderr)]

use crate::program::run::Peri;
use std::process::ExitCode;

mod bridge;
mod exact;

#[derive(clap::Subcommand)]
enum Command {
    /// Print closed-form solutions and the constants of a bond law.
    #[command(subcommand)]
    ExactCommand(exact::ExactCommand),
    /// Write a scene for another engine.
    #[command(subcommand)]
    ExportCommand(bridge::ExportCommand),
    /// Read the results of another engine.
    #[command(subcommand)]
    ImportCommand(bridge::ImportCommand),
    /// CompareCommand an export with the engine that it is for.
    #[command(subcommand)]
    CompareCommand(bridge::CompareCommand),
}

/// Runs the command line of this process.
pub fn main() -> ExitCode {
    harness::case::main::<Peri, _>(|command| match command {
        Command::ExactCommand(exact) => exact.print(),
        Command::ExportCommand(export) => export.print(),
        Command::ImportCommand(import) => import.print(),
        Command::CompareCommand(compare) => compare.print(),
    })
}
