//! Benchmark of the kinetics integrators: error in α against time per step, and the response of a material.
//!
//! Rows `SCHEME KELVIN: QUANTITY`: largest error in α over the curve, time of the whole curve, and time per
//! step of KELVIN.

use crate::Failure;
use crate::{REPEATS, median, point};
use crystfem::kinetics::{KineticConstants, KineticScheme, Kinetics, cooling_curve};
use crystfem::material::ThermalMaterial;
use evidence::measurement::Measurement;
use std::hint::black_box;
use std::time::Instant;

/// Number of steps per timing.
const STEPS: usize = 200_000;

/// Measures column 1 of Table 4.1 from 200 to 120 °C, with a seed of 1e-3 (Euler's method cannot start from
/// 0).
pub fn measure(rate: f64) -> Result<Vec<Measurement>, Failure> {
    if !(rate > 0.0 && rate.is_finite()) {
        return Err(format!("--rate: found {rate} K/min; allowed: above 0").into());
    }
    let kinetics = Kinetics::new(KineticConstants::TABLE_4_1_COLUMN_1)?;
    let rate = rate / 60.0;
    let exact = cooling_curve(&kinetics, rate, 473.15, 393.15, 1e-3, 2);
    let mut rows = Vec::new();
    for scheme in KineticScheme::ALL {
        for kelvin in [0.001, 0.01, 0.1, 0.5, 1.0, 2.0, 5.0, 10.0] {
            let steps = (80.0_f64 / kelvin).round() as usize;
            let mut push = |what: &str, value: f64, unit: &str| {
                let what = format!("{} {kelvin}: {what}", scheme.name());
                rows.push(Measurement::new(what, steps, 1, value, unit));
            };
            let error = error(&kinetics, scheme, rate, kelvin, steps, &exact);
            // JSON has no NaN: a scheme that leaves [0, 1] has no error row
            if error.is_finite() {
                push("error", error, "");
            }
            let step = nanoseconds(&kinetics, scheme, rate, kelvin, steps);
            push("time", 1e-9 * step * steps as f64, "s");
            push("step", step, "ns/step");
        }
    }
    for (name, start, increment) in point::STEPS {
        for latent in [None, Some(209e3)] {
            let coupled = if latent.is_some() { "with" } else { "without" };
            let what = format!("response, {name} by 0.5 K, {coupled} latent heat");
            let value = response(latent, start, increment)?;
            rows.push(Measurement::new(what, STEPS, 1, value, "ns"));
        }
    }
    Ok(rows)
}

/// Measures the response of a material with its tangent, ns.
fn response(latent_heat: Option<f64>, start: f64, increment: f64) -> Result<f64, Failure> {
    let polymer = point::polymer(latent_heat)?;
    let mut old = [0.0];
    polymer.initial_state(start, &mut old);
    let at = point::point(start, increment);
    let mut times = Vec::new();
    for _ in 0..REPEATS {
        let since = Instant::now();
        for _ in 0..STEPS {
            black_box(polymer.respond(black_box(&at), black_box(&old), &mut [0.0])?);
        }
        times.push(since.elapsed().as_secs_f64() / STEPS as f64 * 1e9);
    }
    Ok(median(times))
}

fn error(
    kinetics: &Kinetics,
    scheme: KineticScheme,
    rate: f64,
    kelvin: f64,
    steps: usize,
    exact: &crystfem::kinetics::CoolingCurve,
) -> f64 {
    let mut state = scheme.state(kinetics, 1e-3);
    let mut worst = 0.0_f64;
    for k in 0..steps {
        let (start, end) = (473.15 - k as f64 * kelvin, 473.15 - (k + 1) as f64 * kelvin);
        state = scheme.advance(kinetics, state, start, end, kelvin / rate);
        let error = (scheme.degree(kinetics, state) - kinetics.degree(exact.z_at(end))).abs();
        if !error.is_finite() {
            return f64::NAN;
        }
        worst = worst.max(error);
    }
    worst
}

/// Measures the time per step, including α at the end of each step, ns.
fn nanoseconds(kinetics: &Kinetics, scheme: KineticScheme, rate: f64, kelvin: f64, steps: usize) -> f64 {
    let repeats = (STEPS / steps).max(1);
    let times: Vec<f64> = (0..REPEATS)
        .map(|_| {
            let start = Instant::now();
            for _ in 0..repeats {
                let mut state = scheme.state(kinetics, 1e-3);
                for k in 0..steps {
                    let (from, to) = (473.15 - k as f64 * kelvin, 473.15 - (k + 1) as f64 * kelvin);
                    state = scheme.advance(kinetics, state, from, to, kelvin / rate);
                    black_box(scheme.degree(kinetics, state));
                }
            }
            start.elapsed().as_secs_f64() / (repeats * steps) as f64 * 1e9
        })
        .collect();
    median(times)
}
