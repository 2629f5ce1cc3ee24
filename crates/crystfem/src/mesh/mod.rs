//! Meshes of hexahedra, tetrahedra and wedges: structured meshes, files, quality, outer surfaces, layers.

pub mod abaqus;
mod bar;
mod file_mesh;
mod geometry;
pub mod gmsh;
pub mod layers;
mod locate;
pub mod path;
pub mod quality;
mod read;
mod rectangles;
mod revolved;
mod second_order;
mod section_file;
mod split;
pub mod stl;
mod structured;
pub mod surface;
mod tube;
mod voxels;

use std::collections::BTreeMap;

use nalgebra::Vector3;

use crate::error::Error;

pub use bar::{Bar, Substrate};
pub use file_mesh::ReadMesh;
pub(crate) use geometry::box_around;
pub use locate::LocatedPoint;
pub use meshfile::{Cell, ElementShape, Face, HEXAHEDRON_SIDES, TETRAHEDRON_SIDES};
pub use read::read;
pub use rectangles::Rectangle;
pub use revolved::{PlaneSection, Revolved, RevolvedCells};
pub use split::CellSplit;
pub use structured::{Block, Grid, graded};
pub use tube::Tube;
pub use voxels::{RATIOS, Voxels};

/// A mesh. Elements are numbered 8-node hexahedra first, then 4-node tetrahedra, then the others; nodes of an
/// element are in the order of Abaqus ([`ElementShape`]).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Positions of the nodes, m.
    pub points: Vec<[f64; 3]>,
    /// Nodes of 8-node hexahedra.
    pub hexahedra: Vec<[u32; 8]>,
    /// Nodes of 4-node tetrahedra.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Wedges and second-order elements.
    pub others: Vec<Cell>,
    /// Named sets of nodes, each sorted.
    pub node_sets: BTreeMap<String, Vec<u32>>,
    /// Named sets of elements, each sorted.
    pub element_sets: BTreeMap<String, Vec<u32>>,
    /// Named surfaces.
    pub surfaces: BTreeMap<String, Vec<Face>>,
}

/// Sides of the bounding box of a mesh, as names of surfaces: x−, x+, y−, y+, z−, z+.
pub const BOX_SIDES: [&str; 6] = ["left", "right", "front", "back", "bottom", "top"];

/// Nodes of a face: three or four corners, anticlockwise seen from outside, then the mid-edge nodes of a
/// second-order element, each after its first corner. Dereferences to a slice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FaceNodes {
    nodes: [u32; 8],
    count: u8,
}

impl FaceNodes {
    /// Corners.
    pub fn corners(&self) -> &[u32] {
        let count = if self.count > 4 { self.count / 2 } else { self.count };
        &self.nodes[..usize::from(count)]
    }

    /// Sorted corners, padded with [`u32::MAX`]: the same from either side.
    pub(crate) fn key(&self) -> [u32; 4] {
        let corners = self.corners();
        let mut key = [u32::MAX; 4];
        key[..corners.len()].copy_from_slice(corners);
        key.sort_unstable();
        key
    }
}

impl std::ops::Deref for FaceNodes {
    type Target = [u32];

    fn deref(&self) -> &[u32] {
        &self.nodes[..usize::from(self.count)]
    }
}

/// Shapes of elements that are axis-parallel bricks; elements of the same shape share their matrices.
#[derive(Clone, Debug, PartialEq)]
pub struct Bricks {
    /// Edge lengths along x, y, z of each shape, m, in order of first use.
    pub sizes: Vec<[f64; 3]>,
    /// Shape of each element.
    pub shape: Vec<u32>,
}

impl Mesh {
    /// Number of elements.
    pub fn element_count(&self) -> usize {
        self.hexahedra.len() + self.tetrahedra.len() + self.others.len()
    }

    /// Returns a wedge or a second-order element.
    fn other(&self, element: usize) -> Option<&Cell> {
        self.others.get(element.checked_sub(self.hexahedra.len() + self.tetrahedra.len())?)
    }

    /// Type of an element; tetrahedron for an index out of range.
    pub fn shape(&self, element: u32) -> ElementShape {
        let element = element as usize;
        match element < self.hexahedra.len() {
            true => ElementShape::Hexahedron,
            false => self.other(element).map_or(ElementShape::Tetrahedron, |cell| cell.shape),
        }
    }

    /// Returns true if an element is of second order.
    pub fn is_second_order(&self) -> bool {
        self.others.iter().any(|cell| cell.shape.is_second_order())
    }

    /// Nodes of an element; empty for an index out of range.
    pub fn nodes(&self, element: u32) -> &[u32] {
        let element = element as usize;
        match self.hexahedra.get(element) {
            Some(nodes) => nodes,
            None => match self.tetrahedra.get(element - self.hexahedra.len()) {
                Some(nodes) => nodes,
                None => self.other(element).map_or(&[], Cell::nodes),
            },
        }
    }

    /// Corners of an element; empty for an index out of range.
    pub fn corners(&self, element: u32) -> &[u32] {
        let nodes = self.nodes(element);
        if nodes.len() > 8 { &nodes[..self.shape(element).corners()] } else { nodes }
    }

    /// Number of sides of an element: 6, 4 or 5.
    pub fn side_count(&self, element: u32) -> u8 {
        self.shape(element).side_count()
    }

    /// Faces of an element.
    pub fn faces_of(&self, element: u32) -> impl Iterator<Item = Face> + use<> {
        (0..self.side_count(element)).map(move |side| Face { element, side })
    }

    /// Nodes of a face, anticlockwise seen from outside; empty if there is no such face.
    pub fn face_nodes(&self, face: Face) -> FaceNodes {
        let (all, shape) = (self.nodes(face.element), self.shape(face.element));
        let ring = if all.is_empty() { &[] } else { shape.side(face.side) };
        let next = (0..ring.len()).map(|k| (ring[k], ring[(k + 1) % ring.len()]));
        let middles = next.filter_map(|(a, b)| shape.middle(a, b));
        let (mut nodes, mut count) = ([0; 8], 0);
        for (node, local) in nodes.iter_mut().zip(ring.iter().copied().chain(middles)) {
            *node = all[local];
            count += 1;
        }
        FaceNodes { nodes, count }
    }

    /// Mean position of an element's nodes, m.
    pub fn centre(&self, element: u32) -> [f64; 3] {
        let nodes = self.nodes(element);
        let sum = nodes.iter().fold(Vector3::zeros(), |sum, node| sum + self.point(*node));
        (sum / nodes.len() as f64).into()
    }

    /// Corners of the bounding box of all nodes, m; `None` without nodes.
    pub fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        box_around(self.points.iter().copied())
    }

    /// Corners of the bounding box of some elements, m; `None` without any.
    pub fn bounds_of(&self, elements: &[u32]) -> Option<[[f64; 3]; 2]> {
        let nodes = elements.iter().flat_map(|&element| self.nodes(element));
        box_around(nodes.map(|&node| self.points[node as usize]))
    }

    /// Nodes on faces, sorted, without duplicates.
    pub fn nodes_of(&self, faces: &[Face]) -> Vec<u32> {
        let mut nodes: Vec<u32> = faces.iter().flat_map(|face| self.face_nodes(*face).to_vec()).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Shapes of the elements if all are axis-parallel bricks, numbered from the corner with the smallest
    /// coordinates; `None` otherwise. Edges count as parallel, and shapes as equal, within 1e-9 of the
    /// shortest edge: element matrices then agree to that, far below a discretization error.
    pub fn bricks(&self) -> Option<Bricks> {
        if !(self.tetrahedra.is_empty() && self.others.is_empty()) {
            return None;
        }
        let mut sizes: Vec<[f64; 3]> = Vec::new();
        let mut shape = Vec::with_capacity(self.hexahedra.len());
        // shapes by size in units of relative 1e-9: most elements repeat the previous shape
        let mut known: BTreeMap<[i64; 3], u32> = BTreeMap::new();
        let mut last = u32::MAX;
        for element in 0..self.hexahedra.len() as u32 {
            let size = self.brick(element)?;
            let close = |other: &[f64; 3]| (0..3).all(|d| (size[d] - other[d]).abs() <= 1e-9 * other[d]);
            if !sizes.get(last as usize).is_some_and(close) {
                let key = size.map(|length| (length.ln() * 1e9).round() as i64);
                let found = (0..27)
                    .map(|k| [key[0] + k % 3 - 1, key[1] + k / 3 % 3 - 1, key[2] + k / 9 - 1])
                    .find_map(|near| known.get(&near).copied());
                last = found.unwrap_or_else(|| {
                    sizes.push(size);
                    known.insert(key, sizes.len() as u32 - 1);
                    sizes.len() as u32 - 1
                });
            }
            shape.push(last);
        }
        Some(Bricks { sizes, shape })
    }

    /// Edge lengths of a hexahedron that is an axis-parallel brick, see [`Self::bricks`].
    fn brick(&self, element: u32) -> Option<[f64; 3]> {
        let nodes = self.hexahedra.get(element as usize)?.map(|node| self.point(node));
        let size = nodes[6] - nodes[0];
        let tolerance = 1e-9 * size.min();
        let fits = size.min() > 0.0
            && (0..8).all(|corner| {
                // corners 0 1 2 3 go round the lower face, 4 5 6 7 round the upper one
                let at = [corner & 1 ^ corner >> 1 & 1, corner >> 1 & 1, corner >> 2];
                (0..3).all(|d| (nodes[corner][d] - nodes[0][d] - size[d] * at[d] as f64).abs() <= tolerance)
            });
        fits.then(|| size.into())
    }

    /// Returns the mesh with inner nodes moved, for patch tests: by `amplitude` times the box along x, −0.7
    /// of that along y and 0.5 along z, times ∏ sin(π ξ_d) with ξ from 0 to 1 through the box, which keeps
    /// its shape.
    ///
    /// # Errors
    /// [`Error::Parameter`] for an amplitude above 0.2, which could invert an element.
    pub fn distorted(&self, amplitude: f64) -> Result<Self, Error> {
        // det F = 1 + amplitude (1, −0.7, 0.5)·∇∏ in box units, |∇∏| ≤ π: positive below 0.24
        if amplitude.is_nan() || amplitude.abs() > 0.2 {
            let allowed = "−0.2 … 0.2".into();
            return Err(Error::Parameter { name: "amplitude of the distortion", found: amplitude, allowed });
        }
        let mut mesh = self.clone();
        let Some([lower, upper]) = self.bounds() else { return Ok(mesh) };
        for point in &mut mesh.points {
            let product: f64 = (0..3)
                .map(|d| (std::f64::consts::PI * (point[d] - lower[d]) / (upper[d] - lower[d])).sin())
                .product();
            for (d, part) in [1.0, -0.7, 0.5].into_iter().enumerate() {
                point[d] += amplitude * part * (upper[d] - lower[d]) * product;
            }
        }
        Ok(mesh)
    }

    /// Position of a node.
    pub(crate) fn point(&self, node: u32) -> Vector3<f64> {
        Vector3::from(self.points[node as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_point_outwards() {
        let mesh = Grid::uniform([0.0; 3], [1.0, 2.0, 3.0], [1, 1, 1]).unwrap().mesh("brick").unwrap();
        let mut tetrahedron = Mesh { points: mesh.points.clone(), ..Mesh::default() };
        tetrahedron.tetrahedra.push([0, 1, 3, 4]);
        let mut others = Mesh { points: mesh.points.clone(), ..Mesh::default() };
        others.others.push(Cell::new(&[0, 1, 3, 4, 5, 7]).unwrap());
        let second = others.clone().second_order();
        assert_eq!(second.points.len(), 8 + 9);
        for mesh in [mesh, tetrahedron, others, second] {
            let centre = Vector3::from(mesh.centre(0));
            for side in 0..mesh.side_count(0) {
                let nodes = mesh.face_nodes(Face { element: 0, side });
                let corner = mesh.point(nodes[0]);
                let normal = (mesh.point(nodes[1]) - corner).cross(&(mesh.point(nodes[2]) - corner));
                assert!(normal.dot(&(corner - centre)) > 0.0, "side {side}");
                // each mid-edge node lies between the corner before it and the next
                let corners = nodes.corners();
                for (k, middle) in nodes[corners.len()..].iter().enumerate() {
                    let ends = mesh.point(corners[k]) + mesh.point(corners[(k + 1) % corners.len()]);
                    assert!((0.5 * ends - mesh.point(*middle)).norm() < 1e-15);
                }
            }
        }
    }

    #[test]
    fn missing_elements_have_no_nodes() {
        let mesh = Grid::uniform([0.0; 3], [1.0; 3], [1, 1, 1]).unwrap().mesh("brick").unwrap();
        assert!(mesh.nodes(1).is_empty());
        assert!(mesh.face_nodes(Face { element: 0, side: 6 }).is_empty());
        assert!(mesh.face_nodes(Face { element: 7, side: 0 }).is_empty());
        assert_eq!(Mesh::default().bounds(), None);
    }

    #[test]
    fn bricks_are_grouped_by_shape() {
        // lines at k/7 differ in their last bits; the second half along x is twice as long
        let mut grid = Grid::uniform([0.0; 3], [1.0; 3], [7, 7, 7]).unwrap();
        for x in &mut grid.lines[0] {
            *x = x.max(2.0 * *x - 4.0 / 7.0);
        }
        let mesh = grid.mesh("brick").unwrap();
        let bricks = mesh.bricks().unwrap();
        assert_eq!(bricks.sizes.len(), 2);
        assert!((bricks.sizes[1][0] - 2.0 / 7.0).abs() < 1e-12);
        assert_eq!(bricks.shape.iter().filter(|shape| **shape == 1).count(), 3 * 49);
        assert_eq!(mesh.distorted(0.1).unwrap().bricks(), None);
        assert!(mesh.distorted(0.3).is_err() && mesh.distorted(f64::NAN).is_err());
    }
}
