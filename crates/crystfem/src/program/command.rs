//! The `crystfem` command line. It is a part of the library, so that the solvers are compiled once for all commands.

// harness::say! prints without a panic where nobody reads any more
#![deny(clippy::print_stdout, clippy::print_stderr)]

use crate::program::run::{Crystfem, Failure};
use crate::program::scene::{Kind, kind};
use harness::case::{self, RunArguments};
use harness::scene::Source;
use std::process::ExitCode;

mod bench;
mod card;

#[derive(clap::Subcommand)]
enum Command {
    /// Run a scene of the material alone: kinetics and melting under temperature histories.
    Point(RunArguments),
    /// Run a scene of fits: constants of the kinetics from measurements, with confidence intervals.
    Fit(RunArguments),
    /// Write the materials of a scene as cards for Abaqus or CalculiX, in its units.
    Card(card::Options),
    /// Measure error against run time.
    Bench(bench::Bench),
}

/// Runs the command line of this process.
pub fn main() -> ExitCode {
    case::main::<Crystfem, _>(|command| match command {
        Command::Point(arguments) => run(&arguments, Kind::Point),
        Command::Fit(arguments) => run(&arguments, Kind::Fit),
        Command::Card(options) => card::write(&options),
        Command::Bench(bench) => bench.print(),
    })
}

/// Runs a scene of one kind.
fn run(arguments: &RunArguments, asked: Kind) -> Result<bool, Failure> {
    let source = Source::read(&arguments.scene)?;
    if kind(&source)? != asked {
        let found = "a scene of another kind";
        return Err(source.error("program", found, "`crystfem run`, which takes scenes of all kinds").into());
    }
    case::solve::<Crystfem>(&source, arguments)
}
