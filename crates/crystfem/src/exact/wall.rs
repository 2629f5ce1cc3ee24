//! A plane wall: with films on both sides, or with temperature-dependent conductivity.

use super::half_space::film_share;
use super::root;

/// A wall of half thickness L with films on both faces, or of thickness L with one face insulated; ξ = x/L is
/// 0 at the middle (the insulated face) and 1 at the film. θ = (T − T_a)/(T_i − T_a).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wall {
    /// Bi = hL/k, from 0 (insulated) to infinity (held faces).
    pub biot: f64,
}

impl Wall {
    /// n-th root (from 0) of ζ tan ζ = Bi, split into nπ and the remainder: 0 ≤ ζ − nπ ≤ π/2.
    pub fn root(&self, n: u32) -> (f64, f64) {
        let whole = f64::from(n) * std::f64::consts::PI;
        // (φ + nπ) tan φ = Bi as φ = atan(Bi/(φ + nπ)): the difference is monotone for any Bi
        let rest = root(0.0, std::f64::consts::FRAC_PI_2, |rest| self.biot.atan2(rest + whole) - rest);
        (whole, rest)
    }

    /// Returns θ at ξ after Fo = αt/L², within 1e-13: Σ 4 sin ζ/(2ζ + sin 2ζ) e^{−ζ²Fo} cos ζξ (Carslaw &
    /// Jaeger, 3.11).
    ///
    /// Below Fo = 0.02 the two faces are half spaces (the temperature wave of one is below 1e-21 at the
    /// other); above, twenty terms suffice (e^{−ζ²Fo} < 1e-30 after them).
    pub fn share(&self, place: f64, fourier: f64) -> f64 {
        if fourier.is_nan() || fourier < 0.0 || self.biot.is_nan() || self.biot < 0.0 {
            return f64::NAN;
        }
        if self.biot == 0.0 {
            return 1.0;
        }
        if fourier < 0.02 {
            let root = fourier.sqrt();
            let side = |depth: f64| {
                let similarity = if depth == 0.0 { 0.0 } else { depth / (2.0 * root) };
                // an infinite film holds its face from the start
                film_share(similarity, if fourier == 0.0 && depth > 0.0 { 0.0 } else { self.biot * root })
            };
            return if fourier == 0.0 { 1.0 } else { 1.0 - (side(1.0 - place) + side(1.0 + place)) };
        }
        let term = |n: u32| {
            let (whole, rest) = self.root(n);
            let zeta = whole + rest;
            // sin ζ = ± sin φ and sin 2ζ = sin 2φ keep digits for large n and near nπ
            let sign = if n.is_multiple_of(2) { 1.0 } else { -1.0 };
            4.0 * sign * rest.sin() / (2.0 * zeta + (2.0 * rest).sin())
                * (-zeta * zeta * fourier).exp()
                * (zeta * place).cos()
        };
        (0..20).rev().map(term).sum()
    }
}

/// Returns T at ξ = x/L between two held faces, K, for k = k₀ (1 + b (T − T₀)): Kirchhoff's u = T − T₀ + b (T
/// − T₀)²/2 is linear in x. `slope` is b, 1/K; `reference` T₀, K. NaN unless k is positive at both faces.
pub fn steady_wall(faces: [f64; 2], slope: f64, reference: f64, place: f64) -> f64 {
    let [a, b] = faces.map(|face| face - reference);
    if !(1.0 + slope * a > 0.0 && 1.0 + slope * b > 0.0) {
        return f64::NAN;
    }
    let u = |t: f64| t + 0.5 * slope * t * t;
    let here = u(a) + (u(b) - u(a)) * place;
    // root with positive conductivity, in the form without cancellation at small b
    reference + 2.0 * here / (1.0 + (1.0 + 2.0 * slope * here).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_of_the_formulation() {
        assert!((Wall { biot: 1.0 }.share(0.0, 0.5) - 0.772_526_383_424).abs() < 1e-12);
    }

    #[test]
    fn any_biot_number() {
        // 400 terms in 40-digit arithmetic (mpmath)
        for (biot, fourier, place, exact) in [
            (1e-6, 0.5, 0.0, 0.999_999_665_209_438_4),
            (1e-6, 1e6, 1.0, 0.367_879_441_171_413_7),
            (1e6, 0.5, 0.0, 0.370_778_344_529_272_83),
            (1e6, 0.1, 1.0, 1.783_962_121_164_644_7e-6),
            (1.0, 0.01, 0.9, 0.962_706_636_345_358_2),
            (1.0, 0.02, 1.0, 0.858_479_616_466_947_4),
            (1.0, 0.02, 0.5, 0.999_243_760_943_438_4),
            (100.0, 1e-3, 1.0, 0.170_577_718_325_972_65),
        ] {
            let share = Wall { biot }.share(place, fourier);
            assert!((share - exact).abs() < 1e-13, "{biot} {fourier} {place}: {share} {exact}");
        }
    }

    #[test]
    fn both_forms_agree_at_their_border() {
        for biot in [1e-6, 1e-3, 0.1, 1.0, 10.0, 1e3, 1e6, f64::INFINITY] {
            for place in [0.0, 0.3, 0.9, 1.0] {
                let wall = Wall { biot };
                let [below, above] = [0.02 * (1.0 - 1e-14), 0.02].map(|fourier| wall.share(place, fourier));
                assert!((below - above).abs() < 1e-13, "{biot} {place}: {below} {above}");
            }
        }
    }

    #[test]
    fn limits() {
        assert_eq!(Wall { biot: 0.0 }.share(0.5, 3.0), 1.0);
        assert_eq!(Wall { biot: 2.0 }.share(0.5, 0.0), 1.0);
        assert_eq!(Wall { biot: 2.0 }.share(0.5, f64::INFINITY), 0.0);
        assert!(Wall { biot: f64::INFINITY }.share(1.0, 1e-6).abs() < 1e-15);
        assert!(Wall { biot: -1.0 }.share(0.5, 1.0).is_nan() && Wall { biot: 1.0 }.share(0.5, -1.0).is_nan());
        // held faces: ζ = (n + 1/2)π
        let (whole, rest) = Wall { biot: f64::INFINITY }.root(3);
        assert_eq!((whole, rest), (3.0 * std::f64::consts::PI, std::f64::consts::FRAC_PI_2));
        // ζ → √Bi
        assert!((Wall { biot: 1e-12 }.root(0).1 / 1e-6 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn kirchhoff() {
        assert_eq!(steady_wall([300.0, 400.0], 0.0, 300.0, 0.25), 325.0);
        // the flux k ∂T/∂x is uniform
        let at = |place| steady_wall([300.0, 400.0], 0.01, 320.0, place);
        let flux =
            |place: f64| (1.0 + 0.01 * (at(place) - 320.0)) * (at(place + 1e-6) - at(place - 1e-6)) / 2e-6;
        assert!((flux(0.2) / flux(0.8) - 1.0).abs() < 1e-8);
        assert!(steady_wall([300.0, 500.0], -0.01, 300.0, 0.5).is_nan());
    }
}
