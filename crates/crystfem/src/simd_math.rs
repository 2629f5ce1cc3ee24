//! exp and ln without branches or tables, so that loops over them are vectorized. Inline them into functions
//! that `pulp` dispatches. Relative errors are a few 2⁻⁵³.

/// 1.5·2⁵²; adding it rounds to a whole number.
const ROUNDER: f64 = 6_755_399_441_055_744.0;
/// ln 2, split into its first 32 bits and the remainder.
const LN_2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];
/// Largest |x| for [`expm1_small`].
pub const MAX_SMALL_ARGUMENT: f64 = 0.1;
/// Smallest x with a nonzero result.
const MIN_EXPONENT: f64 = -708.0;

/// 1/k!, k = 13, 12 … 2.
const FACTORIALS: [f64; 12] = [
    1.605_904_383_682_161_3e-10,
    2.087_675_698_786_81e-9,
    2.505_210_838_544_172e-8,
    2.755_731_922_398_589_3e-7,
    2.755_731_922_398_589e-6,
    2.480_158_730_158_73e-5,
    1.984_126_984_126_984e-4,
    1.388_888_888_888_889e-3,
    8.333_333_333_333_333e-3,
    4.166_666_666_666_666_4e-2,
    1.666_666_666_666_666_6e-1,
    0.5,
];

/// eˣ for x ≤ 709; 0 below −708.
#[inline(always)]
pub fn exp(x: f64) -> f64 {
    let held = x.max(MIN_EXPONENT);
    let rounded = held.mul_add(std::f64::consts::LOG2_E, ROUNDER);
    let whole = rounded - ROUNDER;
    let rest = whole.mul_add(-LN_2[1], whole.mul_add(-LN_2[0], held));
    let mut sum = FACTORIALS[0];
    for factor in &FACTORIALS[1..] {
        sum = sum.mul_add(rest, *factor);
    }
    let sum = (sum * rest).mul_add(rest, rest) + 1.0;
    let scale = f64::from_bits((rounded.to_bits() << 52).wrapping_add(1.0_f64.to_bits()));
    if x < MIN_EXPONENT { 0.0 } else { sum * scale }
}

/// ln x of a positive normal x.
#[inline(always)]
pub fn ln(x: f64) -> f64 {
    const ONE: u64 = 1.0_f64.to_bits();
    // the exponent of 2 is that of x over √½
    let above = x.to_bits().wrapping_add(ONE - std::f64::consts::FRAC_1_SQRT_2.to_bits());
    let exponent = f64::from_bits((above >> 52) | TWO_52.to_bits()) - (TWO_52 + 1023.0);
    let part = f64::from_bits(x.to_bits().wrapping_sub(above & (0xFFF << 52)).wrapping_add(ONE)) - 1.0;
    let s = part / (2.0 + part);
    let small = exponent.mul_add(LN_2[1], 2.0 * s * series::<11>(s * s));
    exponent.mul_add(LN_2[0], small + 2.0 * s)
}

/// 2⁵²; a whole number in the last bits is added to it.
const TWO_52: f64 = 4_503_599_627_370_496.0;

/// ln(1 + x) for −½ ≤ x ≤ 1.
#[inline(always)]
pub fn ln_1p(x: f64) -> f64 {
    let s = x / (2.0 + x);
    (2.0 * s).mul_add(series::<17>(s * s), 2.0 * s)
}

/// eˣ − 1 for |x| ≤ [`MAX_SMALL_ARGUMENT`].
#[inline(always)]
pub fn expm1_small(x: f64) -> f64 {
    let mut sum = FACTORIALS[2];
    for factor in &FACTORIALS[3..] {
        sum = sum.mul_add(x, *factor);
    }
    (sum * x).mul_add(x, x)
}

/// eˣ − 1 for −0.7 ≤ x ≤ 0.
#[inline(always)]
pub fn expm1_near(x: f64) -> f64 {
    // square of a root: e²ʸ − 1 = (eʸ − 1)(eʸ + 1)
    let mut sum = expm1_small(0.125 * x);
    for _ in 0..3 {
        sum *= sum + 2.0;
    }
    sum
}

/// Series Σ sᵏ/(2k+1), k = 1 … `TERMS`, for s = t²: artanh t = t (1 + Σ).
#[inline(always)]
fn series<const TERMS: usize>(s: f64) -> f64 {
    let mut sum = 0.0;
    for k in 0..TERMS {
        sum = (sum + ODD[TERMS - 1 - k]) * s;
    }
    sum
}

/// Odd reciprocals 1/3, 1/5 …
const ODD: [f64; 17] = {
    let mut odd = [0.0; 17];
    let mut k = 0;
    while k < odd.len() {
        odd[k] = 1.0 / (2 * k + 3) as f64;
        k += 1;
    }
    odd
};

#[cfg(test)]
mod tests {
    use super::*;

    /// Results agree with the standard library over their ranges, to four times 2⁻⁵².
    #[test]
    fn results_agree_with_the_standard_library() {
        let near = |found: f64, exact: f64, of: f64| {
            assert!((found - exact).abs() <= 4.0 * f64::EPSILON * exact.abs(), "{of}: {found:e} {exact:e}");
        };
        for k in 0..200_001 {
            let part = f64::from(k) / 200_000.0;
            let x = -707.9 + 1416.0 * part;
            near(exp(x), x.exp(), x);
            near(exp(0.01 * x), (0.01 * x).exp(), x);
            near(ln(x.exp()), x.exp().ln(), x);
            near(ln(0.5 + part), (0.5 + part).ln(), part);
            let y = -0.5 + 1.5 * part;
            near(ln_1p(y), y.ln_1p(), y);
            let tiny = 0.1 * (-700.0 * part).exp();
            near(ln_1p(-tiny), (-tiny).ln_1p(), tiny);
            near(expm1_small(-tiny), (-tiny).exp_m1(), tiny);
            near(expm1_small(tiny), tiny.exp_m1(), tiny);
            near(expm1_near(-0.7 * part), (-0.7 * part).exp_m1(), part);
            near(expm1_near(-tiny), (-tiny).exp_m1(), tiny);
        }
        assert_eq!([exp(0.0), ln(1.0), ln_1p(0.0), expm1_small(0.0)], [1.0, 0.0, 0.0, 0.0]);
        assert_eq!([exp(-709.0), exp(f64::NEG_INFINITY)], [0.0, 0.0]);
        assert!(exp(f64::NAN).is_nan() || exp(f64::NAN) < 1e-300);
    }
}
