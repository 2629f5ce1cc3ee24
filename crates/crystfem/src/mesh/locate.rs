//! Location of points in a mesh, for interpolation.

use super::Mesh;
use crate::element::MAX_ELEMENT_NODES;
use crate::element::natural::{self, Natural};
use crate::mesh::ElementShape;
use nalgebra::{Matrix3, Vector3};
use polycore::numerics::hexahedron;

/// Tolerance in natural coordinates, and in distances over an element's diagonal: a point on a node has its
/// value.
const LOCATION_TOLERANCE: f64 = 1e-9;
/// Enlargement of an element's box for cutting lines, over its longest edge: above rounding, and above
/// `LOCATION_TOLERANCE`.
const BOX_MARGIN: f64 = 1e-6;
/// Limit on iterations for natural coordinates in a hexahedron; a parallelepiped needs two.
const MAX_ITERATIONS: usize = 50;
/// Largest distance outside the mesh, over the element's extent.
const MAX_OUTSIDE: f64 = 0.5;

/// A point in a mesh.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LocatedPoint {
    /// Nodes with their shape functions, if not 0.
    weights: Vec<(u32, f64)>,
    /// Elements that contain the point: one, or all that meet there.
    elements: Vec<u32>,
    /// Distance from the requested point, m; 0 inside the mesh.
    distance: f64,
}

impl LocatedPoint {
    /// Elements that contain the point: one, or all that meet there.
    pub fn elements(&self) -> &[u32] {
        &self.elements
    }

    /// Distance from the requested point, m; 0 inside the mesh.
    pub fn distance(&self) -> f64 {
        self.distance
    }

    /// Nodes with nonzero shape functions.
    pub fn nodes(&self) -> impl Iterator<Item = u32> {
        self.weights.iter().map(|pair| pair.0)
    }

    /// Interpolates a field over nodes, Σ N_a u_a; `None` if a node has no value.
    pub fn value(&self, field: impl Fn(u32) -> Option<f64>) -> Option<f64> {
        self.weights.iter().map(|&(node, weight)| Some(weight * field(node)?)).sum()
    }
}

impl Mesh {
    /// Returns true if a point, m, lies in an element or on its faces.
    pub fn contains(&self, element: u32, at: [f64; 3]) -> bool {
        self.shapes_at(element, at).is_some()
    }

    /// Shape functions of an element's nodes at a point, m; `None` outside the element and its faces.
    pub fn shapes_at(&self, element: u32, at: [f64; 3]) -> Option<[f64; MAX_ELEMENT_NODES]> {
        let (corners, nodes) = self.positions::<MAX_ELEMENT_NODES>(element);
        let (weights, distance, rounding) = near(corners.get(..nodes).filter(|list| !list.is_empty())?, at)?;
        (distance <= rounding).then_some(weights)
    }

    /// Locates a point, m. A point outside, by at most half an element's extent along each axis, is moved
    /// into the nearest element; `None` beyond.
    pub fn locate(&self, at: [f64; 3]) -> Option<LocatedPoint> {
        self.locate_in(0..self.element_count() as u32, at)
    }

    /// Locates points in order along the line from `a` to `b`; `None` for points outside the mesh.
    pub fn locate_along(&self, a: [f64; 3], b: [f64; 3], points: &[[f64; 3]]) -> Vec<Option<LocatedPoint>> {
        let along = [0, 1, 2].map(|d| b[d] - a[d]);
        let square: f64 = along.iter().map(|x| x * x).sum();
        // interval of the line in each element's slightly enlarged box
        let part = |element: u32| {
            let [low, high] = self.bounds_of(&[element])?;
            let around = BOX_MARGIN * (0..3).map(|d| high[d] - low[d]).fold(0.0, f64::max);
            let (mut first, mut last) = (f64::NEG_INFINITY, f64::INFINITY);
            for d in 0..3 {
                let ends = [low[d] - around - a[d], high[d] + around - a[d]];
                if along[d] == 0.0 {
                    if ends[0] > 0.0 || ends[1] < 0.0 {
                        return None;
                    }
                    continue;
                }
                let [p, q] = ends.map(|end| end / along[d]);
                (first, last) = (first.max(p.min(q)), last.min(p.max(q)));
            }
            (first <= last).then_some((first, last, element))
        };
        let mut parts: Vec<(f64, f64, u32)> = (0..self.element_count() as u32).filter_map(part).collect();
        parts.sort_by(|p, q| p.0.total_cmp(&q.0));
        let (mut parts, mut open) = (parts.into_iter().peekable(), Vec::new());
        let locate = |at: &[f64; 3]| {
            let here = (0..3).map(|d| (at[d] - a[d]) * along[d]).sum::<f64>() / square;
            while let Some(part) = parts.next_if(|part| part.0 <= here) {
                open.push(part);
            }
            open.retain(|part| part.1 >= here);
            // in the order of all elements, like `locate`
            open.sort_unstable_by_key(|part| part.2);
            let place = self.locate_in(open.iter().map(|part| part.2), *at)?;
            (place.distance == 0.0).then_some(place)
        };
        points.iter().map(locate).collect()
    }

    fn locate_in(&self, elements: impl Iterator<Item = u32>, at: [f64; 3]) -> Option<LocatedPoint> {
        let mut found: Vec<(u32, [f64; MAX_ELEMENT_NODES], f64, f64)> = Vec::new();
        for number in elements {
            let (corners, nodes) = self.positions::<MAX_ELEMENT_NODES>(number);
            let corners = &corners[..nodes];
            if let Some((weights, distance, rounding)) = near(corners, at) {
                found.push((number, weights, distance, rounding));
            }
        }
        let &(nearest, weights, distance, rounding) = found.iter().min_by(|a, b| a.2.total_cmp(&b.2))?;
        let meets = |(_, _, other, rounding): &&(u32, _, f64, f64)| *other <= distance + rounding;
        Some(LocatedPoint {
            weights: self
                .nodes(nearest)
                .iter()
                .copied()
                .zip(weights)
                .filter(|&(_, weight)| weight != 0.0)
                .collect(),
            elements: found.iter().filter(meets).map(|(number, ..)| *number).collect(),
            distance: if distance <= rounding { 0.0 } else { distance },
        })
    }
}

/// Shape functions at the nearest point in an element, the distance to it and the rounding error of that, m;
/// `None` for a point outside by more than half of the element's box.
fn near(corners: &[[f64; 3]], at: [f64; 3]) -> Option<([f64; MAX_ELEMENT_NODES], f64, f64)> {
    let near = (0..3).all(|d| {
        let ends = corners.iter().map(|corner| corner[d]);
        let (low, high) = (ends.clone().fold(f64::MAX, f64::min), ends.fold(f64::MIN, f64::max));
        let around = MAX_OUTSIDE * (high - low);
        (low - around..=high + around).contains(&at[d])
    });
    if !near {
        return None;
    }
    let weights = match (corners.len(), ElementShape::with_nodes(corners.len())) {
        (8, _) => hexahedron_shapes(corners, at),
        (4, _) => tetrahedron_shapes(corners, at),
        (_, shape) => general_shapes(shape?, corners, at),
    };
    let origin = Vector3::from(corners[0]);
    let offset = |corner: &[f64; 3]| Vector3::from(*corner) - origin;
    let reached: Vector3<f64> = corners.iter().zip(weights).map(|(c, weight)| weight * offset(c)).sum();
    let diagonal = corners.iter().map(|corner| offset(corner).norm()).fold(0.0, f64::max);
    Some((weights, (offset(&at) - reached).norm(), LOCATION_TOLERANCE * diagonal))
}

/// Shape functions of a hexahedron at natural coordinates, clamped to the element.
fn trilinear_shapes(natural: Vector3<f64>) -> [f64; MAX_ELEMENT_NODES] {
    // exact at the ends: a node has weight 1, and those across a face have 0
    let natural = natural.map(|x| if x.abs() > 1.0 - LOCATION_TOLERANCE { x.signum() } else { x });
    let mut weights = [0.0; MAX_ELEMENT_NODES];
    weights[..8].copy_from_slice(&hexahedron::shapes(natural.into()));
    weights
}

/// Shape functions of wedges and second-order elements, by Newton's method from the centre, with natural
/// coordinates clamped to the element. Near a curved face the nearest point is that of the nearest natural
/// coordinates.
fn general_shapes(shape: ElementShape, corners: &[[f64; 3]], at: [f64; 3]) -> [f64; MAX_ELEMENT_NODES] {
    let offset = |place: [f64; 3]| Vector3::from(place) - Vector3::from(corners[0]);
    let mut place = Vector3::from(natural::middle(shape));
    for _ in 0..MAX_ITERATIONS {
        let natural = Natural::new(shape, place.into());
        let (mut left, mut jacobian) = (offset(at), Matrix3::<f64>::zeros());
        for (a, corner) in corners.iter().enumerate() {
            left -= natural.shapes[a] * offset(*corner);
            jacobian += offset(*corner) * Vector3::from(natural.gradients[a]).transpose();
        }
        let Some(step) = jacobian.try_inverse().map(|inverse| inverse * left) else { break };
        place = (place + step).map(|x| x.clamp(-3.0, 3.0));
        if step.amax() <= 1e-14 {
            break;
        }
    }
    // exact at the ends, so that a node has weight 1
    let ends = |x: f64| if x.abs() > 1.0 - LOCATION_TOLERANCE { x.signum() } else { x };
    // barycentric coordinates, clamped at 0
    let simplex = |count: usize, place: Vector3<f64>| {
        let mut own = [1.0 - place.iter().take(count).sum::<f64>(), place[0], place[1], place[2]];
        own[count + 1..].fill(0.0);
        let own = own.map(|x| if x > LOCATION_TOLERANCE { x } else { 0.0 });
        let sum: f64 = own.iter().sum();
        own.map(|x| x / sum)
    };
    let place = match shape.corners() {
        8 => place.map(ends),
        4 => {
            let [_, r, s, t] = simplex(3, place);
            Vector3::new(r, s, t)
        }
        _ => {
            let [_, r, s, _] = simplex(2, place);
            Vector3::new(r, s, ends(place[2]))
        }
    };
    Natural::new(shape, place.into()).shapes
}

/// Inverts x(ξ) = Σ N_a(ξ) x_a by Newton's method from the centre.
fn hexahedron_shapes(corners: &[[f64; 3]], at: [f64; 3]) -> [f64; MAX_ELEMENT_NODES] {
    let offset = |place: [f64; 3]| Vector3::from(place) - Vector3::from(corners[0]);
    let mut natural = Vector3::<f64>::zeros();
    for _ in 0..MAX_ITERATIONS {
        let (mut left, mut jacobian) = (offset(at), Matrix3::<f64>::zeros());
        let (shapes, slopes) = (hexahedron::shapes(natural.into()), hexahedron::slopes(natural.into()));
        for ((corner, shape), slope) in corners.iter().zip(shapes).zip(slopes) {
            left -= shape * offset(*corner);
            jacobian += offset(*corner) * Vector3::from(slope).transpose();
        }
        let Some(step) = jacobian.try_inverse().map(|inverse| inverse * left) else { break };
        // far outside a distorted element the map folds: stay within the far side of a neighbour
        natural = (natural + step).map(|x| x.clamp(-3.0, 3.0));
        if step.amax() <= 1e-14 {
            break;
        }
    }
    trilinear_shapes(natural)
}

/// Barycentric coordinates, clamped at 0.
fn tetrahedron_shapes(corners: &[[f64; 3]], at: [f64; 3]) -> [f64; MAX_ELEMENT_NODES] {
    let offset = |place: [f64; 3]| Vector3::from(place) - Vector3::from(corners[0]);
    let edges = Matrix3::from_columns(&[offset(corners[1]), offset(corners[2]), offset(corners[3])]);
    let natural = edges.try_inverse().unwrap_or_default() * offset(at);
    let mut weights = [0.0; MAX_ELEMENT_NODES];
    weights[0] = 1.0 - natural.sum();
    weights[1..4].copy_from_slice(natural.as_slice());
    let weights = weights.map(|weight| if weight > LOCATION_TOLERANCE { weight } else { 0.0 });
    let sum: f64 = weights.iter().sum();
    weights.map(|weight| weight / sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Block, CellSplit, Grid};

    fn meshes() -> [Mesh; 7] {
        let grid = Grid::uniform([0.0; 3], [3.0, 2.0, 1.0], [5, 3, 2]).unwrap();
        let block = Block { name: "brick".into(), lower: [0.0; 3], upper: [3.0, 2.0, 1.0] };
        let hexahedra = grid.mesh("brick").unwrap();
        let distorted = hexahedra.distorted(0.05).unwrap();
        let blocks = [block];
        let [tetrahedra, wedges] =
            [CellSplit::FiveTetrahedra, CellSplit::Wedges].map(|split| grid.blocks(&blocks, split).unwrap());
        let others = [hexahedra.clone(), tetrahedra.clone(), wedges.distorted(0.02).unwrap()];
        let [h20, t10, w15] = others.map(Mesh::second_order);
        [hexahedra, distorted, tetrahedra, wedges, h20, t10, w15]
    }

    fn linear([x, y, z]: [f64; 3]) -> f64 {
        1.0 + 2.0 * x - 3.0 * y + 4.0 * z
    }

    /// Linear fields are exact anywhere, at nodes to the last bit, with all elements there.
    #[test]
    fn linear_fields_are_exact() {
        for mesh in meshes() {
            let field = |node: u32| Some(linear(mesh.points[node as usize]));
            for k in 0..200 {
                let share = |step: f64| (f64::from(k) * step).fract();
                let at = [3.0 * share(0.618), 2.0 * share(0.414), share(0.732)];
                let place = mesh.locate(at).unwrap();
                assert_eq!(place.distance(), 0.0, "{at:?}");
                assert!((place.value(field).unwrap() - linear(at)).abs() < 1e-12, "{at:?}");
            }
            for (node, point) in mesh.points.iter().enumerate() {
                let place = mesh.locate(*point).unwrap();
                let corner = mesh
                    .others
                    .iter()
                    .all(|cell| !cell.nodes()[cell.shape.corners()..].contains(&(node as u32)));
                if corner {
                    assert_eq!(place.weights, [(node as u32, 1.0)]);
                }
                let found = place.value(|other| Some(f64::from(u8::from(other == node as u32)))).unwrap();
                assert!((found - 1.0).abs() < 1e-12);
                let around = (0..mesh.element_count() as u32)
                    .filter(|element| mesh.nodes(*element).contains(&(node as u32)));
                assert_eq!(place.elements(), around.collect::<Vec<_>>());
            }
        }
    }

    /// Points along lines through nodes, in faces, oblique and past the mesh agree with `locate`, elements
    /// included.
    #[test]
    fn lines_agree_with_single_points() {
        for mesh in meshes() {
            for (a, b) in [
                ([0.0; 3], [3.0, 2.0, 1.0]),
                ([-1.0, 0.3, 0.2], [4.0, 1.9, 0.7]),
                ([3.0, 2.0, 0.0], [3.0, 2.0, 1.0]),
                ([2.7, 2.0, 1.0], [0.1, 0.0, 1.0]),
                ([0.5, 5.0, 0.5], [0.7, 5.0, 0.5]),
            ] {
                let at = |k: i32| [0, 1, 2].map(|d| a[d] + (b[d] - a[d]) * f64::from(k) / 60.0);
                let points: Vec<[f64; 3]> = (0..=60).map(at).collect();
                let single = |at: &[f64; 3]| mesh.locate(*at).filter(|place| place.distance() == 0.0);
                assert_eq!(mesh.locate_along(a, b, &points), points.iter().map(single).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn outside_by_half_an_element_at_most() {
        let [mesh, ..] = meshes();
        // elements are 0.6 long
        let place = mesh.locate([3.2, 1.0, 0.5]).unwrap();
        assert!((place.distance() - 0.2).abs() < 1e-12);
        let value = place.value(|node| Some(linear(mesh.points[node as usize]))).unwrap();
        assert!((value - linear([3.0, 1.0, 0.5])).abs() < 1e-12);
        assert_eq!(mesh.locate([3.31, 1.0, 0.5]), None);
        assert_eq!(mesh.locate([1.0, 1.0, 75.0]), None);
        assert_eq!(mesh.locate([f64::NAN, 1.0, 0.5]), None);
        assert_eq!(Mesh::default().locate([0.0; 3]), None);
        assert_eq!(place.value(|node| (node > 0 && node < 20).then_some(1.0)), None);
    }
}
