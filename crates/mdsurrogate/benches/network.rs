//! `cargo bench -p mdsurrogate`: stress, stress with tangent, and batches of stresses for 512 points, as in
//! `cargo xtask bench mdsurrogate`.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use mdsurrogate::surrogate::{Prediction, Workspace};
use std::hint::black_box;

mod points;

fn predictions(criterion: &mut Criterion) {
    let strains = points::points::<f64>();
    let mut memory = Workspace::default();
    let mut predictions = vec![Prediction::default(); points::POINTS];
    let mut group = criterion.benchmark_group("predictions");
    group.throughput(Throughput::Elements(points::POINTS as u64));
    for (name, law) in points::laws().unwrap_or_else(|error| panic!("{error}")) {
        group.bench_function(format!("{name}, stress"), |bencher| {
            bencher.iter(|| strains.iter().all(|c| law.stress(black_box(c), &mut memory).is_ok()));
        });
        group.bench_function(format!("{name}, stress and tangent"), |bencher| {
            bencher.iter(|| law.tangents(black_box(&strains), &mut memory, &mut predictions).is_ok());
        });
        group.bench_function(format!("{name}, stress, batch"), |bencher| {
            bencher.iter(|| law.stresses(black_box(&strains), &mut memory, &mut predictions).is_ok());
        });
    }
    group.finish();
}

criterion_group! { name = network; config = Criterion::default().sample_size(20); targets = predictions }
criterion_main!(network);
