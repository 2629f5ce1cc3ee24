//! Sides and edges of cells that the nodes of a set span.

use super::mesh_cells::{CellMesh, sides_of};
use crate::geometry::Facet;
use std::collections::{BTreeMap, HashSet};

/// A side all of whose corners are in a set.
struct SpannedSide<const D: usize> {
    /// Number of cells that have it.
    cells: usize,
    nodes: Vec<u32>,
    facets: Vec<Facet<D>>,
}

impl<const D: usize> CellMesh<D> {
    /// Returns the facets that nodes span: outer sides of cells whose corners are all among them; for nodes
    /// on none of these such sides between cells, then edges of cells; a point for a single node on no edge.
    ///
    /// # Errors
    /// The number of nodes left.
    pub(super) fn facets_of_nodes(&self, nodes: &[u32]) -> Result<Vec<Facet<D>>, usize> {
        let own: HashSet<u32> = nodes.iter().copied().collect();
        let mut sides: BTreeMap<[u32; 4], SpannedSide<D>> = BTreeMap::new();
        let mut edges: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
        for &cell in self.cells() {
            let element = &self.content().elements[cell as usize];
            let global = self.content().nodes_of(element);
            for side in sides_of(element.kind) {
                let [corners, middles] = [&side.0, &side.1].map(|local| {
                    let nodes = local.iter().map(|&k| global[k]);
                    nodes.collect::<Vec<u32>>()
                });
                for (k, &corner) in corners.iter().enumerate() {
                    let next = corners[(k + 1) % corners.len()];
                    if own.contains(&corner) && own.contains(&next) {
                        let middle = middles.get(k).copied();
                        let line = [Some(corner), middle, Some(next)].into_iter().flatten().collect();
                        edges.entry([corner.min(next), corner.max(next)]).or_insert(line);
                    }
                }
                if corners.iter().all(|corner| own.contains(corner)) {
                    let (key, facets) = self.side(element, &side, false);
                    let nodes = corners.into_iter().chain(middles).collect();
                    sides.entry(key).or_insert(SpannedSide { cells: 0, nodes, facets }).cells += 1;
                }
            }
        }
        let mut left = own.clone();
        let mut facets = Vec::new();
        for is_outer in [true, false] {
            let missed = left.clone();
            for side in sides.values().filter(|side| (side.cells == 1) == is_outer) {
                if side.nodes.iter().any(|node| missed.contains(node)) {
                    facets.extend_from_slice(&side.facets);
                    side.nodes.iter().for_each(|node| {
                        left.remove(node);
                    });
                }
            }
        }
        let missed = left.clone();
        for line in edges.values().filter(|line| line.iter().any(|node| missed.contains(node))) {
            for pair in line.windows(2) {
                let [a, b] = [pair[0], pair[1]].map(|node| self.point(node));
                facets.push(std::array::from_fn(|k| if k == 0 { a } else { b }));
            }
            line.iter().for_each(|node| {
                left.remove(node);
            });
        }
        match nodes {
            _ if left.is_empty() => Ok(facets),
            // in one entry or several
            [node, ..] if own.len() == 1 => Ok(vec![[self.point(*node); D]]),
            _ => Err(left.len()),
        }
    }
}
