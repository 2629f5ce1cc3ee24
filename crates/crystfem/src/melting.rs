//! Melting: degree of melting X_m(T) by Richards' curve, and survival of crystals on heating.

use crate::error::Error;
use crate::simd_math::{exp, expm1_near, ln, ln_1p};

/// Richards' curve, the distribution of melting temperatures. Eq. (4.8) integrates in closed form to X_m = (1
/// + (d−1) e^{−k_m(T−T_p)})^{1/(1−d)}.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Melting {
    /// Sharpness k_m, 1/K.
    sharpness: f64,
    /// Shape d.
    shape: f64,
    /// Most probable melting temperature T_p, K.
    peak: f64,
}

impl Melting {
    /// PA12: k_m = 0.965 /K, d = 8.584, T_p = 450 K (§4.2, after its reference \[23\]).
    pub const PA12: Self = Self { sharpness: 0.965, shape: 8.584, peak: 450.0 };

    /// Returns the curve of sharpness k_m, 1/K, shape d and peak T_p, K.
    ///
    /// # Errors
    /// [`Error::Parameter`] unless k_m > 0, d ≥ 1.001 (the limit d = 1 is Gompertz' curve) and T_p > 0 are
    /// finite.
    pub fn new(sharpness: f64, shape: f64, peak: f64) -> Result<Self, Error> {
        let check = |name, found: f64, good: bool, allowed: &str| {
            if good && found.is_finite() {
                Ok(())
            } else {
                Err(Error::Parameter { name, found, allowed: allowed.to_owned() })
            }
        };
        check("sharpness of melting k_m, 1/K", sharpness, sharpness > 0.0, "above 0")?;
        check("shape of melting d", shape, (1.001..=1e6).contains(&shape), "1.001 to 1e6")?;
        check("peak of melting, K", peak, peak > 0.0, "above 0")?;
        Ok(Self { sharpness, shape, peak })
    }

    /// Constants k_m, d and T_p.
    pub fn constants(&self) -> [f64; 3] {
        [self.sharpness, self.shape, self.peak]
    }

    /// Degree of melting X_m(T): 0 for solid, 1 for melt.
    pub fn molten(&self, temperature: f64) -> f64 {
        (-self.depth(temperature)[0]).exp()
    }

    /// dX_m/dT, 1/K, Eq. (4.8).
    pub fn molten_slope(&self, temperature: f64) -> f64 {
        let [depth, slope] = self.depth(temperature);
        -slope * (-depth).exp()
    }

    /// ln(1 − X_m) and its derivative in T, 1/K: accurate at both ends, where X_m or 1 − X_m underflows.
    pub fn survival(&self, temperature: f64) -> [f64; 2] {
        let exponent = self.sharpness * (temperature - self.peak);
        // above, 1 − X_m = e^{−k_m(T−T_p)} to the last bit
        if exponent > 600.0 {
            return [-exponent, -self.sharpness];
        }
        let [depth, slope] = self.depth(temperature);
        let survivors = -(-depth).exp_m1();
        let logarithm = if depth < 0.7 { survivors.ln() } else { (-(-depth).exp()).ln_1p() };
        [logarithm, slope * (-depth).exp() / survivors]
    }

    /// [`Self::survival`] without branches and slope, for vectorized loops.
    #[inline(always)]
    pub(crate) fn survival_of_all(&self, temperature: f64) -> f64 {
        let power = self.shape - 1.0;
        let beyond = self.sharpness * (temperature - self.peak);
        let exponent = ln(power) - beyond;
        let depth = (exponent.max(0.0) + ln_1p(exp(-exponent.abs()))) / power;
        let little = depth < std::f64::consts::LN_2;
        let solid = ln_1p(-exp(-depth).min(0.5));
        let molten = ln(-expm1_near((-depth).max(-0.7)));
        let logarithm = if little { molten } else { solid };
        if beyond > 600.0 { -beyond } else { logarithm }
    }

    /// −ln X_m = ln(1 + (d−1) e^{−k_m(T−T_p)})/(d−1) and its derivative in T.
    fn depth(&self, temperature: f64) -> [f64; 2] {
        let power = self.shape - 1.0;
        let exponent = power.ln() - self.sharpness * (temperature - self.peak);
        let softplus = exponent.max(0.0) + (-exponent.abs()).exp().ln_1p();
        let logistic = if exponent > 0.0 {
            (1.0 + (-exponent).exp()).recip()
        } else {
            exponent.exp() / (1.0 + exponent.exp())
        };
        [softplus / power, -self.sharpness * logistic / power]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `reference/ch4/curves.txt`, first lines, to the digits printed there.
    #[test]
    fn values_of_the_closed_form() {
        let pa12 = Melting::PA12;
        for (temperature, molten, tolerance) in
            [(420.0, 0.01683, 5e-6), (450.0, 0.75316, 5e-6), (460.0, 0.999936, 5e-7)]
        {
            assert!((pa12.molten(temperature) - molten).abs() < tolerance, "{temperature}");
        }
        evidence::near("X_m(450 K) in closed form", pa12.molten(450.0), 0.75316, 5e-6);
        assert!((pa12.molten_slope(450.0) - 0.08467).abs() < 5e-6);
    }

    /// The slope is Eq. (4.8) as printed.
    #[test]
    fn the_slope_is_the_printed_one() {
        let pa12 = Melting::PA12;
        let [k, d, peak] = pa12.constants();
        for temperature in [400.0, 430.0, 450.0, 455.0, 465.0] {
            let e = (-k * (temperature - peak)).exp();
            let printed = k * e * (1.0 + (d - 1.0) * e).powf(d / (1.0 - d));
            assert!((pa12.molten_slope(temperature) / printed - 1.0).abs() < 1e-12, "{temperature}");
            let [log, slope] = pa12.survival(temperature);
            assert!((pa12.survival_of_all(temperature) / log - 1.0).abs() < 1e-14);
            assert!((log.exp() + pa12.molten(temperature) - 1.0).abs() < 1e-15);
            assert!((slope + printed / (1.0 - pa12.molten(temperature))).abs() < 1e-9 * slope.abs());
        }
    }

    /// The curve is finite, falling, and asymptotically −k_m(T − T_p), from absolute zero to 1e6 K.
    #[test]
    fn ends_of_the_curve() {
        let pa12 = Melting::PA12;
        let mut before = 0.0;
        for step in 0..10_000 {
            let [log, slope] = pa12.survival(f64::from(step) * 0.5);
            assert!(
                log.is_finite() && slope.is_finite() && log <= before && slope <= 0.0,
                "{step} {log} {slope}"
            );
            let own = pa12.survival_of_all(f64::from(step) * 0.5);
            assert!((own - log).abs() <= 1e-13 * log.abs(), "{step} {own:e} {log:e}");
            before = log;
        }
        let [log, slope] = pa12.survival(1e6);
        assert_eq!([log, slope], [-0.965 * (1e6 - 450.0), -0.965]);
        // both branches agree at their border
        let border = 450.0 + 600.0 / 0.965;
        let ([below, _], [above, _]) = (pa12.survival(border - 1e-9), pa12.survival(border + 1e-9));
        assert!((below - above).abs() < 1e-8);
        assert_eq!(pa12.survival(-1e6)[0], 0.0);
    }

    #[test]
    fn refusals() {
        for (sharpness, shape, peak) in
            [(0.0, 8.0, 450.0), (1.0, 1.0, 450.0), (1.0, 8.0, f64::NAN), (f64::INFINITY, 8.0, 450.0)]
        {
            assert!(matches!(Melting::new(sharpness, shape, peak), Err(Error::Parameter { .. })));
        }
        assert_eq!(Melting::new(0.965, 8.584, 450.0).unwrap(), Melting::PA12);
    }
}
