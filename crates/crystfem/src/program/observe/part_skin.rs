//! Outer surface of a part for pictures, with an optional cutting plane.

use crate::error::Error;
use crate::mesh::Mesh;
use crate::mesh::surface::OuterSurface;
use harness::output::picture::{Corner, Plane, Skin};

/// Data of one picture: title, field values at the nodes, and a flag for each element that exists.
pub(super) struct SolidFrame {
    pub(super) title: String,
    pub(super) values: Vec<Vec<f64>>,
    pub(super) exists: Vec<bool>,
}

/// Elements that can be drawn, with their adjacency.
pub struct PartSkin<'a> {
    mesh: &'a Mesh,
    /// Drawn positions of the nodes, m.
    points: std::borrow::Cow<'a, [[f64; 3]]>,
    elements: &'a [u32],
    /// Flags of the elements that can be drawn.
    is_drawn: Vec<bool>,
    surface: OuterSurface,
    cut: Option<Plane>,
}

impl<'a> PartSkin<'a> {
    /// Creates the surface of some elements, cut by a plane.
    ///
    /// # Errors
    /// See [`OuterSurface::new`].
    pub fn new(mesh: &'a Mesh, elements: &'a [u32], cut: Option<Plane>) -> Result<Self, Error> {
        let mut is_drawn = vec![false; mesh.element_count()];
        elements.iter().for_each(|&element| is_drawn[element as usize] = true);
        let points = mesh.points.as_slice().into();
        Ok(Self { mesh, points, elements, is_drawn, surface: OuterSurface::new(mesh)?, cut })
    }

    /// Replaces the drawn positions of the nodes, m.
    pub fn with_points(mut self, points: Vec<[f64; 3]>) -> Self {
        self.points = points.into();
        self
    }

    /// Returns the outer faces of the existing elements and their section by the plane.
    pub fn skin(&self, frame: SolidFrame) -> (String, Skin) {
        let there = |element: u32| {
            let element = element as usize;
            self.is_drawn.get(element) == Some(&true) && frame.exists.get(element) == Some(&true)
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
                    // a wedge is split into three tetrahedra
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

    /// Draws x + 2y over a brick whose last column does not exist yet: outer surface, and section at y = 1.
    #[test]
    fn only_existing_elements_are_drawn() {
        for (cells, quads) in [(CellSplit::Hexahedra, 1), (CellSplit::FiveTetrahedra, 2)] {
            let block = Block { name: "brick".into(), lower: [0.0; 3], upper: [3.0, 2.0, 1.0] };
            let grid = Grid::uniform([0.0; 3], [3.0, 2.0, 1.0], [3, 2, 1]).unwrap();
            let mesh = grid.blocks(&[block], cells).unwrap();
            let all: Vec<u32> = (0..mesh.element_count() as u32).collect();
            let field: Vec<f64> = mesh.points.iter().map(|[x, y, _]| x + 2.0 * y).collect();
            let frame = || SolidFrame {
                title: String::new(),
                values: vec![field.clone()],
                exists: all.iter().map(|&element| mesh.centre(element)[0] < 2.0).collect(),
            };
            let seen = |cut| PartSkin::new(&mesh, &all, cut).unwrap().skin(frame()).1;
            // a box of 2 × 2 × 1 cells: no value beyond its corner
            let whole = seen(None);
            assert_eq!(whole.values(0).count(), 4 * quads * 16, "{cells:?}");
            assert_eq!(whole.values(0).fold(0.0, f64::max), 6.0);
            assert!(whole.values(1).all(f64::is_nan));
            // nothing in front of the cut is drawn: the smallest value is 2 + x on the section
            let cut = View::default().facing(Plane { normal: [0.0, 1.0, 0.0], at: 1.0 });
            assert_eq!(seen(Some(cut)).values(0).fold(f64::INFINITY, f64::min), 2.0);
        }
    }
}
