//! One shared check over the list of all models, with random weights: what holds by construction holds for any.

use super::*;
use crate::network::Activation::{Elu, Relu, Sigmoid, Silu, Softplus, Tanh};
use crate::random::SplitMix64;
use nalgebra::Rotation3;
use polycore::tensor::{Tensor, Voigt6x6};

/// Axes turned by 0.3, −0.5, 0.8 about x, y, z.
fn turned() -> [[f64; 3]; 3] {
    let q = Rotation3::from_euler_angles(0.3, -0.5, 0.8);
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| q[(i, j)]))
}

/// Every kind, with activations that are smooth, ensembles, turned axes, and inputs that are scaled.
pub(super) fn all() -> Vec<(String, Surrogate<f64>)> {
    let mut laws = Vec::new();
    let mut add = |name: String, mut header: Header| {
        for (index, (mean, deviation)) in
            header.input_mean.iter_mut().zip(&mut header.input_deviation).enumerate()
        {
            (*mean, *deviation) = (0.5 + 0.1 * index as f64, 0.7 + 0.2 * index as f64);
        }
        laws.push((name, Surrogate::random(header, 11).unwrap()));
    };
    let smooth = [(20, Softplus), (12, Tanh), (9, Silu)];
    add("ann".into(), Header::new(Kind::Ann, &smooth, 1));
    add("ann × 3".into(), Header::new(Kind::Ann, &[(17, Sigmoid), (8, Softplus)], 3));
    for symmetry in Symmetry::ALL {
        add(format!("energy {symmetry:?}"), Header::new(Kind::energy(symmetry), &smooth, 1));
        let kind = Kind::Energy { symmetry, axes: turned(), polyconvex: false, norms: false };
        add(
            format!("energy {symmetry:?} turned × 2"),
            Header::new(kind, &[(16, Softplus), (16, Softplus)], 2),
        );
    }
    for symmetry in [Symmetry::Orthotropic, Symmetry::Transverse, Symmetry::Isotropic] {
        let hidden = [(16, Softplus), (9, Softplus)];
        add(format!("polyconvex {symmetry:?}"), Header::new(Kind::polyconvex_energy(symmetry), &hidden, 1));
        let kind = Kind::Energy { symmetry, axes: turned(), polyconvex: true, norms: false };
        add(format!("polyconvex {symmetry:?} turned × 2"), Header::new(kind, &[(12, Softplus), (7, Elu)], 2));
    }
    let hidden = [(12, Softplus), (7, Elu)];
    add("polyconvex, of norms".into(), Header::new(Kind::energy_of_norms(), &hidden, 2));
    laws
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

/// ℂ = 2 ∂S/∂C by central differences: with h = 1e-5 rounding is ε/h ≈ 2e-11 and truncation h² ≈ 1e-10 of 1 MPa.
#[test]
fn tangents_are_the_derivatives_of_the_stress() {
    let mut memory = Workspace::default();
    let step = 1e-5;
    for (name, law) in all() {
        for f in deformations() {
            let c = c_of(&f);
            let answer = law.tangent(&c, &mut memory).unwrap();
            assert_eq!(answer.stress, law.stress(&c, &mut memory).unwrap().stress, "{name}");
            let mut gradient = Voigt6x6::zeros();
            for b in 0..6 {
                let mut at = |by: f64| {
                    let mut c = c;
                    c[b] += by;
                    law.stress(&c, &mut memory).unwrap()
                };
                let (up, down) = (at(step), at(-step));
                gradient.set_column(b, &((up.stress - down.stress) / (2.0 * step)));
                if let (Some(up), Some(down)) = (up.energy, down.energy) {
                    let slope = (up - down) / (2.0 * step) * if b < 3 { 2.0 } else { 1.0 };
                    // rounding ε·W/h
                    let size = 1e6 + answer.stress.norm() + answer.energy.unwrap_or(0.0).abs();
                    assert!((slope - answer.stress[b]).abs() < 1e-9 * size, "{name} {b}: {slope}");
                }
            }
            let expected = voigt::tangent_from_stress_gradient(&gradient);
            let difference = (answer.tangent.unwrap() - expected).amax();
            assert!(difference < 1e-7 * expected.amax().max(1e6), "{name}: {difference:e}");
        }
    }
}

#[test]
fn an_energy_has_a_symmetric_tangent_no_stress_at_rest_and_no_work_in_cycles() {
    let mut memory = Workspace::default();
    let rest = Voigt::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    for (name, law) in all() {
        let tangent = law.tangent(&c_of(&deformations()[0]), &mut memory).unwrap().tangent.unwrap();
        let asymmetry = (tangent - tangent.transpose()).norm() / tangent.norm();
        let at_rest = law.stress(&rest, &mut memory).unwrap();
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
            assert!(asymmetry > 1e-3 && at_rest.stress.norm() > 1e3 && (work / size).abs() > 1e-4, "{name}");
            assert!(at_rest.energy.is_none());
        } else {
            assert!(asymmetry < 1e-14, "{name}: {asymmetry:e}");
            assert_eq!((at_rest.stress, at_rest.energy), (Voigt::zeros(), Some(0.0)), "{name}");
            assert!((work / size).abs() < 1e-10, "{name}: {:e}", work / size);
        }
    }
}

#[test]
fn objective_in_every_frame() {
    let mut memory = Workspace::default();
    let q = Rotation3::from_euler_angles(-0.4, 1.1, 0.2).into_inner();
    for (name, law) in all() {
        for f in deformations() {
            let turned = DeformationGradient::new(q * f.matrix()).unwrap();
            let (cauchy, _) = law.cauchy(&f, &mut memory).unwrap();
            let (other, _) = law.cauchy(&turned, &mut memory).unwrap();
            let expected = voigt::stress_transformation(&q) * cauchy;
            assert!((other - expected).norm() < 1e-12 * (expected.norm() + 1e6), "{name}");
        }
    }
}

/// S(Q C Qᵀ) = Q S(C) Qᵀ for generators of each group (in its material axes), and not for a general rotation unless
/// the material is isotropic.
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
fn doubts_are_flagged() {
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
    header.spread_limit = Some(spread * 0.99);
    let strict = Surrogate::<f64>::random(header, 1).unwrap();
    assert!(strict.stress(&c, &mut memory).unwrap().flags.spread);
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
            if let Ok(answer) = law.tangent(&c, &mut memory) {
                assert!(
                    answer.stress.iter().chain(&answer.tangent.unwrap()).all(|v| v.is_finite()),
                    "{name}"
                );
                assert!(answer.flags.any());
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
        let mut answers = vec![Answer::default(); points.len()];
        law.stresses(&points, &mut memory, &mut answers).unwrap();
        for (c, answer) in points.iter().zip(&answers) {
            assert_eq!(*answer, law.stress(c, &mut memory).unwrap(), "{name}");
        }
        law.tangents(&points, &mut memory, &mut answers).unwrap();
        assert_eq!(answers[17], law.tangent(&points[17], &mut memory).unwrap(), "{name}");
        let mut bad = points.clone();
        bad[19][1] = f64::NAN;
        let error = law.stresses(&bad, &mut memory, &mut answers).unwrap_err().to_string();
        assert!(error.contains("(point 19 of the list)") && error.contains("component 22 = NaN"), "{error}");
        assert!(law.stresses(&points, &mut memory, &mut answers[1..]).is_err());
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
