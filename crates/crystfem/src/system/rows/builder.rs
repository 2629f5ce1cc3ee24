//! A row under construction.

use super::stencils::Entries;

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
    /// True if the row equals the one before.
    pub(super) repeated: bool,
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
    pub(super) fn sorted(&mut self, consistent: bool) -> Entries<'_> {
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
