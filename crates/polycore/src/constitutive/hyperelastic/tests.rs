//! Checks common to all laws of [`all`], and closed forms for each.

use super::*;
use crate::constitutive::verify::deformations;
use crate::tensor::StressMeasure;

const IDENTITY: [f64; 3] = [1.0; 3];

pub(super) fn rotation() -> Tensor {
    *nalgebra::Rotation3::from_euler_angles(0.3, -1.1, 2.0).matrix()
}

fn shifted(f: &DeformationGradient, by: &Tensor) -> DeformationGradient {
    DeformationGradient::new(f.matrix() + by).unwrap()
}

/// Step of the central differences: truncation h² ~ 1e-10 and rounding ε/h ~ 2e-11 of the modulus.
const STEP: f64 = 1e-5;
const DIFFERENCE: f64 = 2e-8;

fn check(law: &dyn Hyperelastic, f: &DeformationGradient) {
    let name = law.name();
    let pk1 = law.first_piola_kirchhoff(f).unwrap();
    let pk2 = law.second_piola_kirchhoff(f).unwrap();
    let cauchy = law.cauchy(f).unwrap();
    let tangent = law.material_tangent(f).unwrap();
    let energy = law.energy(f).unwrap();
    // of the stress and tangent themselves, which the printed forms and the loose pressure may dominate
    let scale = tangent.amax().max(pk1.amax());

    // P = ∂W/∂F
    for i in 0..3 {
        for j in 0..3 {
            let mut by = Tensor::zeros();
            by[(i, j)] = STEP;
            let (up, down) = (law.energy(&shifted(f, &by)).unwrap(), law.energy(&shifted(f, &-by)).unwrap());
            let slope = (up - down) / (2.0 * STEP);
            assert!(
                (slope - pk1[(i, j)]).abs() < DIFFERENCE * scale,
                "{name}: P{i}{j} {} {slope}",
                pk1[(i, j)]
            );
        }
    }
    // symmetries
    assert_eq!(pk2, pk2.transpose(), "{name}");
    assert_eq!(cauchy, cauchy.transpose(), "{name}");
    assert!((tangent - tangent.transpose()).amax() <= 1e-14 * tangent.amax(), "{name}");
    // the measures are one stress
    let from_pk2 = f.convert_stress(&pk2, StressMeasure::SecondPiolaKirchhoff, StressMeasure::Cauchy);
    assert!((from_pk2 - cauchy).amax() < 1e-13 * scale, "{name}");
    assert!((f.matrix() * pk2 - pk1).amax() < 1e-13 * scale, "{name}");
    // objectivity: QF; isotropy: FQ
    let q = rotation();
    let turned = DeformationGradient::new(q * f.matrix()).unwrap();
    assert!((law.energy(&turned).unwrap() - energy).abs() < 1e-13 * scale.max(energy), "{name}");
    assert!((law.second_piola_kirchhoff(&turned).unwrap() - pk2).amax() < 1e-13 * scale, "{name}");
    let expected = q * cauchy * q.transpose();
    assert!((law.cauchy(&turned).unwrap() - expected).amax() < 1e-13 * scale, "{name}");
    let turned = DeformationGradient::new(f.matrix() * q.transpose()).unwrap();
    let expected = q * pk2 * q.transpose();
    assert!((law.second_piola_kirchhoff(&turned).unwrap() - expected).amax() < 1e-13 * scale, "{name}");
    let expected = voigt::transform_tangent(&tangent, &q);
    assert!((law.material_tangent(&turned).unwrap() - expected).amax() < 1e-12 * scale, "{name}");
}

#[test]
fn every_law_passes_the_shared_check() {
    let laws = all().unwrap();
    assert_eq!(laws.len(), MODELS.len() * 4 + COMPRESSIBLE_MODELS.len() + 4);
    let mut at_rest: f64 = 0.0;
    for law in &laws {
        at_rest = at_rest.max(law.energy_at(IDENTITY).unwrap().abs() / law.shear_modulus());
        for f in deformations() {
            check(law, &f);
        }
    }
    evidence::at_most("energy at rest over the shear modulus, every law", at_rest, 1e-12);
}

/// Uniaxial nominal stress 3με(1 − ε + O(ε²)) for small ε, in tension and compression, for every
/// incompressible law.
#[test]
fn small_strain_limit_of_the_incompressible_laws() {
    for model in MODELS {
        let law = model.law(model.example).unwrap();
        for strain in [1e-7, -1e-7] {
            let modulus = homogeneous::uniaxial(&law, 1.0 + strain).unwrap() / (3.0 * strain);
            // ε itself is rounded to 1e-9 relative in 1 + ε
            let error = (modulus / law.shear_modulus() - 1.0).abs();
            assert!(error < 2e-7, "{}: {modulus} {}", model.key, law.shear_modulus());
        }
    }
}

/// Tests F = 1: the tangent is λ* 1⊗1 + 2μ𝕀 and, in the stress-free forms, S = 0; λ* is λ only for laws
/// linear in I₁.
#[test]
fn small_strain_limit_of_the_compressible_laws() {
    let lame = 1.7e6;
    for model in MODELS {
        let modulus = model.law(model.example).unwrap().shear_modulus();
        for volumetric in
            [Volumetric::Quadratic { lame }, Volumetric::Logarithmic { lame }, Volumetric::Ciarlet { lame }]
        {
            let law = Compressible::new(model.law(model.example).unwrap(), volumetric).unwrap();
            let response = law.response_at(IDENTITY).unwrap();
            assert!(response.stress.iter().all(|s| s.abs() < 1e-15 * modulus), "{}", law.name());
            for shear in response.shear {
                assert!((shear / modulus - 1.0).abs() < 1e-12, "{}: {shear} {modulus}", law.name());
            }
            assert!((law.shear_modulus() / modulus - 1.0).abs() < 1e-12, "{}", law.name());
        }
    }
    let bulk = |law: &str, p: &[f64]| {
        let law = model(law).unwrap().law(p).unwrap();
        Compressible::new(law, Volumetric::Quadratic { lame }).unwrap().bulk_modulus().unwrap()
    };
    // by hand from ∂²W/∂C∂C: λ + 2μ/3; with 4C₂ for Mooney–Rivlin (μ = 2(C₁ + C₂)); with 2μ/J_m for Gent
    assert!((bulk("neo-hookean", &[3e5]) - (lame + 2e5)).abs() < 1e-9 * lame);
    let mooney = bulk("mooney-rivlin", &[1e5, 5e4]);
    evidence::near("(1.21), bulk modulus, Pa", mooney, lame + 2e5 + 2e5, 1e-9 * lame);
    assert!((bulk("gent", &[3e5, 60.0]) - (lame + 1e4 + 2e5)).abs() < 1e-9 * lame);
}

/// Errata of chapter 1: (1.19) and (1.23) are stress free as printed, (1.21) is not: S(1) = (C₁ + 4C₂)·1.
#[test]
fn printed_mooney_rivlin_is_stressed_at_rest() {
    let (c1, c2) = (1.5e5, 2e4);
    let volumetric = Volumetric::Quadratic { lame: 1e6 };
    let rest = DeformationGradient::identity();
    let law = MooneyRivlin::new(c1, c2).unwrap();
    let printed = Compressible::with_coupling(law, volumetric, Coupling::AsPublished).unwrap();
    let stress = printed.second_piola_kirchhoff(&rest).unwrap();
    assert!((stress - Tensor::identity() * stress[(0, 0)]).amax() < 1e-9);
    evidence::near("(1.21) as printed, stress at rest, Pa", stress[(0, 0)], c1 + 4.0 * c2, 1e-9);
    let mended = Compressible::new(law, volumetric).unwrap();
    assert_eq!(mended.coupling_factor(), 2.0 * (c1 + 2.0 * c2));
    assert_eq!(mended.second_piola_kirchhoff(&rest).unwrap(), Tensor::zeros());

    let neo = NeoHookean::new(3e5).unwrap();
    let gent = Gent::new(3e5, 60.0).unwrap();
    for factor in [
        Compressible::with_coupling(neo, volumetric, Coupling::AsPublished).unwrap().coupling_factor(),
        Compressible::with_coupling(gent, Volumetric::None, Coupling::AsPublished).unwrap().coupling_factor(),
    ] {
        assert_eq!(factor, 3e5);
    }
    let chain = EightChain::new(3e5, 25.0).unwrap();
    let refused = Compressible::with_coupling(chain, volumetric, Coupling::AsPublished).unwrap_err();
    assert_eq!(refused, Error::NotPublished { law: "eight-chain".into() });
}

/// (1.23) without U: K = 2μ/3 + 2μ/J_m, hence ν = 1/(2 + J_m) with λ = 2μ/J_m.
#[test]
fn printed_gent_has_hardly_any_bulk_modulus() {
    let gent = Gent::new(3e5, 60.0).unwrap();
    let printed = Compressible::with_coupling(gent, Volumetric::None, Coupling::AsPublished).unwrap();
    let bulk = printed.bulk_modulus().unwrap();
    assert!((bulk - (2e5 + 1e4)).abs() < 1e-6);
    let poisson = (3.0 * bulk - 6e5) / (6.0 * bulk + 6e5);
    evidence::near("(1.23) as printed, Poisson's ratio", poisson, 1.0 / 62.0, 1e-12);
}

/// (1.21) and (1.17), corrected, written in tensors, with p = −J ∂W/∂J.
#[test]
fn stress_by_the_tensor_form_1_17() {
    let (c1, c2, lame) = (1.5, 0.4, 7.0);
    let law = MooneyRivlin::new(c1, c2).unwrap();
    let law = Compressible::new(law, Volumetric::Quadratic { lame }).unwrap();
    let mut worst: f64 = 0.0;
    for f in deformations() {
        let (c, jacobian) = (f.right_cauchy_green(), f.jacobian());
        let first = c.trace();
        let second = 0.5 * (first * first - (c * c).trace());
        let factor = 2.0 * (c1 + 2.0 * c2);
        let energy = c1 * (first - 3.0) + c2 * (second - 3.0) - factor * jacobian.ln()
            + 0.5 * lame * (jacobian - 1.0).powi(2);
        assert!((law.energy(&f).unwrap() - energy).abs() < 1e-13 * energy.abs().max(1.0));
        let pressure = factor - lame * jacobian * (jacobian - 1.0);
        let expected = Tensor::identity() * (2.0 * (c1 + first * c2))
            - c * (2.0 * c2)
            - c.try_inverse().unwrap() * pressure;
        let stress = law.second_piola_kirchhoff(&f).unwrap();
        worst = worst.max((stress - expected).amax() / expected.amax().max(1.0));
    }
    evidence::at_most("stress against (1.17) with the unit tensor", worst, 1e-13);
}

/// (1.28): half the diagonals of a unit cube, all eight of them, stretched by diag(λ₁, λ₂, λ₃).
#[test]
fn chain_stretch_is_that_of_a_half_diagonal() {
    let stretches = [1.9, 1.1, 0.6];
    let corner = nalgebra::Vector3::from(stretches) * 0.5;
    let chain_stretch = corner.norm() / 0.75_f64.sqrt();
    let law = EightChain::new(1.0, chain_stretch * chain_stretch * 0.999).unwrap();
    match law.energy_at(stretches) {
        Err(Error::Locked { value, .. }) => {
            evidence::at_most(
                "chain stretch against the half diagonal",
                (value - chain_stretch).abs(),
                1e-15,
            );
        }
        other => panic!("{other:?}"),
    }
}

/// W = ½ tr(E ℂ E) = 3/2 με² in isochoric uniaxial strain ε, also where ε² is below the rounding of the
/// printed sum.
#[test]
fn energy_of_small_strains_keeps_its_digits() {
    for model in MODELS {
        let law = model.law(model.example).unwrap();
        let law = Compressible::new(law, Volumetric::Quadratic { lame: 0.0 }).unwrap();
        // without U the volume is controlled by μ: shear, where λ₁λ₂ = 1 exactly
        let gamma = 1e-5_f64;
        let l = (0.5 * gamma).hypot(1.0) + 0.5 * gamma;
        let expected = 0.5 * law.shear_modulus() * gamma * gamma;
        let energy = law.energy_at([l, 1.0 / l, 1.0]).unwrap();
        // first-order terms cancel to rounding, ε/γ = 2e-11; the three-chain law subtracts energies of order
        // n
        let tolerance = if model.key == "three-chain" { 1e-4 } else { 1e-9 };
        let error = (energy / expected - 1.0).abs();
        assert!(error < tolerance, "{}: {energy} {expected}", model.key);
    }
}

/// Textbook closed forms of the nominal stress in uniaxial tension (Treloar, *The Physics of Rubber
/// Elasticity*).
#[test]
fn uniaxial_closed_forms() {
    let b = crate::langevin::inverse;
    for l in [0.3_f64, 0.9, 1.0 + 1e-9, 1.5, 3.0] {
        let kinematic = (l - 1.0) * (l * l + l + 1.0) / (l * l); // λ − λ⁻²
        let laws: [(Box<dyn Hyperelastic>, f64); 5] = [
            (Box::new(NeoHookean::new(2.0).unwrap()), 2.0 * kinematic),
            (Box::new(MooneyRivlin::new(2.0, 0.5).unwrap()), 2.0 * kinematic * (2.0 + 0.5 / l)),
            (Box::new(Gent::new(2.0, 30.0).unwrap()), 2.0 * kinematic * 30.0 / (33.0 - l * l - 2.0 / l)),
            (
                Box::new(Ogden::new(OgdenConvention::Thesis, &[(0.7, 1.7), (-0.2, -3.0)]).unwrap()),
                1.4 * (l.powf(0.7) - l.powf(-1.85)) - 0.4 * (l.powf(-4.0) - l.powf(0.5)),
            ),
            (
                Box::new(ThreeChain::new(3.0, 36.0).unwrap()),
                6.0 * (b(l / 6.0) - l.powf(-1.5) * b(l.powf(-0.5) / 6.0)),
            ),
        ];
        for (law, expected) in laws {
            let found = homogeneous::uniaxial(&law, l).unwrap();
            // the closed forms cancel near λ = 1: some ulp of their terms, which are below 4 there
            assert!(
                (found - expected).abs() < 1e-14 * expected.abs() + 2e-14,
                "{} {l} {found} {expected}",
                law.name()
            );
        }
    }
}

/// formulation.md, "Test numbers" of the eight-chain network: uniaxial, pure shear, equibiaxial P₁/μ₀ at
/// 1e-7.
#[test]
fn eight_chain_reference_numbers() {
    for (links, stretch, expected) in [
        (25.0, 2.0, [1.7803184, 1.9116696, 2.0588673]),
        (25.0, 3.0, [3.0671409, 3.1592624, 3.4714333]),
        (8.0, 1.5, [1.0743818, 1.2293979, 1.4433431]),
        (100.0, 3.0, [2.9287563, 3.006642, 3.0916001]),
    ] {
        let law = EightChain::from_shear_modulus(1.0, links).unwrap();
        let found = [
            homogeneous::uniaxial(&law, stretch).unwrap(),
            homogeneous::pure_shear(&law, stretch).unwrap()[0],
            homogeneous::equibiaxial(&law, stretch).unwrap(),
        ];
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-7, "n = {links}, λ = {stretch}: {found} {expected}");
        }
    }
}

/// P₁ in MPa by FElupe 11.3 with tensortrax, which differentiates the published energies, at (λ₁, λ₂): bar at
/// 0.6 and 2, (4, ½), strip at 2, sheet at 2. Ten decimals. FElupe shifts equal stretches by 1.5e-8 and van
/// der Waals' invariant by 1e-4 (6e-6 MPa): the last two rows, and polynomials of orders above two, are
/// mpmath's derivatives of the energies.
#[test]
fn laws_as_felupe_has_them() {
    let half = 0.5_f64.sqrt();
    let states = [[0.6, 0.6_f64.powf(-0.5)], [2.0, half], [4.0, 0.5], [2.0, 1.0], [2.0, 2.0]];
    let mut worst: f64 = 0.0;
    for (key, p, expected) in [
        ("reduced-polynomial-2", &[0.2, 2e-3][..], [-0.8831905185, 0.728, 2.00025, 0.78375, 0.8672343750]),
        (
            "polynomial-2",
            &[0.15, 0.02, 1e-3, 1e-4, 0.0],
            [-0.8054874074, 0.5747875, 1.4398945312, 0.6560625, 0.9587812500],
        ),
        (
            "reduced-polynomial-4",
            &[0.2, 2e-3, 5e-5, 2e-6],
            [-0.8835161965, 0.7303240000, 2.3705364375, 0.7869393750, 0.8864584574],
        ),
        (
            "reduced-polynomial-5",
            &[0.2, 2e-3, 5e-5, 2e-6, 1e-7],
            [-0.8835166998, 0.7303520000, 2.5013207461, 0.7869874292, 0.8877516128],
        ),
        (
            "reduced-polynomial-6",
            &[0.2, 2e-3, 5e-5, 2e-6, 1e-7, 5e-9],
            [-0.8835167207, 0.7303553600, 2.6072560360, 0.7869939165, 0.8881444087],
        ),
        (
            "polynomial-3",
            &[0.15, 0.02, 1e-3, 1e-4, 5e-5, 5e-5, 2e-6, 1e-6, 5e-7],
            [-0.8065544733, 0.5771735703, 1.6595910775, 0.6599532422, 1.0042406411],
        ),
        (
            "biderman",
            &[0.15, 0.02, 1e-3, 5e-5],
            [-0.8048722868, 0.5761, 1.6485328125, 0.6572226562, 0.9606292603],
        ),
        (
            "arruda-boyce",
            &[0.27, 5.0],
            [-0.6062234225, 0.4926759036, 1.2407572351, 0.5290252141, 0.5697548425],
        ),
        (
            "extended-tube",
            &[0.1867, 0.09693, 0.2169, 0.2],
            [-0.9731035725, 0.5512681624, 1.1591821151, 0.6602045239, 0.8846559175],
        ),
        (
            "van-der-waals",
            &[0.4, 11.0, 0.3, 0.1],
            [-0.8405626414, 0.5666502200, 1.0668932553, 0.6315080752, 0.7910146148],
        ),
    ] {
        let law = model(key).unwrap().law(p).unwrap();
        for ([first, second], expected) in states.into_iter().zip(expected) {
            let found = homogeneous::biaxial(&law, first, second).unwrap()[0];
            assert!((found - expected).abs() < 1e-9, "{key} {first} {second}: {found} {expected}");
            worst = worst.max((found - expected).abs());
        }
    }
    evidence::at_most("ten laws against FElupe and mpmath, nominal stress, MPa", worst, 1e-9);
}

/// Away from rest, where its curvature grows as 1/√x, van der Waals' law has its derivatives for any a.
#[test]
fn van_der_waals_away_from_rest() {
    let law = VanDerWaals::new(0.4e6, 9.0, 0.3, 0.2).unwrap();
    let away: Vec<_> = deformations().into_iter().skip(3).collect();
    for f in &away {
        check(&law, f);
    }
    let found = crate::constitutive::verify::Deviations::measure(&law, &away).unwrap();
    evidence::at_most("∂S/∂C of van der Waals' law against its tangent", found.tangent, 2e-8);
}

#[test]
fn long_chains_are_neo_hookean() {
    let neo = NeoHookean::new(1.0).unwrap();
    let laws: [Box<dyn Hyperelastic>; 3] = [
        Box::new(ThreeChain::new(1.0, 1e10).unwrap()),
        Box::new(EightChain::new(1.0, 1e10).unwrap()),
        Box::new(Gent::new(1.0, 1e10).unwrap()),
    ];
    for law in laws {
        for stretches in [[2.0, 1.0, 0.5], [3.0, 3.0, 1.0 / 9.0]] {
            // corrections are O(λ²/n); the energy is a difference of numbers n times its size
            let (energy, expected) = (law.energy_at(stretches).unwrap(), neo.energy_at(stretches).unwrap());
            assert!((energy - expected).abs() < 1e-5, "{} {energy} {expected}", law.name());
            let stress = homogeneous::biaxial(&law, stretches[0], stretches[1]).unwrap();
            let expected = homogeneous::biaxial(&neo, stretches[0], stretches[1]).unwrap();
            assert!((stress[0] - expected[0]).abs() < 1e-8, "{}", law.name());
        }
    }
}

/// Ogden's constants for Treloar's rubber (0.63, 0.0012, −0.01 MPa; 1.3, 5, −2), shear modulus ½Σμα = 0.4225
/// MPa, as published; in (1.24)'s own convention the same constants are twice as stiff.
#[test]
fn ogden_conventions() {
    let terms = [(0.63e6, 1.3), (0.0012e6, 5.0), (-0.01e6, -2.0)];
    let original = Ogden::new(OgdenConvention::Original, &terms).unwrap();
    evidence::near(
        "Ogden's own prefactor, shear modulus, Pa",
        original.shear_modulus(),
        0.4225e6,
        1e-9 * 0.4225e6,
    );
    let thesis = Ogden::new(OgdenConvention::Thesis, &terms).unwrap();
    evidence::near("(1.24), shear modulus, Pa", thesis.shear_modulus(), 0.845e6, 1e-9 * 0.845e6);
    let abaqus = Ogden::new(OgdenConvention::Abaqus, &[(0.4e6, 1.3)]).unwrap();
    assert_eq!(abaqus.shear_modulus(), 0.4e6);
    // the same law, written three ways
    for convention in [OgdenConvention::Thesis, OgdenConvention::Abaqus] {
        let rewritten = original.in_convention(convention);
        for l in [0.5, 2.0, 5.0] {
            let (a, b) = (homogeneous::uniaxial(&original, l), homogeneous::uniaxial(&rewritten, l));
            let (a, b) = (a.unwrap(), b.unwrap());
            assert!((a / b - 1.0).abs() < 1e-14, "{convention:?} {a} {b}");
        }
    }
    // Treloar's bar under Ogden's constants: within 0.1 MPa at λ = 7.133, where the data have 4.0812 MPa
    let nominal = homogeneous::uniaxial(&original, 7.133).unwrap();
    assert!((nominal - 4.08e6).abs() < 0.3e6, "{nominal}");
}
