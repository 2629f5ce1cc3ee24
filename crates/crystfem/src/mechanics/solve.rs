//! One linear solution of a body: conjugate gradients without a matrix.

use super::body::Body;
use super::coarse::Coarse;
use super::product::{Elements, Load, block, dot};
use crate::error::Error;
use crate::system::vector::combine;
use nalgebra::{Matrix3, Vector3};

const NONE: u32 = u32::MAX;

/// Iterations at most, over the equations.
const ITERATIONS: usize = 20;

/// A load below this part of the forces that add up to it is their rounding.
const ROUNDING: f64 = 1e-14;

impl Body<'_> {
    /// Conjugate gradients with the inverse 3 × 3 blocks of the nodes and a coarse level of rigid motions, on the nodes that exist; adds
    /// its iterations to the state.
    ///
    /// # Errors
    /// [`Error::Parameter`] where they do not converge.
    pub(super) fn solve(
        &mut self,
        moduli: &[(usize, f64)],
        free: &[[bool; 3]],
        load: Load,
    ) -> Result<Vec<Vector3<f64>>, Error> {
        // number of each node among those that exist
        let mut number = vec![NONE; free.len()];
        for &node in moduli.iter().flat_map(|&(element, _)| self.nodes(element)) {
            number[node as usize] = 0;
        }
        let mut nodes = Vec::new();
        for (node, number) in number.iter_mut().enumerate().filter(|(_, number)| **number == 0) {
            *number = nodes.len() as u32;
            nodes.push(node);
        }
        let points: Vec<[f64; 3]> = nodes.iter().map(|&node| self.mesh.points[node]).collect();
        let stiff = moduli
            .iter()
            .map(|&(element, modulus)| (self.nodes(element), self.shape_of(element).condensed(), modulus));
        let mut elements = Elements::new(stiff, &number, nodes.iter().map(|&node| free[node]).collect());
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
            *block = block.try_inverse().unwrap_or_else(Matrix3::identity);
        }
        for (value, free) in residual.iter_mut().zip(free) {
            (0..3).filter(|&d| !free[d]).for_each(|d| value[d] = 0.0);
        }
        let goal = (self.tolerance * dot(&residual, &residual).sqrt()).max(ROUNDING * load.parts.sqrt());
        let spread = |moved: &[Vector3<f64>]| {
            let mut all = vec![Vector3::zeros(); number.len()];
            nodes.iter().zip(moved).for_each(|(&node, &moved)| all[node] = moved);
            all
        };
        let mut moved = vec![Vector3::zeros(); residual.len()];
        if dot(&residual, &residual).sqrt() <= goal {
            return Ok(spread(&moved));
        }
        let coarse = Coarse::new(&elements, &points);
        let precondition = |residual: &[Vector3<f64>], result: &mut [Vector3<f64>]| {
            combine(result, |k, _| blocks[k] * residual[k]);
            coarse.add(residual, result);
        };
        let mut conditioned = vec![Vector3::zeros(); residual.len()];
        precondition(&residual, &mut conditioned);
        let mut direction = conditioned.clone();
        let mut image = vec![Vector3::zeros(); residual.len()];
        let mut product = dot(&residual, &direction);
        let mut iterations = 0;
        let mut found = f64::INFINITY;
        for _ in 0..(ITERATIONS * 3 * residual.len()).max(100) {
            iterations += 1;
            elements.product(&direction, &mut image);
            let length = product / dot(&direction, &image);
            combine(&mut moved, |k, moved| moved + direction[k] * length);
            combine(&mut residual, |k, residual| residual - image[k] * length);
            found = dot(&residual, &residual).sqrt();
            if found <= goal {
                break;
            }
            precondition(&residual, &mut conditioned);
            let next = dot(&residual, &conditioned);
            combine(&mut direction, |k, direction| conditioned[k] + direction * (next / product));
            product = next;
        }
        let moved = spread(&moved);
        self.state.iterations += iterations;
        if found <= goal {
            return Ok(moved);
        }
        Err(Error::Parameter {
            name: "residual of the stresses",
            found,
            allowed: format!("at most {goal:e}: are all rigid motions held?"),
        })
    }
}
