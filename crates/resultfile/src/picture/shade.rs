//! Rendering of faces: parallel projection, depth buffer, light and colour.

use super::canvas::Canvas;
use super::skin::{Skin, SkinFace, cross, dot, minus};
use super::strips::Strip;

/// Samples along a pixel's side.
const SAMPLES: usize = 2;
/// Brightness of a face that the lamp does not reach.
const AMBIENT: f64 = 0.65;
/// Direction of the lamp: right, up, towards the viewer.
const LAMP: [f64; 3] = [-0.45, 0.8, 0.9];
/// Loss of brightness at an edge; edges fade between these lengths of the shortest side, pixels.
const EDGE: f64 = 0.35;
const SHORT: f64 = 3.0;
const LONG: f64 = 12.0;
const NONE: u32 = u32::MAX;

/// A parallel projection.
#[derive(Clone, Copy, Debug)]
pub(super) struct Camera {
    /// Unit vectors to the right, up, and towards the viewer.
    pub(super) axes: [[f64; 3]; 3],
    /// The origin of the projection.
    pub(super) centre: [f64; 3],
    /// Left and upper end of the picture.
    pub(super) corner: [f64; 2],
    /// Pixels per unit of length.
    pub(super) scale: f64,
}

/// The visible face of each sample.
pub(super) struct Sight<'a> {
    skin: &'a Skin,
    camera: Camera,
    /// Width and height, pixels.
    size: [usize; 2],
    depth: Vec<f32>,
    /// Twice the face, and one more in its second triangle.
    seen: Vec<u32>,
    /// Returns whether any sample shows a face.
    visible: Vec<bool>,
}

/// A projected face.
struct Flat {
    corners: [[f64; 3]; 4],
    light: f64,
    /// Loss of brightness at its edges, and the edges: a point, a direction, the limit of the cross product
    /// with both.
    edge: f64,
    edges: [Option<[f64; 5]>; 4],
}

/// The triangles of a face, by its corners.
const HALVES: [[usize; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

impl Camera {
    /// Samples from the left and from the top, and towards the viewer.
    fn place(&self, x: [f64; 3]) -> [f64; 3] {
        let r = minus(x, self.centre);
        let scale = SAMPLES as f64 * self.scale;
        let [x, y, z] = self.axes.map(|axis| dot(axis, r));
        [(x - self.corner[0]) * scale, (self.corner[1] - y) * scale, z * scale]
    }
}

impl<'a> Sight<'a> {
    pub(super) fn new(skin: &'a Skin, camera: Camera, size: [usize; 2]) -> Self {
        let samples = SAMPLES * SAMPLES * size[0] * size[1];
        let (depth, seen) = (vec![f32::NEG_INFINITY; samples], vec![NONE; samples]);
        let mut sight = Self { skin, camera, size, depth, seen, visible: vec![false; skin.faces.len()] };
        let pixels = size.map(|size| SAMPLES * size);
        for (index, face) in skin.faces.iter().enumerate().take((NONE / 2) as usize) {
            let corners = face.at.map(|x| camera.place(x));
            for (half, three) in HALVES.iter().enumerate() {
                let three = three.map(|k| corners[k]);
                covered(three, pixels, |at, _, weights| {
                    let depth = (0..3).map(|k| weights[k] * three[k][2]).sum::<f64>() as f32;
                    if depth > sight.depth[at] {
                        (sight.depth[at], sight.seen[at]) = (depth, (2 * index + half) as u32);
                    }
                });
            }
        }
        for &seen in sight.seen.iter().filter(|&&seen| seen != NONE) {
            sight.visible[(seen / 2) as usize] = true;
        }
        sight
    }

    fn flat(&self, face: &SkinFace) -> Flat {
        let corners = face.at.map(|x| self.camera.place(x));
        let normal = cross(minus(corners[2], corners[0]), minus(corners[3], corners[1]));
        // the visible side is the outside; y points down
        let toward = if normal[2] < 0.0 { -1.0 } else { 1.0 };
        let lamp = [LAMP[0], -LAMP[1], LAMP[2]];
        let size = (dot(normal, normal) * dot(lamp, lamp)).sqrt();
        let lit = if size > 0.0 { (toward * dot(normal, lamp) / size).max(0.0) } else { 1.0 };
        let sides =
            (0..4).map(|k| minus(face.at[(k + 1) % 4], face.at[k])).map(|side| dot(side, side).sqrt());
        let shortest = sides.filter(|&side| side > 0.0).fold(f64::INFINITY, f64::min) * self.camera.scale;
        let edge = EDGE * ((shortest - SHORT) / (LONG - SHORT)).clamp(0.0, 1.0);
        let line = |k: usize| {
            let [a, b] = [corners[k], corners[(k + 1) % 4]];
            let [x, y] = [b[0] - a[0], b[1] - a[1]];
            // half a pixel
            (edge > 0.0 && face.edges >> k & 1 == 1)
                .then(|| [a[0], a[1], x, y, 0.5 * SAMPLES as f64 * x.hypot(y)])
        };
        let edges = [line(0), line(1), line(2), line(3)];
        Flat { corners, light: AMBIENT + (1.0 - AMBIENT) * lit, edge, edges }
    }

    /// Paints one field at a place; returns whether visible values lie below, above its range.
    pub(super) fn paint(
        &self,
        field: usize,
        strip: &Strip,
        canvas: &mut Canvas,
        x: isize,
        y: isize,
    ) -> [bool; 2] {
        let [width, height] = self.size;
        let (low, high) = strip.range;
        // values have single precision
        let room = 1e-6 * (high - low);
        let mut beyond = [false; 2];
        let pixels = [SAMPLES * width, SAMPLES * height];
        let mut colors = vec![[255; 3]; pixels[0] * pixels[1]];
        for (index, face) in self.skin.faces.iter().enumerate().filter(|(index, _)| self.visible[*index]) {
            let flat = self.flat(face);
            for (half, three) in HALVES.iter().enumerate() {
                let seen = (2 * index + half) as u32;
                let values = three.map(|k| f64::from(face.values[k][field]));
                covered(three.map(|k| flat.corners[k]), pixels, |at, p, weights| {
                    if self.seen[at] != seen {
                        return;
                    }
                    let value = (0..3).map(|k| weights[k] * values[k]).sum::<f64>();
                    beyond = [beyond[0] || value < low - room, beyond[1] || value > high + room];
                    let color = strip.colors.color_at((value - low) / (high - low));
                    let light = if flat.is_edge(p) { flat.light * (1.0 - flat.edge) } else { flat.light };
                    colors[at] = color.map(|channel| (light * f64::from(channel) + 0.5) as u8);
                });
            }
        }
        for (row, column) in (0..height).flat_map(|row| (0..width).map(move |column| (row, column))) {
            let samples = (0..SAMPLES * SAMPLES)
                .map(|k| (SAMPLES * row + k / SAMPLES) * pixels[0] + SAMPLES * column + k % SAMPLES);
            if samples.clone().any(|at| self.seen[at] != NONE) {
                let sum = |k: usize| samples.clone().map(|at| u32::from(colors[at][k])).sum::<u32>();
                let count = (SAMPLES * SAMPLES) as u32;
                let color = [0, 1, 2].map(|k| ((sum(k) + count / 2) / count) as u8);
                canvas.set(x + column as isize, y + row as isize, color);
            }
        }
        beyond
    }
}

/// Calls `each` with the samples of a triangle: index, place, barycentric coordinates.
fn covered(
    corners: [[f64; 3]; 3],
    [width, height]: [usize; 2],
    mut each: impl FnMut(usize, [f64; 2], [f64; 3]),
) {
    let [a, b, c] = corners;
    let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    // a triangle without area has no samples
    if !area.is_finite() || area.abs() < 1e-9 {
        return;
    }
    let range = |axis: usize, limit: usize| {
        let low = a[axis].min(b[axis]).min(c[axis]);
        let high = a[axis].max(b[axis]).max(c[axis]);
        // samples lie in the middle of their squares
        ((low - 0.5).ceil().max(0.0) as usize)..((high + 0.5).floor().max(0.0) as usize).min(limit)
    };
    let across = range(0, width);
    for y in range(1, height) {
        for x in across.clone() {
            let p = [x as f64 + 0.5, y as f64 + 0.5];
            let twice =
                |b: [f64; 3], c: [f64; 3]| (b[0] - p[0]) * (c[1] - p[1]) - (b[1] - p[1]) * (c[0] - p[0]);
            let (u, v) = (twice(b, c) / area, twice(c, a) / area);
            let weights = [u, v, 1.0 - u - v];
            // both neighbours take samples on their common side: no hole, the first one wins
            if weights.iter().all(|&weight| weight >= -1e-9) {
                each(y * width + x, p, weights);
            }
        }
    }
}

impl Flat {
    /// Returns whether a sample lies within half a pixel of an edge.
    fn is_edge(&self, p: [f64; 2]) -> bool {
        let near =
            |[x, y, along, across, most]: [f64; 5]| (along * (p[1] - y) - across * (p[0] - x)).abs() < most;
        self.edges.into_iter().flatten().any(near)
    }
}

#[cfg(test)]
mod tests {
    use super::super::color::{ColorMap, MISSING};
    use super::super::skin::{Corner, Plane, View};
    use super::*;

    const SIZE: usize = 400;
    const SCALE: f64 = 180.0;

    fn camera(view: View) -> Camera {
        let half = 0.5 * SIZE as f64 / SCALE;
        Camera { axes: view.axes(), centre: [0.5; 3], corner: [-half, half], scale: SCALE }
    }

    fn strip() -> Strip {
        Strip { label: String::new(), range: (0.0, 1.0), colors: ColorMap::Viridis }
    }

    /// Returns the unit cube, each side of another value; edges are too few pixels away to matter in the
    /// middle of a side.
    fn cube(cut: Option<Plane>) -> Skin {
        let mut skin = Skin::new(cut);
        for side in 0..6 {
            let (axis, values) = (side / 2, [0.2 * side as f64, f64::NAN]);
            let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[u, v]| {
                let mut at = [(side % 2) as f64; 3];
                (at[(axis + 1) % 3], at[(axis + 2) % 3]) = (u, v);
                Corner { at, values }
            });
            skin.face(&corners);
        }
        skin
    }

    fn views() -> [View; 4] {
        [[-60.0, 25.0], [30.0, 0.0], [200.0, -35.0], [-90.0, 90.0]]
            .map(|[a, e]: [f64; 2]| View { azimuth: a.to_radians(), elevation: e.to_radians() })
    }

    /// A cube covers Σ |n_d| times the square of its side, n towards the viewer, and is Σ |e_d| wide and
    /// high: the axes are equal.
    #[test]
    fn a_cube_covers_what_it_must() {
        for view in views() {
            let camera = camera(view);
            let skin = cube(None);
            let sight = Sight::new(&skin, camera, [SIZE; 2]);
            let side = SAMPLES as f64 * SCALE;
            let seen = sight.seen.iter().filter(|&&seen| seen != NONE).count() as f64;
            let [wide, high, area] = view.axes().map(|axis| axis.iter().map(|x| x.abs()).sum::<f64>());
            assert!((seen / (side * side) / area - 1.0).abs() < 5e-3, "{view:?} {seen}");
            let places = |of: fn(usize) -> usize| {
                let places = sight.seen.iter().enumerate().filter(|(_, seen)| **seen != NONE);
                let places = places.map(|(at, _)| of(at));
                (places.clone().max().unwrap() + 1 - places.min().unwrap()) as f64
            };
            assert!((places(|at| at % (SAMPLES * SIZE)) - side * wide).abs() <= 1.0, "{view:?}");
            assert!((places(|at| at / (SAMPLES * SIZE)) - side * high).abs() <= 1.0, "{view:?}");
        }
    }

    /// The middle of each visible side: its colour times its light, by the cosine law.
    #[test]
    fn sides_have_their_colour_and_light() {
        for view in views() {
            let (camera, skin, axes) = (camera(view), cube(None), view.axes());
            let mut canvas = Canvas::new(SIZE, SIZE);
            Sight::new(&skin, camera, [SIZE; 2]).paint(0, &strip(), &mut canvas, 0, 0);
            let lamp = dot(LAMP, LAMP).sqrt();
            for side in 0..6 {
                let (axis, sign) = (side / 2, if side % 2 == 0 { -1.0 } else { 1.0 });
                let normal = axes.map(|across| sign * across[axis]);
                if normal[2] < 0.05 {
                    continue;
                }
                let mut middle = [0.5; 3];
                middle[axis] = (side % 2) as f64;
                let [x, y, _] = camera.place(middle).map(|x| (x / SAMPLES as f64) as usize);
                let light = AMBIENT + (1.0 - AMBIENT) * (dot(normal, LAMP) / lamp).max(0.0);
                let color = ColorMap::Viridis.color_at(0.2 * side as f64).map(|x| light * f64::from(x));
                let found = canvas.get(x, y);
                assert!(
                    (0..3).all(|k| (f64::from(found[k]) - color[k]).abs() <= 1.0),
                    "{view:?} {side} {found:?}"
                );
            }
        }
    }

    /// The nearest face is shown, in any order of faces.
    #[test]
    fn the_nearest_face_is_seen() {
        let square = |y: f64, size: f64, value: f64| {
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
                .map(|[x, z]| Corner { at: [0.5 + size * x, y, 0.5 + size * z], values: [value; 2] })
        };
        let view = View { azimuth: -90f64.to_radians(), elevation: 0.0 };
        let (near, far) = (square(0.0, 0.2, 0.0), square(1.0, 0.8, 1.0));
        for order in [[&near, &far], [&far, &near]] {
            let mut skin = Skin::new(None);
            order.iter().for_each(|face| skin.face(*face));
            let mut canvas = Canvas::new(SIZE, SIZE);
            Sight::new(&skin, camera(view), [SIZE; 2]).paint(1, &strip(), &mut canvas, 0, 0);
            let light = AMBIENT + (1.0 - AMBIENT) * LAMP[2] / dot(LAMP, LAMP).sqrt();
            for (x, value) in [(200, 0.0), (200 + 30, 0.0), (200 + 60, 1.0)] {
                let color = ColorMap::Viridis.color_at(value).map(|x| (light * f64::from(x)).round() as u8);
                assert_eq!(canvas.get(x, 200), color, "{x}");
            }
            assert_eq!(canvas.get(399, 200), [255; 3]);
        }
    }

    /// Values that are none are grey; faces that are none are nothing; what lies beyond a range is told.
    #[test]
    fn odd_faces() {
        let view = View { azimuth: 0.0, elevation: 90f64.to_radians() };
        let corner = |x: f64, y: f64, value: f64| Corner { at: [x, y, 0.0], values: [value, f64::NAN] };
        let mut skin = Skin::new(None);
        let paint = |skin: &Skin, field: usize| {
            let mut canvas = Canvas::new(SIZE, SIZE);
            let beyond = Sight::new(skin, camera(view), [SIZE; 2]).paint(field, &strip(), &mut canvas, 0, 0);
            (canvas.get(200, 200), beyond)
        };
        assert_eq!(paint(&skin, 0), ([255; 3], [false; 2]));
        skin.face(&[]);
        skin.face(&[corner(0.0, 0.0, 1.0), corner(1.0, 1.0, 1.0)]);
        skin.face(&[corner(f64::NAN, 0.0, 1.0), corner(1.0, 0.0, 1.0), corner(1.0, 1.0, 1.0)]);
        skin.face(&[corner(0.5, 0.5, 1.0); 4]);
        skin.face(&[corner(0.0, 0.5, 1.0), corner(0.2, 0.5, 1.0), corner(0.9, 0.5, 1.0)]);
        assert_eq!(paint(&skin, 0), ([255; 3], [false; 2]));
        skin.face(&[
            corner(0.0, 0.0, -1.0),
            corner(1.0, 0.0, 2.0),
            corner(1.0, 1.0, 2.0),
            corner(0.0, 1.0, -1.0),
        ]);
        assert_eq!(paint(&skin, 0).1, [true; 2]);
        let light = AMBIENT + (1.0 - AMBIENT) * LAMP[2] / dot(LAMP, LAMP).sqrt();
        assert_eq!(paint(&skin, 1), (MISSING.map(|x| (light * f64::from(x)).round() as u8), [false; 2]));
    }

    /// Without its front half the cube shows the back side's inside, and where cells are cut, what they hold
    /// there.
    #[test]
    fn a_cut_shows_the_inside() {
        let view = View::default();
        let plane = view.facing(Plane { normal: [0.0, 2.0, 0.0], at: 1.0 });
        assert_eq!(plane, Plane { normal: [0.0, -2.0, 0.0], at: -1.0 });
        let mut skin = cube(Some(plane));
        let values = |value: f64| [value, 0.0];
        // a hexahedron with the field (x + z)/2
        let cell = [
            [0., 0., 0.],
            [1., 0., 0.],
            [1., 1., 0.],
            [0., 1., 0.],
            [0., 0., 1.],
            [1., 0., 1.],
            [1., 1., 1.],
            [0., 1., 1.],
        ];
        skin.section(&cell.map(|at: [f64; 3]| Corner { at, values: values(0.5 * (at[0] + at[2])) }));
        let camera = camera(view);
        let mut canvas = Canvas::new(SIZE, SIZE);
        Sight::new(&skin, camera, [SIZE; 2]).paint(0, &strip(), &mut canvas, 0, 0);
        let normal = view.axes().map(|across| -across[1]);
        let light = AMBIENT + (1.0 - AMBIENT) * (dot(normal, LAMP) / dot(LAMP, LAMP).sqrt()).max(0.0);
        for [x, z] in [[0.5, 0.5], [0.2, 0.3], [0.7, 0.9]] {
            let [i, j, _] = camera.place([x, 0.5, z]).map(|x| (x / SAMPLES as f64) as usize);
            let color = ColorMap::Viridis.color_at(0.5 * (x + z)).map(|x| light * f64::from(x));
            let found = canvas.get(i, j);
            assert!(
                (0..3).all(|k| (f64::from(found[k]) - color[k]).abs() <= 2.0),
                "{x} {z}: {found:?} {color:?}"
            );
        }
    }
}
