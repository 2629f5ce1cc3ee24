//! Cells inside closed surfaces of triangles (STL).

use crate::error::Error;
use crate::mesh::voxels::{VoxelGrid, Voxels};
use meshfile::stl::crossing;
use std::path::Path;

pub use meshfile::stl::Stl;

/// Number of rays per cell along each axis: fill fractions are exact along z and to about 1/8² across.
const RAYS: usize = 8;
/// Offset of rays from the centres of their squares, in squares: edges often pass through centres.
const RAY_OFFSET: [f64; 2] = [1.3e-4, 0.7e-4];
/// Smallest fraction of the volume, overlapping or inside inward-facing shells, that is reported.
const MIN_REPORTED: f64 = 1e-6;

/// Reads a closed surface, see [`meshfile::stl::read`].
///
/// # Errors
/// Errors of [`meshfile::stl::read`].
pub fn read(path: &Path, scale: f64) -> Result<Stl, Error> {
    Ok(meshfile::stl::read(path, scale)?)
}

/// Reads from bytes; `path` is for messages only.
///
/// # Errors
/// Errors of [`read`].
pub fn parse(path: &Path, bytes: &[u8], scale: f64) -> Result<Stl, Error> {
    Ok(meshfile::stl::parse(path, bytes, scale)?)
}

/// Counts the cells along each axis of the grid around a surface, before any is made.
///
/// # Errors
/// Errors of [`voxels`].
pub fn cells(surface: &Stl, size: [f64; 3]) -> Result<[f64; 3], Error> {
    let [low, high] = surface.bounds();
    Ok(VoxelGrid::around(low, high, size)?.counts().map(|count| count as f64))
}

/// Builds the cells inside a surface, at multiples of `size`. 8 × 8 rays in z through each column of cells
/// are inside where they have entered more shells than they have left. Cells filled to less than `least` are
/// left out. Returns also notes on overlaps.
///
/// # Errors
/// [`Error::Parameter`] for a size that is not positive, too many cells, and a `least` that no cell
/// reaches.
pub fn voxels(surface: &Stl, size: [f64; 3], least: f64) -> Result<(Voxels, Vec<String>), Error> {
    let [low, high] = surface.bounds();
    let frame = VoxelGrid::around(low, high, size)?;
    let [nx, ny, nz] = frame.counts();
    let rays = [nx * RAYS, ny * RAYS];
    // crossings of each ray, in units of cells, and their directions
    let mut crossings: Vec<Vec<(f32, i8)>> = vec![Vec::new(); rays[0] * rays[1]];
    let points: Vec<[f64; 3]> =
        surface.points.iter().map(|point| [0, 1, 2].map(|d| frame.units(point[d], d))).collect();
    let place = |k: usize, d: usize| (k as f64 + 0.5 + RAY_OFFSET[d]) / RAYS as f64;
    for triangle in &surface.triangles {
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
    let is_reported = |volume: f64| volume > MIN_REPORTED * surface.volume;
    if is_reported(twice) {
        notes.push(format!("shells overlap: {:.4} mm³ that lie in several count once", 1e9 * twice));
    }
    if is_reported(negative) {
        let mm3 = 1e9 * negative;
        notes.push(format!("{mm3:.4} mm³ inside shells that face inwards, and in no other, are left empty"));
    }
    // exact except for the ray measurements
    let volume = surface.volume - twice + negative;
    Ok((frame.voxels(&filled, least, volume)?.0, notes))
}

#[cfg(test)]
mod tests;
