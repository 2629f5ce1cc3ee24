//! Conjugate gradients (Hestenes & Stiefel 1952, doi:10.6028/jres.049.044) with a preconditioner.

use nalgebra::SVector;
use rayon::prelude::*;

/// Number of vectors of a work item.
const ITEM: usize = 4096;

/// Solves A x = r from x = 0 for a symmetric positive definite A; returns x and the number of iterations, at
/// most `most`. `residual` becomes r − A x; `reached` checks it before each iteration. `product` computes A
/// p, `precondition` an approximation of A⁻¹ r, both into their second argument; `dot` defines the order of
/// its sum.
pub fn conjugate_gradients<const D: usize>(
    residual: &mut [SVector<f64, D>],
    most: usize,
    mut reached: impl FnMut(&[SVector<f64, D>]) -> bool,
    mut product: impl FnMut(&[SVector<f64, D>], &mut [SVector<f64, D>]),
    mut precondition: impl FnMut(&[SVector<f64, D>], &mut [SVector<f64, D>]),
    dot: impl Fn(&[SVector<f64, D>], &[SVector<f64, D>]) -> f64,
) -> (Vec<SVector<f64, D>>, usize) {
    let zeros = || vec![SVector::<f64, D>::zeros(); residual.len()];
    let [mut solution, mut direction, mut conditioned, mut image] = [zeros(), zeros(), zeros(), zeros()];
    let mut before = f64::INFINITY;
    for iteration in 0..most {
        if reached(residual) {
            return (solution, iteration);
        }
        precondition(residual, &mut conditioned);
        let square = dot(residual, &conditioned);
        for_each_chunk(&mut direction, &conditioned, |direction, own| *own + *direction * (square / before));
        before = square;
        product(&direction, &mut image);
        let length = square / dot(&direction, &image);
        for_each_chunk(&mut solution, &direction, |solution, direction| *solution + direction * length);
        for_each_chunk(residual, &image, |residual, image| *residual - image * length);
    }
    (solution, most)
}

fn for_each_chunk<T: Copy + Send + Sync>(out: &mut [T], of: &[T], value: impl Fn(&T, &T) -> T + Sync) {
    out.par_chunks_mut(ITEM).zip(of.par_chunks(ITEM)).for_each(|(out, of)| {
        out.iter_mut().zip(of).for_each(|(out, of)| *out = value(out, of));
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// −u″ = 1 on a line with fixed ends: u = ½x(n + 1 − x) at the nodes, after at most n iterations.
    #[test]
    fn a_parabola() {
        let n = 40;
        let laplacian = |u: &[SVector<f64, 1>], image: &mut [SVector<f64, 1>]| {
            let at = |k: usize| u.get(k).copied().unwrap_or_default();
            (0..n).for_each(|k| image[k] = 2.0 * at(k) - at(k + 1) - k.checked_sub(1).map_or(at(n), at));
        };
        let dot = |a: &[SVector<f64, 1>], b: &[SVector<f64, 1>]| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum();
        let diagonal = |r: &[SVector<f64, 1>], z: &mut [SVector<f64, 1>]| {
            z.iter_mut().zip(r).for_each(|(z, r)| *z = r / 2.0);
        };
        let small = |r: &[SVector<f64, 1>]| r.iter().all(|r| r[0].abs() < 1e-10);
        let mut residual = vec![SVector::<f64, 1>::new(1.0); n];
        let (found, iterations) = conjugate_gradients(&mut residual, 100, small, laplacian, diagonal, dot);
        assert!(iterations <= n, "{iterations}");
        for (k, found) in found.iter().enumerate() {
            let x = (k + 1) as f64;
            // residuals of 1e-10 times the norm of the inverse, (n + 1)²/8
            assert!((found[0] - 0.5 * x * ((n + 1) as f64 - x)).abs() < 2.1e-8, "{k} {found}");
        }
        let mut residual = vec![SVector::<f64, 1>::new(1.0); n];
        assert_eq!(conjugate_gradients(&mut residual, 3, small, laplacian, diagonal, dot).1, 3);
    }
}
