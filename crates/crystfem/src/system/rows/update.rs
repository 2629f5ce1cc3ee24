//! New and changed rows, stored with the others.

use super::stencils::{Entries, RowStencil, Stencils};
use super::{ConductionRows, RowBuilder, RowRun};
use crate::system::vector::{CHUNK, items};
use rayon::prelude::*;

/// Marks a list that has no number yet.
const UNNUMBERED: u32 = u32::MAX;
/// Reciprocal of the fraction of entries that may belong to unused stencils.
const MIN_USED_RATIO: usize = 4;
/// Number of work items for each thread whose new rows are built together.
const ITEMS_AT_ONCE: usize = 4;

/// New rows of one work item: runs with locally numbered stencils, and true for rows with their own values.
struct NewRows {
    runs: Vec<(RowRun, bool)>,
    stencils: Stencils,
}

impl ConductionRows {
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
        // a few work items at once: unequal rows take memory twice until they are stored
        let (consistent, batch) = (self.consistent, ITEMS_AT_ONCE * rayon::current_num_threads());
        let parts = groups.chunks(batch).flat_map(|groups| {
            let part = |changed: &&[u32]| NewRows::new(changed, consistent, &fill);
            groups.par_iter().map(part).collect::<Vec<_>>()
        });
        let before = self.size;
        self.size = size.max(before);
        self.segments.resize_with(items(self.size), Vec::new);
        self.changed.resize(self.segments.len(), self.versions);
        if !self.own.is_empty() {
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
                if part.runs.iter().any(|run| run.1) {
                    self.own.resize(self.size, RowStencil::NONE);
                }
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
