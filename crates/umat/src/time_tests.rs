//! Histories of rubbers with branches through `umat_`.

use crate::RelaxingRubber;
use crate::tests::{UmatCall, call};
use polycore::constitutive::Workspace;
use polycore::constitutive::hyperelastic::{Compressible, EightChain, LopezPamies, NeoHookean, Volumetric};
use polycore::constitutive::viscoelastic::user_material::{self, state_count};
use polycore::constitutive::viscoelastic::{
    Branch, Increment, Mullins, Reaction, Shift, Spring, StrainSoftening, Viscoelastic, Viscosity,
};
use polycore::tensor::voigt::{self, PAIRS, Voigt, Voigt6x6};
use polycore::tensor::{DeformationGradient, Tensor};

const NAME: &str = "VISCOELASTIC_NEO_HOOKEAN_SEAL";
/// K and μ, MPa.
const ELASTIC: [f64; 2] = [20.0, 0.5];

/// All springs, viscosities and shifts but one.
fn branches() -> Vec<Branch> {
    let soft = StrainSoftening { amount: 1.5, shape: [0.9, 2.0, -5.0] };
    let wlf = Shift::Wlf { reference: 293.15, constants: [10.0, 100.0] };
    let thinning = Viscosity::KumarLopezPamies {
        start: 2.0,
        end: 0.01,
        thickening: 0.5,
        thinning: 4.0,
        exponents: [1.8, 0.3],
    };
    let power = Viscosity::BergstromBoyce { rate: 1.0, stress: 0.4, power: 3.0, creep: -0.5, offset: 0.05 };
    let glass = Viscosity::Eyring { rate: 0.05, stress: 0.1, pressure: 0.1, softening: Some(soft) };
    vec![
        Branch {
            spring: Spring::NeoHookean(NeoHookean::new(0.8).unwrap()),
            viscosity: thinning,
            shift: Shift::None,
        },
        Branch {
            spring: Spring::EightChain(EightChain::new(0.4, 12.0).unwrap()),
            viscosity: power,
            shift: wlf,
        },
        Branch {
            spring: Spring::LopezPamies(LopezPamies::new(vec![[0.3, 0.8], [0.1, 2.0]]).unwrap()),
            viscosity: glass,
            shift: Shift::Arrhenius { reference: 293.15, energy: 4e4 },
        },
    ]
}

/// Law of the material point, built without the constants of a host.
fn point(branches: Vec<Branch>, softening: Option<Mullins>) -> Viscoelastic {
    let [bulk, mu] = ELASTIC;
    let alone = Compressible::new(NeoHookean::new(mu).unwrap(), Volumetric::None).unwrap();
    let lame = bulk - alone.bulk_modulus().unwrap();
    let rubber = Compressible::new(NeoHookean::new(mu).unwrap(), Volumetric::Ciarlet { lame }).unwrap();
    let law = Viscoelastic::new(Box::new(rubber), branches).unwrap();
    match softening {
        Some(softening) => law.with_softening(softening).unwrap(),
        None => law,
    }
}

fn constants(law: &Viscoelastic) -> Vec<f64> {
    [&ELASTIC[..], &user_material::constants(law, 273.15, 1.0)].concat()
}

fn soft() -> Option<Mullins> {
    Some(Mullins { ratio: 2.0, offset: 0.05, slope: 0.1 })
}

/// F of a cycle of stretch, shear, change of volume and rotation at a time from 0 to 1, not coaxial.
fn cycle(t: f64) -> Tensor {
    let s = (std::f64::consts::PI * t).sin();
    let stretch = Tensor::new(
        1.0 + 0.6 * s,
        0.4 * (5.0 * t).sin(),
        0.1 * s,
        0.0,
        1.0 - 0.25 * s,
        0.2 * s,
        -0.1 * t,
        0.05 * s,
        1.0 - 0.2 * s,
    );
    rotation(0.7 * t) * stretch
}

/// Rotation about an axis of no symmetry.
fn rotation(angle: f64) -> Tensor {
    let axis = nalgebra::Unit::new_normalize(nalgebra::Vector3::new(1.0, -2.0, 0.5));
    *nalgebra::Rotation3::from_axis_angle(&axis, angle).matrix()
}

fn at<'a>(constants: &'a [f64], f: Tensor, time: f64, celsius: f64) -> UmatCall<'a> {
    UmatCall { time, temperature: [celsius - 3.0, celsius], ..call(NAME, constants, f) }
}

/// Stress and state variables are those of the material point over 40 increments of unequal duration, with
/// softening and changing temperature.
#[test]
fn the_host_is_the_material_point() {
    let law = point(branches(), soft());
    let all = constants(&law);
    let mut numbers = vec![0.0; state_count(3)];
    let (mut state, mut pressure, mut dissipated) = (law.rest(), 0.0, 0.0);
    let mut worst = 0.0_f64;
    for n in 1..=40 {
        let (t, duration) = (f64::from(n) / 40.0, 0.01 * f64::from(1 + n % 7));
        let celsius = 15.0 + 20.0 * t;
        let (found, _, cut) = at(&all, cycle(t), duration, celsius).umat(&mut numbers);
        assert_eq!(cut, 1.0);
        let f = DeformationGradient::new(cycle(t)).unwrap();
        let c = voigt::from_stress(&f.right_cauchy_green());
        let step = Increment { temperature: celsius + 273.15, pressure, ..Increment::new(c, c, duration) };
        let step = law.advance(&state, &step, &mut Workspace::default()).unwrap();
        let expected = voigt::cauchy_from_material(&f, &step.prediction.stress);
        worst = worst.max((found - expected).norm() / expected.norm());
        pressure = Reaction::Law.pressure(&c, &step.prediction.stress);
        (state, dissipated) = (step.state, dissipated + step.dissipated);
        assert!((numbers[0] - pressure).abs() <= 1e-12 * pressure.abs(), "{} {pressure}", numbers[0]);
        assert!((numbers[1] - state.peak).abs() <= 1e-12 * state.peak);
        for (branch, own) in state.branches.iter().zip(numbers[3..].chunks_exact(7)) {
            let viscous = Voigt::from_column_slice(&own[..6]);
            worst = worst.max((viscous - branch.viscous).norm()).max((own[6] - branch.shear).abs());
        }
    }
    // the branches have flowed, and softening is beside them
    assert!(numbers[2] > 0.1 * dissipated && numbers[2] < dissipated, "{} {dissipated}", numbers[2]);
    evidence::at_most("UMAT with three branches beside the material point", worst, 1e-12);
}

/// DDSDDE of a whole increment is the Jaumann tangent of τ = Jσ: differences from one state, for each branch
/// and for all with softening on the way back.
#[test]
fn tangent_by_differences() {
    let singles = branches().into_iter().map(|branch| (vec![branch], None));
    for (own, softening) in singles.chain([(branches(), soft())]) {
        let law = point(own, softening);
        let all = constants(&law);
        let mut numbers = vec![0.0; state_count(law.branches().len())];
        for n in 1..=8 {
            at(&all, cycle(0.09 * f64::from(n)), 0.1, 20.0).umat(&mut numbers);
        }
        let f = cycle(0.8);
        let kirchhoff = |f: Tensor| {
            let (stress, ..) = at(&all, f, 0.1, 20.0).umat(&mut numbers.clone());
            stress * f.determinant()
        };
        let (_, tangent, _) = at(&all, f, 0.1, 20.0).umat(&mut numbers.clone());
        let (step, mut worst) = (1e-5, 0.0_f64);
        for (b, (k, l)) in PAIRS.into_iter().enumerate() {
            let mut rate = Tensor::zeros();
            rate[(k, l)] += 0.5;
            rate[(l, k)] += 0.5;
            let moved = |sign: f64| kirchhoff((Tensor::identity() + rate * (sign * step)) * f);
            let column = (moved(1.0) - moved(-1.0)) / (2.0 * step * f.determinant());
            worst = worst.max((column - tangent.column(b)).norm() / tangent.norm());
        }
        assert!((tangent - tangent.transpose()).norm() < 1e-12 * tangent.norm());
        let name = format!("UMAT with {} branches, tangent beside differences", law.branches().len());
        evidence::at_most(&name, worst, 1e-8);
    }
}

/// A rotation that grows with time on top of the history, DROT of any value: the stress and the tangent
/// rotate, the state variables stay.
#[test]
fn a_superposed_rotation_turns_the_stress() {
    let law = point(branches(), soft());
    let all = constants(&law);
    let mut states = [vec![0.0; state_count(3)], vec![0.0; state_count(3)]];
    let mut worst = 0.0_f64;
    for n in 1..=30 {
        let t = f64::from(n) / 30.0;
        let turn = rotation(-2.0 * t) * Tensor::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        let (still, slope, _) = at(&all, cycle(t), 0.05, 20.0).umat(&mut states[0]);
        let turned = UmatCall { turn: rotation(0.1), ..at(&all, turn * cycle(t), 0.05, 20.0) };
        let (found, found_slope, _) = turned.umat(&mut states[1]);
        let transformation = voigt::stress_transformation(&turn);
        worst = worst.max((found - transformation * still).norm() / still.norm());
        let expected = transformation * slope * transformation.transpose();
        worst = worst.max((found_slope - expected).norm() / slope.norm());
        let off = states[0].iter().zip(&states[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        worst = worst.max(off);
    }
    evidence::at_most("UMAT with branches under a superposed rotation", worst, 1e-12);
}

/// Creates a neo-Hookean branch of constant viscosity.
fn linear(nu: f64, eta: f64) -> Viscoelastic {
    let spring = Spring::NeoHookean(NeoHookean::new(nu).unwrap());
    point(vec![Branch::new(spring, Viscosity::Constant(eta)).unwrap()], None)
}

/// Held at a stretch of 2, ν/η = 1/s, for 1 s: F(λₑ) = F(2) − νt/(3η), F(x) = ln((x−1)²/(x²+x+1))/6 −
/// arctan((2x+1)/√3)/√3; σ₁ − σ₂ = μ(λ² − 1/λ) + ν(λₑ² − 1/λₑ). Backward Euler is of first order; the
/// extrapolation from two step sizes leaves the second.
#[test]
fn relaxation_in_closed_form() {
    let (nu, mu) = (0.8, ELASTIC[1]);
    let law = linear(nu, nu);
    let all = constants(&law);
    let root = 3.0_f64.sqrt();
    let primitive =
        |x: f64| ((x - 1.0).powi(2) / (x * x + x + 1.0)).ln() / 6.0 - ((2.0 * x + 1.0) / root).atan() / root;
    let target = primitive(2.0) - 1.0 / 3.0;
    let (mut low, mut high) = (1.0, 2.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if primitive(middle) > target { high = middle } else { low = middle }
    }
    let of = |modulus: f64, x: f64| modulus * (x * x - 1.0 / x);
    let expected = of(mu, 2.0) + of(nu, low);
    let f = Tensor::from_diagonal(&[2.0, 0.5_f64.sqrt(), 0.5_f64.sqrt()].into());
    let relaxed = |steps: u32| {
        let mut numbers = vec![0.0; state_count(1)];
        at(&all, f, 0.0, 20.0).umat(&mut numbers);
        let mut stress = Voigt::zeros();
        for _ in 0..steps {
            stress = at(&all, f, 1.0 / f64::from(steps), 20.0).umat(&mut numbers).0;
        }
        stress[0] - stress[1]
    };
    let [coarse, fine] = [500, 1000].map(relaxed);
    let [first, second] = [coarse, fine].map(|found| found / expected - 1.0);
    assert!((first / second - 2.0).abs() < 0.02, "{first} {second}");
    evidence::near("relaxation of a branch in the UMAT", (2.0 * fine - coarse) / expected, 1.0, 2e-6);
}

/// Elongation at a constant rate, without change of volume: σ₁ − σ₂ of the branch becomes 3ηε̇ at any rate
/// and any increment.
#[test]
fn elongation_in_closed_form() {
    let (nu, eta, rate) = (0.8, 0.8, 0.1);
    let all = constants(&linear(nu, eta));
    let mut numbers = vec![0.0; state_count(1)];
    let (mut found, duration) = (0.0, 0.5);
    for n in 1..=80 {
        let stretch = (rate * duration * f64::from(n)).exp();
        let side = stretch.powf(-0.5);
        let f = Tensor::from_diagonal(&[stretch, side, side].into());
        let stress = at(&all, f, duration, 20.0).umat(&mut numbers).0;
        found = stress[0] - stress[1] - ELASTIC[1] * (stretch * stretch - 1.0 / stretch);
    }
    evidence::near("elongation of a branch in the UMAT over 3ηε̇", found / (3.0 * eta * rate), 1.0, 1e-9);
}

/// J(SSE + SPD + SCD) is the work ∫P:dF over a cycle. The trapezoidal rule takes the stress after the flow of
/// each increment, so that the gap is of first order; the extrapolation leaves the second.
#[test]
fn energies_are_the_work() {
    let law = point(branches(), soft());
    let all = constants(&law);
    let gap = |steps: u32| {
        let mut numbers = vec![0.0; state_count(3)];
        let mut energies = [0.0; 3];
        let (mut before, mut work, mut most) = (Tensor::zeros(), 0.0, 0.0_f64);
        let mut last = 1.0;
        for n in 1..=steps {
            let [from, to] = [n - 1, n].map(|k| f64::from(k) / f64::from(steps));
            let f = cycle(to);
            let one = at(&all, f, 1.0 / f64::from(steps), 20.0);
            let (stress, ..) = one.with_energies(&mut numbers, &mut energies);
            last = f.determinant();
            let piola = voigt::to_stress(&stress) * f.try_inverse().unwrap().transpose() * last;
            work += 0.5 * (before + piola).dot(&(f - cycle(from)));
            before = piola;
            most = most.max(work);
        }
        let [sse, spd, scd] = energies;
        assert!(spd > 0.01 * most && scd > 0.1 * most && sse > 0.0, "{energies:?} {most}");
        (last * (sse + spd + scd) - work) / most
    };
    let [coarse, fine] = [1000, 2000].map(gap);
    assert!((coarse / fine - 2.0).abs() < 0.02, "{coarse} {fine}");
    let gap = (2.0 * fine - coarse).abs();
    evidence::at_most("UMAT with branches: energies less work, over the work", gap, 1e-5);
}

/// Plane strain and axisymmetry have the first four components of the solid, elastic laws too.
#[test]
fn four_components() {
    let law = point(branches(), soft());
    let all = constants(&law);
    let f = Tensor::new(1.3, 0.2, 0.0, -0.1, 0.9, 0.0, 0.0, 0.0, 1.1);
    for (name, all) in [(NAME, &all[..]), ("NEO_HOOKEAN", &ELASTIC[..])] {
        let answer = |shears: usize| {
            let mut numbers = vec![0.0; state_count(3)];
            let one = UmatCall { shears, name, ..at(all, f, 0.1, 20.0) };
            let (stress, tangent, _) = one.umat(&mut numbers);
            (stress, tangent, numbers)
        };
        let (solid, plane) = (answer(3), answer(1));
        let cut = |a: usize, b: usize| if a < 4 && b < 4 { solid.1[(a, b)] } else { 0.0 };
        assert_eq!(plane.1, Voigt6x6::from_fn(cut));
        assert_eq!(plane.0.as_slice()[..4], solid.0.as_slice()[..4]);
        assert_eq!(solid.0.as_slice()[4..], [0.0; 2]);
        assert_eq!(plane.2, solid.2);
    }
}

/// Without a stress the host cuts its increment: no number that is not finite, and the state stays.
#[test]
fn a_step_without_stress_asks_for_less() {
    let law = point(branches(), soft());
    let all = constants(&law);
    let mut numbers = vec![0.0; state_count(3)];
    at(&all, cycle(0.3), 0.1, 20.0).umat(&mut numbers);
    let kept = numbers.clone();
    let locked = Tensor::from_diagonal(&[90.0, 0.1, 0.1].into());
    let folded = Tensor::from_diagonal(&[-1.0, 1.0, 1.0].into());
    let [huge, nothing] = [1e200, f64::NAN].map(|x| Tensor::from_diagonal(&[x, 1.0, 1.0].into()));
    for (f, duration, celsius) in [
        (locked, 0.0, 20.0),
        (folded, 0.1, 20.0),
        (huge, 0.1, 20.0),
        (nothing, 0.1, 20.0),
        (cycle(0.3), -1.0, 20.0),
        (cycle(0.3), f64::NAN, 20.0),
        (cycle(0.3), f64::INFINITY, 20.0),
    ] {
        let (_, tangent, cut) = at(&all, f, duration, celsius).umat(&mut numbers);
        assert!(cut == 0.25 && tangent.iter().all(|entry| *entry == 0.0), "{f} {duration}");
        assert_eq!(numbers, kept);
    }
    // any duration and temperature has a finite answer, that of a host without a cut
    for duration in [0.0, 1e-300, 1e-12, 1e12, 1e300] {
        for celsius in [-273.0, -100.0, 20.0, 1e4] {
            let mut numbers = kept.clone();
            let (stress, tangent, cut) = at(&all, cycle(0.4), duration, celsius).umat(&mut numbers);
            let finite = stress.iter().chain(tangent.iter()).chain(&numbers).all(|x| x.is_finite());
            assert!(finite && (cut == 1.0 || duration > 1e30), "{duration} {celsius}");
        }
    }
}

#[test]
fn wrong_constants_and_temperatures_are_named() {
    let law = point(branches(), None);
    let all = constants(&law);
    for (key, given, says) in [
        ("neo-hookean", &all[..1], "allowed: K"),
        ("neo-hookean", &all[..2], "end before the absolute zero"),
        ("neo-hookean", &all[..6], "constants of one branch or more behind the first 6"),
        ("neo-hookean", &all[..all.len() - 1], "end before the shift of branch 3"),
        ("rubber", &all[..], "unknown hyperelastic law"),
    ] {
        let error = RelaxingRubber::new(key, given).err().unwrap().to_string();
        assert!(error.contains(says), "{key}: {error}");
    }
    let rubber = RelaxingRubber::new("neo-hookean", &all).unwrap();
    for celsius in [-300.0, f64::NAN] {
        let error = rubber.kelvin(celsius).unwrap_err().to_string();
        assert!(error.contains("above absolute zero: give initial temperatures"), "{error}");
    }
    let short = rubber.material(&mut [0.0; 9], &Voigt::zeros(), 0.0, 293.15).unwrap_err().to_string();
    assert!(short.contains("state variables: found 9; allowed: 24"), "{short}");
    // no branch depends on it
    let simple = constants(&linear(0.8, 0.8));
    assert_eq!(RelaxingRubber::new("neo-hookean", &simple).unwrap().kelvin(-300.0), Ok(-300.0 + 273.15));
}
