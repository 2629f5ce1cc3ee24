//! The stencil of a lattice, and how its sites are stored.

use super::lattice_kernel::TILE;

/// The offsets within the horizon, in an order in which bond k and bond (n − 1 − k) are opposite.
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
                // last axis slowest, so that consecutive offsets read consecutive sites
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

/// Steps in sites along each axis, empty sites before the first cell, and all sites of a box of cells.
pub(super) fn layout<const D: usize>(cells: [usize; D], ratio: f64) -> ([usize; D], usize, usize) {
    // empty cells between rows, so that nothing within twice the horizon and a cell wraps into the next row: stress
    // measures look that far; odd strides, or rows of a power of two would fall into the same cache sets
    let far = ratio.floor() as usize;
    let mut strides = [1; D];
    for d in 1..D {
        strides[d] = (strides[d - 1] * (cells[d - 1] + 2 * far + 1)) | 1;
    }
    let guard = strides.iter().map(|s| s * far).sum::<usize>().next_multiple_of(TILE);
    (strides, guard, (2 * guard + strides[D - 1] * cells[D - 1]).next_multiple_of(TILE))
}

/// Sites of a box of cells and a horizon over the spacing, as a real number: a thin box has many more than cells.
pub fn storage<const D: usize>(cells: [f64; D], ratio: f64) -> f64 {
    // larger boxes need no exact number, and have none
    if cells.iter().product::<f64>() < 1e12 && ratio < 1e3 {
        return layout(cells.map(|c| c as usize), ratio).2 as f64;
    }
    cells.iter().product::<f64>()
}
