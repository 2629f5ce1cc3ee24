//! Command line of `crystfem`, inside the library so that the solvers are compiled once for all commands.

// harness::say! does not panic when the reader of a pipe has gone
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
