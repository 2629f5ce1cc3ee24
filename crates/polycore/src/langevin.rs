//! The Langevin function 𝓛(β) = coth β − 1/β of chain statistics, its inverse, and the energies that follow.
//!
//! A chain of n rigid links at relative extension x = r/(n b) ∈ (−1, 1) carries the dimensionless force
//! β = 𝓛⁻¹(x) (thesis (2.36); Kuhn and Grün 1942, doi:10.1007/BF01793684). Everything here is in
//! dimensionless numbers.
//!
//! Near the locking point x = 1 the digits are in the complement c = 1 − |x|, not in x: a caller who knows c
//! should use [`inverse_from_complement`].
//!
//! Accuracy, measured on 320 000 random arguments against mpmath (`tools/langevin.py`; a thousand of the
//! values are kept in `tests/langevin_reference.csv`), in units in the last place of the exact result:
//!
//! | function | max error | function | max error |
//! |---|---|---|---|
//! | [`langevin`] | 3.9 | [`inverse`], [`inverse_from_complement`] | 1.6 |
//! | [`derivative`] | 3.7 | [`inverse_derivative`] and its complement form | 4.6 |
//! | [`complement`] | 1.6 | [`ln_beta_over_sinh`] | 3.3 |
//! | | | [`free_energy`] | 9.2 |

mod approximant;
mod inverse;
mod table;

pub use approximant::Inverse;
pub use inverse::{
    inverse, inverse_derivative, inverse_derivative_from_complement, inverse_from_complement,
    inverse_with_derivative,
};

/// Below this |β| the functions are ratios of power series with positive terms; above, exponentials.
const SERIES_BELOW: f64 = 3.0;

/// Terms of every series and polynomial. The series need 13 of them at `SERIES_BELOW`; four chains of four
/// are fast.
const TERMS: usize = 16;

/// (sinh β − β)/β³ = Σ β²ᵏ/(2k+3)!
const SINH_EXCESS: [f64; TERMS] = {
    let mut terms = [0.0; TERMS];
    let mut k = 0;
    while k < TERMS {
        terms[k] = 1.0 / factorial(2 * k + 3);
        k += 1;
    }
    terms
};

/// (β cosh β − sinh β)/β³ = Σ (2k+2) β²ᵏ/(2k+3)!
const COSH_EXCESS: [f64; TERMS] = {
    let mut terms = [0.0; TERMS];
    let mut k = 0;
    while k < TERMS {
        terms[k] = (2 * k + 2) as f64 / factorial(2 * k + 3);
        k += 1;
    }
    terms
};

const fn factorial(n: usize) -> f64 {
    let mut product = 1.0;
    let mut factor = 2;
    while factor <= n {
        product *= factor as f64;
        factor += 1;
    }
    product
}

/// 𝓛(β) = coth β − 1/β (thesis Eqs. (1.26), (2.37)); odd, 𝓛(±∞) = ±1.
pub fn langevin(beta: f64) -> f64 {
    let magnitude = beta.abs();
    if magnitude < SERIES_BELOW {
        let square = beta * beta;
        beta * (polynomial(square, &COSH_EXCESS) / (1.0 + square * polynomial(square, &SINH_EXCESS)))
    } else {
        (1.0 - complement_above(magnitude)).copysign(beta)
    }
}

/// 1 − 𝓛(|β|), without cancellation for large β where it tends to 1/|β|.
pub fn complement(beta: f64) -> f64 {
    let magnitude = beta.abs();
    if magnitude < 1.0 { 1.0 - langevin(magnitude) } else { complement_above(magnitude) }
}

/// 𝓛′(β) = 1/β² − 1/sinh² β; even, 1/3 at 0, 1/β² for large β.
pub fn derivative(beta: f64) -> f64 {
    let magnitude = beta.abs();
    if magnitude < SERIES_BELOW {
        let (numerator, denominator) = derivative_ratio(magnitude);
        numerator / denominator
    } else {
        let reciprocal = 1.0 / magnitude;
        reciprocal * reciprocal * (1.0 - beta_over_sinh_squared(magnitude))
    }
}

/// ln(β/sinh β) (thesis Eqs. (1.27), (2.39)); even, −β²/6 for small β, ln 2|β| − |β| for large β, no overflow
/// anywhere.
pub fn ln_beta_over_sinh(beta: f64) -> f64 {
    let magnitude = beta.abs();
    if magnitude < SERIES_BELOW {
        // β·(β·s) and not β²·s: the square underflows before the result does
        -(magnitude * (magnitude * polynomial(magnitude * magnitude, &SINH_EXCESS))).ln_1p()
    } else if magnitude.is_infinite() {
        f64::NEG_INFINITY
    } else {
        (magnitude.ln() + std::f64::consts::LN_2 - magnitude) - (-(-2.0 * magnitude).exp()).ln_1p()
    }
}

/// Free energy of a chain per link and kθ, ψ = β𝓛(β) + ln(β/sinh β) (thesis Eq. (1.27)), with dψ/dx = β at x
/// = 𝓛(β).
///
/// β²/6 for small β. For large β the two terms are ±β while ψ grows as ln 2β − 1 only; they are combined
/// beforehand.
pub fn free_energy(beta: f64) -> f64 {
    let magnitude = beta.abs();
    // where the two ways lose equally little
    if magnitude < 1.25 {
        magnitude * langevin(magnitude) + ln_beta_over_sinh(magnitude)
    } else if magnitude.is_infinite() {
        f64::INFINITY
    } else {
        let decay = (-2.0 * magnitude).exp();
        let tail = if decay > 0.0 { 2.0 * magnitude * decay / (1.0 - decay) } else { 0.0 };
        magnitude.ln() + (std::f64::consts::LN_2 - 1.0) + (tail - (-decay).ln_1p())
    }
}

/// 1/𝓛′(β), which overflows later than the quotient.
fn reciprocal_derivative(beta: f64) -> f64 {
    let magnitude = beta.abs();
    if magnitude < SERIES_BELOW {
        let (numerator, denominator) = derivative_ratio(magnitude);
        denominator / numerator
    } else {
        magnitude * magnitude / (1.0 - beta_over_sinh_squared(magnitude))
    }
}

/// 𝓛′ = (sinh β − β)(sinh β + β)/(β sinh β)² with all powers of β cancelled: numerator and denominator.
fn derivative_ratio(beta: f64) -> (f64, f64) {
    let square = beta * beta;
    let excess = polynomial(square, &SINH_EXCESS);
    let ratio = 1.0 + square * excess;
    (excess * (1.0 + ratio), ratio * ratio)
}

/// 1 − 𝓛(β) = 1/β − 2/(e^{2β} − 1), which cancels below β = 1.
fn complement_above(beta: f64) -> f64 {
    1.0 / beta - 2.0 / (2.0 * beta).exp_m1()
}

/// (β/sinh β)², β ≥ `SERIES_BELOW`.
fn beta_over_sinh_squared(beta: f64) -> f64 {
    let decay = (-beta).exp();
    // β = ∞ is 0·∞
    if decay == 0.0 {
        return 0.0;
    }
    let ratio = 2.0 * beta * decay / (1.0 - decay * decay);
    ratio * ratio
}

/// Σ cₖ tᵏ as four interleaved Horner schemes in t⁴, which run side by side: half the time of a single one.
#[inline]
fn polynomial(at: f64, coefficients: &[f64; TERMS]) -> f64 {
    let square = at * at;
    let fourth = square * square;
    let c = coefficients;
    let chain = |k: usize| ((c[k + 12] * fourth + c[k + 8]) * fourth + c[k + 4]) * fourth + c[k];
    (chain(0) + chain(1) * at) + (chain(2) + chain(3) * at) * square
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn limits() {
        for function in [langevin, derivative, complement, ln_beta_over_sinh, free_energy, inverse] {
            assert!(function(f64::NAN).is_nan());
        }
        assert_eq!(langevin(0.0), 0.0);
        assert_eq!(langevin(f64::INFINITY), 1.0);
        assert_eq!(langevin(f64::NEG_INFINITY), -1.0);
        assert_eq!(derivative(0.0), 1.0 / 3.0);
        assert_eq!(derivative(f64::INFINITY), 0.0);
        assert_eq!(complement(f64::INFINITY), 0.0);
        assert_eq!(ln_beta_over_sinh(0.0), 0.0);
        assert_eq!(ln_beta_over_sinh(1e300), -1e300);
        assert_eq!(ln_beta_over_sinh(f64::MAX), -f64::MAX);
        assert_eq!(ln_beta_over_sinh(f64::NEG_INFINITY), f64::NEG_INFINITY);
        assert_eq!(free_energy(f64::INFINITY), f64::INFINITY);
        assert!((free_energy(f64::MAX) - (f64::MAX.ln() + std::f64::consts::LN_2 - 1.0)).abs() < 1e-12);
    }

    #[test]
    fn both_sides_of_the_switch_agree() {
        for switch in [1.0, 1.25, SERIES_BELOW] {
            for function in [langevin, derivative, complement, ln_beta_over_sinh, free_energy] {
                // 17 ulp: twice the largest error
                let jump = function(f64::next_down(switch)) / function(switch) - 1.0;
                assert!(jump.abs() < 17.0 * f64::EPSILON, "{switch}");
            }
        }
    }

    proptest! {
        #[test]
        fn symmetry(exponent in -300.0..300.0f64) {
            let beta = 10f64.powf(exponent);
            prop_assert_eq!(langevin(-beta), -langevin(beta));
            prop_assert_eq!(derivative(-beta), derivative(beta));
            prop_assert_eq!(complement(-beta), complement(beta));
            prop_assert_eq!(ln_beta_over_sinh(-beta), ln_beta_over_sinh(beta));
            prop_assert_eq!(free_energy(-beta), free_energy(beta));
        }

        /// dψ/dβ = β𝓛′(β), by central differences: truncation h² and cancellation ε/h both below 1e-8.
        #[test]
        fn free_energy_has_the_force_as_its_derivative(beta in 0.05..50.0f64) {
            let step = 1e-5 * beta;
            let slope = (free_energy(beta + step) - free_energy(beta - step)) / (2.0 * step);
            prop_assert!((slope / (beta * derivative(beta)) - 1.0).abs() < 1e-8);
        }

        #[test]
        fn monotone(beta in 0.0..40.0f64) {
            prop_assert!(langevin(beta + 0.01) > langevin(beta));
            prop_assert!(derivative(beta + 0.01) < derivative(beta));
        }
    }
}
