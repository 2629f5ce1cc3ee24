use super::*;
use crate::dataset::tests::{neo_hookean, rows_of_a_law};
use crate::kinematics::cauchy_from_material;
use crate::network::Activation::{Elu, Linear, Relu, Sigmoid, Silu, Softplus, Tanh};
use crate::network::{Activation, Architecture};
use crate::surrogate::{Kind, Symmetry, Workspace};
use harness::case::Fault;
use polycore::constitutive::verify;
use polycore::tensor::{DeformationGradient, Tensor, Voigt, voigt};

fn header(kind: Kind, hidden: &[(usize, Activation)], rows: &[&DataRow]) -> Header {
    let architecture = Architecture::new(kind.inputs(), hidden, kind.outputs());
    crate::fitted::header(kind, architecture, 1, rows, true).unwrap()
}

fn trained(header: &Header, rows: &[&DataRow], settings: Settings) -> Training {
    let mut training = Training::new(header, rows, &[], settings).unwrap();
    while training.ending().is_none() {
        training.epoch().unwrap();
    }
    training
}

const SHORT: Settings = Settings {
    epochs: 3,
    batch: 32,
    learning_rate: 1e-3,
    schedule: Schedule::Constant,
    patience: None,
    loss: Loss::Stress,
    seed: 5,
};

/// Returns laws with all activations, both kinds, polyconvex ones, rotated axes, and no hidden layers.
fn laws(rows: &[&DataRow]) -> Vec<Header> {
    let (s, c) = 0.4f64.sin_cos();
    let axes = [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]];
    let smooth = [(7, Softplus), (6, Tanh), (5, Sigmoid), (8, Silu), (4, Elu), (3, Linear)];
    let mut laws = vec![
        header(Kind::Ann, &[(9, Relu), (7, Softplus), (6, Tanh), (5, Silu), (5, Elu), (4, Sigmoid)], rows),
        header(Kind::Ann, &[], rows),
        header(Kind::energy(Symmetry::Isotropic), &[], rows),
        header(
            Kind::Energy { symmetry: Symmetry::Monoclinic, axes, polyconvex: false, norms: false },
            &smooth,
            rows,
        ),
    ];
    laws.extend(
        Symmetry::ALL.map(|symmetry| header(Kind::energy(symmetry), &[(8, Softplus), (8, Softplus)], rows)),
    );
    for symmetry in [Symmetry::Orthotropic, Symmetry::Transverse, Symmetry::Isotropic] {
        laws.push(header(Kind::polyconvex_energy(symmetry), &[(8, Softplus), (7, Elu), (8, Softplus)], rows));
        laws.push(header(
            Kind::Energy { symmetry, axes, polyconvex: true, norms: false },
            &[(8, Softplus)],
            rows,
        ));
    }
    laws.push(header(Kind::polyconvex_energy(Symmetry::Orthotropic), &[], rows));
    laws.push(header(Kind::energy_of_norms(), &[(8, Softplus), (7, Elu)], rows));
    laws
}

/// Treloar's three tests from a neo-Hookean law: the loss of nominal stresses equals that of the law without
/// burn, and the law predicts a test outside its training.
#[test]
fn nominal_stresses_without_the_pressure() {
    let modulus = 0.4e6;
    let row = |k: usize, mode: polycore::constitutive::hyperelastic::data::Mode| {
        let l = 1.1 + 0.1 * k as f64;
        let second = mode.second_stretch(l);
        let nominal = modulus * (l - 1.0 / (l * second).powi(2) / l);
        DataRow::from_nominal(k as u64, [l, second], [nominal, 0.0]).unwrap()
    };
    let [bar, sheet, strip] = polycore::constitutive::hyperelastic::data::Mode::TESTS;
    let learnt: Vec<DataRow> = (0..20).flat_map(|k| [row(k, bar), row(k, sheet)]).collect();
    let rows: Vec<&DataRow> = learnt.iter().collect();
    for kind in [
        Kind::energy(Symmetry::Isotropic),
        Kind::polyconvex_energy(Symmetry::Isotropic),
        Kind::energy_of_norms(),
    ] {
        let header = header(kind.clone(), &[(8, Softplus)], &rows);
        let training = trained(&header, &rows, SHORT);
        let burn: f64 = training.squares(&training.train).iter().sum();
        let law = ensemble(header.clone(), &[training.state().weights.clone()]).unwrap();
        let plain = crate::eval::errors(&law, learnt.iter()).unwrap().mean_square() / 1e12;
        // burn uses f32
        assert!((burn / plain - 1.0).abs() < 1e-4, "{kind:?}: {burn} {plain}");
        let settings = Settings { epochs: 1500, learning_rate: 0.02, schedule: Schedule::Cosine, ..SHORT };
        let law = ensemble(header.clone(), &[trained(&header, &rows, settings).best().to_vec()]).unwrap();
        let unseen: Vec<DataRow> = (0..20).map(|k| row(k, strip)).collect();
        let found = crate::eval::agreement(&law, unseen.iter()).unwrap().unwrap();
        assert_eq!(found.count, 20);
        assert!(found.r2.unwrap() > 0.999, "{kind:?}: {found:?}");
    }
}

/// The loss in burn equals that of the stresses of the law without burn.
#[test]
fn burn_and_inference_agree() {
    let rows = rows_of_a_law();
    let rows: Vec<&DataRow> = rows.iter().collect();
    for header in laws(&rows) {
        let training = trained(&header, &rows, SHORT);
        let law = ensemble(header.clone(), &[training.state().weights.clone()]).unwrap();
        let mut expected = [0.0; 6];
        let mut memory = Workspace::default();
        for row in &rows {
            let error = law.stress(&row.c, &mut memory).unwrap().stress - row.s;
            for a in 0..6 {
                expected[a] += (error[a] / 1e6).powi(2) / rows.len() as f64;
            }
        }
        let burn = training.squares(&training.train);
        let total: f64 = expected.iter().sum();
        assert!(total > 1.0, "{total}");
        for a in 0..6 {
            // a hundred roundings of f32 (6e-8) on stresses up to ten times the errors that are squared here
            assert!((burn[a] - expected[a]).abs() < 1e-4 * total, "{:?}: {burn:?} {expected:?}", header.kind);
        }
    }
}

/// The change of the loss along its gradient equals the norm of the gradient.
#[test]
fn gradients_are_derivatives_of_the_loss() {
    let rows = rows_of_a_law();
    let rows: Vec<&DataRow> = rows.iter().collect();
    for header in laws(&rows) {
        let training = Training::new(&header, &rows, &[], SHORT).unwrap();
        let batch = training.train.batch(&(0..rows.len()).collect::<Vec<_>>());
        let weights = &training.state.weights;
        let step = training.model.step(&training.layout, weights, &batch);
        let gradient: Vec<f32> = step.gradients.layers.iter().flatten().flatten().copied().collect();
        assert_eq!(gradient.len(), weights.len());
        let norm = gradient.iter().map(|g| f64::from(*g).powi(2)).sum::<f64>().sqrt();
        let at = |distance: f64| {
            let moved =
                weights.iter().zip(&gradient).map(|(w, g)| w + (distance * f64::from(*g) / norm) as f32);
            let moved: Vec<f32> = moved.collect();
            training.model.step(&training.layout, &moved, &batch).loss
        };
        let slope = (at(2e-3) - at(-2e-3)) / 4e-3;
        // rounding 6e-8/2e-3 of the loss, curvature, and kinks of ReLU
        assert!((slope / norm - 1.0).abs() < 2e-2, "{:?}: {slope} {norm}", header.kind);
    }
}

#[test]
fn reruns_and_resumed_runs_have_the_same_bits() {
    let rows = rows_of_a_law();
    let rows: Vec<&DataRow> = rows.iter().collect();
    let (learnt, kept) = rows.split_at(400);
    let header = header(Kind::energy(Symmetry::Orthotropic), &[(8, Softplus)], learnt);
    let settings = Settings { epochs: 4, schedule: Schedule::Cosine, ..SHORT };
    let bits = |state: &TrainingState| {
        let weights = state.weights.iter().chain(&state.best).map(|w| w.to_bits()).collect::<Vec<_>>();
        let losses: Vec<_> = state.history.iter().map(|e| (e.train.to_bits(), e.judged.to_bits())).collect();
        (weights, losses)
    };
    let run = || {
        let mut training = Training::new(&header, learnt, kept, settings).unwrap();
        while training.ending().is_none() {
            training.epoch().unwrap();
        }
        bits(training.state())
    };
    let undisturbed = run();
    assert_eq!(run(), undisturbed);
    let mut first = Training::new(&header, learnt, kept, settings).unwrap();
    first.epoch().unwrap();
    let stored = serde_json::to_vec(first.state()).unwrap();
    let mut second =
        Training::resume(&header, learnt, kept, settings, serde_json::from_slice(&stored).unwrap()).unwrap();
    while second.ending().is_none() {
        second.epoch().unwrap();
    }
    assert_eq!(bits(second.state()), undisturbed);
    // another seed gives another network
    let other = Training::new(&header, learnt, kept, Settings { seed: 6, ..settings }).unwrap();
    assert_ne!(other.state().weights, first.state().weights);
}

/// Bounded weights are never negative, after any step, and resumed trainings are bit-identical.
#[test]
fn weights_of_a_polyconvex_energy_keep_their_sign() {
    let rows = rows_of_a_law();
    let rows: Vec<&DataRow> = rows.iter().collect();
    let header =
        header(Kind::polyconvex_energy(Symmetry::Orthotropic), &[(8, Softplus), (8, Softplus)], &rows);
    let settings = Settings { learning_rate: 0.1, epochs: 4, ..SHORT };
    let mut training = Training::new(&header, &rows, &[], settings).unwrap();
    for epoch in 0..4 {
        training.epoch().unwrap();
        let weights = &training.state().weights;
        // 6 of 7 inputs, then all; only the weights of J and the biases may be negative
        let layout = &training.layout;
        let bounded =
            weights[..48].iter().chain(&weights[layout.weights(1)]).chain(&weights[layout.weights(2)]);
        assert!(bounded.clone().all(|weight| *weight >= 0.0) && bounded.clone().any(|weight| *weight == 0.0));
        assert!(weights[48..56].iter().any(|weight| *weight < 0.0));
        // the weights form a valid law
        ensemble(header.clone(), std::slice::from_ref(weights)).unwrap();
        if epoch == 1 {
            let state = serde_json::from_str(&serde_json::to_string(training.state()).unwrap()).unwrap();
            training = Training::resume(&header, &rows, &[], settings, state).unwrap();
        }
    }
    let undisturbed = trained(&header, &rows, settings);
    assert_eq!(undisturbed.state().weights, training.state().weights);
}

#[test]
fn divergence_is_named_and_loses_nothing() {
    let rows = rows_of_a_law();
    let rows: Vec<&DataRow> = rows.iter().collect();
    let hidden = [(32, Relu), (32, Softplus), (32, Relu), (32, Softplus)];
    let header = header(Kind::Ann, &hidden, &rows);
    let mut training = trained(&header, &rows, SHORT);
    training.settings.learning_rate = 1e10;
    training.settings.epochs = 50;
    let mut before = training.state().clone();
    let error = loop {
        match training.epoch() {
            Ok(_) => before = training.state().clone(),
            Err(error) => break error,
        }
    };
    assert!(matches!(error, Error::Diverged { batch: 1.., learning_rate: 1e10, .. }), "{error}");
    assert!(error.to_string().contains("learning rate 1e10"), "{error}");
    assert_eq!(error.exit_code(), 1);
    assert_eq!(*training.state(), before);
    assert!(training.best().iter().all(|weight| weight.is_finite()));
}

/// Noiseless law of the test rows, evaluated between its paths.
#[test]
fn a_known_law_is_learnt() {
    let rows = rows_of_a_law();
    let rows: Vec<&DataRow> = rows.iter().collect();
    let c = Voigt::new(1.2, 1.1, 1.0, 0.0, 0.0, 0.0);
    let expected = neo_hookean(&c);
    // −μ ln J + λ/2 ln²J is convex for J < e: the law is polyconvex at the rows
    for (kind, activation, learning_rate) in [
        (Kind::Ann, Tanh, 5e-3),
        (Kind::energy(Symmetry::Orthotropic), Softplus, 5e-3),
        (Kind::polyconvex_energy(Symmetry::Orthotropic), Softplus, 2e-2),
        (Kind::polyconvex_energy(Symmetry::Transverse), Softplus, 2e-2),
        (Kind::polyconvex_energy(Symmetry::Isotropic), Softplus, 2e-2),
    ] {
        let header = header(kind.clone(), &[(24, activation), (24, activation)], &rows);
        let settings = Settings {
            epochs: 200,
            learning_rate,
            schedule: Schedule::Cosine,
            batch: 32,
            ..Settings::default()
        };
        let training = trained(&header, &rows, settings);
        let history = training.state().history();
        let (first, last) = (history[0].train, history[199].train);
        assert!(last < 1e-3 * first && last < 40.0, "{kind:?}: {first} {last} MPa²");
        let law = ensemble(header, &[training.best().to_vec()]).unwrap();
        let stress = law.stress(&c, &mut Workspace::default()).unwrap().stress;
        // interpolation between paths: 3 % is an order above the error on the rows
        assert!((stress - expected).norm() < 0.03 * expected.norm(), "{kind:?}: {stress} {expected}");
    }
}

/// Returns rows of rubber: S = μ(1 − p C⁻¹) with det F = 1 to eight decimals, μ = 0.6 MPa, p from σ₃₃ = 0;
/// stretched and sheared.
fn rows_of_rubber() -> Vec<DataRow> {
    let mut rows = Vec::new();
    for run in 0..24 {
        for sample in 0..15u32 {
            let part = f64::from(sample) / 14.0;
            let (x, y) = (1.0 + 0.08 * f64::from(run % 6) * part, 1.0 + 0.1 * f64::from(run / 6) * part);
            let shear = if run % 2 == 0 { 0.3 * part } else { 0.0 };
            let tidy = |value: f64| (value * 1e8).round() / 1e8;
            let matrix = Tensor::new(x, shear, 0.0, 0.0, y, 0.0, 0.0, 0.0, 1.0 / (x * y)).map(tidy);
            let f = DeformationGradient::new(matrix).unwrap();
            let c = f.right_cauchy_green();
            let s = 0.6e6 * (Tensor::identity() - c[(2, 2)] * c.try_inverse().unwrap());
            rows.push(DataRow::new(
                u64::from(sample),
                f64::NAN,
                f,
                cauchy_from_material(&f, &voigt::from_stress(&s)),
            ));
        }
    }
    rows
}

/// A constant invariant, I₃ = 1, is not amplified: the law is right between its runs, where the last digits
/// differ.
#[test]
fn incompressible_rubber_is_learnt() {
    let rows = rows_of_rubber();
    let (learnt, kept): (Vec<_>, Vec<_>) = rows.iter().enumerate().partition(|(k, _)| k / 15 % 5 != 2);
    let (learnt, kept): (Vec<&DataRow>, Vec<&DataRow>) =
        (learnt.into_iter().map(|(_, row)| row).collect(), kept.into_iter().map(|(_, row)| row).collect());
    let settings = Settings { epochs: 500, learning_rate: 1e-2, schedule: Schedule::Cosine, ..SHORT };
    let header = header(Kind::energy(Symmetry::Isotropic), &[(16, Softplus), (16, Softplus)], &learnt);
    let training = trained(&header, &learnt, settings);
    let law = ensemble(header, &[training.best().to_vec()]).unwrap();
    let errors = crate::eval::errors(&law, kept.iter().copied()).unwrap();
    let size = kept.iter().map(|row| row.s.norm_squared()).sum::<f64>() / kept.len() as f64;
    let relative = (errors.mean_square() / size).sqrt();
    // runs between training runs; standardised by its own deviation, I₃ would be amplified rounding
    assert!(relative < 0.1, "{relative}");
}

/// An ensemble flags strains at which its members disagree more than on the training rows.
#[test]
fn spread_has_a_limit() {
    let rows = rows_of_a_law();
    let all: Vec<&DataRow> = rows.iter().collect();
    // the six shorter runs, in the same directions
    let (kept, learnt) = all.split_at(240);
    let settings = Settings { epochs: 60, learning_rate: 5e-3, ..SHORT };
    let header = header(Kind::Ann, &[(16, Tanh), (16, Tanh)], learnt);
    let member = |seed: u64| trained(&header, learnt, Settings { seed, ..settings }).best().to_vec();
    let members: Vec<Vec<f32>> = (1..=3).map(member).collect();
    let strains: Vec<Voigt> = learnt.iter().map(|row| row.c).collect();
    let law = ensemble(header.clone(), &members).unwrap();
    assert_eq!(law.header().spread_limit, None);
    let law = law.with_spread_limit(&strains).unwrap();
    let limit = law.header().spread_limit.unwrap();
    assert!(limit > 0.0 && limit < 1e9, "{limit} Pa");
    let mut memory = Workspace::default();
    let mut flagged = |c: &Voigt| law.stress(c, &mut memory).unwrap().flags.spread;
    // flags: none of the training rows, few of similar runs, most far rows
    assert!(!strains.iter().any(&mut flagged));
    assert!(kept.iter().filter(|row| flagged(&row.c)).count() * 10 < kept.len());
    let far = (0..20).map(|k| Voigt::new(2.5 + 0.1 * f64::from(k), 0.4, 2.0, 0.0, 0.0, 0.0));
    assert!(far.filter(&mut flagged).count() >= 18);
    // a single member, or equal members, never disagree
    let alone = ensemble(header.clone(), &members[..1]).unwrap().with_spread_limit(&strains).unwrap();
    assert_eq!(alone.header().spread_limit, None);
    let same = vec![members[0].clone(); 2];
    let same = ensemble(header, &same).unwrap().with_spread_limit(&strains).unwrap();
    assert_eq!(same.header().spread_limit, None);
}

#[test]
fn early_stopping_keeps_the_best() {
    let rows = rows_of_a_law();
    let rows: Vec<&DataRow> = rows.iter().collect();
    let header = header(Kind::Ann, &[(8, Tanh)], &rows[..80]);
    let settings = Settings { epochs: 500, patience: Some(3), learning_rate: 0.05, ..SHORT };
    let mut training = Training::new(&header, &rows[..80], &rows[200..280], settings).unwrap();
    while training.ending().is_none() {
        training.epoch().unwrap();
    }
    assert_eq!(training.ending(), Some(Ending::Stopped));
    let state = training.state();
    let losses: Vec<f64> = state.history().iter().map(|epoch| epoch.validation.unwrap()).collect();
    let least = losses.iter().copied().fold(f64::INFINITY, f64::min);
    assert_eq!(losses[state.best_epoch() as usize - 1], least);
    assert_eq!(losses.len(), state.best_epoch() as usize + 3);
    // the best weights have the lowest loss
    let mut best = Training::new(&header, &rows[..80], &rows[200..280], settings).unwrap();
    best.state.weights.clone_from(&state.best);
    let validation = best.squares(best.validation.as_ref().unwrap());
    assert_eq!(validation.iter().sum::<f64>(), least);
}

#[test]
fn extremes() {
    let rows = rows_of_a_law();
    let all: Vec<&DataRow> = rows.iter().collect();
    // one row and repeated rows can be trained
    for few in [vec![&rows[30]], vec![&rows[30]; 5]] {
        for (kind, activation) in [
            (Kind::Ann, Tanh),
            (Kind::energy(Symmetry::Transverse), Tanh),
            (Kind::polyconvex_energy(Symmetry::Transverse), Softplus),
        ] {
            let header = header(kind, &[(4, activation)], &few);
            assert!(trained(&header, &few, SHORT).best().iter().all(|weight| weight.is_finite()));
        }
    }
    assert!(Training::new(&header(Kind::Ann, &[], &all), &[], &all, SHORT).is_err());
    let relu = header(Kind::energy(Symmetry::Isotropic), &[(4, Relu)], &all);
    let error = Training::new(&relu, &all, &[], SHORT).err().unwrap().to_string();
    assert!(error.contains("activation of an energy: found relu"), "{error}");
    // state of another network
    let small = Training::new(&header(Kind::Ann, &[(4, Tanh)], &all), &all, &[], SHORT).unwrap();
    let other = header(Kind::Ann, &[(5, Tanh)], &all);
    let error = Training::resume(&other, &all, &[], SHORT, small.state().clone()).err().unwrap().to_string();
    assert!(error.contains("found 58; allowed: 71"), "{error}");
    for (settings, part) in [
        (Settings { epochs: 0, ..SHORT }, "epochs: found 0"),
        (Settings { batch: 0, ..SHORT }, "batch: found 0"),
        (Settings { learning_rate: f64::NAN, ..SHORT }, "learning rate: found NaN"),
        (Settings { learning_rate: -1.0, ..SHORT }, "learning rate: found -1"),
        (Settings { patience: Some(0), ..SHORT }, "patience: found 0"),
    ] {
        let error = settings.check().unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn schedules() {
    let cosine = Settings { epochs: 11, learning_rate: 0.1, schedule: Schedule::Cosine, ..SHORT };
    assert!((cosine.rate(0) - 0.1).abs() < 1e-15 && (cosine.rate(10) - 0.001).abs() < 1e-15);
    assert!((cosine.rate(5) - 0.0505).abs() < 1e-15);
    // beyond the end, and for a single epoch
    assert!((cosine.rate(20) - 0.001).abs() < 1e-15);
    assert!((Settings { epochs: 1, ..cosine }.rate(0) - 0.1).abs() < 1e-15);
    assert_eq!(SHORT.rate(2), 1e-3);
}

/// Laws trained on softening data, which push weights against their bound.
#[test]
fn trained_on_softening_data() {
    let mut rows = rows_of_a_law();
    for row in &mut rows {
        let strain = voigt::strain_from_right_cauchy_green(&row.c);
        let softer = row.s / (1.0 + strain.norm_squared() / 0.02);
        *row = DataRow::new(
            row.sample,
            row.time,
            row.deformation,
            cauchy_from_material(&row.deformation, &softer),
        );
    }
    let rows: Vec<&DataRow> = rows.iter().collect();
    let mut random = crate::random::SplitMix64::new(9);
    let mut train = |kind: Kind| {
        let header = header(kind, &[(12, Softplus), (12, Softplus)], &rows);
        let training =
            trained(&header, &rows, Settings { epochs: 60, learning_rate: 1e-2, ..Settings::default() });
        let law = ensemble(header, &[training.best().to_vec()]).unwrap();
        // a trained model satisfies the checks of any law
        let found = verify::Deviations::measure(&law, &verify::deformations()[..4]).unwrap();
        assert!(found.stress.unwrap() < 2e-8 && found.tangent < 2e-8 && found.asymmetry < 1e-14, "{found:?}");
        assert!(found.stress_at_rest == 0.0 && found.objectivity < 1e-12 && found.bits == 0.0, "{found:?}");
        (training.state().best_loss(), verify::count_ellipticity_losses(&law, 200, &mut random).unwrap(), law)
    };
    for symmetry in [Symmetry::Orthotropic, Symmetry::Transverse, Symmetry::Isotropic] {
        let (bound, lost, law) = train(Kind::polyconvex_energy(symmetry));
        let stopped = |layer: &crate::network::Layer<f64>| layer.weights.contains(&0.0);
        assert!(lost == 0 && law.members()[0].layers().iter().any(stopped), "{symmetry:?}: {lost}");
        let (free, lost, _) = train(Kind::energy(symmetry));
        // effect of the bound; the data are not elliptic
        assert!(lost > 0 && free < 0.5 * bound, "{symmetry:?}: {lost}, {free} {bound} MPa²");
    }
}
