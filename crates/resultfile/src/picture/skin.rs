//! The visible surface of a solid: faces with values at their corners, cut by a plane.

/// A point of a surface, and the values of one or two fields there; NaN where there is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Position.
    pub at: [f64; 3],
    /// Values of the fields.
    pub values: [f64; 2],
}

/// A plane normal · x = at. It removes points with larger values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Normal vector of any length but 0.
    pub normal: [f64; 3],
    /// Distance from the origin along the normal, in lengths of the normal.
    pub at: f64,
}

/// The position of the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Angle around z, from x towards y; rad.
    pub azimuth: f64,
    /// Angle above the plane of x and y; rad.
    pub elevation: f64,
}

/// The surface of a solid: faces in any order and orientation.
#[derive(Clone, Debug, Default)]
pub struct Skin {
    pub(super) cut: Option<Plane>,
    pub(super) faces: Vec<SkinFace>,
}

/// A triangle (its last corner twice) or a quadrilateral.
#[derive(Clone, Copy, Debug)]
pub(super) struct SkinFace {
    pub(super) at: [[f64; 3]; 4],
    pub(super) values: [[f32; 2]; 4],
    /// Bit k: from corner k to the next one runs an edge.
    pub(super) edges: u8,
}

/// Edges of a hexahedron, its corners in the order of VTK.
const EDGES: [[usize; 2]; 12] =
    [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];

impl Default for View {
    fn default() -> Self {
        Self { azimuth: -60f64.to_radians(), elevation: 25f64.to_radians() }
    }
}

impl View {
    /// Unit vectors to the right, up, and towards the viewer.
    pub(super) fn axes(&self) -> [[f64; 3]; 3] {
        let ((s, c), (up, along)) = (self.azimuth.sin_cos(), self.elevation.sin_cos());
        [[-s, c, 0.0], [-up * c, -up * s, along], [along * c, along * s, up]]
    }

    /// Returns the same plane with its normal towards the viewer: it removes the part in front.
    pub fn facing(&self, plane: Plane) -> Plane {
        if dot(plane.normal, self.axes()[2]) < 0.0 {
            Plane { normal: plane.normal.map(|x| -x), at: -plane.at }
        } else {
            plane
        }
    }
}

impl Plane {
    /// Positive beyond.
    pub(super) fn side(&self, x: [f64; 3]) -> f64 {
        dot(self.normal, x) - self.at
    }

    /// Returns the intersection with the edge from a corner to another one on the other side.
    fn between(&self, a: &Corner, b: &Corner) -> Corner {
        let (from, to) = (self.side(a.at), self.side(b.at));
        let t = from / (from - to);
        let mix = |a: f64, b: f64| a + t * (b - a);
        Corner {
            at: [0, 1, 2].map(|d| mix(a.at[d], b.at[d])),
            values: [0, 1].map(|k| mix(a.values[k], b.values[k])),
        }
    }
}

impl Skin {
    /// Returns an empty surface. A plane cuts all faces that come.
    pub fn new(cut: Option<Plane>) -> Self {
        Self { cut, faces: Vec::new() }
    }

    /// Adds a convex face, corners in order. Faces with a position that is not finite are ignored.
    pub fn face(&mut self, corners: &[Corner]) {
        let Some(plane) = self.cut else { return self.push(corners) };
        let mut kept = Vec::with_capacity(corners.len() + 1);
        for (corner, next) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            let inside = [corner, next].map(|corner| plane.side(corner.at) <= 0.0);
            if inside[0] {
                kept.push(*corner);
            }
            if inside[0] != inside[1] {
                kept.push(plane.between(corner, next));
            }
        }
        self.push(&kept);
    }

    /// Adds the section of the plane through a cell: a tetrahedron (four corners) or a hexahedron (eight
    /// corners, order of VTK).
    pub fn section(&mut self, cell: &[Corner]) {
        let Some(plane) = self.cut else { return };
        let mut found: Vec<Corner> = Vec::new();
        let mut edge = |a: &Corner, b: &Corner| {
            if (plane.side(a.at) <= 0.0) != (plane.side(b.at) <= 0.0) {
                found.push(plane.between(a, b));
            }
        };
        match cell {
            [a, b, c, d] => [[a, b], [a, c], [a, d], [b, c], [b, d], [c, d]].map(|[a, b]| edge(a, b)).len(),
            cell if cell.len() == 8 => EDGES.map(|[a, b]| edge(&cell[a], &cell[b])).len(),
            _ => return,
        };
        // the section of a convex cell is convex: order by angle
        let count = found.len() as f64;
        let middle = [0, 1, 2].map(|d| found.iter().map(|corner| corner.at[d]).sum::<f64>() / count);
        let least = (0..3).min_by(|&a, &b| plane.normal[a].abs().total_cmp(&plane.normal[b].abs()));
        let mut aside = [0.0; 3];
        aside[least.unwrap_or(0)] = 1.0;
        let u = cross(plane.normal, aside);
        let v = cross(plane.normal, u);
        let lengths = [dot(u, u).sqrt(), dot(v, v).sqrt()];
        let angle = |corner: &Corner| {
            let r = minus(corner.at, middle);
            (dot(r, v) / lengths[1]).atan2(dot(r, u) / lengths[0])
        };
        found.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
        self.push(&found);
    }

    /// Values of a field at the corners of all faces.
    pub fn values(&self, field: usize) -> impl Iterator<Item = f64> {
        self.faces.iter().flat_map(move |face| face.values.map(|values| f64::from(values[field.min(1)])))
    }

    /// A fan of quadrilaterals, the last perhaps a triangle.
    fn push(&mut self, corners: &[Corner]) {
        let count = corners.len();
        if count < 3 || corners.iter().any(|corner| corner.at.iter().any(|x| !x.is_finite())) {
            return;
        }
        for first in (1..count - 1).step_by(2) {
            let last = (first + 2).min(count - 1);
            let four = [corners[0], corners[first], corners[first + 1], corners[last]];
            // inner sides of the fan are not edges, nor is the side of length 0 of a triangle
            let edges = [first == 1, true, last > first + 1, last == count - 1];
            self.faces.push(SkinFace {
                at: four.map(|corner| corner.at),
                values: four.map(|corner| corner.values.map(|value| value as f32)),
                edges: (0..4).map(|k| u8::from(edges[k]) << k).sum(),
            });
        }
    }
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|d| a[d] - b[d])
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twice the area of all faces, and the greatest error of their values against a field.
    fn measure(skin: &Skin, field: impl Fn([f64; 3]) -> f64) -> (f64, f64) {
        let (mut twice, mut error) = (0.0, 0.0_f64);
        for face in &skin.faces {
            let normal = cross(minus(face.at[2], face.at[0]), minus(face.at[3], face.at[1]));
            twice += dot(normal, normal).sqrt();
            for (at, values) in face.at.iter().zip(&face.values) {
                error = error.max((f64::from(values[0]) - field(*at)).abs());
            }
        }
        (twice, error)
    }

    /// Sections of bricks and of the tetrahedra in them, by planes through corners, edges and insides, have
    /// the area that a box has there, and the linear field that is at the corners.
    #[test]
    fn sections_fill_the_plane() {
        let field = |x: [f64; 3]| 1.0 + 2.0 * x[0] - x[1] + 0.5 * x[2];
        // 3 × 2 × 2 unit cells
        let corner = |x: usize, y: usize, z: usize| {
            let at = [x, y, z].map(|x| x as f64);
            Corner { at, values: [field(at), 0.0] }
        };
        let mut cells = Vec::new();
        for (i, j, k) in (0..12).map(|n| (n % 3, n / 3 % 2, n / 6)) {
            let lower = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
            cells.push([k, k + 1].map(|z| lower.map(|[x, y]| corner(x, y, z))).concat());
        }
        // six tetrahedra around the diagonal from corner 0 to corner 6
        let around = [1, 2, 3, 7, 4, 5];
        let parts = |cell: &Vec<Corner>| {
            (0..6)
                .map(|n| [0, 6, around[n], around[(n + 1) % 6]].map(|k| cell[k]).to_vec())
                .collect::<Vec<_>>()
        };
        let tetrahedra: Vec<Vec<Corner>> = cells.iter().flat_map(parts).collect();
        let half = 0.5f64.sqrt();
        for (normal, at, area) in [
            ([0.0, 1.0, 0.0], 1.0, 6.0),
            ([0.0, -1.0, 0.0], -1.0, 6.0),
            ([0.0, 3.0, 0.0], 1.5, 6.0),
            ([half, 0.0, half], 2.0 * half, 4.0 / half),
            ([half, 0.0, -half], 0.25 * half, 4.0 / half),
            ([1.0, 0.0, 0.0], 3.0, 0.0),
            ([1.0, 0.0, 0.0], -1.0, 0.0),
        ] {
            for cells in [&cells, &tetrahedra] {
                let mut skin = Skin::new(Some(Plane { normal, at }));
                cells.iter().for_each(|cell| skin.section(cell));
                let (twice, error) = measure(&skin, field);
                assert!((twice - 2.0 * area).abs() < 1e-12, "{normal:?} {at}: {twice}");
                assert!(error < 1e-6, "{normal:?} {at}: {error}");
            }
        }
    }

    /// A face that the plane crosses keeps one side, with an edge along the cut.
    #[test]
    fn faces_are_clipped() {
        let corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [0.0, 1.0]]
            .map(|[x, y]| Corner { at: [x, y, 0.0], values: [x, 0.0] });
        for (at, area) in [(5.0, 4.0), (4.0, 4.0), (3.0, 3.0), (0.5, 0.5), (-1.0, 0.0)] {
            let mut skin = Skin::new(Some(Plane { normal: [1.0, 0.0, 0.0], at }));
            skin.face(&corners);
            let (twice, error) = measure(&skin, |x| x[0]);
            assert!((twice - 2.0 * area).abs() < 1e-12 && error < 1e-6, "{at}: {twice} {error}");
            assert!(skin.faces.iter().all(|face| face.edges == 0b1111));
        }
        // a corner cut off leaves five: a quadrilateral and a triangle, whose common side is no edge
        let mut skin = Skin::new(Some(Plane { normal: [1.0, 4.0, 0.0], at: 6.0 }));
        skin.face(&corners);
        assert_eq!(skin.faces.iter().map(|face| face.edges).collect::<Vec<_>>(), [0b0111, 0b1010]);
        assert!((measure(&skin, |x| x[0]).0 - 2.0 * 3.5).abs() < 1e-12);
    }
}
