//! Kernels of a lattice in motion. Fields lie component by component, as in [`crate::field::Field`]; lengths
//! are in spacings and velocities in spacings a step. No kernel checks its indices: buffers have the lengths
//! that [`super::body`] gives them.

use super::bond_kernels::add_bond;
use cubecl::ir::ElemType;
use cubecl::prelude::*;

/// Threads of a cube.
pub const CUBE: usize = 128;
/// Sums of the first half of a step: force times increment where held, velocity times increment where free,
/// body force times increment, greatest increment.
pub const LEAP_SUMS: usize = 4;
/// Sums of the second half: v², force times increment where held, gain of v² where held, velocity times
/// increment where free, body force times increment.
pub const KICK_SUMS: usize = 5;
/// Sums of a step.
pub const SUMS: usize = LEAP_SUMS + KICK_SUMS;
/// Numbers of a bond: ξ, 1/|ξ|², stiffness.
pub const ROW: usize = 2;
/// Numbers of a law beyond its coefficients: value at e = 0, least and greatest e, the e from which bonds are
/// listed.
pub const ENDS: usize = 4;
/// Numbers of a node of a law that is a table: strain l − 1, tension, its derivative.
pub const NODE: usize = 3;

/// Constants that kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct KernelForm {
    /// Dimension of the body.
    pub dimension: usize,
    /// Bonds of the stencil.
    pub bonds: usize,
    /// Whether the law is a table instead of a ratio of polynomials.
    pub tabulated: bool,
    /// Coefficients of the law's numerator.
    pub numerator: usize,
    /// Coefficients of its denominator beyond the leading 1.
    pub denominator: usize,
    /// Whether the law is constant beyond its ends.
    pub clamped: bool,
    /// Whether the law has a value at e = 0.
    pub stressed: bool,
    /// Whether components are held.
    pub held: bool,
    /// Whether body forces act.
    pub loaded: bool,
    /// Components of the factors of particles that bonds are weighted with: 0, 1, or as many as the body has.
    pub factors: usize,
    /// Particles of a thread.
    pub tile: usize,
    /// Bonds of a particle that are taken together, a divisor of all its bonds: 1 or 2.
    pub unroll: usize,
}

impl KernelForm {
    /// Numbers of the law that each thread keeps: all but the nodes of a table.
    pub fn coefficients(&self) -> usize {
        self.numerator + self.denominator + ENDS
    }
}

/// Lists a bond, and counts it where the list is full.
#[cube]
fn note<F: Float>(count: &[Atomic<u32>], list: &mut [u32], elongations: &mut [F], site: u32, k: usize, e: F) {
    let place = count[0].fetch_add(1u32) as usize;
    if place < elongations.len() {
        list[2 * place] = site;
        list[2 * place + 1] = k as u32;
        elongations[place] = e;
    }
}

/// Force densities Σ_J c w q(e) ζ of particles, with the weights w of [`weight`] and e = η·(2ξ + η)/|ξ|²,
/// plus `factor` times the body force. Where it `looks`, each thread writes the least and greatest e of its
/// bonds, and lists bonds beyond the law's last number.
///
/// The two ends of a bond find the same bits of e.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments, clippy::collapsible_if)]
pub fn pull<F: Float>(
    displacement: &[F],
    factors: &[F],
    particles: &[u32],
    shifts: &[i32],
    rows: &[F],
    law: &[F],
    intact: &[u32],
    body: &[F],
    force: &mut [F],
    ranges: &mut [F],
    count: &[Atomic<u32>],
    list: &mut [u32],
    elongations: &mut [F],
    factor: InputScalar,
    #[comptime] form: KernelForm,
    #[comptime] looks: bool,
    #[define(F)] _precision: ElemType,
) {
    let dimension = comptime!(form.dimension);
    let tile = comptime!(form.tile);
    let total = particles.len();
    let first = ABSOLUTE_POS / comptime!(CUBE) * comptime!(CUBE * form.tile) + ABSOLUTE_POS % comptime!(CUBE);
    if ABSOLUTE_POS / comptime!(CUBE) * comptime!(CUBE * form.tile) >= total {
        terminate!();
    }
    let sites = displacement.len() / dimension;
    let mut site = Array::<u32>::new(tile);
    let mut before = Array::<u32>::new(tile);
    let mut own = Array::<F>::new(comptime!(form.tile * form.dimension));
    let mut sum = Array::<F>::new(comptime!(form.tile * form.dimension));
    let mut coefficients = Array::<F>::new(comptime!(form.coefficients()));
    #[unroll]
    for j in 0..comptime!(form.coefficients()) {
        coefficients[j] = law[j];
    }
    #[unroll]
    for p in 0..tile {
        site[p] = particles[usize::min(first + p * comptime!(CUBE), total - 1)];
        #[unroll]
        for d in 0..dimension {
            own[p * dimension + d] = displacement[d * sites + site[p] as usize];
            sum[p * dimension + d] = F::new(0.0);
        }
    }
    let mut low = F::new(0.0);
    let mut high = F::new(0.0);
    let ends = comptime!(form.numerator + form.denominator);
    let words = comptime!(form.bonds.div_ceil(32));
    for word in 0..words {
        let mut any = 0u32;
        let mut all = 0xffff_ffffu32;
        #[unroll]
        for p in 0..tile {
            let inside = first + p * comptime!(CUBE) < total;
            before[p] = select(inside, intact[word * sites + site[p] as usize], 0u32);
            any |= before[p];
            all &= before[p];
        }
        if any != 0 {
            let start = 32 * word;
            let last = usize::min(start + 32, comptime!(form.bonds));
            let whole = 0xffff_ffffu32 >> ((32 - (last - start)) as u32);
            if all == whole {
                // no branch, so that loads of several bonds are under way together
                let mut k = start;
                while k < last {
                    let mut seen = Array::<F>::new(comptime!(form.tile * form.unroll));
                    let mut greatest = F::new(0.0);
                    #[unroll]
                    for next in 0..comptime!(form.unroll) {
                        #[unroll]
                        for p in 0..tile {
                            let e = add_bond::<F>(
                                displacement,
                                factors,
                                shifts,
                                rows,
                                law,
                                &coefficients,
                                &own,
                                &mut sum,
                                site[p],
                                k + next,
                                p,
                                form,
                            );
                            if comptime!(looks) {
                                seen[next * tile + p] = e;
                                low = F::min(low, e);
                                greatest = F::max(greatest, e);
                            }
                        }
                    }
                    if comptime!(looks) {
                        high = F::max(high, greatest);
                        if greatest > coefficients[ends + 3] {
                            #[unroll]
                            for next in 0..comptime!(form.unroll) {
                                #[unroll]
                                for p in 0..tile {
                                    let e = seen[next * tile + p];
                                    if e > coefficients[ends + 3] {
                                        note::<F>(count, list, elongations, site[p], k + next, e);
                                    }
                                }
                            }
                        }
                    }
                    k += comptime!(form.unroll);
                }
            } else {
                for k in start..last {
                    let bit = 1u32 << ((k - start) as u32);
                    #[unroll]
                    for p in 0..tile {
                        if before[p] & bit != 0 {
                            let e = add_bond::<F>(
                                displacement,
                                factors,
                                shifts,
                                rows,
                                law,
                                &coefficients,
                                &own,
                                &mut sum,
                                site[p],
                                k,
                                p,
                                form,
                            );
                            if comptime!(looks) {
                                low = F::min(low, e);
                                high = F::max(high, e);
                                if e > coefficients[ends + 3] {
                                    note::<F>(count, list, elongations, site[p], k, e);
                                }
                            }
                        }
                    }
                }
            }
        }
    }
    let factor = factor.get::<F>();
    #[unroll]
    for p in 0..tile {
        if first + p * comptime!(CUBE) < total {
            #[unroll]
            for d in 0..dimension {
                let to = d * sites + site[p] as usize;
                let mut all = sum[p * dimension + d];
                if comptime!(form.loaded) {
                    all = fma(factor, body[to], all);
                }
                force[to] = all;
            }
        }
    }
    if comptime!(looks) {
        ranges[ABSOLUTE_POS] = low;
        ranges[ranges.len() / 2 + ABSOLUTE_POS] = high;
    }
}

/// The half kick of the free components, v ← `keep`·v + `push`·f, and u ← u + v; held components go to
/// `after` times the full displacement. Each thread writes its [`LEAP_SUMS`].
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub fn half_kick_and_drift<F: Float>(
    force: &[F],
    particles: &[u32],
    held: &[u32],
    full: &[F],
    body: &[F],
    velocity: &mut [F],
    displacement: &mut [F],
    partial: &mut [F],
    ratio: InputScalar,
    keep: InputScalar,
    push: InputScalar,
    after: InputScalar,
    #[comptime] form: KernelForm,
    #[define(F)] _precision: ElemType,
) {
    let dimension = comptime!(form.dimension);
    let threads = partial.len() / comptime!(SUMS);
    if ABSOLUTE_POS >= threads {
        terminate!();
    }
    let sites = displacement.len() / dimension;
    let ratio = ratio.get::<F>();
    let keep = keep.get::<F>();
    let push = push.get::<F>();
    let after = after.get::<F>();
    let mut held_work = F::new(0.0);
    let mut damped = F::new(0.0);
    let mut body_work = F::new(0.0);
    let mut greatest = F::new(0.0);
    for index in range_stepped(ABSOLUTE_POS, particles.len(), threads) {
        let site = particles[index] as usize;
        #[unroll]
        for d in 0..dimension {
            let at = d * sites + site;
            let old = ratio * velocity[at];
            let pull = force[at];
            let here = displacement[at];
            let mut speed = fma(push, pull, keep * old);
            let mut increment = speed;
            let mut there = here + speed;
            if comptime!(form.held) {
                if (held[site] >> (d as u32)) & 1u32 != 0 {
                    there = after * full[at];
                    increment = there - here;
                    speed = old;
                    held_work = fma(pull, increment, held_work);
                } else {
                    damped = fma(old, increment, damped);
                }
            } else {
                damped = fma(old, increment, damped);
            }
            if comptime!(form.loaded) {
                body_work = fma(body[at], increment, body_work);
            }
            greatest = F::max(greatest, F::max(increment, F::new(0.0) - increment));
            velocity[at] = speed;
            displacement[at] = there;
        }
    }
    partial[ABSOLUTE_POS] = held_work;
    partial[threads + ABSOLUTE_POS] = damped;
    partial[2 * threads + ABSOLUTE_POS] = body_work;
    partial[3 * threads + ABSOLUTE_POS] = greatest;
}

/// The second half kick of the free components, v ← `keep`·(v + `push`·f); held components have `rate` times
/// the full displacement and have moved by `gain` times it. Each thread writes its [`KICK_SUMS`].
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub fn kick<F: Float>(
    force: &[F],
    particles: &[u32],
    held: &[u32],
    full: &[F],
    body: &[F],
    velocity: &mut [F],
    partial: &mut [F],
    keep: InputScalar,
    push: InputScalar,
    rate: InputScalar,
    gain: InputScalar,
    #[comptime] form: KernelForm,
    #[define(F)] _precision: ElemType,
) {
    let dimension = comptime!(form.dimension);
    let threads = partial.len() / comptime!(SUMS);
    if ABSOLUTE_POS >= threads {
        terminate!();
    }
    let sites = velocity.len() / dimension;
    let keep = keep.get::<F>();
    let push = push.get::<F>();
    let rate = rate.get::<F>();
    let gain = gain.get::<F>();
    let mut square = F::new(0.0);
    let mut held_work = F::new(0.0);
    let mut gained = F::new(0.0);
    let mut damped = F::new(0.0);
    let mut body_work = F::new(0.0);
    for index in range_stepped(ABSOLUTE_POS, particles.len(), threads) {
        let site = particles[index] as usize;
        #[unroll]
        for d in 0..dimension {
            let at = d * sites + site;
            let old = velocity[at];
            let pull = force[at];
            let mut increment = old;
            let mut speed = keep * fma(push, pull, old);
            if comptime!(form.held) {
                if (held[site] >> (d as u32)) & 1u32 != 0 {
                    increment = gain * full[at];
                    speed = rate * full[at];
                    held_work = fma(pull, increment, held_work);
                    gained += speed * speed - old * old;
                } else {
                    damped = fma(speed, increment, damped);
                }
            } else {
                damped = fma(speed, increment, damped);
            }
            if comptime!(form.loaded) {
                body_work = fma(body[at], increment, body_work);
            }
            square = fma(speed, speed, square);
            velocity[at] = speed;
        }
    }
    let start = comptime!(LEAP_SUMS) * threads + ABSOLUTE_POS;
    partial[start] = square;
    partial[start + threads] = held_work;
    partial[start + 2 * threads] = gained;
    partial[start + 3 * threads] = damped;
    partial[start + 4 * threads] = body_work;
}
