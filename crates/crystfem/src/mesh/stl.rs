//! Closed surfaces of triangles (STL), and the cells inside them.
//!
//! An own reader, because `stl_io` 0.11 distinguishes text from binary files by their first word, which some
//! binary files share, and its errors name no line.

mod corners;
mod shells;

use std::collections::HashMap;
use std::path::Path;

use crate::error::Error;
use crate::mesh::voxels::{VoxelGrid, Voxels};

/// Number of rays per cell along each axis: fill fractions are exact along z and to about 1/8² across.
const RAYS: usize = 8;
/// Offset of rays from the centres of their squares, in squares: edges often pass through centres.
const RAY_OFFSET: [f64; 2] = [1.3e-4, 0.7e-4];
/// Smallest fraction of the volume, overlapping or inside inward-facing shells, that is reported.
const MIN_REPORTED: f64 = 1e-6;

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
    parse(path, &crate::file::read_bytes(path)?, scale)
}

/// Reads from bytes; `path` is for messages only.
///
/// # Errors
/// Errors of [`read`].
pub fn parse(path: &Path, bytes: &[u8], scale: f64) -> Result<Stl, Error> {
    if !(scale > 0.0 && scale.is_finite()) {
        let allowed = "positive and finite, m per unit of the file".into();
        return Err(Error::Parameter { name: "scale of the mesh", found: scale, allowed });
    }
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

    /// Number of cells along each axis of the grid around it, before any is made.
    ///
    /// # Errors
    /// Errors of [`Self::voxels`].
    pub fn cells(&self, size: [f64; 3]) -> Result<[f64; 3], Error> {
        let [low, high] = self.bounds();
        Ok(VoxelGrid::around(low, high, size)?.counts().map(|count| count as f64))
    }

    /// Builds the cells inside, at multiples of `size`. 8 × 8 rays in z through each column of cells are
    /// inside where they have entered more shells than they have left. Cells filled to less than `least` are
    /// left out. Returns also notes on overlaps.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a size that is not positive, too many cells, and a `least` that no cell
    /// reaches.
    pub fn voxels(&self, size: [f64; 3], least: f64) -> Result<(Voxels, Vec<String>), Error> {
        let [low, high] = self.bounds();
        let frame = VoxelGrid::around(low, high, size)?;
        let [nx, ny, nz] = frame.counts();
        let rays = [nx * RAYS, ny * RAYS];
        // crossings of each ray, in units of cells, and their directions
        let mut crossings: Vec<Vec<(f32, i8)>> = vec![Vec::new(); rays[0] * rays[1]];
        let points: Vec<[f64; 3]> =
            self.points.iter().map(|point| [0, 1, 2].map(|d| frame.units(point[d], d))).collect();
        let place = |k: usize, d: usize| (k as f64 + 0.5 + RAY_OFFSET[d]) / RAYS as f64;
        for triangle in &self.triangles {
            let corners = triangle.map(|n| points[n as usize]);
            let range = |d: usize| {
                let ends = corners.map(|corner| corner[d] * RAYS as f64 - 0.5 - RAY_OFFSET[d]);
                let low = ends.into_iter().fold(f64::INFINITY, f64::min).ceil().max(0.0) as usize;
                let high = ends.into_iter().fold(f64::NEG_INFINITY, f64::max).floor();
                low..((high + 1.0).max(0.0) as usize).min(rays[d])
            };
            for (i, j) in range(0).flat_map(|i| range(1).map(move |j| (i, j))) {
                if let Some((z, way)) = crossing(triangle, &points, [place(i, 0), place(j, 1)]) {
                    crossings[i + rays[0] * j].push((z as f32, way as i8));
                }
            }
        }
        let whole: f64 = size.iter().product();
        let part = whole / (RAYS * RAYS) as f64;
        let mut filled = vec![0.0; nx * ny * nz];
        // lengths counted in more than one shell, and in inward-facing shells outside all others
        let (mut twice, mut negative) = (0.0, 0.0);
        for (ray, crossings) in crossings.iter_mut().enumerate() {
            let column = (ray % rays[0]) / RAYS + nx * (ray / rays[0] / RAYS);
            // at touching shells, out before in
            crossings.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
            let mut around = 0_i32;
            for pair in crossings.windows(2) {
                let [from, to] = [f64::from(pair[0].0), f64::from(pair[1].0)];
                around -= i32::from(pair[0].1);
                twice += part * (to - from) * f64::from((around - 1).max(0));
                negative += part * (to - from) * f64::from((-around).max(0));
                if around < 1 {
                    continue;
                }
                for k in (from.floor().max(0.0) as usize)..(to.ceil().max(0.0) as usize).min(nz) {
                    let inside = to.min(k as f64 + 1.0) - from.max(k as f64);
                    filled[column + nx * ny * k] += part * inside.max(0.0);
                }
            }
        }
        let mut notes = Vec::new();
        let is_reported = |volume: f64| volume > MIN_REPORTED * self.volume;
        if is_reported(twice) {
            notes.push(format!("shells overlap: {:.4} mm³ that lie in several count once", 1e9 * twice));
        }
        if is_reported(negative) {
            let mm3 = 1e9 * negative;
            notes.push(format!(
                "{mm3:.4} mm³ inside shells that face inwards, and in no other, are left empty"
            ));
        }
        // exact except for the ray measurements
        let volume = self.volume - twice + negative;
        Ok((frame.voxels(&filled, least, volume)?.0, notes))
    }
}

/// Finds the crossing of a triangle with a ray along z, facing upwards (1) or downwards (−1); `None` without
/// a crossing. An edge gives its two triangles the same sign, so that the ray crosses one of them.
fn crossing(triangle: &[u32; 3], points: &[[f64; 3]], at: [f64; 2]) -> Option<(f64, i32)> {
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

#[cfg(test)]
mod tests;
