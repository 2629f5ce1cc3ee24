//! What neurons do with their sums, in two precisions.

use serde::{Deserialize, Serialize};
use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// The two precisions of inference.
pub trait Real:
    Copy
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
    /// To f64, exact.
    fn to_f64(self) -> f64;
    /// eˣ.
    fn exp(self) -> Self;
    /// ln(1 + x).
    fn ln_1p(self) -> Self;
    /// tanh x.
    fn tanh(self) -> Self;
}

macro_rules! real {
    ($type:ident) => {
        impl Real for $type {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            #[inline]
            fn from_f64(value: f64) -> Self {
                value as Self
            }
            #[inline]
            fn to_f64(self) -> f64 {
                self.into()
            }
            #[inline]
            fn exp(self) -> Self {
                self.exp()
            }
            #[inline]
            fn ln_1p(self) -> Self {
                self.ln_1p()
            }
            #[inline]
            fn tanh(self) -> Self {
                self.tanh()
            }
        }
    };
}
real!(f32);
real!(f64);

/// What a neuron does with its sum; (3.11) and more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Activation {
    /// x.
    Linear,
    /// max(x, 0) (3.11), printed as max(x); its derivative at 0 is 0.
    Relu,
    /// ln(1 + eˣ) (3.11), written as max(x, 0) + ln(1 + e^{−|x|}), which does not overflow.
    Softplus,
    /// tanh x.
    Tanh,
    /// 1/(1 + e⁻ˣ).
    Sigmoid,
    /// x/(1 + e⁻ˣ) (Elfwing et al. 2018, <https://doi.org/10.1016/j.neunet.2017.12.012>).
    Silu,
    /// x, and eˣ − 1 below 0 (Clevert et al. 2016, <https://arxiv.org/abs/1511.07289>).
    Elu,
}

impl Activation {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Linear, Self::Relu, Self::Softplus, Self::Tanh, Self::Sigmoid, Self::Silu, Self::Elu];

    /// Value, first and second derivative.
    #[inline]
    pub fn at<T: Real>(self, x: T) -> [T; 3] {
        let (zero, one) = (T::ZERO, T::ONE);
        match self {
            Self::Linear => [x, one, zero],
            Self::Relu => {
                if x <= zero {
                    [zero, zero, zero]
                } else {
                    [x, one, zero]
                }
            }
            Self::Softplus => {
                let small = if x < zero { x.exp() } else { (-x).exp() };
                let s = logistic(x, small);
                let positive = if x < zero { zero } else { x };
                [positive + small.ln_1p(), s, s * (one - s)]
            }
            Self::Tanh => {
                let t = x.tanh();
                let first = one - t * t;
                [t, first, -(t + t) * first]
            }
            Self::Sigmoid => {
                let s = logistic(x, if x < zero { x.exp() } else { (-x).exp() });
                let first = s * (one - s);
                [s, first, first * (one - s - s)]
            }
            Self::Silu => {
                let s = logistic(x, if x < zero { x.exp() } else { (-x).exp() });
                let slope = s * (one - s);
                [x * s, s + x * slope, slope * (one + one + x * (one - s - s))]
            }
            Self::Elu => {
                if x > zero {
                    [x, one, zero]
                } else {
                    let e = x.exp();
                    [e - one, e, e]
                }
            }
        }
    }
}

/// 1/(1 + e⁻ˣ) from `small` = e^{−|x|}.
#[inline]
fn logistic<T: Real>(x: T, small: T) -> T {
    if x < T::ZERO { small / (T::ONE + small) } else { T::ONE / (T::ONE + small) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn activations_have_their_derivatives_and_do_not_overflow() {
        let step = 1e-5;
        for activation in Activation::ALL {
            for x in [-30.0, -2.0, -0.3, 0.4, 3.0, 30.0] {
                let [low, at, high] = [x - step, x, x + step].map(|x| activation.at::<f64>(x));
                // central differences: rounding ε·|f|/h and truncation h²
                assert!(((high[0] - low[0]) / (2.0 * step) - at[1]).abs() < 2e-9, "{activation:?} {x}");
                assert!(((high[1] - low[1]) / (2.0 * step) - at[2]).abs() < 2e-9, "{activation:?} {x}");
            }
            for x in [f64::MAX, -f64::MAX, 1e4, -1e4, 0.0] {
                assert!(activation.at(x).iter().all(|value| value.is_finite()), "{activation:?} {x}");
                assert!(activation.at(x.clamp(-3e38, 3e38) as f32).iter().all(|value| value.is_finite()));
            }
            // a fault is not swallowed
            assert!(activation.at(f64::NAN)[0].is_nan(), "{activation:?}");
        }
        // ln 2, and ln(1 + e^-40) = e^-40 to 17 digits
        assert!((Activation::Softplus.at(0.0)[0] - std::f64::consts::LN_2).abs() < 1e-16);
        assert!((Activation::Softplus.at(-40.0)[0] / f64::exp(-40.0) - 1.0).abs() < 1e-15);
    }
}
