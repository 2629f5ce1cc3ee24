//! One linear solution of a body: conjugate gradients without a matrix.

use super::body::Body;
use super::coarse::{Coarse, Stiff};
use crate::error::Error;
use nalgebra::{Matrix3, SVector, Vector3};

/// Iterations at most, over the equations.
const ITERATIONS: usize = 20;

/// A load below this part of the forces that add up to it is their rounding.
const ROUNDING: f64 = 1e-14;

/// Forces that add up to a load, node by node.
pub(super) struct Load {
    pub(super) sum: Vec<Vector3<f64>>,
    /// Sum of the squares of the parts.
    pub(super) parts: f64,
}

impl Body<'_> {
    fn stiff<'b>(&'b self, moduli: &'b [(usize, f64)]) -> impl Iterator<Item = Stiff<'b>> + Clone {
        moduli.iter().map(|&(element, modulus)| {
            (&self.mesh.hexahedra[element], &self.shape_of(element).condensed, modulus)
        })
    }

    /// Σ E K̂ u of elements with moduli E, on free components.
    fn product(&self, moduli: &[(usize, f64)], free: &[[bool; 3]], u: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let mut result = vec![Vector3::zeros(); u.len()];
        for (nodes, condensed, modulus) in self.stiff(moduli) {
            let forces = condensed * gather(nodes, u) * modulus;
            for (k, &node) in nodes.iter().enumerate() {
                result[node as usize] += Vector3::from(forces.fixed_rows::<3>(3 * k));
            }
        }
        keep(&mut result, free);
        result
    }

    /// Conjugate gradients with the inverse 3 × 3 blocks of the nodes and a coarse level of rigid motions; adds its iterations to the state.
    ///
    /// # Errors
    /// [`Error::Parameter`] where they do not converge.
    pub(super) fn solve(
        &mut self,
        moduli: &[(usize, f64)],
        free: &[[bool; 3]],
        load: Load,
    ) -> Result<Vec<Vector3<f64>>, Error> {
        let mut residual = load.sum;
        let mut blocks = vec![Matrix3::zeros(); residual.len()];
        for (nodes, condensed, modulus) in self.stiff(moduli) {
            for (k, &node) in nodes.iter().enumerate() {
                blocks[node as usize] += condensed.fixed_view::<3, 3>(3 * k, 3 * k) * modulus;
            }
        }
        for (block, free) in blocks.iter_mut().zip(free) {
            for d in (0..3).filter(|&d| !free[d]) {
                block.row_mut(d).fill(0.0);
                block.column_mut(d).fill(0.0);
                block[(d, d)] = 1.0;
            }
            *block = block.try_inverse().unwrap_or_else(Matrix3::identity);
        }
        keep(&mut residual, free);
        let dot =
            |a: &[Vector3<f64>], b: &[Vector3<f64>]| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>();
        let goal = (self.tolerance * dot(&residual, &residual).sqrt()).max(ROUNDING * load.parts.sqrt());
        let mut moved = vec![Vector3::zeros(); residual.len()];
        if dot(&residual, &residual).sqrt() <= goal {
            return Ok(moved);
        }
        let coarse = Coarse::new(self.stiff(moduli), &self.mesh.points, free);
        let precondition = |residual: &[Vector3<f64>]| -> Vec<Vector3<f64>> {
            let mut result: Vec<_> = blocks.iter().zip(residual).map(|(block, r)| block * r).collect();
            coarse.add(residual, &mut result);
            result
        };
        let mut direction = precondition(&residual);
        let mut product = dot(&residual, &direction);
        for _ in 0..(ITERATIONS * 3 * residual.len()).max(100) {
            self.state.iterations += 1;
            let image = self.product(moduli, free, &direction);
            let length = product / dot(&direction, &image);
            for k in 0..moved.len() {
                moved[k] += direction[k] * length;
                residual[k] -= image[k] * length;
            }
            if dot(&residual, &residual).sqrt() <= goal {
                return Ok(moved);
            }
            let conditioned = precondition(&residual);
            let next = dot(&residual, &conditioned);
            direction.iter_mut().zip(&conditioned).for_each(|(d, c)| *d = c + *d * (next / product));
            product = next;
        }
        let found = dot(&residual, &residual).sqrt();
        Err(Error::Parameter {
            name: "residual of the stresses",
            found,
            allowed: format!("at most {goal:e}: are all rigid motions held?"),
        })
    }
}

pub(super) fn gather(nodes: &[u32; 8], u: &[Vector3<f64>]) -> SVector<f64, 24> {
    SVector::from_fn(|k, _| u[nodes[k / 3] as usize][k % 3])
}

/// 0 where a component is not free.
fn keep(field: &mut [Vector3<f64>], free: &[[bool; 3]]) {
    for (value, free) in field.iter_mut().zip(free) {
        (0..3).filter(|&d| !free[d]).for_each(|d| value[d] = 0.0);
    }
}
