//! Quality of the flags of a model: bad predictions caught, and false alarms.

use crate::Error;
use crate::dataset::DataRow;
use crate::surrogate::{Surrogate, Workspace};

/// Relative error above which a prediction is bad.
const BAD: f64 = 0.1;
/// Error over the noise of the data above which a prediction is bad; no law can follow the noise.
const ABOVE_NOISE: f64 = 3.0;

/// Names of the flags, in the order of the lists in [`FlagStatistics`].
pub const FLAGS: [&str; 4] = ["any flag", "the box", "the distance", "the spread"];

/// Counts of predictions by error and flags.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FlagStatistics {
    /// Number of rows with an error above a tenth of their stress and three times the noise.
    pub bad: usize,
    /// Number of the other rows.
    pub good: usize,
    /// Number of bad rows with each of [`FLAGS`].
    pub caught: [usize; 4],
    /// Number of good rows with each of [`FLAGS`]: false alarms.
    pub alarms: [usize; 4],
    /// Spearman's rank correlation of spread and error; `None` for a single member or fewer than three rows.
    pub correlation: Option<f64>,
    /// For each component of S, the fractions of rows whose measured value lies within one and two standard
    /// deviations of the ensemble ([`Prediction::deviation`](crate::surrogate::Prediction::deviation)).
    /// `None` for a single member, nominal stresses (which need the covariance), and members that always
    /// agree.
    pub within: [Option<[f64; 2]>; 6],
}

impl FlagStatistics {
    /// Counts the predictions; `noise` is the root mean square noise of ‖S‖ in the data, Pa, or 0.
    ///
    /// # Errors
    /// Returns the errors of [`Surrogate::stress`].
    pub fn count<'a>(
        law: &Surrogate,
        rows: impl Iterator<Item = &'a DataRow>,
        noise: f64,
    ) -> Result<Self, Error> {
        let mut memory = Workspace::default();
        let mut found = Self::default();
        let (mut errors, mut spreads) = (Vec::new(), Vec::new());
        let (mut inside, mut apart, mut nominal) = ([[0; 2]; 6], [false; 6], false);
        for row in rows {
            let answer = law.stress(&row.c, &mut memory)?;
            let [measured, predicted] = row.compared(&answer.stress);
            let error = (predicted - measured).norm();
            let flags = answer.flags;
            let raised = [flags.any(), flags.outside.contains(&true), flags.far, flags.spread];
            let (count, flagged) = match error > BAD * measured.norm() && error > ABOVE_NOISE * noise {
                true => (&mut found.bad, &mut found.caught),
                false => (&mut found.good, &mut found.alarms),
            };
            *count += 1;
            for (sum, flag) in flagged.iter_mut().zip(raised) {
                *sum += usize::from(flag);
            }
            nominal |= row.nominal.is_some();
            for a in 0..6 {
                let (distance, deviation) = ((predicted[a] - measured[a]).abs(), answer.deviation[a]);
                apart[a] |= deviation > 0.0;
                inside[a][0] += usize::from(distance <= deviation);
                inside[a][1] += usize::from(distance <= 2.0 * deviation);
            }
            errors.push(error);
            spreads.push(answer.spread);
        }
        if law.header().members > 1 && errors.len() > 2 {
            found.correlation = correlation(&ranks(&errors), &ranks(&spreads));
        }
        for a in (0..6).filter(|&a| apart[a] && !nominal) {
            found.within[a] = Some(inside[a].map(|count| count as f64 / errors.len() as f64));
        }
        Ok(found)
    }
}

/// Returns the ranks in ascending order; equal values share their mean rank.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0.0; values.len()];
    let mut first = 0;
    while first < order.len() {
        let same = order[first..].iter().take_while(|&&k| values[k] == values[order[first]]).count().max(1);
        for &k in &order[first..first + same] {
            ranks[k] = first as f64 + 0.5 * (same as f64 - 1.0);
        }
        first += same;
    }
    ranks
}

/// Computes Pearson's correlation; `None` for a constant list.
fn correlation(a: &[f64], b: &[f64]) -> Option<f64> {
    let count = a.len() as f64;
    let mean = |list: &[f64]| list.iter().sum::<f64>() / count;
    let (mean_a, mean_b) = (mean(a), mean(b));
    let sum =
        |f: &dyn Fn(f64, f64) -> f64| a.iter().zip(b).map(|(a, b)| f(a - mean_a, b - mean_b)).sum::<f64>();
    let root = (sum(&|a, _| a * a) * sum(&|_, b| b * b)).sqrt();
    (root > 0.0).then(|| sum(&|a, b| a * b) / root)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::tests::rows_of_a_law;
    use crate::network::{Activation::Linear, Layer, Network};
    use crate::surrogate::{Header, Kind};

    #[test]
    fn ranks_and_their_correlation() {
        assert_eq!(ranks(&[3.0, 1.0, 2.0, 1.0]), [3.0, 0.5, 2.0, 0.5]);
        // 1 − 6 Σd²/n(n² − 1) without ties: d = (1, −1, 0, 0)
        let found = correlation(&ranks(&[1.0, 2.0, 3.0, 9.0]), &ranks(&[2.0, 1.0, 5.0, 6.0])).unwrap();
        assert!((found - (1.0 - 12.0 / 60.0)).abs() < 1e-15);
        assert_eq!(correlation(&[1.0, 2.0], &[3.0, 3.0]), None);
    }

    /// Two members that predict m ± s: fractions counted by hand.
    #[test]
    fn shares_within_deviations() {
        let rows = rows_of_a_law();
        let mut header = Header::new(Kind::Ann, &[], 2);
        header.output_deviation = vec![0.0; 6];
        let range = rows.iter().fold([f64::MAX, f64::MIN], |[l, h], row| [l.min(row.s[1]), h.max(row.s[1])]);
        let (mean, deviation) = (0.5 * (range[0] + range[1]), 0.2 * (range[1] - range[0]));
        (header.output_mean[1], header.output_deviation[1]) = (mean, deviation);
        let member = |sign: f64| {
            let mut bias = vec![0.0; 6];
            bias[1] = sign;
            let layer = Layer { weights: vec![0.0; 36], bias, activation: Linear };
            Network::<f64>::new(header.architecture.clone(), vec![layer]).unwrap()
        };
        let law = Surrogate::new(header.clone(), vec![member(1.0), member(-1.0)]).unwrap();
        let share = |reach: f64| {
            rows.iter().filter(|row| (row.s[1] - mean).abs() <= reach).count() as f64 / rows.len() as f64
        };
        let found = FlagStatistics::count(&law, rows.iter(), 0.0).unwrap();
        // the members agree on all components but 22
        let expected = [None, Some([share(deviation), share(2.0 * deviation)]), None, None, None, None];
        assert_eq!(found.within, expected);
        assert!(
            share(deviation) > 0.0
                && share(2.0 * deviation) > share(deviation)
                && share(2.0 * deviation) < 1.0
        );
        header.members = 1;
        let alone = Surrogate::new(header.clone(), vec![member(1.0)]).unwrap();
        assert_eq!(FlagStatistics::count(&alone, rows.iter(), 0.0).unwrap().within, [None; 6]);
    }

    /// Laws that predict zero, and the stress of one row.
    #[test]
    fn bad_and_good_by_hand() {
        let rows = rows_of_a_law();
        let rows: Vec<&DataRow> = rows[1..40].iter().collect();
        let mut header = Header::new(Kind::Ann, &[], 2);
        header.output_deviation = vec![0.0; 6];
        let law = Surrogate::random(header.clone(), 1).unwrap();
        let found = FlagStatistics::count(&law, rows.iter().copied(), 0.0).unwrap();
        // predictions are 0: all bad, all outside the box C = I, members agree
        assert_eq!((found.bad, found.good, found.caught), (39, 0, [39, 39, 0, 0]));
        assert_eq!(found.correlation, None);
        // with noise as large as the stress no prediction is bad
        let noisy = FlagStatistics::count(&law, rows.iter().copied(), 1e9).unwrap();
        assert_eq!((noisy.bad, noisy.alarms), (0, [39, 39, 0, 0]));
        // the prediction is right at one row, whose C lies in the box
        header.training_box = [[-9.0, 9.0]; 6];
        header.output_mean = rows[9].s.as_slice().to_vec();
        let law = Surrogate::random(header, 1).unwrap();
        let found = FlagStatistics::count(&law, rows[9..10].iter().copied(), 0.0).unwrap();
        assert_eq!((found.bad, found.good, found.alarms), (0, 1, [0; 4]));
    }
}
