//! `cargo xtask bench peri`: bond evaluations per second, bytes per particle, and the bandwidth of the
//! machine.

use clap::Parser;
use evidence::measurement::{Measurement, print};
use harness::case::terminal::Threads;
use kernel::RATIO;
use peri::bonds::{BodyGeometry, BondForces, Bonds, CloudBonds, VolumeCorrection, force};
use peri::field::Field;
use peri::material::{LawCover, relief};
use peri::potential::Law;
use std::hint::black_box;
use std::time::Instant;

mod block;
mod kernel;
mod laws;
mod solvers;

/// Range of stretches of the bond law for comparison.
const WIDE: [f64; 2] = [0.5, 3.0];

/// Number of repetitions; the median counts.
const REPEATS: usize = 7;

type Failure = Box<dyn std::error::Error + Send + Sync>;

/// Settings of the measurement.
#[derive(Parser)]
struct Bench {
    /// Print JSON rows {what, size, threads, value, unit}.
    #[arg(long)]
    json: bool,
    /// Largest number of particles.
    #[arg(long, default_value_t = 1e7, conflicts_with = "block")]
    largest: f64,
    /// Thread counts.
    #[arg(long, value_delimiter = ',', default_values_t = [1, 2], conflicts_with = "block")]
    bench_threads: Vec<usize>,
    #[command(flatten)]
    block: block::Options,
    #[command(flatten)]
    solvers: solvers::Options,
    /// Measure ways to evaluate the bond law instead, each with its error.
    #[arg(long, conflicts_with_all = ["block", "solvers"])]
    laws: bool,
    #[command(flatten)]
    threads: Threads,
    /// Ignored argument of `cargo bench`.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> Result<(), Failure> {
    let bench = Bench::parse();
    bench.threads.apply()?;
    let rows = match bench.block.block {
        Some(cells) => block::measure(cells, &bench.block)?,
        None if !bench.solvers.solvers.is_empty() => solvers::measure(&bench.solvers.solvers)?,
        None if bench.laws => laws::measure()?,
        None => bench.rates()?,
    };
    print(&rows, bench.json);
    Ok(())
}

impl Bench {
    fn rates(&self) -> Result<Vec<Measurement>, Failure> {
        let mut rows = Vec::new();
        for &threads in &self.bench_threads {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
            pool.install(|| self.measure(threads, &mut rows))?;
        }
        Ok(rows)
    }

    fn measure(&self, threads: usize, rows: &mut Vec<Measurement>) -> Result<(), Failure> {
        rows.push(Measurement::new("STREAM triad", 1 << 25, threads, triad(), "B/s"));
        for size in [1e4, 1e5, 1e6, 1e7_f64] {
            if size > self.largest {
                break;
            }
            measure_dimension::<2>(size, threads, rows)?;
            measure_dimension::<3>(size, threads, rows)?;
        }
        Ok(())
    }
}

/// Measures a ← b + s·c over arrays larger than any cache: bytes moved per second, best of five as in STREAM.
fn triad() -> f64 {
    use rayon::prelude::*;
    let n = 1 << 25;
    let (b, c) = (vec![1.0; n], vec![2.0; n]);
    let mut a = vec![0.0; n];
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let start = Instant::now();
        a.par_chunks_mut(1 << 16).zip(b.par_chunks(1 << 16).zip(c.par_chunks(1 << 16))).for_each(
            |(a, (b, c))| {
                for (a, (b, c)) in a.iter_mut().zip(b.iter().zip(c)) {
                    *a = b + 3.0 * c;
                }
            },
        );
        best = best.min(start.elapsed().as_secs_f64());
        black_box(&a);
    }
    3.0 * 8.0 * n as f64 / best
}

fn measure_dimension<const D: usize>(
    size: f64,
    threads: usize,
    rows: &mut Vec<Measurement>,
) -> Result<(), Failure> {
    let lattice = kernel::block::<D>(size)?;
    let cells = lattice.cells;
    let points = |index: usize| -> [f64; D] {
        let mut rest = index;
        std::array::from_fn(|d| {
            let cell = rest % cells[d];
            rest /= cells[d];
            cell as f64 + 0.5
        })
    };
    let total: usize = cells.iter().product();
    let mut bonds = kernel::bonds(lattice)?;
    // the DENT specimen's stretches, and those of a stiff plate
    measure_bonds(&mut bonds, "lattice", Law::ChainOffset, [0.95, 1.05], threads, rows)?;
    let seconds = measure_bonds(&mut bonds, "lattice", Law::ChainOffset, WIDE, threads, rows)?;
    measure_bonds(&mut bonds, "lattice", Law::Linear, [0.95, 1.05], threads, rows)?;
    measure_two_laws(&mut bonds, "lattice", seconds, threads, rows)?;
    measure_solids(&mut bonds, "lattice", seconds, threads, rows)?;
    // a neighbour list of 3D bonds takes 2.5 kB a particle
    if size <= 1e6 {
        let points: Vec<[f64; D]> = (0..total).map(points).collect();
        let mut cloud = CloudBonds::new(&points, &vec![1.0; total], 1.0, RATIO, VolumeCorrection::None, &[])?;
        measure_bonds(&mut cloud, "list", Law::ChainOffset, [0.95, 1.05], threads, rows)?;
        let seconds = measure_bonds(&mut cloud, "list", Law::ChainOffset, WIDE, threads, rows)?;
        measure_two_laws(&mut cloud, "list", seconds, threads, rows)?;
        measure_solids(&mut cloud, "list", seconds, threads, rows)?;
        // stretches of scenes; softening takes as long if it is zero
        let start = Instant::now();
        let theta = relief(&cloud).unwrap_or_else(|| Field::zeros(cloud.sites()));
        cloud.set_relief(theta);
        let what = format!("{D}D list, its relief");
        let value = start.elapsed().as_secs_f64();
        rows.push(Measurement::new(what, total, threads, value, "s"));
        measure_solids(&mut cloud, "relieved list", seconds, threads, rows)?;
    }
    Ok(())
}

/// Measures forces of two laws in alternate layers of one particle, and in halves, over that of one law.
fn measure_two_laws<const D: usize>(
    bonds: &mut dyn Bonds<D>,
    path: &str,
    one_law: f64,
    threads: usize,
    rows: &mut Vec<Measurement>,
) -> Result<(), Failure> {
    let (_, displacement) = kernel::loaded(bonds, Law::ChainOffset, WIDE)?;
    let (size, mut out) = (bonds.particles().len(), Field::<D>::zeros(bonds.sites()));
    let half = 0.5 * (size as f64).powf(1.0 / D as f64);
    let alternate = |x: f64| x.rem_euclid(2.0) < 1.0;
    for (name, layer) in [("layers", &alternate as &dyn Fn(f64) -> bool), ("halves", &|x| x < half)] {
        for axis in [0, D - 1] {
            let mut material = kernel::two_laws(bonds, |place: [f64; D]| layer(place[axis]))?;
            let cover = LawCover { stretches: WIDE, bound: 1e-9, clamped: false, known: None };
            material.cover(bonds, &displacement, &cover)?;
            let seconds = median(|| {
                bonds.prepare(&displacement);
                kernel::forces(&*material, bonds, &displacement, &mut out);
                black_box(&out);
            });
            let what = format!("{D}D {path} two laws in {name} along axis {axis}, over one");
            rows.push(Measurement::new(what, size, threads, seconds / one_law, ""));
        }
    }
    Ok(())
}

/// Measures both passes of solids with any Poisson ratio, and their time over that of a bond law.
fn measure_solids<const D: usize>(
    bonds: &mut dyn Bonds<D>,
    path: &str,
    bond_law: f64,
    threads: usize,
    rows: &mut Vec<Measurement>,
) -> Result<(), Failure> {
    let (_, displacement) = kernel::loaded(bonds, Law::Linear, [0.95, 1.05])?;
    let (bonds, mut out) = (&*bonds, Field::<D>::zeros(bonds.sites()));
    for (name, mut solid) in kernel::solids(bonds)? {
        let seconds = median(|| {
            kernel::both_passes(&mut *solid, bonds, &displacement, &mut out);
            black_box(&out);
        });
        let (size, rate) = (bonds.particles().len(), bonds.directed_bonds() as f64 / seconds);
        let what = format!("{D}D {path} {name}, both passes");
        rows.push(Measurement::new(&what, size, threads, rate, "directed bonds/s"));
        let what = format!("{what}, over {} {}–{}", Law::ChainOffset.name(), WIDE[0], WIDE[1]);
        rows.push(Measurement::new(what, size, threads, seconds / bond_law, ""));
    }
    Ok(())
}

/// Returns the median of the seconds of a function, after a first call.
fn median(mut run: impl FnMut()) -> f64 {
    run();
    // at least 20 ms a measurement
    let start = Instant::now();
    run();
    let inner = (0.02 / start.elapsed().as_secs_f64()).ceil().clamp(1.0, 1000.0) as usize;
    let mut times: Vec<f64> = (0..REPEATS)
        .map(|_| {
            let start = Instant::now();
            (0..inner).for_each(|_| run());
            start.elapsed().as_secs_f64() / inner as f64
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[REPEATS / 2]
}

fn measure_bonds<const D: usize>(
    bonds: &mut dyn Bonds<D>,
    path: &str,
    law: Law,
    range: [f64; 2],
    threads: usize,
    rows: &mut Vec<Measurement>,
) -> Result<f64, Failure> {
    let (fit, displacement) = kernel::loaded(bonds, law, range)?;
    let mut out = Field::zeros(bonds.sites());
    let seconds = median(|| {
        bonds.prepare(&displacement);
        force(bonds, &displacement, &mut out);
        black_box(&out);
    });
    let size = bonds.particles().len();
    let what = format!("{D}D {path} {} {}–{} ({})", law.name(), range[0], range[1], fit.kind());
    let rate = bonds.directed_bonds() as f64 / seconds;
    rows.push(Measurement::new(&what, size, threads, rate, "directed bonds/s"));
    if law == Law::Linear || path == "list" && range != WIDE {
        // bonds and particles; displacement, velocity, force and mass of the solver
        let solver = bonds.sites() * 8 * (3 * D + 1);
        let bytes = (bonds.bytes() + solver) as f64 / size as f64;
        rows.push(Measurement::new(format!("{D}D {path} memory"), size, threads, bytes, "B/particle"));
    }
    Ok(seconds)
}
