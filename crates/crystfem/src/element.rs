//! First-order hexahedra (2 × 2 × 2 Gauss points), tetrahedra (4 points) and wedges (6 points), and
//! second-order elements ([`natural`]): shape functions, gradients, volumes, faces.
//!
//! In first-order elements integration point g is nearest to corner g. Lumped capacity counts energy at the
//! corner and conduction at the Gauss point beside it: each pair is one material point with one state.

mod face;
pub mod natural;

pub use face::FaceGeometry;
use meshfile::ElementShape;
use nalgebra::Matrix3;
use natural::QuadratureRule;
use polycore::numerics::hexahedron;
pub use polycore::numerics::hexahedron::CORNERS;

/// Maximum number of nodes, and of integration points, of a first-order element.
pub const FIRST_ORDER_NODES: usize = 8;
/// Maximum number of nodes of any element.
pub const MAX_ELEMENT_NODES: usize = 20;
/// Maximum number of integration points of any element.
pub const MAX_ELEMENT_POINTS: usize = 27;

/// 1/√3: the abscissa of the two-point Gauss rule.
const GAUSS: f64 = 0.577_350_269_189_625_8;
/// Four-point rule of a tetrahedron, exact to degree 2: one barycentric coordinate is NEAR, three are FAR.
const NEAR: f64 = 0.585_410_196_624_968_5;
const FAR: f64 = 0.138_196_601_125_010_5;

/// An element at its integration points.
#[derive(Clone, Debug)]
pub struct Geometry<const N: usize = FIRST_ORDER_NODES, const P: usize = FIRST_ORDER_NODES> {
    /// Number of nodes.
    pub nodes: usize,
    /// Number of integration points; equals the number of nodes in first-order elements.
    pub points: usize,
    /// Gauss weight times the Jacobian of each point, m³.
    pub weights: [f64; P],
    /// ∇N of each node at each point, 1/m: `gradients[point][node]`.
    pub gradients: [[[f64; 3]; N]; P],
    /// ∫ N dV of each node, m³.
    pub corner_volumes: [f64; N],
}

/// Number of integration points of an element with `nodes` nodes.
pub fn points(nodes: usize) -> usize {
    rule(nodes).map_or(nodes, |rule| rule.points)
}

/// Integration rule of wedges and second-order elements; `None` for 8-node hexahedra and 4-node tetrahedra.
fn rule(nodes: usize) -> Option<&'static QuadratureRule> {
    match nodes {
        8 | 4 => None,
        _ => ElementShape::with_nodes(nodes).map(QuadratureRule::for_shape),
    }
}

/// N of each node at each integration point: `shapes(nodes)[point][node]`.
pub fn shapes<const N: usize, const P: usize>(nodes: usize) -> [[f64; N]; P] {
    let mut shapes = [[0.0; N]; P];
    if let Some(rule) = rule(nodes) {
        for (shapes, natural) in shapes.iter_mut().zip(&rule.at) {
            shapes[..nodes].copy_from_slice(&natural.shapes[..nodes]);
        }
        return shapes;
    }
    for point in 0..nodes {
        if nodes == 8 {
            shapes[point][..8].copy_from_slice(&hexahedron::shapes(gauss(point)));
        } else {
            shapes[point][..nodes].fill(FAR);
            shapes[point][point] = NEAR;
        }
    }
    shapes
}

impl<const N: usize, const P: usize> Geometry<N, P> {
    /// Computes the geometry of an element from its nodes, at most `N`; `None` if a Jacobian is not positive
    /// (inverted, flat, folded).
    pub fn new(corners: &[[f64; 3]]) -> Option<Self> {
        let nodes = corners.len();
        let mut geometry = Self {
            nodes,
            points: points(nodes),
            weights: [0.0; P],
            gradients: [[[0.0; 3]; N]; P],
            corner_volumes: [0.0; N],
        };
        let shapes = shapes::<N, P>(nodes);
        let rule = rule(nodes);
        for point in 0..geometry.points {
            let mut natural = [[0.0; 3]; N];
            match rule {
                Some(rule) => natural[..nodes].copy_from_slice(&rule.at[point].gradients[..nodes]),
                None => natural_gradients(nodes, point, &mut natural),
            }
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
            let weight = match rule {
                Some(rule) => determinant * rule.weights[point],
                None if nodes == 8 => determinant,
                None => determinant / 24.0,
            };
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

    /// ∫ ∇N_a · k ∇N_b dV, W/K.
    pub fn conduction(&self, conductivity: &Matrix3<f64>) -> [[f64; N]; N] {
        let mut matrix = [[0.0; N]; N];
        for point in 0..self.points {
            self.add_conduction(point, conductivity, &mut matrix);
        }
        matrix
    }

    /// Adds the contribution of one integration point to [`Self::conduction`], for a symmetric conductivity.
    pub fn add_conduction(&self, point: usize, conductivity: &Matrix3<f64>, matrix: &mut [[f64; N]; N]) {
        let gradients = &self.gradients[point];
        for b in 0..self.nodes {
            let mut image = [0.0; 3];
            for d in 0..3 {
                for n in 0..3 {
                    image[d] += self.weights[point] * conductivity[(d, n)] * gradients[b][n];
                }
            }
            // both triangles get the same bits: the heat that leaves one node arrives at the other
            for a in 0..=b {
                let value = (0..3).map(|d| gradients[a][d] * image[d]).sum::<f64>();
                matrix[a][b] += value;
                if a < b {
                    matrix[b][a] += value;
                }
            }
        }
    }

    /// Adds [`Self::add_conduction`] with a factor on each column; the result is not symmetric.
    pub fn add_scaled_conduction(
        &self,
        point: usize,
        conductivity: &Matrix3<f64>,
        scale: &[f64],
        matrix: &mut [[f64; N]; N],
    ) {
        let mut own = [[0.0; N]; N];
        self.add_conduction(point, conductivity, &mut own);
        for (row, own) in matrix.iter_mut().zip(own) {
            for ((value, own), scale) in row.iter_mut().zip(own).zip(scale) {
                *value += own * scale;
            }
        }
    }

    /// ∫ N_a N_b dV, m³.
    pub fn mass(&self) -> [[f64; N]; N] {
        let shapes = shapes::<N, P>(self.nodes);
        let mut matrix = [[0.0; N]; N];
        for point in 0..self.points {
            for a in 0..self.nodes {
                for b in 0..self.nodes {
                    matrix[a][b] += self.weights[point] * shapes[point][a] * shapes[point][b];
                }
            }
        }
        matrix
    }
}

fn gauss(point: usize) -> [f64; 3] {
    CORNERS[point].map(|sign| GAUSS * sign)
}

/// ∂N/∂ξ of each node of an 8-node hexahedron or a 4-node tetrahedron at an integration point.
fn natural_gradients(nodes: usize, point: usize, gradients: &mut [[f64; 3]]) {
    if nodes == 8 {
        gradients[..8].copy_from_slice(&hexahedron::slopes(gauss(point)));
    } else {
        gradients[..4].copy_from_slice(&[[-1.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meshfile::HEXAHEDRON_SIDES;

    const BOX: [f64; 3] = [2.0, 3.0, 5.0];

    fn brick() -> [[f64; 3]; 8] {
        CORNERS.map(|c| [0, 1, 2].map(|d| 0.5 * (1.0 + c[d]) * BOX[d]))
    }

    /// A hexahedron with plane but unequal faces: volume of a frustum, and ∇ of a linear field.
    #[test]
    fn volumes_and_gradients() {
        let brick = <Geometry>::new(&brick()).unwrap();
        assert!((brick.volume() - 30.0).abs() < 1e-13);
        assert!(brick.corner_volumes.iter().all(|v| (v - 3.75).abs() < 1e-14));
        // top half as wide as the bottom: V = h (A + √(A a) + a)/3 = 2 (4 + 2 + 1)/3
        let frustum = CORNERS.map(|[x, y, z]| {
            let scale = if z > 0.0 { 0.5 } else { 1.0 };
            [x * scale, y * scale, z + 7.0]
        });
        let tetrahedron = [[0.0; 3], [1.0, 0.1, 0.0], [0.2, 1.0, 0.0], [0.0, 0.3, 1.0]];
        let frustum_geometry = <Geometry>::new(&frustum).unwrap();
        assert!((frustum_geometry.volume() - 14.0 / 3.0).abs() < 1e-13);
        let small = <Geometry>::new(&tetrahedron).unwrap();
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
        let cube = <Geometry>::new(&CORNERS.map(|c| c.map(|x| 0.5 * (1.0 + x)))).unwrap();
        let matrix = cube.conduction(&Matrix3::identity());
        for (b, expected) in [1.0 / 3.0, 0.0, -1.0 / 12.0, 0.0, 0.0, -1.0 / 12.0, -1.0 / 12.0, -1.0 / 12.0]
            .into_iter()
            .enumerate()
        {
            assert!((matrix[0][b] - expected).abs() < 1e-15, "{b}: {}", matrix[0][b]);
        }
        let mass = cube.mass();
        assert!((mass[0][0] - 1.0 / 27.0).abs() < 1e-16 && (mass[0][6] - 1.0 / 216.0).abs() < 1e-16);
        let corner = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let corner = <Geometry>::new(&corner).unwrap();
        let matrix = corner.conduction(&Matrix3::identity());
        assert!((matrix[0][0] - 0.5).abs() < 1e-15 && (matrix[0][1] + 1.0 / 6.0).abs() < 1e-15);
        // V/10 and V/20
        let mass = corner.mass();
        assert!((mass[0][0] - 1.0 / 60.0).abs() < 1e-15 && (mass[0][1] - 1.0 / 120.0).abs() < 1e-15);
    }

    #[test]
    fn faces_close_the_element() {
        let hexahedron = brick();
        let mut area = 0.0;
        for side in HEXAHEDRON_SIDES {
            let face = <FaceGeometry>::new(&side.map(|k| hexahedron[k]));
            assert!((face.corner_areas.iter().sum::<f64>() - face.area()).abs() < 1e-13);
            area += face.area();
        }
        assert!((area - 62.0).abs() < 1e-12);
        let triangle = <FaceGeometry>::new(&[[0.0; 3], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0]]);
        assert!((triangle.area() - 3.0).abs() < 1e-15 && (triangle.corner_areas[1] - 1.0).abs() < 1e-15);
    }

    #[test]
    fn inverted_and_flat_elements_are_refused() {
        let mut inside_out = brick();
        inside_out.swap(0, 4);
        assert!(<Geometry>::new(&inside_out).is_none());
        let flat = brick().map(|[x, y, _]| [x, y, 1.0]);
        assert!(<Geometry>::new(&flat).is_none());
        assert!(<Geometry>::new(&[[f64::NAN; 3]; 4]).is_none());
    }

    /// Sides of a second-order element close it, and a curved one has the volume of the divergence theorem.
    #[test]
    fn second_order_sides_close_the_element() {
        for shape in ElementShape::ALL {
            let corners: Vec<[f64; 3]> = (0..shape.corners()).map(|k| natural::corner(shape, k)).collect();
            let middle = |&[p, q]: &[usize; 2]| [0, 1, 2].map(|d| 0.5 * (corners[p][d] + corners[q][d]));
            let all = corners.iter().copied().chain(shape.edges().iter().map(middle));
            // quadratic in place: second-order elements represent it
            let curve = |[x, y, z]: [f64; 3]| match shape.is_second_order() {
                true => [x + 0.1 * y * z, y - 0.05 * x * x, z + 0.04 * x * y],
                false => [x + 0.3 * y, y + 0.1 * z, z],
            };
            let places: Vec<[f64; 3]> = all.take(shape.nodes()).map(curve).collect();
            let geometry = Geometry::<MAX_ELEMENT_NODES, MAX_ELEMENT_POINTS>::new(&places).unwrap();
            assert_eq!(geometry.points, points(shape.nodes()));
            let mass = geometry.mass();
            let volume = geometry.volume();
            assert!((mass.iter().flatten().sum::<f64>() / volume - 1.0).abs() < 1e-14, "{shape:?}");
            // ⅓ ∮ x·n dA by corner fans of many triangles
            let mut flux = 0.0;
            for side in 0..shape.side_count() {
                let ring = shape.side(side);
                let at = |r: f64, s: f64| {
                    let weights = match *ring {
                        [_, _, _] => vec![1.0 - r - s, r, s],
                        _ => vec![(1.0 - r) * (1.0 - s), r * (1.0 - s), r * s, (1.0 - r) * s],
                    };
                    let place = |d: usize| ring.iter().zip(&weights).map(|(&k, w)| w * corners[k][d]).sum();
                    let natural = natural::Natural::new(shape, [place(0), place(1), place(2)]);
                    nalgebra::Vector3::from(
                        [0, 1, 2].map(|d| {
                            (0..shape.nodes()).map(|a| natural.shapes[a] * places[a][d]).sum::<f64>()
                        }),
                    )
                };
                let n = 40;
                let step = 1.0 / f64::from(n);
                for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                    let (r, s) = (f64::from(i) * step, f64::from(j) * step);
                    let (a, b, c, d) = (at(r, s), at(r + step, s), at(r + step, s + step), at(r, s + step));
                    if ring.len() == 4 || i + j < n {
                        flux += a.cross(&b).dot(&d) / 6.0;
                    }
                    if ring.len() == 4 || i + j + 1 < n {
                        flux += b.cross(&c).dot(&d) / 6.0;
                    }
                }
            }
            // facets of a fortieth: (1/40)²
            assert!((flux / volume - 1.0).abs() < 1e-3, "{shape:?}: {flux} {volume}");
        }
        // 8-node and 6-node faces, flat and of quadratic shape
        let quad = [[0.0; 3], [2.0, 0.0, 0.0], [2.0, 3.0, 0.0], [0.0, 3.0, 0.0]];
        let middles = [[1.0, 0.0, 0.0], [2.0, 1.5, 0.0], [1.0, 3.0, 0.0], [0.0, 1.5, 0.0]];
        let face = FaceGeometry::<8, 9>::new(&[quad, middles].concat());
        assert!((face.area() - 6.0).abs() < 1e-14);
        // −A/12 and A/3
        assert!((face.corner_areas[0] + 0.5).abs() < 1e-14 && (face.corner_areas[4] - 2.0).abs() < 1e-14);
        let triangle = [quad[0], quad[1], quad[3], middles[0], [1.0, 1.5, 0.0], middles[3]];
        let face = FaceGeometry::<8, 9>::new(&triangle);
        assert!((face.area() - 3.0).abs() < 1e-14);
        assert!(face.corner_areas[0].abs() < 1e-14 && (face.corner_areas[3] - 1.0).abs() < 1e-14);
    }
}
