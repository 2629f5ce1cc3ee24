//! Products of element matrices with displacements: each element by vectors of the processor, then the sum at each node in the order of its
//! elements, so that its bits do not depend on threads.

use crate::system::vector::sum;
use nalgebra::{SMatrix, Vector3};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Elements and nodes of a work item.
const ITEM: usize = 512;
/// Components of an element.
const COMPONENTS: usize = 24;

/// An element: its nodes, K̂ and its modulus.
pub type Stiff<'a> = ([u32; 8], &'a SMatrix<f64, 24, 24>, f64);

/// Elements with what each node has of them.
pub struct Elements<'a> {
    list: Vec<Stiff<'a>>,
    /// Where the corners of each node begin, as 8 × element + corner.
    starts: Vec<u32>,
    corners: Vec<u32>,
    free: Vec<[bool; 3]>,
    forces: Vec<[f64; COMPONENTS]>,
}

impl<'a> Elements<'a> {
    /// On nodes of which `free` components move.
    pub fn new(list: Vec<Stiff<'a>>, free: Vec<[bool; 3]>) -> Self {
        let mut starts = vec![0_u32; free.len() + 1];
        let nodes = || list.iter().flat_map(|element| element.0);
        nodes().for_each(|node| starts[node as usize + 1] += 1);
        (0..free.len()).for_each(|k| starts[k + 1] += starts[k]);
        let mut next = starts.clone();
        let mut corners = vec![0; 8 * list.len()];
        for (corner, node) in (0..).zip(nodes()) {
            let next = &mut next[node as usize];
            corners[*next as usize] = corner;
            *next += 1;
        }
        let forces = vec![[0.0; COMPONENTS]; list.len()];
        Self { list, starts, corners, free, forces }
    }

    /// Each element.
    pub fn list(&self) -> &[Stiff<'a>] {
        &self.list
    }

    /// Components that move.
    pub fn free(&self) -> &[[bool; 3]] {
        &self.free
    }

    /// image = Σ E K̂ u on free components.
    pub fn product(&mut self, u: &[Vector3<f64>], image: &mut [Vector3<f64>]) {
        let Self { list, starts, corners, free, forces } = self;
        let arch = Arch::new();
        forces.par_chunks_mut(ITEM).zip(list.par_chunks(ITEM)).for_each(|(forces, list)| {
            arch.dispatch(Product { list, u, forces });
        });
        image.par_chunks_mut(ITEM).enumerate().for_each(|(item, image)| {
            for (k, image) in (item * ITEM..).zip(image) {
                let mut sum = [0.0; 3];
                for &corner in &corners[starts[k] as usize..starts[k + 1] as usize] {
                    let force = &forces[corner as usize / 8][3 * (corner as usize % 8)..][..3];
                    (0..3).for_each(|d| sum[d] += force[d]);
                }
                *image = Vector3::from_fn(|d, _| if free[k][d] { sum[d] } else { 0.0 });
            }
        });
    }
}

struct Product<'a, 'b> {
    list: &'a [Stiff<'b>],
    u: &'a [Vector3<f64>],
    forces: &'a mut [[f64; COMPONENTS]],
}

impl WithSimd for Product<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { list, u, forces } = self;
        let vectors = COMPONENTS / S::F64_LANES;
        for ((nodes, condensed, modulus), forces) in list.iter().zip(forces) {
            let mut local = [0.0; COMPONENTS];
            for (k, &node) in nodes.iter().enumerate() {
                let own = &u[node as usize];
                for d in 0..3 {
                    local[3 * k + d] = own[d];
                }
            }
            // even and odd columns apart: their sums do not wait for each other
            let mut sums = [[simd.splat_f64s(0.0); COMPONENTS]; 2];
            for (pair, local) in condensed.as_slice().chunks_exact(2 * COMPONENTS).zip(local.chunks_exact(2))
            {
                for half in 0..2 {
                    let (column, _) = S::as_simd_f64s(&pair[half * COMPONENTS..(half + 1) * COMPONENTS]);
                    let x = simd.splat_f64s(local[half]);
                    for v in 0..vectors {
                        sums[half][v] = simd.mul_add_f64s(column[v], x, sums[half][v]);
                    }
                }
            }
            let factor = simd.splat_f64s(*modulus);
            let (out, _) = S::as_mut_simd_f64s(&mut forces[..]);
            for v in 0..vectors {
                out[v] = simd.mul_f64s(simd.add_f64s(sums[0][v], sums[1][v]), factor);
            }
        }
    }
}

/// a·b, in work items.
pub fn dot(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    sum(a.len(), |k| a[k].dot(&b[k]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SVector;

    /// Two elements that share four nodes, one component held, against plain matrices.
    #[test]
    fn a_product_is_that_of_the_matrices() {
        let matrix = SMatrix::<f64, 24, 24>::from_fn(|i, j| ((i * j + 3 * (i + j)) as f64).sin());
        let list = vec![([0, 1, 2, 3, 4, 5, 6, 7], &matrix, 2.0), ([4, 5, 6, 7, 8, 9, 10, 11], &matrix, 0.5)];
        let mut free = vec![[true; 3]; 12];
        free[5][1] = false;
        let u: Vec<Vector3<f64>> = (0..12).map(|k| Vector3::new(1.0, f64::from(k), -0.3)).collect();
        let mut expected = vec![Vector3::zeros(); 12];
        for (nodes, matrix, modulus) in &list {
            let local = SVector::<f64, 24>::from_fn(|k, _| u[nodes[k / 3] as usize][k % 3]);
            let forces = *matrix * local * *modulus;
            (0..24).for_each(|k| expected[nodes[k / 3] as usize][k % 3] += forces[k]);
        }
        expected[5][1] = 0.0;
        let mut image = vec![Vector3::zeros(); 12];
        Elements::new(list, free).product(&u, &mut image);
        // 24 products of order 10
        assert!(image.iter().zip(&expected).all(|(a, b)| (a - b).norm() < 1e-12), "{image:?}");
        assert_eq!(dot(&image, &u), image.iter().zip(&u).map(|(a, b)| a.dot(b)).sum::<f64>());
    }
}
