//! Energies that are polyconvex by construction, and others that need not be.

use super::tests::deformations;
use super::*;
use crate::constitutive::network::Activation::{Softplus, Tanh};
use crate::constitutive::verify::count_ellipticity_losses;
use crate::random::SplitMix64;
use crate::tensor::{Tensor, voigt};
use nalgebra::Vector3;

fn is_polyconvex(law: &Surrogate<f64>) -> bool {
    law.header().kind.is_polyconvex()
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
    let laws: Vec<_> = examples().unwrap().into_iter().filter(|(_, law)| is_polyconvex(law)).collect();
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

/// No loss of ellipticity anywhere. Energies without the restriction lose it somewhere, so the check can
/// fail.
#[test]
fn waves_have_real_speeds() {
    let mut random = SplitMix64::new(9);
    let mut others = 0;
    for (name, law) in examples().unwrap().into_iter().filter(|(_, law)| law.header().kind != Kind::Ann) {
        let lost = count_ellipticity_losses(&law, 200, &mut random).unwrap();
        assert!(lost == 0 || !is_polyconvex(&law), "{name}: {lost}");
        others += lost;
    }
    assert!(others > 50, "{others}");
}

#[test]
fn what_no_polyconvex_energy_can_have() {
    let message = |kind: Kind, activation| {
        let header = Header::new(Kind::energy(Symmetry::Isotropic), &[(4, activation)], 1);
        let inputs = kind.inputs();
        let architecture = crate::constitutive::network::Architecture::new(inputs, &[(4, activation)], 1);
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
