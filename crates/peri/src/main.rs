//! The `peri` command line.

// polycore::say! prints without a panic where nobody reads any more
#![deny(clippy::print_stdout, clippy::print_stderr)]

use peri::run::Peri;
use std::process::ExitCode;

mod bench;
mod exact_command;

#[derive(clap::Subcommand)]
enum Command {
    /// Print closed-form solutions and the constants of a bond law.
    #[command(subcommand)]
    Exact(exact_command::Exact),
    /// Measure bond evaluations per second, memory, and the machine's bandwidth.
    Bench(bench::Bench),
}

fn main() -> ExitCode {
    polycore::case::main::<Peri, _>(|command| match command {
        Command::Exact(exact) => exact.print(),
        Command::Bench(bench) => bench.print(),
    })
}
