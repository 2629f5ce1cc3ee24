//! The two precisions of inference, and their vectors.

use pulp::Simd;
use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// Floating-point type with vectors of the machine's widest instructions.
pub trait SimdLanes: Copy {
    /// A vector.
    type Vector<S: Simd>: Copy;
    /// Number of adjacent outputs in packed weights: 128 bytes.
    const PANEL: usize;
    /// Sets all lanes to a value.
    fn splat<S: Simd>(simd: S, value: Self) -> Self::Vector<S>;
    /// a·b + c.
    fn mul_add<S: Simd>(
        simd: S,
        a: Self::Vector<S>,
        b: Self::Vector<S>,
        c: Self::Vector<S>,
    ) -> Self::Vector<S>;
    /// The sum of the lanes.
    fn sum<S: Simd>(simd: S, a: Self::Vector<S>) -> Self;
    /// List as whole vectors; the remainder is left out.
    fn vectors<S: Simd>(list: &[Self]) -> &[Self::Vector<S>];
    /// List as whole vectors to write; the remainder is left out.
    fn vectors_mut<S: Simd>(list: &mut [Self]) -> &mut [Self::Vector<S>];
}

/// The two precisions of inference.
pub trait Real:
    SimdLanes
    + Copy
    + Default
    + Debug
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + Send
    + Sync
    + 'static
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// Rounded from f64.
    fn from_f64(value: f64) -> Self;
    /// Converts to f64, exactly.
    fn to_f64(self) -> f64;
    /// a·b + c, in one rounding where the machine has an instruction for it.
    fn fused<const FUSED: bool>(self, b: Self, c: Self) -> Self;
    /// eˣ of x ≤ 0 without branches, 0 where it would be subnormal; NaN stays NaN.
    ///
    /// x = n ln 2 + r, |r| ≤ ½ ln 2; the Taylor series of eʳ to its last term above ¼ ulp, times 2ⁿ by its
    /// bits.
    fn exp_of_negative<const FUSED: bool>(self) -> Self;
    /// ln(1 + t) of 0 ≤ t ≤ 1 without branches.
    ///
    /// 1 + t, or half of it, is 1 + f with f in [1/√2 − 1, √2 − 1]; ln(1 + f) = 2 artanh u, u = f/(2 + f), as
    /// a series.
    fn ln_1p_of_unit<const FUSED: bool>(self) -> Self;
    /// √x.
    fn root(self) -> Self;
}

macro_rules! real {
    ($type:ident, $bits:ident, vectors $vectors:ident, $lanes:ident, $splat:ident, $mul_add:ident, $sum:ident,
     $as:ident, $as_mut:ident,
     panel $panel:literal, magic $magic:literal, mantissa $mantissa:literal, least $least:literal,
     bias $bias:literal,
     ln2 $high:literal + $low:literal, exp $exp:literal, artanh $artanh:literal) => {
        impl SimdLanes for $type {
            type Vector<S: Simd> = S::$vectors;
            const PANEL: usize = $panel;
            #[inline(always)]
            fn splat<S: Simd>(simd: S, value: Self) -> S::$vectors {
                simd.$splat(value)
            }
            #[inline(always)]
            fn mul_add<S: Simd>(simd: S, a: S::$vectors, b: S::$vectors, c: S::$vectors) -> S::$vectors {
                simd.$mul_add(a, b, c)
            }
            #[inline(always)]
            fn sum<S: Simd>(simd: S, a: S::$vectors) -> Self {
                simd.$sum(a)
            }
            #[inline(always)]
            fn vectors<S: Simd>(list: &[Self]) -> &[S::$vectors] {
                S::$as(list).0
            }
            #[inline(always)]
            fn vectors_mut<S: Simd>(list: &mut [Self]) -> &mut [S::$vectors] {
                S::$as_mut(list).0
            }
        }

        impl Real for $type {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            #[inline(always)]
            fn from_f64(value: f64) -> Self {
                value as Self
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                self.into()
            }
            #[inline(always)]
            fn fused<const FUSED: bool>(self, b: Self, c: Self) -> Self {
                if FUSED { self.mul_add(b, c) } else { self * b + c }
            }
            #[inline(always)]
            fn exp_of_negative<const FUSED: bool>(self) -> Self {
                const REVERSED: [$type; $exp] = {
                    // 1/k! for k = N − 1 … 0
                    let (mut list, mut factorial, mut k) = ([1.0; $exp], 1.0, 1);
                    while k < $exp {
                        factorial *= k as f64;
                        list[$exp - 1 - k] = (1.0 / factorial) as $type;
                        k += 1;
                    }
                    list
                };
                let x = if self < $least { $least } else { self };
                let shifted = x.fused::<FUSED>(std::$type::consts::LOG2_E, $magic);
                let n = shifted - $magic;
                let r = n.fused::<FUSED>(-$low, n.fused::<FUSED>(-$high, x));
                let mut sum = REVERSED[0];
                for coefficient in &REVERSED[1..] {
                    sum = sum.fused::<FUSED>(r, *coefficient);
                }
                let power =
                    $type::from_bits((shifted.to_bits() << $mantissa).wrapping_add($bias << $mantissa));
                if self < $least { 0.0 } else { sum * power }
            }
            #[inline(always)]
            fn ln_1p_of_unit<const FUSED: bool>(self) -> Self {
                const REVERSED: [$type; $artanh] = {
                    // 2/(2k + 1) for k = N − 1 … 0
                    let (mut list, mut k) = ([2.0; $artanh], 1);
                    while k < $artanh {
                        list[$artanh - 1 - k] = (2.0 / (2 * k + 1) as f64) as $type;
                        k += 1;
                    }
                    list
                };
                let large = self > std::$type::consts::SQRT_2 - 1.0;
                let f = if large { (self - 1.0) * 0.5 } else { self };
                let base = if large { std::$type::consts::LN_2 } else { 0.0 };
                let u = f / (2.0 + f);
                let square = u * u;
                let mut sum = REVERSED[0];
                for coefficient in &REVERSED[1..] {
                    sum = sum.fused::<FUSED>(square, *coefficient);
                }
                u.fused::<FUSED>(sum, base)
            }
            #[inline(always)]
            fn root(self) -> Self {
                self.sqrt()
            }
        }
    };
}
// magic: 1.5·2^mantissa, so that the low bits of x + magic are the integer next to x. ln 2 as the sum of a
// number with trailing zeros (n·high is exact) and the rest. Terms: 0.3466^N/N! and 0.02944^N/(2N + 1) below
// a quarter ulp.
real!(f32, u32, vectors f32s, F32_LANES, splat_f32s, mul_add_e_f32s, reduce_sum_f32s,
      as_simd_f32s, as_mut_simd_f32s,
      panel 32, magic 12_582_912.0, mantissa 23, least -87.0, bias 127,
      ln2 0.693_145_75 + 1.428_606_8e-6, exp 8, artanh 5);
real!(f64, u64, vectors f64s, F64_LANES, splat_f64s, mul_add_e_f64s, reduce_sum_f64s,
      as_simd_f64s, as_mut_simd_f64s,
      panel 16, magic 6_755_399_441_055_744.0, mantissa 52, least -708.0, bias 1023,
      ln2 0.693_147_180_369_123_8 + 1.908_214_929_270_587_7e-10, exp 14, artanh 11);

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the standard library, fused and not: two or three roundings.
    #[test]
    fn exponentials_and_logarithms() {
        for k in 0..=20_000 {
            let x = -f64::from(k) * f64::from(k) * 1.75e-6;
            for value in [x.exp_of_negative::<true>(), x.exp_of_negative::<false>()] {
                // r carries ε·|x| of the argument without a fused product
                assert!((value / x.exp() - 1.0).abs() < 5e-16 * (1.0 + 0.01 * x.abs()), "{x}: {value:e}");
            }
            let x = (x / 9.0) as f32;
            for value in [x.exp_of_negative::<true>(), x.exp_of_negative::<false>()] {
                assert!((f64::from(value) / f64::from(x).exp() - 1.0).abs() < 2.4e-7, "{x}: {value:e}");
            }
            let t = (f64::from(k) / 2e4).powi(4);
            for value in [t.ln_1p_of_unit::<true>(), t.ln_1p_of_unit::<false>()] {
                assert!((value - t.ln_1p()).abs() <= 5e-16 * t.ln_1p(), "{t}: {value:e}");
            }
            let t = t as f32;
            for value in [t.ln_1p_of_unit::<true>(), t.ln_1p_of_unit::<false>()] {
                assert!((f64::from(value) - f64::from(t).ln_1p()).abs() <= 2.4e-7 * f64::from(t), "{t}");
            }
        }
        for x in [-709.0, -1e300, f64::MIN, f64::NEG_INFINITY] {
            assert_eq!(x.exp_of_negative::<true>(), 0.0);
        }
        assert_eq!((0.0f64.exp_of_negative::<true>(), 0.0f64.ln_1p_of_unit::<true>()), (1.0, 0.0));
        assert!(f64::NAN.exp_of_negative::<true>().is_nan() && f32::NAN.ln_1p_of_unit::<false>().is_nan());
    }
}
