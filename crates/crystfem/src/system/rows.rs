//! Conduction matrix (and consistent capacity matrix) by rows, with each distinct list of offsets and of
//! values stored once.
//!
//! A row is a list of offsets, column − row, and a list of values. On a mesh with lines of equal elements
//! most consecutive rows are equal; a run of them is a stencil, y_i = Σ_k v_k x_{i+o_k}, without
//! index gathers. Otherwise this is a compressed row format, and partly filled cells have few distinct lists,
//! which stay in caches. Each row is written once, without colouring or sums across threads, so that the bits
//! do not depend on threads; the cost equals that of scattering because a stencil has 27 products and the
//! elements around a node have 64.
//!
//! A body of mostly unequal elements that exists from the start stores the upper halves by diagonals instead,
//! if its numbering allows it ([`bands`]).

pub(crate) mod bands;
mod builder;
mod product;
mod stencils;
mod update;

pub use builder::RowBuilder;

use super::vector::{CHUNK, items};
use bands::{BandFlow, BandProduct, Bands};
use polycore::numerics::ordered_sum;
use product::{FlowAndCapacity, RowsProduct};
use pulp::Arch;
use rayon::prelude::*;
use stencils::{RowStencil, Stencils};

/// A run of equal rows of one work item; `start` counts within the item.
#[derive(Clone, Copy, Debug)]
struct RowRun {
    start: u16,
    length: u16,
    stencil: RowStencil,
}

/// Matrices K and, with consistent capacity, M, over the existing nodes.
#[derive(Clone, Debug)]
pub struct ConductionRows {
    size: usize,
    consistent: bool,
    /// Longest runs of equal rows of each work item.
    segments: Vec<Vec<RowRun>>,
    stencils: Stencils,
    /// Stencil of each row with its own values; empty without such rows.
    own: Vec<RowStencil>,
    /// All entries, instead of stencils, if they are stored by diagonals.
    bands: Option<Bands>,
    /// Values without the contributions of each evaluation.
    base: Option<[Vec<f64>; 2]>,
    /// Version of the pattern, and of the values.
    versions: [u64; 2],
    /// Versions in which each work item last changed.
    changed: Vec<[u64; 2]>,
}

/// Diagonal of the rows, recomputed when they or the factors of M and K have changed.
#[derive(Default)]
pub struct Diagonal {
    values: Vec<f64>,
    made_for: Option<([u64; 2], [u64; 2])>,
}

impl Diagonal {
    /// Returns the diagonal of `weights[0]`·M + `weights[1]`·K.
    pub fn update(&mut self, rows: &ConductionRows, weights: [f64; 2]) -> &[f64] {
        let made_for = Some((rows.versions, weights.map(f64::to_bits)));
        if self.made_for != made_for {
            self.values.clear();
            self.values.resize(rows.size, 0.0);
            rows.add_diagonal(weights, &mut self.values);
            self.made_for = made_for;
        }
        &self.values
    }
}

/// Largest mean length of runs that count as short.
const MAX_SHORT_RUN: usize = 4;
/// Smallest ratio of rows to distinct ones that count as few.
const MIN_REPEATED_ROWS: usize = 4;

impl ConductionRows {
    /// Returns an empty matrix.
    pub fn new(consistent: bool) -> Self {
        Self {
            size: 0,
            consistent,
            segments: Vec::new(),
            stencils: Stencils::default(),
            own: Vec::new(),
            bands: None,
            base: None,
            versions: [0; 2],
            changed: Vec::new(),
        }
    }

    /// Returns empty rows that are stored by diagonals.
    pub fn from_bands(bands: Bands) -> Self {
        let (size, versions) = (bands.layout.size, [1; 2]);
        let changed = vec![versions; items(size)];
        Self { size, bands: Some(bands), versions, changed, ..Self::new(false) }
    }

    /// Diagonals, if rows are stored by them.
    pub fn bands(&self) -> Option<&Bands> {
        self.bands.as_ref()
    }

    /// Number of rows.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Number of work items.
    pub fn items(&self) -> usize {
        items(self.size)
    }

    /// Versions of the pattern and of the values.
    pub fn versions(&self) -> [u64; 2] {
        self.versions
    }

    /// Versions of the rows of one work item.
    pub fn versions_of(&self, item: usize) -> [u64; 2] {
        self.changed[item]
    }

    /// Returns true if most rows of a work item differ from their neighbours.
    pub fn is_unequal(&self, item: usize) -> bool {
        if self.bands.is_some() {
            return true;
        }
        let rows = (self.size - item * CHUNK).min(CHUNK);
        MAX_SHORT_RUN * self.segments[item].len() > rows
    }

    /// Returns true if distinct rows are few enough for caches, however they alternate.
    pub fn are_few(&self) -> bool {
        self.bands.is_none() && MIN_REPEATED_ROWS * self.stencils.values.used <= self.size
    }

    /// Builds `size` rows; `fill` begins each row and adds its entries.
    #[cfg(test)]
    pub fn build(size: usize, consistent: bool, fill: impl Fn(usize, &mut RowBuilder) + Sync) -> Self {
        let mut rows = Self::new(consistent);
        rows.update(size, &(0..size as u32).collect::<Vec<_>>(), fill);
        rows
    }

    /// Number of lists of values, of runs of equal rows, and of entries of K; independent of the history.
    pub fn stored(&self) -> [usize; 3] {
        if let Some(bands) = &self.bands {
            return [self.size, self.size, bands.entries()];
        }
        let Stencils { values, .. } = &self.stencils;
        [values.used, self.segments.iter().map(Vec::len).sum(), values.entries() - values.dead]
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        if let Some(bands) = &self.bands {
            return bands.bytes();
        }
        let runs: usize = self.segments.iter().map(Vec::len).sum();
        runs * size_of::<RowRun>() + self.own.len() * size_of::<RowStencil>() + self.stencils.bytes()
    }

    /// Adds to an entry of a row with its own values; without effect on other rows, and below the diagonal of
    /// rows that are stored by diagonals.
    pub fn add(&mut self, row: usize, column: usize, conduction: f64, capacity: f64) {
        if let Some(bands) = &mut self.bands {
            bands.add(row, column, conduction, capacity);
            self.versions[1] += 1;
            self.changed[row / CHUNK][1] = self.versions[1];
            return;
        }
        let Some(&RowStencil { pattern, values }) = self.own.get(row).filter(|own| **own != RowStencil::NONE)
        else {
            return;
        };
        let start = self.stencils.values.range(values).start;
        let offset = column as i64 - row as i64;
        self.versions[1] += 1;
        self.changed[row / CHUNK][1] = self.versions[1];
        let offsets = self.stencils.offsets(pattern);
        if let Ok(at) = offsets.binary_search_by_key(&offset, |&o| i64::from(o)) {
            self.stencils.conduction[start + at] += conduction;
            if !self.stencils.capacity.is_empty() {
                self.stencils.capacity[start + at] += capacity;
            }
        }
    }

    /// Saves the values of new rows, to which [`Self::restore`] returns them.
    pub fn keep(&mut self) {
        let base = self.base.get_or_insert_default();
        let Stencils { conduction, capacity, .. } = &self.stencils;
        for (base, values) in base.iter_mut().zip([conduction, capacity]) {
            base.extend_from_slice(&values[base.len()..]);
        }
    }

    /// Restores the saved values.
    pub fn restore(&mut self) {
        if let Some([conduction, capacity]) = &self.base {
            self.stencils.conduction.copy_from_slice(conduction);
            self.stencils.capacity.copy_from_slice(capacity);
            self.versions[1] += 1;
            self.changed.iter_mut().for_each(|changed| changed[1] = self.versions[1]);
        }
    }

    /// Adds the diagonal of `weights[0]`·M + `weights[1]`·K.
    pub fn add_diagonal(&self, weights: [f64; 2], to: &mut [f64]) {
        to.par_chunks_mut(CHUNK).enumerate().for_each(|(item, to)| {
            if let Some(bands) = &self.bands {
                (item * CHUNK..).zip(to).for_each(|(row, to)| *to += bands.value(0, row, weights));
                return;
            }
            for segment in &self.segments[item] {
                let value = self.diagonal(segment, weights);
                to[segment.rows()].iter_mut().for_each(|to| *to += value);
            }
        });
    }

    /// Returns the largest of `of(row, K_ii)`.
    pub fn largest(&self, of: impl Fn(usize, f64) -> f64 + Sync) -> f64 {
        if let Some(bands) = &self.bands {
            let value = |row: usize| of(row, bands.value(0, row, [0.0, 1.0]));
            return (0..self.size).into_par_iter().map(value).reduce(|| f64::NEG_INFINITY, f64::max);
        }
        let item = |(item, segments): (usize, &Vec<RowRun>)| {
            let mut most = f64::NEG_INFINITY;
            for segment in segments {
                let value = self.diagonal(segment, [0.0, 1.0]);
                segment.rows().for_each(|row| most = most.max(of(item * CHUNK + row, value)));
            }
            most
        };
        self.segments.par_iter().enumerate().map(item).reduce(|| f64::NEG_INFINITY, f64::max)
    }

    fn diagonal(&self, segment: &RowRun, weights: [f64; 2]) -> f64 {
        self.stencils.diagonal(segment.stencil).map_or(0.0, |at| self.value(at, weights))
    }

    /// Columns of a row, ascending.
    pub fn columns(&self, row: usize) -> impl Iterator<Item = usize> + '_ {
        self.row(row, [0.0; 2]).map(|(column, _)| column)
    }

    /// Entries (column, value) of a row of `weights[0]`·M + `weights[1]`·K, columns ascending.
    pub fn row(&self, row: usize, weights: [f64; 2]) -> impl Iterator<Item = (usize, f64)> + '_ {
        let by_bands = self.bands.iter().flat_map(move |bands| bands.row(row, weights));
        let stencil = self.segment(row).map(|segment| segment.stencil);
        let offsets = stencil.map_or(&[][..], |stencil| self.stencils.offsets(stencil.pattern));
        let start = stencil.map_or(0, |stencil| self.stencils.values.range(stencil.values).start);
        let listed = (start..)
            .zip(offsets)
            .map(move |(at, &offset)| (row.wrapping_add_signed(offset as isize), self.value(at, weights)));
        by_bands.chain(listed)
    }

    /// Run of a row.
    fn segment(&self, row: usize) -> Option<&RowRun> {
        let segments = self.segments.get(row / CHUNK)?;
        let next = segments.partition_point(|segment| usize::from(segment.start) <= row % CHUNK);
        segments.get(next.saturating_sub(1))
    }

    fn value(&self, at: usize, [capacity, conduction]: [f64; 2]) -> f64 {
        let own = conduction * self.stencils.conduction[at];
        match self.stencils.capacity.get(at) {
            Some(value) => own + capacity * value,
            None => own,
        }
    }

    /// Computes y = diagonal·x + (`weights[0]`·M + `weights[1]`·K) x; returns x·y, summed in the order of the
    /// items.
    pub fn product(&self, diagonal: Option<&[f64]>, weights: [f64; 2], x: &[f64], y: &mut [f64]) -> f64 {
        self.multiply::<false>(diagonal, weights, x, y)
    }

    /// Computes y = K x as Σ_j K_ij (x_j − x_i): rows of K sum to zero. Rounding is that of the differences,
    /// so that heat is conserved relative to the heat flow, not to the stored heat.
    pub fn flow(&self, x: &[f64], y: &mut [f64]) {
        self.multiply::<true>(None, [0.0, 1.0], x, y);
    }

    /// Computes [`Self::flow`] of x, and M u of the consistent capacity.
    pub fn flow_and_capacity(&self, x: &[f64], u: &[f64], flow: &mut [f64], stored: &mut [f64]) {
        flow.par_chunks_mut(CHUNK).zip(stored.par_chunks_mut(CHUNK)).enumerate().for_each(
            |(item, (flow, stored))| {
                let first = item * CHUNK;
                if let Some(bands) = &self.bands {
                    return Arch::new().dispatch(BandFlow { bands, x, u, flow, stored, first });
                }
                let segments = &self.segments[item];
                Arch::new().dispatch(FlowAndCapacity { rows: self, segments, x, u, flow, stored, first });
            },
        );
    }

    fn multiply<const FLOW: bool>(
        &self,
        diagonal: Option<&[f64]>,
        weights: [f64; 2],
        x: &[f64],
        y: &mut [f64],
    ) -> f64 {
        let part = |(item, y): (usize, &mut [f64])| self.multiply_item::<FLOW>(item, diagonal, weights, x, y);
        ordered_sum(y.par_chunks_mut(CHUNK).enumerate().map(part))
    }

    /// Multiplies the rows of one work item, by [`Self::product`] or as a flow.
    pub fn multiply_item<const FLOW: bool>(
        &self,
        item: usize,
        diagonal: Option<&[f64]>,
        weights: [f64; 2],
        x: &[f64],
        y: &mut [f64],
    ) -> f64 {
        let first = item * CHUNK;
        if let Some(bands) = &self.bands {
            return Arch::new().dispatch(BandProduct::<FLOW> { bands, weights, diagonal, x, y, first });
        }
        let segments = &self.segments[item];
        Arch::new().dispatch(RowsProduct::<FLOW> { rows: self, segments, weights, diagonal, x, y, first })
    }
}

impl RowRun {
    /// Rows, within the work item.
    #[inline(always)]
    fn rows(self) -> std::ops::Range<usize> {
        let start = self.start as usize;
        start..start + self.length as usize
    }
}

#[cfg(test)]
mod band_tests;
#[cfg(test)]
mod tests;
