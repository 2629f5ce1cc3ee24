//! The cloud kernel: the neighbours of one particle gathered in groups.

use super::kernel::{Pass, law};
use super::real::Real;
use crate::potential::StretchRange;
use pulp::Simd;

/// Neighbour lists are padded to a multiple of this with bonds of no stiffness to the particle itself.
pub const GROUP: usize = 8;

/// What the cloud kernel reads: compressed rows of neighbours.
pub struct CloudData<'a, const D: usize> {
    /// Reference position.
    pub position: [&'a [f64]; D],
    /// Displacement.
    pub displacement: [&'a [f64]; D],
    /// First bond of each particle, and the end of the last.
    pub starts: &'a [usize],
    /// Neighbour of each bond.
    pub neighbours: &'a [u32],
    /// 1/|ξ| of each bond; 0 where broken.
    pub inverse_length: &'a [f64],
    /// w V_J of each bond; empty where all bonds have the same, which is then part of `stiffness`.
    pub weights: &'a [f64],
    /// 2kθ, times the common w V_J.
    pub stiffness: f64,
}

/// The cloud kernel: lists under a law.
pub struct CloudPass<'a, const D: usize, const P: usize, const Q: usize> {
    /// The lists.
    pub data: &'a CloudData<'a, D>,
    /// q(0), numerator and denominator of the law in e = λ² − 1.
    pub law: (f64, [f64; P], [f64; Q]),
    /// Ends of the law in e; outside of them q stays what it is there.
    pub clamp: [f64; 2],
}

impl<const D: usize, const P: usize, const Q: usize> Pass<D> for CloudPass<'_, D, P, Q> {
    #[inline(always)]
    fn run<S: Simd>(
        &self,
        simd: S,
        start: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    ) {
        let zero = simd.splat_f64s(0.0);
        let (mut low, mut high) = (zero, zero);
        let tracking = track.is_some();
        let CloudData { position, displacement, starts, neighbours, inverse_length, weights, stiffness } =
            *self.data;
        // closures and `array::from_fn` would not inherit the target features, and so not be inlined
        for offset in 0..force[0].len() {
            let own = start + offset;
            let (mut here, mut moved) = ([0.0; D], [0.0; D]);
            for d in 0..D {
                here[d] = position[d][own];
                moved[d] = displacement[d][own];
            }
            let mut sum = [zero; D];
            for first in (starts[own]..starts[own + 1]).step_by(GROUP) {
                let (mut bond, mut change) = ([[0.0; GROUP]; D], [[0.0; GROUP]; D]);
                let group = &neighbours[first..first + GROUP];
                for lane in 0..GROUP {
                    let j = group[lane] as usize;
                    for d in 0..D {
                        // SAFETY: every neighbour is a particle of the cloud (checked where the lists are built)
                        unsafe {
                            bond[d][lane] = position[d].get_unchecked(j) - here[d];
                            change[d][lane] = displacement[d].get_unchecked(j) - moved[d];
                        }
                    }
                }
                for sub in (0..GROUP).step_by(S::F64_LANES) {
                    // SAFETY: sub + lanes ≤ GROUP, the length of the arrays and of the slices cut here
                    let inverse = unsafe { f64::load::<S>(&inverse_length[first..first + GROUP], sub) };
                    let mut factor = simd.mul_f64s(inverse, simd.splat_f64s(stiffness));
                    if !weights.is_empty() {
                        // SAFETY: as above
                        let weight = unsafe { f64::load::<S>(&weights[first..first + GROUP], sub) };
                        factor = simd.mul_f64s(factor, weight);
                    }
                    let (mut zeta, mut e) = ([zero; D], zero);
                    for d in 0..D {
                        let (xi, eta) =
                            unsafe { (f64::load::<S>(&bond[d], sub), f64::load::<S>(&change[d], sub)) };
                        zeta[d] = simd.add_f64s(xi, eta);
                        e = simd.mul_add_f64s(eta, simd.add_f64s(zeta[d], xi), e);
                    }
                    e = simd.mul_f64s(e, simd.mul_f64s(inverse, inverse));
                    let q = law::<f64, S, P, Q>(simd, e, self.clamp, self.law.0, &self.law.1, &self.law.2);
                    let q = simd.mul_f64s(q, factor);
                    for d in 0..D {
                        sum[d] = simd.mul_add_f64s(q, zeta[d], sum[d]);
                    }
                    if tracking {
                        (low, high) = (simd.min_f64s(low, e), simd.max_f64s(high, e));
                    }
                }
            }
            for d in 0..D {
                force[d][offset] = simd.reduce_sum_f64s(sum[d]);
            }
        }
        if let Some(range) = track {
            *range =
                range.join(StretchRange { low: simd.reduce_min_f64s(low), high: simd.reduce_max_f64s(high) });
        }
    }
}
