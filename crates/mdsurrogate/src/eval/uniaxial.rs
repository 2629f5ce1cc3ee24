//! Curves of uniaxial runs: moduli, stiffening, peaks.

use crate::dataset::Path as Run;

/// Strain range for the modulus: below, the crystal is still relaxing; above, it softens or stiffens.
pub const MODULUS: [f64; 2] = [0.02, 0.08];
/// Strain ranges before and after 12 %, where the thesis finds stiffening in x (§3.2).
pub const STIFFENING: [[f64; 2]; 2] = [[0.04, 0.12], [0.12, 0.20]];
/// Window of the moving mean, which removes peaks of the noise.
const MEAN_OF: usize = 5;

/// Returns engineering strain and Cauchy stress (Pa) along the axis.
pub fn curve(run: &Run, axis: usize) -> Vec<[f64; 2]> {
    run.rows.iter().map(|row| [row.deformation.matrix()[(axis, axis)] - 1.0, row.cauchy[axis]]).collect()
}

/// Computes the least-squares slope between two strains; `None` for fewer than five points.
pub fn slope(points: &[[f64; 2]], [low, high]: [f64; 2]) -> Option<f64> {
    let own: Vec<[f64; 2]> = points.iter().filter(|p| (low..=high).contains(&p[0])).copied().collect();
    let mean = |k: usize| own.iter().map(|p| p[k]).sum::<f64>() / own.len() as f64;
    let [x, y] = [mean(0), mean(1)];
    let sum = |f: &dyn Fn(&[f64; 2]) -> f64| own.iter().map(f).sum::<f64>();
    let width = sum(&|p| (p[0] - x).powi(2));
    (own.len() >= 5 && width > 0.0).then(|| sum(&|p| (p[0] - x) * (p[1] - y)) / width)
}

/// Returns strain and value of the largest moving mean.
pub fn peak(points: &[[f64; 2]]) -> Option<[f64; 2]> {
    let mean = |window: &[[f64; 2]], k: usize| window.iter().map(|p| p[k]).sum::<f64>() / MEAN_OF as f64;
    let means = points.windows(MEAN_OF).map(|window| [mean(window, 0), mean(window, 1)]);
    means.max_by(|a, b| a[1].total_cmp(&b[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_and_peaks_by_hand() {
        // slopes of 2 and 6 Pa before and after 0.12, then falling
        let stress = |e: f64| match e {
            e if e <= 0.12 => 1.0 + 2.0 * e,
            e if e <= 0.2 => 1.24 + 6.0 * (e - 0.12),
            e => 1.72 - (e - 0.2),
        };
        let points: Vec<[f64; 2]> = (0..=60).map(|k| 0.005 * f64::from(k)).map(|e| [e, stress(e)]).collect();
        assert!((slope(&points, MODULUS).unwrap() - 2.0).abs() < 1e-12);
        assert!((slope(&points, [0.125, 0.2]).unwrap() - 6.0).abs() < 1e-12);
        assert_eq!(slope(&points, [0.0, 0.015]), None);
        // five samples from the peak on: 1.72, 1.715, 1.71, 1.705, 1.7
        let [strain, height] = peak(&points).unwrap();
        assert!((strain - 0.21).abs() < 1e-9 && (height - 1.71).abs() < 1e-9, "{strain} {height}");
    }
}
