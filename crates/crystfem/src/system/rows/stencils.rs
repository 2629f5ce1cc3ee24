//! What rows are made of: distances of their columns, and values. Each distinct list of either is stored
//! once, so that equal cells that are numbered differently share values, and unequal ones that are numbered
//! alike share distances.

use crate::system::NONE;
use std::collections::HashMap;
use std::ops::Range;

/// A row: its list of distances and its list of values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Stencil {
    pub(super) pattern: u32,
    pub(super) values: u32,
}

impl Stencil {
    /// None yet.
    pub(super) const NONE: Self = Self { pattern: NONE, values: NONE };
}

/// Entries of a row, columns ascending: distances, K and, with consistent capacity, M.
#[derive(Clone, Copy)]
pub(super) struct Entries<'a> {
    pub(super) offsets: &'a [i32],
    pub(super) conduction: &'a [f64],
    pub(super) capacity: &'a [f64],
}

/// Where lists lie in flat arrays, how many rows have each, and how equal ones are found.
#[derive(Clone, Debug)]
pub(super) struct Lists {
    starts: Vec<u32>,
    rows: Vec<u32>,
    by_hash: HashMap<u64, u32>,
    /// Lists that some row has.
    pub(super) used: usize,
    /// Entries of the others.
    pub(super) dead: usize,
}

/// All lists.
#[derive(Clone, Debug, Default)]
pub(super) struct Stencils {
    pub(super) patterns: Lists,
    pub(super) values: Lists,
    offsets: Vec<i32>,
    /// The place of the diagonal in each pattern; [`NONE`] where there is none.
    diagonal: Vec<u32>,
    /// Whether the columns of each pattern come in threes, one beside the other.
    threes: Vec<bool>,
    pub(super) conduction: Vec<f64>,
    /// Empty with lumped capacity.
    pub(super) capacity: Vec<f64>,
}

impl Default for Lists {
    fn default() -> Self {
        Self { starts: vec![0], rows: Vec::new(), by_hash: HashMap::new(), used: 0, dead: 0 }
    }
}

impl Lists {
    pub(super) fn count(&self) -> usize {
        self.rows.len()
    }

    /// Entries of all lists.
    pub(super) fn entries(&self) -> usize {
        self.starts[self.count()] as usize
    }

    #[inline(always)]
    pub(super) fn range(&self, list: u32) -> Range<usize> {
        self.starts[list as usize] as usize..self.starts[list as usize + 1] as usize
    }

    /// Appends a list of so many entries that no row has yet.
    fn push(&mut self, length: usize) -> u32 {
        self.starts.push((self.entries() + length) as u32);
        self.rows.push(0);
        self.dead += length;
        (self.count() - 1) as u32
    }

    /// The list of this hash that is equal; else the place for the hash of a new one.
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

    /// Counts rows that have a list now.
    pub(super) fn hold(&mut self, list: u32, rows: u16) {
        if self.rows[list as usize] == 0 {
            self.used += 1;
            self.dead -= self.range(list).len();
        }
        self.rows[list as usize] += u32::from(rows);
    }

    /// The same of those that have it no more.
    pub(super) fn release(&mut self, list: u32, rows: u16) {
        self.rows[list as usize] -= u32::from(rows);
        if self.rows[list as usize] == 0 {
            self.used -= 1;
            self.dead += self.range(list).len();
        }
    }
}

impl Stencils {
    /// Distances of a row.
    #[inline(always)]
    pub(super) fn offsets(&self, pattern: u32) -> &[i32] {
        &self.offsets[self.patterns.range(pattern)]
    }

    /// Whether the columns of a pattern come in threes, one beside the other.
    #[inline(always)]
    pub(super) fn in_threes(&self, pattern: u32) -> bool {
        self.threes[pattern as usize]
    }

    /// The entry on the diagonal.
    pub(super) fn diagonal(&self, stencil: Stencil) -> Option<usize> {
        let at = self.diagonal[stencil.pattern as usize];
        (at != NONE).then_some(self.values.range(stencil.values).start + at as usize)
    }

    /// Bytes of all lists.
    pub(super) fn bytes(&self) -> usize {
        // start, rows, hash and name; place of the diagonal and threes
        const LIST: usize = 4 + 4 + 16;
        let values = self.conduction.len() + self.capacity.len();
        (self.patterns.count() + self.values.count()) * LIST
            + self.patterns.count() * 5
            + self.offsets.len() * size_of::<i32>()
            + values * size_of::<f64>()
    }

    pub(super) fn entries(&self, stencil: Stencil) -> Entries<'_> {
        let range = self.values.range(stencil.values);
        Entries {
            offsets: self.offsets(stencil.pattern),
            conduction: &self.conduction[range.clone()],
            capacity: self.capacity.get(range).unwrap_or_default(),
        }
    }

    /// The stencil of these entries, whose values are a row's own or shared.
    pub(super) fn find_or_add(&mut self, entries: Entries, own: bool) -> Stencil {
        Stencil { pattern: self.pattern(entries.offsets), values: self.list(entries, own) }
    }

    /// The pattern of these distances.
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

    /// The list of these values.
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
