//! `cargo xtask bench mdsurrogate`: nanoseconds per point for stress, tangent and batches of the thesis'
//! network and of energies.

use clap::Parser;
use evidence::measurement::{Measurement, print};
use mdsurrogate::Error;
use mdsurrogate::network::Real;
use mdsurrogate::surrogate::{Prediction, Surrogate, Workspace};
use nalgebra::Scalar;
use points::POINTS;
use std::hint::black_box;
use std::time::Instant;

mod points;
mod training;

/// Number of repetitions; the median is reported.
const REPEATS: usize = 15;

/// Measures the speed of laws or of their training.
#[derive(Parser)]
struct Bench {
    /// Print JSON rows {what, size, threads, value, unit}.
    #[arg(long)]
    json: bool,
    /// Measure training: one epoch of the thesis' network with as many rows.
    #[arg(long, conflicts_with = "law")]
    training: bool,
    /// Law to measure instead of the built-in ones with random weights.
    law: Option<std::path::PathBuf>,
    /// Argument that `cargo bench` adds.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let bench = Bench::parse();
    let mut rows = Vec::new();
    if bench.training {
        rows = training::measure()?;
    } else {
        let laws = match &bench.law {
            Some(path) => vec![("law".into(), Surrogate::read(path)?)],
            None => points::laws()?,
        };
        for (name, law) in laws {
            measure(&name, "f64", &law, &mut rows)?;
            measure(&name, "f32", &law.convert::<f32>()?, &mut rows)?;
        }
    }
    print(&rows, bench.json);
    Ok(())
}

fn measure<T: Real + Scalar>(
    name: &str,
    precision: &str,
    law: &Surrogate<T>,
    rows: &mut Vec<Measurement>,
) -> Result<(), Error> {
    let points = points::points::<T>();
    let mut memory = Workspace::default();
    let mut predictions = vec![Prediction::default(); POINTS];
    let size = law.header().architecture.parameters();
    let mut row = |what: &str, value: f64| {
        let what = format!("{name}, {precision}, {what}");
        rows.push(Measurement::new(what, size, 1, value, "ns/point"));
    };
    let single = median_time(|| {
        for (c, prediction) in points.iter().zip(&mut predictions) {
            *prediction = law.stress(black_box(c), &mut memory)?;
        }
        Ok(())
    })?;
    row("stress", single);
    let with_tangent = median_time(|| {
        for (c, prediction) in points.iter().zip(&mut predictions) {
            *prediction = law.tangent(black_box(c), &mut memory)?;
        }
        Ok(())
    })?;
    row("stress and tangent", with_tangent);
    row(
        "stress, batch",
        median_time(|| Ok(law.stresses(black_box(&points), &mut memory, &mut predictions)?))?,
    );
    Ok(())
}

/// Returns the median time in nanoseconds per point.
fn median_time(mut run: impl FnMut() -> Result<(), Error>) -> Result<f64, Error> {
    let mut times = [0.0; REPEATS];
    for time in &mut times {
        let start = Instant::now();
        run()?;
        *time = start.elapsed().as_secs_f64() * 1e9 / POINTS as f64;
    }
    times.sort_by(f64::total_cmp);
    Ok(times[REPEATS / 2])
}
