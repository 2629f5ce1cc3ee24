//! Position of a path: bounding box, placement, and the fraction outside a part.

use super::{Bead, Move, ToolPath};
use crate::mesh::{Mesh, box_around};

/// Largest number of samples along a path.
const MAX_SAMPLES: f64 = 1e5;
/// Largest number of cells of the grid over elements along each axis.
const MAX_CELLS: f64 = 256.0;

impl ToolPath {
    /// Moves that deposit material.
    pub fn printing_moves(&self) -> impl Iterator<Item = &Move> {
        self.moves.iter().filter(|one| one.prints)
    }

    /// Bounding box of the centrelines of beads, m: z from the lower face of the lowest bead to the highest
    /// nozzle. `None` without printing moves.
    pub fn bounds(&self, bead: Bead) -> Option<[[f64; 3]; 2]> {
        let [mut low, high] = box_around(self.printing_moves().flat_map(|one| [one.from, one.to]))?;
        low[2] -= bead.height;
        Some([low, high])
    }

    /// Translates the path; printers measure from a corner of their bed.
    pub fn translated(mut self, by: [f64; 3]) -> Self {
        for one in &mut self.moves {
            for d in 0..3 {
                one.from[d] += by[d];
                one.to[d] += by[d];
            }
        }
        self
    }

    /// Translates the path in x and y to centre its bounding box over some elements.
    pub fn centred(self, mesh: &Mesh, elements: &[u32], bead: Bead) -> Self {
        let (Some([low, high]), Some([lower, upper])) = (self.bounds(bead), mesh.bounds_of(elements)) else {
            return self;
        };
        let shift = |d: usize| 0.5 * (lower[d] + upper[d] - low[d] - high[d]);
        self.translated([shift(0), shift(1), 0.0])
    }

    /// Fraction of the deposited length with its centreline outside some elements: half a bead below the
    /// nozzle, sampled every half width, or less often along a very long path.
    pub fn fraction_outside(&self, mesh: &Mesh, elements: &[u32], bead: Bead) -> f64 {
        let length = |one: &Move| (0..3).map(|d| (one.to[d] - one.from[d]).powi(2)).sum::<f64>().sqrt();
        let whole: f64 = self.printing_moves().map(length).sum();
        let step = (0.5 * bead.width).max(whole / MAX_SAMPLES);
        let boxes = ElementGrid::new(mesh, elements);
        let mut missed = 0.0;
        for one in self.printing_moves() {
            let own = length(one);
            let pieces = (own / step - 1e-9).ceil().clamp(1.0, MAX_SAMPLES) as u32;
            let outside = (0..pieces).filter(|&k| {
                let share = (f64::from(k) + 0.5) / f64::from(pieces);
                let mut at = [0, 1, 2].map(|d| one.from[d] + share * (one.to[d] - one.from[d]));
                at[2] -= 0.5 * bead.height;
                !boxes.contains(mesh, at)
            });
            missed += own * outside.count() as f64 / f64::from(pieces);
        }
        if whole > 0.0 { missed / whole } else { 0.0 }
    }
}

/// Elements by the cells of a grid over x and y that their boxes touch.
struct ElementGrid {
    low: [f64; 2],
    size: [f64; 2],
    count: [usize; 2],
    cells: Vec<Vec<(u32, [[f64; 3]; 2])>>,
}

impl ElementGrid {
    fn new(mesh: &Mesh, elements: &[u32]) -> Self {
        let [low, high] = mesh.bounds_of(elements).unwrap_or_default();
        let along = (elements.len() as f64).sqrt().ceil().clamp(1.0, MAX_CELLS) as usize;
        let size = [0, 1].map(|d| ((high[d] - low[d]) / along as f64).max(f64::MIN_POSITIVE));
        let cells = vec![Vec::new(); along * along];
        let mut boxes = Self { low: [low[0], low[1]], size, count: [along; 2], cells };
        for &element in elements {
            let Some(bounds) = mesh.bounds_of(&[element]) else { continue };
            let [from, to] = bounds.map(|corner| [0, 1].map(|d| boxes.index(corner[d], d)));
            for column in from[0]..=to[0] {
                for row in from[1]..=to[1] {
                    boxes.cells[column * along + row].push((element, bounds));
                }
            }
        }
        boxes
    }

    /// Column or row of a coordinate, clamped to the grid.
    fn index(&self, x: f64, d: usize) -> usize {
        // a cast saturates, so nothing below zero remains
        (((x - self.low[d]) / self.size[d]) as usize).min(self.count[d] - 1)
    }

    fn contains(&self, mesh: &Mesh, at: [f64; 3]) -> bool {
        let cell = &self.cells[self.index(at[0], 0) * self.count[1] + self.index(at[1], 1)];
        let inside = |[low, high]: &[[f64; 3]; 2]| (0..3).all(|d| (low[d]..=high[d]).contains(&at[d]));
        cell.iter().any(|(element, bounds)| inside(bounds) && mesh.contains(*element, at))
    }
}
