//! Element types: corners, edges and sides, and their node order here and in other programs.

/// Sides of a wedge: triangles 0 and 1, quadrilaterals 2 to 4, numbered as in Abaqus, anticlockwise seen from
/// outside.
const WEDGE_SIDES: [&[usize]; 5] = [&[0, 2, 1], &[3, 4, 5], &[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]];
/// Local nodes of the sides S1 … S6 of a hexahedron, anticlockwise seen from outside.
pub const HEXAHEDRON_SIDES: [[usize; 4]; 6] =
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
/// Local nodes of the sides S1 … S4 of a tetrahedron, anticlockwise seen from outside.
pub const TETRAHEDRON_SIDES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
const HEXAHEDRON_EDGES: [[usize; 2]; 12] =
    [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];
const TETRAHEDRON_EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];
const WEDGE_EDGES: [[usize; 2]; 9] = [[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]];

/// An element type. Nodes are in the order of Abaqus (C3D8, C3D4, C3D6, C3D20, C3D10, C3D15): corners, then
/// the node on the middle of each edge in the order of [`ElementShape::edges`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ElementShape {
    /// 8 nodes.
    Hexahedron,
    /// 4 nodes.
    Tetrahedron,
    /// 6 nodes: a triangle, and the one opposite to it.
    Wedge,
    /// 20 nodes.
    Hexahedron20,
    /// 10 nodes.
    Tetrahedron10,
    /// 15 nodes.
    Wedge15,
}

impl ElementShape {
    /// All types.
    pub const ALL: [Self; 6] = [
        Self::Hexahedron,
        Self::Tetrahedron,
        Self::Wedge,
        Self::Hexahedron20,
        Self::Tetrahedron10,
        Self::Wedge15,
    ];

    /// Number of nodes.
    pub const fn nodes(self) -> usize {
        match self {
            Self::Hexahedron => 8,
            Self::Tetrahedron => 4,
            Self::Wedge => 6,
            Self::Hexahedron20 => 20,
            Self::Tetrahedron10 => 10,
            Self::Wedge15 => 15,
        }
    }

    /// Returns the type with this number of nodes.
    pub fn with_nodes(nodes: usize) -> Option<Self> {
        Self::ALL.into_iter().find(|shape| shape.nodes() == nodes)
    }

    /// Returns the type with mid-edge nodes added.
    pub const fn second_order(self) -> Self {
        match self {
            Self::Hexahedron | Self::Hexahedron20 => Self::Hexahedron20,
            Self::Tetrahedron | Self::Tetrahedron10 => Self::Tetrahedron10,
            Self::Wedge | Self::Wedge15 => Self::Wedge15,
        }
    }

    /// Returns true for second-order shape functions.
    pub const fn is_second_order(self) -> bool {
        self.nodes() > 8
    }

    /// Number of corners.
    pub const fn corners(self) -> usize {
        match self {
            Self::Hexahedron | Self::Hexahedron20 => 8,
            Self::Tetrahedron | Self::Tetrahedron10 => 4,
            Self::Wedge | Self::Wedge15 => 6,
        }
    }

    /// Corners at the ends of each edge.
    pub const fn edges(self) -> &'static [[usize; 2]] {
        match self {
            Self::Hexahedron | Self::Hexahedron20 => &HEXAHEDRON_EDGES,
            Self::Tetrahedron | Self::Tetrahedron10 => &TETRAHEDRON_EDGES,
            Self::Wedge | Self::Wedge15 => &WEDGE_EDGES,
        }
    }

    /// Number of sides.
    pub const fn side_count(self) -> u8 {
        match self {
            Self::Hexahedron | Self::Hexahedron20 => 6,
            Self::Tetrahedron | Self::Tetrahedron10 => 4,
            Self::Wedge | Self::Wedge15 => 5,
        }
    }

    /// Corners of a side, anticlockwise seen from outside; empty if there is no such side.
    pub fn side(self, side: u8) -> &'static [usize] {
        let side = usize::from(side);
        match self.corners() {
            8 => HEXAHEDRON_SIDES.get(side).map_or(&[], |side| side.as_slice()),
            4 => TETRAHEDRON_SIDES.get(side).map_or(&[], |side| side.as_slice()),
            _ => WEDGE_SIDES.get(side).copied().unwrap_or_default(),
        }
    }

    /// Mid-edge node between two corners; `None` for a first-order element or without such an edge.
    pub fn middle(self, a: usize, b: usize) -> Option<usize> {
        if !self.is_second_order() {
            return None;
        }
        let edge = self.edges().iter().position(|&[p, q]| (p, q) == (a, b) || (q, p) == (a, b))?;
        Some(self.corners() + edge)
    }

    /// Name of its solid element in Abaqus and CalculiX.
    pub const fn abaqus(self) -> &'static str {
        match self {
            Self::Hexahedron => "C3D8",
            Self::Tetrahedron => "C3D4",
            Self::Wedge => "C3D6",
            Self::Hexahedron20 => "C3D20",
            Self::Tetrahedron10 => "C3D10",
            Self::Wedge15 => "C3D15",
        }
    }

    /// Name in messages.
    pub const fn name(self) -> &'static str {
        match self.corners() {
            8 => "hexahedron",
            4 => "tetrahedron",
            _ => "wedge",
        }
    }

    /// Number in VTK, and the position here of each node in VTK's order. VTK numbers the first triangle of a
    /// 6-node wedge in the opposite sense (vtkWedge: its normal points away from the second), and all others
    /// like Abaqus.
    pub const fn vtk(self) -> (u8, Option<[usize; 6]>) {
        match self {
            Self::Hexahedron => (12, None),
            Self::Tetrahedron => (10, None),
            Self::Wedge => (13, Some([0, 2, 1, 3, 5, 4])),
            Self::Hexahedron20 => (25, None),
            Self::Tetrahedron10 => (24, None),
            Self::Wedge15 => (26, None),
        }
    }

    /// Position in Gmsh's order of each node here. Gmsh has its own order of edges in second-order elements
    /// (<https://gmsh.info/doc/texinfo/gmsh.html#Node-ordering>).
    pub const fn gmsh(self) -> &'static [usize] {
        const FIRST: [usize; 8] = [0, 1, 2, 3, 4, 5, 6, 7];
        match self {
            // Gmsh's edges: 01 03 04 12 15 23 26 37 45 47 56 67
            Self::Hexahedron20 => &[0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15],
            // 01 12 20 30 23 13
            Self::Tetrahedron10 => &[0, 1, 2, 3, 4, 5, 6, 7, 9, 8],
            // 01 02 03 12 14 25 34 35 45
            Self::Wedge15 => &[0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11],
            _ => FIRST.split_at(self.nodes()).0,
        }
    }
}

/// A wedge or a second-order element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cell {
    /// Type.
    pub shape: ElementShape,
    nodes: [u32; 20],
}

impl Cell {
    /// Returns an element with these nodes; `None` if no type has as many.
    pub fn new(nodes: &[u32]) -> Option<Self> {
        let mut cell = Self { shape: ElementShape::with_nodes(nodes.len())?, nodes: [u32::MAX; 20] };
        cell.nodes[..nodes.len()].copy_from_slice(nodes);
        Some(cell)
    }

    /// Nodes.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes[..self.shape.nodes()]
    }

    /// Nodes, for changes.
    pub fn nodes_mut(&mut self) -> &mut [u32] {
        &mut self.nodes[..self.shape.nodes()]
    }
}
