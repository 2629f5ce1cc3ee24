//! Energies that are polyconvex by construction, and others that need not be.

use super::tests::{all, deformations};
use super::*;
use crate::network::Activation::{Softplus, Tanh};
use crate::random::SplitMix64;
use nalgebra::Vector3;
use polycore::tensor::Tensor;

fn is_polyconvex(law: &Surrogate<f64>) -> bool {
    law.header().kind.is_polyconvex()
}

/// Random tensors with a positive determinant, up to strains of several hundred per cent.
fn random_deformation(random: &mut SplitMix64) -> DeformationGradient {
    loop {
        let noise = Tensor::from_fn(|_, _| 3.0 * (random.uniform() - 0.5));
        if let Ok(f) = DeformationGradient::new(Tensor::identity() + noise)
            && f.matrix().determinant() > 0.05
        {
            return f;
        }
    }
}

/// W as a function of F, H = cof F and J taken as independent: the mean of the members.
fn free_energy(law: &Surrogate<f64>, f: &Tensor, h: &Tensor, j: f64) -> f64 {
    let Kind::Energy { symmetry, axes, norms, .. } = &law.header().kind else { panic!("an energy") };
    let axis = |i: usize| Vector3::from(axes[i]);
    let (plain, cofactor) =
        (|i: usize| (f * axis(i)).norm_squared(), |i: usize| (h * axis(i)).norm_squared());
    let x = match symmetry {
        Symmetry::Orthotropic => {
            vec![plain(0), plain(1), plain(2), cofactor(0), cofactor(1), cofactor(2), j]
        }
        Symmetry::Transverse => vec![f.norm_squared(), h.norm_squared(), plain(2), cofactor(2), j],
        _ if *norms => vec![f.norm(), h.norm(), j],
        _ => vec![f.norm_squared(), h.norm_squared(), j],
    };
    let mut tape = Tape::default();
    let member = |m: usize| {
        let input: Vec<f64> = (0..x.len()).map(|k| (x[k] - law.mean[k]) * law.inverse[k]).collect();
        let rest = &law.rest[m];
        let linear: f64 = (0..x.len()).map(|k| rest.invariants[k] * (x[k] - rest.at[k])).sum();
        law.output[0] * law.members[m].forward(&input, &mut tape)[0] + linear - rest.value
    };
    (0..law.members.len()).map(member).sum::<f64>() / law.members.len() as f64
}

/// W(½(p + q)) ≤ ½(W(p) + W(q)) in (F, cof F, J), and W(C) is that function on deformations.
#[test]
fn convex_in_deformation_cofactor_and_volume() {
    let mut random = SplitMix64::new(5);
    let mut memory = Workspace::default();
    let laws: Vec<_> = all().into_iter().filter(|(_, law)| is_polyconvex(law)).collect();
    assert_eq!(laws.len(), 7);
    for (name, law) in &laws {
        for f in deformations() {
            let (c, f) = (voigt::from_stress(&f.right_cauchy_green()), f.matrix());
            let cofactor = f.determinant() * f.try_inverse().unwrap().transpose();
            let energy = law.stress(&c, &mut memory).unwrap().energy.unwrap();
            let free = free_energy(law, f, &cofactor, f.determinant());
            // law: minus a remainder of rounding size
            assert!((free - energy).abs() < 1e-12 * (energy.abs() + 1e7), "{name}: {free} {energy}");
        }
        for _ in 0..500 {
            let tensor = |random: &mut SplitMix64| Tensor::from_fn(|_, _| 4.0 * (random.uniform() - 0.5));
            let (f, h, j) = (tensor(&mut random), tensor(&mut random), 4.0 * random.uniform() - 1.0);
            let (g, k, l) = (tensor(&mut random), tensor(&mut random), 4.0 * random.uniform() - 1.0);
            let ends = [free_energy(law, &f, &h, j), free_energy(law, &g, &k, l)];
            let middle = free_energy(law, &((f + g) / 2.0), &((h + k) / 2.0), (j + l) / 2.0);
            let slack = 1e-12 * (ends[0].abs() + ends[1].abs());
            assert!(middle <= (ends[0] + ends[1]) / 2.0 + slack, "{name}: {ends:?} {middle}");
        }
    }
}

/// At how many of 200 random F and directions (m ⊗ N) : 𝔸 : (m ⊗ N) < 0 with 𝔸_iJkL = F_iI F_kK ℂ_IJKL + δ_ik S_JL, beyond
/// rounding: waves without a real speed.
fn lost_waves(law: &Surrogate<f64>, random: &mut SplitMix64) -> u32 {
    let mut memory = Workspace::default();
    let mut lost = 0;
    for _ in 0..200 {
        let f = random_deformation(random);
        let c = voigt::from_stress(&f.right_cauchy_green());
        let answer = law.tangent(&c, &mut memory).unwrap();
        let (tangent, stress) = (answer.tangent.unwrap(), voigt::to_stress(&answer.stress));
        let mut unit = || Vector3::from_fn(|_, _| random.uniform() - 0.5).normalize();
        let (m, n) = (unit(), unit());
        let back = f.matrix().transpose() * m;
        let mut acoustic = n.dot(&(stress * n));
        for (i, j, k, l) in (0..81).map(|p| (p / 27, p / 9 % 3, p / 3 % 3, p % 3)) {
            acoustic += back[i] * n[j] * back[k] * n[l] * voigt::component(&tangent, i, j, k, l);
        }
        lost += u32::from(acoustic < -1e-12 * tangent.norm() * back.norm_squared());
    }
    lost
}

/// No loss of ellipticity anywhere. Energies without the restriction lose it somewhere, so the check can fail.
#[test]
fn waves_have_real_speeds() {
    let mut random = SplitMix64::new(9);
    let mut others = 0;
    for (name, law) in all().into_iter().filter(|(_, law)| law.header().kind != Kind::Ann) {
        let lost = lost_waves(&law, &mut random);
        assert!(lost == 0 || !is_polyconvex(&law), "{name}: {lost}");
        others += lost;
    }
    assert!(others > 50, "{others}");
}

/// The same of laws trained on data that soften, which push weights against their bound.
#[cfg(feature = "train")]
#[test]
fn trained_on_softening_data() {
    use crate::dataset::Row;
    use crate::train::{Settings, Training};
    let mut rows = crate::dataset::tests::rows_of_a_law();
    for row in &mut rows {
        let strain = voigt::strain_of_right_cauchy_green(&row.c);
        let softer = row.s / (1.0 + strain.norm_squared() / 0.02);
        *row = Row::new(row.sample, row.time, row.deformation, cauchy_of_material(&row.deformation, &softer));
    }
    let rows: Vec<&Row> = rows.iter().collect();
    let mut random = SplitMix64::new(9);
    let mut train = |kind: Kind| {
        let architecture =
            crate::network::Architecture::new(kind.inputs(), &[(12, Softplus), (12, Softplus)], 1);
        let header = Header::fitted(kind, architecture, 1, &rows, true).unwrap();
        let settings = Settings { epochs: 60, learning_rate: 1e-2, ..Settings::default() };
        let mut training = Training::new(&header, &rows, &[], settings).unwrap();
        while training.ending().is_none() {
            training.epoch().unwrap();
        }
        let law = crate::train::ensemble(header, &[training.best().to_vec()]).unwrap();
        (training.state().best_loss(), lost_waves(&law, &mut random), law)
    };
    for symmetry in [Symmetry::Orthotropic, Symmetry::Transverse, Symmetry::Isotropic] {
        let (bound, lost, law) = train(Kind::polyconvex_energy(symmetry));
        let stopped = |layer: &crate::network::Layer<f64>| layer.weights.contains(&0.0);
        assert!(lost == 0 && law.members()[0].layers().iter().any(stopped), "{symmetry:?}: {lost}");
        let (free, lost, _) = train(Kind::energy(symmetry));
        // what the bound costs, and that the data are not elliptic
        assert!(lost > 0 && free < 0.5 * bound, "{symmetry:?}: {lost}, {free} {bound} MPa²");
    }
}

#[test]
fn what_no_polyconvex_energy_can_have() {
    let message = |kind: Kind, activation| {
        let header = Header::new(Kind::energy(Symmetry::Isotropic), &[(4, activation)], 1);
        let inputs = kind.inputs();
        let architecture = crate::network::Architecture::new(inputs, &[(4, activation)], 1);
        let list = |value: f64| vec![value; inputs];
        let header =
            Header { kind, architecture, input_mean: list(0.0), input_deviation: list(1.0), ..header };
        Surrogate::<f64>::random(header, 1).map(|_| ()).map_err(|error| error.to_string())
    };
    assert_eq!(message(Kind::polyconvex_energy(Symmetry::Isotropic), Softplus), Ok(()));
    let error = message(Kind::polyconvex_energy(Symmetry::Isotropic), Tanh).unwrap_err();
    assert!(error.contains("Tanh") && error.contains("polyconvex"), "{error}");
    let error = message(Kind::polyconvex_energy(Symmetry::Monoclinic), Softplus).unwrap_err();
    assert!(error.contains("found Monoclinic; allowed: orthotropic"), "{error}");
    // weights of J may be negative, others not
    let kind = Kind::polyconvex_energy(Symmetry::Isotropic);
    let header = Header::new(kind, &[(2, Softplus)], 1);
    let with = |layer: usize, place: usize| {
        let law = Surrogate::<f64>::random(header.clone(), 1).unwrap();
        let mut layers = law.members()[0].layers().to_vec();
        layers[layer].weights[place] = -0.25;
        let network = Network::new(header.architecture.clone(), layers).unwrap();
        Surrogate::new(header.clone(), vec![network]).map(|_| ()).map_err(|error| error.to_string())
    };
    assert_eq!(with(0, 5), Ok(()));
    let error = with(0, 4).unwrap_err();
    assert!(error.contains("-0.25 for input 1 of layer 0"), "{error}");
    assert!(with(1, 0).unwrap_err().contains("0 or more"));
}
