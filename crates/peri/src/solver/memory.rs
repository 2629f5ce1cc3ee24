//! The last steps s and changes of the gradient y, and the direction that follows: Nocedal (1980),
//! doi:10.1090/S0025-5718-1980-0572855-7, with the recursion carried out on inner products (Chen, Wang & Zhou 2014, NIPS 27),
//! so that stored fields are read twice an iteration.
//!
//! With an initial inverse γB, B the preconditioner, only s and w = B y are stored.

use crate::field::{CHUNK, Field, chunk_range};
use rayon::prelude::*;
use std::collections::VecDeque;

/// Parts of a sum of products, so that it vectorises.
const LANES: usize = 8;

/// A step, and what it did to the gradient.
struct Pair<const D: usize> {
    /// s.
    step: Field<D>,
    /// w = B y.
    image: Field<D>,
    /// s·y and y·w of this pair.
    curvature: f64,
    size: f64,
    /// s·y and w·y with the y of each later pair, in their order.
    later: VecDeque<[f64; 2]>,
    /// s·g and w·g with the present gradient.
    gradient: [f64; 2],
}

/// The pairs, oldest first.
pub struct Memory<const D: usize> {
    most: usize,
    pairs: VecDeque<Pair<D>>,
    /// Fields to use again.
    spare: Vec<Field<D>>,
    /// Scale of the initial inverse; 1 until a pair is known.
    scale: f64,
}

impl<const D: usize> Memory<D> {
    /// Room for `most` pairs.
    pub fn new(most: usize) -> Self {
        Self { most, pairs: VecDeque::new(), spare: Vec::new(), scale: 1.0 }
    }

    /// Whether no pair is known.
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// Forgets all pairs, and the scale where it belongs to another preconditioner.
    pub fn clear(&mut self, scale_too: bool) {
        for pair in self.pairs.drain(..) {
            self.spare.extend([pair.step, pair.image]);
        }
        if scale_too {
            self.scale = 1.0;
        }
    }

    /// d = −H g from z = B g; returns g·d.
    pub fn direction(&self, gradient: &Field<D>, image: &Field<D>, result: &mut Field<D>) -> f64 {
        let count = self.pairs.len();
        // backwards: a_i = s_i·(g − Σ_{j>i} a_j y_j)/(s_i·y_i)
        let mut back = vec![0.0; count];
        for i in (0..count).rev() {
            let pair = &self.pairs[i];
            let later: f64 = (i + 1..count).map(|j| back[j] * pair.later[j - i - 1][0]).sum();
            back[i] = (pair.gradient[0] - later) / pair.curvature;
        }
        // forwards: b_i = y_i·(γ(z − Σ_j a_j w_j) + Σ_{k<i} (a_k − b_k) s_k)/(s_i·y_i)
        let mut weights = vec![0.0; count];
        for i in 0..count {
            let pair = &self.pairs[i];
            let mut value = pair.gradient[1] - back[i] * pair.size;
            for j in 0..count {
                if j < i {
                    value -= back[j] * self.pairs[j].later[i - j - 1][1];
                } else if j > i {
                    value -= back[j] * pair.later[j - i - 1][1];
                }
            }
            value *= self.scale;
            for (k, weight) in weights[..i].iter().enumerate() {
                value += weight * self.pairs[k].later[i - k - 1][0];
            }
            weights[i] = back[i] - value / pair.curvature;
        }
        let (sites, scale) = (gradient.sites(), self.scale);
        let (gradient, image) = (gradient.components(), image.components());
        let parts: Vec<f64> = result
            .chunks_mut()
            .into_par_iter()
            .enumerate()
            .map(|(chunk, d)| {
                let range = chunk_range(chunk, sites);
                let mut sum = 0.0;
                for c in 0..D {
                    let out = &mut *d[c];
                    out.iter_mut().zip(&image[c][range.clone()]).for_each(|(d, z)| *d = -scale * z);
                    for (pair, (a, weight)) in self.pairs.iter().zip(back.iter().zip(&weights)) {
                        let (s, w) = (pair.step.components()[c], pair.image.components()[c]);
                        let (s, w) = (&s[range.clone()], &w[range.clone()]);
                        let scaled = scale * a;
                        for k in 0..out.len() {
                            out[k] += scaled * w[k] - weight * s[k];
                        }
                    }
                    sum += product(out, &gradient[c][range.clone()]);
                }
                sum
            })
            .collect();
        parts.iter().sum()
    }

    /// Takes note of an accepted step: `direction` and `old_image` become s = α d and w = z − z_old, y = g − g_old.
    /// Both fields come back with other content. Pairs without curvature are not kept.
    pub fn add(
        &mut self,
        step: f64,
        direction: &mut Field<D>,
        (old_gradient, old_image): (&Field<D>, &mut Field<D>),
        (gradient, image): (&Field<D>, &Field<D>),
        least: f64,
    ) {
        let sites = gradient.sites();
        let (g0, g1, z1) = (old_gradient.components(), gradient.components(), image.components());
        let pairs = &self.pairs;
        // s·y, w·y, s·g, w·g of the new pair, then of each other with the new y and g
        let items = direction.chunks_mut().into_par_iter().zip(old_image.chunks_mut()).enumerate();
        let parts: Vec<Vec<f64>> = items
            .map(|(chunk, (s, w))| {
                let range = chunk_range(chunk, sites);
                let mut sums = vec![0.0; 4 * (pairs.len() + 1)];
                let mut change = [0.0; CHUNK];
                let change = &mut change[..range.len()];
                for c in 0..D {
                    let (g, z) = (&g1[c][range.clone()], &z1[c][range.clone()]);
                    change
                        .iter_mut()
                        .zip(g)
                        .zip(&g0[c][range.clone()])
                        .for_each(|((y, g), old)| *y = g - old);
                    s[c].iter_mut().for_each(|s| *s *= step);
                    w[c].iter_mut().zip(z).for_each(|(w, z)| *w = z - *w);
                    add_products(&mut sums[..4], s[c], w[c], change, g);
                    for (pair, sums) in pairs.iter().zip(sums[4..].chunks_mut(4)) {
                        let (s, w) = (pair.step.components()[c], pair.image.components()[c]);
                        add_products(sums, &s[range.clone()], &w[range.clone()], change, g);
                    }
                }
                sums
            })
            .collect();
        let mut sums = vec![0.0; 4 * (self.pairs.len() + 1)];
        for part in &parts {
            sums.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
        }
        let [curvature, size] = [sums[0], sums[1]];
        let keep = curvature > least && size > 0.0 && curvature.is_finite() && size.is_finite();
        for (pair, sums) in self.pairs.iter_mut().zip(sums[4..].chunks(4)) {
            pair.gradient = [sums[2], sums[3]];
            if keep {
                pair.later.push_back([sums[0], sums[1]]);
            }
        }
        if !keep || self.most == 0 {
            return;
        }
        self.scale = curvature / size;
        if self.pairs.len() == self.most
            && let Some(oldest) = self.pairs.pop_front()
        {
            self.spare.extend([oldest.step, oldest.image]);
        }
        let mut fresh = || self.spare.pop().unwrap_or_else(|| Field::zeros(sites));
        let (step, image) = (std::mem::replace(direction, fresh()), std::mem::replace(old_image, fresh()));
        let (later, gradient) = (VecDeque::new(), [sums[2], sums[3]]);
        self.pairs.push_back(Pair { step, image, curvature, size, later, gradient });
    }
}

/// sums += (s·y, w·y, s·g, w·g).
fn add_products(sums: &mut [f64], s: &[f64], w: &[f64], y: &[f64], g: &[f64]) {
    let mut lanes = [[0.0; LANES]; 4];
    let parts = s.chunks(LANES).zip(w.chunks(LANES)).zip(y.chunks(LANES).zip(g.chunks(LANES)));
    for ((s, w), (y, g)) in parts {
        for lane in 0..s.len() {
            lanes[0][lane] += s[lane] * y[lane];
            lanes[1][lane] += w[lane] * y[lane];
            lanes[2][lane] += s[lane] * g[lane];
            lanes[3][lane] += w[lane] * g[lane];
        }
    }
    for (sum, lanes) in sums.iter_mut().zip(&lanes) {
        *sum += lanes.iter().sum::<f64>();
    }
}

/// a·b.
pub fn product(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    for (a, b) in a.chunks(LANES).zip(b.chunks(LANES)) {
        for lane in 0..a.len() {
            lanes[lane] += a[lane] * b[lane];
        }
    }
    lanes.iter().sum()
}
