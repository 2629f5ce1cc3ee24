//! Symmetric matrices K and M by diagonals, for meshes of unequal elements whose nodes are numbered in lines.
//!
//! Such a mesh, however distorted, has the same few distances between neighbouring equations everywhere: 13
//! for bricks. The entries a_ij, j ≥ i, of one distance j − i are stored side by side, and a_ji is a_ij.
//! Products are vectors without gathers, and memory and its traffic are half of those of whole rows:
//!
//! y_i = Σ_d a_d[i] x_{i+d} + Σ_d a_d[i−d] x_{i−d}.
//!
//! The second sum reads what the first has read for earlier rows, from caches.

use crate::system::vector::dot_simd;
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// Largest number of distances.
const MAX_BANDS: usize = 32;
/// Largest ratio of stored numbers to entries.
const MAX_SPREAD: f64 = 1.3;
/// Number of rows whose sums stay in the nearest cache while all distances are added, one after the other:
/// then few streams of numbers are read at once, which the processor fetches ahead. A divisor of a work item.
pub(crate) const TILE: usize = 512;

/// Places of the entries of an upper half: tile by tile of rows, and in a tile distance by distance, so that
/// memory is read in its order.
#[derive(Clone, Debug, Default)]
pub struct BandLayout {
    /// Number of rows.
    pub size: usize,
    /// Distances j − i, ascending.
    pub distances: Vec<usize>,
}

/// Neighbouring entries of a tile's rows, of one distance.
#[derive(Clone, Copy)]
pub(crate) struct BandPiece {
    /// Place of the first value.
    pub at: usize,
    /// First row, within the tile.
    pub begin: usize,
    /// Number of rows.
    pub length: usize,
    /// Column of the first row.
    pub column: usize,
}

impl BandLayout {
    /// Number of places.
    pub fn places(&self) -> usize {
        self.size.div_ceil(TILE) * TILE * self.distances.len()
    }

    /// Place of entry a_ij, j − i = `distances`\[`band`\].
    #[inline(always)]
    pub fn entry_index(&self, band: usize, row: usize) -> usize {
        (row / TILE * self.distances.len() + band) * TILE + row % TILE
    }

    /// Returns the entries of a tile's rows, all or its first ones, of one distance: to the right of the
    /// diagonal, and those to the left, which are the right ones of rows in up to two tiles.
    #[inline(always)]
    pub(crate) fn pieces(&self, band: usize, rows: &Range<usize>) -> [Option<BandPiece>; 3] {
        let distance = self.distances[band];
        let right = rows.start..rows.end.min(self.size.saturating_sub(distance)).max(rows.start);
        let piece = |rows: &Range<usize>, begin: usize, column: usize| {
            (!rows.is_empty()).then(|| BandPiece {
                at: self.entry_index(band, rows.start),
                begin,
                length: rows.len(),
                column,
            })
        };
        let mut pieces = [piece(&right, 0, rows.start + distance), None, None];
        if distance > 0 && distance < rows.end {
            let left = rows.start.saturating_sub(distance)..rows.end - distance;
            let cut = ((left.start / TILE + 1) * TILE).min(left.end);
            let begin = |column: usize| column + distance - rows.start;
            pieces[1] = piece(&(left.start..cut), begin(left.start), left.start);
            pieces[2] = piece(&(cut..left.end), begin(cut), cut);
        }
        pieces
    }
}

/// Upper halves of K and, with consistent capacity, M.
#[derive(Clone, Debug)]
pub struct Bands {
    /// Places of the entries; the first distance is 0.
    pub layout: BandLayout,
    /// Bit b of row i: a_ij, j − i = `distances`\[b\], is an entry.
    pattern: Vec<u32>,
    /// K.
    conduction: Vec<f64>,
    /// M; empty with lumped capacity.
    capacity: Vec<f64>,
}

impl Bands {
    /// Returns empty matrices for elements whose equations `list` appends; `None` if their distances are too
    /// many for bands to save memory.
    pub fn find<T>(
        size: usize,
        consistent: bool,
        elements: impl Iterator<Item = T>,
        list: impl Fn(T, &mut Vec<u32>),
    ) -> Option<Self> {
        let (mut distances, mut pattern) = (vec![0], vec![0_u32; size]);
        let mut equations = Vec::new();
        for element in elements {
            equations.clear();
            list(element, &mut equations);
            for (a, &one) in equations.iter().enumerate() {
                for &other in &equations[a..] {
                    let distance = one.abs_diff(other) as usize;
                    let bit = match distances.iter().position(|known| *known == distance) {
                        Some(bit) => bit,
                        None if distances.len() < MAX_BANDS => {
                            distances.push(distance);
                            distances.len() - 1
                        }
                        None => return None,
                    };
                    pattern[one.min(other) as usize] |= 1 << bit;
                }
            }
        }
        let entries: usize = pattern.iter().map(|bits| bits.count_ones() as usize).sum();
        let numbers = size * distances.len();
        if numbers as f64 > MAX_SPREAD * entries as f64 {
            return None;
        }
        // in ascending order, so that rows are sorted
        let mut order: Vec<usize> = (0..distances.len()).collect();
        order.sort_unstable_by_key(|&bit| distances[bit]);
        for bits in &mut pattern {
            let old = *bits;
            *bits = order.iter().zip(0..).map(|(from, to)| (old >> from & 1) << to).sum();
        }
        distances.sort_unstable();
        let layout = BandLayout { size, distances };
        let places = layout.places();
        let capacity = vec![0.0; if consistent { places } else { 0 }];
        Some(Self { layout, pattern, conduction: vec![0.0; places], capacity })
    }

    /// Adds to an entry of the upper half; without effect on others.
    pub fn add(&mut self, row: usize, column: usize, conduction: f64, capacity: f64) {
        let Some(distance) = column.checked_sub(row) else { return };
        if let Ok(band) = self.layout.distances.binary_search(&distance) {
            let at = self.layout.entry_index(band, row);
            self.conduction[at] += conduction;
            if let Some(value) = self.capacity.get_mut(at) {
                *value += capacity;
            }
        }
    }

    /// Number of entries of the whole K.
    pub fn entries(&self) -> usize {
        let half: usize = self.pattern.iter().map(|bits| bits.count_ones() as usize).sum();
        2 * half - self.layout.size
    }

    /// Number of stored values, of all bands.
    pub fn numbers(&self) -> usize {
        self.conduction.len() + self.capacity.len()
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        self.numbers() * size_of::<f64>() + self.pattern.len() * size_of::<u32>()
    }

    /// Returns entry a_ij of `weights[0]`·M + `weights[1]`·K, j − i = `distances`\[`band`\].
    #[inline(always)]
    pub fn value(&self, band: usize, row: usize, [capacity, conduction]: [f64; 2]) -> f64 {
        let at = self.layout.entry_index(band, row);
        let own = conduction * self.conduction[at];
        match self.capacity.get(at) {
            Some(value) => own + capacity * value,
            None => own,
        }
    }

    /// Entries (column, value) of a row of `weights[0]`·M + `weights[1]`·K, columns ascending.
    pub fn row(&self, row: usize, weights: [f64; 2]) -> impl Iterator<Item = (usize, f64)> + '_ {
        let entry = move |row: usize, band: usize| {
            (self.pattern[row] >> band & 1 == 1).then(|| self.value(band, row, weights))
        };
        let below = (1..self.layout.distances.len()).rev().filter_map(move |band| {
            let column = row.checked_sub(self.layout.distances[band])?;
            Some((column, entry(column, band)?))
        });
        let above = (0..self.layout.distances.len())
            .filter_map(move |band| Some((row + self.layout.distances[band], entry(row, band)?)));
        below.chain(above)
    }
}

/// Product of rows from `first` on: y = diagonal·x + (`weights[0]`·M + `weights[1]`·K) x, or, as a flow, Σ_j
/// a_ij (x_j − x_i). Returns x·y, 0 for a flow.
pub(super) struct BandProduct<'a, const FLOW: bool> {
    pub bands: &'a Bands,
    pub weights: [f64; 2],
    pub diagonal: Option<&'a [f64]>,
    pub x: &'a [f64],
    pub y: &'a mut [f64],
    pub first: usize,
}

impl<const FLOW: bool> WithSimd for BandProduct<'_, FLOW> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Self { bands, weights: [capacity, conduction], diagonal, x, y, first } = self;
        for (tile, y) in y.chunks_mut(TILE).enumerate() {
            let start = first + tile * TILE;
            let rows = start..start + y.len();
            match diagonal {
                Some(diagonal) => {
                    let terms = diagonal[rows.clone()].iter().zip(&x[rows.clone()]);
                    y.iter_mut().zip(terms).for_each(|(y, (d, x))| *y = d * x);
                }
                None => y.fill(0.0),
            }
            for band in 0..bands.layout.distances.len() {
                for piece in bands.layout.pieces(band, &rows).into_iter().flatten() {
                    let BandPiece { at, begin, length, column } = piece;
                    let own = &x[start + begin..][..length];
                    let (y, other) = (&mut y[begin..][..length], &x[column..][..length]);
                    let own = if FLOW { own } else { &[] };
                    add(simd, conduction, &bands.conduction[at..][..length], other, own, y);
                    if let Some(values) = bands.capacity.get(at..at + length) {
                        add(simd, capacity, values, other, own, y);
                    }
                }
            }
        }
        if FLOW { 0.0 } else { dot_simd(simd, &x[first..first + y.len()], y) }
    }
}

/// Adds factor·a·(other − own) to y; `own` may be empty for 0.
#[inline(always)]
fn add<S: Simd>(simd: S, factor: f64, a: &[f64], other: &[f64], own: &[f64], y: &mut [f64]) {
    let ((a, a_rest), (other, other_rest)) = (S::as_simd_f64s(a), S::as_simd_f64s(other));
    let ((own, own_rest), (y, y_rest)) = (S::as_simd_f64s(own), S::as_mut_simd_f64s(y));
    let by = simd.splat_f64s(factor);
    let count = y.len();
    let (a, other) = (&a[..count], &other[..count]);
    if own.is_empty() {
        for k in 0..count {
            y[k] = simd.mul_add_f64s(simd.mul_f64s(by, a[k]), other[k], y[k]);
        }
    } else {
        let own = &own[..count];
        for k in 0..count {
            let difference = simd.sub_f64s(other[k], own[k]);
            y[k] = simd.mul_add_f64s(simd.mul_f64s(by, a[k]), difference, y[k]);
        }
    }
    for (k, y) in y_rest.iter_mut().enumerate() {
        *y += factor * a_rest[k] * (other_rest[k] - own_rest.get(k).unwrap_or(&0.0));
    }
}

/// Flow K x as Σ_j K_ij (x_j − x_i), and M u, of rows from `first` on, in one pass.
pub(super) struct BandFlow<'a> {
    pub bands: &'a Bands,
    pub x: &'a [f64],
    pub u: &'a [f64],
    pub flow: &'a mut [f64],
    pub stored: &'a mut [f64],
    pub first: usize,
}

impl WithSimd for BandFlow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { bands, x, u, flow, stored, first } = self;
        for (tile, (flow, stored)) in flow.chunks_mut(TILE).zip(stored.chunks_mut(TILE)).enumerate() {
            let start = first + tile * TILE;
            let rows = start..start + flow.len();
            flow.fill(0.0);
            stored.fill(0.0);
            for band in 0..bands.layout.distances.len() {
                for piece in bands.layout.pieces(band, &rows).into_iter().flatten() {
                    let BandPiece { at, begin, length, column } = piece;
                    let entries = [&bands.conduction, &bands.capacity].map(|list| &list[at..][..length]);
                    let others = [x, u].map(|list| &list[column..][..length]);
                    let sums = [&mut flow[begin..][..length], &mut stored[begin..][..length]];
                    add_both(simd, entries, others, &x[start + begin..][..length], sums);
                }
            }
        }
    }
}

/// Adds K·(x − own) and M·u to their sums.
#[inline(always)]
fn add_both<S: Simd>(
    simd: S,
    [k, m]: [&[f64]; 2],
    [x, u]: [&[f64]; 2],
    own: &[f64],
    [flow, stored]: [&mut [f64]; 2],
) {
    let ((k, k_rest), (m, m_rest)) = (S::as_simd_f64s(k), S::as_simd_f64s(m));
    let ((x, x_rest), (u, u_rest)) = (S::as_simd_f64s(x), S::as_simd_f64s(u));
    let (own, own_rest) = S::as_simd_f64s(own);
    let (flow, flow_rest) = S::as_mut_simd_f64s(flow);
    let (stored, stored_rest) = S::as_mut_simd_f64s(stored);
    let count = flow.len();
    let (k, m, x, u) = (&k[..count], &m[..count], &x[..count], &u[..count]);
    let (own, stored) = (&own[..count], &mut stored[..count]);
    for at in 0..count {
        flow[at] = simd.mul_add_f64s(k[at], simd.sub_f64s(x[at], own[at]), flow[at]);
        stored[at] = simd.mul_add_f64s(m[at], u[at], stored[at]);
    }
    for at in 0..flow_rest.len() {
        flow_rest[at] += k_rest[at] * (x_rest[at] - own_rest[at]);
        stored_rest[at] += m_rest[at] * u_rest[at];
    }
}
