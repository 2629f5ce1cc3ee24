//! A bond on a device: its weight, the law, and its force.

use super::kernels::{KernelForm, NODE, ROW};
use cubecl::prelude::*;

/// Weight of a bond from the factors g of its ends: (Σ_d (n_d/ḡ_d)²)^(−1/2), ḡ = ½(g_I + g_J); ḡ if they are
/// equal along all axes. `row` is the place of the bond in `rows`.
#[cube]
pub fn weight<F: Float>(
    factors: &[F],
    rows: &[F],
    row: usize,
    site: usize,
    there: usize,
    #[comptime] form: KernelForm,
) -> F {
    let half = F::new(0.5);
    if comptime!(form.factors == 1) {
        half * (factors[site] + factors[there])
    } else {
        let dimension = comptime!(form.dimension);
        let sites = factors.len() / dimension;
        let mut sum = F::new(0.0);
        #[unroll]
        for d in 0..dimension {
            let mean = half * (factors[d * sites + site] + factors[d * sites + there]);
            let along = rows[row + d] / mean;
            sum = fma(along, along, sum);
        }
        F::new(1.0) / F::sqrt(sum * rows[row + dimension])
    }
}

/// Value at e of a law that is a ratio of polynomials.
#[cube]
fn ratio<F: Float>(law: &Array<F>, e: F, #[comptime] form: KernelForm) -> F {
    let mut q = law[comptime!(form.numerator - 1)];
    #[unroll]
    for j in 1..comptime!(form.numerator) {
        q = fma(q, e, law[comptime!(form.numerator - 1 - j)]);
    }
    if comptime!(form.denominator > 0) {
        let mut below = law[comptime!(form.numerator + form.denominator - 1)];
        #[unroll]
        for j in 1..comptime!(form.denominator) {
            below = fma(below, e, law[comptime!(form.numerator + form.denominator - 1 - j)]);
        }
        q /= fma(below, e, F::new(1.0));
    }
    q *= e;
    if comptime!(form.stressed) {
        q += law[comptime!(form.numerator + form.denominator)];
    }
    q
}

/// Value at e of a law that is a table: the cubic of its piece, the tangent beyond its ends.
#[cube]
fn tabulated<F: Float>(law: &[F], e: F, #[comptime] form: KernelForm) -> F {
    let one = F::new(1.0);
    let start = comptime!(form.coefficients());
    let stretch = F::sqrt(F::max(one + e, F::new(0.0)));
    let strain = e / (one + stretch);
    let mut left = 0usize;
    let mut right = (law.len() - start) / comptime!(NODE) - 1;
    while right - left > 1 {
        let middle = (left + right) / 2;
        if law[start + comptime!(NODE) * middle] <= strain {
            left = middle;
        } else {
            right = middle;
        }
    }
    let from = start + comptime!(NODE) * left;
    let to = start + comptime!(NODE) * right;
    let width = law[to] - law[from];
    let s = (strain - law[from]) / width;
    let r = (law[to] - strain) / width;
    let rise = F::new(2.0) * s;
    let fall = F::new(2.0) * r;
    let mut tension = (one + rise) * r * r * law[from + 1]
        + s * r * r * width * law[from + 2]
        + s * s * (one + fall) * law[to + 1]
        - s * s * r * width * law[to + 2];
    if strain < law[from] {
        tension = fma(law[from + 2], strain - law[from], law[from + 1]);
    }
    if strain > law[to] {
        tension = fma(law[to + 2], strain - law[to], law[to + 1]);
    }
    tension / F::max(stretch, F::new(1e-30))
}

/// Adds the force of bond `k` on the particle `p` of a thread, in `site`; its e.
#[cube]
#[allow(clippy::too_many_arguments)]
pub fn add_bond<F: Float>(
    displacement: &[F],
    factors: &[F],
    shifts: &[i32],
    rows: &[F],
    table: &[F],
    law: &Array<F>,
    own: &Array<F>,
    sum: &mut Array<F>,
    site: u32,
    k: usize,
    #[comptime] p: usize,
    #[comptime] form: KernelForm,
) -> F {
    let dimension = comptime!(form.dimension);
    let sites = displacement.len() / dimension;
    let row = k * comptime!(form.dimension + ROW);
    let there = (site as i32 + shifts[k]) as usize;
    let mut zeta = Array::<F>::new(dimension);
    let mut e = F::new(0.0);
    #[unroll]
    for d in 0..dimension {
        let bond = rows[row + d];
        let eta = displacement[d * sites + there] - own[p * dimension + d];
        zeta[d] = bond + eta;
        e = fma(eta, zeta[d] + bond, e);
    }
    e *= rows[row + dimension];
    let ends = comptime!(form.numerator + form.denominator);
    let mut at = e;
    if comptime!(form.clamped) {
        at = F::max(law[ends + 1], F::min(e, law[ends + 2]));
    }
    let mut q =
        if comptime!(form.tabulated) { tabulated::<F>(table, at, form) } else { ratio::<F>(law, at, form) };
    q *= rows[row + dimension + 1];
    if comptime!(form.factors > 0) {
        q *= weight::<F>(factors, rows, row, site as usize, there, form);
    }
    #[unroll]
    for d in 0..dimension {
        sum[p * dimension + d] = fma(q, zeta[d], sum[p * dimension + d]);
    }
    e
}
