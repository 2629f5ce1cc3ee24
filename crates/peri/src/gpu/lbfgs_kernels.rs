//! Kernels of L-BFGS; see [`super::kernels`] for fields, lengths and indices. The gradient g is −F where
//! free, 0 where held; B is diagonal. Pairs lie one after the other, in single precision.

use super::kernels::KernelForm;
use super::relaxation_kernels::is_free;
use cubecl::ir::ElemType;
use cubecl::prelude::*;

/// Sums of an evaluation: F² where free, F² where held, g·d, |s u|².
pub const LINE_SUMS: usize = 4;
/// Sums of each pair: s·y, w·y, s·g, w·g.
pub const PAIR_SUMS: usize = 4;

/// Sums of the present force along a direction, each thread its [`LINE_SUMS`]; |s u|² with springs s only
/// where it `measures`.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub fn line_sums<F: Float>(
    force: &[F],
    direction: &[F],
    displacement: &[F],
    particles: &[u32],
    held: &[u32],
    springs: &[F],
    body: &[F],
    partial: &mut [F],
    loading: InputScalar,
    #[comptime] form: KernelForm,
    #[comptime] measures: bool,
    #[define(F)] _precision: ElemType,
) {
    let dimension = comptime!(form.dimension);
    let threads = partial.len() / comptime!(LINE_SUMS);
    if ABSOLUTE_POS >= threads {
        terminate!();
    }
    let sites = displacement.len() / dimension;
    let mut free = F::new(0.0);
    let mut constrained = F::new(0.0);
    let loading = loading.get::<F>();
    let mut slope = F::new(0.0);
    let mut moved = F::new(0.0);
    for index in range_stepped(ABSOLUTE_POS, particles.len(), threads) {
        let site = particles[index] as usize;
        #[unroll]
        for d in 0..dimension {
            let at = d * sites + site;
            let pull = force[at];
            if is_free(held, site, d, form) {
                free = fma(pull, pull, free);
                slope -= pull * direction[at];
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
    partial[ABSOLUTE_POS] = free;
    partial[threads + ABSOLUTE_POS] = constrained;
    partial[2 * threads + ABSOLUTE_POS] = slope;
    partial[3 * threads + ABSOLUTE_POS] = moved;
}

/// Adds `step` times a direction to displacements.
#[cube(launch_unchecked)]
pub fn advance<F: Float>(
    direction: &[F],
    displacement: &mut [F],
    step: InputScalar,
    #[define(F)] _precision: ElemType,
) {
    if ABSOLUTE_POS < direction.len() {
        displacement[ABSOLUTE_POS] =
            fma(step.get::<F>(), direction[ABSOLUTE_POS], displacement[ABSOLUTE_POS]);
    }
}

/// Greatest square of the length of a direction, each thread's.
#[cube(launch_unchecked)]
pub fn reach<F: Float>(
    direction: &[F],
    particles: &[u32],
    partial: &mut [F],
    #[comptime] dimension: usize,
    #[define(F)] _precision: ElemType,
) {
    let threads = partial.len();
    if ABSOLUTE_POS >= threads {
        terminate!();
    }
    let sites = direction.len() / dimension;
    let mut greatest = F::new(0.0);
    for index in range_stepped(ABSOLUTE_POS, particles.len(), threads) {
        let site = particles[index] as usize;
        let mut square = F::new(0.0);
        #[unroll]
        for d in 0..dimension {
            let along = direction[d * sites + site];
            square = fma(along, along, square);
        }
        greatest = F::max(greatest, square);
    }
    partial[ABSOLUTE_POS] = greatest;
}

/// Writes a field, scaled.
#[cube(launch_unchecked)]
pub fn spread<F: Float>(from: &[F], into: &mut [F], factor: InputScalar, #[define(F)] _precision: ElemType) {
    if ABSOLUTE_POS < from.len() {
        into[ABSOLUTE_POS] = factor.get::<F>() * from[ABSOLUTE_POS];
    }
}

/// Records the pair of an accepted `step` in place `slot`: s = `step`·d, w = B y with y = g − g₀.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub fn record<F: Float>(
    force: &[F],
    before: &[F],
    direction: &[F],
    particles: &[u32],
    held: &[u32],
    local: &[F],
    steps: &mut [f32],
    images: &mut [f32],
    threads: InputScalar,
    slot: InputScalar,
    step: InputScalar,
    #[comptime] form: KernelForm,
    #[define(F)] _precision: ElemType,
) {
    let dimension = comptime!(form.dimension);
    let threads = threads.get::<u32>() as usize;
    if ABSOLUTE_POS >= threads {
        terminate!();
    }
    let sites = force.len() / dimension;
    let start = slot.get::<u32>() as usize * force.len();
    let step = step.get::<F>();
    for index in range_stepped(ABSOLUTE_POS, particles.len(), threads) {
        let site = particles[index] as usize;
        #[unroll]
        for d in 0..dimension {
            let at = d * sites + site;
            let mut image = F::new(0.0);
            if is_free(held, site, d, form) {
                image = local[site] * (before[at] - force[at]);
            }
            steps[start + at] = f32::cast_from(step * direction[at]);
            images[start + at] = f32::cast_from(image);
        }
    }
}

/// Products of all pairs with y = g − g₀ and g, [`PAIR_SUMS`] lists each; as many threads a pair as a list is
/// long.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub fn pair_products<F: Float>(
    force: &[F],
    before: &[F],
    particles: &[u32],
    held: &[u32],
    steps: &[f32],
    images: &[f32],
    partial: &mut [F],
    #[comptime] form: KernelForm,
    #[comptime] pairs: usize,
    #[define(F)] _precision: ElemType,
) {
    let dimension = comptime!(form.dimension);
    let threads = partial.len() / comptime!(PAIR_SUMS * pairs);
    let pair = ABSOLUTE_POS / threads;
    if pair >= pairs {
        terminate!();
    }
    let lane = ABSOLUTE_POS % threads;
    let sites = force.len() / dimension;
    let start = pair * force.len();
    let mut step_change = F::new(0.0);
    let mut image_change = F::new(0.0);
    let mut step_slope = F::new(0.0);
    let mut image_slope = F::new(0.0);
    for index in range_stepped(lane, particles.len(), threads) {
        let site = particles[index] as usize;
        #[unroll]
        for d in 0..dimension {
            let at = d * sites + site;
            if is_free(held, site, d, form) {
                let change = before[at] - force[at];
                let gradient = F::new(0.0) - force[at];
                let step = F::cast_from(steps[start + at]);
                let image = F::cast_from(images[start + at]);
                step_change = fma(step, change, step_change);
                image_change = fma(image, change, image_change);
                step_slope = fma(step, gradient, step_slope);
                image_slope = fma(image, gradient, image_slope);
            }
        }
    }
    let first = PAIR_SUMS * pair * threads + lane;
    partial[first] = step_change;
    partial[first + threads] = image_change;
    partial[first + 2 * threads] = step_slope;
    partial[first + 3 * threads] = image_slope;
}

/// The direction d = −γ B g + Σ_i (γ a_i w_i − b_i s_i), with γ a and b of each pair in `weights`, and a list
/// of g·d.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub fn combine<F: Float>(
    force: &[F],
    particles: &[u32],
    held: &[u32],
    local: &[F],
    steps: &[f32],
    images: &[f32],
    weights: &[F],
    direction: &mut [F],
    partial: &mut [F],
    scale: InputScalar,
    #[comptime] form: KernelForm,
    #[define(F)] _precision: ElemType,
) {
    let dimension = comptime!(form.dimension);
    let threads = partial.len();
    if ABSOLUTE_POS >= threads {
        terminate!();
    }
    let sites = force.len() / dimension;
    let pairs = weights.len() / 2;
    let scale = scale.get::<F>();
    let mut slope = F::new(0.0);
    for index in range_stepped(ABSOLUTE_POS, particles.len(), threads) {
        let site = particles[index] as usize;
        #[unroll]
        for d in 0..dimension {
            let at = d * sites + site;
            let mut sum = F::new(0.0);
            if is_free(held, site, d, form) {
                sum = scale * local[site] * force[at];
                for pair in 0..pairs {
                    let back = weights[2 * pair];
                    let along = weights[2 * pair + 1];
                    // slots without a pair may have numbers that are not finite
                    if back != F::new(0.0) || along != F::new(0.0) {
                        let place = pair * force.len() + at;
                        sum += back * F::cast_from(images[place]) - along * F::cast_from(steps[place]);
                    }
                }
                slope -= force[at] * sum;
            }
            direction[at] = sum;
        }
    }
    partial[ABSOLUTE_POS] = slope;
}
