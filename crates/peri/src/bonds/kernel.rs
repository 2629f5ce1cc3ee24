//! The bond-force kernels: branch-free, vectorised over particles (lattice) or over neighbours (cloud).
//!
//! Both evaluate, with η = u_J − u_I and e = λ² − 1 = η·(2ξ + η)/|ξ|² (no cancellation at small strain),
//! the force density Σ_J c_IJ q(e) (ξ + η), q = t/(kθ λ), c = 2kθ w V_J/|ξ|, as in Eqs (2.6), (2.47).
//! q is the rational fit of [`crate::potential::KernelFit`]: no square root, and no division where it is a
//! polynomial.

use super::real::KernelReal;
use crate::potential::StretchRange;
use pulp::{Arch, Simd, WithSimd};

/// A kernel with everything it reads in place.
pub trait ForceKernel<const D: usize> {
    /// Force densities of the sites `start..start + force[0].len()`; `track` collects the stretches observed.
    fn run<S: Simd>(
        &self,
        simd: S,
        start: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    );
}

struct KernelCall<'a, 'b, P, const D: usize> {
    pass: P,
    start: usize,
    force: &'a mut [&'b mut [f64]; D],
    track: Option<&'a mut StretchRange>,
}

impl<const D: usize, P: ForceKernel<D>> WithSimd for KernelCall<'_, '_, P, D> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.pass.run(simd, self.start, self.force, self.track);
    }
}

/// Runs a kernel with the widest instructions that this machine has.
pub fn dispatch<const D: usize>(
    pass: impl ForceKernel<D>,
    start: usize,
    force: &mut [&mut [f64]; D],
    track: Option<&mut StretchRange>,
) {
    Arch::new().dispatch(KernelCall { pass, start, force, track });
}

/// constant + E·N(E)/D(E) by Horner's rule, E clamped to two ends.
#[inline(always)]
pub fn law<T: KernelReal, S: Simd, const P: usize, const Q: usize>(
    simd: S,
    e: T::Vector<S>,
    clamp: [T; 2],
    constant: T,
    numerator: &[T; P],
    denominator: &[T; Q],
) -> T::Vector<S> {
    let e = T::max(simd, T::splat(simd, clamp[0]), T::min(simd, e, T::splat(simd, clamp[1])));
    let mut n = T::splat(simd, numerator[P - 1]);
    for k in (0..P - 1).rev() {
        n = T::mul_add(simd, n, e, T::splat(simd, numerator[k]));
    }
    if Q > 0 {
        let mut d = T::splat(simd, denominator[Q - 1]);
        for k in (0..Q - 1).rev() {
            d = T::mul_add(simd, d, e, T::splat(simd, denominator[k]));
        }
        d = T::mul_add(simd, d, e, T::splat(simd, T::from_f64(1.0)));
        n = T::div(simd, n, d);
    }
    T::mul_add(simd, n, e, T::splat(simd, constant))
}
