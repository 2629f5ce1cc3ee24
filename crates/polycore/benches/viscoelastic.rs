//! `cargo bench -p polycore --bench viscoelastic`: one step of a material point with its tangent beside the
//! elastic law, and a cycle of VHB 4910 for both schemes at several errors.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use polycore::constitutive::hyperelastic::data::Mode;
use polycore::constitutive::hyperelastic::{Compressible, LopezPamies, NeoHookean, Volumetric};
use polycore::constitutive::viscoelastic::{
    Branch, History, Increment, Pace, Reaction, Scheme, Spring, Viscoelastic, Viscosity, strain_of_test,
};
use polycore::constitutive::{Law, Workspace};
use polycore::tensor::Voigt;
use std::hint::black_box;

const VHB: Viscosity = Viscosity::KumarLopezPamies {
    start: 7014e3,
    end: 100.0,
    thickening: 3507e3,
    thinning: 1e-6,
    exponents: [1.852, 0.26],
};

fn vhb_spring() -> Spring {
    Spring::LopezPamies(LopezPamies::new(vec![[5.42e3, -10.0], [20.78e3, 1.948]]).unwrap())
}

fn elastic() -> Compressible<NeoHookean> {
    Compressible::new(NeoHookean::new(1e5).unwrap(), Volumetric::Ciarlet { lame: 1e7 }).unwrap()
}

fn steps(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("step of a point");
    let (from, to) = (Voigt::new(1.2, 0.9, 1.0, 0.2, 0.1, 0.0), Voigt::new(1.3, 0.9, 1.0, 0.25, 0.1, 0.0));
    let mut memory = Workspace::default();
    let law = elastic();
    group.bench_function("elastic law, tangent", |bencher| {
        bencher.iter(|| Law::tangent(&law, black_box(&to), &mut memory).unwrap());
    });
    let neo = || Spring::NeoHookean(NeoHookean::new(1e5).unwrap());
    for (name, spring, viscosity, scheme) in [
        ("constant branch, tangent", neo(), Viscosity::Constant(1e5), Scheme::Euler),
        ("Kumar-Lopez-Pamies branch, tangent", vhb_spring(), VHB, Scheme::Euler),
        ("Kumar-Lopez-Pamies branch, second order", vhb_spring(), VHB, Scheme::Sdirk2),
    ] {
        let branch = Branch::new(spring, viscosity).unwrap();
        let law = Viscoelastic::new(Box::new(elastic()), vec![branch]).unwrap();
        let state = law.advance(&law.rest(), &Increment::new(from, from, 0.3), &mut memory).unwrap().state;
        let increment = Increment { scheme, ..Increment::new(from, to, 0.1) };
        group.bench_function(name, |bencher| {
            bencher.iter(|| law.advance(black_box(&state), &increment, &mut memory).unwrap());
        });
    }
    group.finish();
}

fn cycles(criterion: &mut Criterion) {
    let equilibrium = LopezPamies::new(vec![[13.54e3, 1.0], [1.08e3, -2.474]]).unwrap();
    let branch = Branch::new(vhb_spring(), VHB).unwrap();
    let law = Viscoelastic::new(Box::new(equilibrium), vec![branch]).unwrap();
    let strain = |t: f64| strain_of_test(Mode::Uniaxial, 3.0 - (t - 40.0).abs() / 20.0);
    let reaction = Reaction::Test(Mode::Uniaxial);
    let history = History { strain: &strain, temperature: &|_| 293.15, times: &[0.0, 40.0, 70.0], reaction };
    let stress = |pace| law.follow(&history, law.rest(), pace).unwrap().points[1].step.prediction.stress;
    let exact = stress(Pace::Equal(20_000, Scheme::Sdirk2));
    let mut group = criterion.benchmark_group("cycle of VHB 4910");
    group.sample_size(10);
    let mut measure = |name: &str, amount: f64, pace| {
        let error = (stress(pace) - exact).norm() / exact.norm();
        let id = BenchmarkId::new(format!("{name}, error {error:.1e}"), amount);
        group.bench_function(id, |bencher| bencher.iter(|| stress(black_box(pace))));
    };
    for count in [20, 80, 320] {
        measure("Euler, steps", count as f64, Pace::Equal(count, Scheme::Euler));
        measure("second order, steps", count as f64, Pace::Equal(count, Scheme::Sdirk2));
    }
    for limit in [1e3, 1e2, 1e1, 1.0] {
        measure("error control, Pa", limit, Pace::Within(limit));
    }
    group.finish();
}

criterion_group! {
    name = viscoelastic;
    config = Criterion::default().sample_size(20);
    targets = steps, cycles
}
criterion_main!(viscoelastic);
