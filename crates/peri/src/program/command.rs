//! Command line of `peri`, part of the library so that solvers are compiled once.

// harness::say! does not panic on a closed pipe
#![deny(clippy::print_stdout, clippy::print_stderr)]

use crate::program::run::Peri;
use std::process::ExitCode;

mod bridge;
mod exact;

#[derive(clap::Subcommand)]
enum Command {
    /// Print closed-form solutions and the constants of a bond law.
    #[command(subcommand)]
    Exact(exact::ExactCommand),
    /// Write a scene for another engine (LAMMPS).
    #[command(subcommand)]
    Export(bridge::ExportCommand),
    /// Read the results of another engine (LAMMPS).
    #[command(subcommand)]
    Import(bridge::ImportCommand),
    /// Compare forces of an export with those of its engine.
    #[command(subcommand)]
    Compare(bridge::CompareCommand),
}

/// Runs the command line of this process.
pub fn main() -> ExitCode {
    harness::case::main::<Peri, _>(|command| match command {
        Command::Exact(exact) => exact.print(),
        Command::Export(export) => export.print(),
        Command::Import(import) => import.print(),
        Command::Compare(compare) => compare.print(),
    })
}
