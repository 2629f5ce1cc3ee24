//! Bayesian optimisation: a Gaussian process of the losses, and the candidate with the largest expected
//! improvement.

use super::{Journal, Oracle, SearchCandidate, SearchMethod, SearchSpace, ask};
use crate::Error;
use crate::random::SplitMix64;
use egobox_gp::GaussianProcess;
use egobox_gp::correlation_models::Matern52Corr;
use egobox_gp::mean_models::ConstantMean;
use linfa::traits::Fit;
use ndarray::{Array1, Array2};

/// Number of compared candidates, each at random and near the best ones.
const SAMPLED: usize = 500;
/// Number of best candidates whose neighbours are compared.
const BEST: usize = 5;
/// Noise variance of a loss relative to the variance of all losses: two seeds of a network differ by about a
/// tenth of the spread.
const NUGGET: f64 = 1e-2;
/// Number of starts of the likelihood maximisation; above one, because egobox draws a single start without a
/// seed.
const STARTS: usize = 2;

/// Searches with `trials` trainings of `epochs`, the first `initial` of them at random.
///
/// The Gaussian process (Matérn 5/2, constant mean, egobox) models the logarithm of the loss; a diverged
/// training counts as twice the largest loss.
///
/// # Errors
/// Returns [`Error::Parameter`] for fewer than 3 initial trials or fewer trials than these, and the errors of
/// [`SearchSpace::check`] and the oracle.
pub fn bayesian(
    space: &SearchSpace,
    [initial, trials]: [usize; 2],
    epochs: u32,
    seed: u64,
    journal: &mut Journal,
    oracle: &mut dyn Oracle,
) -> Result<(), Error> {
    space.check()?;
    if !(3..=10_000).contains(&initial) || !(initial..=10_000).contains(&trials) {
        let allowed = "at least 3 initial and at most 10,000 trials";
        return Err(Error::parameter("trials", format!("{trials}, {initial} of them initial"), allowed));
    }
    let mut random = SplitMix64::new(seed);
    let (mut points, mut losses): (Vec<SearchCandidate>, Vec<Option<f64>>) = (Vec::new(), Vec::new());
    for number in 0..trials {
        let candidate = match number < initial {
            true => space.sample(&mut random),
            false => most_promising(space, &points, &losses, &mut random),
        };
        losses.push(ask(oracle, journal, SearchMethod::Bayesian, number, &candidate, epochs)?);
        oracle.forget(SearchMethod::Bayesian, &[number]);
        points.push(candidate);
    }
    Ok(())
}

/// Returns the untried candidate with the largest expected improvement; a random one if no process can be
/// fitted (equal losses) or all candidates were tried.
fn most_promising(
    space: &SearchSpace,
    tried: &[SearchCandidate],
    losses: &[Option<f64>],
    random: &mut SplitMix64,
) -> SearchCandidate {
    let mut order: Vec<usize> = (0..tried.len()).collect();
    order.sort_by(|&a, &b| losses[a].unwrap_or(f64::INFINITY).total_cmp(&losses[b].unwrap_or(f64::INFINITY)));
    let mut sampled: Vec<SearchCandidate> = (0..SAMPLED).map(|_| space.sample(random)).collect();
    for k in 0..SAMPLED {
        sampled.push(space.neighbour(&tried[order[k % order.len().min(BEST)]], random));
    }
    let fallback = space.sample(random);
    sampled.retain(|candidate| !tried.contains(candidate));
    let Some(first) = sampled.first() else { return fallback };
    let worst = losses.iter().flatten().fold(f64::MIN_POSITIVE, |worst, &loss| worst.max(loss));
    let targets: Vec<f64> =
        losses.iter().map(|loss| loss.unwrap_or(2.0 * worst).max(f64::MIN_POSITIVE).ln()).collect();
    let least = targets.iter().copied().fold(f64::INFINITY, f64::min);
    let width = space.encode(first).len();
    let table = |list: &[SearchCandidate]| {
        let flat: Vec<f64> = list.iter().flat_map(|candidate| space.encode(candidate)).collect();
        Array2::from_shape_vec((list.len(), width), flat).ok()
    };
    let (Some(x), Some(asked)) = (table(tried), table(&sampled)) else { return fallback };
    let process = GaussianProcess::<f64, ConstantMean, Matern52Corr>::params(
        ConstantMean::default(),
        Matern52Corr::default(),
    )
    .nugget(NUGGET)
    .n_start(STARTS);
    let fitted = process.fit(&linfa::Dataset::new(x, Array1::from(targets)));
    let Some((mean, variance)) = fitted.ok().and_then(|process| process.predict_valvar(&asked).ok()) else {
        return fallback;
    };
    let mut best = (0.0, None);
    for (k, (&mean, &variance)) in mean.iter().zip(&variance).enumerate() {
        let gain = expected_improvement(least, mean, variance.max(0.0).sqrt());
        if gain > best.0 {
            best = (gain, Some(k));
        }
    }
    best.1.map_or(fallback, |k| sampled[k].clone())
}

/// Computes (f* − μ)Φ(z) + σφ(z) with z = (f* − μ)/σ (Jones et al. 1998, Eq. 15).
fn expected_improvement(least: f64, mean: f64, deviation: f64) -> f64 {
    let gain = least - mean;
    if deviation <= 0.0 {
        return gain.max(0.0);
    }
    let z = gain / deviation;
    let below = 0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2);
    let density = (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
    gain * below + deviation * density
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quadrature of max(f* − y, 0) over the normal distribution.
    #[test]
    fn expected_improvement_is_an_expectation() {
        for (mean, deviation) in [(0.0, 1.0), (1.5, 0.7), (-2.0, 0.3), (4.0, 1.0)] {
            let step = 1e-4;
            let gain = |k: i32| {
                let z = f64::from(k) * step;
                let density = (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
                (0.5 - (mean + deviation * z)).max(0.0) * density * step
            };
            let sum: f64 = (-100_000..=100_000).map(gain).sum();
            // the error of the rule at the kink is of order step²
            assert!((expected_improvement(0.5, mean, deviation) - sum).abs() < 1e-8);
        }
        assert_eq!(expected_improvement(1.0, 0.25, 0.0), 0.75);
        assert_eq!(expected_improvement(1.0, 2.0, 0.0), 0.0);
    }
}
