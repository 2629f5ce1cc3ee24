//! Quality of the flags on a known law: share of bad predictions caught, and of good ones flagged.
//!
//! The networks are fitted without a training framework: hidden weights stay random, the linear outputs are
//! those of ridge regression (Huang et al. 2006, <https://doi.org/10.1016/j.neucom.2005.12.126>).

use super::*;
use crate::constitutive::network::Activation::Tanh;
use crate::constitutive::network::{Activation, Layer};
use crate::random::SplitMix64;
use crate::tensor::voigt;
use nalgebra::{DMatrix, Matrix6};

const NEURONS: usize = 120;

/// Stiff along 3, as chains are, and softening: S = D E/(1 + |E|²/0.04), E without shear in the norm.
fn truth(c: &Voigt) -> Voigt {
    let e = voigt::strain_from_right_cauchy_green(c);
    #[rustfmt::skip]
    let d = Matrix6::new(
        8e9, 3e9, 4e9, 0.0, 0.0, 0.0,
        3e9, 7e9, 4e9, 0.0, 0.0, 0.0,
        4e9, 4e9, 60e9, 0.0, 0.0, 0.0,
        0.0, 0.0, 0.0, 2e9, 0.0, 0.0,
        0.0, 0.0, 0.0, 0.0, 3e9, 0.0,
        0.0, 0.0, 0.0, 0.0, 0.0, 3e9,
    );
    let size = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
    d * e / (1.0 + size / 0.04)
}

/// Box lengths of runs in one or two directions at fifteen levels, the others shrinking by a third of the
/// strain: as Table 3.2; `between` shifts the levels.
fn runs(between: f64, random: &mut SplitMix64) -> Vec<Voigt> {
    let mut rows = Vec::new();
    let level = |k: usize, direction: usize| [0.3, 0.3, 0.15][direction] * (k as f64 + 1.0 - between) / 15.0;
    for first in 0..3 {
        for second in first..3 {
            for (i, j) in (0..15).flat_map(|i| (0..15).map(move |j| (i, j))) {
                if first == second && i != j {
                    continue;
                }
                for step in 1..=8 {
                    let mut strain = [0.0; 3];
                    let part = f64::from(step) / 8.0;
                    strain[first] = level(i, first) * part;
                    strain[second] = level(j, second) * part;
                    let pulled: f64 = strain.iter().sum();
                    let mut wobble = || 0.004 * (random.uniform() - 0.5);
                    for a in (0..3).filter(|a| *a != first && *a != second) {
                        strain[a] = -pulled / 3.0 + wobble();
                    }
                    rows.push(Voigt::from_fn(|a, _| if a < 3 { (1.0 + strain[a]).powi(2) } else { 0.0 }));
                }
            }
        }
    }
    rows
}

fn moments(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt())
}

/// An ensemble of four, fitted to the rows.
fn fitted(rows: &[Voigt]) -> Surrogate<f64> {
    let mut header = Header::new(Kind::Ann, &[(NEURONS, Tanh)], 4);
    let targets: Vec<Voigt> = rows.iter().map(truth).collect();
    for a in 0..6 {
        let column: Vec<f64> = rows.iter().map(|c| c[a]).collect();
        let (mean, deviation) = moments(&column);
        (header.input_mean[a], header.input_deviation[a]) =
            (mean, if deviation < 1e-12 { 0.0 } else { deviation });
        header.training_box[a] =
            column.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], &c| [l.min(c), h.max(c)]);
        let column: Vec<f64> = targets.iter().map(|s| s[a]).collect();
        (header.output_mean[a], header.output_deviation[a]) = moments(&column);
    }
    header.support = Some(Support::from_rows(rows, 256).unwrap());
    let network = |seed: u64| {
        let network = Network::<f64>::random(header.architecture.clone(), seed).unwrap();
        let mut random = SplitMix64::new(seed + 100);
        let first = Layer {
            bias: (0..NEURONS).map(|_| 2.0 * random.uniform() - 1.0).collect(),
            ..network.layers()[0].clone()
        };
        let features = DMatrix::from_fn(rows.len(), NEURONS + 1, |row, k| {
            if k == NEURONS {
                return 1.0;
            }
            let weights = &first.weights[6 * k..6 * k + 6];
            let input = |a: usize| match header.input_deviation[a] {
                0.0 => 0.0,
                deviation => (rows[row][a] - header.input_mean[a]) / deviation,
            };
            Activation::Tanh.derivatives(first.bias[k] + (0..6).map(|a| weights[a] * input(a)).sum::<f64>())
                [0]
        });
        let scaled = DMatrix::from_fn(rows.len(), 6, |row, a| match header.output_deviation[a] {
            0.0 => 0.0,
            deviation => (targets[row][a] - header.output_mean[a]) / deviation,
        });
        let normal = features.transpose() * &features + DMatrix::identity(NEURONS + 1, NEURONS + 1) * 1e-6;
        let outputs = normal.cholesky().unwrap().solve(&(features.transpose() * scaled));
        let last = Layer {
            weights: (0..6 * NEURONS).map(|i| outputs[(i % NEURONS, i / NEURONS)]).collect(),
            bias: (0..6).map(|a| outputs[(NEURONS, a)]).collect(),
            activation: Activation::Linear,
        };
        Network::new(header.architecture.clone(), vec![first, last]).unwrap()
    };
    let members: Vec<_> = (1..=4).map(network).collect();
    let law = Surrogate::new(header.clone(), members.clone()).unwrap();
    // the largest spread on the rows it was fitted to
    let mut memory = Workspace::default();
    let spread = rows.iter().map(|c| law.stress(c, &mut memory).unwrap().spread).fold(0.0, f64::max);
    header.spread_limit = Some(spread);
    Surrogate::new(header, members).unwrap()
}

/// Bad: wrong by more than a tenth of the stress. Of points in runs held out, anywhere in the box, anywhere
/// in a box half as large again, and sheared: how many are bad, how many of the bad are flagged, and how many
/// of the good.
#[test]
fn bad_predictions_are_caught_and_good_ones_kept() {
    let mut random = SplitMix64::new(4);
    let rows = runs(0.0, &mut random);
    let law = fitted(&rows);
    let limits = law.header().training_box;
    let held_out = runs(0.5, &mut random);
    let mut memory = Workspace::default();
    let in_box = |random: &mut SplitMix64, larger: f64| {
        Voigt::from_fn(|a, _| {
            let [low, high] = limits[a];
            0.5 * (low + high) + larger * (high - low) * (random.uniform() - 0.5)
        })
    };
    for group in 0..4 {
        // number; flagged by any, box, distance, spread
        let (mut bad, mut good) = ([0; 5], [0; 5]);
        for _ in 0..1000 {
            let c = match group {
                0 => held_out[random.below(held_out.len())],
                1 => in_box(&mut random, 1.0),
                2 => in_box(&mut random, 1.5),
                _ => {
                    let mut c = held_out[random.below(held_out.len())];
                    c[3] = 0.2 * (random.uniform() - 0.5);
                    c
                }
            };
            let prediction = law.stress(&c, &mut memory).unwrap();
            let expected = truth(&c);
            let flags = prediction.flags;
            let wrong = (prediction.stress - expected).norm() > 0.1 * expected.norm();
            let list = if wrong { &mut bad } else { &mut good };
            list[0] += 1;
            let all = [flags.any(), flags.outside.contains(&true), flags.far, flags.spread];
            for (place, flag) in all.into_iter().enumerate() {
                list[place + 1] += i32::from(flag);
            }
            assert!(group != 3 || c[3].abs() < 1e-6 || flags.unseen[3], "shear that was never seen");
        }
        // measured: of 1000 held-out predictions 5 are bad, 7 flagged; in the box 597 are bad, of which the
        // box catches none, the distance 596, the spread 592, together all (and 329 of 403 good ones, where
        // there were no data either); beyond the box 829 bad, all caught; sheared 209 bad, all caught by what
        // was unseen, 6 by the distance and none by the spread
        println!("group {group}: bad {bad:?}, good {good:?} (number; any, box, distance, spread)");
        if group == 0 {
            assert!(bad[0] < 20 && bad[1] + good[1] < 30, "held-out runs are in the data");
        } else {
            assert!(bad[0] > 100 && 100 * bad[1] >= 99 * bad[0], "bad predictions are caught");
        }
        assert!(
            group != 1 || (bad[2] == 0 && 100 * bad[3] >= 95 * bad[0]),
            "the box has gaps, the distance finds them"
        );
    }
}
