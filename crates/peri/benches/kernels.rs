//! `cargo bench -p peri`: force densities of all bonds, as `cargo xtask bench peri` measures them.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use peri::bonds::{BodyGeometry, BondDamage, CloudBonds, VolumeCorrection, force};
use peri::field::Field;
use peri::material::LawCover;
use peri::potential::{KernelFit, Law};
use peri::stress::{BallVolume, StressInput, StressMethod, SurfaceCompensation, piola_in_cloud};

mod kernel;

/// Numbers of particles that fit into the caches.
const SIZE: f64 = 1e4;

fn dimension<const D: usize>(criterion: &mut Criterion) -> Result<(), peri::Error> {
    for (law, range) in
        [(Law::ChainOffset, [0.95, 1.05]), (Law::ChainOffset, [0.5, 3.0]), (Law::Linear, [0.95, 1.05])]
    {
        let mut bonds = kernel::bonds::<D>(kernel::block(SIZE)?)?;
        let (_, displacement) = kernel::loaded(&mut bonds, law, range)?;
        let mut out = Field::zeros(bonds.sites());
        let mut group = criterion.benchmark_group("directed bonds");
        group.throughput(Throughput::Elements(bonds.directed_bonds()));
        let name = format!("{D}D lattice {} {}–{}", law.name(), range[0], range[1]);
        group.bench_function(name, |bencher| bencher.iter(|| force(&bonds, &displacement, &mut out)));
        group.finish();
    }
    let mut bonds = kernel::bonds::<D>(kernel::block(SIZE)?)?;
    let (_, displacement) = kernel::loaded(&mut bonds, Law::Linear, [0.95, 1.05])?;
    let mut out = Field::zeros(bonds.sites());
    let mut layers = kernel::two_laws(&bonds, |place: [f64; D]| place[D - 1].rem_euclid(2.0) < 1.0)?;
    let cover = LawCover { stretches: [0.95, 1.05], bound: 1e-9, clamped: false, known: None };
    layers.cover(&mut bonds, &displacement, &cover)?;
    let mut group = criterion.benchmark_group("directed bonds");
    group.throughput(Throughput::Elements(bonds.directed_bonds()));
    group.bench_function(format!("{D}D lattice, layers of two laws"), |bencher| {
        bencher.iter(|| kernel::forces(&*layers, &bonds, &displacement, &mut out));
    });
    group.finish();
    for (name, mut solid) in kernel::solids(&bonds)? {
        let mut group = criterion.benchmark_group("directed bonds");
        group.throughput(Throughput::Elements(bonds.directed_bonds()));
        group.bench_function(format!("{D}D lattice {name}, both passes"), |bencher| {
            bencher.iter(|| kernel::both_passes(&mut *solid, &bonds, &displacement, &mut out));
        });
        group.finish();
    }
    Ok(())
}

fn forces(criterion: &mut Criterion) {
    // a second thread would be another measurement
    let single = rayon::ThreadPoolBuilder::new().num_threads(1).build_global();
    single.unwrap_or_else(|error| panic!("{error}"));
    let run = dimension::<2>(criterion).and_then(|()| dimension::<3>(criterion));
    run.unwrap_or_else(|error| panic!("{error}"));
}

/// Stress of a cloud of 17³ particles off their lattice, δ = 4 Δx.
fn stress(criterion: &mut Criterion) {
    let points: Vec<[f64; 3]> = (0..17_usize.pow(3))
        .map(|k| [k % 17, k / 17 % 17, k / 289].map(|i| i as f64))
        .map(|[x, y, z]| [x + 0.1 * (y + z).sin(), y + 0.1 * (2.0 * x).sin(), z + 0.1 * (x - y).cos()])
        .collect();
    let volumes = vec![1.0; points.len()];
    let bonds = CloudBonds::new(&points, &volumes, 1.0, 4.0, VolumeCorrection::None, &[]);
    let bonds = bonds.unwrap_or_else(|error| panic!("{error}"));
    let mut displacement = Field::zeros(bonds.sites());
    for (site, point) in points.iter().enumerate() {
        displacement.set(site, point.map(|x| 0.05 * x));
    }
    let law = Law::Linear.build(0.0, 0.0, false).unwrap_or_else(|error| panic!("{error}"));
    let fit = KernelFit::new(&*law, [0.5, 2.0], 1e-7);
    let fit = fit.unwrap_or_else(|error| panic!("{error}"));
    let mut group = criterion.benchmark_group("stress of a cloud");
    for measure in [StressMethod::Hardy, StressMethod::Gaussian] {
        let state = StressInput {
            displacement: &displacement,
            fit: (&fit).into(),
            modulus: 1.0,
            missing: SurfaceCompensation::Bonds,
        };
        group.bench_function(measure.name(), |bencher| {
            bencher.iter(|| piola_in_cloud(&bonds, &state, measure, BallVolume::Particles));
        });
    }
    group.finish();
}

criterion_group! { name = kernels; config = Criterion::default().sample_size(20); targets = forces, stress }
criterion_main!(kernels);
