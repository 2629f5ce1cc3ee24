//! `cargo xtask bench crystfem`: error against run time, seconds per step, memory.

use clap::{Parser, Subcommand};
use evidence::measurement::print as print_rows;
use harness::case::terminal::Threads;

mod brick;
mod integrators;
mod kinetics;
mod point;
mod print;
mod solvers;

/// Number of timings; the median is reported.
const REPEATS: usize = 7;

type Failure = Box<dyn std::error::Error>;

/// Measures solvers, integrators and materials.
#[derive(Parser)]
struct Bench {
    #[command(subcommand)]
    what: What,
    /// Print JSON rows {what, size, threads, value, unit}.
    #[arg(long, global = true)]
    json: bool,
    #[command(flatten)]
    threads: Threads,
    /// Argument that `cargo bench` adds.
    #[arg(long, global = true, hide = true)]
    bench: bool,
}

#[derive(Subcommand)]
enum What {
    /// Measure the kinetics integrators, error in alpha against nanoseconds per step, and the response of a
    /// material.
    Kinetics {
        /// Cooling rate, K/min.
        #[arg(long, default_value_t = 10.0)]
        rate: f64,
    },
    /// Measure the time integrators, error against time, with fixed and adaptive steps, for a smooth and a
    /// quenched cube.
    Integrators {
        /// Elements along an edge.
        #[arg(long, default_value_t = 16, value_parser = elements)]
        elements: usize,
    },
    /// Measure the linear solvers, error against time, in short and long steps of the quenched cube.
    Solvers {
        /// Elements along an edge.
        #[arg(long, default_value_t = 26, value_parser = elements)]
        elements: usize,
    },
    /// Measure seconds per step, iterations and memory of a brick with film and radiation, 20 steps of 0.5 s.
    Brick(brick::Options),
    /// Measure seconds per birth with its step, iterations and memory of a block printed in short line
    /// segments.
    Print(print::Options),
}

fn elements(text: &str) -> Result<usize, String> {
    let value: usize = text.parse().map_err(|_| format!("`{text}` is not a whole number"))?;
    if (1..=400).contains(&value) { Ok(value) } else { Err(format!("{value} is outside 1 to 400")) }
}

fn main() -> Result<(), Failure> {
    let bench = Bench::parse();
    bench.threads.apply()?;
    let rows = match bench.what {
        What::Kinetics { rate } => kinetics::measure(rate)?,
        What::Integrators { elements } => integrators::measure(elements)?,
        What::Solvers { elements } => solvers::measure(elements)?,
        What::Brick(options) => brick::measure(&options)?,
        What::Print(options) => print::measure(&options)?,
    };
    print_rows(&rows, bench.json);
    Ok(())
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
