//! Linear hexahedra (2 × 2 × 2 Gauss points) and tetrahedra (4 points): shapes, gradients, volumes, faces.
//!
//! Integration point g lies nearest to corner g, in both elements. With lumped capacity, energy is counted at the
//! corner and conduction at the Gauss point beside it, so each pair is one material point with one state.

use crate::mesh::Mesh;
use nalgebra::Matrix3;

/// Nodes of an element at most.
pub const MOST: usize = 8;

/// Corners of a hexahedron in natural coordinates, in the order of Abaqus and VTK.
pub const CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

/// 1/√3: the abscissa of the two-point Gauss rule.
const GAUSS: f64 = 0.577_350_269_189_625_8;
/// The four-point rule of a tetrahedron, exact to degree 2: one barycentric coordinate is NEAR, three are FAR.
const NEAR: f64 = 0.585_410_196_624_968_5;
const FAR: f64 = 0.138_196_601_125_010_5;

/// Positions of the nodes of an element; the first 4 or 8 are set.
pub fn corners(mesh: &Mesh, element: u32) -> ([[f64; 3]; MOST], usize) {
    let nodes = mesh.nodes(element);
    let mut corners = [[0.0; 3]; MOST];
    for (corner, &node) in corners.iter_mut().zip(nodes) {
        *corner = mesh.points[node as usize];
    }
    (corners, nodes.len())
}

/// An element at its integration points.
#[derive(Clone, Debug)]
pub struct Geometry {
    /// Nodes, and integration points: 8 or 4.
    pub nodes: usize,
    /// Gauss weight times the Jacobian of each point, m³.
    pub weights: [f64; MOST],
    /// ∇N of each node at each point, 1/m: `gradients[point][node]`.
    pub gradients: [[[f64; 3]; MOST]; MOST],
    /// ∫ N dV of each node, m³.
    pub corner_volumes: [f64; MOST],
}

/// N of each node at each integration point: `shapes(nodes)[point][node]`.
pub fn shapes(nodes: usize) -> [[f64; MOST]; MOST] {
    let mut shapes = [[0.0; MOST]; MOST];
    for point in 0..nodes {
        for node in 0..nodes {
            shapes[point][node] = if nodes == 8 {
                (0..3).map(|d| 0.5 * (1.0 + GAUSS * CORNERS[point][d] * CORNERS[node][d])).product()
            } else if point == node {
                NEAR
            } else {
                FAR
            };
        }
    }
    shapes
}

impl Geometry {
    /// Of the element with these corners; `None` where a Jacobian is not positive (inverted, flat, folded).
    pub fn new(corners: &[[f64; 3]]) -> Option<Self> {
        let nodes = corners.len();
        let mut geometry = Self {
            nodes,
            weights: [0.0; MOST],
            gradients: [[[0.0; 3]; MOST]; MOST],
            corner_volumes: [0.0; MOST],
        };
        let shapes = shapes(nodes);
        for point in 0..nodes {
            let mut natural = [[0.0; 3]; MOST];
            natural_gradients(nodes, point, &mut natural);
            // relative to the first corner: no cancellation far from the origin
            let mut jacobian = Matrix3::<f64>::zeros();
            for node in 1..nodes {
                for d in 0..3 {
                    let offset = corners[node][d] - corners[0][d];
                    for n in 0..3 {
                        jacobian[(d, n)] += offset * natural[node][n];
                    }
                }
            }
            let determinant = jacobian.determinant();
            if determinant.is_nan() || determinant <= 0.0 {
                return None;
            }
            let inverse = jacobian.try_inverse()?;
            let weight = if nodes == 8 { determinant } else { determinant / 24.0 };
            geometry.weights[point] = weight;
            for node in 0..nodes {
                for d in 0..3 {
                    geometry.gradients[point][node][d] =
                        (0..3).map(|n| natural[node][n] * inverse[(n, d)]).sum();
                }
                geometry.corner_volumes[node] += weight * shapes[point][node];
            }
        }
        geometry.weights.iter().all(|w| w.is_finite()).then_some(geometry)
    }

    /// Volume, m³.
    #[cfg(test)]
    pub fn volume(&self) -> f64 {
        self.weights.iter().sum()
    }

    /// ∫ ∇N_a · k ∇N_b dV, W/K: row `a` at `8a`.
    pub fn conduction(&self, conductivity: &Matrix3<f64>) -> [f64; 64] {
        let mut matrix = [0.0; 64];
        for point in 0..self.nodes {
            self.add_conduction(point, conductivity, &mut matrix);
        }
        matrix
    }

    /// Adds one integration point's part of [`Self::conduction`], for a symmetric conductivity.
    pub fn add_conduction(&self, point: usize, conductivity: &Matrix3<f64>, matrix: &mut [f64; 64]) {
        let gradients = &self.gradients[point];
        for b in 0..self.nodes {
            let mut image = [0.0; 3];
            for d in 0..3 {
                for n in 0..3 {
                    image[d] += self.weights[point] * conductivity[(d, n)] * gradients[b][n];
                }
            }
            // both triangles get the same bits: heat that leaves one node for another arrives there
            for a in 0..=b {
                let value = (0..3).map(|d| gradients[a][d] * image[d]).sum::<f64>();
                matrix[8 * a + b] += value;
                if a < b {
                    matrix[8 * b + a] += value;
                }
            }
        }
    }

    /// The same with a factor on each column: the result is not symmetric.
    pub fn add_scaled_conduction(
        &self,
        point: usize,
        conductivity: &Matrix3<f64>,
        scale: &[f64],
        matrix: &mut [f64; 64],
    ) {
        let mut own = [0.0; 64];
        self.add_conduction(point, conductivity, &mut own);
        for (at, (value, own)) in matrix.iter_mut().zip(own).enumerate() {
            *value += own * scale[at % 8];
        }
    }

    /// ∫ N_a N_b dV, m³.
    pub fn mass(&self) -> [f64; 64] {
        let shapes = shapes(self.nodes);
        let mut matrix = [0.0; 64];
        for point in 0..self.nodes {
            for a in 0..self.nodes {
                for b in 0..self.nodes {
                    matrix[8 * a + b] += self.weights[point] * shapes[point][a] * shapes[point][b];
                }
            }
        }
        matrix
    }
}

/// ∂N/∂ξ of each node at an integration point.
fn natural_gradients(nodes: usize, point: usize, gradients: &mut [[f64; 3]; MOST]) {
    if nodes == 8 {
        for (gradient, corner) in gradients.iter_mut().zip(&CORNERS) {
            let factor = |d: usize| 0.5 * (1.0 + GAUSS * CORNERS[point][d] * corner[d]);
            *gradient = [
                0.5 * corner[0] * factor(1) * factor(2),
                0.5 * corner[1] * factor(0) * factor(2),
                0.5 * corner[2] * factor(0) * factor(1),
            ];
        }
    } else {
        gradients[..4].copy_from_slice(&[[-1.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    }
}

/// A face at its integration points: 2 × 2 Gauss points, or three on a triangle.
#[derive(Clone, Debug)]
pub struct FaceGeometry {
    /// Nodes, and integration points: 4 or 3.
    pub nodes: usize,
    /// Gauss weight times the area of each point, m².
    pub weights: [f64; 4],
    /// N of each node at each point.
    pub shapes: [[f64; 4]; 4],
    /// ∫ N dA of each node, m².
    pub corner_areas: [f64; 4],
}

impl FaceGeometry {
    /// Of a face with these corners, in order around it.
    pub fn new(corners: &[[f64; 3]]) -> Self {
        let nodes = corners.len().min(4);
        let mut face = Self { nodes, weights: [0.0; 4], shapes: [[0.0; 4]; 4], corner_areas: [0.0; 4] };
        const AROUND: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        for point in 0..nodes {
            let mut tangents = [[0.0; 3]; 2];
            for node in 0..nodes {
                let natural = if nodes == 4 {
                    let factor = |d: usize| 0.5 * (1.0 + GAUSS * AROUND[point][d] * AROUND[node][d]);
                    face.shapes[point][node] = factor(0) * factor(1);
                    [0.5 * AROUND[node][0] * factor(1), 0.5 * AROUND[node][1] * factor(0)]
                } else {
                    face.shapes[point][node] = if point == node { 2.0 / 3.0 } else { 1.0 / 6.0 };
                    [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]][node]
                };
                for n in 0..2 {
                    for d in 0..3 {
                        tangents[n][d] += (corners[node][d] - corners[0][d]) * natural[n];
                    }
                }
            }
            let [s, t] = tangents;
            let normal = [s[1] * t[2] - s[2] * t[1], s[2] * t[0] - s[0] * t[2], s[0] * t[1] - s[1] * t[0]];
            let area = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
            face.weights[point] = if nodes == 4 { area } else { area / 6.0 };
            for node in 0..nodes {
                face.corner_areas[node] += face.weights[point] * face.shapes[point][node];
            }
        }
        face
    }

    /// Area, m².
    #[cfg(test)]
    pub fn area(&self) -> f64 {
        self.weights.iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::HEXAHEDRON_SIDES;

    const BOX: [f64; 3] = [2.0, 3.0, 5.0];

    fn brick() -> [[f64; 3]; 8] {
        CORNERS.map(|c| [0, 1, 2].map(|d| 0.5 * (1.0 + c[d]) * BOX[d]))
    }

    /// A hexahedron with plane but unequal faces: volume of a frustum, and ∇ of a linear field.
    #[test]
    fn volumes_and_gradients() {
        let brick = Geometry::new(&brick()).unwrap();
        assert!((brick.volume() - 30.0).abs() < 1e-13);
        assert!(brick.corner_volumes.iter().all(|v| (v - 3.75).abs() < 1e-14));
        // top half as wide as the bottom: V = h (A + √(A a) + a)/3 = 2 (4 + 2 + 1)/3
        let frustum = CORNERS.map(|[x, y, z]| {
            let scale = if z > 0.0 { 0.5 } else { 1.0 };
            [x * scale, y * scale, z + 7.0]
        });
        let tetrahedron = [[0.0; 3], [1.0, 0.1, 0.0], [0.2, 1.0, 0.0], [0.0, 0.3, 1.0]];
        let frustum_geometry = Geometry::new(&frustum).unwrap();
        assert!((frustum_geometry.volume() - 14.0 / 3.0).abs() < 1e-13);
        let small = Geometry::new(&tetrahedron).unwrap();
        // det/6 of the edges: (1·1 − 0.1·0.2)·1/6
        assert!((small.volume() - 0.98 / 6.0).abs() < 1e-15);
        for (corners, geometry) in [(&frustum[..], &frustum_geometry), (&tetrahedron[..], &small)] {
            for point in 0..geometry.nodes {
                for d in 0..3 {
                    let slope: f64 = (0..geometry.nodes)
                        .map(|a| {
                            let [x, y, z] = corners[a];
                            (1.0 + 2.0 * x - 3.0 * y + 4.0 * z) * geometry.gradients[point][a][d]
                        })
                        .sum();
                    assert!((slope - [2.0, -3.0, 4.0][d]).abs() < 1e-12, "{slope}");
                }
            }
        }
    }

    /// ∫ ∇N·∇N of the unit cube: 1/3 on the diagonal, 0 along edges, −1/12 across faces and through the body
    /// (Zienkiewicz & Taylor); of the corner tetrahedron: 1/2, −1/6.
    #[test]
    fn matrices_of_unit_elements() {
        let cube = Geometry::new(&CORNERS.map(|c| c.map(|x| 0.5 * (1.0 + x)))).unwrap();
        let matrix = cube.conduction(&Matrix3::identity());
        for (b, expected) in [1.0 / 3.0, 0.0, -1.0 / 12.0, 0.0, 0.0, -1.0 / 12.0, -1.0 / 12.0, -1.0 / 12.0]
            .into_iter()
            .enumerate()
        {
            assert!((matrix[b] - expected).abs() < 1e-15, "{b}: {}", matrix[b]);
        }
        let mass = cube.mass();
        assert!((mass[0] - 1.0 / 27.0).abs() < 1e-16 && (mass[6] - 1.0 / 216.0).abs() < 1e-16);
        let corner = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let corner = Geometry::new(&corner).unwrap();
        let matrix = corner.conduction(&Matrix3::identity());
        assert!((matrix[0] - 0.5).abs() < 1e-15 && (matrix[1] + 1.0 / 6.0).abs() < 1e-15);
        // V/10 and V/20
        let mass = corner.mass();
        assert!((mass[0] - 1.0 / 60.0).abs() < 1e-15 && (mass[1] - 1.0 / 120.0).abs() < 1e-15);
    }

    #[test]
    fn faces_close_the_element() {
        let hexahedron = brick();
        let mut area = 0.0;
        for side in HEXAHEDRON_SIDES {
            let face = FaceGeometry::new(&side.map(|k| hexahedron[k]));
            assert!((face.corner_areas.iter().sum::<f64>() - face.area()).abs() < 1e-13);
            area += face.area();
        }
        assert!((area - 62.0).abs() < 1e-12);
        let triangle = FaceGeometry::new(&[[0.0; 3], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0]]);
        assert!((triangle.area() - 3.0).abs() < 1e-15 && (triangle.corner_areas[1] - 1.0).abs() < 1e-15);
    }

    #[test]
    fn inverted_and_flat_elements_are_refused() {
        let mut inside_out = brick();
        inside_out.swap(0, 4);
        assert!(Geometry::new(&inside_out).is_none());
        let flat = brick().map(|[x, y, _]| [x, y, 1.0]);
        assert!(Geometry::new(&flat).is_none());
        assert!(Geometry::new(&[[f64::NAN; 3]; 4]).is_none());
    }
}
