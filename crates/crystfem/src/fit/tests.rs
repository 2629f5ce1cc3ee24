use super::*;
use crate::kinetics::{KineticConstants, Kinetics, cooling_curve};
use harness::case::Fault;

/// Normal random numbers (splitmix64 and Box–Muller).
struct AlphaNoise(u64);

impl AlphaNoise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

const KNOWN: FixedConstants =
    FixedConstants { equilibrium_melting: 466.35, frozen: 294.15, activation_energy: 6270.0 };

fn pa12() -> Kinetics {
    Kinetics::new(KineticConstants::TABLE_4_1_COLUMN_1).unwrap()
}

/// α at 1, 2 and 10 K/min by exact quadrature, every kelvin about the transition.
fn coolings(rates: &[f64]) -> Vec<Cooling> {
    rates
        .iter()
        .map(|rate| {
            let rate = rate / 60.0;
            let curve = cooling_curve(&pa12(), rate, 466.35, 400.0, 0.0, 2);
            let middle = curve.temperature_at(0.5).unwrap().round();
            let temperatures: Vec<f64> = (-12..=12).map(|k| middle - 0.75 * f64::from(k)).collect();
            let degrees = temperatures.iter().map(|&t| pa12().degree(curve.z_at(t))).collect();
            Cooling { rate, temperatures, degrees }
        })
        .collect()
}

fn runs(noise: Option<(&mut AlphaNoise, f64)>) -> Vec<Run> {
    let mut runs: Vec<Run> = coolings(&[1.0, 2.0, 10.0])
        .into_iter()
        .map(|c| Run::cooling(c.rate, c.temperatures, c.degrees, &KNOWN).unwrap())
        .collect();
    if let Some((noise, size)) = noise {
        for degree in runs.iter_mut().flat_map(|run| &mut run.degrees) {
            *degree += size * noise.normal();
        }
    }
    runs
}

/// Recovers the constants from data without noise; Gauss' rule on steps of 0.75 K and from T₀ contributes
/// 1e-6.
#[test]
fn nakamura_constants_are_recovered() {
    let fit = nakamura(&runs(None), &KNOWN).unwrap();
    for (name, value) in [("growth_rate", 37_869.0), ("nucleation", 136_235.0), ("avrami_exponent", 2.678)] {
        let found = fit.get(name).unwrap();
        assert!((found.value / value - 1.0).abs() < 1e-4, "{name} {}", found.value);
        assert!(found.standard_error < 1e-3 * value);
    }
    assert!(fit.rms < 1e-6 && fit.measurements == 75 && fit.model.len() == 75, "{}", fit.rms);
}

#[test]
fn avrami_constants_are_recovered() {
    let times: Vec<f64> = (0..40).map(|k| 10.0 * f64::from(k)).collect();
    for exponent in [0.6, 1.0, 2.678, 4.0] {
        let degrees: Vec<f64> = times.iter().map(|&t| crate::kinetics::avrami(t, 130.0, exponent)).collect();
        let fit = avrami(&times, &degrees).unwrap();
        let rate: f64 = std::f64::consts::LN_2 / 130.0_f64.powf(exponent);
        for (name, value) in [("half_time", 130.0), ("avrami_exponent", exponent), ("rate_constant", rate)] {
            assert!((fit.get(name).unwrap().value / value - 1.0).abs() < 1e-7, "{name} {exponent}");
        }
    }
}

/// Recovers Ozawa's exponent n and χ(T) = (∫K dT)ⁿ of Nakamura's theory from exact rows, interpolated
/// linearly.
#[test]
fn ozawa_exponent_is_recovered() {
    let mut coolings = coolings(&[5.0, 7.0, 10.0, 14.0]);
    let temperature = 426.0;
    for cooling in &mut coolings {
        let curve = cooling_curve(&pa12(), cooling.rate, 466.35, 400.0, 0.0, 2);
        cooling.temperatures = (0..600).map(|k| 440.0 - 0.05 * f64::from(k)).collect();
        cooling.degrees = cooling.temperatures.iter().map(|&t| pa12().degree(curve.z_at(t))).collect();
    }
    let fit = ozawa(&coolings, temperature).unwrap();
    let z = cooling_curve(&pa12(), 1.0, 466.35, temperature, 0.0, 2).z.pop().unwrap();
    let exponent = fit.get("ozawa_exponent").unwrap().value;
    evidence::near("Ozawa's exponent that comes back with q^(−m)", exponent, 2.678, 1e-3);
    assert!((fit.get("cooling_function").unwrap().value / z.powf(2.678) - 1.0).abs() < 1e-3);
    let error = ozawa(&coolings, 455.0).unwrap_err().to_string();
    assert!(error.contains("0 rates with alpha") && error.contains("at least 3"), "{error}");
}

/// Returns the frequency with which 95 % intervals contain the true values.
fn coverage(count: u64, truth: &[(&str, f64)], fit: impl Fn(&mut AlphaNoise) -> KineticFit) -> Vec<f64> {
    let mut held = vec![0.0; truth.len()];
    for seed in 0..count {
        let fit = fit(&mut AlphaNoise(seed.wrapping_mul(0x1234_5678_9abc_def1)));
        for (held, (name, value)) in held.iter_mut().zip(truth) {
            let [low, high] = fit.get(name).unwrap().interval;
            *held += f64::from(u8::from(low <= *value && *value <= high)) / count as f64;
        }
    }
    held
}

/// 95 % ± 3.5 standard deviations of the frequency, √(0.95 · 0.05/600) = 0.9 %.
#[test]
fn intervals_of_avrami_have_their_coverage() {
    let times: Vec<f64> = (1..=30).map(|k| 12.0 * f64::from(k)).collect();
    let rate = std::f64::consts::LN_2 / 150.0_f64.powf(2.5);
    let truth = [("half_time", 150.0), ("avrami_exponent", 2.5), ("rate_constant", rate)];
    let held = coverage(600, &truth, |noise| {
        let degrees: Vec<f64> =
            times.iter().map(|&t| crate::kinetics::avrami(t, 150.0, 2.5) + 0.02 * noise.normal()).collect();
        avrami(&times, &degrees).unwrap()
    });
    assert!(held.iter().all(|share| (share - 0.95).abs() < 0.032), "{held:?}");
}

/// 95 % ± 3.5 standard deviations of the frequency, √(0.95 · 0.05/300) = 1.3 %.
#[test]
fn intervals_of_nakamura_have_their_coverage() {
    let truth = [("growth_rate", 37_869.0), ("nucleation", 136_235.0), ("avrami_exponent", 2.678)];
    let held = coverage(300, &truth, |noise| nakamura(&runs(Some((noise, 0.02))), &KNOWN).unwrap());
    assert!(held.iter().all(|share| (share - 0.95).abs() < 0.045), "{held:?}");
}

/// 95 % intervals at few rates, where the quantile of Student's distribution matters (four degrees of
/// freedom).
#[test]
fn intervals_of_ozawa_have_their_coverage() {
    let truth = [("ozawa_exponent", 2.678)];
    let held = coverage(600, &truth, |noise| {
        let coolings: Vec<Cooling> = [5.0, 6.5, 8.0, 10.0, 12.0, 15.0]
            .map(|rate| {
                let z = cooling_curve(&pa12(), rate / 60.0, 466.35, 426.0, 0.0, 2).z.pop().unwrap();
                let degree = pa12().degree(z) + 0.005 * noise.normal();
                Cooling { rate: rate / 60.0, temperatures: vec![426.0, 425.0], degrees: vec![degree; 2] }
            })
            .into();
        ozawa(&coolings, 426.0).unwrap()
    });
    assert!((held[0] - 0.95).abs() < 0.032, "{held:?}");
}

#[test]
fn degenerate_data_have_named_errors() {
    let times = [10.0, 20.0, 30.0, 40.0, 50.0];
    for (times, degrees, part) in [
        (&times[..1], &[0.5][..], "1 measurements for 2 parameters; allowed: at least 3"),
        (&times[..], &[0.5; 5][..], "alpha is constant"),
        (&times[..], &[0.0, 0.0, 0.0, 1.0, 1.0][..], "0 measurements of alpha between 0.01 and 0.99"),
        (&times[..], &[0.1, f64::NAN, 0.5, 0.7, 0.9][..], "measurement 2: alpha = NaN; allowed: -0.2 to 1.2"),
        (&times[..], &[0.1, 0.2, 0.5, 0.7, 90.0][..], "measurement 5: alpha = 90"),
        (&times[..], &[0.1, 0.2][..], "5 times and 2 values of alpha"),
        (
            &[-1.0, 2.0, 3.0, 4.0][..],
            &[0.1, 0.2, 0.5, 0.7][..],
            "measurement 1: time (s) = -1; allowed: finite, 0",
        ),
        (&[0.0; 4][..], &[0.1, 0.2, 0.5, 0.7][..], "no time above 0 s"),
        (&[7.0; 4][..], &[0.1, 0.2, 0.5, 0.7][..], "do not determine all parameters"),
        (&[][..], &[][..], "0 measurements"),
    ] {
        let error = avrami(times, degrees).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains(part), "{error}");
    }
    // one isothermal run determines K and n, not K₀ and K_G
    let hold = Run {
        times: (0..30).map(|k| 10.0 * f64::from(k)).collect(),
        temperatures: vec![430.0; 30],
        degrees: (0..30).map(|k| pa12().degree(pa12().rate(430.0) * 10.0 * f64::from(k))).collect(),
        history: Vec::new(),
    };
    let error = nakamura(std::slice::from_ref(&hold), &KNOWN).unwrap_err().to_string();
    assert!(error.contains("do not determine all parameters"), "{error}");
    let backwards = Run { times: hold.times.iter().rev().copied().collect(), ..hold.clone() };
    assert!(nakamura(&[backwards], &KNOWN).unwrap_err().to_string().contains("measurement 2: time = 280 s"));
    let cold = Run { temperatures: vec![200.0; 30], ..hold };
    assert!(nakamura(&[cold], &KNOWN).unwrap_err().to_string().contains("no alpha between"));
    assert!(
        nakamura(&runs(None), &FixedConstants { frozen: 500.0, ..KNOWN })
            .unwrap_err()
            .to_string()
            .contains("above the temperature")
    );
    for (rate, temperatures, part) in
        [(0.0, [430.0, 420.0], "cooling rate 0"), (1.0, [420.0, 430.0], "measurement 2")]
    {
        let error =
            Run::cooling(rate, temperatures.to_vec(), vec![0.1, 0.2], &KNOWN).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
    let back = Run { history: vec![[-1.0, 440.0], [-2.0, 435.0]], ..runs(None).remove(0) };
    let error = nakamura(&[back], &KNOWN).unwrap_err().to_string();
    assert!(error.contains("row 2 of the history: time = -2 s; allowed: -1 or later"), "{error}");
    let same: Vec<Cooling> = (0..4).map(|_| coolings(&[10.0]).remove(0)).collect();
    assert!(ozawa(&same, 426.0).is_err());
}

/// Growth during a hold before the first measurement is part of the history.
#[test]
fn a_hold_before_the_measurements_counts() {
    let mut held = runs(None);
    for run in &mut held {
        // a hold one kelvin above the first measurement, until z is 0.3 larger
        let temperature = run.temperatures[0] + 1.0;
        let reached =
            run.times[0] - (run.times[1] - run.times[0]) / (run.temperatures[0] - run.temperatures[1]);
        let hold = 0.3 / pa12().rate(temperature);
        for (time, degree) in run.times.iter_mut().zip(&mut run.degrees) {
            (*time, *degree) = (*time + hold, pa12().degree(pa12().z_of_degree(*degree) + 0.3));
        }
        run.history.extend([[reached, temperature], [reached + hold, temperature]]);
    }
    let value = |runs: &[Run]| nakamura(runs, &KNOWN).unwrap().estimates[1].value;
    let truth = KineticConstants::TABLE_4_1_COLUMN_1.nucleation;
    assert!((value(&held) / truth - 1.0).abs() < 1e-5, "{}", value(&held));
    held.iter_mut().for_each(|run| run.history.truncate(1));
    assert!((value(&held) / truth - 1.0).abs() > 1e-3);
}

proptest::proptest! {
    /// A fit ends with finite estimates or an error for any input.
    #[test]
    fn never_panics(times in proptest::collection::vec(proptest::num::f64::ANY, 0..12),
                    degrees in proptest::collection::vec(-0.3..1.3_f64, 0..12)) {
        if let Ok(fit) = avrami(&times, &degrees) {
            proptest::prop_assert!(fit.rms.is_finite());
        }
        let temperatures: Vec<f64> = times.iter().map(|t| t.abs() % 700.0).collect();
        let times = (0..times.len()).map(|k| k as f64).collect();
        let run = Run { times, temperatures, degrees, history: vec![[0.0, 480.0]] };
        if let Ok(fit) = nakamura(&[run], &KNOWN) {
            proptest::prop_assert!(fit.rms.is_finite());
        }
    }
}

/// Draws predict the scatter of repeated measurements: for a prediction beyond the data, the temperature at α
/// = ½ on cooling at 40 K/min, the spread over repeated measurements is that of the draws, and their 95 %
/// bands contain the true value in 95 % of cases.
#[test]
fn draws_predict_repeated_measurements() {
    let half = |kinetics: &Kinetics| {
        cooling_curve(kinetics, 40.0 / 60.0, 466.35, 380.0, 0.0, 2).temperature_at(0.5).unwrap()
    };
    let of = |constants: &[f64]| {
        let known = KineticConstants::TABLE_4_1_COLUMN_1;
        let [growth_rate, nucleation, avrami_exponent] = [constants[0], constants[1], constants[2]];
        half(&Kinetics::new(KineticConstants { growth_rate, nucleation, avrami_exponent, ..known }).unwrap())
    };
    let truth = half(&pa12());
    let mut noise = AlphaNoise(5);
    let (mut predicted, mut deviations, mut within) = (Vec::new(), Vec::new(), 0);
    let repeats = 80;
    let deviation = |all: &[f64]| {
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        (all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (all.len() - 1) as f64).sqrt()
    };
    for _ in 0..repeats {
        let fit = nakamura(&runs(Some((&mut noise, 0.02))), &KNOWN).unwrap();
        predicted.push(of(&fit.estimates.iter().map(|one| one.value).collect::<Vec<_>>()));
        let mut band: Vec<f64> = fit.draws.iter().take(200).map(|draw| of(draw)).collect();
        deviations.push(deviation(&band));
        band.sort_by(f64::total_cmp);
        within += usize::from((band[4]..=band[195]).contains(&truth));
    }
    let mean = deviations.iter().sum::<f64>() / repeats as f64;
    // a standard deviation from 80 numbers is good to 8 %
    evidence::near("posterior_spread_over_repeated", mean / deviation(&predicted), 1.0, 0.2);
    evidence::near("posterior_coverage", within as f64 / repeats as f64, 0.95, 0.06);
}
