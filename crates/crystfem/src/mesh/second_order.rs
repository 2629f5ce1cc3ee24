//! Conversion of first-order to second-order elements.

use super::{Cell, Mesh};
use std::collections::HashMap;

impl Mesh {
    /// Converts to second-order elements with straight edges: a new node on the middle of each edge. Node
    /// sets gain the new nodes between two of theirs; second-order elements stay. Elements keep their
    /// numbers.
    pub fn second_order(self) -> Self {
        let elements: Vec<u32> = (0..self.element_count() as u32).collect();
        let mut mesh =
            Self { hexahedra: Vec::new(), tetrahedra: Vec::new(), others: Vec::new(), ..self.clone() };
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        for element in elements {
            let (shape, nodes) = (self.shape(element), self.nodes(element));
            let mut all = nodes.to_vec();
            if !shape.is_second_order() {
                for &[a, b] in shape.edges() {
                    let (a, b) = (nodes[a].min(nodes[b]), nodes[a].max(nodes[b]));
                    all.push(*middles.entry([a, b]).or_insert_with(|| {
                        mesh.points.push((0.5 * (self.point(a) + self.point(b))).into());
                        mesh.points.len() as u32 - 1
                    }));
                }
            }
            mesh.others.extend(Cell::new(&all));
        }
        for set in mesh.node_sets.values_mut() {
            let inside = |node: &u32| set.binary_search(node).is_ok();
            let between = middles.iter().filter(|(ends, _)| ends.iter().all(inside));
            let mut between: Vec<u32> = between.map(|(_, middle)| *middle).collect();
            between.sort_unstable();
            set.extend(between);
        }
        mesh
    }
}

#[cfg(test)]
mod tests {
    use crate::mesh::{Block, CellSplit, Grid, quality};

    #[test]
    fn every_edge_has_one_node() {
        let grid = Grid::uniform([0.0; 3], [3.0, 2.0, 2.0], [3, 2, 2]).unwrap();
        let block = [Block { name: "brick".into(), lower: [0.0; 3], upper: [3.0, 2.0, 2.0] }];
        // edges of the grid, of the diagonals of its squares (once each), of its cells
        let edges = 3 * 9 + 2 * 4 * 3 + 2 * 4 * 3;
        let (x, y, z) = (4 * 4, 3 * 3 * 2, 3 * 3 * 2);
        for (split, more, left) in [
            (CellSplit::Hexahedra, 0, 9 + 12),
            (CellSplit::Wedges, 3 * 2 * 3, 9 + 12),
            (CellSplit::SixTetrahedra, x + y + z + 12, 9 + 12 + 4),
        ] {
            let mesh = grid.blocks(&block, split).unwrap();
            let [nodes, elements] = [mesh.points.len(), mesh.element_count()];
            let second = mesh.second_order();
            assert_eq!(second.points.len(), nodes + edges + more, "{split:?}");
            assert_eq!(second.node_sets["left"].len(), left, "{split:?}");
            let quality = quality::check(&second, None).unwrap();
            assert!((quality.volume - 12.0).abs() < 1e-13 && quality.notes.is_empty(), "{:?}", quality.notes);
            assert_eq!((second.element_count(), quality.parts), (elements, 1));
        }
    }
}
