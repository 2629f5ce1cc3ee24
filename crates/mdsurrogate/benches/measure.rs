//! `mdsurrogate bench`: nanoseconds a point of stress, of tangent and of batches, of the thesis' network and of energies.

use crate::bench_points::{self, POINTS};
use mdsurrogate::Error;
use mdsurrogate::network::Real;
use mdsurrogate::surrogate::{Prediction, Surrogate, Workspace};
use nalgebra::Scalar;
use polycore::case::terminal::{Measurement, print_measurements};
use std::hint::black_box;
use std::time::Instant;

/// Repetitions, of which the median counts.
const REPEATS: usize = 15;

/// What to measure.
#[derive(clap::Args)]
pub struct Bench {
    /// Print JSON rows {what, size, threads, value, unit}.
    #[arg(long)]
    json: bool,
    /// Measure training: an epoch of the thesis' network on rows of the thesis' number.
    #[arg(long, conflicts_with = "law")]
    training: bool,
    /// A law to measure instead of the built-in ones with random weights.
    law: Option<std::path::PathBuf>,
}

impl Bench {
    /// Measures and prints.
    pub fn print(self) -> Result<bool, Error> {
        if self.training {
            print_measurements(&crate::bench_training::measure()?, self.json);
            return Ok(true);
        }
        let mut rows = Vec::new();
        for (name, law) in self.laws()? {
            measure(&name, "f64", &law, &mut rows)?;
            measure(&name, "f32", &law.convert::<f32>()?, &mut rows)?;
        }
        print_measurements(&rows, self.json);
        Ok(true)
    }

    fn laws(&self) -> Result<Vec<(String, Surrogate<f64>)>, Error> {
        if let Some(path) = &self.law {
            return Ok(vec![("law".into(), Surrogate::read(path)?)]);
        }
        bench_points::laws()
    }
}

fn measure<T: Real + Scalar>(
    name: &str,
    precision: &str,
    law: &Surrogate<T>,
    rows: &mut Vec<Measurement>,
) -> Result<(), Error> {
    let points = bench_points::points::<T>();
    let mut memory = Workspace::default();
    let mut predictions = vec![Prediction::default(); POINTS];
    let size = law.header().architecture.parameters() as u64;
    let mut row = |what: &str, value: f64| {
        let what = format!("{name}, {precision}, {what}");
        rows.push(Measurement { what, size, threads: 1, value, unit: "ns/point" });
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

/// Nanoseconds a point.
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
