//! First- and second-order tetrahedra, of modulus 1.

use super::element::{ElementVector, GAUSS_POINTS, VoigtVector, stiffness, strain_of};
use crate::element::natural::Natural;
use crate::mesh::ElementShape;
use nalgebra::{Matrix3, SMatrix, Vector3};

/// Four-point rule, exact to degree 2: one barycentric coordinate is NEAR, three are FAR.
const NEAR: f64 = 0.585_410_196_624_968_5;
const FAR: f64 = 0.138_196_601_125_010_5;

/// A tetrahedron of 4 nodes with one Gauss point, or of 10 with four. Free strains at four points are a
/// linear function, which second-order strains contain; the constant first-order strain takes the mean.
#[derive(Clone, Debug)]
pub struct Tetrahedron {
    nodes: usize,
    points: usize,
    /// Volumes of the Gauss points, m³.
    pub weights: [f64; 4],
    /// Gradients of the shape functions at each Gauss point, 1/m.
    gradients: Vec<[f64; 3]>,
    /// Gradients of the shape functions at the centre, 1/m.
    middle: Vec<[f64; 3]>,
    /// Stiffness K̂ over the modulus, column by column.
    pub stiffness: Vec<f64>,
    elastic: SMatrix<f64, 6, 6>,
}

/// Natural coordinates of a Gauss point.
fn gauss(nodes: usize, point: usize) -> [f64; 3] {
    // corner 0 has the remainder of the three others
    [1, 2, 3].map(|corner| match (nodes, corner == point) {
        (4, _) => 0.25,
        (_, true) => NEAR,
        _ => FAR,
    })
}

fn shape(nodes: usize) -> ElementShape {
    if nodes == 4 { ElementShape::Tetrahedron } else { ElementShape::Tetrahedron10 }
}

impl Tetrahedron {
    /// Computes an element of 4 or 10 nodes, m; `None` if inverted at a Gauss point.
    pub fn new(places: &[[f64; 3]], poisson: f64) -> Option<Self> {
        let (nodes, points) = (places.len(), if places.len() == 4 { 1 } else { 4 });
        let elastic = stiffness(poisson);
        let (mut weights, mut gradients) = ([0.0; 4], Vec::with_capacity(points * nodes));
        for (point, weight) in weights.iter_mut().enumerate().take(points) {
            let (own, volume) = derivatives(places, gauss(nodes, point))?;
            *weight = volume / (6 * points) as f64;
            gradients.extend(own);
        }
        let middle = derivatives(places, [0.25; 3])?.0;
        let stiffness = assemble(nodes, &gradients, weights, |_| elastic);
        Some(Self { nodes, points, weights, gradients, middle, stiffness, elastic })
    }

    /// Stiffness of moduli at the Gauss points, column by column.
    pub(super) fn tangent(&self, moduli: &[SMatrix<f64, 6, 6>; GAUSS_POINTS]) -> Vec<f64> {
        assemble(self.nodes, &self.gradients, self.weights, |point| moduli[point])
    }

    /// Stress over the modulus, from an elastic strain.
    pub fn stress(&self, strain: &VoigtVector) -> VoigtVector {
        self.elastic * strain
    }

    /// Nodal forces of stresses at the Gauss points.
    pub fn forces(&self, stresses: &[VoigtVector; GAUSS_POINTS]) -> ElementVector {
        let mut forces = ElementVector::zeros();
        for (point, own) in self.gradients.chunks_exact(self.nodes).enumerate() {
            let weighed = stresses[point] * self.weights[point];
            for (node, gradient) in own.iter().enumerate() {
                let force = strain_of(*gradient).transpose() * weighed;
                (0..3).for_each(|d| forces[3 * node + d] += force[d]);
            }
        }
        forces
    }

    /// Strains at the Gauss points from nodal displacements, 0 beyond them.
    pub fn strains(&self, displacement: &ElementVector) -> [VoigtVector; GAUSS_POINTS] {
        let mut strains = [VoigtVector::zeros(); GAUSS_POINTS];
        for (strain, own) in strains.iter_mut().zip(self.gradients.chunks_exact(self.nodes)) {
            for (node, gradient) in own.iter().enumerate() {
                *strain += strain_of(*gradient) * displacement.fixed_rows::<3>(3 * node);
            }
        }
        strains
    }

    /// Rotation at the centre by nodal displacements, half their curl, rad.
    pub fn rotation(&self, displacement: &ElementVector) -> [f64; 3] {
        let parts = self.middle.iter().enumerate();
        let sum = parts.fold(Vector3::zeros(), |sum: Vector3<f64>, (node, gradient)| {
            sum + Vector3::from(*gradient).cross(&displacement.fixed_rows::<3>(3 * node)) * 0.5
        });
        sum.into()
    }

    /// Number of Gauss points.
    pub fn points(&self) -> usize {
        self.points
    }
}

/// Σ w Bᵀ C B over the Gauss points, column by column.
fn assemble(
    nodes: usize,
    gradients: &[[f64; 3]],
    weights: [f64; 4],
    modulus: impl Fn(usize) -> SMatrix<f64, 6, 6>,
) -> Vec<f64> {
    let mut stiffness = vec![0.0; 9 * nodes * nodes];
    for (point, (own, weight)) in gradients.chunks_exact(nodes).zip(weights).enumerate() {
        let strains: Vec<SMatrix<f64, 6, 3>> = own.iter().map(|gradient| strain_of(*gradient)).collect();
        for (column, strain) in strains.iter().enumerate() {
            let stress = modulus(point) * strain * weight;
            for (row, other) in strains.iter().enumerate() {
                let block = other.transpose() * stress;
                for j in 0..3 {
                    for i in 0..3 {
                        stiffness[(3 * column + j) * 3 * nodes + 3 * row + i] += block[(i, j)];
                    }
                }
            }
        }
    }
    stiffness
}

/// Shape functions at a Gauss point.
pub fn shares(nodes: usize, point: usize) -> [f64; 10] {
    let all = Natural::new(shape(nodes), gauss(nodes, point)).shapes;
    std::array::from_fn(|node| all[node])
}

/// Gradients of the shape functions, 1/m, and det ∂x/∂ξ, m³; `None` unless that is positive.
fn derivatives(places: &[[f64; 3]], at: [f64; 3]) -> Option<(Vec<[f64; 3]>, f64)> {
    let natural = Natural::new(shape(places.len()), at);
    let own = natural.gradients.iter().zip(places);
    let jacobian = own.fold(Matrix3::zeros(), |sum: Matrix3<f64>, (local, place)| {
        sum + Vector3::from(*place) * Vector3::from(*local).transpose()
    });
    let volume = jacobian.determinant();
    let inverse = jacobian.try_inverse().filter(|_| volume > 0.0)?.transpose();
    let gradients =
        natural.gradients[..places.len()].iter().map(|local| (inverse * Vector3::from(*local)).into());
    Some((gradients.collect(), volume))
}
