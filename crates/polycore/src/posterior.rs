//! Posterior of a least-squares fit, as a sample of its parameters.

use crate::random::SplitMix64;
use nalgebra::DMatrix;

/// Number of draws that fits write.
pub const DRAWS: usize = 1000;

/// Degrees of freedom beyond which Student's distribution is replaced by the normal one.
const NORMAL: usize = 1000;

/// Draws parameters of a fit from Student's multivariate t about the minimum, with the covariance s²(JᵀJ)⁻¹
/// as its scale and the degrees of freedom of the residuals. It is the posterior of a linear
/// model with errors of one unknown size and no prior knowledge of either (Box & Tiao, *Bayesian Inference in
/// Statistical Analysis*, 1973, section 2.7), and Laplace's approximation of any other. The same seed gives
/// the same draws. `None` if the covariance is not positive definite.
pub fn draws(
    at: &[f64],
    covariance: &DMatrix<f64>,
    degrees: usize,
    count: usize,
    seed: u64,
) -> Option<Vec<Vec<f64>>> {
    let factor = covariance.clone().cholesky()?.unpack();
    let mut random = SplitMix64::new(seed);
    let mut draw = || {
        let normal: Vec<f64> = at.iter().map(|_| random.normal()).collect();
        let scale = if (1..=NORMAL).contains(&degrees) {
            let square: f64 = (0..degrees).map(|_| random.normal().powi(2)).sum();
            (degrees as f64 / square).sqrt()
        } else {
            1.0
        };
        let moved = |i: usize| (0..=i).map(|j| factor[(i, j)] * normal[j]).sum::<f64>();
        (0..at.len()).map(|i| at[i] + scale * moved(i)).collect()
    };
    Some((0..count).map(|_| draw()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean, covariance ν/(ν − 2) Σ, and the 97.5 % quantile of Student's t of 10 degrees of freedom, 2.228
    /// (tables).
    #[test]
    fn draws_have_the_moments_of_students_t() {
        let covariance = DMatrix::from_row_slice(2, 2, &[4.0, -1.2, -1.2, 1.0]);
        let (degrees, count) = (10, 200_000);
        let found = draws(&[3.0, -2.0], &covariance, degrees, count, 7).unwrap();
        let mean = [0, 1].map(|i| found.iter().map(|q| q[i]).sum::<f64>() / count as f64);
        assert!((mean[0] - 3.0).abs() < 0.02 && (mean[1] + 2.0).abs() < 0.01, "{mean:?}");
        let moment = |i: usize, j: usize| {
            found.iter().map(|q| (q[i] - mean[i]) * (q[j] - mean[j])).sum::<f64>() / count as f64
        };
        let wider = degrees as f64 / (degrees as f64 - 2.0);
        for (i, j) in [(0, 0), (0, 1), (1, 1)] {
            let ratio = moment(i, j) / (wider * covariance[(i, j)]);
            assert!((ratio - 1.0).abs() < 0.03, "{i} {j}: {ratio}");
        }
        let beyond = found.iter().filter(|q| (q[1] + 2.0).abs() > 2.228).count() as f64 / count as f64;
        evidence::near("posterior_beyond_the_interval", beyond, 0.05, 0.002);
        assert_eq!(draws(&[0.0], &DMatrix::from_element(1, 1, -1.0), 5, 3, 1), None);
        let again = |seed| draws(&[0.0], &DMatrix::from_element(1, 1, 1.0), 5, 3, seed);
        assert!(again(1) == again(1) && again(1) != again(2));
    }
}
