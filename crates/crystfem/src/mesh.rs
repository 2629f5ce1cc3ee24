//! Meshes of hexahedra and tetrahedra.

use std::collections::BTreeMap;

/// A face of an element: the element's number and the side, 0–5 of a hexahedron or 0–3 of a tetrahedron, numbered as in
/// Abaqus (S1 is side 0).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Face {
    /// Element: hexahedra first, tetrahedra after them.
    pub element: u32,
    /// Side.
    pub side: u8,
}

/// A mesh. Elements are numbered hexahedra first, then tetrahedra; nodes of an element in the order of Abaqus and VTK.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Positions of the nodes, m.
    pub points: Vec<[f64; 3]>,
    /// Nodes of 8-node hexahedra.
    pub hexahedra: Vec<[u32; 8]>,
    /// Nodes of 4-node tetrahedra.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Named sets of nodes, each sorted.
    pub node_sets: BTreeMap<String, Vec<u32>>,
    /// Named sets of elements, each sorted.
    pub element_sets: BTreeMap<String, Vec<u32>>,
    /// Named surfaces.
    pub surfaces: BTreeMap<String, Vec<Face>>,
}
