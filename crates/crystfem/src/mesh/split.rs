//! Splitting of structured hexahedra into tetrahedra and wedges.

use crate::mesh::{Cell, ElementShape, Face, HEXAHEDRON_SIDES, Mesh};

/// Element type in the cells of a grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum CellSplit {
    /// A hexahedron.
    #[default]
    Hexahedra,
    /// Five tetrahedra, mirrored from cell to cell so that diagonals meet.
    FiveTetrahedra,
    /// Six tetrahedra around the diagonal from the first to the opposite corner (Kuhn's triangulation).
    SixTetrahedra,
    /// Two wedges, with triangles below and above.
    Wedges,
}

impl CellSplit {
    /// Number of elements of a cell.
    pub fn count(self) -> usize {
        match self {
            Self::Hexahedra => 1,
            Self::FiveTetrahedra => FIVE[0].len(),
            Self::SixTetrahedra => SIX.len(),
            Self::Wedges => WEDGES.len(),
        }
    }
}

const SIX: [[usize; 4]; 6] =
    [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]];
const WEDGES: [[usize; 6]; 2] = [[0, 1, 2, 4, 5, 6], [0, 2, 3, 4, 6, 7]];
/// Central and four corner tetrahedra; the second list is for cells of odd parity.
const FIVE: [[[usize; 4]; 5]; 2] = [
    [[0, 1, 2, 5], [0, 2, 3, 7], [0, 5, 7, 4], [2, 7, 5, 6], [0, 2, 7, 5]],
    [[1, 2, 3, 6], [0, 1, 3, 4], [1, 6, 4, 5], [3, 4, 6, 7], [1, 3, 4, 6]],
];

/// Splits each hexahedron, with sets and surfaces; `odd` is the parity of each cell.
pub(super) fn split(mesh: Mesh, odd: &[bool], into: CellSplit) -> Mesh {
    if into == CellSplit::Hexahedra {
        return mesh;
    }
    let count = into.count() as u32;
    let part = |element: usize, k: usize| -> &[usize] {
        match into {
            CellSplit::Wedges => &WEDGES[k],
            CellSplit::SixTetrahedra => &SIX[k],
            _ => &FIVE[usize::from(odd[element])][k],
        }
    };
    let (mut tetrahedra, mut others) = (Vec::new(), Vec::new());
    for (element, nodes) in mesh.hexahedra.iter().enumerate() {
        for part in (0..count as usize).map(|k| part(element, k)) {
            match *part {
                [a, b, c, d] => tetrahedra.push([nodes[a], nodes[b], nodes[c], nodes[d]]),
                _ => others.extend(Cell::new(&part.iter().map(|&n| nodes[n]).collect::<Vec<_>>())),
            }
        }
    }
    let shape = if into == CellSplit::Wedges { ElementShape::Wedge } else { ElementShape::Tetrahedron };
    let of_set = |set: &Vec<u32>| set.iter().flat_map(|e| e * count..(e + 1) * count).collect();
    let of_surface = |faces: &Vec<Face>| {
        let mut split: Vec<Face> = Vec::with_capacity(2 * faces.len());
        for face in faces {
            let whole = HEXAHEDRON_SIDES[usize::from(face.side)];
            for k in 0..count {
                let part = part(face.element as usize, k as usize);
                let on = (0..shape.side_count())
                    .filter(|&side| shape.side(side).iter().all(|&n| whole.contains(&part[n])));
                split.extend(on.map(|side| Face { element: face.element * count + k, side }));
            }
        }
        split.sort_unstable();
        split
    };
    Mesh {
        tetrahedra,
        others,
        hexahedra: Vec::new(),
        element_sets: mesh.element_sets.iter().map(|(name, set)| (name.clone(), of_set(set))).collect(),
        surfaces: mesh.surfaces.iter().map(|(name, faces)| (name.clone(), of_surface(faces))).collect(),
        points: mesh.points,
        node_sets: mesh.node_sets,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::surface::OuterSurface;
    use crate::mesh::{Block, Grid, quality};

    #[test]
    fn wedges_fill_the_brick_and_meet() {
        let grid = Grid::uniform([0.0; 3], [3.0, 2.0, 2.0], [3, 2, 2]).unwrap();
        let blocks = [Block { name: "brick".into(), lower: [0.0; 3], upper: [3.0, 2.0, 2.0] }];
        let mesh = grid.blocks(&blocks, CellSplit::Wedges).unwrap();
        assert_eq!((mesh.others.len(), mesh.element_sets["brick"].len()), (24, 24));
        let quality = quality::check(&mesh, None).unwrap();
        assert!((quality.volume - 12.0).abs() < 1e-13 && quality.notes.is_empty(), "{:?}", quality.notes);
        // two triangles for each of six squares below and above, quadrilaterals around
        let surface = OuterSurface::of_all(&mesh).unwrap();
        assert_eq!(surface.faces().count(), 2 * 2 * 6 + 2 * (6 + 4));
        let mut named: Vec<Face> = mesh.surfaces.values().flatten().copied().collect();
        named.sort_unstable();
        assert_eq!(named, surface.faces().collect::<Vec<_>>());
    }

    #[test]
    fn tetrahedra_fill_the_brick_and_meet() {
        let grid = Grid::uniform([0.0; 3], [3.0, 2.0, 2.0], [3, 2, 2]).unwrap();
        let blocks = [Block { name: "brick".into(), lower: [0.0; 3], upper: [3.0, 2.0, 2.0] }];
        for (into, count) in [(CellSplit::FiveTetrahedra, 5), (CellSplit::SixTetrahedra, 6)] {
            let mesh = grid.blocks(&blocks, into).unwrap();
            assert_eq!(mesh.tetrahedra.len(), 12 * count);
            assert_eq!(mesh.element_sets["brick"].len(), 12 * count);
            assert_eq!(into.count() * 12, mesh.element_count());
            let quality = quality::check(&mesh, None).unwrap();
            assert!((quality.volume - 12.0).abs() < 1e-13);
            assert!(quality.notes.is_empty(), "{:?}", quality.notes);
            // conforming: only the sides of the box are outer faces, two triangles a square
            let surface = OuterSurface::of_all(&mesh).unwrap();
            assert_eq!(surface.faces().count(), 2 * 2 * (6 + 6 + 4));
            let mut named: Vec<Face> = mesh.surfaces.values().flatten().copied().collect();
            named.sort_unstable();
            assert_eq!(named, surface.faces().collect::<Vec<_>>());
        }
    }
}
