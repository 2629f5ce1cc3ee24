//! Coarse level of rigid motions: six for each group of about 4³ nodes.
//!
//! Conjugate gradients with 3 × 3 blocks alone need iterations in proportion to a part's slenderness; blocks
//! plus P (Pᵀ K P)⁻¹ Pᵀ need about 45 for any shape (`docs/guide/src/theory/print-stress.md`).

use super::product::{Elements, block};
use nalgebra::{Matrix3x6, SMatrix, Vector3, Vector6};
use std::collections::BTreeMap;

/// Nodes of a group along each axis.
const SIDE: f64 = 4.0;
/// Smallest pivot over its diagonal; below, the motion has no stiffness or is redundant.
const MIN_PIVOT: f64 = 1e-10;
const NONE: u32 = u32::MAX;

/// Groups of nodes and the Cholesky factor of Pᵀ K P.
pub struct CoarseMotions {
    /// Group of each node, or [`NONE`].
    group: Vec<u32>,
    /// Displacement at each node by the motions of its group, 0 for fixed components.
    motions: Vec<Matrix3x6<f64>>,
    factor: Skyline,
}

impl CoarseMotions {
    /// Builds the coarse space of elements on nodes at `points`.
    pub fn new(elements: &Elements, points: &[[f64; 3]]) -> Self {
        let free = elements.free();
        let mut exists = vec![false; points.len()];
        let (mut edges, mut count) = (Vector3::zeros(), 0.0);
        for (nodes, ..) in elements.each() {
            nodes.iter().for_each(|&node| exists[node as usize] = true);
            let at = |k: usize| Vector3::from(points[nodes[k] as usize]);
            // edges of an upright brick; for a tetrahedron the box around its corners, halved with mid-edge
            // nodes
            edges += if nodes.len() == 8 {
                (at(6) - at(0)).abs()
            } else {
                let [low, high] =
                    [Vector3::inf, Vector3::sup].map(|of| (1..4).fold(at(0), |all, k| of(&all, &at(k))));
                (high - low) * if nodes.len() == 4 { 1.0 } else { 0.5 }
            };
            count += 1.0;
        }
        let side = edges * (SIDE / count);
        let there = || points.iter().enumerate().filter(|(node, _)| exists[*node]);
        let low = there().fold([f64::INFINITY; 3], |low, (_, at)| std::array::from_fn(|d| low[d].min(at[d])));
        let high =
            there().fold([f64::NEG_INFINITY; 3], |high, (_, at)| std::array::from_fn(|d| high[d].max(at[d])));
        // longest axis last: the factor then has the smallest bandwidth
        let mut axes = [0, 1, 2];
        axes.sort_by(|&a, &b| ((high[b] - low[b]) / side[b]).total_cmp(&((high[a] - low[a]) / side[a])));
        let place = |at: &[f64; 3]| axes.map(|d| ((at[d] - low[d]) / side[d] + 1e-6).floor() as i64);
        let mut numbers: BTreeMap<[i64; 3], (u32, Vector3<f64>, f64)> = BTreeMap::new();
        for (_, at) in there() {
            let (_, sum, many) = numbers.entry(place(at)).or_insert((0, Vector3::zeros(), 0.0));
            *sum += Vector3::from(*at);
            *many += 1.0;
        }
        numbers.values_mut().zip(0..).for_each(|(entry, number)| entry.0 = number);
        let mut group = vec![NONE; points.len()];
        let mut motions = vec![Matrix3x6::zeros(); points.len()];
        for (node, at) in there() {
            let (number, sum, many) = numbers[&place(at)];
            group[node] = number;
            // lengths are scaled by the size of a group, so that translations and rotations are comparable
            let arm = (Vector3::from(*at) - sum / many) / side.max();
            let turns = -arm.cross_matrix();
            for d in (0..3).filter(|&d| free[node][d]) {
                motions[node][(d, d)] = 1.0;
                motions[node].fixed_view_mut::<1, 3>(d, 3).copy_from(&turns.row(d));
            }
        }
        let mut on_roller = vec![false; points.len()];
        for (node, normal) in elements.normals() {
            let own = motions[*node];
            motions[*node] = own - normal * (normal.transpose() * own);
            on_roller[*node] = true;
        }
        let mut first: Vec<u32> = (0..numbers.len() as u32).collect();
        for (nodes, ..) in elements.each() {
            let least = nodes.iter().map(|&node| group[node as usize]).min().unwrap_or(0);
            nodes.iter().for_each(|&node| {
                let first = &mut first[group[node as usize] as usize];
                *first = least.min(*first);
            });
        }
        let mut matrix = Skyline::new(&first);
        for (nodes, stiffness, modulus) in elements.each() {
            let groups: Vec<u32> = nodes.iter().map(|&node| group[node as usize]).collect();
            let is_held = |&node: &u32| free[node as usize] != [true; 3] || on_roller[node as usize];
            let held = nodes.iter().any(is_held);
            // rigid motions of one group do not strain an element inside it
            if !held && groups.iter().all(|other| *other == groups[0]) {
                continue;
            }
            for (column, &other) in nodes.iter().enumerate() {
                for (row, &node) in nodes.iter().enumerate().filter(|(row, _)| groups[*row] >= groups[column])
                {
                    let block = block(stiffness, nodes.len(), row, column) * modulus;
                    let own = motions[node as usize].transpose() * (block * motions[other as usize]);
                    matrix.add(groups[row], groups[column], &own);
                }
            }
        }
        matrix.factor();
        Self { group, motions, factor: matrix }
    }

    /// Adds P (Pᵀ K P)⁻¹ Pᵀ r.
    pub fn add(&self, residual: &[Vector3<f64>], to: &mut [Vector3<f64>]) {
        let mut coarse = vec![0.0; self.factor.size()];
        for ((&group, motions), residual) in self.group.iter().zip(&self.motions).zip(residual) {
            if group != NONE {
                let own: Vector6<f64> = motions.tr_mul(residual);
                let at = 6 * group as usize;
                coarse[at..at + 6].iter_mut().zip(own.iter()).for_each(|(sum, own)| *sum += own);
            }
        }
        self.factor.solve(&mut coarse);
        for ((&group, motions), to) in self.group.iter().zip(&self.motions).zip(to) {
            if group != NONE {
                let at = 6 * group as usize;
                *to += motions * Vector6::from_column_slice(&coarse[at..at + 6]);
            }
        }
    }
}

/// Lower triangle of a symmetric matrix of 6 × 6 blocks, row by row from the first entry that may be nonzero.
struct Skyline {
    /// Start of each row in `values`.
    starts: Vec<usize>,
    /// First column of each row.
    first: Vec<usize>,
    values: Vec<f64>,
}

impl Skyline {
    fn new(first: &[u32]) -> Self {
        let first: Vec<usize> = first.iter().flat_map(|&block| [6 * block as usize; 6]).collect();
        let mut starts = vec![0];
        first.iter().enumerate().for_each(|(row, first)| starts.push(starts[row] + row + 1 - first));
        let values = vec![0.0; starts[first.len()]];
        Self { starts, first, values }
    }

    fn size(&self) -> usize {
        self.first.len()
    }

    fn row(&self, row: usize) -> &[f64] {
        &self.values[self.starts[row]..self.starts[row + 1]]
    }

    fn add(&mut self, row: u32, column: u32, block: &SMatrix<f64, 6, 6>) {
        for i in 0..6 {
            let at = 6 * row as usize + i;
            let columns = if row == column { i + 1 } else { 6 };
            let begin = self.starts[at] + 6 * column as usize - self.first[at];
            self.values[begin..begin + columns].iter_mut().zip(0..).for_each(|(x, j)| *x += block[(i, j)]);
        }
    }

    /// Factors in place by Cholesky; unknowns with vanishing pivots are left out.
    fn factor(&mut self) {
        for row in 0..self.size() {
            let (above, own) = self.values.split_at_mut(self.starts[row]);
            let (first, length) = (self.first[row], row - self.first[row]);
            for column in first..row {
                let other = &above[self.starts[column]..self.starts[column + 1]];
                let from = first.max(self.first[column]);
                let sum: f64 = own[from - first..column - first]
                    .iter()
                    .zip(&other[from - self.first[column]..])
                    .map(|(a, b)| a * b)
                    .sum();
                let pivot = other[column - self.first[column]];
                let at = column - first;
                own[at] = if pivot > 0.0 { (own[at] - sum) / pivot } else { 0.0 };
            }
            let square: f64 = own[..length].iter().map(|x| x * x).sum();
            let left = own[length] - square;
            own[length] = if left > MIN_PIVOT * own[length] { left.sqrt() } else { 0.0 };
        }
    }

    fn solve(&self, right: &mut [f64]) {
        for row in 0..self.size() {
            let (first, own) = (self.first[row], self.row(row));
            let length = row - first;
            let sum: f64 = own[..length].iter().zip(&right[first..row]).map(|(a, b)| a * b).sum();
            right[row] = if own[length] > 0.0 { (right[row] - sum) / own[length] } else { 0.0 };
        }
        for row in (0..self.size()).rev() {
            let (first, own) = (self.first[row], self.row(row));
            let length = row - first;
            let value = if own[length] > 0.0 { right[row] / own[length] } else { 0.0 };
            right[row] = value;
            right[first..row].iter_mut().zip(own).for_each(|(x, factor)| *x -= factor * value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Solves with two coupled blocks and a motion without stiffness.
    #[test]
    fn factors_solve() {
        let mut matrix = Skyline::new(&[0, 0]);
        let full = SMatrix::<f64, 6, 6>::from_fn(|i, j| if i == j { 8.0 } else { 0.3 / (1 + i + j) as f64 });
        let mut low = full;
        low.row_mut(4).fill(0.0);
        low.column_mut(4).fill(0.0);
        let coupling =
            SMatrix::<f64, 6, 6>::from_fn(|i, j| if i == 4 { 0.0 } else { 0.1 * (i + 2 * j) as f64 });
        matrix.add(0, 0, &full);
        matrix.add(1, 0, &coupling);
        matrix.add(1, 1, &low);
        let exact: Vec<f64> = (0..12).map(|k| if k == 10 { 0.0 } else { 1.0 + k as f64 }).collect();
        let symmetric = |i: usize, j: usize| match (i / 6, j / 6) {
            (0, 0) => full[(i, j)],
            (1, 0) => coupling[(i - 6, j)],
            (0, 1) => coupling[(j - 6, i)],
            _ => low[(i - 6, j - 6)],
        };
        let mut right: Vec<f64> =
            (0..12).map(|i| (0..12).map(|j| symmetric(i, j) * exact[j]).sum()).collect();
        matrix.factor();
        matrix.solve(&mut right);
        for (found, exact) in right.iter().zip(exact) {
            assert!((found - exact).abs() < 1e-12, "{found} {exact}");
        }
    }
}
