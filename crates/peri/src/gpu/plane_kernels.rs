//! Kernels of contact with planes; see [`super::kernels`] for fields, lengths and indices. An element is a
//! point that a plane pushes, with the particles below it; see [`crate::contact::PlaneRows`].

use super::kernels::KernelForm;
use cubecl::ir::ElemType;
use cubecl::prelude::*;

/// Numbers of a plane: its normal, 1 + max |n_d n_e|.
pub const PLANE: usize = 1;

/// Overlaps of elements with planes, o = `shift` − h − n·Σ w u with the height h at rest, and the sizes k⟨o⟩
/// of their forces; `pushes` has the force on each element. Where it `weighs`, `stiff` has Σ_p k (1 + max
/// |n_d n_e|) Σ|w| over planes nearer than `near`.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments, clippy::collapsible_if)]
pub fn press<F: Float>(
    displacement: &[F],
    ends: &[u32],
    below: &[u32],
    weights: &[F],
    planes: &[F],
    heights: &[F],
    stiffness: &[F],
    shifts: &[F],
    sizes: &mut [F],
    pushes: &mut [F],
    stiff: &mut [F],
    near: InputScalar,
    #[comptime] form: KernelForm,
    #[comptime] count: usize,
    #[comptime] weighs: bool,
    #[define(F)] _precision: ElemType,
) {
    let dimension = comptime!(form.dimension);
    let elements = ends.len() - 1;
    let element = ABSOLUTE_POS;
    if element >= elements {
        terminate!();
    }
    let sites = displacement.len() / dimension;
    let near = near.get::<F>();
    let mut moved = Array::<F>::new(dimension);
    let mut push = Array::<F>::new(dimension);
    #[unroll]
    for d in 0..dimension {
        moved[d] = F::new(0.0);
        push[d] = F::new(0.0);
    }
    let mut spread = F::new(0.0);
    for entry in ends[element]..ends[element + 1] {
        let weight = weights[entry as usize];
        let site = below[entry as usize] as usize;
        #[unroll]
        for d in 0..dimension {
            moved[d] = fma(weight, displacement[d * sites + site], moved[d]);
        }
        if comptime!(weighs) {
            spread += F::max(weight, F::new(0.0) - weight);
        }
    }
    let mut held = F::new(0.0);
    #[unroll]
    for plane in 0..count {
        let at = plane * elements + element;
        let normal = plane * comptime!(form.dimension + PLANE);
        let mut overlap = shifts[plane] - heights[at];
        #[unroll]
        for d in 0..dimension {
            overlap -= planes[normal + d] * moved[d];
        }
        let size = stiffness[at] * F::max(overlap, F::new(0.0));
        sizes[at] = size;
        #[unroll]
        for d in 0..dimension {
            push[d] = fma(size, planes[normal + d], push[d]);
        }
        if comptime!(weighs) {
            if overlap + near > F::new(0.0) {
                held = fma(stiffness[at], planes[normal + dimension], held);
            }
        }
    }
    #[unroll]
    for d in 0..dimension {
        pushes[d * elements + element] = push[d];
    }
    if comptime!(weighs) {
        stiff[element] = held * spread;
    }
}

/// Adds the forces on elements to those of the particles `chosen`; the square of those of each where all are
/// `chosen`, of faces and of a bare particle on their own.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub fn spread_pushes<F: Float>(
    chosen: &[u32],
    particles: &[u32],
    ends: &[u32],
    above: &[u32],
    shares: &[F],
    pushes: &[F],
    force: &mut [F],
    squares: &mut [F],
    #[comptime] form: KernelForm,
    #[define(F)] _precision: ElemType,
) {
    let dimension = comptime!(form.dimension);
    if ABSOLUTE_POS >= chosen.len() {
        terminate!();
    }
    let sites = force.len() / dimension;
    let elements = pushes.len() / dimension;
    let particle = chosen[ABSOLUTE_POS] as usize;
    let site = particles[particle] as usize;
    let mut square = F::new(0.0);
    #[unroll]
    for part in 0..2usize {
        let mut sum = Array::<F>::new(dimension);
        #[unroll]
        for d in 0..dimension {
            sum[d] = F::new(0.0);
        }
        for entry in ends[2 * particle + part]..ends[2 * particle + part + 1] {
            let share = shares[entry as usize];
            let element = above[entry as usize] as usize;
            #[unroll]
            for d in 0..dimension {
                sum[d] = fma(share, pushes[d * elements + element], sum[d]);
            }
        }
        #[unroll]
        for d in 0..dimension {
            force[d * sites + site] += sum[d];
            square = fma(sum[d], sum[d], square);
        }
    }
    squares[particle] = square;
}

/// Adds `factor` times the stiffness of elements to masses: Σ |w|/V times `stiff`.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub fn weigh<F: Float>(
    particles: &[u32],
    ends: &[u32],
    above: &[u32],
    shares: &[F],
    stiff: &[F],
    mass: &mut [F],
    factor: InputScalar,
    #[define(F)] _precision: ElemType,
) {
    if ABSOLUTE_POS >= particles.len() {
        terminate!();
    }
    let site = particles[ABSOLUTE_POS] as usize;
    let mut sum = F::new(0.0);
    for entry in ends[2 * ABSOLUTE_POS]..ends[2 * ABSOLUTE_POS + 2] {
        let share = shares[entry as usize];
        sum = fma(F::max(share, F::new(0.0) - share), stiff[above[entry as usize] as usize], sum);
    }
    mass[site] = fma(factor.get::<F>(), sum, mass[site]);
}

/// Stops particles.
#[cube(launch_unchecked)]
pub fn stop<F: Float>(
    sites: &[u32],
    velocity: &mut [F],
    #[comptime] form: KernelForm,
    #[define(F)] _precision: ElemType,
) {
    if ABSOLUTE_POS >= sites.len() {
        terminate!();
    }
    let dimension = comptime!(form.dimension);
    let all = velocity.len() / dimension;
    #[unroll]
    for d in 0..dimension {
        velocity[d * all + sites[ABSOLUTE_POS] as usize] = F::new(0.0);
    }
}
