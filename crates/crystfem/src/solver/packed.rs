//! Packed matrix for iterations on mostly distinct rows: entries combined for one step, in single precision,
//! eight rows side by side.
//!
//! Iterations on unequal rows are limited by memory bandwidth. Off-diagonal entries are rounded to f32, and
//! the diagonal takes the rounding errors, so that row sums stay those of f64. The energy xᵀAx then agrees
//! with that of A to about 2⁻²⁴ for long and short steps alike; conjugate gradients recompute the residual
//! with A itself before the difference matters.

use super::packed_bands::{PackedBandProduct, PackedBands};
use crate::system::ConductionRows;
use crate::system::vector::CHUNK;
use polycore::numerics::ordered_sum;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Number of rows side by side.
const LANES: usize = 8;
/// Largest ratio of a block's entries to those of its longest row, for blocks whose rows share offsets.
const MAX_SPREAD: f64 = 1.3;

/// Packed rows of a combination of M and K.
#[derive(Default)]
pub struct PackedRows {
    items: Vec<CachedItem>,
    /// Packed diagonals, instead of items.
    bands: Option<PackedBands>,
    /// Versions of rows, and factors, for which it was made.
    made_for: Option<([u64; 2], [u64; 2])>,
    any: bool,
}

/// A work item with its versions: births change few items.
#[derive(Default)]
struct CachedItem {
    /// `None` if rows are mostly equal.
    item: Option<Item>,
    /// Version of the pattern.
    shaped_for: Option<u64>,
    /// Version of the values, and factors.
    filled_for: Option<(u64, [u64; 2])>,
}

/// Packed rows of one work item.
#[derive(Default)]
struct Item {
    /// Diagonal plus the rounding errors of the other entries.
    core: Vec<f64>,
    /// Off-diagonal entries, block by block.
    values: Vec<[f32; LANES]>,
    blocks: Vec<RowBlock>,
    /// Distances from the diagonal, for banded blocks.
    offsets: Vec<i32>,
    /// Columns of the other blocks.
    columns: Vec<[u32; LANES]>,
}

/// A block of eight rows, or of the last ones.
#[derive(Clone, Copy)]
struct RowBlock {
    /// Index of its first entry in `offsets` or `columns`.
    first: u32,
    count: u16,
    banded: bool,
}

impl PackedRows {
    /// Updates outdated work items; returns false if no rows are packed.
    pub fn update(&mut self, rows: &ConductionRows, weights: [f64; 2]) -> bool {
        let factors = weights.map(f64::to_bits);
        // few distinct rows stay in caches unpacked
        if rows.are_few() {
            *self = Self::default();
            return false;
        }
        let made_for = Some((rows.versions(), factors));
        if let Some(bands) = rows.bands() {
            if self.made_for != made_for {
                self.items = Vec::new();
                self.bands.get_or_insert_default().pack(bands, weights);
                (self.made_for, self.any) = (made_for, true);
            }
            return true;
        }
        self.bands = None;
        if self.made_for != made_for {
            self.items.resize_with(rows.items(), CachedItem::default);
            self.items.par_iter_mut().enumerate().for_each(|(index, kept)| {
                let [shape, values] = rows.versions_of(index);
                if kept.shaped_for != Some(shape) {
                    kept.item = rows.is_unequal(index).then(|| Item::new(rows, index));
                    (kept.shaped_for, kept.filled_for) = (Some(shape), None);
                }
                if kept.filled_for != Some((values, factors)) {
                    kept.item.iter_mut().for_each(|item| item.fill(rows, index, weights));
                    kept.filled_for = Some((values, factors));
                }
            });
            (self.made_for, self.any) = (made_for, self.items.iter().any(|kept| kept.item.is_some()));
        }
        self.any
    }

    /// Computes y = (diagonal + `factor`·A) x; returns x·y. `weights` are `factor` times those of A.
    pub fn product(
        &self,
        rows: &ConductionRows,
        diagonal: Option<&[f64]>,
        (factor, weights): (f64, [f64; 2]),
        x: &[f64],
        y: &mut [f64],
    ) -> f64 {
        let arch = Arch::new();
        if let Some(packed) = &self.bands {
            let part = |(index, y): (usize, &mut [f64])| {
                arch.dispatch(PackedBandProduct { packed, diagonal, factor, x, y, first: index * CHUNK })
            };
            return ordered_sum(y.par_chunks_mut(CHUNK).enumerate().map(part));
        }
        let part = |(index, y): (usize, &mut [f64])| match self.items.get(index).map(|kept| &kept.item) {
            Some(Some(item)) => {
                let first = index * CHUNK;
                let diagonal = diagonal.map(|diagonal| &diagonal[first..first + y.len()]);
                arch.dispatch(PackedProduct { item, diagonal, factor, x, y, first })
            }
            _ => rows.multiply_item::<false>(index, diagonal, weights, x, y),
        };
        ordered_sum(y.par_chunks_mut(CHUNK).enumerate().map(part))
    }
}

impl Item {
    /// Builds the pattern of a work item.
    fn new(rows: &ConductionRows, index: usize) -> Self {
        let mut item = Self::default();
        let (start, end) = (index * CHUNK, ((index + 1) * CHUNK).min(rows.size()));
        item.core.resize(end - start, 0.0);
        let (mut offsets, mut own): (Vec<i32>, Vec<i32>) = (Vec::new(), Vec::new());
        for first in (start..end).step_by(LANES) {
            let lanes = first..(first + LANES).min(end);
            offsets.clear();
            let mut most = 0;
            for row in lanes.clone() {
                let others = rows.columns(row).filter(|&column| column != row);
                own.clear();
                own.extend(others.map(|column| (column as i64 - row as i64) as i32));
                most = most.max(own.len());
                // most rows have the distances of the row before
                if own != offsets {
                    offsets.extend_from_slice(&own);
                    offsets.sort_unstable();
                    offsets.dedup();
                }
            }
            let inside = |offset: &i32| {
                let to = first as i64 + i64::from(*offset);
                to >= 0 && to as usize + LANES <= rows.size()
            };
            let banded = lanes.len() == LANES
                && offsets.len() as f64 <= MAX_SPREAD * most as f64
                && offsets.first().is_none_or(inside)
                && offsets.last().is_none_or(inside);
            if banded {
                let last = item.blocks.last().filter(|last| last.banded);
                let same = last.map(|last| (last.first, &item.offsets[last.range()]));
                let begin = match same {
                    Some((begin, list)) if list == offsets => begin,
                    _ => {
                        item.offsets.extend_from_slice(&offsets);
                        (item.offsets.len() - offsets.len()) as u32
                    }
                };
                item.blocks.push(RowBlock { first: begin, count: offsets.len() as u16, banded });
                item.values.resize(item.values.len() + offsets.len(), [0.0; LANES]);
            } else {
                let begin = item.columns.len();
                item.columns.resize(begin + most, [first as u32; LANES]);
                for (lane, row) in lanes.enumerate() {
                    let others = rows.columns(row).filter(|&column| column != row);
                    for (columns, column) in item.columns[begin..].iter_mut().zip(others) {
                        columns[lane] = column as u32;
                    }
                }
                item.blocks.push(RowBlock { first: begin as u32, count: most as u16, banded });
                item.values.resize(item.values.len() + most, [0.0; LANES]);
            }
        }
        item.offsets.shrink_to_fit();
        item.columns.shrink_to_fit();
        item.values.shrink_to_fit();
        item
    }

    /// Fills in the entries for given factors.
    fn fill(&mut self, rows: &ConductionRows, index: usize, weights: [f64; 2]) {
        self.values.fill([0.0; LANES]);
        let mut values = self.values.as_mut_slice();
        for (place, block) in self.blocks.iter().enumerate() {
            let (own, rest) = values.split_at_mut(usize::from(block.count));
            values = rest;
            let offsets = if block.banded { &self.offsets[block.range()] } else { &[] };
            let begin = LANES * place;
            for lane in 0..LANES.min(self.core.len() - begin) {
                let row = index * CHUNK + begin + lane;
                let (mut core, mut at) = (0.0, 0);
                for (column, value) in rows.row(row, weights) {
                    if column == row {
                        core += value;
                        continue;
                    }
                    if block.banded {
                        let offset = (column as i64 - row as i64) as i32;
                        at += offsets[at..].iter().take_while(|other| **other < offset).count();
                    }
                    own[at][lane] = value as f32;
                    core += value - f64::from(own[at][lane]);
                    at += 1;
                }
                self.core[begin + lane] = core;
            }
        }
    }
}

impl RowBlock {
    fn range(self) -> std::ops::Range<usize> {
        self.first as usize..self.first as usize + usize::from(self.count)
    }
}

/// Product of one work item.
struct PackedProduct<'a> {
    item: &'a Item,
    diagonal: Option<&'a [f64]>,
    factor: f64,
    x: &'a [f64],
    y: &'a mut [f64],
    first: usize,
}

impl WithSimd for PackedProduct<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Self { item, diagonal, factor, x, y, first } = self;
        let mut values = item.values.as_slice();
        let mut dots = [0.0; LANES];
        for (place, block) in item.blocks.iter().enumerate() {
            let (own, rest) = values.split_at(usize::from(block.count));
            values = rest;
            let begin = LANES * place;
            let row = first + begin;
            let mut vectors = [simd.splat_f64s(0.0); LANES];
            if block.banded {
                let offsets = &item.offsets[block.range()];
                for k in 0..own.len() {
                    let start = row.wrapping_add_signed(offsets[k] as isize);
                    add(simd, &own[k], &x[start..start + LANES], &mut vectors);
                }
            } else {
                let columns = &item.columns[block.range()];
                for k in 0..own.len() {
                    let mut other = [0.0; LANES];
                    for lane in 0..LANES {
                        other[lane] = x[columns[k][lane] as usize];
                    }
                    add(simd, &own[k], &other, &mut vectors);
                }
            }
            let mut sums = [0.0; LANES];
            let (parts, _) = S::as_mut_simd_f64s(&mut sums);
            #[expect(clippy::manual_memcpy, reason = "a slice of the vectors would keep them in memory")]
            for v in 0..parts.len() {
                parts[v] = vectors[v];
            }
            let range = begin..(begin + LANES).min(y.len());
            let (out, core, x) = (&mut y[range.clone()], &item.core[range.clone()], &x[row..]);
            match diagonal.map(|diagonal| &diagonal[range]) {
                Some(diagonal) => {
                    for lane in 0..out.len() {
                        out[lane] = (factor * core[lane] + diagonal[lane]) * x[lane] + factor * sums[lane];
                        dots[lane] += x[lane] * out[lane];
                    }
                }
                None => {
                    for lane in 0..out.len() {
                        out[lane] = factor * (core[lane] * x[lane] + sums[lane]);
                        dots[lane] += x[lane] * out[lane];
                    }
                }
            }
        }
        dots.iter().sum()
    }
}

/// Adds an entry of eight rows times entries of a vector.
#[inline(always)]
fn add<S: Simd>(simd: S, entry: &[f32; LANES], x: &[f64], sums: &mut [S::f64s; LANES]) {
    let mut wide = [0.0; LANES];
    for lane in 0..LANES {
        wide[lane] = f64::from(entry[lane]);
    }
    let ((entry, _), (x, _)) = (S::as_simd_f64s(&wide), S::as_simd_f64s(x));
    for v in 0..entry.len() {
        sums[v] = simd.mul_add_f64s(entry[v], x[v], sums[v]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::RowBuilder;

    /// Products on a grid of 90 × 70 with unequal entries, between ordered and between scattered neighbours,
    /// agree with f64 to the rounding of f32, and exactly on uniform vectors.
    #[test]
    fn products_of_grids_and_of_unordered_rows() {
        let (width, height) = (90, 70);
        let size = width * height;
        for scattered in [false, true] {
            let mut of: Vec<usize> = (0..size).collect();
            if scattered {
                of.sort_by(|a, b| f64::total_cmp(&((a * a) as f64).sin(), &((b * b) as f64).sin()));
            }
            let mut names = vec![0; size];
            of.iter().enumerate().for_each(|(name, &k)| names[k] = name);
            let name = |k: usize| names[k];
            let entry = |a: usize, b: usize| -1.0 - 0.5 * ((a.min(b) + 3 * a.max(b)) as f64).sin();
            let rows = ConductionRows::build(size, true, |row, out| {
                out.begin(std::iter::once(row as u32));
                let k = of[row];
                let mut sum = 0.0;
                let sides = [!k.is_multiple_of(width), k % width + 1 < width, k >= width, k + width < size];
                for (other, _) in [k.wrapping_sub(1), k + 1, k.wrapping_sub(width), k + width]
                    .into_iter()
                    .zip(sides)
                    .filter(|(_, there)| *there)
                {
                    let value = entry(k, other);
                    sum -= value;
                    out.add((name(other) as i64 - row as i64) as i32, value, -0.1 * value);
                }
                out.add(0, sum, 1.0);
            });
            let mut packed = PackedRows::default();
            let diagonal: Vec<f64> = (0..size).map(|k| 1e-3 * (k as f64).cos().abs()).collect();
            let x: Vec<f64> = (0..size).map(|k| (k as f64).sin()).collect();
            let one = vec![1.0; size];
            for weights in [[0.0, 1.0], [1.0, 1e6]] {
                assert!(packed.update(&rows, weights) && packed.items.iter().all(|kept| kept.item.is_some()));
                let banded = packed.items.iter().flat_map(|kept| &kept.item).flat_map(|item| &item.blocks);
                let banded = banded.filter(|block| block.banded).count();
                assert!(if scattered { banded == 0 } else { banded * LANES > size * 9 / 10 }, "{banded}");
                let [mut found, mut exact] = [vec![0.0; size], vec![0.0; size]];
                for (x, rounding) in [(&x, 4.0 * f64::from(f32::EPSILON)), (&one, 1e-15)] {
                    let dot = packed.product(&rows, Some(&diagonal), (1.0, weights), x, &mut found);
                    let exact_dot = rows.product(Some(&diagonal), weights, x, &mut exact);
                    let scale = weights[1] * 8.0;
                    let far = found.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                    assert!(far <= rounding * scale, "{far:e} {scale:e}");
                    assert!((dot - exact_dot).abs() <= rounding * scale * size as f64);
                }
            }
        }
    }

    /// Only work items with changed or appended rows are packed again; products equal those of rows made at
    /// once.
    #[test]
    fn unchanged_items_are_kept() {
        let fill = |scale: f64| {
            move |row: usize, out: &mut RowBuilder| {
                out.begin(std::iter::once(row as u32));
                let own = scale + 0.1 * (row as f64).sin();
                out.add(0, 2.0 * own, 0.0);
                (0..row.min(3)).for_each(|k| out.add(-1 - k as i32, -0.3 * own, 0.0));
            }
        };
        let (before, size) = (3 * CHUNK - 5, 4 * CHUNK + 17);
        let changed: Vec<u32> =
            (CHUNK as u32 + 3..CHUNK as u32 + 9).chain(before as u32..size as u32).collect();
        let mut rows = ConductionRows::build(before, false, fill(1.0));
        let mut packed = PackedRows::default();
        assert!(packed.update(&rows, [0.0, 1.0]));
        let made = |packed: &PackedRows| -> Vec<Option<u64>> {
            packed.items.iter().map(|kept| kept.shaped_for).collect()
        };
        let first = made(&packed);
        rows.update(size, &changed, fill(2.0));
        assert!(packed.update(&rows, [0.0, 1.0]));
        let second = made(&packed);
        assert_eq!(second.iter().zip(&first).map(|(a, b)| a == b).collect::<Vec<_>>(), [true, false, false]);
        assert_eq!(second.len(), 5);
        let whole = ConductionRows::build(size, false, |row, out: &mut RowBuilder| {
            fill(if changed.binary_search(&(row as u32)).is_ok() { 2.0 } else { 1.0 })(row, out);
        });
        let mut fresh = PackedRows::default();
        assert!(fresh.update(&whole, [0.0, 1.0]));
        let x: Vec<f64> = (0..size).map(|k| (k as f64).cos()).collect();
        let [mut kept, mut exact] = [vec![0.0; size], vec![0.0; size]];
        let dots = [(&packed, &rows, &mut kept), (&fresh, &whole, &mut exact)]
            .map(|(packed, rows, y)| packed.product(rows, None, (1.0, [0.0, 1.0]), &x, y));
        assert!(kept == exact && dots[0] == dots[1]);
    }

    /// Additions to a row with its own values are packed again with their work item.
    #[test]
    fn rows_of_their_own() {
        let fill = |own: bool| {
            move |row: usize, out: &mut RowBuilder| {
                out.begin(std::iter::once(row as u32));
                out.add(0, 2.0 + (row as f64).sin(), 0.0);
                (0..row.min(2)).for_each(|k| out.add(-1 - k as i32, -0.3, 0.0));
                out.own = own && row == 77;
            }
        };
        let size = 2 * CHUNK;
        let x: Vec<f64> = (0..size).map(|k| (k as f64).cos()).collect();
        let product = |packed: &mut PackedRows, rows: &ConductionRows| {
            assert!(packed.update(rows, [0.0, 1.0]));
            let mut y = vec![0.0; size];
            packed.product(rows, None, (1.0, [0.0, 1.0]), &x, &mut y);
            y
        };
        let mut rows = ConductionRows::build(size, false, fill(true));
        rows.keep();
        let mut packed = PackedRows::default();
        let first = product(&mut packed, &rows);
        assert_eq!(
            first,
            product(&mut PackedRows::default(), &ConductionRows::build(size, false, fill(false)))
        );
        rows.add(77, 76, 10.0, 0.0);
        let added = product(&mut packed, &rows);
        assert_eq!(added, product(&mut PackedRows::default(), &rows));
        let differ: Vec<usize> = (0..size).filter(|&row| added[row] != first[row]).collect();
        assert_eq!(differ, [77]);
        rows.restore();
        assert_eq!(first, product(&mut packed, &rows));
    }

    /// Equal rows are not packed.
    #[test]
    fn equal_rows_are_not_packed() {
        let rows = ConductionRows::build(10_000, false, |_, out| {
            out.begin(std::iter::empty());
            out.add(0, 2.0, 0.0);
        });
        assert!(!PackedRows::default().update(&rows, [0.0, 1.0]));
    }
}
