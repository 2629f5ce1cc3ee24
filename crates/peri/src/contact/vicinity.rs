//! Validity of a list of close pairs: it holds while nearby particles move together, however far.

use crate::bonds::CellGrid;
use crate::field::{CHUNK, Field, chunk_range};
use crate::parallel;
use polycore::numerics::bounds;
use rayon::prelude::*;

/// Cells at most this far apart are compared one by one, the others all at once.
const RINGS: i64 = 3;
/// The list is rebuilt if less than this fraction of its skin is left.
const LEAST: f64 = 0.2;

/// The particles of a list in cells, and their relative motion.
#[derive(Clone)]
pub struct Vicinity<const D: usize> {
    grid: CellGrid<D>,
    edge: f64,
    skin: f64,
    /// Displacement at which the list was made.
    pub listed_at: Field<D>,
    /// Last displacement at which cells were compared, and the relative motion left to any two particles from
    /// there on, m.
    compared_at: Field<D>,
    left: f64,
}

impl<const D: usize> Vicinity<D> {
    /// Tracks a list of all pairs that may touch until two particles have moved by `skin` against each other;
    /// pairs that do not share a cell of the grid or neighbouring ones are at least `edge` apart.
    pub fn new(grid: CellGrid<D>, displacement: &Field<D>, edge: f64, skin: f64) -> Self {
        let (listed_at, compared_at) = (displacement.clone(), displacement.clone());
        Self { grid, edge, skin, listed_at, compared_at, left: skin }
    }

    /// Returns true if the list holds for a displacement; `particles` are the sites of the grid.
    pub fn is_current(&mut self, particles: &[u32], displacement: &Field<D>) -> bool {
        if self.skin == 0.0 {
            return false;
        }
        let sites = self.compared_at.sites();
        // half of the rest; a little less, for the rounding of positions far from the origin
        let limit = (0.49 * self.left).powi(2);
        let (now, then) = (displacement.components(), self.compared_at.components());
        let moved = |chunk: usize| {
            let range = chunk_range(chunk, sites);
            let mut square = [0.0; CHUNK];
            for d in 0..D {
                let parts = now[d][range.clone()].iter().zip(&then[d][range.clone()]);
                square.iter_mut().zip(parts).for_each(|(s, (a, b))| *s += (a - b) * (a - b));
            }
            // NaN counts as moved
            !square[..range.len()].iter().all(|&s| s <= limit)
        };
        if !(0..sites.div_ceil(CHUNK)).into_par_iter().any(moved) {
            return true;
        }
        self.compare_at(particles, displacement)
    }

    /// Compares cells at a displacement; returns true if the list holds.
    pub fn compare_at(&mut self, particles: &[u32], displacement: &Field<D>) -> bool {
        self.left = self.compare(particles, displacement);
        self.compared_at.clone_from(displacement);
        self.left > LEAST * self.skin
    }

    /// Distance by which every particle may move from where cells were last compared, m.
    #[cfg(feature = "gpu")]
    pub fn room(&self) -> f64 {
        // as in `is_current`
        if self.skin > 0.0 { 0.49 * self.left } else { 0.0 }
    }

    /// Computes the relative motion left to any two particles outside the list, m; negative if it was
    /// exceeded or is unknown.
    fn compare(&self, particles: &[u32], displacement: &Field<D>) -> f64 {
        // least and greatest components of the displacements in every cell
        let of = |members: &[u32]| {
            let (mut low, mut high) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
            for &member in members {
                let site = particles[member as usize] as usize;
                let (now, then) = (displacement.get(site), self.listed_at.get(site));
                for d in 0..D {
                    let moved = now[d] - then[d];
                    // NaN propagates
                    low[d] = if moved < low[d] || moved.is_nan() { moved } else { low[d] };
                    high[d] = if moved > high[d] || moved.is_nan() { moved } else { high[d] };
                }
            }
            [low, high]
        };
        let members: Vec<&[u32]> = self.grid.members().collect();
        let moves: Vec<[[f64; D]; 2]> = parallel::map_each(&members, |members| of(members));
        let against = |a: &[[f64; D]; 2], b: &[[f64; D]; 2]| {
            let along = |d: usize| (a[1][d] - b[0][d]).max(b[1][d] - a[0][d]);
            (0..D).map(|d| along(d) * along(d)).sum::<f64>().sqrt()
        };
        // pairs k ≥ 2 cells apart were at least (k − 1) edges apart, and an edge is at least a contact
        // distance, the gap of the list and the skin: they may move by (k − 2) edges and a skin against each
        // other
        let allowed = |rings: i64| (rings - 2).max(0) as f64 * self.edge + self.skin;
        let left = |number: usize| {
            let mut left = f64::INFINITY;
            self.grid.around(number, RINGS, |other, rings| {
                left = left.min(allowed(rings) - against(&moves[number], &moves[other]));
            });
            left
        };
        let near = parallel::map(moves.len(), left).into_iter().fold(f64::INFINITY, f64::min);
        let all = bounds(moves.iter().flatten().copied());
        let left = near.min(allowed(RINGS + 1) - against(&all, &all));
        let known = moves.iter().flatten().flatten().all(|moved| moved.is_finite());
        if known { left } else { f64::NEG_INFINITY }
    }
}
