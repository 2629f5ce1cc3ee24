//! `cargo bench -p polycore`: nanoseconds of every inverse Langevin function, as `cargo xtask bench langevin`
//! measures them.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use polycore::langevin::Inverse;
use std::hint::black_box;

mod arguments;

fn inverses(criterion: &mut Criterion) {
    let arguments = arguments::arguments();
    let mut row = vec![0.0; arguments.len()];
    let mut group = criterion.benchmark_group("inverse Langevin");
    group.throughput(Throughput::Elements(arguments::ROW as u64));
    for choice in Inverse::ALL {
        group.bench_function(choice.name(), |bencher| {
            bencher.iter(|| choice.fill(black_box(&arguments), black_box(&mut row)));
        });
    }
    group.finish();
}

criterion_group! { name = langevin; config = Criterion::default().sample_size(20); targets = inverses }
criterion_main!(langevin);
