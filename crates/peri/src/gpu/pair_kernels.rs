//! Kernels of contact between particles; see [`super::kernels`] for fields, lengths and indices, and
//! [`crate::contact::PairRows`] for rows.

use super::kernels::KernelForm;
use cubecl::ir::ElemType;
use cubecl::prelude::*;

/// Numbers of a pair beyond ξ: d, stiffness.
pub const PAIR: usize = 2;

/// Computes ζ of the pair whose numbers begin at `row`; returns its square.
#[cube]
fn part<F: Float>(
    displacement: &[F],
    pairs: &[F],
    row: usize,
    site: usize,
    there: usize,
    zeta: &mut Array<F>,
    #[comptime] form: KernelForm,
) -> F {
    let dimension = comptime!(form.dimension);
    let sites = displacement.len() / dimension;
    let mut square = F::new(0.0);
    #[unroll]
    for d in 0..dimension {
        let eta = displacement[d * sites + there] - displacement[d * sites + site];
        zeta[d] = pairs[row + d] + eta;
        square = fma(zeta[d], zeta[d], square);
    }
    square
}

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
        let square = part::<F>(displacement, pairs, row, site, there, &mut zeta, form);
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

/// Adds the stiffness of others nearer than d + `near` to the masses of particles, `factor`·Σ_J c (1 +
/// max_{d≠e} |n_d n_e|) along n = ζ/r; without bonds, a particle has twice that instead.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub fn weigh_pairs<F: Float>(
    displacement: &[F],
    particles: &[u32],
    ends: &[u32],
    alone: &[u32],
    others: &[u32],
    pairs: &[F],
    mass: &mut [F],
    near: InputScalar,
    factor: InputScalar,
    #[comptime] form: KernelForm,
    #[define(F)] _precision: ElemType,
) {
    let particle = ABSOLUTE_POS;
    if particle >= particles.len() {
        terminate!();
    }
    let dimension = comptime!(form.dimension);
    let site = particles[particle] as usize;
    let near = near.get::<F>();
    let mut zeta = Array::<F>::new(dimension);
    let mut sum = F::new(0.0);
    for entry in ends[particle]..ends[particle + 1] {
        let row = entry as usize * comptime!(form.dimension + PAIR);
        let there = others[entry as usize] as usize;
        let square = part::<F>(displacement, pairs, row, site, there, &mut zeta, form);
        let reach = pairs[row + dimension] + near;
        if square < reach * reach {
            let mut mixed = F::new(0.0);
            #[unroll]
            for d in 0..dimension {
                #[unroll]
                for other in 0..d {
                    let product = zeta[d] * zeta[other];
                    mixed = F::max(mixed, F::max(product, F::new(0.0) - product));
                }
            }
            let mut share = F::new(0.0);
            if square > F::new(0.0) {
                share = mixed / square;
            }
            sum = fma(pairs[row + dimension + 1], F::new(1.0) + share, sum);
        }
    }
    if sum > F::new(0.0) {
        let sum = factor.get::<F>() * sum;
        if alone[particle] != 0u32 {
            mass[site] = sum + sum;
        } else {
            mass[site] += sum;
        }
    }
}

/// Squares of the differences of a direction between particles nearer than d + `near`, the greatest of each.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub fn close_in<F: Float>(
    displacement: &[F],
    direction: &[F],
    particles: &[u32],
    ends: &[u32],
    others: &[u32],
    pairs: &[F],
    squares: &mut [F],
    near: InputScalar,
    #[comptime] form: KernelForm,
    #[define(F)] _precision: ElemType,
) {
    let particle = ABSOLUTE_POS;
    if particle >= particles.len() {
        terminate!();
    }
    let dimension = comptime!(form.dimension);
    let sites = displacement.len() / dimension;
    let site = particles[particle] as usize;
    let near = near.get::<F>();
    let mut zeta = Array::<F>::new(dimension);
    let mut greatest = F::new(0.0);
    for entry in ends[particle]..ends[particle + 1] {
        let row = entry as usize * comptime!(form.dimension + PAIR);
        let there = others[entry as usize] as usize;
        let square = part::<F>(displacement, pairs, row, site, there, &mut zeta, form);
        let reach = pairs[row + dimension] + near;
        if square < reach * reach {
            let mut apart = F::new(0.0);
            #[unroll]
            for d in 0..dimension {
                let change = direction[d * sites + there] - direction[d * sites + site];
                apart = fma(change, change, apart);
            }
            greatest = F::max(greatest, apart);
        }
    }
    squares[particle] = greatest;
}
