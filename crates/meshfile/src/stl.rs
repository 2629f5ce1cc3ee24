//! Closed surfaces of triangles (STL).
//!
//! An own reader, because `stl_io` 0.11 distinguishes text from binary files by their first word, which some
//! binary files share, and its errors name no line.

mod corners;
mod shells;

use std::collections::HashMap;
use std::path::Path;

use crate::error::{Error, check_scale};

/// Closed shells of triangles. The inside is the union of all shells, as in slicers: overlaps count once. An
/// inward-facing shell inside another one is a cavity.
#[derive(Clone, Debug, PartialEq)]
pub struct Stl {
    /// Corners, m, without duplicates.
    pub points: Vec<[f64; 3]>,
    /// Indices of the corners, anticlockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Volume inside the shells, m³, less cavities; overlaps count in each shell.
    pub volume: f64,
    /// Notes for the user.
    pub notes: Vec<String>,
}

/// Reads an STL file, ASCII or binary, with coordinates multiplied by `scale` (1e-3 for a file in mm: the
/// format has no unit), merges corners closer than 1e-6 of the largest extent, flips inverted shells, and
/// checks that they are closed. Normals in the file are ignored.
///
/// # Errors
/// [`Error::Shared`] if the file cannot be read; [`Error::File`] with the line of text, or the sizes in
/// bytes, for an invalid file; [`Error::Mesh`] for edges that are not matched in opposite directions, and no
/// volume.
pub fn read(path: &Path, scale: f64) -> Result<Stl, Error> {
    parse(path, &crate::error::read_bytes(path)?, scale)
}

/// Reads from bytes; `path` is for messages only.
///
/// # Errors
/// Errors of [`read`].
pub fn parse(path: &Path, bytes: &[u8], scale: f64) -> Result<Stl, Error> {
    check_scale(scale)?;
    let (corners, note) = corners::corners(path, bytes)?;
    let mut notes: Vec<String> = note.into_iter().collect();
    let mut numbers: HashMap<[u32; 3], u32> = HashMap::new();
    let mut points = Vec::new();
    let mut add = |corner: &[f32; 3]| {
        // −0 is 0
        *numbers.entry(corner.map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
            points.push(corner.map(|x| f64::from(x) * scale));
            points.len() as u32 - 1
        })
    };
    let mut triangles: Vec<[u32; 3]> =
        corners.chunks_exact(3).map(|three| [&three[0], &three[1], &three[2]].map(&mut add)).collect();
    let whole = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle;
        a != b && b != c && c != a
    };
    let all = triangles.len();
    triangles.retain(whole);
    let thin = all - triangles.len();
    let first = shells::weld(&points);
    let welded = first.iter().enumerate().filter(|(k, first)| *k as u32 != **first).count();
    if welded > 0 {
        triangles.iter_mut().for_each(|triangle| *triangle = triangle.map(|n| first[n as usize]));
        triangles.retain(whole);
        notes.push(format!("{welded} corners closer than 1e-6 of the size to another are merged"));
    }
    if all > triangles.len() {
        let collapsed = all - thin - triangles.len();
        let small =
            if collapsed > 0 { format!(", {collapsed} of them smaller than that") } else { String::new() };
        notes.push(format!("{} triangles with two equal corners are left out{small}", all - triangles.len()));
    }
    let shells = shells::shells(path, &points, &mut triangles, &mut notes)?;
    let volume = shells::orient(&points, &mut triangles, shells, &mut notes);
    if volume > 0.0 && volume.is_finite() {
        return Ok(Stl { points, triangles, volume, notes });
    }
    Err(Error::Mesh(format!("{}: volume {volume} m³; allowed: above 0", path.display())))
}

impl Stl {
    /// Bounding box, m.
    pub fn bounds(&self) -> [[f64; 3]; 2] {
        polycore::numerics::bounds(self.triangles.iter().flatten().map(|n| self.points[*n as usize]))
    }
}

/// Finds the crossing of a triangle with a ray along z, facing upwards (1) or downwards (−1); `None` without
/// a crossing. An edge gives its two triangles the same sign, so that the ray crosses one of them.
pub fn crossing(triangle: &[u32; 3], points: &[[f64; 3]], at: [f64; 2]) -> Option<(f64, i32)> {
    let side = |p: u32, q: u32| {
        let [low, high] = [p.min(q), p.max(q)].map(|n| points[n as usize]);
        let cross = (high[0] - low[0]) * (at[1] - low[1]) - (high[1] - low[1]) * (at[0] - low[0]);
        if p < q { cross } else { -cross }
    };
    let &[a, b, c] = triangle;
    let sides = [side(b, c), side(c, a), side(a, b)];
    let sum: f64 = sides.iter().sum();
    let up = sides.iter().all(|side| *side > 0.0);
    let inside = up || sides.iter().all(|side| *side < 0.0);
    let z = || triangle.iter().zip(sides).map(|(&n, side)| side / sum * points[n as usize][2]).sum();
    inside.then(|| (z(), if up { 1 } else { -1 }))
}
