//! Times at which a bead covers the centres of elements.

use polycore::numerics::bounds;
use std::collections::BTreeMap;

use nalgebra::Vector2;

use super::{Move, ToolPath};
use crate::error::Error;
use crate::mesh::Mesh;

/// Cross-section of a bead: below the nozzle, to both sides of its path, with round ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bead {
    /// Width, m.
    pub width: f64,
    /// Height, m.
    pub height: f64,
}

/// Times at which elements are covered: when the nozzle is nearest to the centre of an element, in the first
/// move whose bead contains that centre.
#[derive(Clone, Debug, PartialEq)]
pub struct ActivationTimes {
    /// Time of each element of the mesh, s: −∞ if not requested, +∞ if never covered.
    pub times: Vec<f64>,
    /// Elements never covered, ascending.
    pub missed: Vec<u32>,
    /// Heights z of printing moves, with the end time of the last one at each, s.
    levels: Vec<(f64, f64)>,
    height: f64,
}

impl ActivationTimes {
    /// Assigns elements never covered the end time of the last bead at their height, as if gaps between beads
    /// were filled. Returns the number of elements without a bead at their height, which remain missed.
    pub fn fill(&mut self, mesh: &Mesh) -> usize {
        let (levels, height) = (&self.levels, self.height);
        let times = &mut self.times;
        self.missed.retain(|element| {
            let z = mesh.centre(*element)[2];
            let first = levels.partition_point(|level| level.0 < z);
            let inside = levels[first..].iter().take_while(|level| level.0 - height < z);
            let last = inside.map(|level| level.1).fold(f64::NEG_INFINITY, f64::max);
            if last.is_finite() {
                times[*element as usize] = last;
            }
            !last.is_finite()
        });
        self.missed.len()
    }
}

/// Largest position, m, and time, s, of a move: beyond any printer, and with a square far from overflow.
const LARGEST_COORDINATE: f64 = 1e12;

/// Largest number of cells along each axis.
const MAX_CELLS: f64 = 512.0;

/// Centres of elements, sorted by cell of a grid over x and y, then by z.
struct Centres {
    lower: [f64; 2],
    upper: [f64; 2],
    size: f64,
    rows: u64,
    sorted: Vec<(u64, f64, u32)>,
    places: Vec<[f64; 2]>,
}

impl Centres {
    fn new(mesh: &Mesh, elements: &[u32], width: f64) -> Self {
        let centres: Vec<[f64; 3]> = elements.iter().map(|element| mesh.centre(*element)).collect();
        let [lower, upper] = bounds(centres.iter().map(|centre| [centre[0], centre[1]]));
        let size = width.max((upper[0] - lower[0]).max(upper[1] - lower[1]) / MAX_CELLS);
        let rows = ((upper[1] - lower[1]) / size) as u64 + 1;
        let mut all = Self { lower, upper, size, rows, sorted: Vec::new(), places: Vec::new() };
        all.sorted = (0..).zip(&centres).map(|(k, c)| (all.cell([c[0], c[1]]), c[2], k)).collect();
        all.sorted.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        all.places = centres.iter().map(|c| [c[0], c[1]]).collect();
        all
    }

    /// Column and row of a position, clamped to the grid.
    fn index(&self, place: [f64; 2]) -> [u64; 2] {
        // a cast saturates, so nothing below zero remains
        [0, 1].map(|d| ((place[d].min(self.upper[d]) - self.lower[d]) / self.size) as u64)
    }

    fn cell(&self, place: [f64; 2]) -> u64 {
        let [column, row] = self.index(place);
        column * self.rows + row
    }

    /// Centres with z in (low, high] in a cell, as indices of `places`, with their z.
    fn in_cell(&self, cell: u64, [low, high]: [f64; 2]) -> impl Iterator<Item = (f64, usize)> + '_ {
        let first =
            self.sorted.partition_point(|entry| entry.0 < cell || (entry.0 == cell && entry.1 <= low));
        let inside = self.sorted[first..].iter().take_while(move |entry| entry.0 == cell && entry.1 <= high);
        inside.map(|entry| (entry.1, entry.2 as usize))
    }
}

pub(super) fn activation(
    path: &ToolPath,
    mesh: &Mesh,
    elements: &[u32],
    bead: Bead,
) -> Result<ActivationTimes, Error> {
    for (name, found) in [("width of the bead", bead.width), ("height of the bead", bead.height)] {
        if !(found > 0.0 && found.is_finite()) {
            return Err(Error::Parameter { name, found, allowed: "positive and finite, m".into() });
        }
    }
    if let Some(element) = elements.iter().find(|element| mesh.nodes(**element).is_empty()) {
        let allowed = format!("below {}", mesh.element_count());
        return Err(Error::Parameter { name: "element", found: f64::from(*element), allowed });
    }
    if !path.moves.iter().any(|one| one.prints) {
        return Err(Error::Mesh("the path prints nothing; allowed: 1 printing move or more".into()));
    }
    let values = |one: &Move| {
        [one.from[0], one.from[1], one.from[2], one.to[0], one.to[1], one.to[2], one.start, one.end]
    };
    if let Some(value) =
        path.moves.iter().flat_map(values).find(|value| value.is_nan() || value.abs() > LARGEST_COORDINATE)
    {
        let allowed = format!("places and times up to {LARGEST_COORDINATE:e} m and s");
        return Err(Error::Parameter { name: "move of the path", found: value, allowed });
    }
    let mut earliest = vec![f64::INFINITY; elements.len()];
    let mut levels: BTreeMap<u64, (f64, f64)> = BTreeMap::new();
    let centres = Centres::new(mesh, elements, bead.width);
    for one in path.moves.iter().filter(|one| one.prints) {
        let z = one.to[2];
        let level = levels.entry(z.to_bits()).or_insert((z, one.end));
        level.1 = level.1.max(one.end);
        cover(one, &centres, bead, &mut earliest);
    }
    let mut levels: Vec<(f64, f64)> = levels.into_values().collect();
    levels.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let mut times = vec![f64::NEG_INFINITY; mesh.element_count()];
    for (element, time) in elements.iter().zip(&earliest) {
        times[*element as usize] = *time;
    }
    let missed = (0u32..).zip(&times).filter(|(_, time)| **time == f64::INFINITY).map(|(element, _)| element);
    Ok(ActivationTimes { missed: missed.collect(), times, levels, height: bead.height })
}

/// Covers centres by a move.
fn cover(one: &Move, centres: &Centres, bead: Bead, earliest: &mut [f64]) {
    let radius = 0.5 * bead.width;
    let from = Vector2::new(one.from[0], one.from[1]);
    let along = Vector2::new(one.to[0], one.to[1]) - from;
    let square = along.norm_squared();
    let Some([first, last]) = clip(from, along, centres, radius) else { return };
    // pieces no longer than four cells, so that the boxes around slanted ones contain few centres
    let pieces = ((last - first) * square.sqrt() / (4.0 * centres.size)).ceil().clamp(1.0, MAX_CELLS) as u32;
    let rise = one.to[2] - one.from[2];
    for piece in 0..pieces {
        let share = |k: u32| first + (last - first) * (f64::from(k) / f64::from(pieces));
        let ends = [from + along * share(piece), from + along * share(piece + 1)];
        let low = ends[0].inf(&ends[1]).add_scalar(-radius);
        let high = ends[0].sup(&ends[1]).add_scalar(radius);
        let [low, high] = [centres.index(low.into()), centres.index(high.into())];
        let top = [one.from[2] + rise * share(piece), one.from[2] + rise * share(piece + 1)];
        let range = [top[0].min(top[1]) - bead.height, top[0].max(top[1])];
        for (column, row) in (low[0]..=high[0]).flat_map(|c| (low[1]..=high[1]).map(move |r| (c, r))) {
            for (z, k) in centres.in_cell(column * centres.rows + row, range) {
                let centre = Vector2::from(centres.places[k]);
                let share =
                    if square > 0.0 { ((centre - from).dot(&along) / square).clamp(0.0, 1.0) } else { 0.0 };
                let top = one.from[2] + rise * share;
                let near = (centre - from - along * share).norm() <= radius;
                if near && z <= top && z > top - bead.height {
                    earliest[k] = earliest[k].min(one.start + (one.end - one.start) * share);
                }
            }
        }
    }
}

/// Clips a move to the reach of the centres, as fractions of it; `None` if outside.
fn clip(from: Vector2<f64>, along: Vector2<f64>, centres: &Centres, radius: f64) -> Option<[f64; 2]> {
    let (mut first, mut last) = (0.0f64, 1.0f64);
    for d in 0..2 {
        let (low, high) = (centres.lower[d] - radius - from[d], centres.upper[d] + radius - from[d]);
        if along[d] == 0.0 {
            if low > 0.0 || high < 0.0 {
                return None;
            }
        } else {
            let (a, b) = (low / along[d], high / along[d]);
            first = first.max(a.min(b));
            last = last.min(a.max(b));
        }
    }
    (first <= last).then_some([first, last])
}
