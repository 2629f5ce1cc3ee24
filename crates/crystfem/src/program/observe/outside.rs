//! What is seen of a part from outside.

use crate::error::Error;
use crate::mesh::Mesh;
use crate::mesh::surface::OuterSurface;
use harness::output::picture::{Corner, Plane, Skin};

/// A frame: what it is called, the values of its fields at the nodes, and which elements exist.
pub(super) struct Frame {
    pub(super) title: String,
    pub(super) values: Vec<Vec<f64>>,
    pub(super) exists: Vec<bool>,
}

/// Elements that may be seen, and who borders on whom.
pub struct Outside<'a> {
    mesh: &'a Mesh,
    /// Where its nodes are shown.
    points: std::borrow::Cow<'a, [[f64; 3]]>,
    elements: &'a [u32],
    /// Whether each element of the mesh is one of them.
    is_one: Vec<bool>,
    surface: OuterSurface,
    cut: Option<Plane>,
}

impl<'a> Outside<'a> {
    /// Of some elements, cut by a plane.
    ///
    /// # Errors
    /// See [`OuterSurface::new`].
    pub fn new(mesh: &'a Mesh, elements: &'a [u32], cut: Option<Plane>) -> Result<Self, Error> {
        let mut is_one = vec![false; mesh.element_count()];
        elements.iter().for_each(|&element| is_one[element as usize] = true);
        let points = mesh.points.as_slice().into();
        Ok(Self { mesh, points, elements, is_one, surface: OuterSurface::new(mesh)?, cut })
    }

    /// With the nodes somewhere else, m.
    pub fn at(mut self, points: Vec<[f64; 3]>) -> Self {
        self.points = points.into();
        self
    }

    /// The outer surface of those that exist, and where the plane cuts them.
    pub fn skin(&self, frame: Frame) -> (String, Skin) {
        let there = |element: u32| {
            let element = element as usize;
            self.is_one.get(element) == Some(&true) && frame.exists.get(element) == Some(&true)
        };
        let value = |field: usize, node: u32| {
            frame.values.get(field).and_then(|values| values.get(node as usize)).copied().unwrap_or(f64::NAN)
        };
        let corners = |nodes: &[u32]| -> Vec<Corner> {
            let corner = |&node: &u32| Corner {
                at: self.points[node as usize],
                values: [value(0, node), value(1, node)],
            };
            nodes.iter().map(corner).collect()
        };
        let mut skin = Skin::new(self.cut);
        for &element in self.elements.iter().filter(|element| there(**element)) {
            for face in self.mesh.faces_of(element) {
                if self.surface.opposite(face).is_none_or(|other| !there(other.element)) {
                    skin.face(&corners(self.mesh.face_nodes(face).corners()));
                }
            }
            if self.cut.is_some() {
                match self.mesh.corners(element) {
                    // a wedge is three tetrahedra
                    &[a, b, c, d, e, f] => {
                        for part in [[a, b, c, f], [a, b, f, e], [a, e, f, d]] {
                            skin.section(&corners(&part));
                        }
                    }
                    cell => skin.section(&corners(cell)),
                }
            }
        }
        (frame.title, skin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Block, CellSplit, Grid};
    use harness::output::picture::{Plane, View};

    /// A field x + 2y over a brick whose last column does not exist yet: its outside, and its section at y = 1.
    #[test]
    fn only_what_exists_is_seen() {
        for (cells, quads) in [(CellSplit::Hexahedra, 1), (CellSplit::FiveTetrahedra, 2)] {
            let block = Block { name: "brick".into(), lower: [0.0; 3], upper: [3.0, 2.0, 1.0] };
            let grid = Grid::uniform([0.0; 3], [3.0, 2.0, 1.0], [3, 2, 1]).unwrap();
            let mesh = grid.blocks(&[block], cells).unwrap();
            let all: Vec<u32> = (0..mesh.element_count() as u32).collect();
            let field: Vec<f64> = mesh.points.iter().map(|[x, y, _]| x + 2.0 * y).collect();
            let frame = || Frame {
                title: String::new(),
                values: vec![field.clone()],
                exists: all.iter().map(|&element| mesh.centre(element)[0] < 2.0).collect(),
            };
            let seen = |cut| Outside::new(&mesh, &all, cut).unwrap().skin(frame()).1;
            // a box of 2 × 2 × 1 cells: no field beyond its corner
            let whole = seen(None);
            assert_eq!(whole.values(0).count(), 4 * quads * 16, "{cells:?}");
            assert_eq!(whole.values(0).fold(0.0, f64::max), 6.0);
            assert!(whole.values(1).all(f64::is_nan));
            // in front, at small y, nothing is left: 2 + x on the section is the least
            let cut = View::default().facing(Plane { normal: [0.0, 1.0, 0.0], at: 1.0 });
            assert_eq!(seen(Some(cut)).values(0).fold(f64::INFINITY, f64::min), 2.0);
        }
    }
}
