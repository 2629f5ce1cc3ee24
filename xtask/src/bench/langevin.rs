//! Error against time of every inverse Langevin function.
//!
//! Error: the largest relative one on a grid of (0, 1) graded to both ends. That of the exact inverse is
//! taken against the mpmath values of polycore's tests; the others are compared with the exact inverse, whose
//! error is 2e-16. Time: the median over repeats of a row of shuffled uniform arguments, divided by its
//! length; one core.

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use harness::output::picture::{LinePlot, Series};
use miette::{IntoDiagnostic, Result, miette};
use polycore::langevin::{Inverse, inverse_from_complement};

use super::Row;
use crate::table::TextTable;

#[path = "../../../crates/polycore/benches/langevin/arguments.rs"]
mod arguments;

use arguments::{ROW, arguments};

/// Values of 𝓛⁻¹ to 20 digits: `function,argument,value`.
const REFERENCE: &str = include_str!("../../../crates/polycore/tests/langevin_reference.csv");

/// Number of rows per repeat, and of repeats.
const ROWS: usize = 200;
const REPEATS: usize = 41;

/// Returns the rows and their table; the picture goes to `folder`/langevin.{png,svg}.
pub fn run(folder: &Path) -> Result<(Vec<Row>, String)> {
    let grid = grid();
    let arguments = arguments();
    let mut rows = Vec::new();
    let mut points = Vec::new();
    let mut table = TextTable::new(["inverse", "largest relative error", "published", "ns/call", "source"]);
    for choice in Inverse::ALL {
        let (error, count) = match choice {
            Inverse::Exact => error_of_exact()?,
            _ => (largest_error(choice, &grid), grid.len()),
        };
        let nanoseconds = nanoseconds(choice, &arguments);
        let row = |what: &str, size: usize, value: f64, unit: &str| Row {
            what: format!("{}: {what}", choice.name()),
            size: size as u64,
            threads: 1,
            value: Some(value),
            unit: unit.to_owned(),
        };
        rows.push(row("largest relative error", count, error, ""));
        rows.push(row("time", ROW * ROWS * REPEATS, nanoseconds, "ns/call"));
        table.push([
            choice.name().to_owned(),
            format!("{error:.3e}"),
            choice.published_error().map_or_else(|| "-".to_owned(), |percent| format!("{percent} %")),
            format!("{nanoseconds:.2}"),
            choice.source().to_owned(),
        ]);
        points.push((choice.name(), nanoseconds, error));
    }
    draw(folder, &points)?;
    Ok((rows, table.text()))
}

/// Complements c = 1 − x: uniform in x with steps of 1e-5, and geometric to 1e-12 at both ends.
fn grid() -> Vec<f64> {
    let uniform = (1..100_000).map(|k| 1e-5 * f64::from(k));
    let geometric = (500..1200).map(|k| 10f64.powf(-0.01 * f64::from(k)));
    let near_zero = geometric.clone().map(|x| 1.0 - x);
    uniform.chain(geometric).chain(near_zero).collect()
}

fn largest_error(choice: Inverse, complements: &[f64]) -> f64 {
    let error = |&c: &f64| (choice.value_from_complement(c) / inverse_from_complement(c) - 1.0).abs();
    complements.iter().map(error).fold(0.0, f64::max)
}

fn error_of_exact() -> Result<(f64, usize)> {
    let (mut largest, mut count) = (0.0, 0);
    for line in REFERENCE.lines().filter(|line| line.starts_with("inverse")) {
        let fields: Vec<&str> = line.split(',').collect();
        let &[name, argument, value] = fields.as_slice() else {
            return Err(miette!("langevin_reference.csv: `{line}`"));
        };
        let number = |text: &str| text.parse::<f64>().map_err(|error| miette!("{text}: {error}"));
        let (argument, value) = (number(argument)?, number(value)?);
        let found = match name {
            "inverse" => Inverse::Exact.value(argument),
            "inverse_from_complement" => Inverse::Exact.value_from_complement(argument),
            _ => continue,
        };
        // subnormal numbers have fewer digits
        if value > f64::MIN_POSITIVE {
            largest = f64::max(largest, (found / value - 1.0).abs());
            count += 1;
        }
    }
    Ok((largest, count))
}

fn nanoseconds(choice: Inverse, arguments: &[f64]) -> f64 {
    let mut row = vec![0.0; arguments.len()];
    let mut times: Vec<f64> = (0..REPEATS)
        .map(|_| {
            let since = Instant::now();
            for _ in 0..ROWS {
                choice.fill(black_box(arguments), black_box(&mut row));
            }
            since.elapsed().as_secs_f64() * 1e9 / (ROWS * arguments.len()) as f64
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[REPEATS / 2]
}

fn draw(folder: &Path, points: &[(&str, f64, f64)]) -> Result<()> {
    let mut plot = LinePlot::new("Inverse Langevin functions: error against time")
        .axes("time / (ns per call)", "largest relative error over (0, 1)")
        .log_x()
        .log_y();
    for (name, time, error) in points {
        plot = plot.series(Series::markers(name, &[*time], &[*error]));
    }
    for name in ["langevin.png", "langevin.svg"] {
        plot.write(folder.join(name)).into_diagnostic()?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exact_inverse_is_exact() {
        let (error, count) = error_of_exact().expect("the reference values");
        // 1.6 ulp are at most 1.6 × 2.2e-16
        assert!(error < 3.6e-16 && count > 200, "{error} {count}");
    }

    #[test]
    fn the_grid_reaches_both_ends() {
        let grid = grid();
        let (low, high) =
            grid.iter().fold((1.0, 0.0), |(low, high), &c| (f64::min(low, c), f64::max(high, c)));
        assert!(low < 2e-12 && high > 1.0 - 2e-12);
        assert!((largest_error(Inverse::Cohen, &grid) - 0.04937).abs() < 1e-5);
    }
}
