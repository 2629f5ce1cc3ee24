//! 𝓛⁻¹ to the accuracy of the arithmetic, without iteration: polynomials of a smooth remainder.
//!
//! |x| < 1/2: 𝓛⁻¹ = 3x + x³P(x²). Beyond: 𝓛⁻¹ = 1/(c + Q(c)), where Q = 2/(e^{2β} − 1) is below rounding for
//! c < 3/64 and piecewise polynomial in c else. What the polynomials give is at most a sixth of the sum, so
//! that their rounding hardly counts.

use super::polynomial;
use super::table::{NEAR_ONE, NEAR_ZERO};

/// Below this complement Q(c)/c < 1.3e-17.
const RECIPROCAL_BELOW: f64 = 3.0 / 64.0;

/// The top bits of 3/64 down to the first one of the mantissa: half octaves are counted from here.
const FIRST_HALF_OCTAVE: u64 = RECIPROCAL_BELOW.to_bits() >> 51;

/// 𝓛⁻¹(x), within 1.6 ulp for every |x| < 1, subnormal numbers included. Odd.
///
/// 𝓛⁻¹(±1) = ±∞. For |x| > 1 there is no such β: NaN, as for x = NaN.
///
/// ```
/// // formulation.md, chain network: 𝓛⁻¹(1/√25)
/// assert!((polycore::langevin::inverse(0.2) - 0.614966600191).abs() < 1e-12);
/// assert!(polycore::langevin::inverse(1.5).is_nan());
/// ```
pub fn inverse(x: f64) -> f64 {
    let magnitude = x.abs();
    if magnitude < 0.5 {
        from_small(x)
    } else {
        // the difference is exact
        from_small_complement(1.0 - magnitude).copysign(x)
    }
}

/// 𝓛⁻¹(1 − c), within 1.6 ulp of the given c ∈ (0, 1]: nothing is lost near locking, where 𝓛⁻¹ → 1/c.
///
/// The magnitude for x of either sign, with c = 1 − |x|. ∞ at c = 0 (and where 1/c overflows), NaN outside
/// [0, 1].
///
/// ```
/// assert_eq!(polycore::langevin::inverse_from_complement(1e-200), 1e200);
/// ```
pub fn inverse_from_complement(complement: f64) -> f64 {
    if complement > 0.5 && complement <= 1.0 {
        from_small(1.0 - complement)
    } else {
        from_small_complement(complement)
    }
}

/// d𝓛⁻¹/dx = 1/𝓛′(𝓛⁻¹(x)); even, 3 at 0, 1/(1 − |x|)² near 1, ∞ at ±1, NaN beyond.
pub fn inverse_derivative(x: f64) -> f64 {
    super::reciprocal_derivative(inverse(x))
}

/// 𝓛⁻¹(x) and its derivative, as [`inverse`] and [`inverse_derivative`] give them.
pub fn inverse_with_derivative(x: f64) -> [f64; 2] {
    let beta = inverse(x);
    [beta, super::reciprocal_derivative(beta)]
}

/// d𝓛⁻¹/dx at |x| = 1 − c for a given c ∈ [0, 1]; ∞ at c = 0, NaN outside.
pub fn inverse_derivative_from_complement(complement: f64) -> f64 {
    super::reciprocal_derivative(inverse_from_complement(complement))
}

#[inline]
fn from_small(x: f64) -> f64 {
    let square = x * x;
    3.0 * x + x * (square * polynomial(square, &NEAR_ZERO))
}

#[inline]
fn from_small_complement(complement: f64) -> f64 {
    if complement < RECIPROCAL_BELOW {
        return if complement >= 0.0 { 1.0 / complement.abs() } else { f64::NAN };
    }
    // 1/2 itself belongs to the last half octave
    if complement > 0.5 || complement.is_nan() {
        return f64::NAN;
    }
    let half_octave = ((complement.to_bits() >> 51) - FIRST_HALF_OCTAVE) as usize;
    let (middle, coefficients) = &NEAR_ONE[half_octave.min(NEAR_ONE.len() - 1)];
    1.0 / (complement + polynomial(complement - middle, coefficients))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::langevin::{complement, derivative, langevin};
    use proptest::prelude::*;

    #[test]
    fn limits() {
        assert_eq!(inverse(0.0), 0.0);
        assert!(inverse(-0.0).is_sign_negative());
        assert_eq!(inverse(1.0), f64::INFINITY);
        assert_eq!(inverse(-1.0), f64::NEG_INFINITY);
        assert_eq!(inverse_from_complement(0.0), f64::INFINITY);
        assert_eq!(inverse_from_complement(-0.0), f64::INFINITY);
        assert_eq!(inverse_from_complement(1.0), 0.0);
        assert_eq!(inverse_derivative(0.0), 3.0);
        assert_eq!(inverse_derivative(-1.0), f64::INFINITY);
        assert_eq!(inverse_derivative_from_complement(0.0), f64::INFINITY);
        assert_eq!(inverse_derivative_from_complement(1e-100), 1e200);
        for beyond in [1.0f64.next_up(), -1.0f64.next_up(), 2.0, f64::INFINITY, f64::NAN] {
            assert!(inverse(beyond).is_nan() && inverse_derivative(beyond).is_nan(), "{beyond}");
            assert!(inverse_from_complement(beyond).is_nan(), "{beyond}");
        }
        assert!(inverse_from_complement(-f64::MIN_POSITIVE).is_nan());
        // 3x is exact there
        assert_eq!(inverse(f64::from_bits(1)), f64::from_bits(3));
    }

    #[test]
    fn taylor_series() {
        // 3x + 9x³/5 + 297x⁵/175: Kuhn and Grün 1942, doi:10.1007/BF01793684; the next term is 1.76 x⁷
        for x in [1e-8f64, 1e-4, 1e-3] {
            let series = 3.0 * x + 1.8 * x.powi(3) + 297.0 / 175.0 * x.powi(5);
            assert!((inverse(x) / series - 1.0).abs() < 4e-16);
        }
    }

    #[test]
    fn numbers_of_the_formulation() {
        for (links, beta) in [(8.0f64, 1.150986111540), (25.0, 0.614966600191), (100.0, 0.301817149206)] {
            assert!((inverse(1.0 / links.sqrt()) - beta).abs() < 1e-12);
        }
    }

    #[test]
    fn continuous_where_polynomials_meet() {
        for edge in [3.0 / 64.0, 1.0 / 16.0, 3.0 / 32.0, 0.125, 0.1875, 0.25, 0.375, 0.5] {
            let (below, above) =
                (inverse_from_complement(f64::next_down(edge)), inverse_from_complement(edge));
            // 4 ulp: the errors of both sides
            assert!((below / above - 1.0).abs() < 4.0 * f64::EPSILON, "{edge}");
        }
    }

    proptest! {
        /// The error of 𝓛⁻¹(x) is that of 𝓛 (5 ulp) times x/(β𝓛′) ≥ 1, and its own.
        #[test]
        fn round_trip(exponent in -12.0..1.0f64) {
            let beta = 10f64.powf(exponent);
            let x = langevin(beta);
            let condition = x / (beta * derivative(beta));
            prop_assert!((inverse(x) / beta - 1.0).abs() < (6.0 * condition + 4.0) * f64::EPSILON);
        }

        #[test]
        fn round_trip_near_locking(exponent in 0.3..300.0f64) {
            let beta = 10f64.powf(exponent);
            prop_assert!((inverse_from_complement(complement(beta)) / beta - 1.0).abs() < 6.0 * f64::EPSILON);
        }

        #[test]
        fn odd(x in -1.0..1.0f64) {
            prop_assert_eq!(inverse(-x), -inverse(x));
            prop_assert_eq!(inverse_derivative(-x), inverse_derivative(x));
        }

        /// Central differences on the complement: truncation (h/c)² and cancellation ε c/h both below 1e-8.
        #[test]
        fn derivative_by_differences(exponent in -12.0..-0.1f64) {
            let c = 10f64.powf(exponent);
            let step = (1e-5 * c).min(1e-5 * (1.0 - c));
            let slope = (inverse_from_complement(c - step) - inverse_from_complement(c + step))
                / ((c + step) - (c - step));
            prop_assert!((slope / inverse_derivative_from_complement(c) - 1.0).abs() < 1e-8);
        }
    }
}
