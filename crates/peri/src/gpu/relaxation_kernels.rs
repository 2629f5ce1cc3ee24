//! Kernels of dynamic relaxation; see [`super::kernels`] for fields, lengths and indices. Masses are in units
//! of [`super::DeviceRelaxation`].

use super::bond_kernels::weight;
use super::kernels::{KernelForm, ROW};
use cubecl::ir::ElemType;
use cubecl::prelude::*;

/// Returns true if component `d` of a site is free.
#[cube]
pub fn is_free(held: &[u32], site: usize, d: usize, #[comptime] form: KernelForm) -> bool {
    let mut free = true;
    if comptime!(form.held) {
        free = (held[site] >> (d as u32)) & 1u32 == 0;
    }
    free
}

/// Sums of an iteration: velocity times change of force, mass times v², F² where free, F² where held, |s u|²;
/// the greatest component of the last move.
pub const RELAXATION_SUMS: usize = 6;
/// Place of the last of them, which [`relax`] writes.
pub const WAY: usize = RELAXATION_SUMS - 1;

/// Sums of the present force over particles, each thread its [`RELAXATION_SUMS`]; |s u|² with springs s only
/// where it `measures`.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub fn relaxation_sums<F: Float>(
    force: &[F],
    before: &[F],
    velocity: &[F],
    displacement: &[F],
    particles: &[u32],
    held: &[u32],
    mass: &[F],
    springs: &[F],
    body: &[F],
    partial: &mut [F],
    loading: InputScalar,
    #[comptime] form: KernelForm,
    #[comptime] measures: bool,
    #[define(F)] _precision: ElemType,
) {
    let dimension = comptime!(form.dimension);
    let threads = partial.len() / comptime!(RELAXATION_SUMS);
    if ABSOLUTE_POS >= threads {
        terminate!();
    }
    let sites = displacement.len() / dimension;
    let mut top = F::new(0.0);
    let mut bottom = F::new(0.0);
    let mut free = F::new(0.0);
    let mut constrained = F::new(0.0);
    let loading = loading.get::<F>();
    let mut moved = F::new(0.0);
    for index in range_stepped(ABSOLUTE_POS, particles.len(), threads) {
        let site = particles[index] as usize;
        let own = mass[site];
        #[unroll]
        for d in 0..dimension {
            let at = d * sites + site;
            let pull = force[at];
            let speed = velocity[at];
            if is_free(held, site, d, form) {
                top = fma(speed, pull - before[at], top);
                bottom = fma(speed * speed, own, bottom);
                free = fma(pull, pull, free);
            } else {
                // without the body force on it
                let mut inner = pull;
                if comptime!(form.loaded) {
                    inner = fma(-loading, body[at], pull);
                }
                constrained = fma(inner, inner, constrained);
            }
            if comptime!(measures) {
                let reach = springs[site] * displacement[at];
                moved = fma(reach, reach, moved);
            }
        }
    }
    partial[ABSOLUTE_POS] = top;
    partial[threads + ABSOLUTE_POS] = bottom;
    partial[2 * threads + ABSOLUTE_POS] = free;
    partial[3 * threads + ABSOLUTE_POS] = constrained;
    partial[4 * threads + ABSOLUTE_POS] = moved;
}

/// The move of free components: v ← `keep`·v + `push`·F/M, u ← u + v; held ones stay, with v = 0.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub fn relax<F: Float>(
    force: &[F],
    particles: &[u32],
    held: &[u32],
    mass: &[F],
    velocity: &mut [F],
    displacement: &mut [F],
    partial: &mut [F],
    threads: InputScalar,
    keep: InputScalar,
    push: InputScalar,
    #[comptime] form: KernelForm,
    #[define(F)] _precision: ElemType,
) {
    let dimension = comptime!(form.dimension);
    let threads = threads.get::<u32>() as usize;
    if ABSOLUTE_POS >= threads {
        terminate!();
    }
    let sites = displacement.len() / dimension;
    let keep = keep.get::<F>();
    let push = push.get::<F>();
    let mut way = F::new(0.0);
    for index in range_stepped(ABSOLUTE_POS, particles.len(), threads) {
        let site = particles[index] as usize;
        let own = mass[site];
        #[unroll]
        for d in 0..dimension {
            let at = d * sites + site;
            let mut speed = F::new(0.0);
            if is_free(held, site, d, form) {
                speed = keep * velocity[at] + push * force[at] / own;
            }
            velocity[at] = speed;
            displacement[at] += speed;
            way = F::max(way, F::max(speed, F::new(0.0) - speed));
        }
    }
    partial[comptime!(WAY) * threads + ABSOLUTE_POS] = way;
}

/// Bounds of the stiffness of particles, Σ_J c w·max(t, `least`)(1 + max_{d≠e} |n_d n_e|) with the directions
/// n of the deformed bonds and t from a table of `pieces` in e, which begins at `low`; `rest` without bonds.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub fn stiffen<F: Float>(
    displacement: &[F],
    factors: &[F],
    particles: &[u32],
    shifts: &[i32],
    rows: &[F],
    intact: &[u32],
    pieces: &[F],
    mass: &mut [F],
    low: InputScalar,
    per_step: InputScalar,
    least: InputScalar,
    rest: InputScalar,
    #[comptime] form: KernelForm,
    #[define(F)] _precision: ElemType,
) {
    let dimension = comptime!(form.dimension);
    if ABSOLUTE_POS >= particles.len() {
        terminate!();
    }
    let sites = displacement.len() / dimension;
    let site = particles[ABSOLUTE_POS] as usize;
    let low = low.get::<F>();
    let per_step = per_step.get::<F>();
    let least = least.get::<F>();
    let last = pieces.len() - 1;
    let mut sum = F::new(0.0);
    let mut zeta = Array::<F>::new(dimension);
    for k in 0..comptime!(form.bonds) {
        let word = intact[k / 32 * sites + site];
        if (word >> ((k % 32) as u32)) & 1u32 != 0 {
            let there = (site as i32 + shifts[k]) as usize;
            let row = k * comptime!(form.dimension + ROW);
            let mut e = F::new(0.0);
            let mut square = F::new(0.0);
            let mut mixed = F::new(0.0);
            #[unroll]
            for d in 0..dimension {
                let bond = rows[row + d];
                let eta = displacement[d * sites + there] - displacement[d * sites + site];
                zeta[d] = bond + eta;
                e = fma(eta, zeta[d] + bond, e);
                square = fma(zeta[d], zeta[d], square);
                #[unroll]
                for other in 0..d {
                    let product = zeta[d] * zeta[other];
                    mixed = F::max(mixed, F::max(product, F::new(0.0) - product));
                }
            }
            e *= rows[row + dimension];
            let place = F::max((e - low) * per_step, F::new(0.0));
            let piece = usize::min(u32::cast_from(place) as usize, last);
            let tangent = F::max(pieces[piece], least);
            let mut share = F::new(0.0);
            if square > F::new(0.0) {
                share = mixed / square;
            }
            let mut stiffness = rows[row + dimension + 1];
            if comptime!(form.factors > 0) {
                stiffness *= weight::<F>(factors, rows, row, site, there, form);
            }
            sum = fma(stiffness * tangent, F::new(1.0) + share, sum);
        }
    }
    if sum > F::new(0.0) {
        mass[site] = sum;
    } else {
        mass[site] = rest.get::<F>();
    }
}
