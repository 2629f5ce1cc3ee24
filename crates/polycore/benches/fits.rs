//! `cargo bench -p polycore --bench fits`: fits of every law to 705 stresses of a bar, with 2 % of noise.

use criterion::{Criterion, criterion_group, criterion_main};
use polycore::constitutive::hyperelastic::data::{Mode, TestData, TestState};
use polycore::constitutive::hyperelastic::{MODELS, fit::fit, homogeneous, model};

/// Ogden's rubber, stretched to 7.6.
fn bar() -> TestData {
    let ogden = model("ogden-3").unwrap();
    let law = ogden.law(ogden.example).unwrap();
    let state = |i: u32| {
        let stretch = 1.0 + 6.6 * f64::from(i) / 705.0;
        let noise = 1.0 + 0.02 * (12.9898 * f64::from(i)).sin();
        let stress = homogeneous::uniaxial(&law, stretch).unwrap();
        let stretches = [stretch, Mode::Uniaxial.second_stretch(stretch)];
        TestState::new(Mode::Uniaxial, stretches, [noise * stress, 0.0])
    };
    TestData::new("bar".to_owned(), (1..=705).map(state).collect())
}

fn fits(criterion: &mut Criterion) {
    let table = bar();
    let mut group = criterion.benchmark_group("fit of 705 stresses");
    for model in MODELS {
        group.bench_function(model.key, |bencher| bencher.iter(|| fit(model, &table).unwrap()));
    }
    group.finish();
}

criterion_group! {
    name = all;
    config = Criterion::default().sample_size(10);
    targets = fits
}
criterion_main!(all);
