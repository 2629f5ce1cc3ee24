//! `cargo bench -p peri`: force densities of all bonds, as `peri bench` and `cargo xtask bench peri` measure them.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use peri::bonds::{Bonds, force};
use peri::field::Field;
use peri::potential::Law;
use peri::run::Failure;

#[path = "../src/command/bench/kernel.rs"]
mod kernel;

/// Particles: what the caches hold.
const SIZE: f64 = 1e4;

fn dimension<const D: usize>(criterion: &mut Criterion) -> Result<(), Failure> {
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

criterion_group! { name = kernels; config = Criterion::default().sample_size(20); targets = forces }
criterion_main!(kernels);
