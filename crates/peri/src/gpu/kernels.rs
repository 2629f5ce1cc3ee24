//! What runs on a device, one particle a thread. Fields lie component by component, as in [`crate::field::Field`].

use cubecl::ir::ElemType;
use cubecl::prelude::*;

/// What the kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Form {
    /// Dimension of the body.
    pub dimension: usize,
    /// Bonds of the stencil.
    pub bonds: usize,
    /// Coefficients of the law's numerator.
    pub numerator: usize,
    /// Coefficients of its denominator beyond the leading 1.
    pub denominator: usize,
    /// Whether bonds break.
    pub breaks: bool,
    /// Whether velocities follow the forces.
    pub kicks: bool,
}

/// Numbers of a row before its bond's coefficients: the ends of the law in E, its value at E = 0, and the E at which the bond breaks.
pub const HEAD: usize = 4;

impl Form {
    /// Numbers of a row: the bond ξ, [`HEAD`], numerator, denominator.
    pub fn width(&self) -> usize {
        self.dimension + HEAD + self.numerator + self.denominator
    }
}

/// Forces Σ_J q(E) ζ with E = η·(2ξ + η) of every particle, the half kick v ← v + `push`·f of its free components, and the bonds
/// with E > E_c taken from those that are intact: f is then the force of what is left.
///
/// A thread writes what belongs to its own particle; the two ends of a bond find the same bits of E, so both break it.
#[cube(launch)]
// a kernel's buffers; what is decided before it is compiled, around what is decided when it runs
#[allow(clippy::too_many_arguments, clippy::collapsible_if)]
pub fn pull<F: Float>(
    displacement: &[F],
    particles: &[u32],
    held: &[u32],
    shifts: &[i32],
    rows: &[F],
    intact: &mut [u32],
    force: &mut [F],
    velocity: &mut [F],
    push: InputScalar,
    #[comptime] form: Form,
    #[define(F)] _precision: ElemType,
) {
    if ABSOLUTE_POS >= particles.len() {
        terminate!();
    }
    let dimension = comptime!(form.dimension);
    let numerator = comptime!(form.dimension + HEAD);
    let denominator = comptime!(form.dimension + HEAD + form.numerator);
    let site = particles[ABSOLUTE_POS] as usize;
    let sites = displacement.len() / dimension;
    let mut own = Array::<F>::new(dimension);
    let mut zeta = Array::<F>::new(dimension);
    let mut sum = Array::<F>::new(dimension);
    let mut lost = Array::<F>::new(dimension);
    #[unroll]
    for d in 0..dimension {
        own[d] = displacement[d * sites + site];
        sum[d] = F::new(0.0);
        lost[d] = F::new(0.0);
    }
    let words = comptime!(form.bonds.div_ceil(32));
    for word in 0..words {
        let before = intact[word * sites + site];
        let mut after = before;
        let first = 32 * word;
        let last = usize::min(first + 32, comptime!(form.bonds));
        for k in first..last {
            let bit = 1u32 << ((k - first) as u32);
            if before & bit != 0 {
                let row = k * comptime!(form.width());
                let there = (site as i32 + shifts[k]) as usize;
                let mut e = F::new(0.0);
                #[unroll]
                for d in 0..dimension {
                    let bond = rows[row + d];
                    let eta = displacement[d * sites + there] - own[d];
                    zeta[d] = bond + eta;
                    e = fma(eta, zeta[d] + bond, e);
                }
                let clamped = F::max(rows[row + dimension], F::min(e, rows[row + dimension + 1]));
                let mut q = rows[row + numerator + comptime!(form.numerator - 1)];
                #[unroll]
                for j in 1..comptime!(form.numerator) {
                    q = fma(q, clamped, rows[row + numerator + comptime!(form.numerator - 1 - j)]);
                }
                if comptime!(form.denominator > 0) {
                    let mut below = rows[row + denominator + comptime!(form.denominator - 1)];
                    #[unroll]
                    for j in 1..comptime!(form.denominator) {
                        below = fma(
                            below,
                            clamped,
                            rows[row + denominator + comptime!(form.denominator - 1 - j)],
                        );
                    }
                    q /= fma(below, clamped, F::new(1.0));
                }
                q = fma(q, clamped, rows[row + dimension + 2]);
                #[unroll]
                for d in 0..dimension {
                    sum[d] = fma(q, zeta[d], sum[d]);
                }
                if comptime!(form.breaks) {
                    if e > rows[row + dimension + 3] {
                        after &= !bit;
                        #[unroll]
                        for d in 0..dimension {
                            lost[d] = fma(q, zeta[d], lost[d]);
                        }
                    }
                }
            }
        }
        if comptime!(form.breaks) {
            if after != before {
                intact[word * sites + site] = after;
            }
        }
    }
    let push = push.get::<F>();
    #[unroll]
    for d in 0..dimension {
        if comptime!(form.kicks) {
            if held[site] >> (d as u32) & 1 == 0 {
                velocity[d * sites + site] = fma(push, sum[d], velocity[d * sites + site]);
            }
        }
        force[d * sites + site] = sum[d] - lost[d];
    }
}

/// The half kick of the free components, v ← v + `push`·f, and u ← u + v; velocities are displacements a step.
#[cube(launch)]
pub fn leap<F: Float>(
    force: &[F],
    particles: &[u32],
    held: &[u32],
    velocity: &mut [F],
    displacement: &mut [F],
    push: InputScalar,
    #[comptime] dimension: usize,
    #[define(F)] _precision: ElemType,
) {
    if ABSOLUTE_POS >= particles.len() {
        terminate!();
    }
    let site = particles[ABSOLUTE_POS] as usize;
    let sites = displacement.len() / dimension;
    let push = push.get::<F>();
    #[unroll]
    for d in 0..dimension {
        let at = d * sites + site;
        let mut speed = velocity[at];
        if held[site] >> (d as u32) & 1 == 0 {
            speed = fma(push, force[at], speed);
            velocity[at] = speed;
        }
        displacement[at] += speed;
    }
}
