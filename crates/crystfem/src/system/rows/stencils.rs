//! Distinct rows, and how equal ones are found.

use crate::system::NONE;
use std::collections::HashMap;

/// Distinct rows, flat.
#[derive(Clone, Debug, Default)]
pub(super) struct Stencils {
    starts: Vec<u32>,
    pub(super) offsets: Vec<i32>,
    pub(super) conduction: Vec<f64>,
    /// Empty with lumped capacity.
    pub(super) capacity: Vec<f64>,
    /// The entry on the diagonal of each; [`NONE`] where there is none.
    diagonal: Vec<u32>,
}

impl Stencils {
    pub(super) fn new() -> Self {
        Self { starts: vec![0], ..Self::default() }
    }

    pub(super) fn count(&self) -> usize {
        self.starts.len() - 1
    }

    pub(super) fn range(&self, stencil: u32) -> std::ops::Range<usize> {
        self.starts[stencil as usize] as usize..self.starts[stencil as usize + 1] as usize
    }

    /// The entry on the diagonal.
    pub(super) fn diagonal(&self, stencil: u32) -> Option<usize> {
        let at = self.diagonal[stencil as usize];
        (at != NONE).then_some(at as usize)
    }

    pub(super) fn push(&mut self, entries: &[(i32, f64, f64)], consistent: bool) -> u32 {
        for &(offset, conduction, capacity) in entries {
            self.offsets.push(offset);
            self.conduction.push(conduction);
            if consistent {
                self.capacity.push(capacity);
            }
        }
        let before = self.offsets.len() - entries.len();
        let diagonal = entries.iter().position(|entry| entry.0 == 0);
        self.diagonal.push(diagonal.map_or(NONE, |at| (before + at) as u32));
        self.starts.push(self.offsets.len() as u32);
        (self.count() - 1) as u32
    }

    pub(super) fn entries(&self, stencil: u32) -> Vec<(i32, f64, f64)> {
        self.range(stencil)
            .map(|at| (self.offsets[at], self.conduction[at], self.capacity.get(at).copied().unwrap_or(0.0)))
            .collect()
    }

    pub(super) fn equals(&self, stencil: u32, entries: &[(i32, f64, f64)]) -> bool {
        let range = self.range(stencil);
        range.len() == entries.len()
            && range.zip(entries).all(|(at, entry)| {
                self.offsets[at] == entry.0
                    && self.conduction[at].to_bits() == entry.1.to_bits()
                    && (self.capacity.is_empty() || self.capacity[at].to_bits() == entry.2.to_bits())
            })
    }
}

/// Finds equal rows.
#[derive(Clone, Debug, Default)]
pub(super) struct Finder {
    by_hash: HashMap<u64, Vec<u32>>,
}

impl Finder {
    pub(super) fn find_or_add(
        &mut self,
        stencils: &mut Stencils,
        entries: &[(i32, f64, f64)],
        consistent: bool,
    ) -> u32 {
        // FNV-1a over the bits
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        for entry in entries {
            for word in [entry.0 as u64, entry.1.to_bits(), entry.2.to_bits()] {
                hash = (hash ^ word).wrapping_mul(0x0100_0000_01b3);
                hash ^= hash >> 29;
            }
        }
        let list = self.by_hash.entry(hash).or_default();
        if let Some(&found) = list.iter().find(|&&stencil| stencils.equals(stencil, entries)) {
            return found;
        }
        let added = stencils.push(entries, consistent);
        list.push(added);
        added
    }
}
