//! Activation functions and their derivatives.

use super::real::Real;
use pulp::{Arch, Simd, WithSimd};
use serde::{Deserialize, Serialize};

/// Activation function of a neuron; (3.11) and more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
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
    /// All activations.
    pub const ALL: [Self; 7] =
        [Self::Linear, Self::Relu, Self::Softplus, Self::Tanh, Self::Sigmoid, Self::Silu, Self::Elu];

    /// Value, first and second derivative.
    pub fn derivatives<T: Real>(self, x: T) -> [T; 3] {
        match self {
            Self::Linear => Linear::derivatives::<T, false>(x),
            Self::Relu => Relu::derivatives::<T, false>(x),
            Self::Softplus => Softplus::derivatives::<T, false>(x),
            Self::Tanh => Tanh::derivatives::<T, false>(x),
            Self::Sigmoid => Sigmoid::derivatives::<T, false>(x),
            Self::Silu => Silu::derivatives::<T, false>(x),
            Self::Elu => Elu::derivatives::<T, false>(x),
        }
    }

    /// Computes values of a list, and first and second derivatives if their lists are not empty, with the
    /// widest instructions of this machine.
    pub fn evaluate<T: Real>(self, x: &[T], values: &mut [T], first: &mut [T], second: &mut [T]) {
        Arch::new().dispatch(ActivationPass { activation: self, x, values, first, second });
    }

    /// Computes values, first and second derivatives of a list; empty lists are skipped.
    #[inline(always)]
    pub(super) fn fill<T: Real, const FUSED: bool>(
        self,
        sums: &[T],
        values: &mut [T],
        first: &mut [T],
        second: &mut [T],
    ) {
        match self {
            Self::Linear => fill::<Linear, T, FUSED>(sums, values, first, second),
            Self::Relu => fill::<Relu, T, FUSED>(sums, values, first, second),
            Self::Softplus => fill::<Softplus, T, FUSED>(sums, values, first, second),
            Self::Tanh => fill::<Tanh, T, FUSED>(sums, values, first, second),
            Self::Sigmoid => fill::<Sigmoid, T, FUSED>(sums, values, first, second),
            Self::Silu => fill::<Silu, T, FUSED>(sums, values, first, second),
            Self::Elu => fill::<Elu, T, FUSED>(sums, values, first, second),
        }
    }
}

struct ActivationPass<'a, T> {
    activation: Activation,
    x: &'a [T],
    values: &'a mut [T],
    first: &'a mut [T],
    second: &'a mut [T],
}

impl<T: Real> WithSimd for ActivationPass<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { activation, x, values, first, second } = self;
        // one lane: no vector unit that pulp knows of, and maybe no fused product
        if S::F64_LANES > 1 {
            activation.fill::<T, true>(x, values, first, second);
        } else {
            activation.fill::<T, false>(x, values, first, second);
        }
    }
}

/// Plain loops without branches: the compiler turns them into vectors of the dispatched width.
#[inline(always)]
fn fill<F: SmoothFunction, T: Real, const FUSED: bool>(
    sums: &[T],
    values: &mut [T],
    first: &mut [T],
    second: &mut [T],
) {
    let count = sums.len().min(values.len());
    let (sums, values) = (&sums[..count], &mut values[..count]);
    if second.len() >= count && first.len() >= count {
        let (first, second) = (&mut first[..count], &mut second[..count]);
        for k in 0..count {
            [values[k], first[k], second[k]] = F::derivatives::<T, FUSED>(sums[k]);
        }
    } else if first.len() >= count {
        let first = &mut first[..count];
        for k in 0..count {
            [values[k], first[k], _] = F::derivatives::<T, FUSED>(sums[k]);
        }
    } else {
        for k in 0..count {
            [values[k], _, _] = F::derivatives::<T, FUSED>(sums[k]);
        }
    }
}

/// Function of one variable with two derivatives, without branches.
trait SmoothFunction {
    fn derivatives<T: Real, const FUSED: bool>(x: T) -> [T; 3];
}

struct Linear;
struct Relu;
struct Softplus;
struct Tanh;
struct Sigmoid;
struct Silu;
struct Elu;

impl SmoothFunction for Linear {
    #[inline(always)]
    fn derivatives<T: Real, const FUSED: bool>(x: T) -> [T; 3] {
        [x, T::ONE, T::ZERO]
    }
}

impl SmoothFunction for Relu {
    #[inline(always)]
    fn derivatives<T: Real, const FUSED: bool>(x: T) -> [T; 3] {
        // NaN is not ≤ 0 and stays
        let off = x <= T::ZERO;
        [if off { T::ZERO } else { x }, if off { T::ZERO } else { T::ONE }, T::ZERO]
    }
}

impl SmoothFunction for Softplus {
    #[inline(always)]
    fn derivatives<T: Real, const FUSED: bool>(x: T) -> [T; 3] {
        let small = exp_of_minus_size::<T, FUSED>(x);
        let s = logistic(x, small);
        let positive = if x < T::ZERO { T::ZERO } else { x };
        [positive + small.ln_1p_of_unit::<FUSED>(), s, s * (T::ONE - s)]
    }
}

impl SmoothFunction for Tanh {
    #[inline(always)]
    fn derivatives<T: Real, const FUSED: bool>(x: T) -> [T; 3] {
        // (1 − e^{−2|x|})/(1 + e^{−2|x|}): to rounding of 1, not of small x
        let small = exp_of_minus_size::<T, FUSED>(x + x);
        let size = (T::ONE - small) / (T::ONE + small);
        let t = if x < T::ZERO { -size } else { size };
        let first = T::ONE - t * t;
        [t, first, -(t + t) * first]
    }
}

impl SmoothFunction for Sigmoid {
    #[inline(always)]
    fn derivatives<T: Real, const FUSED: bool>(x: T) -> [T; 3] {
        let s = logistic(x, exp_of_minus_size::<T, FUSED>(x));
        let first = s * (T::ONE - s);
        [s, first, first * (T::ONE - s - s)]
    }
}

impl SmoothFunction for Silu {
    #[inline(always)]
    fn derivatives<T: Real, const FUSED: bool>(x: T) -> [T; 3] {
        let s = logistic(x, exp_of_minus_size::<T, FUSED>(x));
        let slope = s * (T::ONE - s);
        // far out the slope is 0, and so is its product, also where x is infinite
        let bent = if slope == T::ZERO { T::ZERO } else { x * slope };
        [x * s, s + bent, (slope + slope) + bent * (T::ONE - s - s)]
    }
}

impl SmoothFunction for Elu {
    #[inline(always)]
    fn derivatives<T: Real, const FUSED: bool>(x: T) -> [T; 3] {
        let e = exp_of_minus_size::<T, FUSED>(x);
        let on = x > T::ZERO;
        [if on { x } else { e - T::ONE }, if on { T::ONE } else { e }, if on { T::ZERO } else { e }]
    }
}

/// e^{−|x|}.
#[inline(always)]
fn exp_of_minus_size<T: Real, const FUSED: bool>(x: T) -> T {
    (if x > T::ZERO { -x } else { x }).exp_of_negative::<FUSED>()
}

/// 1/(1 + e⁻ˣ) from `small` = e^{−|x|}.
#[inline(always)]
fn logistic<T: Real>(x: T, small: T) -> T {
    (if x < T::ZERO { small } else { T::ONE }) / (T::ONE + small)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn activations_have_their_derivatives_and_do_not_overflow() {
        let step = 1e-5;
        for activation in Activation::ALL {
            for x in [-30.0, -2.0, -0.3, 0.4, 3.0, 30.0] {
                let [low, at, high] = [x - step, x, x + step].map(|x| activation.derivatives::<f64>(x));
                // central differences: rounding ε·|f|/h and truncation h²
                assert!(((high[0] - low[0]) / (2.0 * step) - at[1]).abs() < 2e-9, "{activation:?} {x}");
                assert!(((high[1] - low[1]) / (2.0 * step) - at[2]).abs() < 2e-9, "{activation:?} {x}");
            }
            for x in [f64::MAX, -f64::MAX, 1e4, -1e4, 0.0] {
                assert!(
                    activation.derivatives(x).iter().all(|value| value.is_finite()),
                    "{activation:?} {x}"
                );
                assert!(
                    activation.derivatives(x.clamp(-3e38, 3e38) as f32).iter().all(|value| value.is_finite())
                );
            }
            // NaN is not hidden
            assert!(activation.derivatives(f64::NAN)[0].is_nan(), "{activation:?}");
        }
        evidence::near("ReLU of −1", Activation::Relu.derivatives(-1.0)[0], 0.0, 0.0);
        // ln 2, and ln(1 + e^-40) = e^-40 to 17 digits
        assert!((Activation::Softplus.derivatives(0.0)[0] - std::f64::consts::LN_2).abs() < 1e-16);
        assert!((Activation::Softplus.derivatives(-40.0)[0] / f64::exp(-40.0) - 1.0).abs() < 1e-15);
    }
}
