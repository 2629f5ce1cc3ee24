//! Closed surfaces of triangles (STL), and the cells inside them.
//!
//! A reader of our own: `stl_io` 0.11 tells text from bytes by their first word, which binary files of some programs share,
//! and its errors name no line.

use std::collections::HashMap;
use std::path::Path;

use crate::error::Error;
use crate::mesh::labelled::line_error;
use crate::mesh::voxels::{Frame, Voxels};
use nalgebra::Vector3;

/// Columns of rays in a cell along each axis: filled parts are exact along z and to about 1/8² across.
const RAYS: usize = 8;
/// By how much rays miss the middles of their part of a cell, in parts of it: edges lie on middles, seldom here.
const ASIDE: [f64; 2] = [1.3e-4, 0.7e-4];

/// A closed surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Stl {
    /// Corners, m, each once.
    pub points: Vec<[f64; 3]>,
    /// Their numbers, anticlockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Volume inside, m³.
    pub volume: f64,
    /// What should be looked at.
    pub notes: Vec<String>,
}

/// Reads an STL file, ASCII or binary, coordinates multiplied by `scale` (1e-3 for a file in mm: the format has no unit), and
/// checks that it is closed. Normals of the file are not used.
///
/// # Errors
/// [`Error::Shared`] where the file cannot be read; [`Error::File`] with the line of text, or the byte, for what is no STL;
/// [`Error::Mesh`] for edges of one triangle or of more than two, triangles that face opposite ways, and no volume.
pub fn read(path: &Path, scale: f64) -> Result<Stl, Error> {
    parse(path, &super::read_bytes(path)?, scale)
}

/// [`read`], of bytes; `path` is for messages only.
///
/// # Errors
/// See [`read`].
pub fn parse(path: &Path, bytes: &[u8], scale: f64) -> Result<Stl, Error> {
    if !(scale > 0.0 && scale.is_finite()) {
        let allowed = "positive and finite, m per unit of the file".into();
        return Err(Error::Parameter { name: "scale of the mesh", found: scale, allowed });
    }
    // 80 bytes, the number of triangles, 50 bytes each: no text has this length by chance
    let announced = bytes.get(80..84).and_then(|four| four.try_into().ok()).map(u32::from_le_bytes);
    let binary = announced.filter(|count| bytes.len() as u64 == 84 + 50 * u64::from(*count));
    let corners = match binary {
        Some(_) => bytes[84..].chunks_exact(50).flat_map(of_triangle).collect(),
        None => text(path, bytes, announced)?,
    };
    let mut numbers: HashMap<[u32; 3], u32> = HashMap::new();
    let mut points = Vec::new();
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    let mut thin = 0;
    for three in corners.chunks_exact(3) {
        let mut triangle = [0; 3];
        for (own, corner) in triangle.iter_mut().zip(three) {
            if corner.iter().any(|x: &f32| !x.is_finite()) {
                let found = format!("{corner:?}");
                return Err(line_error(path, 1, "corner of a triangle", found, "finite numbers"));
            }
            // −0 is 0
            let key = corner.map(|x| (x + 0.0).to_bits());
            *own = *numbers.entry(key).or_insert_with(|| {
                points.push(corner.map(|x| f64::from(x) * scale));
                points.len() as u32 - 1
            });
        }
        let [a, b, c] = triangle;
        if a == b || b == c || c == a {
            thin += 1;
        } else {
            triangles.push(triangle);
        }
    }
    let mut notes = Vec::new();
    if thin > 0 {
        notes.push(format!("{thin} triangles with two equal corners are left out"));
    }
    closed(path, &points, &triangles)?;
    let at = |n: u32| Vector3::from(points[n as usize]) - Vector3::from(points[0]);
    let six: f64 = triangles.iter().map(|&[a, b, c]| at(a).cross(&at(b)).dot(&at(c))).sum();
    if six < 0.0 {
        notes.push("triangles are clockwise seen from outside: turned".to_owned());
        triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    }
    let volume = six.abs() / 6.0;
    if volume > 0.0 && volume.is_finite() {
        return Ok(Stl { points, triangles, volume, notes });
    }
    Err(Error::Mesh(format!("{}: volume {volume} m³; allowed: above 0", path.display())))
}

/// Corners of a binary triangle, after its normal.
fn of_triangle(bytes: &[u8]) -> [[f32; 3]; 3] {
    let number = |k: usize| bytes[4 * k..].first_chunk().map_or(f32::NAN, |four| f32::from_le_bytes(*four));
    [3, 6, 9].map(|k| [number(k), number(k + 1), number(k + 2)])
}

/// Corners of the triangles of a text.
fn text(path: &Path, bytes: &[u8], announced: Option<u32>) -> Result<Vec<[f32; 3]>, Error> {
    if !bytes.trim_ascii_start().starts_with(b"solid") {
        let found = format!("{} bytes, of {} triangles", bytes.len(), announced.unwrap_or(0));
        let allowed =
            "text that begins with `solid`, or bytes: 84 and 50 for each triangle that bytes 81 to 84 count";
        return Err(line_error(path, 1, "STL", found, allowed));
    }
    let (mut corners, mut begun, mut last) = (Vec::new(), 0, 1);
    for (line, text) in (1..).zip(bytes.split(|byte| *byte == b'\n')) {
        let text = String::from_utf8_lossy(text);
        let mut words = text.split_whitespace();
        last = line;
        match words.next().map(str::to_lowercase).as_deref() {
            Some("vertex") => {
                let numbers: Vec<f32> = words.filter_map(|word| word.parse().ok()).collect();
                let [x, y, z] = numbers[..] else {
                    return Err(line_error(path, line, "vertex", text.trim(), "three numbers"));
                };
                corners.push([x, y, z]);
            }
            Some("facet") => begun = corners.len(),
            Some("endfacet") if corners.len() != begun + 3 => {
                let found = corners.len() - begun;
                return Err(line_error(path, line, "vertices of a facet", found, "3"));
            }
            None | Some("solid" | "endsolid" | "outer" | "endloop" | "endfacet") => {}
            Some(_) => {
                let allowed = "solid, facet, outer loop, vertex, endloop, endfacet, endsolid";
                return Err(line_error(path, line, "line of an STL", text.trim(), allowed));
            }
        }
    }
    if corners.is_empty() || corners.len() % 3 != 0 {
        return Err(line_error(path, last, "vertices", corners.len(), "3 of each facet, 1 facet or more"));
    }
    Ok(corners)
}

/// Every edge belongs to two triangles, which pass along it in opposite directions.
fn closed(path: &Path, points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<(), Error> {
    let mut edges: HashMap<[u32; 2], [u32; 2]> = HashMap::new();
    for &[a, b, c] in triangles {
        for [p, q] in [[a, b], [b, c], [c, a]] {
            edges.entry([p.min(q), p.max(q)]).or_default()[usize::from(p > q)] += 1;
        }
    }
    let mut wrong: Vec<([u32; 2], [u32; 2])> =
        edges.into_iter().filter(|(_, count)| *count != [1, 1]).collect();
    wrong.sort_unstable();
    let Some((ends, _)) = wrong.first() else { return Ok(()) };
    let count = |is: &dyn Fn(u32, u32) -> bool| wrong.iter().filter(|(_, [a, b])| is(*a, *b)).count();
    let open = count(&|a, b| a + b == 1);
    let many = count(&|a, b| a + b > 2);
    let turned = count(&|a, b| a + b == 2);
    let [p, q] = ends.map(|node| points[node as usize].map(|x| (1e9 * x).round() / 1e6));
    Err(Error::Mesh(format!(
        "{}: not a closed surface: {open} edges of one triangle, {many} of more than two, {turned} of two that face opposite ways, the \
         first from {p:?} to {q:?} mm; allowed: 0 (repair it where it was drawn)",
        path.display()
    )))
}

impl Stl {
    /// Box around it, m.
    pub fn bounds(&self) -> [[f64; 3]; 2] {
        let first = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        self.points.iter().fold(first, |[mut low, mut high], point| {
            for d in 0..3 {
                (low[d], high[d]) = (low[d].min(point[d]), high[d].max(point[d]));
            }
            [low, high]
        })
    }

    /// Cells along each axis of the grid around it, before any of them is made.
    ///
    /// # Errors
    /// See [`Self::voxels`].
    pub fn cells(&self, size: [f64; 3]) -> Result<[f64; 3], Error> {
        let [low, high] = self.bounds();
        Ok(Frame::around(low, high, size)?.counts().map(|count| count as f64))
    }

    /// The cells inside, from multiples of `size` on: along 8 × 8 rays in z through each column of cells, the surface is
    /// crossed inwards and outwards in turn, and a cell is filled where a ray is inside. Cells filled to less than `least` are left out.
    ///
    /// # Errors
    /// A size that is not positive, more cells than can be numbered, a least part that no cell reaches.
    pub fn voxels(&self, size: [f64; 3], least: f64) -> Result<Voxels, Error> {
        let [low, high] = self.bounds();
        let frame = Frame::around(low, high, size)?;
        let [nx, ny, nz] = frame.counts();
        let rays = [nx * RAYS, ny * RAYS];
        // crossings of each ray, in units of cells
        let mut crossings: Vec<Vec<f32>> = vec![Vec::new(); rays[0] * rays[1]];
        let points: Vec<[f64; 3]> =
            self.points.iter().map(|point| [0, 1, 2].map(|d| frame.units(point[d], d))).collect();
        let place = |k: usize, d: usize| (k as f64 + 0.5 + ASIDE[d]) / RAYS as f64;
        for triangle in &self.triangles {
            let corners = triangle.map(|n| points[n as usize]);
            let range = |d: usize| {
                let ends = corners.map(|corner| corner[d] * RAYS as f64 - 0.5 - ASIDE[d]);
                let low = ends.into_iter().fold(f64::INFINITY, f64::min).ceil().max(0.0) as usize;
                let high = ends.into_iter().fold(f64::NEG_INFINITY, f64::max).floor();
                low..((high + 1.0).max(0.0) as usize).min(rays[d])
            };
            for (i, j) in range(0).flat_map(|i| range(1).map(move |j| (i, j))) {
                if let Some(z) = crossing(triangle, &points, [place(i, 0), place(j, 1)]) {
                    crossings[i + rays[0] * j].push(z as f32);
                }
            }
        }
        let whole: f64 = size.iter().product();
        let part = whole / (RAYS * RAYS) as f64;
        let mut filled = vec![0.0; nx * ny * nz];
        for (ray, crossings) in crossings.iter_mut().enumerate() {
            let column = (ray % rays[0]) / RAYS + nx * (ray / rays[0] / RAYS);
            crossings.sort_unstable_by(f32::total_cmp);
            for pair in crossings.chunks_exact(2) {
                let [from, to] = [f64::from(pair[0]), f64::from(pair[1])];
                for k in (from.floor().max(0.0) as usize)..(to.ceil().max(0.0) as usize).min(nz) {
                    let inside = to.min(k as f64 + 1.0) - from.max(k as f64);
                    filled[column + nx * ny * k] += part * inside.max(0.0);
                }
            }
        }
        Ok(frame.voxels(&filled, least, self.volume)?.0)
    }
}

/// Where a triangle crosses a ray along z; `None` where it does not. An edge gives its two triangles the same sign, so that the
/// ray crosses one of them.
fn crossing(triangle: &[u32; 3], points: &[[f64; 3]], at: [f64; 2]) -> Option<f64> {
    let side = |p: u32, q: u32| {
        let [low, high] = [p.min(q), p.max(q)].map(|n| points[n as usize]);
        let cross = (high[0] - low[0]) * (at[1] - low[1]) - (high[1] - low[1]) * (at[0] - low[0]);
        if p < q { cross } else { -cross }
    };
    let &[a, b, c] = triangle;
    let sides = [side(b, c), side(c, a), side(a, b)];
    let sum: f64 = sides.iter().sum();
    let inside = sides.iter().all(|side| *side > 0.0) || sides.iter().all(|side| *side < 0.0);
    inside.then(|| triangle.iter().zip(sides).map(|(&n, side)| side / sum * points[n as usize][2]).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(bytes: &[u8]) -> Result<Stl, Error> {
        parse(Path::new("a.stl"), bytes, 1e-3)
    }

    /// Triangles of a box.
    fn brick(size: [f32; 3]) -> Vec<[[f32; 3]; 3]> {
        let corner = |k: usize| [0, 1, 2].map(|d| if k >> d & 1 == 1 { size[d] } else { 0.0 });
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).map(|t| t.map(corner)).collect()
    }

    fn ascii(triangles: &[[[f32; 3]; 3]]) -> String {
        let corner = |[x, y, z]: [f32; 3]| format!("   vertex {x:e} {y} {z}\n");
        let facet = |t: &[[f32; 3]; 3]| {
            format!(" facet normal 0 0 0\n  outer loop\n{}  endloop\n endfacet\n", t.map(corner).concat())
        };
        format!("solid part\n{}endsolid part\n", triangles.iter().map(facet).collect::<String>())
    }

    fn binary(triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
        // the word of a text at the beginning, as some programs write it
        let mut bytes = b"solid but binary".to_vec();
        bytes.resize(80, b' ');
        bytes.extend((triangles.len() as u32).to_le_bytes());
        for triangle in triangles {
            bytes.extend([0; 12]);
            bytes.extend(triangle.iter().flatten().flat_map(|x| x.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    }

    /// A sphere of radius 5 about (5, 5, 5) by splitting an octahedron five times.
    fn sphere() -> Vec<[[f32; 3]; 3]> {
        let unit = |d: usize, s: f64| Vector3::from([0, 1, 2].map(|e| if e == d { s } else { 0.0 }));
        let mut all = Vec::new();
        for (x, y, z) in (0..8).map(|k| (k & 1, k >> 1 & 1, k >> 2)) {
            let sign = |k: i32| f64::from(1 - 2 * k);
            let [a, b, c] = [unit(0, sign(x)), unit(1, sign(y)), unit(2, sign(z))];
            all.push(if (x + y + z) % 2 == 0 { [a, b, c] } else { [a, c, b] });
        }
        for _ in 0..5 {
            let parts = all.iter().flat_map(|&[a, b, c]| {
                let [d, e, f] = [(a + b).normalize(), (b + c).normalize(), (c + a).normalize()];
                [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
            });
            all = parts.collect();
        }
        all.iter().map(|t| t.map(|p| [0, 1, 2].map(|d| (5.0 + 5.0 * p[d]) as f32))).collect()
    }

    #[test]
    fn text_and_bytes_are_one_surface() {
        let triangles = brick([3.0, 2.0, 1.0]);
        let [text, bytes] =
            [ascii(&triangles).into_bytes(), binary(&triangles)].map(|all| parsed(&all).unwrap());
        assert_eq!(text, bytes);
        assert_eq!((text.points.len(), text.triangles.len(), text.notes.len()), (8, 12, 0));
        assert!((text.volume - 6e-9).abs() < 1e-22);
        // inside out
        let turned: Vec<_> = triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
        let turned = parsed(&binary(&turned)).unwrap();
        assert!((turned.volume - 6e-9).abs() < 1e-22 && turned.notes[0].contains("turned"));
    }

    #[test]
    fn a_box_fills_its_cells() {
        let stl = parsed(&binary(&brick([3.0, 2.0, 1.0]))).unwrap();
        let voxels = stl.voxels([5e-4; 3], 0.5).unwrap();
        assert_eq!(voxels.mesh.element_count(), 6 * 4 * 2);
        assert!(
            (voxels.ratio - 1.0).abs() < 1e-6 && voxels.fill.iter().all(|fill| (fill - 1.0).abs() < 1e-6)
        );
        // cells that the box fills in part: 3 = 4 × 0.8 − 0.2
        let voxels = stl.voxels([8e-4, 5e-4, 4e-4], 0.1).unwrap();
        assert_eq!(voxels.mesh.element_count(), 4 * 4 * 3);
        assert!((voxels.fill.iter().sum::<f64>() * 1.6e-10 / 6e-9 - 1.0).abs() < 1e-12);
        assert!((voxels.fill[3] - 0.75).abs() < 1e-6 && (voxels.fill[47] - 0.375).abs() < 1e-6);
        assert!((voxels.ratio - 7.68 / 6.0).abs() < 1e-6 && !voxels.may_be_full());
    }

    #[test]
    fn a_sphere_has_its_volume() {
        let stl = parsed(&binary(&sphere())).unwrap();
        let exact = 4.0 / 3.0 * std::f64::consts::PI * 125e-9;
        // chords of 90°/32
        assert!((stl.volume / exact - 1.0).abs() < 2e-3, "{}", stl.volume / exact);
        let full = stl.voxels([5e-4; 3], 0.5).unwrap();
        assert!((full.ratio - 1.0).abs() < 0.01 && full.may_be_full(), "{}", full.ratio);
        let parts = stl.voxels([1e-3; 3], 0.0).unwrap();
        assert!((parts.fill.iter().sum::<f64>() * 1e-9 / stl.volume - 1.0).abs() < 1e-12);
        // rays alone miss little of it
        assert!(parts.left_out.abs() < 1e-12 && parts.fill.iter().all(|fill| *fill < 1.002));
        let inner = (0..parts.fill.len() as u32).filter(|&e| {
            let centre = Vector3::from(parts.mesh.centre(e)).add_scalar(-5e-3);
            centre.norm() < 4e-3
        });
        assert!(inner.into_iter().all(|e| parts.fill[e as usize] > 0.998));
    }

    #[test]
    fn what_is_wrong_is_named() {
        let triangles = brick([3.0, 2.0, 1.0]);
        let refused = |bytes: &[u8], words: &[&str]| {
            let text = parsed(bytes).unwrap_err().to_string();
            assert!(words.iter().all(|word| text.contains(word)), "{text}");
        };
        refused(
            &binary(&triangles[..11]),
            &["a.stl: not a closed surface: 3 edges of one triangle, 0 of more"],
        );
        let mut turned = triangles.clone();
        turned[4].swap(0, 1);
        refused(&binary(&turned), &["3 of two that face opposite ways", "mm; allowed: 0"]);
        let bytes = binary(&triangles);
        refused(&bytes[10..], &["a.stl:1: STL: found \"674 bytes"]);
        refused(b"", &["text that begins with `solid`"]);
        let text = ascii(&triangles);
        refused(
            text.replacen("vertex", "vertx", 1).as_bytes(),
            &["a.stl:4: line of an STL: found \"vertx 0e0 0 0\""],
        );
        refused(
            text.replacen("vertex 0e0 0 0", "vertex 0e0 0", 1).as_bytes(),
            &["a.stl:4: vertex: found", "three"],
        );
        refused(
            text.replacen("vertex 0e0 0 0\n", "\n", 1).as_bytes(),
            &["a.stl:8: vertices of a facet: found \"2\""],
        );
        refused(text.replacen("vertex 0e0", "vertex nan", 1).as_bytes(), &["corner of a triangle", "finite"]);
        refused(b"solid nothing\nendsolid\n", &["vertices: found \"0\""]);
        let zero = parse(Path::new("a.stl"), &bytes, 0.0).unwrap_err().to_string();
        assert!(zero.contains("scale of the mesh: found 0"), "{zero}");
    }
}
