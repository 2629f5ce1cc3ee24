//! `cargo bench -p crystfem`: response of a material with its tangent, as in `cargo xtask bench crystfem --
//! kinetics`.

use criterion::{Criterion, criterion_group, criterion_main};
use crystfem::material::ThermalMaterial;
use std::hint::black_box;

mod point;

fn responses(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("response");
    for (name, start, increment) in point::STEPS {
        for latent in [None, Some(209e3)] {
            let polymer = point::polymer(latent).unwrap_or_else(|error| panic!("{error}"));
            let mut old = [0.0];
            polymer.initial_state(start, &mut old);
            let at = point::point(start, increment);
            let name = format!("{name}, {} latent heat", if latent.is_some() { "with" } else { "without" });
            group.bench_function(name, |bencher| {
                bencher.iter(|| polymer.respond(black_box(&at), black_box(&old), &mut [0.0]).is_ok());
            });
        }
    }
    group.finish();
}

criterion_group! { name = points; config = Criterion::default().sample_size(20); targets = responses }
criterion_main!(points);
