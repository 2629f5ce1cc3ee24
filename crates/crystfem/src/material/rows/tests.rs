//! Rows of points agree with single points.

use super::*;
use crate::kinetics::{KineticConstants, Kinetics};
use crate::melting::Melting;

/// Rows agree with [`Crystallization::advance`] and α point by point: cold, hot, long and short increments, z
/// from 0 to fully crystallized.
#[test]
fn rows_agree_with_single_points() {
    for (constants, melting) in [
        (KineticConstants::TABLE_4_1_COLUMN_1, Some(Melting::PA12)),
        (KineticConstants::TABLE_4_1_COLUMN_2, None),
        (
            KineticConstants { avrami_exponent: 1.0, ..KineticConstants::TABLE_4_1_COLUMN_1 },
            Some(Melting::PA12),
        ),
        (KineticConstants { avrami_exponent: 10.0, ..KineticConstants::APPENDIX_B }, Some(Melting::PA12)),
    ] {
        let law = Crystallization { kinetics: Kinetics::new(constants).unwrap(), melting };
        let (mut start, mut end) = (Vec::new(), Vec::new());
        for k in 0..400 {
            for change in [0.0, 1e-9, 1e-4, 0.01, 0.3, 1.0, 7.0, 300.0] {
                let temperature = 280.0 + 0.5 * f64::from(k);
                start.extend([temperature; 2]);
                end.extend([temperature + change, temperature - change]);
            }
        }
        let increments = Increments { start: &start, end: &end, dt: 0.5 };
        let states = [0.0, 1e-300, 1e-19, 1e-8, 1e-3, 0.1, 0.5, 0.9, 1.5, 3.0, 4.5, 12.0, 1e3, 1e30];
        let (mut node, mut z) = (Vec::new(), Vec::new());
        for k in 0..start.len() {
            node.extend([k as u32; 14]);
            z.extend(states);
        }
        let old = z.clone();
        let mut scratch = Scratch::default();
        law.advance_all(increments, &node, &mut z, &mut scratch);
        for (point, (&k, &before)) in node.iter().zip(&old).enumerate() {
            let k = k as usize;
            let exact = law.advance(before, start[k], end[k], 0.5).z;
            let found = z[point];
            // ln(1−X_m) is rounded by 2⁻⁵³ (1 − ln X_m) of itself a few times; dz = z (eᵖ − 1)/(n p) of that
            let slack = melting.filter(|_| end[k] > start[k]).map_or(0.0, |melting| {
                let [survival, depth] =
                    [melting.survival(start[k])[0], -melting.molten(start[k]).ln()].map(f64::abs);
                16.0 * f64::EPSILON * survival * (1.0 + depth)
            });
            let power = exact.powf(constants.avrami_exponent).clamp(1e-30, 700.0);
            let slack = slack * power.exp_m1() / (constants.avrami_exponent * power);
            // eˣ is off by 2⁻⁵³ x a few times
            let slack = slack + 1e-13 + 8.0 * f64::EPSILON * exact.max(1e-307).ln().abs();
            // and 0 below e⁻⁷⁰⁸, times K₀ Δt
            assert!(
                (found - exact).abs() <= slack * exact + 1e-302,
                "{} {} z {before:e}: {found:e} {exact:e}",
                start[k],
                end[k]
            );
        }
        // the step suggestion, for points of one z each
        for (begin, finish) in [(420.0, 419.0), (400.0, 401.0), (300.0, 300.0), (440.0, 442.0)] {
            for before in states {
                let increments = Increments { start: &[begin], end: &[finish], dt: 0.5 };
                let mut own = [before];
                let wish = law.advance_all(increments, &[0], &mut own, &mut scratch);
                let degree = |z| law.kinetics.degree(z);
                let change = (degree(own[0]) - degree(before)).abs();
                let exact = (change > 0.0).then(|| (LARGEST_CHANGE / change).clamp(0.1, MAX_STEP_RATIO));
                assert!(
                    match (wish, exact) {
                        (Some(wish), Some(exact)) => (wish / exact - 1.0).abs() < 1e-12,
                        // a change of one rounding error, or zero
                        (wish, exact) => wish == exact || change < 1e-15,
                    },
                    "{begin} {before:e}: {wish:?} {exact:?}"
                );
            }
        }
    }
}

/// Increments that are not finite give NaN and leave other points unchanged, also after pieces and in a
/// shorter item.
#[test]
fn increments_that_are_not_finite() {
    for melting in [Some(Melting::PA12), None] {
        let kinetics = Kinetics::new(KineticConstants::TABLE_4_1_COLUMN_1).unwrap();
        let law = Crystallization { kinetics, melting };
        let mut scratch = Scratch::default();
        let mut advance = |start: &[f64], end: &[f64]| {
            let node: Vec<u32> = (0..start.len() as u32).collect();
            let mut z = vec![0.5; start.len()];
            law.advance_all(Increments { start, end, dt: 0.5 }, &node, &mut z, &mut scratch);
            z
        };
        let long = advance(&[380.0, 390.0, 400.0, 410.0, 300.0], &[450.0, 320.0, 460.0, 310.0, 480.0]);
        assert!(long.iter().all(|z| z.is_finite()));
        let (nan, infinite) = (f64::NAN, f64::INFINITY);
        let z = advance(&[380.0, nan, 400.0, 410.0], &[nan, 320.0, infinite, 310.0]);
        assert_eq!(z.iter().map(|z| z.is_nan()).collect::<Vec<_>>(), [true, true, true, false]);
        assert_eq!(z[3], long[3]);
    }
}
