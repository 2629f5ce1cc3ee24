//! A body of solidifying Maxwell elements on a mesh of hexahedra: births, steps, supports.

use super::element::{Hexahedron, POINTS, Six};
use super::maxwell::Increment;
use crate::error::Error;
use crate::mesh::Mesh;
use nalgebra::{Matrix3, SVector, Vector3};

/// Residual over the load at which a solution ends, unless told otherwise.
const TOLERANCE: f64 = 1e-12;

/// Iterations at most, over the equations.
const ITERATIONS: usize = 20;

/// Elements, their state and displacements.
///
/// Strains of an element count from its birth: only increments of displacement enter, so that where shared nodes were
/// before does not matter.
pub struct Body<'a> {
    mesh: &'a Mesh,
    /// Elements of one shape share their matrices.
    shapes: Vec<Hexahedron>,
    shape: Vec<u32>,
    /// Residual over the load at which a solution ends.
    pub tolerance: f64,
    /// What changes.
    pub state: BodyState,
}

/// What a body needs to continue, bit by bit.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct BodyState {
    /// Elastic strains of the branches at each Gauss point, element by element; empty before birth.
    strains: Vec<Vec<[[f64; 6]; POINTS]>>,
    /// Σ E b s e at the Gauss points of each element at the end of the last step, Pa: the stress over Ĉ.
    stresses: Vec<[[f64; 6]; POINTS]>,
    /// Displacements of the nodes, m.
    pub displacement: Vec<[f64; 3]>,
    /// Iterations of conjugate gradients so far.
    pub iterations: u64,
}

/// A prescribed displacement increment of 0: node and component.
pub type Support = (u32, usize);

impl<'a> Body<'a> {
    /// A body without any element born.
    ///
    /// # Errors
    /// [`Error::Parameter`] for other elements than hexahedra of first order, for elements that are turned inside out, and for a Poisson's ratio outside −1 … 0.5.
    pub fn new(mesh: &'a Mesh, poisson: f64) -> Result<Self, Error> {
        let fault =
            |name, found: f64, allowed: &str| Error::Parameter { name, found, allowed: allowed.to_owned() };
        if !(poisson > -1.0 && poisson < 0.5) {
            return Err(fault("poisson", poisson, "above -1 and below 0.5"));
        }
        let others = mesh.element_count() - mesh.hexahedra.len();
        if others > 0 {
            return Err(fault("elements other than hexahedra", others as f64, "none"));
        }
        let (mut shapes, mut shape, mut known) = (Vec::new(), Vec::new(), std::collections::HashMap::new());
        for nodes in &mesh.hexahedra {
            let corners = nodes.map(|node| mesh.points[node as usize]);
            // edges to 1e-12 of the element's size tell shapes apart
            let size = (0..3).map(|d| (corners[6][d] - corners[0][d]).abs()).fold(0.0, f64::max);
            let key: Vec<i64> = corners
                .iter()
                .flat_map(|corner| (0..3).map(|d| ((corner[d] - corners[0][d]) / size * 1e12).round() as i64))
                .chain([(size * 1e15).round() as i64])
                .collect();
            let index = match known.get(&key) {
                Some(&index) => index,
                None => {
                    let element = Hexahedron::new(&corners, poisson);
                    let element =
                        element.ok_or_else(|| fault("volume of a hexahedron", f64::NAN, "above 0"))?;
                    shapes.push(element);
                    known.insert(key, shapes.len() as u32 - 1);
                    shapes.len() as u32 - 1
                }
            };
            shape.push(index);
        }
        let count = mesh.hexahedra.len();
        Ok(Self {
            mesh,
            shapes,
            shape,
            tolerance: TOLERANCE,
            state: BodyState {
                strains: vec![Vec::new(); count],
                stresses: vec![[[0.0; 6]; POINTS]; count],
                displacement: vec![[0.0; 3]; mesh.points.len()],
                iterations: 0,
            },
        })
    }

    /// Elements without stress and strain from now on.
    pub fn born(&mut self, elements: impl IntoIterator<Item = usize>, branches: usize) {
        for element in elements {
            self.state.strains[element] = vec![[[0.0; 6]; POINTS]; branches];
            self.state.stresses[element] = [[0.0; 6]; POINTS];
        }
    }

    /// Cauchy stress at a Gauss point, Pa: xx, yy, zz, xy, yz, zx.
    pub fn stress(&self, element: usize, point: usize) -> [f64; 6] {
        self.shapes[self.shape[element] as usize]
            .stress(&Six::from(self.state.stresses[element][point]))
            .into()
    }

    /// Mean of an element's stress by volume, Pa: of its Gauss points.
    pub fn mean_stress(&self, element: usize) -> [f64; 6] {
        let weights = &self.shapes[self.shape[element] as usize].weights;
        let volume: f64 = weights.iter().sum();
        let points = (0..POINTS).map(|point| (self.stress(element, point), weights[point] / volume));
        points.fold([0.0; 6], |sum, (stress, share)| std::array::from_fn(|k| sum[k] + share * stress[k]))
    }

    /// The corners of an element at rest.
    fn corners(&self, element: usize) -> [[f64; 3]; 8] {
        self.mesh.hexahedra[element].map(|node| self.mesh.points[node as usize])
    }

    /// One step of all elements that are born: `increment` of an element, and its linear free strain at a Gauss point and its place (at the Gauss points: taken at the
    /// centre alone, it would leave stresses in a body that bends freely). One linear solution.
    ///
    /// # Errors
    /// [`Error::Parameter`] where conjugate gradients do not converge: the supports leave a rigid motion that the loads drive.
    pub fn step(
        &mut self,
        increment: impl Fn(usize) -> Increment,
        free_strain: impl Fn(usize, usize, [f64; 3]) -> f64,
        supports: &[Support],
    ) -> Result<(), Error> {
        let alive: Vec<usize> = (0..self.state.strains.len())
            .filter(|&element| !self.state.strains[element].is_empty())
            .collect();
        let mut free = vec![[false; 3]; self.state.displacement.len()];
        for &element in &alive {
            self.mesh.hexahedra[element].iter().for_each(|&node| free[node as usize] = [true; 3]);
        }
        supports.iter().for_each(|&(node, component)| free[node as usize][component] = false);
        let mut load = vec![Vector3::zeros(); self.state.displacement.len()];
        let mut steps = Vec::with_capacity(alive.len());
        for &element in &alive {
            let (shape, increment) = (&self.shapes[self.shape[element] as usize], increment(element));
            let corners = self.corners(element);
            let free: [f64; POINTS] =
                std::array::from_fn(|point| free_strain(element, point, Hexahedron::place(&corners, point)));
            // the stress of a step without displacement
            let predicted: [Six; POINTS] = std::array::from_fn(|point| {
                let mut strains: Vec<[f64; 6]> =
                    self.state.strains[element].iter().map(|branch| branch[point]).collect();
                let mechanical = mechanical(&Six::zeros(), free[point]);
                increment.advance(&mut strains, &mechanical);
                let floor = Six::from(mechanical) * increment.floor;
                shape.stress(&(Six::from(increment.stress(&strains)) + floor))
            });
            let (forces, modal) = shape.forces(&predicted);
            for (k, &node) in self.mesh.hexahedra[element].iter().enumerate() {
                load[node as usize] -= Vector3::from(forces.fixed_rows::<3>(3 * k));
            }
            steps.push((element, increment, free, modal));
        }
        let moduli: Vec<(usize, f64)> =
            steps.iter().map(|(element, increment, ..)| (*element, increment.stiffness)).collect();
        let moved = self.solve(&moduli, &free, load)?;
        for (element, increment, free, modal) in steps {
            let shape = &self.shapes[self.shape[element] as usize];
            let local = gather(&self.mesh.hexahedra[element], &moved);
            let strains = shape.strains(&local, &modal, increment.stiffness);
            for point in 0..POINTS {
                let mechanical = mechanical(&strains[point], free[point]);
                let mut branches: Vec<[f64; 6]> =
                    self.state.strains[element].iter().map(|branch| branch[point]).collect();
                increment.advance(&mut branches, &mechanical);
                self.state.stresses[element][point] = increment.stress(&branches);
                self.state.strains[element]
                    .iter_mut()
                    .zip(branches)
                    .for_each(|(branch, strain)| branch[point] = strain);
            }
        }
        for (place, moved) in self.state.displacement.iter_mut().zip(&moved) {
            (0..3).for_each(|d| place[d] += moved[d]);
        }
        Ok(())
    }

    /// Σ E K̂ u of elements with moduli E, on free components.
    fn product(&self, moduli: &[(usize, f64)], free: &[[bool; 3]], u: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let mut result = vec![Vector3::zeros(); u.len()];
        for &(element, modulus) in moduli {
            let nodes = &self.mesh.hexahedra[element];
            let forces = self.shapes[self.shape[element] as usize].condensed * gather(nodes, u) * modulus;
            for (k, &node) in nodes.iter().enumerate() {
                result[node as usize] += Vector3::from(forces.fixed_rows::<3>(3 * k));
            }
        }
        keep(&mut result, free);
        result
    }

    /// Conjugate gradients with the inverse 3 × 3 blocks of the nodes.
    fn solve(
        &mut self,
        moduli: &[(usize, f64)],
        free: &[[bool; 3]],
        mut residual: Vec<Vector3<f64>>,
    ) -> Result<Vec<Vector3<f64>>, Error> {
        let mut blocks = vec![Matrix3::zeros(); residual.len()];
        for &(element, modulus) in moduli {
            let condensed = &self.shapes[self.shape[element] as usize].condensed;
            for (k, &node) in self.mesh.hexahedra[element].iter().enumerate() {
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
        let goal = self.tolerance * dot(&residual, &residual).sqrt();
        let mut moved = vec![Vector3::zeros(); residual.len()];
        let precondition = |residual: &[Vector3<f64>]| -> Vec<Vector3<f64>> {
            blocks.iter().zip(residual).map(|(block, r)| block * r).collect()
        };
        let mut direction = precondition(&residual);
        let mut product = dot(&residual, &direction);
        for _ in 0..(ITERATIONS * 3 * residual.len()).max(100) {
            if dot(&residual, &residual).sqrt() <= goal {
                return Ok(moved);
            }
            self.state.iterations += 1;
            let image = self.product(moduli, free, &direction);
            let length = product / dot(&direction, &image);
            for k in 0..moved.len() {
                moved[k] += direction[k] * length;
                residual[k] -= image[k] * length;
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

fn gather(nodes: &[u32; 8], u: &[Vector3<f64>]) -> SVector<f64, 24> {
    SVector::from_fn(|k, _| u[nodes[k / 3] as usize][k % 3])
}

/// 0 where a component is not free.
fn keep(field: &mut [Vector3<f64>], free: &[[bool; 3]]) {
    for (value, free) in field.iter_mut().zip(free) {
        (0..3).filter(|&d| !free[d]).for_each(|d| value[d] = 0.0);
    }
}

/// Δε − Δε* 1.
fn mechanical(strain: &Six, free: f64) -> [f64; 6] {
    std::array::from_fn(|k| strain[k] - if k < 3 { free } else { 0.0 })
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
