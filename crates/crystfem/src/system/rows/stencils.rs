//! Offsets and values of rows. Each distinct list of either is stored once, so that equal cells with
//! different numbering share values, and unequal cells with equal numbering share offsets.

use crate::system::NONE;
use std::collections::HashMap;
use std::ops::Range;

/// Stencil of a row: its list of offsets and its list of values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct RowStencil {
    pub(super) pattern: u32,
    pub(super) values: u32,
}

impl RowStencil {
    /// Marks a missing stencil.
    pub(super) const NONE: Self = Self { pattern: NONE, values: NONE };
}

/// Entries of a row, columns ascending: offsets, K and, with consistent capacity, M.
#[derive(Clone, Copy)]
pub(super) struct Entries<'a> {
    pub(super) offsets: &'a [i32],
    pub(super) conduction: &'a [f64],
    pub(super) capacity: &'a [f64],
}

/// Index of lists in flat arrays: their ranges, the number of rows of each, and a hash of their content.
#[derive(Clone, Debug)]
pub(super) struct ListIndex {
    starts: Vec<u32>,
    rows: Vec<u32>,
    by_hash: HashMap<u64, u32>,
    /// Number of lists in use.
    pub(super) used: usize,
    /// Number of entries of unused lists.
    pub(super) dead: usize,
}

/// Lists of offsets and of values.
#[derive(Clone, Debug, Default)]
pub(super) struct Stencils {
    pub(super) patterns: ListIndex,
    pub(super) values: ListIndex,
    offsets: Vec<i32>,
    /// Position of the diagonal in each pattern, or [`NONE`].
    diagonal: Vec<u32>,
    /// True for patterns whose columns are groups of three consecutive ones.
    threes: Vec<bool>,
    pub(super) conduction: Vec<f64>,
    /// M values; empty with lumped capacity.
    pub(super) capacity: Vec<f64>,
}

impl Default for ListIndex {
    fn default() -> Self {
        Self { starts: vec![0], rows: Vec::new(), by_hash: HashMap::new(), used: 0, dead: 0 }
    }
}

impl ListIndex {
    pub(super) fn count(&self) -> usize {
        self.rows.len()
    }

    /// Number of entries of all lists.
    pub(super) fn entries(&self) -> usize {
        self.starts[self.count()] as usize
    }

    #[inline(always)]
    pub(super) fn range(&self, list: u32) -> Range<usize> {
        self.starts[list as usize] as usize..self.starts[list as usize + 1] as usize
    }

    /// Appends an unused list of `length` entries.
    fn push(&mut self, length: usize) -> u32 {
        self.starts.push((self.entries() + length) as u32);
        self.rows.push(0);
        self.dead += length;
        (self.count() - 1) as u32
    }

    /// Finds an equal list by its hash, or the slot for a new one.
    fn find(
        &self,
        words: impl Iterator<Item = u64>,
        equal: impl Fn(Range<usize>) -> bool,
    ) -> Result<u32, u64> {
        // FNV-1a over the bits
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        words.for_each(|word| {
            hash = (hash ^ word).wrapping_mul(0x0100_0000_01b3);
            hash ^= hash >> 29;
        });
        while let Some(&found) = self.by_hash.get(&hash) {
            if equal(self.range(found)) {
                return Ok(found);
            }
            hash = hash.wrapping_add(1);
        }
        Err(hash)
    }

    /// Counts rows that now use a list.
    pub(super) fn add_rows(&mut self, list: u32, rows: u16) {
        if self.rows[list as usize] == 0 {
            self.used += 1;
            self.dead -= self.range(list).len();
        }
        self.rows[list as usize] += u32::from(rows);
    }

    /// Counts rows that no longer use a list.
    pub(super) fn remove_rows(&mut self, list: u32, rows: u16) {
        self.rows[list as usize] -= u32::from(rows);
        if self.rows[list as usize] == 0 {
            self.used -= 1;
            self.dead += self.range(list).len();
        }
    }
}

impl Stencils {
    /// Offsets of a row.
    #[inline(always)]
    pub(super) fn offsets(&self, pattern: u32) -> &[i32] {
        &self.offsets[self.patterns.range(pattern)]
    }

    /// Returns true if the columns of a pattern are groups of three consecutive ones.
    #[inline(always)]
    pub(super) fn in_threes(&self, pattern: u32) -> bool {
        self.threes[pattern as usize]
    }

    /// Index of the diagonal entry.
    pub(super) fn diagonal(&self, stencil: RowStencil) -> Option<usize> {
        let at = self.diagonal[stencil.pattern as usize];
        (at != NONE).then_some(self.values.range(stencil.values).start + at as usize)
    }

    /// Bytes of all lists.
    pub(super) fn bytes(&self) -> usize {
        // start, rows, hash and name; diagonal and threes
        const LIST: usize = 4 + 4 + 16;
        let values = self.conduction.len() + self.capacity.len();
        (self.patterns.count() + self.values.count()) * LIST
            + self.patterns.count() * 5
            + self.offsets.len() * size_of::<i32>()
            + values * size_of::<f64>()
    }

    pub(super) fn entries(&self, stencil: RowStencil) -> Entries<'_> {
        let range = self.values.range(stencil.values);
        Entries {
            offsets: self.offsets(stencil.pattern),
            conduction: &self.conduction[range.clone()],
            capacity: self.capacity.get(range).unwrap_or_default(),
        }
    }

    /// Finds or adds the stencil of these entries, with values shared or of the row's own.
    pub(super) fn find_or_add(&mut self, entries: Entries, own: bool) -> RowStencil {
        RowStencil { pattern: self.pattern(entries.offsets), values: self.list(entries, own) }
    }

    /// Finds or adds the pattern of these offsets.
    pub(super) fn pattern(&mut self, offsets: &[i32]) -> u32 {
        let words = offsets.iter().map(|&offset| offset as u64);
        let hash = match self.patterns.find(words, |range| self.offsets[range] == *offsets) {
            Ok(found) => return found,
            Err(hash) => hash,
        };
        self.offsets.extend_from_slice(offsets);
        let diagonal = offsets.iter().position(|&offset| offset == 0);
        self.diagonal.push(diagonal.map_or(NONE, |at| at as u32));
        let (threes, rest) = offsets.as_chunks::<3>();
        let beside = |own: &[i32; 3]| own[1] == own[0] + 1 && own[2] == own[0] + 2;
        self.threes.push(!threes.is_empty() && rest.is_empty() && threes.iter().all(beside));
        let added = self.patterns.push(offsets.len());
        self.patterns.by_hash.insert(hash, added);
        added
    }

    /// Finds or adds the list of these values.
    pub(super) fn list(&mut self, Entries { conduction, capacity, .. }: Entries, own: bool) -> u32 {
        let hash = (!own).then(|| {
            let words = conduction.iter().chain(capacity).map(|value| value.to_bits());
            self.values.find(words, |range| {
                range.len() == conduction.len()
                    && equal(&self.conduction[range.clone()], conduction)
                    && equal(self.capacity.get(range).unwrap_or_default(), capacity)
            })
        });
        if let Some(Ok(found)) = hash {
            return found;
        }
        self.conduction.extend_from_slice(conduction);
        self.capacity.extend_from_slice(capacity);
        let added = self.values.push(conduction.len());
        if let Some(Err(hash)) = hash {
            self.values.by_hash.insert(hash, added);
        }
        added
    }
}

fn equal(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}
