//! Properties that every model has by construction, beside [`crate::constitutive::verify`].

use super::*;
use crate::constitutive::network::Activation::{Elu, Linear, Relu, Softplus, Tanh};
use crate::constitutive::network::Layer;
use crate::random::SplitMix64;
use crate::tensor::{DeformationGradient, Tensor, voigt};
use nalgebra::Rotation3;

fn all() -> Vec<(String, Surrogate<f64>)> {
    examples().unwrap()
}

pub(super) fn deformations() -> Vec<DeformationGradient> {
    let mut random = SplitMix64::new(3);
    let mut f = || {
        let noise = Tensor::from_fn(|_, _| 0.6 * (random.uniform() - 0.5));
        DeformationGradient::new(Tensor::identity() + noise).unwrap()
    };
    (0..5).map(|_| f()).collect()
}

pub(super) fn c_of(f: &DeformationGradient) -> Voigt {
    voigt::from_stress(&f.right_cauchy_green())
}

#[test]
fn an_energy_does_no_work_in_cycles() {
    let mut memory = Workspace::default();
    let rest = Voigt::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    for (name, law) in all() {
        // a smooth closed loop in all six components; the trapezoidal rule converges exponentially on it
        let points = 256;
        let (mut work, mut size) = (0.0, 0.0);
        for k in 0..points {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(points);
            let phase = |a: usize| angle * (1 + a % 2) as f64 + a as f64;
            let amplitude = |a: usize| if a < 3 { 0.2 } else { 0.1 };
            let c = Voigt::from_fn(|a, _| rest[a] + amplitude(a) * phase(a).sin());
            let rate = Voigt::from_fn(|a, _| {
                amplitude(a) * (1 + a % 2) as f64 * phase(a).cos() * if a < 3 { 0.5 } else { 1.0 }
            });
            let power = law.stress(&c, &mut memory).unwrap().stress.dot(&rate);
            work += power;
            size += power.abs();
        }
        if law.header().kind == Kind::Ann {
            // what the thesis' map lacks
            assert!((work / size).abs() > 1e-4, "{name}");
        } else {
            assert!((work / size).abs() < 1e-10, "{name}: {:e}", work / size);
        }
    }
}

/// S(Q C Qᵀ) = Q S(C) Qᵀ for generators of each group (in its material axes), and not for a general rotation
/// unless the material is isotropic.
#[test]
fn invariant_under_the_group_and_nothing_more() {
    use std::f64::consts::PI;
    let mut memory = Workspace::default();
    let general = Rotation3::from_euler_angles(0.7, 0.4, -1.2).into_inner();
    let about_z = |angle: f64| Rotation3::from_euler_angles(0.0, 0.0, angle).into_inner();
    let about_x = Rotation3::from_euler_angles(PI, 0.0, 0.0).into_inner();
    for (name, law) in all() {
        let Kind::Energy { symmetry, axes, .. } = law.header().kind.clone() else { continue };
        let group = match symmetry {
            Symmetry::Triclinic => vec![],
            Symmetry::Monoclinic => vec![about_z(PI)],
            Symmetry::Orthotropic => vec![about_z(PI), about_x],
            Symmetry::Transverse => vec![about_z(0.9), about_x],
            Symmetry::Isotropic => vec![general],
        };
        let material = Tensor::from_fn(|i, j| axes[i][j]);
        let c = c_of(&deformations()[1]);
        let stress = law.stress(&c, &mut memory).unwrap().stress;
        let mut distance = |q: Tensor| {
            let t = voigt::stress_transformation(&(material.transpose() * q * material));
            (law.stress(&(t * c), &mut memory).unwrap().stress - t * stress).norm() / stress.norm()
        };
        for q in group {
            assert!(distance(q) < 1e-11, "{name}: {:e}", distance(q));
        }
        if symmetry != Symmetry::Isotropic {
            assert!(distance(general) > 1e-4, "{name}: {:e}", distance(general));
        }
        if symmetry == Symmetry::Monoclinic {
            assert!(distance(about_x) > 1e-4, "{name}");
        }
    }
}

#[test]
fn uncertainty_is_flagged() {
    let mut header = Header::new(Kind::energy(Symmetry::Orthotropic), &[(8, Softplus)], 4);
    header.training_box = [[0.8, 2.0], [0.8, 2.5], [1.0, 1.3], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]];
    let law = Surrogate::<f64>::random(header.clone(), 1).unwrap();
    let mut memory = Workspace::default();
    let inside = law.stress(&Voigt::new(1.1, 1.0, 1.2, 0.0, 0.0, 0.0), &mut memory).unwrap();
    assert!(!inside.flags.any() && inside.spread > 0.0);
    let beyond = law.stress(&Voigt::new(1.1, 1.0, 1.31, 0.0, 0.0, 0.0), &mut memory).unwrap();
    assert_eq!(beyond.flags.outside, [false, false, true, false, false, false]);
    assert_eq!(beyond.flags.unseen, [false; 6]);
    let sheared = law.stress(&Voigt::new(1.1, 1.0, 1.2, 0.01, 0.0, 0.0), &mut memory).unwrap();
    assert_eq!(sheared.flags.unseen, [false, false, false, true, false, false]);
    assert!(sheared.flags.any());
    // the spread by hand, from the members one by one
    let c = Voigt::new(1.1, 1.0, 1.2, 0.0, 0.0, 0.0);
    let single = |member: &Network<f64>| {
        let header = Header { members: 1, ..header.clone() };
        Surrogate::new(header, vec![member.clone()])
            .unwrap()
            .stress(&c, &mut Workspace::default())
            .unwrap()
            .stress
    };
    let stresses: Vec<Voigt> = law.members().iter().map(single).collect();
    let mean = stresses.iter().sum::<Voigt>() / 4.0;
    let spread = (stresses.iter().map(|s| (s - mean).norm_squared()).sum::<f64>() / 4.0).sqrt();
    assert!((mean - inside.stress).norm() < 1e-9 && (spread / inside.spread - 1.0).abs() < 1e-12);
    for a in 0..6 {
        let square = stresses.iter().map(|s| (s[a] - mean[a]).powi(2)).sum::<f64>() / 4.0;
        assert!((inside.deviation[a] - square.sqrt()).abs() < 1e-12 * spread, "component {a}");
    }
    header.spread_limit = Some(spread * 0.99);
    let strict = Surrogate::<f64>::random(header, 1).unwrap();
    assert!(strict.stress(&c, &mut memory).unwrap().flags.spread);
}

/// Linear networks: Sᵐ = Aᵐ c + bᵐ, with deviations in closed form; one member has none.
#[test]
fn the_deviation_of_linear_members() {
    let slopes: [f64; 4] = [1.0, 2.0, 4.0, 9.0];
    let header =
        |members: usize| Header { output_deviation: vec![1e6; 6], ..Header::new(Kind::Ann, &[], members) };
    // Sₐ = 10⁶ m (a + 1) xₐ + 10⁶ m², x the standardised input
    let member = |slope: &f64| {
        let weight = |i: usize| if i.is_multiple_of(7) { slope * (i / 7 + 1) as f64 } else { 0.0 };
        let (weights, bias) = ((0..36).map(weight).collect(), vec![slope * slope; 6]);
        let layer = Layer { weights, bias, activation: Linear };
        Network::<f64>::new(header(4).architecture, vec![layer]).unwrap()
    };
    let of =
        |slopes: &[f64]| Surrogate::new(header(slopes.len()), slopes.iter().map(member).collect()).unwrap();
    let (law, mut memory) = (of(&slopes), Workspace::default());
    for c in deformations().iter().map(c_of) {
        let found = law.stress(&c, &mut memory).unwrap();
        let x = law.features(&c).values;
        for a in 0..6 {
            let at = |m: &f64| 1e6 * (m * (a + 1) as f64 * x[a] + m * m);
            let mean = slopes.iter().map(at).sum::<f64>() / 4.0;
            let exact = (slopes.iter().map(|m| (at(m) - mean).powi(2)).sum::<f64>() / 4.0).sqrt();
            assert!((found.deviation[a] - exact).abs() < 1e-13 * found.spread, "{a}");
        }
        assert!((found.deviation.norm() / found.spread - 1.0).abs() < 1e-15);
        let alone = of(&slopes[1..2]).tangent(&c, &mut memory).unwrap();
        assert_eq!((alone.deviation, alone.spread), (Voigt::zeros(), 0.0));
    }
}

/// Turning the axes by 90° about 3 turns the deviations of isotropic energies, too: 11 ↔ 22, 13 ↔ 23.
#[test]
fn the_deviation_turns_with_the_axes() {
    let header = Header::new(Kind::energy(Symmetry::Isotropic), &[(8, Softplus)], 3);
    let (law, mut memory) = (Surrogate::<f64>::random(header, 5).unwrap(), Workspace::default());
    for c in deformations().iter().map(c_of) {
        let turned = Voigt::new(c[1], c[0], c[2], -c[3], -c[5], c[4]);
        let [here, there] = [c, turned].map(|c| law.stress(&c, &mut memory).unwrap());
        let d = there.deviation;
        let back = Voigt::new(d[1], d[0], d[2], d[3], d[5], d[4]);
        assert!(here.spread > 0.0 && (back - here.deviation).norm() < 1e-11 * here.spread);
    }
}

#[test]
fn extreme_deformations_are_errors_or_finite() {
    let mut memory = Workspace::default();
    for (name, law) in all() {
        for bad in [
            Voigt::new(f64::NAN, 1.0, 1.0, 0.0, 0.0, 0.0),
            Voigt::new(1.0, f64::INFINITY, 1.0, 0.0, 0.0, 0.0),
            Voigt::new(1.0, 1.0, 1.0, 1.0, 0.0, 0.0),
            Voigt::new(1.0, 0.0, 1.0, 0.0, 0.0, 0.0),
            Voigt::new(-1.0, -1.0, 1.0, 0.0, 0.0, 0.0),
        ] {
            assert!(law.stress(&bad, &mut memory).is_err(), "{name}");
        }
        for (size, near) in [(1e-12, 1.0), (1e4, 1e4), (1e150, 1e-30), (1e300, 1e300)] {
            let c = Voigt::new(size, near, 1.0, 0.0, 0.0, 0.0);
            if let Ok(prediction) = law.tangent(&c, &mut memory) {
                assert!(
                    prediction.stress.iter().chain(&prediction.tangent.unwrap()).all(|v| v.is_finite()),
                    "{name}"
                );
                assert!(prediction.flags.any());
            }
        }
    }
}

#[test]
fn lists_give_the_bits_of_single_points() {
    let mut random = SplitMix64::new(8);
    let point =
        |_| Voigt::from_fn(|a, _| if a < 3 { 0.8 + random.uniform() } else { 0.2 * random.uniform() });
    let points: Vec<Voigt> = (0..21).map(point).collect();
    let mut memory = Workspace::default();
    for (name, law) in all() {
        let mut predictions = vec![Prediction::default(); points.len()];
        law.stresses(&points, &mut memory, &mut predictions).unwrap();
        for (c, prediction) in points.iter().zip(&predictions) {
            assert_eq!(*prediction, law.stress(c, &mut memory).unwrap(), "{name}");
        }
        law.tangents(&points, &mut memory, &mut predictions).unwrap();
        assert_eq!(predictions[17], law.tangent(&points[17], &mut memory).unwrap(), "{name}");
        let mut bad = points.clone();
        bad[19][1] = f64::NAN;
        let error = law.stresses(&bad, &mut memory, &mut predictions).unwrap_err().to_string();
        assert!(error.contains("(point 19 of the list)") && error.contains("component 22 = NaN"), "{error}");
        assert!(law.stresses(&points, &mut memory, &mut predictions[1..]).is_err());
    }
}

#[test]
fn single_precision_agrees() {
    for (name, law) in all() {
        let single: Surrogate<f32> = law.convert().unwrap();
        let (mut memory, mut small) = (Workspace::default(), Workspace::default());
        for f in deformations() {
            let c = c_of(&f);
            let double = law.tangent(&c, &mut memory).unwrap();
            let narrow = single.tangent(&c.map(|v| v as f32), &mut small).unwrap();
            let (d, n) = (double.tangent.unwrap(), narrow.tangent.unwrap().map(f64::from));
            // a few hundred roundings of 6e-8 of numbers up to some times the result (S(I) is subtracted)
            assert!((d - n).norm() < 1e-3 * (d.norm() + 1e6), "{name}");
            let difference = (double.stress - narrow.stress.map(f64::from)).norm();
            assert!(difference < 1e-3 * (double.stress.norm() + 1e6), "{name}");
        }
    }
}

#[test]
fn files_keep_the_bits_and_refuse_what_does_not_fit() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("law.safetensors");
    let mut memory = Workspace::default();
    for (name, law) in all() {
        law.write(&path).unwrap();
        let back = Surrogate::read(&path).unwrap();
        assert_eq!((back.header(), back.members()), (law.header(), law.members()), "{name}");
        let c = c_of(&deformations()[2]);
        assert_eq!(back.tangent(&c, &mut memory).unwrap(), law.tangent(&c, &mut memory).unwrap());
    }
    let law = &all()[3].1;
    law.write(&path).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let fails = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        Surrogate::read(&path).unwrap_err().to_string()
    };
    for cut in [0, 7, 100, bytes.len() / 2, bytes.len() - 1] {
        assert!(fails(&bytes[..cut]).contains("no safetensors file"), "{cut}");
    }
    assert!(fails(b"run_id,kind\n").contains("no safetensors file"));
    // a header of another architecture, of the same length
    let swap = |from: &str, to: &str| {
        assert_eq!(from.len(), to.len());
        let at = bytes.windows(from.len()).position(|window| window == from.as_bytes()).expect(from);
        let mut changed = bytes.clone();
        changed[at..at + to.len()].copy_from_slice(to.as_bytes());
        changed
    };
    let error = fails(&swap("[6,16,16,1]", "[6,16,17,1]"));
    assert!(
        error.contains("`member0.layer1.weight` of shape [16, 16]; allowed") && error.contains("[17, 16]"),
        "{error}"
    );
    assert!(fails(&swap("[6,16,16,1]", "[7,16,16,1]")).contains("allowed: 6 inputs"));
    assert!(fails(&swap("mdsurrogate law 1", "mdsurrogate law 9")).contains("without the metadata"));
    assert!(fails(&swap("\\\"members\\\":2", "\\\"members\\\":1")).contains("12 tensors; allowed: 6"));
}

#[test]
fn headers_that_do_not_fit() {
    let good = Header::new(Kind::Ann, &[(4, Relu), (3, Elu)], 1);
    Surrogate::<f64>::random(good.clone(), 1).unwrap();
    let nan = || Header { input_mean: vec![f64::NAN; 6], ..good.clone() };
    for bad in [
        Header { members: 0, ..good.clone() },
        Header { input_mean: vec![0.0; 5], ..good.clone() },
        nan(),
        Header { input_deviation: vec![-1.0; 6], ..good.clone() },
        Header { kind: Kind::energy(Symmetry::Isotropic), ..good.clone() },
        Header { training_box: [[1.0, 0.0]; 6], ..good.clone() },
        Header { spread_limit: Some(0.0), ..good.clone() },
    ] {
        assert!(Surrogate::<f64>::random(bad.clone(), 1).is_err(), "{bad:?}");
    }
    for axes in
        [[[1.0, 0.0, 0.0]; 3], [[f64::NAN; 3]; 3], [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]]
    {
        let kind = Kind::Energy { symmetry: Symmetry::Transverse, axes, polyconvex: false, norms: false };
        let error = Surrogate::<f64>::random(Header::new(kind, &[(3, Tanh)], 1), 1).unwrap_err();
        assert!(error.to_string().contains("orthonormal"), "{error}");
    }
}
