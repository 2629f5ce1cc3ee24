//! Vector operations in fixed work items, so that sums have the same bits on any number of threads.

use polycore::numerics::ordered_sum;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Number of entries of a work item.
pub const CHUNK: usize = 4096;

/// Number of work items of a vector.
pub fn items(size: usize) -> usize {
    size.div_ceil(CHUNK)
}

/// Computes a·b within a work item, in four vectors of partial sums.
#[inline(always)]
pub fn dot_simd<S: Simd>(simd: S, a: &[f64], b: &[f64]) -> f64 {
    let length = a.len().min(b.len());
    let ((a, a_rest), (b, b_rest)) = (S::as_simd_f64s(&a[..length]), S::as_simd_f64s(&b[..length]));
    let mut sums = [simd.splat_f64s(0.0); 4];
    let whole = a.len() / 4 * 4;
    for k in (0..whole).step_by(4) {
        for v in 0..4 {
            sums[v] = simd.mul_add_f64s(a[k + v], b[k + v], sums[v]);
        }
    }
    for k in whole..a.len() {
        sums[0] = simd.mul_add_f64s(a[k], b[k], sums[0]);
    }
    let low = simd.add_f64s(sums[0], sums[1]);
    let high = simd.add_f64s(sums[2], sums[3]);
    let mut sum = simd.reduce_sum_f64s(simd.add_f64s(low, high));
    for (a, b) in a_rest.iter().zip(b_rest) {
        sum += a * b;
    }
    sum
}

struct Square<'a> {
    value: &'a [f64],
    weight: &'a [f64],
}

impl WithSimd for Square<'_> {
    type Output = f64;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let length = self.value.len().min(self.weight.len());
        let (value, value_rest) = S::as_simd_f64s(&self.value[..length]);
        let (weight, weight_rest) = S::as_simd_f64s(&self.weight[..length]);
        let mut sums = [simd.splat_f64s(0.0); 2];
        for (k, (v, w)) in value.iter().zip(weight).enumerate() {
            sums[k & 1] = simd.mul_add_f64s(simd.mul_f64s(*v, *w), *v, sums[k & 1]);
        }
        let mut sum = simd.reduce_sum_f64s(simd.add_f64s(sums[0], sums[1]));
        for (v, w) in value_rest.iter().zip(weight_rest) {
            sum += v * w * v;
        }
        sum
    }
}

/// Computes Σ w v².
pub fn weighted_square(value: &[f64], weight: &[f64]) -> f64 {
    let arch = Arch::new();
    let items = value.par_chunks(CHUNK).zip(weight.par_chunks(CHUNK));
    ordered_sum(items.map(|(value, weight)| arch.dispatch(Square { value, weight })))
}

struct Dot<'a>(&'a [f64], &'a [f64]);

impl WithSimd for Dot<'_> {
    type Output = f64;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        dot_simd(simd, self.0, self.1)
    }
}

/// Computes a·b.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let arch = Arch::new();
    ordered_sum(a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK)).map(|(a, b)| arch.dispatch(Dot(a, b))))
}

/// Computes Σ f(k) over 0..size, in work items, each with independent partial sums.
pub fn sum(size: usize, term: impl Fn(usize) -> f64 + Sync) -> f64 {
    const LANES: usize = 8;
    let item = |item: usize| {
        let (start, end) = (item * CHUNK, ((item + 1) * CHUNK).min(size));
        let mut sums = [0.0; LANES];
        let whole = end - (end - start) % LANES;
        for k in (start..whole).step_by(LANES) {
            for (lane, sum) in sums.iter_mut().enumerate() {
                *sum += term(k + lane);
            }
        }
        (whole..end).for_each(|k| sums[0] += term(k));
        sums.iter().sum::<f64>()
    };
    ordered_sum((0..items(size)).into_par_iter().map(item))
}

/// Returns the largest f(k) over 0..size; NaN if one is NaN.
pub fn largest(size: usize, term: impl Fn(usize) -> f64 + Sync) -> f64 {
    let parts: Vec<f64> = (0..items(size))
        .into_par_iter()
        .map(|item| {
            let mut most = f64::NEG_INFINITY;
            for k in item * CHUNK..((item + 1) * CHUNK).min(size) {
                let value = term(k);
                if value > most || value.is_nan() {
                    most = value;
                }
                if most.is_nan() {
                    break;
                }
            }
            most
        })
        .collect();
    parts.into_iter().fold(f64::NEG_INFINITY, |a, b| if b > a || b.is_nan() { b } else { a })
}

/// Sets out_k = f(k), in work items.
pub fn set(out: &mut [f64], value: impl Fn(usize) -> f64 + Sync) {
    out.par_chunks_mut(CHUNK).enumerate().for_each(|(item, out)| {
        for (k, out) in out.iter_mut().enumerate() {
            *out = value(item * CHUNK + k);
        }
    });
}

/// Sets out_k = f(out_k, a_k, b_k), in work items.
pub fn blend(out: &mut [f64], a: &[f64], b: &[f64], value: impl Fn(f64, f64, f64) -> f64 + Sync) {
    out.par_chunks_mut(CHUNK).zip(a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK))).for_each(|(out, (a, b))| {
        for (out, (a, b)) in out.iter_mut().zip(a.iter().zip(b)) {
            *out = value(*out, *a, *b);
        }
    });
}

/// Sets out_k = f(k, out_k), in work items.
pub fn combine<T: Copy + Send>(out: &mut [T], value: impl Fn(usize, T) -> T + Sync) {
    out.par_chunks_mut(CHUNK).enumerate().for_each(|(item, out)| {
        for (k, out) in out.iter_mut().enumerate() {
            *out = value(item * CHUNK + k, *out);
        }
    });
}

struct SolutionUpdate<'a> {
    length: f64,
    solution: &'a mut [f64],
    residual: &'a mut [f64],
    direction: &'a [f64],
    image: &'a [f64],
    inverse: &'a [f64],
}

impl WithSimd for SolutionUpdate<'_> {
    type Output = f64;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let (solution, solution_rest) = S::as_mut_simd_f64s(self.solution);
        let (residual, residual_rest) = S::as_mut_simd_f64s(self.residual);
        let (direction, direction_rest) = S::as_simd_f64s(self.direction);
        let (image, image_rest) = S::as_simd_f64s(self.image);
        let (inverse, inverse_rest) = S::as_simd_f64s(self.inverse);
        let count = solution.len();
        let (residual, direction) = (&mut residual[..count], &direction[..count]);
        let (image, inverse) = (&image[..count], &inverse[..count]);
        let (length, minus) = (simd.splat_f64s(self.length), simd.splat_f64s(-self.length));
        let mut sums = [simd.splat_f64s(0.0); 2];
        for k in 0..count {
            solution[k] = simd.mul_add_f64s(length, direction[k], solution[k]);
            residual[k] = simd.mul_add_f64s(minus, image[k], residual[k]);
            let scaled = simd.mul_f64s(residual[k], inverse[k]);
            sums[k & 1] = simd.mul_add_f64s(scaled, residual[k], sums[k & 1]);
        }
        let mut sum = simd.reduce_sum_f64s(simd.add_f64s(sums[0], sums[1]));
        for k in 0..solution_rest.len() {
            solution_rest[k] += self.length * direction_rest[k];
            residual_rest[k] -= self.length * image_rest[k];
            sum += residual_rest[k] * inverse_rest[k] * residual_rest[k];
        }
        sum
    }
}

/// Updates x += α p and r −= α q; returns Σ r²/diagonal.
pub fn advance(
    length: f64,
    solution: &mut [f64],
    residual: &mut [f64],
    direction: &[f64],
    image: &[f64],
    inverse: &[f64],
) -> f64 {
    let arch = Arch::new();
    let items = solution
        .par_chunks_mut(CHUNK)
        .zip(residual.par_chunks_mut(CHUNK))
        .zip(direction.par_chunks(CHUNK).zip(image.par_chunks(CHUNK)))
        .zip(inverse.par_chunks(CHUNK));
    ordered_sum(items.map(|(((solution, residual), (direction, image)), inverse)| {
        arch.dispatch(SolutionUpdate { length, solution, residual, direction, image, inverse })
    }))
}

struct DirectionUpdate<'a> {
    factor: f64,
    direction: &'a mut [f64],
    residual: &'a [f64],
    inverse: &'a [f64],
}

impl WithSimd for DirectionUpdate<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (direction, direction_rest) = S::as_mut_simd_f64s(self.direction);
        let (residual, residual_rest) = S::as_simd_f64s(self.residual);
        let (inverse, inverse_rest) = S::as_simd_f64s(self.inverse);
        let count = direction.len();
        let (residual, inverse) = (&residual[..count], &inverse[..count]);
        let factor = simd.splat_f64s(self.factor);
        for k in 0..count {
            let scaled = simd.mul_f64s(residual[k], inverse[k]);
            direction[k] = simd.mul_add_f64s(factor, direction[k], scaled);
        }
        for k in 0..direction_rest.len() {
            direction_rest[k] = self.factor * direction_rest[k] + residual_rest[k] * inverse_rest[k];
        }
    }
}

/// Updates p = r/diagonal + β p.
pub fn turn(factor: f64, direction: &mut [f64], residual: &[f64], inverse: &[f64]) {
    let arch = Arch::new();
    direction.par_chunks_mut(CHUNK).zip(residual.par_chunks(CHUNK).zip(inverse.par_chunks(CHUNK))).for_each(
        |(direction, (residual, inverse))| {
            arch.dispatch(DirectionUpdate { factor, direction, residual, inverse });
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Operations agree with plain loops, on a length that is not a multiple of the lanes.
    #[test]
    fn operations() {
        let size = 2 * CHUNK + 13;
        let vector = |seed: f64| (0..size).map(|k| (seed * k as f64).sin()).collect::<Vec<_>>();
        let (p, q, w) = (vector(1.0), vector(2.0), vector(3.0));
        let (mut x, mut r) = (vector(4.0), vector(5.0));
        let (x0, r0) = (x.clone(), r.clone());
        let square = advance(0.5, &mut x, &mut r, &p, &q, &w);
        let mut expected = 0.0;
        for k in 0..size {
            assert!((x[k] - (x0[k] + 0.5 * p[k])).abs() < 1e-15);
            let residual = r0[k] - 0.5 * q[k];
            assert!((r[k] - residual).abs() < 1e-15);
            expected += residual * residual * w[k];
        }
        // 8205 terms of order 1
        assert!((square - expected).abs() < 1e-10 && (weighted_square(&r, &w) - expected).abs() < 1e-10);
        let mut d = p.clone();
        turn(0.25, &mut d, &r, &w);
        assert!((0..size).all(|k| (d[k] - (r[k] * w[k] + 0.25 * p[k])).abs() < 1e-15));
        let plain: f64 = p.iter().zip(&q).map(|(p, q)| p * q).sum();
        assert!((dot(&p, &q) - plain).abs() < 1e-10);
        blend(&mut d, &p, &q, |d, p, q| d - p * q);
        assert!((0..size).all(|k| (d[k] - (r[k] * w[k] + 0.25 * p[k] - p[k] * q[k])).abs() < 1e-15));
        assert_eq!(sum(size, |_| 1.0), size as f64);
        assert_eq!(largest(size, |k| k as f64), size as f64 - 1.0);
        assert!(largest(size, |k| if k == 3 { f64::NAN } else { 1.0 }).is_nan());
        let mut out = vec![0.0; size];
        set(&mut out, |k| k as f64);
        assert_eq!(out[CHUNK + 1], CHUNK as f64 + 1.0);
    }
}
