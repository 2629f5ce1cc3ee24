//! Kernel of contact between particles; see [`super::kernels`] for fields, lengths and indices, and
//! [`crate::contact::PairRows`] for rows.

use super::kernels::KernelForm;
use cubecl::ir::ElemType;
use cubecl::prelude::*;

/// Numbers of a pair beyond ξ: d, stiffness.
pub const PAIR: usize = 2;

/// Adds the forces of others on the particles `chosen`, −Σ_J c (d − r) ζ/r over r < d, where it `acts`;
/// `stiff` has Σ_J c over them.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub fn push_apart<F: Float>(
    displacement: &[F],
    chosen: &[u32],
    particles: &[u32],
    ends: &[u32],
    others: &[u32],
    pairs: &[F],
    force: &mut [F],
    stiff: &mut [F],
    #[comptime] form: KernelForm,
    #[comptime] acts: bool,
    #[define(F)] _precision: ElemType,
) {
    if ABSOLUTE_POS >= chosen.len() {
        terminate!();
    }
    let dimension = comptime!(form.dimension);
    let sites = displacement.len() / dimension;
    let particle = chosen[ABSOLUTE_POS] as usize;
    let site = particles[particle] as usize;
    let mut sum = Array::<F>::new(dimension);
    let mut zeta = Array::<F>::new(dimension);
    #[unroll]
    for d in 0..dimension {
        sum[d] = F::new(0.0);
    }
    let mut all = F::new(0.0);
    for entry in ends[particle]..ends[particle + 1] {
        let there = others[entry as usize] as usize;
        let row = entry as usize * comptime!(form.dimension + PAIR);
        let mut square = F::new(0.0);
        #[unroll]
        for d in 0..dimension {
            let eta = displacement[d * sites + there] - displacement[d * sites + site];
            zeta[d] = pairs[row + d] + eta;
            square = fma(zeta[d], zeta[d], square);
        }
        let distance = pairs[row + dimension];
        if square < distance * distance {
            let stiffness = pairs[row + dimension + 1];
            all += stiffness;
            if comptime!(acts) {
                let r = F::sqrt(square);
                let mut size = r;
                if square <= F::new(0.0) {
                    // two particles at one point part along ξ
                    size = F::new(0.0);
                    #[unroll]
                    for d in 0..dimension {
                        zeta[d] = pairs[row + d];
                        size = fma(zeta[d], zeta[d], size);
                    }
                    size = F::sqrt(size);
                }
                let push = stiffness * (distance - r) / size;
                #[unroll]
                for d in 0..dimension {
                    sum[d] -= push * zeta[d];
                }
            }
        }
    }
    if comptime!(acts) {
        #[unroll]
        for d in 0..dimension {
            force[d * sites + site] += sum[d];
        }
    }
    stiff[particle] = all;
}
