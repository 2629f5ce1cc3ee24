use super::*;
use crate::kinetics::{KineticConstants, Kinetics};
use crate::melting::Melting;

/// PA12 of formulation.md: k = 0.25, ρ = 1010, c = 2200, X∞ = 0.25, ΔH = 209 J/g.
fn pa12(latent_heat: Option<f64>) -> Semicrystalline {
    pa12_of(KineticConstants::TABLE_4_1_COLUMN_1, latent_heat)
}

fn pa12_of(constants: KineticConstants, latent_heat: Option<f64>) -> Semicrystalline {
    Semicrystalline::new(Polymer {
        density: 1010.0,
        conductivity: ThermalProperty::constant("conductivity", 0.25).unwrap(),
        specific_heat: ThermalProperty::constant("specific heat", 2200.0).unwrap(),
        kinetics: Kinetics::new(constants).unwrap(),
        melting: Some(Melting::PA12),
        ultimate_crystallinity: 0.25,
        latent_heat,
        seed: 0.0,
    })
    .unwrap()
}

fn plain() -> Conductor {
    let constant = |value| ThermalProperty::constant("a property", value).unwrap();
    Conductor::new(1010.0, constant(0.25), constant(2200.0)).unwrap()
}

fn tabulated() -> Conductor {
    let table = |values: [f64; 4]| {
        ThermalProperty::table("a property", vec![250.0, 320.0, 450.0, 600.0], values.to_vec()).unwrap()
    };
    Conductor::new(2500.0, table([0.2, 0.3, 0.25, 0.4]), table([1400.0, 2200.0, 2600.0, 2500.0])).unwrap()
}

fn all() -> Vec<Box<dyn ThermalMaterial>> {
    vec![
        Box::new(plain()),
        Box::new(tabulated()),
        Box::new(pa12(None)),
        Box::new(pa12(Some(209e3))),
        Box::new(pa12_of(KineticConstants::TABLE_4_1_COLUMN_2, Some(209e3))),
        Box::new(PublishedSubroutine::new(plain(), Sign::AsPublished, false)),
        Box::new(PublishedSubroutine::new(plain(), Sign::Corrected, true)),
        Box::new(tabulated().with_directions([1.0, 0.4, 1e-3]).unwrap()),
    ]
}

fn point(temperature: f64, increment: f64, dt: f64) -> PointInput {
    PointInput { temperature, increment, gradient: Vector3::new(100.0, -20.0, 3.0), dt }
}

/// Tangents agree with finite differences, energy is a function of temperature and state, and the old state
/// is unchanged.
#[test]
fn tangents() {
    for (law, material) in all().iter().enumerate() {
        let count = material.state_names().len();
        for temperature in [260.0, 330.0, 385.0, 401.0, 425.0, 441.0, 455.0, 470.0, 700.0] {
            for increment in [-35.3, -3.1, -0.2, 0.3, 2.7, 33.0] {
                for dt in [0.05, 2.0, 400.0] {
                    let mut old = vec![0.0; count];
                    material.initial_state(temperature, &mut old);
                    if law > 1 && law < 5 {
                        old[0] = 0.7;
                    }
                    let mut new = vec![0.0; count];
                    let at = point(temperature, increment, dt);
                    let found = material.respond(&at, &old, &mut new).unwrap();
                    let rest = material.energy(temperature + increment, &new);
                    assert!((rest - found.energy).abs() <= 1e-9 * rest.abs().max(1.0), "{law}");
                    let h = 1e-4;
                    let near = |dt_end: f64| {
                        let mut new = vec![0.0; count];
                        let at = PointInput { increment: increment + dt_end, ..at };
                        material.respond(&at, &old, &mut new).unwrap()
                    };
                    let (up, down) = (near(h), near(-h));
                    let slope = (up.energy - down.energy) / (2.0 * h);
                    // central differences: rounding of U over 2h, and curvature
                    let error = (slope - found.d_energy_d_temperature).abs();
                    assert!(error < 1e-5 * slope.abs().max(2200.0), "{law} {at:?}: {slope} {found:?}");
                    let flux = (up.flux - down.flux) / (2.0 * h);
                    assert!((flux - found.d_flux_d_temperature).norm() < 1e-6, "{law} {at:?}");
                    assert!((found.d_flux_d_gradient * at.gradient - found.flux).norm() < 1e-12);
                }
            }
        }
    }
}

/// The flux is −D k ∇T; invalid factors are named.
#[test]
fn conductivity_along_axes() {
    let material = pa12(None).with_directions([2.0, 1.0, 1e-6]).unwrap();
    let mut new = [0.0];
    let found = material.respond(&point(400.0, 0.0, 1.0), &[0.1], &mut new).unwrap();
    let isotropic = pa12(None).respond(&point(400.0, 0.0, 1.0), &[0.1], &mut new).unwrap().flux;
    assert_eq!(found.flux, isotropic.component_mul(&Vector3::new(2.0, 1.0, 1e-6)));
    for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(plain().with_directions([1.0, wrong, 1.0]).is_err());
    }
}

/// Returns z of a material after a path of (temperature, duration).
fn follow(material: &dyn ThermalMaterial, start: f64, state: f64, path: &[(f64, f64)], steps: usize) -> f64 {
    let (mut at, mut state) = (start, state);
    for &(end, duration) in path {
        for k in 0..steps {
            let [a, b] = [k, k + 1].map(|k| at + (end - at) * k as f64 / steps as f64);
            let mut new = [0.0];
            material.respond(&point(a, b - a, duration / steps as f64), &[state], &mut new).unwrap();
            state = new[0];
        }
        at = end;
    }
    state
}

/// Erratum 6: the survival α (1−X_m(T₂))/(1−X_m(T₁)) is exact in one step or in many, falls with T, and ends
/// at 0.
#[test]
fn melting_by_survival() {
    let material = pa12(None);
    let kinetics = material.kinetics();
    let full = kinetics.z_of_remainder(1e-12);
    let mut before = 1.0;
    for end in [400.0, 420.0, 440.0, 450.0, 455.0, 459.9, 460.0, 500.0, 1273.15] {
        // no growth in zero time
        let exact = (Melting::PA12.survival(end)[0] - Melting::PA12.survival(300.0)[0]).exp();
        let [once, many] =
            [1, 500].map(|steps| kinetics.degree(follow(&material, 300.0, full, &[(end, 0.0)], steps)));
        assert!((once - exact).abs() <= 1e-11 * exact, "{end}: {once} {exact}");
        assert!((many - once).abs() <= 1e-11 * once, "{end}: {once} {many}");
        assert!(once < before);
        before = once;
    }
    assert_eq!(before, 0.0);
    // 459.9 and 460 K: no jump; most has melted, where the printed form leaves 0.754
    let at = |end: f64| kinetics.degree(follow(&material, 300.0, full, &[(end, 0.0)], 1));
    assert!(at(459.9) < 1e-4 && (at(459.9) - at(460.0)).abs() < 1e-5);
}

/// Heating through the range where growth and melting overlap converges at second order in the step.
#[test]
fn splitting_of_growth_and_melting_converges() {
    let material = pa12(None);
    let kinetics = material.kinetics();
    let end = |steps: usize| kinetics.degree(follow(&material, 400.0, 0.3, &[(452.0, 600.0)], steps));
    let fine = end(8192);
    let errors = [64, 128, 256, 512].map(|steps| (end(steps) - fine).abs());
    assert!((end(1) - fine).abs() < 2e-3, "{} {fine}", end(1));
    for pair in errors.windows(2) {
        assert!(pair[1] < 0.4 * pair[0], "{errors:?}");
    }
}

/// A thousand cycles of melting and crystallization end where the first did, to the last digits.
#[test]
fn a_thousand_cycles_do_not_drift() {
    let material = pa12(Some(209e3));
    let kinetics = material.kinetics();
    let path = [(500.0, 60.0), (400.0, 120.0), (400.0, 10.0), (452.0, 5.0), (390.0, 60.0)];
    let first = follow(&material, 390.0, 0.0, &path, 7);
    let mut z = first;
    for cycle in 0..1000 {
        z = follow(&material, 390.0, z, &path, 7);
        let alpha = kinetics.degree(z);
        assert!((0.0..=1.0).contains(&alpha));
        assert!((z / first - 1.0).abs() < 1e-9, "{cycle}: {z} {first}");
    }
}

/// Adiabatic hold after an undercooling: the rise of temperature ΔH X∞/c = 23.75 K (erratum 9: 23.8).
#[test]
fn latent_heat_is_in_the_energy() {
    let material = pa12(Some(209e3));
    let full = material.kinetics().z_of_remainder(0.0);
    let rise = (material.energy(400.0, &[0.0]) - material.energy(400.0, &[full])) / 2200.0;
    assert!((rise - 23.75).abs() < 1e-9, "{rise}");
    assert!(!material.is_linear() && pa12(None).is_linear());
    // without latent heat the energy does not depend on α
    assert_eq!(pa12(None).energy(400.0, &[full]), pa12(None).energy(400.0, &[0.0]));
}

#[test]
fn step_ratio_is_that_of_the_change_of_alpha() {
    let material = pa12(None);
    let ratio =
        |z: f64, dt: f64| material.respond(&point(420.0, 0.0, dt), &[z], &mut [0.0]).unwrap().step_ratio;
    assert_eq!(ratio(0.0, 0.0), None);
    assert_eq!(ratio(1e30, 1e9), None);
    assert_eq!(ratio(0.0, 1e9), Some(0.1));
    let [before, after] =
        [1.0, 1.0 + material.kinetics().growth(420.0, 420.0, 2.0).z].map(|z| material.kinetics().degree(z));
    let found = ratio(1.0, 2.0).unwrap();
    assert!((found - LARGEST_CHANGE / (after - before)).abs() < 1e-12, "{found}");
    // also if a bound on the change suffices
    let mut bounded = 0;
    for dt in [1e-3, 1e-2, 0.03, 0.1, 0.3, 1.0, 3.0] {
        let grown = material.kinetics().growth(420.0, 420.0, dt).z;
        bounded += usize::from(grown * material.kinetics().constants().avrami_exponent < 0.01);
        let [before, after] = [0.3, 0.3 + grown].map(|z| material.kinetics().degree(z));
        let expected = (LARGEST_CHANGE / (after - before)).clamp(0.1, 10.0);
        assert!((ratio(0.3, dt).unwrap() - expected).abs() < 1e-9 * expected, "{dt}");
    }
    assert!((1..7).contains(&bounded), "{bounded}");
}

#[test]
fn invalid_temperatures_are_refused() {
    for material in all() {
        let state = vec![0.0; material.state_names().len()];
        let mut new = state.clone();
        for (at, part) in [
            (point(f64::NAN, 0.0, 1.0), "temperature, K: found NaN"),
            (point(400.0, f64::INFINITY, 1.0), "found inf"),
            (point(400.0, 0.0, -1.0), "time increment, s: found -1; allowed: 0 or above"),
            (point(400.0, 0.0, f64::NAN), "found NaN"),
        ] {
            let error = material.respond(&at, &state, &mut new).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
    }
}

proptest::proptest! {
    /// α stays finite and in [0, 1] from any α, over any increment between −200 and 1000 °C in up to 1e9 s.
    #[test]
    fn bounded_and_finite(
        start in 73.15..1273.15_f64, end in 73.15..1273.15_f64, scale in 0..10_i32, dt in -9.0..9.0_f64,
        degree in 0.0..=1.0_f64, exponent in 0..16_i32, near_one in proptest::bool::ANY, column in 0..2_usize,
    ) {
        let constants = [KineticConstants::TABLE_4_1_COLUMN_1, KineticConstants::TABLE_4_1_COLUMN_2][column];
        let material = pa12_of(constants, Some(209e3));
        let kinetics = material.kinetics();
        let small = degree * 10.0_f64.powi(-exponent);
        let z = if near_one { kinetics.z_of_remainder(small) } else { kinetics.z_of_degree(small) };
        let mut new = [f64::NAN];
        let at = point(start, (end - start) * 10.0_f64.powi(-scale), 10.0_f64.powf(dt));
        let found = material.respond(&at, &[z], &mut new).unwrap();
        let alpha = kinetics.degree(new[0]);
        proptest::prop_assert!((0.0..=1.0).contains(&alpha) && new[0].is_finite());
        proptest::prop_assert!(found.energy.is_finite() && found.d_energy_d_temperature.is_finite());
        proptest::prop_assert!(found.step_ratio.is_none_or(|ratio| (0.1..=10.0).contains(&ratio)));
        // cooling never melts
        if at.increment <= 0.0 {
            proptest::prop_assert!(alpha >= kinetics.degree(z) * (1.0 - 1e-12));
        }
    }

    /// A single step across the whole window at 1e-3 to 1e6 K/min gives α of exact quadrature.
    #[test]
    fn one_step_across_the_window(rate in -3.0..6.0_f64, column in 0..2_usize) {
        let constants = [KineticConstants::TABLE_4_1_COLUMN_1, KineticConstants::TABLE_4_1_COLUMN_2][column];
        let material = pa12_of(constants, None);
        let rate = 10.0_f64.powf(rate) / 60.0;
        let mut new = [0.0];
        material.respond(&point(478.15, 290.0 - 478.15, 188.15 / rate), &[0.0], &mut new).unwrap();
        let exact = crate::kinetics::cooling_curve(material.kinetics(), rate, 478.15, 290.0, 0.0, 2);
        let z = exact.z[exact.z.len() - 1];
        proptest::prop_assert!((new[0] / z - 1.0).abs() < 2e-5);
    }
}

mod printed {
    use super::*;

    /// Returns α after each step of a ramp.
    fn ramp(sign: Sign, guarded: bool, from: f64, to: f64, step: f64, dt: f64) -> Vec<f64> {
        let material = PublishedSubroutine::new(plain(), sign, guarded);
        let (mut state, mut alphas) = ([0.0], Vec::new());
        material.initial_state(0.0, &mut state);
        let count = ((to - from).abs() / step).round() as usize;
        let step = step.copysign(to - from);
        for k in 0..count {
            let old = state;
            let at = point(from + 273.15 + k as f64 * step, step, dt);
            material.respond(&at, &old, &mut state).unwrap();
            alphas.push(state[0]);
        }
        alphas
    }

    /// Erratum 2: `DTEMP > 0` crystallizes. Cooling 200 → 120 °C leaves α = 1e-3, heating 120 → 180 °C gives
    /// 1.
    #[test]
    fn erratum_2_the_sign_is_inverted() {
        let cooled = ramp(Sign::AsPublished, false, 200.0, 120.0, 0.005, 0.03);
        assert!((cooled.last().unwrap() - 1e-3).abs() < 1e-9, "{:?}", cooled.last());
        let heated = ramp(Sign::AsPublished, false, 120.0, 180.0, 0.005, 0.03);
        assert!(heated.iter().any(|&alpha| alpha > 0.999), "{:?}", heated.last());
    }

    /// Erratum 3: without a guard T < T₀ the exponential overflows on the first step from 200 °C, then NaN.
    #[test]
    fn erratum_3_the_exponential_overflows_above_melting() {
        // formulation.md: α = 4.7e17 on step 1; its Δt is 0.05 s
        let alphas = ramp(Sign::Corrected, false, 200.0, 120.0, 1.0, 0.05);
        assert!((alphas[0] / 4.7e17 - 1.0).abs() < 0.01, "{:e}", alphas[0]);
        assert!(alphas[1].is_nan());
        let guarded = ramp(Sign::Corrected, true, 200.0, 120.0, 0.005, 0.03);
        assert!(guarded.iter().take(1000).all(|&alpha| alpha == f64::from(1e-3_f32)));
    }

    /// Erratum 4: Algorithm 1 sets α = 0 above melting, a fixed point of (4.11); the code's seed hides it.
    #[test]
    fn erratum_4_zero_is_a_fixed_point() {
        let kinetics = Kinetics::new(KineticConstants::TABLE_4_1_COLUMN_1).unwrap();
        evidence::near("rate (4.11) at α = 0, 420 K", kinetics.degree_rate(420.0, 0.0), 0.0, 0.0);
        assert!(kinetics.growth(420.0, 420.0, 10.0).z > 0.0);
    }

    /// Erratum 6: α = 1 heated to 459.9 K leaves 0.754, then jumps to 1e-3 at 460 K.
    #[test]
    fn erratum_6_alpha_max_mixes_two_crystallinities() {
        let material = PublishedSubroutine::new(plain(), Sign::Corrected, true);
        let mut alpha = 1.0;
        let mut last = (0.0, 0.0);
        // TEMPK = K − 0.15 in the code; steps of 1 mK
        for k in 0..40_010 {
            let mut new = [0.0];
            let temperature = 420.15 + f64::from(k) * 1e-3;
            material.respond(&point(temperature, 1e-3, 1e-3), &[alpha], &mut new).unwrap();
            if temperature - 0.15 < 459.9 {
                last = (temperature, new[0]);
            }
            alpha = new[0];
        }
        assert!((last.1 - 0.754).abs() < 2e-3, "{last:?}");
        assert_eq!(alpha, f64::from(1e-3_f32));
    }

    /// Euler at 1 K steps and 10 K/min: NaN, as formulation.md's table has it, with the sign corrected and
    /// guarded.
    #[test]
    fn euler_goes_nan_at_one_kelvin_per_step() {
        let alphas = ramp(Sign::Corrected, true, 200.0, 120.0, 1.0, 6.0);
        assert!(alphas.iter().any(|alpha| alpha.is_nan()));
        assert!(alphas.iter().any(|&alpha| alpha > 1.0));
    }
}

/// Tangents stay finite when crystals melt completely on strong heating, at any step.
#[test]
fn tangents_are_finite_on_strong_heating() {
    let material = pa12(Some(209e3));
    let faint = (200..640).map(|k| 10_f64.powf(-0.5 * f64::from(k)));
    for z in faint.chain([0.0, 1e-320, 1e-30, 1e-8, 0.1, 1.0, 3.0]) {
        for start in
            [73.15, 290.0, 294.0, 294.2, 320.0, 400.0, 440.0, 455.0, 466.0, 466.4, 470.0, 600.0, 1175.7]
        {
            for increment in [-100.0, -1e-3, 0.0, 1e-9, 1e-3, 0.5, 10.0, 100.0, 900.0] {
                for dt in [0.0, 1e-12, 1e-6, 1e-3, 1.0, 1e6] {
                    let at = PointInput { temperature: start, increment, gradient: Default::default(), dt };
                    let mut new = [0.0];
                    let response = material.respond(&at, &[z], &mut new).unwrap();
                    let found = [new[0], response.energy, response.d_energy_d_temperature];
                    assert!(found.iter().all(|x| x.is_finite()), "{z} {at:?}: {found:?}");
                }
            }
        }
    }
}
