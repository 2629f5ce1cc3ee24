//! The `crystfem` command line. It is a part of the library, so that the solvers are compiled once for all commands.

// harness::say! prints without a panic where nobody reads any more
#![deny(clippy::print_stdout, clippy::print_stderr)]

use crate::program::run::Crystfem;
use std::process::ExitCode;

mod card;

#[derive(clap::Subcommand)]
enum Command {
    /// Write the materials of a scene as cards for Abaqus or CalculiX, in its units.
    Card(card::Options),
}

/// Runs the command line of this process.
pub fn main() -> ExitCode {
    harness::case::main::<Crystfem, _>(|Command::Card(options)| card::write(&options))
}
