//! Student's t distribution.

use polycore::numerics::bisected;

/// Returns t with P(|x| ≤ t) = 0.95 for Student's distribution with `degrees` degrees of freedom (at least
/// 1); Abramowitz & Stegun 26.7.3 and 26.7.4, inverted by bisection.
pub fn quantile(degrees: usize) -> f64 {
    if degrees > 2000 {
        // 26.7.5: its next term is below 1e-9 here
        let (z, n) = (1.959_963_984_540_054_f64, degrees as f64);
        let second = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / (96.0 * n * n);
        return z + (z.powi(3) + z) / (4.0 * n) + second;
    }
    bisected(0.0, 13.0, 60, |t| within(t, degrees.max(1)) < 0.95)
}

/// Probability P(|x| ≤ t).
fn within(t: f64, degrees: usize) -> f64 {
    let angle = (t / (degrees as f64).sqrt()).atan();
    let (sine, cosine) = angle.sin_cos();
    let odd = degrees % 2 == 1;
    // 1 + 1/2 cos² + (1·3)/(2·4) cos⁴ + …, or cos + 2/3 cos³ + (2·4)/(3·5) cos⁵ + …
    let (mut term, mut sum) = (if odd { cosine } else { 1.0 }, 0.0);
    let mut k = if odd { 1 } else { 0 };
    while k + 2 <= degrees {
        sum += term;
        term *= cosine * cosine * (k + 1) as f64 / (k + 2) as f64;
        k += 2;
    }
    if odd { (angle + sine * sum) * std::f64::consts::FRAC_2_PI } else { sine * sum }
}

#[cfg(test)]
mod tests {
    /// Tables of the t distribution, two-sided 95 % (e.g. Abramowitz & Stegun, table 26.10).
    #[test]
    fn table() {
        for (degrees, t) in [
            (1, 12.706),
            (2, 4.303),
            (3, 3.182),
            (4, 2.776),
            (5, 2.571),
            (10, 2.228),
            (30, 2.042),
            (60, 2.000),
            (120, 1.980),
        ] {
            assert!((super::quantile(degrees) - t).abs() < 6e-4, "{degrees} {}", super::quantile(degrees));
        }
        assert!((super::quantile(2001) - super::quantile(2000)).abs() < 1e-6);
        assert!((super::quantile(usize::MAX) - 1.95996).abs() < 1e-5);
    }
}
