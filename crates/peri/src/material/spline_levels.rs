//! Preconditioner for operators that act on smooth fields like ∫(Δθ)²: splines on grids, each twice as wide
//! as the one before (Bramble, Pasciak & Xu 1990, doi:10.1090/S0025-5718-1990-1023042-6).

use super::tensor::Vector;
use crate::bonds::{BodyGeometry, CloudBonds};
use crate::field::CHUNK;
use crate::parallel;
use polycore::numerics::bounds;

/// Width of the finest grid in spacings: twice that takes 40 % more iterations.
const FINEST: f64 = 1.0;

/// Grids over a cloud, from the finest on.
pub(super) struct SplineLevels<const D: usize> {
    low: [f64; D],
    width: f64,
    grids: Vec<SplineGrid<D>>,
}

/// Products of quadratic splines, one around the middle of each cell, the first axis fastest.
struct SplineGrid<const D: usize> {
    cells: [usize; D],
    /// 1/∫(Δb)² of a spline whose particles are all inside; 0 for others.
    weights: Vec<f64>,
    values: Vec<Vector<D>>,
}

impl<const D: usize> SplineLevels<D> {
    /// Builds the grids for fields that are zero outside of `inside`, and an operator `stiffness`·∫(Δθ)² on
    /// smooth fields.
    pub(super) fn new(cloud: &CloudBonds<D>, inside: &[bool], stiffness: f64) -> Self {
        let [low, high] = bounds((0..cloud.sites()).map(|site| cloud.position(site)));
        let mut width = FINEST * cloud.spacing();
        // a cell and more around the body, for the splines at its ends
        let cells: [usize; D] = std::array::from_fn(|d| ((high[d] - low[d]) / width) as usize + 4);
        let mut levels = Self { low: low.map(|x| x - 1.5 * width), width, grids: Vec::new() };
        let mut grid = SplineGrid::new(cells);
        for site in (0..cloud.sites()).filter(|&site| !inside[site]) {
            levels.visit_splines(cells, cloud.position(site), |node, _| grid.weights[node] = 0.0);
        }
        loop {
            let coarse = grid.coarser();
            // ∫b², ∫b′² and ∫b″² of a spline are 11/20, 1 and 6
            let square = if D == 2 { 8.6 } else { 8.745 } * width.powi(D as i32 - 4) * cloud.thickness();
            let usable = grid.weights.iter().any(|&weight| weight > 0.0);
            grid.weights.iter_mut().for_each(|weight| *weight /= stiffness * square);
            if !usable {
                return levels;
            }
            levels.grids.push(grid);
            (grid, width) = (coarse, 2.0 * width);
        }
    }

    /// Adds the correction of all grids to a residual.
    pub(super) fn add(&mut self, cloud: &CloudBonds<D>, residual: &[Vector<D>], to: &mut [Vector<D>]) {
        let Some(finest) = self.grids.first_mut() else { return };
        let (cells, mut values) = (finest.cells, std::mem::take(&mut finest.values));
        values.fill(Vector::zeros());
        for (site, residual) in residual.iter().enumerate() {
            self.visit_splines(cells, cloud.position(site), |node, weight| values[node] += residual * weight);
        }
        self.grids[0].values = values;
        for k in 1..self.grids.len() {
            let (fine, coarse) = self.grids.split_at_mut(k);
            let (fine, coarse) = (&fine[k - 1], &mut coarse[0]);
            coarse.values.fill(Vector::zeros());
            let (cells, values) = (coarse.cells, &mut coarse.values);
            fine.parents(cells, |node, parent, weight| values[parent] += fine.values[node] * weight);
        }
        for grid in &mut self.grids {
            grid.values.iter_mut().zip(&grid.weights).for_each(|(value, weight)| *value *= *weight);
        }
        for k in (1..self.grids.len()).rev() {
            let (fine, coarse) = self.grids.split_at_mut(k);
            let (fine, coarse) = (&mut fine[k - 1], &coarse[0]);
            let mut values = std::mem::take(&mut fine.values);
            fine.parents(coarse.cells, |node, parent, weight| values[node] += coarse.values[parent] * weight);
            fine.values = values;
        }
        let (this, finest) = (&*self, &self.grids[0]);
        parallel::for_chunks(to, CHUNK, |chunk, to| {
            for (index, to) in to.iter_mut().enumerate() {
                let place = cloud.position(chunk * CHUNK + index);
                this.visit_splines(cells, place, |node, weight| *to += finest.values[node] * weight);
            }
        });
    }

    /// Visits the splines of the finest grid at a position.
    #[inline]
    fn visit_splines(&self, cells: [usize; D], place: [f64; D], mut visit: impl FnMut(usize, f64)) {
        let (mut first, mut stride, mut strides) = (0, 1, [0; D]);
        let mut weights = [[0.0; 3]; D];
        for d in 0..D {
            let at = (place[d] - self.low[d]) / self.width;
            let cell = at as usize;
            let t = at - cell as f64;
            weights[d] = [0.5 * (1.0 - t) * (1.0 - t), 0.5 + t * (1.0 - t), 0.5 * t * t];
            (first, strides[d]) = (first + stride * (cell - 1), stride);
            stride *= cells[d];
        }
        for c in 0..if D == 3 { 3 } else { 1 } {
            let (plane, deep) =
                if D == 3 { (first + c * strides[D - 1], weights[D - 1][c]) } else { (first, 1.0) };
            for b in 0..3 {
                for a in 0..3 {
                    visit(plane + b * strides[1] + a, deep * weights[1][b] * weights[0][a]);
                }
            }
        }
    }
}

impl<const D: usize> SplineGrid<D> {
    fn new(cells: [usize; D]) -> Self {
        let count = cells.iter().product();
        Self { cells, weights: vec![1.0; count], values: vec![Vector::zeros(); count] }
    }

    /// Coarsens the grid by two; keeps the splines without any part of weight 0.
    fn coarser(&self) -> Self {
        let mut coarse = Self::new(self.cells.map(|count| count.div_ceil(2)));
        let (cells, weights) = (coarse.cells, &mut coarse.weights);
        self.parents(cells, |node, parent, _| {
            if self.weights[node] == 0.0 {
                weights[parent] = 0.0;
            }
        });
        coarse
    }

    /// Visits each spline with the coarser ones that contain it: spline c is that of 2c − 1, 2c, 2c + 1 and
    /// 2c + 2 with ¼, ¾, ¾ and ¼.
    fn parents(&self, coarse: [usize; D], mut visit: impl FnMut(usize, usize, f64)) {
        let mut place = [0_usize; D];
        for node in 0..self.weights.len() {
            for k in 0..1 << D {
                let (mut parent, mut weight, mut stride, mut exists) = (0, 1.0, 1, true);
                for d in 0..D {
                    let near = k >> d & 1 == 0;
                    // the farther one is the next for an odd spline, the last for an even one
                    let at = match (near, place[d] % 2) {
                        (true, _) => place[d] / 2,
                        (false, 1) => place[d] / 2 + 1,
                        _ => (place[d] / 2).wrapping_sub(1),
                    };
                    exists &= at < coarse[d];
                    parent += stride * at.min(coarse[d] - 1);
                    stride *= coarse[d];
                    weight *= if near { 0.75 } else { 0.25 };
                }
                if exists {
                    visit(node, parent, weight);
                }
            }
            for d in 0..D {
                place[d] += 1;
                if place[d] < self.cells[d] {
                    break;
                }
                place[d] = 0;
            }
        }
    }
}
