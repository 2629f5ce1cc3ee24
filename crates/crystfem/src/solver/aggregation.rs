//! Multigrid levels by smoothed aggregation (Vaněk, Mandel and Brezina 1996, doi:10.1007/BF02238511).
//!
//! Only conduction is aggregated, so that the levels serve every step length and capacity. Neighbours are
//! selected by distance, not by matrix entry: in a cube of eight nodes those along an edge have no entry, and
//! in a thin layer the near ones are above each other.

use rayon::prelude::*;

/// Largest squared distance of near neighbours over the smallest one.
const NEAR_RATIO: f64 = 4.0;
/// Number of unknowns that are not aggregated further.
const MAX_UNAGGREGATED: usize = 60;
/// Smallest coarsening ratio that is worth a level.
const MIN_COARSENING: f64 = 1.5;
/// Smoothing factor 1/λ of the prolongation: λ of D⁻¹K is below 2 in most meshes.
const SMOOTHING: f64 = 2.0 / 3.0;
/// Smallest fraction of the diagonal that remains without far neighbours.
const MIN_DIAGONAL: f64 = 0.1;
/// No unknown.
const NONE: u32 = u32::MAX;

/// A sparse matrix, row by row.
#[derive(Clone, Debug, Default)]
pub struct Sparse {
    pub starts: Vec<u32>,
    pub columns: Vec<u32>,
    pub values: Vec<f64>,
}

impl Sparse {
    /// Concatenates the rows of work items.
    fn gather(rows: Vec<Self>) -> Self {
        let mut all = Self { starts: vec![0], ..Self::default() };
        for rows in rows {
            let first = all.columns.len() as u32;
            all.starts.extend(rows.starts[1..].iter().map(|start| first + start));
            all.columns.extend_from_slice(&rows.columns);
            all.values.extend_from_slice(&rows.values);
        }
        all
    }

    /// Builds rows one by one, in parallel work items; `fill` adds (column, value) pairs, and those of the
    /// same column are summed.
    fn build(size: usize, columns: usize, fill: impl Fn(usize, &mut dyn FnMut(u32, f64)) + Sync) -> Self {
        let items: Vec<usize> = (0..size).step_by(ITEM).collect();
        let part = |place: &mut Vec<u32>, &first: &usize| {
            let mut part = Self { starts: vec![0], ..Self::default() };
            for row in first..(first + ITEM).min(size) {
                let start = part.columns.len();
                fill(row, &mut |column, value| {
                    let at = &mut place[column as usize];
                    if *at == NONE {
                        *at = part.columns.len() as u32;
                        part.columns.push(column);
                        part.values.push(0.0);
                    }
                    part.values[*at as usize] += value;
                });
                part.columns[start..].iter().for_each(|&column| place[column as usize] = NONE);
                part.starts.push(part.columns.len() as u32);
            }
            part
        };
        Self::gather(items.par_iter().map_init(|| vec![NONE; columns], part).collect())
    }

    pub fn rows(&self) -> usize {
        self.starts.len() - 1
    }

    /// Columns and values of a row.
    pub fn row(&self, row: usize) -> impl Iterator<Item = (u32, f64)> {
        let range = self.starts[row] as usize..self.starts[row + 1] as usize;
        self.columns[range.clone()].iter().copied().zip(self.values[range].iter().copied())
    }

    fn transposed(&self, columns: usize) -> Self {
        let mut starts = vec![0; columns + 1];
        self.columns.iter().for_each(|&column| starts[column as usize + 1] += 1);
        (0..columns).for_each(|k| starts[k + 1] += starts[k]);
        let mut next = starts.clone();
        let mut other =
            Self { starts, columns: vec![0; self.columns.len()], values: vec![0.0; self.values.len()] };
        for row in 0..self.rows() {
            for (column, value) in self.row(row) {
                let at = &mut next[column as usize];
                other.columns[*at as usize] = row as u32;
                other.values[*at as usize] = value;
                *at += 1;
            }
        }
        other
    }

    /// Product of a row with x.
    pub fn dot(&self, row: usize, x: &[f64]) -> f64 {
        let range = self.starts[row] as usize..self.starts[row + 1] as usize;
        let (columns, left) = self.columns[range.clone()].as_chunks::<4>();
        let (values, over) = self.values[range].as_chunks::<4>();
        let mut sums = [0.0; 4];
        for (columns, values) in columns.iter().zip(values) {
            for lane in 0..4 {
                sums[lane] += values[lane] * x[columns[lane] as usize];
            }
        }
        for (&column, value) in left.iter().zip(over) {
            sums[0] += value * x[column as usize];
        }
        (sums[0] + sums[1]) + (sums[2] + sums[3])
    }
}

/// Number of rows of a work item.
const ITEM: usize = 4096;

/// Transfer from one level to the next coarser one.
#[derive(Clone, Debug)]
pub struct Transfer {
    pub prolongation: Sparse,
    pub restriction: Sparse,
    /// Conduction on the coarser level.
    pub conduction: Sparse,
}

/// Builds all levels below the finest. `entries` visits the entries of a row of the conduction matrix; only
/// `free` equations are unknowns.
pub fn levels(
    free: &[f64],
    place: impl Fn(usize) -> [f64; 3],
    entries: impl Fn(usize, &mut dyn FnMut(usize, f64)) + Sync,
) -> Vec<Transfer> {
    let size = free.len();
    let mut places: Vec<[f64; 3]> = (0..size).map(place).collect();
    // prescribed and unused equations are in no row and have none
    let mut conduction = Sparse::build(size, size, |row, add| {
        if free[row] != 0.0 {
            entries(row, &mut |column, value| {
                if free[column] != 0.0 {
                    add(column as u32, value);
                }
            });
        }
    });
    let mut levels = Vec::new();
    loop {
        let exists = (0..conduction.rows()).filter(|&row| conduction.row(row).next().is_some()).count();
        if exists <= MAX_UNAGGREGATED {
            return levels;
        }
        let near = |row: usize| {
            let places = &places;
            let square = move |column: u32| -> f64 {
                let (a, b) = (places[row], places[column as usize]);
                (0..3).map(|d| (a[d] - b[d]).powi(2)).sum()
            };
            let others = || {
                conduction.columns[conduction.starts[row] as usize..conduction.starts[row + 1] as usize]
                    .iter()
                    .copied()
                    .filter(move |&column| column as usize != row)
            };
            let least = others().map(square).fold(f64::INFINITY, f64::min);
            others().filter(move |&column| square(column) <= NEAR_RATIO * (1.0 + 1e-9) * least)
        };
        let (group, count) =
            aggregate(conduction.rows(), |row| near(row), |row| conduction.row(row).next().is_some());
        if (exists as f64) < MIN_COARSENING * f64::from(count) {
            return levels;
        }
        let prolongation = Sparse::build(conduction.rows(), count as usize, |row, add| {
            if group[row] == NONE {
                return;
            }
            // add far entries to the diagonal, which keeps the sum of the row
            let mut list: Vec<u32> = near(row).collect();
            list.sort_unstable();
            let (mut whole, mut diagonal) = (0.0, 0.0);
            for (column, value) in conduction.row(row) {
                if column as usize == row {
                    whole = value;
                }
                if list.binary_search(&column).is_err() {
                    diagonal += value;
                }
            }
            let factor = SMOOTHING / if diagonal > MIN_DIAGONAL * whole { diagonal } else { whole };
            add(group[row], 1.0 - factor * diagonal);
            for (column, value) in
                conduction.row(row).filter(|(column, _)| list.binary_search(column).is_ok())
            {
                add(group[column as usize], -factor * value);
            }
        });
        let restriction = prolongation.transposed(count as usize);
        let product = Sparse::build(conduction.rows(), count as usize, |row, add| {
            for (column, value) in conduction.row(row) {
                prolongation.row(column as usize).for_each(|(coarse, share)| add(coarse, value * share));
            }
        });
        let next = Sparse::build(count as usize, count as usize, |row, add| {
            for (fine, share) in restriction.row(row) {
                product.row(fine as usize).for_each(|(coarse, value)| add(coarse, share * value));
            }
        });
        let mut means = vec![([0.0; 3], 0.0); count as usize];
        for (place, &group) in places.iter().zip(&group).filter(|(_, group)| **group != NONE) {
            let (sum, many) = &mut means[group as usize];
            (0..3).for_each(|d| sum[d] += place[d]);
            *many += 1.0;
        }
        places = means.into_iter().map(|(sum, many)| sum.map(|x| x / many)).collect();
        conduction = next.clone();
        levels.push(Transfer { prolongation, restriction, conduction: next });
    }
}

/// Assigns a group to each unknown: first a root with all its near neighbours, then groups of the remaining
/// ones.
fn aggregate<I: Iterator<Item = u32>>(
    size: usize,
    near: impl Fn(usize) -> I,
    exists: impl Fn(usize) -> bool,
) -> (Vec<u32>, u32) {
    let mut group = vec![NONE; size];
    let mut count = 0;
    for row in 0..size {
        if group[row] == NONE && exists(row) && near(row).all(|other| group[other as usize] == NONE) {
            group[row] = count;
            near(row).for_each(|other| group[other as usize] = count);
            count += 1;
        }
    }
    let roots = group.clone();
    for row in (0..size).filter(|&row| roots[row] == NONE && exists(row)) {
        match near(row).map(|other| roots[other as usize]).find(|&other| other != NONE) {
            Some(other) => group[row] = other,
            None => {
                // near neighbours that also remain
                if group[row] == NONE {
                    group[row] = count;
                    for other in near(row) {
                        if group[other as usize] == NONE {
                            group[other as usize] = count;
                        }
                    }
                    count += 1;
                }
            }
        }
    }
    (group, count)
}
