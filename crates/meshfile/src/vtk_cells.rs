//! Cells of VTK as elements of a [`MeshFile`](crate::MeshFile).

use crate::content::ElementKind;
use crate::shape::ElementShape;

/// Cell type of VTK, number of its nodes, element kind: the first nodes of the cell, in its order. Nodes in
/// the middles of sides and cells are left out. Types 68 to 73 are Lagrange cells of any order, whose order
/// of edges changed between versions: those with corners only.
const KINDS: [(u8, usize, ElementKind); 23] = [
    (1, 1, ElementKind::Point),
    (3, 2, ElementKind::Line),
    (68, 2, ElementKind::Line),
    (21, 3, ElementKind::Line3),
    (5, 3, ElementKind::Triangle),
    (69, 3, ElementKind::Triangle),
    (22, 6, ElementKind::Triangle6),
    (34, 7, ElementKind::Triangle6),
    (9, 4, ElementKind::Quadrangle),
    (70, 4, ElementKind::Quadrangle),
    (23, 8, ElementKind::Quadrangle8),
    (28, 9, ElementKind::Quadrangle8),
    (10, 4, ElementKind::Solid(ElementShape::Tetrahedron)),
    (71, 4, ElementKind::Solid(ElementShape::Tetrahedron)),
    (24, 10, ElementKind::Solid(ElementShape::Tetrahedron10)),
    (12, 8, ElementKind::Solid(ElementShape::Hexahedron)),
    (72, 8, ElementKind::Solid(ElementShape::Hexahedron)),
    (25, 20, ElementKind::Solid(ElementShape::Hexahedron20)),
    (29, 27, ElementKind::Solid(ElementShape::Hexahedron20)),
    (13, 6, ElementKind::Solid(ElementShape::Wedge)),
    (73, 6, ElementKind::Solid(ElementShape::Wedge)),
    (26, 15, ElementKind::Solid(ElementShape::Wedge15)),
    (32, 18, ElementKind::Solid(ElementShape::Wedge15)),
];

/// Types in [`element`], for messages.
pub(crate) const ALLOWED: &str = "triangles, quadrilaterals, tetrahedra, hexahedra and wedges of first or \
    second order, pixels, voxels, lines, vertices";

/// Returns the kind and nodes of a cell of VTK; `None` for other types.
pub(crate) fn element(kind: u8, nodes: &[u32], points: &[[f64; 3]]) -> Option<(ElementKind, Vec<u32>)> {
    let pick = |order: &[usize]| order.iter().map(|&place| nodes[place]).collect();
    match (kind, nodes.len()) {
        // the corners of pixels and voxels are ordered along x first
        (8, 4) => return Some((ElementKind::Quadrangle, pick(&[0, 1, 3, 2]))),
        (11, 8) => {
            let shape = ElementShape::Hexahedron;
            return Some((ElementKind::Solid(shape), pick(&[0, 1, 3, 2, 4, 5, 7, 6])));
        }
        (7, 3) => return Some((ElementKind::Triangle, nodes.to_vec())),
        (7, 4) => return Some((ElementKind::Quadrangle, nodes.to_vec())),
        _ => {}
    }
    let (.., own) = KINDS.iter().find(|known| (known.0, known.1) == (kind, nodes.len()))?;
    let mut kept = nodes[..own.node_count()].to_vec();
    // VTK's own order of the first triangle is the opposite of other programs', which write both
    if *own == ElementKind::Solid(ElementShape::Wedge) && volume(nodes, points) < 0.0 {
        kept = pick(&[0, 2, 1, 3, 5, 4]);
    }
    Some((*own, kept))
}

/// Six times the volume of the tetrahedron of the first triangle of a wedge and its fourth node.
fn volume(nodes: &[u32], points: &[[f64; 3]]) -> f64 {
    let at = |k: usize| points[nodes[k] as usize];
    let edge = |k: usize| [0, 1, 2].map(|d| at(k)[d] - at(0)[d]);
    let ([a, b, c], [p, q, r], [x, y, z]) = (edge(1), edge(2), edge(3));
    (b * r - c * q) * x + (c * p - a * r) * y + (a * q - b * p) * z
}
