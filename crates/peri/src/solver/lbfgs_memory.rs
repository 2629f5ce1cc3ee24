//! The last steps s and changes of the gradient y, and the direction computed from them: Nocedal (1980),
//! doi:10.1090/S0025-5718-1980-0572855-7, with the recursion carried out on inner products (Chen, Wang & Zhou
//! 2014, NIPS 27), so that stored fields are read twice an iteration.
//!
//! With an initial inverse γB, B the preconditioner, only s and w = B y are stored, in single precision: the
//! pairs are most of the memory traffic of an iteration, and a direction needs no more. All sums are in
//! double precision.

use super::pair_products::{Kept, PairProducts};
use super::particle_map::in_order;
use super::passes::{LANES, sum};
use crate::field::{CHUNK, Field, chunk_range};
use pulp::{Arch, NullaryFnOnce, Simd, WithSimd};
use std::collections::VecDeque;

/// Entries processed at a time, so that data shared by several pairs stay in the cache.
const BLOCK: usize = 512;

/// A vector field in single precision.
type Single<const D: usize> = [Vec<f32>; D];

/// A step and the change of the gradient.
struct StepPair<const D: usize> {
    /// s.
    step: Single<D>,
    /// w = B y.
    image: Single<D>,
}

/// The pairs, oldest first.
pub struct LbfgsMemory<const D: usize> {
    pairs: VecDeque<StepPair<D>>,
    /// Inner products of the pairs.
    products: PairProducts,
    /// Fields to be reused.
    spare: Vec<Single<D>>,
}

impl<const D: usize> LbfgsMemory<D> {
    /// Creates a memory for `most` pairs.
    pub fn new(most: usize) -> Self {
        Self { pairs: VecDeque::new(), products: PairProducts::new(most), spare: Vec::new() }
    }

    /// Returns true if no pair is stored.
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// Forgets all pairs, and the scale if it belongs to another preconditioner.
    pub fn clear(&mut self, scale_too: bool) {
        for pair in self.pairs.drain(..) {
            self.spare.extend([pair.step, pair.image]);
        }
        self.products.clear(scale_too);
    }

    /// Computes d = −H g from z = B g; returns g·d.
    pub fn direction(&self, gradient: &Field<D>, image: &Field<D>, result: &mut Field<D>) -> f64 {
        let (back, weights) = self.products.weights();
        let (sites, scale) = (gradient.sites(), self.products.scale());
        let (gradient, image) = (gradient.components(), image.components());
        let arch = Arch::new();
        let parts = in_order(result.chunks_mut(), |chunk, d| {
            let range = chunk_range(chunk, sites);
            let mut sum = 0.0;
            for (c, out) in d.into_iter().enumerate() {
                for (block, out) in out.chunks_mut(BLOCK).enumerate() {
                    let start = range.start + block * BLOCK;
                    let place = start..start + out.len();
                    let (z, g) = (&image[c][place.clone()], &gradient[c][place.clone()]);
                    for k in 0..out.len() {
                        out[k] = -scale * z[k];
                    }
                    for (pair, (a, weight)) in self.pairs.iter().zip(back.iter().zip(&weights)) {
                        let (s, w) = (&pair.step[c][place.clone()], &pair.image[c][place.clone()]);
                        arch.dispatch(Combine { out: &mut *out, scaled: scale * a, w, weight: *weight, s });
                    }
                    sum += arch.dispatch(DotProduct { a: out, b: g });
                }
            }
            sum
        });
        parts.iter().sum()
    }

    /// Records an accepted step α: s = α d, w = z − z_old, y = g − g_old. Pairs without curvature are
    /// discarded.
    pub fn add(
        &mut self,
        step: f64,
        direction: &Field<D>,
        (old_gradient, old_image): (&Field<D>, &Field<D>),
        (gradient, image): (&Field<D>, &Field<D>),
        least: f64,
    ) {
        let sites = gradient.sites();
        let (g0, g1) = (old_gradient.components(), gradient.components());
        let (d, z0, z1) = (direction.components(), old_image.components(), image.components());
        let mut fresh = || self.spare.pop().unwrap_or_else(|| std::array::from_fn(|_| vec![0.0; sites]));
        let (mut new_step, mut new_image) = (fresh(), fresh());
        let pairs = &self.pairs;
        // s·y, w·y, s·g, w·g of the new pair, then of each other with the new y and g
        let items = chunks(&mut new_step).into_iter().zip(chunks(&mut new_image)).collect();
        let arch = Arch::new();
        let parts = in_order(items, |chunk, (s, w): ([&mut [f32]; D], [&mut [f32]; D])| {
            let range = chunk_range(chunk, sites);
            let mut sums = vec![0.0; 4 * (pairs.len() + 1)];
            let (mut change, mut wide) = ([0.0; BLOCK], [[0.0; BLOCK]; 2]);
            for c in 0..D {
                let blocks = s[c].chunks_mut(BLOCK).zip(w[c].chunks_mut(BLOCK)).enumerate();
                for (block, (s, w)) in blocks {
                    let start = range.start + block * BLOCK;
                    let place = start..start + s.len();
                    let change = &mut change[..s.len()];
                    let (g, old) = (&g1[c][place.clone()], &g0[c][place.clone()]);
                    let (d, z, z_old) = (&d[c][place.clone()], &z1[c][place.clone()], &z0[c][place.clone()]);
                    for k in 0..s.len() {
                        change[k] = g[k] - old[k];
                        s[k] = (step * d[k]) as f32;
                        w[k] = (z[k] - z_old[k]) as f32;
                    }
                    let y = &*change;
                    let mut add = |s: &[f32], w: &[f32], sums: &mut [f64]| {
                        let [wide_s, wide_w] = wide.each_mut().map(|wide| &mut wide[..y.len()]);
                        arch.dispatch(ToDouble { from: s, to: &mut *wide_s });
                        arch.dispatch(ToDouble { from: w, to: &mut *wide_w });
                        let products = arch.dispatch(NewProducts { s: wide_s, w: wide_w, y, g });
                        for k in 0..4 {
                            sums[k] += products[k];
                        }
                    };
                    add(s, w, &mut sums[..4]);
                    for (pair, sums) in pairs.iter().zip(sums[4..].chunks_mut(4)) {
                        add(&pair.step[c][place.clone()], &pair.image[c][place.clone()], sums);
                    }
                }
            }
            sums
        });
        let mut sums = vec![0.0; 4 * (self.pairs.len() + 1)];
        for part in &parts {
            sums.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
        }
        let of = |four: &[f64]| [four[0], four[1], four[2], four[3]];
        let others: Vec<[f64; 4]> = sums[4..].chunks(4).map(of).collect();
        match self.products.add(of(&sums[..4]), &others, least) {
            Kept::None => self.spare.extend([new_step, new_image]),
            kept => {
                if kept == Kept::InsteadOfOldest
                    && let Some(oldest) = self.pairs.pop_front()
                {
                    self.spare.extend([oldest.step, oldest.image]);
                }
                self.pairs.push_back(StepPair { step: new_step, image: new_image });
            }
        }
    }
}

/// Splits a field into its work items, in order.
fn chunks<const D: usize>(field: &mut Single<D>) -> Vec<[&mut [f32]; D]> {
    let mut iterators = field.each_mut().map(|component| component.chunks_mut(CHUNK));
    let count = iterators[0].len();
    (0..count).map(|_| iterators.each_mut().map(|i| i.next().unwrap_or_default())).collect()
}

/// Converts to double precision; sums that convert as they go are not vectorised.
struct ToDouble<'a> {
    from: &'a [f32],
    to: &'a mut [f64],
}

impl NullaryFnOnce for ToDouble<'_> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        let from = &self.from[..self.to.len()];
        for k in 0..from.len() {
            self.to[k] = f64::from(from[k]);
        }
    }
}

/// s·y, w·y, s·g, w·g.
struct NewProducts<'a> {
    s: &'a [f64],
    w: &'a [f64],
    y: &'a [f64],
    g: &'a [f64],
}

impl WithSimd for NewProducts<'_> {
    type Output = [f64; 4];
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> [f64; 4] {
        let ((s, s_last), (w, w_last)) = (S::as_simd_f64s(self.s), S::as_simd_f64s(self.w));
        let ((y, y_last), (g, g_last)) = (S::as_simd_f64s(self.y), S::as_simd_f64s(self.g));
        let (w, y, g) = (&w[..s.len()], &y[..s.len()], &g[..s.len()]);
        let zero = simd.splat_f64s(0.0);
        let (mut sy, mut wy, mut sg, mut wg) = (zero, zero, zero, zero);
        for k in 0..s.len() {
            sy = simd.mul_add_f64s(s[k], y[k], sy);
            wy = simd.mul_add_f64s(w[k], y[k], wy);
            sg = simd.mul_add_f64s(s[k], g[k], sg);
            wg = simd.mul_add_f64s(w[k], g[k], wg);
        }
        let mut sums = [
            simd.reduce_sum_f64s(sy),
            simd.reduce_sum_f64s(wy),
            simd.reduce_sum_f64s(sg),
            simd.reduce_sum_f64s(wg),
        ];
        for k in 0..s_last.len() {
            sums[0] += s_last[k] * y_last[k];
            sums[1] += w_last[k] * y_last[k];
            sums[2] += s_last[k] * g_last[k];
            sums[3] += w_last[k] * g_last[k];
        }
        sums
    }
}

/// out += scaled·w − weight·s.
struct Combine<'a> {
    out: &'a mut [f64],
    scaled: f64,
    w: &'a [f32],
    weight: f64,
    s: &'a [f32],
}

impl NullaryFnOnce for Combine<'_> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        let Self { out, scaled, w, weight, s } = self;
        let (w, s) = (&w[..out.len()], &s[..out.len()]);
        for k in 0..out.len() {
            out[k] += scaled * f64::from(w[k]) - weight * f64::from(s[k]);
        }
    }
}

/// a·b.
struct DotProduct<'a> {
    a: &'a [f64],
    b: &'a [f64],
}

impl NullaryFnOnce for DotProduct<'_> {
    type Output = f64;
    #[inline(always)]
    fn call(self) -> f64 {
        let ((a, a_last), (b, b_last)) = (self.a.as_chunks::<LANES>(), self.b.as_chunks::<LANES>());
        let b = &b[..a.len()];
        let mut lanes = [0.0; LANES];
        for k in 0..a.len() {
            for lane in 0..LANES {
                lanes[lane] += a[k][lane] * b[k][lane];
            }
        }
        for lane in 0..a_last.len() {
            lanes[lane] += a_last[lane] * b_last[lane];
        }
        sum(&lanes)
    }
}
