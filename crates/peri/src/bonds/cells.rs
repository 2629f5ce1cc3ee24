//! Points sorted into cells, for range searches.

use crate::parallel;
use polycore::numerics::bounds;
use rayon::prelude::*;

/// Cells farther than this from the first are merged: positions there are not resolved to a cell.
const FARTHEST: i64 = 1 << 40;

/// Points in cells of equal edge. Empty cells are not stored: a point far from all others costs nothing.
#[derive(Clone)]
pub struct CellGrid<const D: usize> {
    low: [f64; D],
    edge: f64,
    /// Cells that hold points, ascending; the last axis comes first, so that rows along the first axis lie
    /// together.
    cells: Vec<[i64; D]>,
    /// The greatest cell along each axis.
    last: [i64; D],
    starts: Vec<usize>,
    members: Vec<u32>,
}

impl<const D: usize> CellGrid<D> {
    /// Sorts points into cells of at least `edge`; at most four per point and axis in any case.
    pub fn new(points: &[[f64; D]], edge: f64) -> Self {
        let [low, high] = bounds(points.iter().copied());
        let most = (points.len() as f64).powf(1.0 / D as f64).ceil().max(1.0);
        let widest = (0..D).map(|d| high[d] - low[d]).fold(0.0, f64::max);
        Self::with_edge(points, edge.max(widest / (4.0 * most)))
    }

    /// Sorts points into cells of `edge`, however far apart they are.
    pub fn with_edge(points: &[[f64; D]], edge: f64) -> Self {
        let [low, _] = bounds(points.iter().copied());
        let (cells, starts, members, last) = (Vec::new(), Vec::new(), Vec::new(), [0; D]);
        let mut grid = Self { low, edge: edge.max(f64::MIN_POSITIVE), cells, last, starts, members };
        let key = |k: usize| (grid.cell(points[k]), k as u32);
        let mut keyed: Vec<([i64; D], u32)> = parallel::map(points.len(), key);
        keyed.par_sort_unstable();
        for (place, (cell, member)) in keyed.into_iter().enumerate() {
            if grid.cells.last() != Some(&cell) {
                grid.cells.push(cell);
                grid.starts.push(place);
                grid.last = std::array::from_fn(|d| grid.last[d].max(cell[d]));
            }
            grid.members.push(member);
        }
        grid.starts.push(points.len());
        grid
    }

    /// Returns all members, cell by cell: near points are near in this order.
    pub fn order(&self) -> &[u32] {
        &self.members
    }

    /// Iterates over the members of each cell, in the order of the cells.
    pub fn members(&self) -> impl Iterator<Item = &[u32]> {
        self.starts.windows(2).map(|ends| &self.members[ends[0]..ends[1]])
    }

    /// Visits the cells at most `rings` cells away from the cell with this number, each with its distance in
    /// cells.
    pub fn around(&self, number: usize, rings: i64, mut visit: impl FnMut(usize, i64)) {
        let own = self.cells[number];
        let away = |cell: &[i64; D]| (0..D).map(|d| (cell[d] - own[d]).abs()).max().unwrap_or(0);
        let mut at = number;
        while let Some(cell) = self.cells.get(at) {
            // the first axis on which it is too far away, and the next cell that may be near enough
            let Some(d) = (0..D).find(|&d| (cell[d] - own[d]).abs() > rings) else {
                visit(at, away(cell));
                at += 1;
                continue;
            };
            let mut next = *cell;
            if cell[d] < own[d] {
                next[d] = own[d] - rings;
            } else if d == 0 {
                return;
            } else {
                next[d - 1] += 1;
                next[d] = own[d] - rings;
            }
            next[d + 1..].fill(i64::MIN);
            at += self.cells[at..].partition_point(|cell| *cell < next);
        }
    }

    /// Returns the cell of a point, last axis first; NaN belongs to the first cell.
    fn cell(&self, point: [f64; D]) -> [i64; D] {
        std::array::from_fn(|d| {
            let axis = D - 1 - d;
            (((point[axis] - self.low[axis]) / self.edge).floor() as i64).clamp(-FARTHEST, FARTHEST)
        })
    }

    /// Visits every point in the cells that a ball around `point` may touch, including points beyond the
    /// ball.
    pub fn near(&self, point: [f64; D], radius: f64, mut visit: impl FnMut(usize)) {
        let (low, high) = (self.cell(point.map(|x| x - radius)), self.cell(point.map(|x| x + radius)));
        let low: [i64; D] = low.map(|c| c.max(0));
        let high: [i64; D] = std::array::from_fn(|d| high[d].min(self.last[d]));
        if (0..D).any(|d| low[d] > high[d]) {
            return;
        }
        let mut row = low;
        loop {
            let first = self.cells.partition_point(|cell| *cell < row);
            for (k, cell) in self.cells[first..].iter().enumerate() {
                if cell[..D - 1] != row[..D - 1] || cell[D - 1] > high[D - 1] {
                    break;
                }
                for &member in &self.members[self.starts[first + k]..self.starts[first + k + 1]] {
                    visit(member as usize);
                }
            }
            let mut d = D - 1;
            loop {
                if d == 0 {
                    return;
                }
                d -= 1;
                row[d] += 1;
                if row[d] <= high[d] {
                    break;
                }
                row[d] = low[d];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Scattered points, one of them very far away: all pairs are found, in the order of dense cells.
    #[test]
    fn finds_all_pairs() {
        let mut points: Vec<[f64; 3]> = (0..300)
            .map(|k| {
                let x = f64::from(k);
                [(x * 0.731).fract(), (x * 0.417).fract() * 0.4 - 7.0, (x * 0.119).fract()]
            })
            .collect();
        points[17] = [1e300, 0.0, 1e250];
        for (points, edge) in [(&points[..], 0.11), (&points[..17], 0.07), (&points[..1], 1.0), (&[], 1.0)] {
            let grid = CellGrid::with_edge(points, edge);
            let distance =
                |a: [f64; 3], b: [f64; 3]| (0..3).map(|d| (a[d] - b[d]).powi(2)).sum::<f64>().sqrt();
            for (i, &here) in points.iter().enumerate() {
                let mut found = Vec::new();
                grid.near(here, edge, |j| found.push(j));
                found.sort_unstable();
                assert!(found.windows(2).all(|pair| pair[0] < pair[1]), "each once");
                let near = (0..points.len()).filter(|&j| distance(here, points[j]) <= edge || j == i);
                assert!(near.into_iter().all(|j| found.binary_search(&j).is_ok()), "point {i}");
            }
            let mut order = grid.order().to_vec();
            order.sort_unstable();
            assert!(order.iter().enumerate().all(|(k, &member)| k == member as usize));
        }
        let near = |grid: &CellGrid<3>| {
            let mut count = 0;
            grid.near([0.5, -6.8, 0.5], 0.1, |_| count += 1);
            count
        };
        let all = near(&CellGrid::with_edge(&points, 0.1));
        assert!((1..40).contains(&all), "{all} of 300 although one is far away");
    }
}
