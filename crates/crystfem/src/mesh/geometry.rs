//! Positions and volumes of the elements of a mesh.

use super::Mesh;
use crate::element::{FIRST_ORDER_NODES, Geometry, MAX_ELEMENT_NODES, MAX_ELEMENT_POINTS};
use polycore::numerics::bounds;

/// Corners of the bounding box of positions, m; `None` without any.
pub fn box_around(places: impl Iterator<Item = [f64; 3]>) -> Option<[[f64; 3]; 2]> {
    let [lower, upper] = bounds(places);
    (lower[0] <= upper[0]).then_some([lower, upper])
}

impl Mesh {
    /// Positions of the nodes of an element, m, padded with 0, and their number.
    pub(crate) fn positions<const N: usize>(&self, element: u32) -> ([[f64; 3]; N], usize) {
        let nodes = self.nodes(element);
        let mut places = [[0.0; 3]; N];
        for (place, &node) in places.iter_mut().zip(nodes) {
            *place = self.points[node as usize];
        }
        (places, nodes.len())
    }

    /// Computes an element of any shape at its integration points; `None` if a Jacobian is not positive.
    pub(crate) fn geometry(&self, element: u32) -> Option<Geometry<MAX_ELEMENT_NODES, MAX_ELEMENT_POINTS>> {
        let (places, nodes) = self.positions::<MAX_ELEMENT_NODES>(element);
        Geometry::new(&places[..nodes])
    }

    /// Positive fraction of an element's volume for each of its nodes, for means over nodes, m³: ∫ N dV; for
    /// second-order elements, whose ∫ N dV is negative at corners, V ∫ N² dV over the sum of all (Hinton,
    /// Rock & Zienkiewicz 1976). `None` if a Jacobian is not positive.
    pub(crate) fn node_volumes(&self, element: u32) -> Option<[f64; MAX_ELEMENT_NODES]> {
        let mut volumes = [0.0; MAX_ELEMENT_NODES];
        let (places, nodes) = self.positions::<MAX_ELEMENT_NODES>(element);
        if nodes <= FIRST_ORDER_NODES {
            let geometry = Geometry::<FIRST_ORDER_NODES, FIRST_ORDER_NODES>::new(&places[..nodes])?;
            volumes[..FIRST_ORDER_NODES].copy_from_slice(&geometry.corner_volumes);
            return Some(volumes);
        }
        let geometry = self.geometry(element)?;
        let mass = geometry.mass();
        let sum: f64 = (0..nodes).map(|a| mass[a][a]).sum();
        let volume: f64 = geometry.weights.iter().sum();
        for (a, own) in volumes.iter_mut().enumerate().take(nodes) {
            *own = volume * mass[a][a] / sum;
        }
        Some(volumes)
    }

    /// Volume of an element, m³; 0 for an invalid one.
    pub fn volume(&self, element: u32) -> f64 {
        self.node_volumes(element).map_or(0.0, |volumes| volumes.iter().sum())
    }
}
