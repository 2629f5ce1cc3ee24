//! Linear solution of a body by matrix-free conjugate gradients.

use super::body::{Body, slide};
use super::coarse::CoarseMotions;
use super::product::{Elements, NodalLoad, block, dot};
use crate::error::Error;
use crate::system::vector::combine;
use nalgebra::{Matrix3, Vector3};
use polycore::numerics::conjugate_gradients;

const NONE: u32 = u32::MAX;

/// Limit on iterations, per equation.
const MAX_ITERATIONS_PER_EQUATION: usize = 20;

/// Relative size of a load, over its contributions, that is rounding.
pub(super) const ROUNDING_RATIO: f64 = 1e-14;

impl Body<'_> {
    /// Solves to a relative residual by conjugate gradients with the inverse 3 × 3 blocks of the nodes and a
    /// coarse level of rigid motions, on the existing nodes; adds its iterations to the state. `moduli` has
    /// the existing elements, each with its tangent (default: K̂) and a factor on it.
    ///
    /// # Errors
    /// [`Error::Parameter`] without convergence.
    pub(super) fn solve(
        &mut self,
        moduli: &[(usize, Option<&[f64]>, f64)],
        free: &[[bool; 3]],
        load: &NodalLoad,
        tolerance: f64,
    ) -> Result<Vec<Vector3<f64>>, Error> {
        // index of each node among the existing ones
        let mut number = vec![NONE; free.len()];
        for &node in moduli.iter().flat_map(|&(element, ..)| self.nodes(element)) {
            number[node as usize] = 0;
        }
        let mut nodes = Vec::new();
        for (node, number) in number.iter_mut().enumerate().filter(|(_, number)| **number == 0) {
            *number = nodes.len() as u32;
            nodes.push(node);
        }
        let points: Vec<[f64; 3]> = nodes.iter().map(|&node| self.mesh.points[node]).collect();
        let stiff = moduli.iter().map(|&(element, tangent, modulus)| {
            let stiffness = tangent.unwrap_or_else(|| self.shape_of(element).condensed());
            (self.nodes(element), stiffness, modulus)
        });
        let normals = self.normals(free).into_iter().map(|(node, normal)| (number[node] as usize, normal));
        let own_free = nodes.iter().map(|&node| free[node]).collect();
        let mut elements = Elements::new(stiff, &number, own_free, normals.collect());
        let free = elements.free();
        let mut residual: Vec<Vector3<f64>> = nodes.iter().map(|&node| load.sum[node]).collect();
        let mut blocks = vec![Matrix3::zeros(); residual.len()];
        for (nodes, condensed, modulus) in elements.each() {
            for (k, &node) in nodes.iter().enumerate() {
                blocks[node as usize] += block(condensed, nodes.len(), k, k) * modulus;
            }
        }
        for (block, free) in blocks.iter_mut().zip(free) {
            for d in (0..3).filter(|&d| !free[d]) {
                block.row_mut(d).fill(0.0);
                block.column_mut(d).fill(0.0);
                block[(d, d)] = 1.0;
            }
        }
        for (node, normal) in elements.normals() {
            let within = Matrix3::identity() - normal * normal.transpose();
            blocks[*node] = within * blocks[*node] * within + normal * normal.transpose();
        }
        for block in &mut blocks {
            *block = block.try_inverse().unwrap_or_else(Matrix3::identity);
        }
        for (value, free) in residual.iter_mut().zip(free) {
            (0..3).filter(|&d| !free[d]).for_each(|d| value[d] = 0.0);
        }
        slide(&mut residual, elements.normals());
        let goal = (tolerance * dot(&residual, &residual).sqrt()).max(ROUNDING_RATIO * load.parts.sqrt());
        if dot(&residual, &residual).sqrt() <= goal {
            return Ok(vec![Vector3::zeros(); number.len()]);
        }
        let coarse = CoarseMotions::new(&elements, &points);
        let normals = elements.normals().to_vec();
        let precondition = |residual: &[Vector3<f64>], result: &mut [Vector3<f64>]| {
            combine(result, |k, _| blocks[k] * residual[k]);
            coarse.add(residual, result);
            slide(result, &normals);
        };
        let most = (MAX_ITERATIONS_PER_EQUATION * 3 * residual.len()).max(100);
        let reached = |residual: &[Vector3<f64>]| dot(residual, residual).sqrt() <= goal;
        let product = |u: &[Vector3<f64>], image: &mut [Vector3<f64>]| elements.product(u, image);
        let (moved, iterations) =
            conjugate_gradients(&mut residual, most, reached, product, precondition, dot);
        self.state.iterations += iterations as u64;
        let found = dot(&residual, &residual).sqrt();
        if found <= goal {
            let mut all = vec![Vector3::zeros(); number.len()];
            nodes.iter().zip(&moved).for_each(|(&node, &moved)| all[node] = moved);
            return Ok(all);
        }
        Err(Error::Parameter {
            name: "residual of the stresses",
            found,
            allowed: format!("at most {goal:e}: are all rigid motions held?"),
        })
    }
}
