//! The elements around nodes, and which of their sides are outside.

use super::NONE;
use crate::mesh::{Face, Mesh};
use polycore::numerics::Groups;
use rayon::prelude::*;

/// Elements whose sides are looked at together.
const BATCH: usize = 4096;

/// The elements around each node of a mesh, ascending, as `stride` × element + number of the node in it.
pub struct Around {
    corners: Groups<u32>,
    /// 8, or 32 of a mesh with second-order elements.
    stride: u32,
}

impl Around {
    /// Of all elements that ever exist.
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

    /// Elements of a node that are born, and its number in each.
    pub fn of(&self, node: u32, born: &[u32]) -> impl Iterator<Item = (u32, usize)> {
        let stride = self.stride;
        self.corners
            .of(node as usize)
            .iter()
            .map(move |&corner| (corner / stride, (corner % stride) as usize))
            .filter(|&(element, _)| born[element as usize] != NONE)
    }

    /// Sides of these elements that have a node of those wanted and that no other element shares, in the
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
                    && !self.of(corners[0], born).any(|(other, _)| {
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
