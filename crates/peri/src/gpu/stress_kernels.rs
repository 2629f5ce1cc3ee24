//! Kernels of the stress: forces of the bonds of one offset, and their distribution over the particles whose
//! windows they cross.

use super::bond_kernels::add_bond;
use super::kernels::{KernelForm, ROW};
use cubecl::ir::ElemType;
use cubecl::prelude::*;

/// Bit of a site that holds a particle.
pub const OCCUPIED: u32 = 1;
/// Bit of a site whose averages are divided by the weights of the bonds that exist.
pub const COMPLETED: u32 = 2;

/// Force densities of bond `bond` of the stencil on all particles; 0 where it is not intact.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub fn offset_forces<F: Float>(
    displacement: &[F],
    factors: &[F],
    particles: &[u32],
    shifts: &[i32],
    rows: &[F],
    law: &[F],
    intact: &[u32],
    forces: &mut [F],
    bond: InputScalar,
    #[comptime] form: KernelForm,
    #[define(F)] _precision: ElemType,
) {
    if ABSOLUTE_POS >= particles.len() {
        terminate!();
    }
    let dimension = comptime!(form.dimension);
    let sites = displacement.len() / dimension;
    let k = bond.get::<u32>();
    let site = particles[ABSOLUTE_POS];
    let mut coefficients = Array::<F>::new(comptime!(form.coefficients()));
    #[unroll]
    for j in 0..comptime!(form.coefficients()) {
        coefficients[j] = law[j];
    }
    let mut own = Array::<F>::new(dimension);
    let mut sum = Array::<F>::new(dimension);
    #[unroll]
    for d in 0..dimension {
        own[d] = displacement[d * sites + site as usize];
        sum[d] = F::new(0.0);
    }
    if (intact[(k / 32) as usize * sites + site as usize] >> (k % 32)) & 1u32 != 0 {
        add_bond::<F>(
            displacement,
            factors,
            shifts,
            rows,
            law,
            &coefficients,
            &own,
            &mut sum,
            site,
            k as usize,
            0usize,
            form,
        );
    }
    #[unroll]
    for d in 0..dimension {
        forces[d * sites + site as usize] = sum[d];
    }
}

/// Adds Σ w f ⊗ ξ of bond `bond` to the sums of each particle, over the `count` taps from `first` on: bonds
/// that begin at a shift from the particle, and their weights w there.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub fn distribute<F: Float>(
    forces: &[F],
    flags: &[u32],
    particles: &[u32],
    shifts: &[i32],
    rows: &[F],
    taps: &[i32],
    weights: &[F],
    sums: &mut [F],
    bond: InputScalar,
    first: InputScalar,
    count: InputScalar,
    #[comptime] form: KernelForm,
    #[define(F)] _precision: ElemType,
) {
    let total = particles.len();
    if ABSOLUTE_POS >= total {
        terminate!();
    }
    let dimension = comptime!(form.dimension);
    let sites = flags.len();
    let k = bond.get::<u32>() as usize;
    let first = first.get::<u32>() as usize;
    let last = first + count.get::<u32>() as usize;
    let site = particles[ABSOLUTE_POS];
    let completed = flags[site as usize] & comptime!(COMPLETED) != 0;
    let mut average = Array::<F>::new(dimension);
    #[unroll]
    for d in 0..dimension {
        average[d] = F::new(0.0);
    }
    let mut existing = F::new(0.0);
    for tap in first..last {
        let start = site as i32 + taps[tap];
        if start >= 0 && start < sites as i32 {
            let start = start as usize;
            #[unroll]
            for d in 0..dimension {
                average[d] = fma(weights[tap], forces[d * sites + start], average[d]);
            }
            if completed && flags[start] & comptime!(OCCUPIED) != 0 {
                // particles lie farther from both ends of the storage than a bond is long
                let end = (start as i32 + shifts[k]) as usize;
                if flags[end] & comptime!(OCCUPIED) != 0 {
                    existing += weights[tap];
                }
            }
        }
    }
    // where no such bond exists, the average is zero
    let divisor = select(completed && existing > F::new(0.0), existing, F::new(1.0));
    #[unroll]
    for a in 0..dimension {
        #[unroll]
        for b in 0..dimension {
            let at = (a * dimension + b) * total + ABSOLUTE_POS;
            let edge = rows[k * comptime!(form.dimension + ROW) + b];
            sums[at] = fma(average[a] / divisor, edge, sums[at]);
        }
    }
}
