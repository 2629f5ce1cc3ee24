//! Products of element matrices with displacements: vectorized element by element, then summed at each node
//! in the order of its elements, so that the bits do not depend on threads.

use super::body::slide;
use super::element::ElementVector;
use crate::system::vector::sum;
use nalgebra::{Matrix3, Vector3};
use polycore::numerics::Groups;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Number of elements or nodes of a work item.
const ITEM: usize = 512;
/// Number of components of a hexahedron.
const COMPONENTS: usize = 24;

/// Load of nodes, as a sum of forces.
pub(super) struct NodalLoad {
    pub(super) sum: Vec<Vector3<f64>>,
    /// Sum of the squares of all contributions.
    pub(super) parts: f64,
}

/// An element of `N` nodes: its nodes, K̂ column by column, and its modulus.
type Stiff<'a, const N: usize> = ([u32; N], &'a [f64], f64);

/// Elements with their matrices: hexahedra, then tetrahedra of 4 and of 10 nodes.
pub struct Elements<'a> {
    hexahedra: Vec<Stiff<'a, 8>>,
    first: Vec<Stiff<'a, 4>>,
    second: Vec<Stiff<'a, 10>>,
    /// Positions in `forces` of each node.
    corners: Groups<u32>,
    free: Vec<[bool; 3]>,
    /// Nodes with rollers and their normals.
    normals: Vec<(usize, Vector3<f64>)>,
    /// Nodal forces of all elements.
    forces: Vec<f64>,
}

impl<'a> Elements<'a> {
    /// Collects elements on nodes with `free` components and, of nodes with rollers, normals; `number` is the
    /// index of each node of the mesh among these.
    pub fn new(
        list: impl Iterator<Item = (&'a [u32], &'a [f64], f64)>,
        number: &[u32],
        free: Vec<[bool; 3]>,
        normals: Vec<(usize, Vector3<f64>)>,
    ) -> Self {
        let (mut hexahedra, mut first, mut second) = (Vec::new(), Vec::new(), Vec::new());
        for (nodes, stiffness, modulus) in list {
            if let Some(nodes) = nodes.first_chunk::<10>() {
                second.push((nodes.map(|node| number[node as usize]), stiffness, modulus));
            } else if let Some(nodes) = nodes.first_chunk::<8>() {
                hexahedra.push((nodes.map(|node| number[node as usize]), stiffness, modulus));
            } else if let Some(nodes) = nodes.first_chunk::<4>() {
                first.push((nodes.map(|node| number[node as usize]), stiffness, modulus));
            }
        }
        let corners = Groups::new(0, std::iter::empty());
        let mut own = Self { hexahedra, first, second, corners, free, normals, forces: Vec::new() };
        let nodes: Vec<u32> = own.each().flat_map(|element| element.0).copied().collect();
        own.corners = Groups::new(own.free.len(), nodes.iter().map(|&node| node as usize).zip(0..));
        own.forces = vec![0.0; 3 * nodes.len()];
        own
    }

    /// Iterates over elements: nodes, K̂ and modulus.
    pub fn each(&self) -> impl Iterator<Item = (&[u32], &'a [f64], f64)> {
        fn plain<'b, 'a, const N: usize>(stiff: &'b Stiff<'a, N>) -> (&'b [u32], &'a [f64], f64) {
            (&stiff.0, stiff.1, stiff.2)
        }
        let tetrahedra = self.first.iter().map(plain).chain(self.second.iter().map(plain));
        self.hexahedra.iter().map(plain).chain(tetrahedra)
    }

    /// Free components.
    pub fn free(&self) -> &[[bool; 3]] {
        &self.free
    }

    /// Nodes with rollers and their normals.
    pub fn normals(&self) -> &[(usize, Vector3<f64>)] {
        &self.normals
    }

    /// Computes image = Σ E K̂ u on free components.
    pub fn product(&mut self, u: &[Vector3<f64>], image: &mut [Vector3<f64>]) {
        let Self { hexahedra, first, second, corners, free, normals, forces } = self;
        let arch = Arch::new();
        let (of_hexahedra, rest) = forces.split_at_mut(COMPONENTS * hexahedra.len());
        let (of_first, of_second) = rest.split_at_mut(12 * first.len());
        let parts = of_hexahedra.par_chunks_mut(COMPONENTS * ITEM);
        parts.zip(hexahedra.par_chunks(ITEM)).for_each(|(forces, list)| {
            let (forces, _) = forces.as_chunks_mut();
            arch.dispatch(HexahedraProduct { list, u, forces });
        });
        plain_product(first, u, of_first);
        plain_product(second, u, of_second);
        image.par_chunks_mut(ITEM).enumerate().for_each(|(item, image)| {
            for (k, image) in (item * ITEM..).zip(image) {
                let mut sum = [0.0; 3];
                for &corner in corners.group(k) {
                    let force = &forces[3 * corner as usize..][..3];
                    (0..3).for_each(|d| sum[d] += force[d]);
                }
                *image = Vector3::from_fn(|d, _| if free[k][d] { sum[d] } else { 0.0 });
            }
        });
        slide(image, normals);
    }
}

/// Returns the 3 × 3 block of two nodes of K̂.
pub fn block(stiffness: &[f64], nodes: usize, row: usize, column: usize) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| stiffness[(3 * column + j) * 3 * nodes + 3 * row + i])
}

/// Computes E K̂ u of tetrahedra, column by column.
fn plain_product<const N: usize>(list: &[Stiff<N>], u: &[Vector3<f64>], forces: &mut [f64]) {
    forces.par_chunks_mut(3 * N * ITEM).zip(list.par_chunks(ITEM)).for_each(|(forces, list)| {
        for ((nodes, stiffness, modulus), forces) in list.iter().zip(forces.chunks_exact_mut(3 * N)) {
            forces.fill(0.0);
            for (k, &node) in nodes.iter().enumerate() {
                for d in 0..3 {
                    let x = u[node as usize][d] * modulus;
                    let column = &stiffness[(3 * k + d) * 3 * N..][..3 * N];
                    forces.iter_mut().zip(column).for_each(|(force, entry)| *force += entry * x);
                }
            }
        }
    });
}

struct HexahedraProduct<'a, 'b> {
    list: &'a [Stiff<'b, 8>],
    u: &'a [Vector3<f64>],
    forces: &'a mut [[f64; COMPONENTS]],
}

impl WithSimd for HexahedraProduct<'_, '_> {
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
            // even and odd columns separately: their sums are independent
            let mut sums = [[simd.splat_f64s(0.0); COMPONENTS]; 2];
            for (pair, local) in condensed.chunks_exact(2 * COMPONENTS).zip(local.chunks_exact(2)) {
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

/// Computes a·b, in work items.
pub fn dot(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    sum(a.len(), |k| a[k].dot(&b[k]))
}

/// Gathers the displacements of an element's nodes.
pub(super) fn gather(nodes: &[u32], u: &[Vector3<f64>]) -> ElementVector {
    let mut local = ElementVector::zeros();
    for (k, &node) in nodes.iter().enumerate() {
        local.fixed_rows_mut::<3>(3 * k).copy_from(&u[node as usize]);
    }
    local
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// Product agrees with plain matrices for two hexahedra with four common nodes and tetrahedra on them,
    /// one component held.
    #[test]
    fn a_product_is_that_of_the_matrices() {
        let matrix =
            |n: usize| DMatrix::<f64>::from_fn(3 * n, 3 * n, |i, j| ((i * j + 3 * (i + j)) as f64).sin());
        let matrices = [8, 4, 10].map(matrix);
        let nodes: [&[u32]; 4] = [
            &[0, 1, 2, 3, 4, 5, 6, 7],
            &[4, 5, 6, 7, 8, 9, 10, 11],
            &[3, 1, 9, 5],
            &[0, 2, 4, 6, 8, 10, 1, 3, 5, 7],
        ];
        let list: Vec<(&[u32], &DMatrix<f64>, f64)> = vec![
            (nodes[3], &matrices[2], 0.3),
            (nodes[0], &matrices[0], 2.0),
            (nodes[2], &matrices[1], 1.5),
            (nodes[1], &matrices[0], 0.5),
        ];
        let mut free = vec![[true; 3]; 12];
        free[5][1] = false;
        let u: Vec<Vector3<f64>> = (0..12).map(|k| Vector3::new(1.0, f64::from(k), -0.3)).collect();
        let mut expected = vec![Vector3::zeros(); 12];
        for (nodes, matrix, modulus) in &list {
            let local = DVector::<f64>::from_fn(3 * nodes.len(), |k, _| u[nodes[k / 3] as usize][k % 3]);
            let forces = *matrix * local * *modulus;
            (0..forces.len()).for_each(|k| expected[nodes[k / 3] as usize][k % 3] += forces[k]);
        }
        expected[5][1] = 0.0;
        let mut image = vec![Vector3::zeros(); 12];
        let number: Vec<u32> = (0..12).collect();
        let plain = list.iter().map(|(nodes, matrix, modulus)| (*nodes, matrix.as_slice(), *modulus));
        let across = Vector3::new(0.6, 0.0, 0.8);
        slide(&mut expected, &[(7, across)]);
        Elements::new(plain, &number, free, vec![(7, across)]).product(&u, &mut image);
        // 30 products of order 10
        assert!(image.iter().zip(&expected).all(|(a, b)| (a - b).norm() < 1e-12), "{image:?}");
        assert_eq!(dot(&image, &u), image.iter().zip(&u).map(|(a, b)| a.dot(b)).sum::<f64>());
    }
}
