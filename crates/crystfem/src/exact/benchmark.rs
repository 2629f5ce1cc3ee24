//! Benchmarks of NAFEMS in closed form (Cameron, Casey, Simpson, Benchmark Tests for Thermal Analysis, 1986).

use super::{Wall, root};
use std::f64::consts::PI;

/// Temperature, K, at the free end of a rod held at `hot` at the other end and radiating to `ambient`: the
/// root of k/L (T_h − T) = εσ (T⁴ − T_a⁴). `conductance` is k/L, `radiation` εσ. T2 of NAFEMS. NaN unless
/// both are above 0 and T_h ≥ T_a ≥ 0.
pub fn radiating_rod(hot: f64, ambient: f64, conductance: f64, radiation: f64) -> f64 {
    if !(conductance > 0.0 && radiation > 0.0 && ambient >= 0.0 && hot >= ambient) {
        return f64::NAN;
    }
    root(ambient, hot, |t| conductance * (hot - t) - radiation * (t.powi(4) - ambient.powi(4)))
}

/// A slab held at 0 at x = 0 and at A sin ωt at x = L from t = 0, initially at 0. T3 of NAFEMS.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SwingingSlab {
    /// L, m.
    pub thickness: f64,
    /// a = k/(ρc), m²/s.
    pub diffusivity: f64,
    /// ω, rad/s.
    pub angular_frequency: f64,
}

impl SwingingSlab {
    /// Returns T/A at x, m, and t > 0, s: Im[e^{iωt} sinh(qx)/sinh(qL)] with q = √(iω/a), and a decaying
    /// series (Carslaw & Jaeger, 3.6), within 1e-12 for at/L² ≥ 1e-4. NaN outside.
    pub fn share(&self, x: f64, time: f64) -> f64 {
        let Self { thickness, diffusivity, angular_frequency } = *self;
        let fourier = diffusivity * time / thickness.powi(2);
        if !(fourier >= 1e-4 && (0.0..=thickness).contains(&x) && angular_frequency > 0.0) {
            return f64::NAN;
        }
        // q = p (1 + i); sinh without its growth e^{px}/2
        let p = (0.5 * angular_frequency / diffusivity).sqrt();
        let sinh = |x: f64| {
            let decay = (-2.0 * p * x).exp();
            [(1.0 - decay) * (p * x).cos(), (1.0 + decay) * (p * x).sin()]
        };
        let ([a, b], [c, d]) = (sinh(x), sinh(thickness));
        let size = (p * (x - thickness)).exp() / (c * c + d * d);
        let [real, imaginary] = [size * (a * c + b * d), size * (b * c - a * d)];
        let (sin, cos) = (angular_frequency * time).sin_cos();
        let rate = |n: f64| diffusivity * (n * PI / thickness).powi(2);
        let transient: f64 = (1..=600)
            .map(f64::from)
            .take_while(|&n| rate(n) * time < 50.0)
            .map(|n| {
                let sign = if n % 2.0 == 0.0 { -1.0 } else { 1.0 };
                let k = rate(n);
                let weight =
                    2.0 * sign / (n * PI) * angular_frequency * k / (k * k + angular_frequency.powi(2));
                weight * (-k * time).exp() * (n * PI * x / thickness).sin()
            })
            .sum();
        real * sin + imaginary * cos + transient
    }
}

/// A plate 0 ≤ x ≤ a, 0 ≤ y ≤ b, held at 1 on y = 0, insulated on x = 0, with a film to 0 on x = a and y = b.
/// T4 of NAFEMS.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CooledPlate {
    /// a and b, m.
    pub size: [f64; 2],
    /// H = h/k, 1/m.
    pub film: f64,
}

impl CooledPlate {
    /// Returns T at a point, within 1e-12 for y ≥ a/50, NaN outside:
    /// Σ 4 sin ζ/(2ζ + sin 2ζ) cos βx Y(y)/Y(0) with ζ = βa, ζ tan ζ = Ha, Y = β cosh β(b − y) + H sinh β(b −
    /// y).
    pub fn share(&self, [x, y]: [f64; 2]) -> f64 {
        let ([a, b], film) = (self.size, self.film);
        if !((0.0..=a).contains(&x) && (a / 50.0..=b).contains(&y) && film > 0.0) {
            return f64::NAN;
        }
        let wall = Wall { biot: film * a };
        let term = |n: u32| {
            let (whole, rest) = wall.root(n);
            let zeta = whole + rest;
            let beta = zeta / a;
            let sign = if n.is_multiple_of(2) { 1.0 } else { -1.0 };
            // without the growth e^{β(b−y)}/2
            let profile = |left: f64| {
                let decay = (-2.0 * beta * left).exp();
                beta * (1.0 + decay) + film * (1.0 - decay)
            };
            4.0 * sign * rest.sin() / (2.0 * zeta + (2.0 * rest).sin())
                * (beta * x).cos()
                * (profile(b - y) / profile(b))
                * (-beta * y).exp()
        };
        // e^{−nπ/50} < 1e-16 beyond
        (0..600).rev().map(term).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// NAFEMS prints 927.0 K; more digits in 25-digit arithmetic (mpmath).
    #[test]
    fn rod() {
        for (sigma, exact) in [(5.67e-8, 927.007_606_246_246), (5.670_374_419e-8, 927.003_950_452_064)] {
            let found = radiating_rod(1000.0, 300.0, 556.0, 0.98 * sigma);
            assert!((found - exact).abs() < 1e-10, "{found}");
        }
        assert_eq!(radiating_rod(300.0, 300.0, 1.0, 1.0), 300.0);
        assert!(
            radiating_rod(200.0, 300.0, 1.0, 1.0).is_nan() && radiating_rod(400.0, 300.0, 0.0, 1.0).is_nan()
        );
    }

    /// NAFEMS prints 36.60 °C.
    #[test]
    fn slab() {
        let diffusivity = 35.0 / (7200.0 * 440.5);
        let slab = SwingingSlab { thickness: 0.1, diffusivity, angular_frequency: PI / 40.0 };
        for (x, time, exact) in [(0.08, 32.0, 36.603_115_959_084_61), (0.08, 8.0, 2.787_128_517_077_878)] {
            assert!((100.0 * slab.share(x, time) - exact).abs() < 1e-11, "{}", 100.0 * slab.share(x, time));
        }
        // the faces
        assert!(
            (slab.share(0.1, 32.0) - (0.8 * PI).sin()).abs() < 1e-12 && slab.share(0.0, 32.0).abs() < 1e-12
        );
        assert!(slab.share(0.2, 32.0).is_nan() && slab.share(0.05, 0.0).is_nan());
    }

    /// NAFEMS prints 18.3 °C.
    #[test]
    fn plate() {
        let plate = CooledPlate { size: [0.6, 1.0], film: 750.0 / 52.0 };
        for (at, exact) in [([0.6, 0.2], 18.253_756_537_134_22), ([0.0, 0.5], 35.401_153_989_785_79)] {
            assert!((100.0 * plate.share(at) - exact).abs() < 1e-10, "{}", 100.0 * plate.share(at));
        }
        // the film on top: T' = −H T
        let slope = (plate.share([0.3, 1.0]) - plate.share([0.3, 1.0 - 1e-6])) / 1e-6;
        assert!((slope / (-plate.film * plate.share([0.3, 1.0])) - 1.0).abs() < 1e-4);
        assert!(plate.share([0.3, 0.0]).is_nan());
    }
}
