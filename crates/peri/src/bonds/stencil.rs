//! The stencil of a lattice, and how its sites are stored.

use super::lattice_kernel::TILE;

/// Offsets within the horizon, ordered so that bonds k and n − 1 − k are opposite.
#[derive(Clone, Debug)]
pub struct Stencil<const D: usize> {
    /// Offsets in cells.
    pub offsets: Vec<[i32; D]>,
}

impl<const D: usize> Stencil<D> {
    /// All offsets 0 < |o| ≤ `ratio` (horizon over spacing).
    pub fn new(ratio: f64) -> Self {
        let reach = ratio.floor() as i32;
        let side = (2 * reach + 1) as usize;
        let offsets = (0..side.pow(D as u32))
            .map(|index| {
                // last axis slowest
                std::array::from_fn(|d| (index / side.pow(d as u32) % side) as i32 - reach)
            })
            .filter(|o: &[i32; D]| {
                let square: i64 = o.iter().map(|&x| i64::from(x) * i64::from(x)).sum();
                square > 0 && square as f64 <= ratio * ratio
            })
            .collect();
        Self { offsets }
    }

    /// |ξ|/Δx of bond `k`.
    pub fn length(&self, k: usize) -> f64 {
        self.offsets[k].iter().map(|&x| f64::from(x * x)).sum::<f64>().sqrt()
    }
}

/// Sites that the widest vectors of kernels take at once.
const VECTOR: usize = 8;

/// Returns the axes in the order in which neighbours follow each other in storage: `first`, then the others.
fn order<const D: usize>(first: usize) -> [usize; D] {
    std::array::from_fn(|k| match k {
        0 => first,
        _ => k - usize::from(k <= first),
    })
}

/// Chooses the order of axes in which the particles of a box of cells fill vectors best: a bar ten particles
/// thick fills them along its axis only. Keeps the first axis first if that is nearly as good.
pub(super) fn fullest<const D: usize>(cells: [usize; D], occupied: &[bool], ratio: f64) -> [usize; D] {
    let vectors = |first: usize| {
        let (strides, guard, sites) = layout(cells, ratio, order(first));
        let mut filled = vec![false; sites.div_ceil(VECTOR)];
        for mut index in (0..occupied.len()).filter(|&index| occupied[index]) {
            let mut site = guard;
            for d in 0..D {
                site += strides[d] * (index % cells[d]);
                index /= cells[d];
            }
            filled[site / VECTOR] = true;
        }
        filled.iter().filter(|&&filled| filled).count()
    };
    let counts: [usize; D] = std::array::from_fn(vectors);
    let best = (0..D).min_by_key(|&first| counts[first]).unwrap_or(0);
    order(if 20 * counts[best] < 17 * counts[0] { best } else { 0 })
}

/// Returns the steps in sites along each axis, the number of empty sites before the first cell, and the
/// number of all sites of a box of cells, for an order of axes.
pub(super) fn layout<const D: usize>(
    cells: [usize; D],
    ratio: f64,
    order: [usize; D],
) -> ([usize; D], usize, usize) {
    // empty cells between rows, so that nothing within twice the horizon and a cell reaches the next row
    // (stress measures look that far); odd strides, as rows of a power of two would fall into the same cache
    // sets
    let far = ratio.floor() as usize;
    let mut strides = [1; D];
    for axes in order.windows(2) {
        strides[axes[1]] = (strides[axes[0]] * (cells[axes[0]] + 2 * far + 1)) | 1;
    }
    let guard = strides.iter().map(|s| s * far).sum::<usize>().next_multiple_of(TILE);
    (strides, guard, (2 * guard + strides[order[D - 1]] * cells[order[D - 1]]).next_multiple_of(TILE))
}

/// Returns a lower bound on the number of sites of a box of cells, for a ratio of horizon to spacing, as a
/// real number: a thin box has many more sites than cells.
pub fn storage<const D: usize>(cells: [f64; D], ratio: f64) -> f64 {
    // larger boxes exceed exact integers and need none
    if cells.iter().product::<f64>() < 1e12 && ratio < 1e3 {
        let sites = |first: usize| layout(cells.map(|c| c as usize), ratio, order(first)).2;
        return (0..D).map(sites).min().unwrap_or(0) as f64;
    }
    cells.iter().product::<f64>()
}
