//! Elements around nodes, and their outer sides.

use super::NONE;
use crate::mesh::{Face, Mesh};
use polycore::numerics::Groups;
use rayon::prelude::*;

/// Number of elements whose sides are examined together.
const BATCH: usize = 4096;

/// Elements around each node of a mesh, ascending, as `stride` × element + local number of the node.
pub struct NodeElements {
    corners: Groups<u32>,
    /// Stride: 8, or 32 for a mesh with second-order elements.
    stride: u32,
}

impl NodeElements {
    /// Collects all elements that ever exist.
    pub fn new(mesh: &Mesh, absent: &[u32]) -> Self {
        let stride = if mesh.is_second_order() { 32 } else { 8 };
        let mut exists = vec![true; mesh.element_count()];
        absent.iter().for_each(|&element| exists[element as usize] = false);
        let corners = (0..exists.len()).filter(|&element| exists[element]).flat_map(|element| {
            let corners = stride * element as u32..;
            mesh.nodes(element as u32).iter().map(|&node| node as usize).zip(corners)
        });
        Self { corners: Groups::new(mesh.points.len(), corners), stride }
    }

    /// Frees the lists of a mesh that gains no elements; no other call may follow.
    pub fn free_lists(&mut self) {
        self.corners = Groups::new(0, std::iter::empty());
    }

    /// Born elements of a node, with the local number of the node.
    pub fn elements_of(&self, node: u32, born: &[u32]) -> impl Iterator<Item = (u32, usize)> {
        let stride = self.stride;
        self.corners
            .group(node as usize)
            .iter()
            .map(move |&corner| (corner / stride, (corner % stride) as usize))
            .filter(|&(element, _)| born[element as usize] != NONE)
    }

    /// Sides of these elements that contain a wanted node and are not shared with another element, in the
    /// order of the elements.
    pub fn outer(
        &self,
        mesh: &Mesh,
        born: &[u32],
        elements: &[u32],
        wanted: impl Fn(u32) -> bool + Sync,
    ) -> Vec<Face> {
        let of = |&element: &u32| {
            (0..mesh.side_count(element)).map(move |side| Face { element, side }).filter(|&face| {
                let corners = mesh.face_nodes(face);
                corners.iter().any(|&node| wanted(node))
                    && !self.elements_of(corners[0], born).any(|(other, _)| {
                        let others = mesh.nodes(other);
                        other != face.element && corners[1..].iter().all(|corner| others.contains(corner))
                    })
            })
        };
        let faces: Vec<Vec<Face>> =
            elements.par_chunks(BATCH).map(|elements| elements.iter().flat_map(of).collect()).collect();
        faces.concat()
    }
}
