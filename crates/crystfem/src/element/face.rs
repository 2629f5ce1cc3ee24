//! Faces of elements at their integration points.

use super::{GAUSS, natural};
use meshfile::ElementShape;

/// A face at its integration points: 2 × 2 Gauss points or three on a triangle; 3 × 3 or six in second order.
#[derive(Clone, Debug)]
pub struct FaceGeometry<const N: usize = 4, const P: usize = 4> {
    /// Number of nodes.
    pub nodes: usize,
    /// Number of integration points.
    pub points: usize,
    /// Gauss weight times the area of each point, m².
    pub weights: [f64; P],
    /// N of each node at each point.
    pub shapes: [[f64; N]; P],
    /// ∫ N dA of each node, m².
    pub corner_areas: [f64; N],
}

/// Corners of a quadrilateral in natural coordinates, in order.
const QUADRILATERAL_CORNERS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

/// N and ∂N/∂ξ of a second-order triangle (r, s ≥ 0) or quadrilateral (−1 … 1), from the first side of a
/// solid element with such sides.
fn second_order_face(nodes: usize, [r, s]: [f64; 2]) -> [(f64, [f64; 2]); 8] {
    let (shape, at, order): (_, _, &[usize]) = match nodes {
        8 => (ElementShape::Hexahedron20, [r, s, -1.0], &[0, 1, 2, 3, 8, 9, 10, 11]),
        _ => (ElementShape::Wedge15, [r, s, -1.0], &[0, 1, 2, 6, 7, 8]),
    };
    let natural = natural::Natural::new(shape, at);
    let mut face = [(0.0, [0.0; 2]); 8];
    for (own, &node) in face.iter_mut().zip(order) {
        *own = (natural.shapes[node], [natural.gradients[node][0], natural.gradients[node][1]]);
    }
    face
}

impl<const N: usize, const P: usize> FaceGeometry<N, P> {
    /// Computes the geometry of a face from its nodes: corners in order around it, then mid-edge nodes.
    pub fn new(corners: &[[f64; 3]]) -> Self {
        let nodes = corners.len().min(N);
        let mut rule: [([f64; 2], f64); 9] = [([0.0; 2], 0.0); 9];
        let points = match nodes {
            8 => {
                let all = (0..9).map(|k| (natural::GAUSS_3[k % 3], natural::GAUSS_3[k / 3]));
                for (own, ((r, v), (s, w))) in rule.iter_mut().zip(all) {
                    *own = ([r, s], v * w);
                }
                9
            }
            6 => {
                for (own, point) in rule.iter_mut().zip(natural::dunavant()) {
                    *own = point;
                }
                6
            }
            _ => nodes,
        };
        let mut face =
            Self { nodes, points, weights: [0.0; P], shapes: [[0.0; N]; P], corner_areas: [0.0; N] };
        for point in 0..points {
            let mut tangents = [[0.0; 3]; 2];
            let second = (nodes > 4).then(|| second_order_face(nodes, rule[point].0));
            for node in 0..nodes {
                let natural = if let Some(second) = &second {
                    face.shapes[point][node] = second[node].0;
                    second[node].1
                } else if nodes == 4 {
                    let factor = |d: usize| {
                        0.5 * (1.0 + GAUSS * QUADRILATERAL_CORNERS[point][d] * QUADRILATERAL_CORNERS[node][d])
                    };
                    face.shapes[point][node] = factor(0) * factor(1);
                    [
                        0.5 * QUADRILATERAL_CORNERS[node][0] * factor(1),
                        0.5 * QUADRILATERAL_CORNERS[node][1] * factor(0),
                    ]
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
            face.weights[point] = match nodes {
                4 => area,
                3 => area / 6.0,
                _ => area * rule[point].1,
            };
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
