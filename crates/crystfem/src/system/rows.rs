//! The conduction matrix (and the consistent capacity matrix) row by row, each distinct row stored once.
//!
//! A row is a list of (column − row, value). On a mesh with lines of equal elements most consecutive rows are equal;
//! a run of them is one segment, y_i = Σ_k v_k x_{i+o_k}, a stencil without any indices to gather. Elsewhere this is
//! plain compressed rows. Each row is written once: no colouring and no sums between threads, so the bits do not
//! depend on them; gathering costs nothing over scattering because a stencil has 27 products where the elements
//! around a node have 64.

mod product;
mod stencils;

use super::vector::{CHUNK, items};
use product::{Both, Product};
use pulp::Arch;
use rayon::prelude::*;
use stencils::{Finder, Stencils};

/// Consecutive equal rows, within one work item.
#[derive(Clone, Copy, Debug)]
struct Segment {
    start: u32,
    length: u32,
    stencil: u32,
}

/// One row under construction.
#[derive(Debug, Default)]
pub struct Row {
    entries: Vec<(i32, f64, f64)>,
    /// Whether the row has entries that are set later, so that it cannot be shared.
    pub own: bool,
    key: Vec<u32>,
    new_key: Vec<u32>,
    repeated: bool,
}

impl Row {
    /// Begins a row by what determines it. True where that is the same as for the row before: nothing needs to be
    /// added then.
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

    /// Adds to the entry at a distance from the diagonal.
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

/// The matrices K and, with consistent capacity, M, over the nodes that exist.
#[derive(Clone, Debug)]
pub struct Rows {
    size: usize,
    consistent: bool,
    /// Runs of equal rows of each work item, as long as they can be.
    segments: Vec<Vec<Segment>>,
    stencils: Stencils,
    finder: Finder,
    /// Stencil of each row that has one of its own; empty where no row has.
    own: Vec<u32>,
    /// Entries of stencils of their own that no row has any more.
    dead: usize,
    /// Values without what is added in each evaluation.
    base: Option<[Vec<f64>; 2]>,
    /// Counts changes of the pattern, and of values.
    versions: [u64; 2],
    /// The versions in which each work item last changed.
    changed: Vec<[u64; 2]>,
}

/// The diagonal of rows, made anew where they or the factors of M and K have changed.
#[derive(Default)]
pub struct Diagonal {
    values: Vec<f64>,
    made_for: Option<([u64; 2], [u64; 2])>,
}

impl Diagonal {
    /// That of `weights[0]`·M + `weights[1]`·K.
    pub fn of(&mut self, rows: &Rows, weights: [f64; 2]) -> &[f64] {
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

/// Rows of a run on average where runs count as short.
const MOST_ALONE: usize = 4;
/// No stencil of its own.
const SHARED: u32 = u32::MAX;
/// The part of the entries that may be dead.
const MOST_DEAD: usize = 4;

/// New rows of one work item: runs with stencils of their own numbering, and whether each is a row's own.
struct Part {
    runs: Vec<(Segment, bool)>,
    stencils: Stencils,
}

impl Rows {
    /// None.
    pub fn new(consistent: bool) -> Self {
        Self {
            size: 0,
            consistent,
            segments: Vec::new(),
            stencils: Stencils::new(),
            finder: Finder::default(),
            own: Vec::new(),
            dead: 0,
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

    /// What changes with the pattern, and what changes with the values.
    pub fn versions(&self) -> [u64; 2] {
        self.versions
    }

    /// The same of the rows of one work item.
    pub fn versions_of(&self, item: usize) -> [u64; 2] {
        self.changed[item]
    }

    /// Whether most rows of a work item stand alone.
    pub fn is_unequal(&self, item: usize) -> bool {
        let rows: u32 = self.segments[item].iter().map(|segment| segment.length).sum();
        MOST_ALONE * self.segments[item].len() > rows as usize
    }

    /// Of `size` rows; `fill` begins each row and says what is in it.
    #[cfg(test)]
    pub fn build(size: usize, consistent: bool, fill: impl Fn(usize, &mut Row) + Sync) -> Self {
        let mut rows = Self::new(consistent);
        rows.update(size, &(0..size as u32).collect::<Vec<_>>(), fill);
        rows
    }

    /// Makes these rows, ascending, and empty ones up to `size`; `fill` begins each row and says what is in it. Other rows stay. What it
    /// leaves depends on the rows alone, not on how they came about, but for stencils that no row has any more.
    pub fn update(&mut self, size: usize, changed: &[u32], fill: impl Fn(usize, &mut Row) + Sync) {
        if self.dead * MOST_DEAD > self.stencils.offsets.len() {
            self.compact();
        }
        self.versions = self.versions.map(|version| version + 1);
        let groups: Vec<&[u32]> =
            changed.chunk_by(|a, b| *a as usize / CHUNK == *b as usize / CHUNK).collect();
        let parts: Vec<Part> =
            groups.par_iter().map(|changed| Part::new(changed, self.consistent, &fill)).collect();
        let before = self.size;
        self.size = size.max(before);
        self.segments.resize_with(items(self.size), Vec::new);
        self.changed.resize(self.segments.len(), self.versions);
        if !self.own.is_empty() || parts.iter().any(|part| part.runs.iter().any(|run| run.1)) {
            self.own.resize(self.size, SHARED);
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
            of.resize(end - first, SHARED);
            for segment in &self.segments[item] {
                of[segment.start as usize - first..][..segment.length as usize].fill(segment.stencil);
            }
            if let Some(part) = part {
                let mut global = vec![SHARED; part.stencils.count()];
                for (run, own) in &part.runs {
                    let name = &mut global[run.stencil as usize];
                    if *name == SHARED {
                        let entries = part.stencils.entries(run.stencil);
                        *name = match own {
                            true => self.stencils.push(&entries, self.consistent),
                            false => self.finder.find_or_add(&mut self.stencils, &entries, self.consistent),
                        };
                    }
                    of[run.start as usize - first..][..run.length as usize].fill(*name);
                    if let Some(place) = self.own.get_mut(run.start as usize)
                        && *own
                    {
                        let old = std::mem::replace(place, *name);
                        self.dead += if old == SHARED { 0 } else { self.stencils.range(old).len() };
                    }
                }
            }
            // rows out of use
            if of.contains(&SHARED) {
                let empty = self.finder.find_or_add(&mut self.stencils, &[], false);
                of.iter_mut().filter(|stencil| **stencil == SHARED).for_each(|stencil| *stencil = empty);
            }
            let runs = of.chunk_by(|a, b| a == b);
            self.segments[item].clear();
            let mut start = first as u32;
            for run in runs {
                let length = run.len() as u32;
                self.segments[item].push(Segment { start, length, stencil: run[0] });
                start += length;
            }
            self.segments[item].shrink_to_fit();
        }
    }

    /// Drops stencils that no row has.
    fn compact(&mut self) {
        let old = std::mem::replace(&mut self.stencils, Stencils::new());
        let base = self.base.take();
        self.finder = Finder::default();
        let mut names = vec![SHARED; old.count()];
        let mut kept = base.as_ref().map(|_| [Vec::new(), Vec::new()]);
        for segment in self.segments.iter_mut().flatten() {
            let name = &mut names[segment.stencil as usize];
            if *name == SHARED {
                let entries = old.entries(segment.stencil);
                let own = self.own.get(segment.start as usize).is_some_and(|&own| own != SHARED);
                *name = match own {
                    true => self.stencils.push(&entries, self.consistent),
                    false => self.finder.find_or_add(&mut self.stencils, &entries, self.consistent),
                };
                for (kept, base) in kept.iter_mut().flatten().zip(base.iter().flatten()) {
                    kept.extend_from_slice(base.get(old.range(segment.stencil)).unwrap_or_default());
                }
            }
            segment.stencil = *name;
            if let Some(own) = self.own.get_mut(segment.start as usize).filter(|own| **own != SHARED) {
                *own = *name;
            }
        }
        (self.base, self.dead) = (kept, 0);
    }

    /// Distinct rows stored, segments of equal rows, and stored entries.
    pub fn stored(&self) -> [usize; 3] {
        [self.stencils.count(), self.segments.iter().map(Vec::len).sum(), self.stencils.offsets.len()]
    }

    /// Adds to an entry of a row of its own; without effect elsewhere.
    pub fn add(&mut self, row: usize, column: usize, conduction: f64, capacity: f64) {
        let Some(&stencil) = self.own.get(row).filter(|&&stencil| stencil != SHARED) else { return };
        let range = self.stencils.range(stencil);
        let offset = column as i64 - row as i64;
        self.versions[1] += 1;
        self.changed[row / CHUNK][1] = self.versions[1];
        if let Ok(at) = self.stencils.offsets[range.clone()].binary_search_by_key(&offset, |&o| i64::from(o))
        {
            self.stencils.conduction[range.start + at] += conduction;
            if !self.stencils.capacity.is_empty() {
                self.stencils.capacity[range.start + at] += capacity;
            }
        }
    }

    /// Takes the values of rows that are new since the last call as those to which [`Self::restore`] sets them.
    pub fn keep(&mut self) {
        let base = self.base.get_or_insert_default();
        let Stencils { conduction, capacity, .. } = &self.stencils;
        for (base, values) in base.iter_mut().zip([conduction, capacity]) {
            base.extend_from_slice(&values[base.len()..]);
        }
    }

    /// Sets the values back to what they were.
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
                let start = segment.start as usize - item * CHUNK;
                let value = self.diagonal(segment, weights);
                to[start..start + segment.length as usize].iter_mut().for_each(|to| *to += value);
            }
        });
    }

    /// The largest of `of(row, K_ii)`.
    pub fn largest(&self, of: impl Fn(usize, f64) -> f64 + Sync) -> f64 {
        let item = |segments: &Vec<Segment>| {
            let mut most = f64::NEG_INFINITY;
            for segment in segments {
                let value = self.diagonal(segment, [0.0, 1.0]);
                let start = segment.start as usize;
                (start..start + segment.length as usize).for_each(|row| most = most.max(of(row, value)));
            }
            most
        };
        self.segments.par_iter().map(item).reduce(|| f64::NEG_INFINITY, f64::max)
    }

    fn diagonal(&self, segment: &Segment, weights: [f64; 2]) -> f64 {
        self.stencils.diagonal(segment.stencil).map_or(0.0, |at| self.value(at, weights))
    }

    /// Columns of a row, ascending.
    pub fn columns(&self, row: usize) -> impl Iterator<Item = usize> + '_ {
        self.row(row, [0.0; 2]).map(|(column, _)| column)
    }

    /// Entries (column, value) of a row of `capacity`·M + `conduction`·K, columns ascending.
    pub fn row(&self, row: usize, weights: [f64; 2]) -> impl Iterator<Item = (usize, f64)> + '_ {
        let segments = self.segments.get(row / CHUNK).map_or(&[][..], Vec::as_slice);
        let segment = segments.partition_point(|s| s.start as usize <= row).saturating_sub(1);
        let range = segments.get(segment).map_or(0..0, |s| self.stencils.range(s.stencil));
        range.map(move |at| {
            (row.wrapping_add_signed(self.stencils.offsets[at] as isize), self.value(at, weights))
        })
    }

    fn value(&self, at: usize, [capacity, conduction]: [f64; 2]) -> f64 {
        let own = conduction * self.stencils.conduction[at];
        match self.stencils.capacity.get(at) {
            Some(value) => own + capacity * value,
            None => own,
        }
    }

    /// y = diagonal·x + (`weights[0]`·M + `weights[1]`·K) x; returns x·y, summed in the order of the items.
    pub fn product(&self, diagonal: Option<&[f64]>, weights: [f64; 2], x: &[f64], y: &mut [f64]) -> f64 {
        self.multiply::<false>(diagonal, weights, x, y)
    }

    /// y = K x as Σ_j K_ij (x_j − x_i): rows of K add up to nothing. Its rounding is that of the differences, so that
    /// heat is conserved to rounding of what flows, not of what is stored.
    pub fn flow(&self, x: &[f64], y: &mut [f64]) {
        self.multiply::<true>(None, [0.0, 1.0], x, y);
    }

    /// [`Self::flow`] of x, and M u of the consistent capacity.
    pub fn flow_and_capacity(&self, x: &[f64], u: &[f64], flow: &mut [f64], stored: &mut [f64]) {
        flow.par_chunks_mut(CHUNK).zip(stored.par_chunks_mut(CHUNK)).enumerate().for_each(
            |(item, (flow, stored))| {
                let (segments, first) = (&self.segments[item], item * CHUNK);
                Arch::new().dispatch(Both { rows: self, segments, x, u, flow, stored, first });
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
        let part = |(item, y): (usize, &mut [f64])| self.part::<FLOW>(item, diagonal, weights, x, y);
        let parts: Vec<f64> = y.par_chunks_mut(CHUNK).enumerate().map(part).collect();
        parts.iter().sum()
    }

    /// [`Self::product`], or the flow, of the rows of one work item, `y`.
    pub fn part<const FLOW: bool>(
        &self,
        item: usize,
        diagonal: Option<&[f64]>,
        weights: [f64; 2],
        x: &[f64],
        y: &mut [f64],
    ) -> f64 {
        let (segments, first) = (&self.segments[item], item * CHUNK);
        Arch::new().dispatch(Product::<FLOW> { rows: self, segments, weights, diagonal, x, y, first })
    }
}

impl Part {
    /// Of rows of one work item, ascending.
    fn new(changed: &[u32], consistent: bool, fill: &(impl Fn(usize, &mut Row) + Sync)) -> Self {
        let mut part = Self { runs: Vec::new(), stencils: Stencils::new() };
        let (mut finder, mut row) = (Finder::default(), Row::default());
        for &index in changed {
            fill(index as usize, &mut row);
            if !row.repeated {
                row.entries.sort_unstable_by_key(|entry| entry.0);
            }
            let last = part.runs.last_mut().filter(|last| !row.own && !last.1);
            let same = last.filter(|last| row.repeated || part.stencils.equals(last.0.stencil, &row.entries));
            match same {
                Some((last, _)) if last.start + last.length == index => last.length += 1,
                Some(&mut (last, own)) => {
                    part.runs.push((Segment { start: index, length: 1, stencil: last.stencil }, own));
                }
                None => {
                    let stencil = match row.own {
                        true => part.stencils.push(&row.entries, consistent),
                        false => finder.find_or_add(&mut part.stencils, &row.entries, consistent),
                    };
                    part.runs.push((Segment { start: index, length: 1, stencil }, row.own));
                }
            }
        }
        part
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// −1, 2.5, −1 on a line of 10 000 with one different row, against the plain sum.
    #[test]
    fn a_line_has_few_stencils_and_the_right_product() {
        let size = 10_000;
        let values = |row: usize| if row == 5000 { [-2.0, 7.0, -3.0] } else { [-1.0, 2.5, -1.0] };
        let mut rows = Rows::build(size, true, |row, out| {
            out.begin(std::iter::empty());
            let v = values(row);
            for (k, offset) in [-1_i32, 0, 1].into_iter().enumerate() {
                if (0..size as i64).contains(&(row as i64 + i64::from(offset))) {
                    out.add(offset, v[k], 0.5 * v[k]);
                }
            }
            out.own = row == 77;
        });
        assert_eq!(rows.stored()[0], 5);
        rows.add(77, 78, 10.0, 20.0);
        rows.add(78, 79, 1e9, 1e9);
        let x: Vec<f64> = (0..size).map(|k| ((k * k) as f64).sin()).collect();
        let d: Vec<f64> = (0..size).map(|k| 1.0 + (k as f64).cos()).collect();
        let mut y = vec![0.0; size];
        let dot = rows.product(Some(&d), [2.0, 3.0], &x, &mut y);
        let mut exact_dot = 0.0;
        for row in 0..size {
            let v = values(row);
            let mut sum = d[row] * x[row];
            for k in 0..3 {
                if let Some(other) = (row + k).checked_sub(1).filter(|&other| other < size) {
                    sum += 4.0 * v[k] * x[other];
                }
            }
            if row == 77 {
                sum += 70.0 * x[78];
            }
            exact_dot += x[row] * sum;
            // three products of order 10
            assert!((y[row] - sum).abs() < 1e-13, "{row}");
        }
        assert!((dot - exact_dot).abs() < 1e-9);
        assert_eq!(rows.row(77, [0.0, 1.0]).collect::<Vec<_>>(), [(76, -1.0), (77, 2.5), (78, 9.0)]);
        let mut diagonal = vec![1.0; size];
        rows.add_diagonal([2.0, 3.0], &mut diagonal);
        assert_eq!(
            [diagonal[4999], diagonal[5000]],
            [1.0 + 3.0 * 2.5 + 2.0 * 1.25, 1.0 + 3.0 * 7.0 + 2.0 * 3.5]
        );
        assert_eq!(rows.largest(|row, value| if row < 100 { row as f64 } else { value }), 99.0);
    }
}
