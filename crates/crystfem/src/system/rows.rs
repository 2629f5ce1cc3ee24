//! Conduction matrix (and consistent capacity matrix) by rows, with each distinct list of offsets and of
//! values stored once.
//!
//! A row is a list of offsets, column − row, and a list of values. On a mesh with lines of equal elements
//! most consecutive rows are equal; a run of them is a stencil, y_i = Σ_k v_k x_{i+o_k}, without
//! index gathers. Otherwise this is a compressed row format, and partly filled cells have few distinct lists,
//! which stay in caches. Each row is written once, without colouring or sums across threads, so that the bits
//! do not depend on threads; the cost equals that of scattering because a stencil has 27 products and the
//! elements around a node have 64.

mod product;
mod stencils;

use super::vector::{CHUNK, items};
use polycore::numerics::ordered_sum;
use product::{FlowAndCapacity, RowsProduct};
use pulp::Arch;
use rayon::prelude::*;
use stencils::{Entries, RowStencil, Stencils};

/// A run of equal rows of one work item; `start` counts within the item.
#[derive(Clone, Copy, Debug)]
struct RowRun {
    start: u16,
    length: u16,
    stencil: RowStencil,
}

/// A row under construction.
#[derive(Debug, Default)]
pub struct RowBuilder {
    entries: Vec<(i32, f64, f64)>,
    /// The entries, sorted, list by list.
    offsets: Vec<i32>,
    values: [Vec<f64>; 2],
    /// True if the row has entries that are set later, and so cannot be shared.
    pub own: bool,
    key: Vec<u32>,
    new_key: Vec<u32>,
    repeated: bool,
}

impl RowBuilder {
    /// Begins a row with its determinants. Returns true if they equal those of the row before: then nothing
    /// needs to be added.
    pub fn begin(&mut self, determinants: impl Iterator<Item = u32>) -> bool {
        self.new_key.clear();
        // iterated from within: chains of iterators are slow from outside
        let Self { new_key, .. } = self;
        determinants.for_each(|determinant| new_key.push(determinant));
        self.repeated = !self.own && !self.key.is_empty() && self.key == self.new_key;
        if !self.repeated {
            std::mem::swap(&mut self.key, &mut self.new_key);
            self.entries.clear();
            self.own = false;
        }
        self.repeated
    }

    /// Sorts the added entries.
    fn sorted(&mut self, consistent: bool) -> Entries<'_> {
        let Self { entries, offsets, values: [conduction, capacity], .. } = self;
        entries.sort_unstable_by_key(|entry| entry.0);
        offsets.clear();
        offsets.extend(entries.iter().map(|entry| entry.0));
        conduction.clear();
        conduction.extend(entries.iter().map(|entry| entry.1));
        capacity.clear();
        capacity.extend(entries.iter().filter(|_| consistent).map(|entry| entry.2));
        Entries { offsets, conduction, capacity }
    }

    /// Adds to the entry at an offset from the diagonal.
    pub fn add(&mut self, offset: i32, conduction: f64, capacity: f64) {
        match self.entries.iter_mut().find(|entry| entry.0 == offset) {
            Some(entry) => {
                entry.1 += conduction;
                entry.2 += capacity;
            }
            None => self.entries.push((offset, conduction, capacity)),
        }
    }
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
/// Marks a list that has no number yet.
const UNNUMBERED: u32 = u32::MAX;
/// Reciprocal of the fraction of entries that may belong to unused stencils.
const MIN_USED_RATIO: usize = 4;
/// Smallest ratio of rows to distinct ones that count as few.
const MIN_REPEATED_ROWS: usize = 4;

/// New rows of one work item: runs with locally numbered stencils, and true for rows with their own values.
struct NewRows {
    runs: Vec<(RowRun, bool)>,
    stencils: Stencils,
}

impl ConductionRows {
    /// Returns an empty matrix.
    pub fn new(consistent: bool) -> Self {
        Self {
            size: 0,
            consistent,
            segments: Vec::new(),
            stencils: Stencils::default(),
            own: Vec::new(),
            base: None,
            versions: [0; 2],
            changed: Vec::new(),
        }
    }

    /// Number of rows.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Number of work items.
    pub fn items(&self) -> usize {
        self.segments.len()
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
        let rows = (self.size - item * CHUNK).min(CHUNK);
        MAX_SHORT_RUN * self.segments[item].len() > rows
    }

    /// Returns true if distinct rows are few enough for caches, however they alternate.
    pub fn are_few(&self) -> bool {
        MIN_REPEATED_ROWS * self.stencils.values.used <= self.size
    }

    /// Builds `size` rows; `fill` begins each row and adds its entries.
    #[cfg(test)]
    pub fn build(size: usize, consistent: bool, fill: impl Fn(usize, &mut RowBuilder) + Sync) -> Self {
        let mut rows = Self::new(consistent);
        rows.update(size, &(0..size as u32).collect::<Vec<_>>(), fill);
        rows
    }

    /// Rebuilds the `changed` rows, ascending, and adds empty ones up to `size`; `fill` begins each row and
    /// adds its entries. Other rows stay. The result depends on the rows alone, not on their history, except
    /// for unused stencils.
    pub fn update(&mut self, size: usize, changed: &[u32], fill: impl Fn(usize, &mut RowBuilder) + Sync) {
        let Stencils { values, patterns, .. } = &self.stencils;
        if values.dead + patterns.dead > (values.entries() / MIN_USED_RATIO).max(self.size) {
            self.compact();
        }
        self.versions = self.versions.map(|version| version + 1);
        let groups: Vec<&[u32]> =
            changed.chunk_by(|a, b| *a as usize / CHUNK == *b as usize / CHUNK).collect();
        let parts: Vec<NewRows> =
            groups.par_iter().map(|changed| NewRows::new(changed, self.consistent, &fill)).collect();
        let before = self.size;
        self.size = size.max(before);
        self.segments.resize_with(items(self.size), Vec::new);
        self.changed.resize(self.segments.len(), self.versions);
        if !self.own.is_empty() || parts.iter().any(|part| part.runs.iter().any(|run| run.1)) {
            self.own.resize(self.size, RowStencil::NONE);
        }
        let mut of = Vec::with_capacity(CHUNK);
        let mut parts = groups.iter().map(|group| group[0] as usize / CHUNK).zip(parts).peekable();
        for item in 0..self.segments.len() {
            let first = item * CHUNK;
            let end = (first + CHUNK).min(self.size);
            let part = parts.next_if(|part| part.0 == item).map(|part| part.1);
            if part.is_none() && end <= before {
                continue;
            }
            self.changed[item] = self.versions;
            of.clear();
            of.resize(end - first, RowStencil::NONE);
            for segment in &self.segments[item] {
                of[segment.rows()].fill(segment.stencil);
                self.stencils.patterns.remove_rows(segment.stencil.pattern, segment.length);
                self.stencils.values.remove_rows(segment.stencil.values, segment.length);
            }
            if let Some(part) = part {
                let mut patterns = vec![UNNUMBERED; part.stencils.patterns.count()];
                let mut values = vec![UNNUMBERED; part.stencils.values.count()];
                for (run, own) in &part.runs {
                    let entries = part.stencils.entries(run.stencil);
                    let pattern = &mut patterns[run.stencil.pattern as usize];
                    if *pattern == UNNUMBERED {
                        *pattern = self.stencils.pattern(entries.offsets);
                    }
                    let values = &mut values[run.stencil.values as usize];
                    if *values == UNNUMBERED {
                        *values = self.stencils.list(entries, *own);
                    }
                    let stencil = RowStencil { pattern: *pattern, values: *values };
                    of[run.rows()].fill(stencil);
                    if let Some(place) = self.own.get_mut(first + usize::from(run.start))
                        && *own
                    {
                        *place = stencil;
                    }
                }
            }
            // rows out of use
            if of.contains(&RowStencil::NONE) {
                let none = Entries { offsets: &[], conduction: &[], capacity: &[] };
                let empty = self.stencils.find_or_add(none, false);
                of.iter_mut()
                    .filter(|stencil| **stencil == RowStencil::NONE)
                    .for_each(|stencil| *stencil = empty);
            }
            self.segments[item].clear();
            let mut start = 0;
            for run in of.chunk_by(|a, b| a == b) {
                let segment = RowRun { start, length: run.len() as u16, stencil: run[0] };
                self.count_rows(segment);
                self.segments[item].push(segment);
                start += segment.length;
            }
            self.segments[item].shrink_to_fit();
        }
    }

    fn count_rows(&mut self, RowRun { length, stencil, .. }: RowRun) {
        self.stencils.patterns.add_rows(stencil.pattern, length);
        self.stencils.values.add_rows(stencil.values, length);
    }

    /// Drops unused lists.
    fn compact(&mut self) {
        let old = std::mem::take(&mut self.stencils);
        let base = self.base.take();
        let mut patterns = vec![UNNUMBERED; old.patterns.count()];
        let mut values = vec![UNNUMBERED; old.values.count()];
        let mut kept = base.as_ref().map(|_| [Vec::new(), Vec::new()]);
        for item in 0..self.segments.len() {
            for at in 0..self.segments[item].len() {
                let RowRun { start, stencil, .. } = self.segments[item][at];
                let own = self.own.get_mut(item * CHUNK + usize::from(start));
                let own = own.filter(|own| **own != RowStencil::NONE);
                let entries = old.entries(stencil);
                let pattern = &mut patterns[stencil.pattern as usize];
                if *pattern == UNNUMBERED {
                    *pattern = self.stencils.pattern(entries.offsets);
                }
                let values = &mut values[stencil.values as usize];
                if *values == UNNUMBERED {
                    *values = self.stencils.list(entries, own.is_some());
                    for (kept, base) in kept.iter_mut().flatten().zip(base.iter().flatten()) {
                        kept.extend_from_slice(
                            base.get(old.values.range(stencil.values)).unwrap_or_default(),
                        );
                    }
                }
                let stencil = RowStencil { pattern: *pattern, values: *values };
                own.into_iter().for_each(|own| *own = stencil);
                self.segments[item][at].stencil = stencil;
                self.count_rows(self.segments[item][at]);
            }
        }
        self.base = kept;
    }

    /// Number of lists of values, of runs of equal rows, and of entries of K; independent of the history.
    pub fn stored(&self) -> [usize; 3] {
        let Stencils { values, .. } = &self.stencils;
        [values.used, self.segments.iter().map(Vec::len).sum(), values.entries() - values.dead]
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        let runs: usize = self.segments.iter().map(Vec::len).sum();
        runs * size_of::<RowRun>() + self.own.len() * size_of::<RowStencil>() + self.stencils.bytes()
    }

    /// Adds to an entry of a row with its own values; without effect on other rows.
    pub fn add(&mut self, row: usize, column: usize, conduction: f64, capacity: f64) {
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
            for segment in &self.segments[item] {
                let value = self.diagonal(segment, weights);
                to[segment.rows()].iter_mut().for_each(|to| *to += value);
            }
        });
    }

    /// Returns the largest of `of(row, K_ii)`.
    pub fn largest(&self, of: impl Fn(usize, f64) -> f64 + Sync) -> f64 {
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
        let stencil = self.segment(row).map(|segment| segment.stencil);
        let offsets = stencil.map_or(&[][..], |stencil| self.stencils.offsets(stencil.pattern));
        let start = stencil.map_or(0, |stencil| self.stencils.values.range(stencil.values).start);
        (start..)
            .zip(offsets)
            .map(move |(at, &offset)| (row.wrapping_add_signed(offset as isize), self.value(at, weights)))
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
                let (segments, first) = (&self.segments[item], item * CHUNK);
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
        let (segments, first) = (&self.segments[item], item * CHUNK);
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

impl NewRows {
    /// Builds the rows of one work item, ascending.
    fn new(changed: &[u32], consistent: bool, fill: &(impl Fn(usize, &mut RowBuilder) + Sync)) -> Self {
        let mut part = Self { runs: Vec::new(), stencils: Stencils::default() };
        let mut row = RowBuilder::default();
        for &index in changed {
            fill(index as usize, &mut row);
            let start = (index as usize % CHUNK) as u16;
            let (repeated, own) = (row.repeated, row.own);
            let stencil = match part.runs.last() {
                Some((last, _)) if repeated => last.stencil,
                _ => part.stencils.find_or_add(row.sorted(consistent), own),
            };
            match part.runs.last_mut() {
                Some((last, false)) if last.stencil == stencil && last.start + last.length == start => {
                    last.length += 1;
                }
                _ => part.runs.push((RowRun { start, length: 1, stencil }, own)),
            }
        }
        part
    }
}

#[cfg(test)]
mod tests;
