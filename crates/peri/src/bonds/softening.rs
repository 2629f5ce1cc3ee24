//! Damaged bonds, of an integrity between 0 and 1.

use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A damaged bond, seen from one of its ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Softened {
    /// Site of the particle.
    pub site: u32,
    /// Number among the particle's bonds, see [`super::Neighbour::index`].
    pub index: u32,
    /// κ: greatest energy that its breaking would have released, over its share of the family, J/m³.
    pub greatest: f64,
    /// d: fraction of the bond's volume that acts.
    pub integrity: f64,
}

/// The damaged bonds of a body, each from both ends, by site and index. All others are intact or severed.
#[derive(Clone, Debug, Default)]
pub struct SoftenedBonds {
    bonds: Vec<Softened>,
    revision: u64,
}

impl SoftenedBonds {
    /// All damaged bonds.
    pub fn bonds(&self) -> &[Softened] {
        &self.bonds
    }

    /// Replaces all damaged bonds; any order.
    pub fn replace(&mut self, mut bonds: Vec<Softened>) {
        bonds.sort_unstable_by_key(|bond| (bond.site, bond.index));
        self.bonds = bonds;
        self.revision += 1;
    }

    /// Counter that grows with every [`Self::replace`].
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Damaged bonds of a range of sites.
    pub fn among(&self, sites: Range<usize>) -> &[Softened] {
        among(&self.bonds, sites)
    }
}

/// Selects the damaged bonds of a range of sites from a list sorted by site.
pub fn among(bonds: &[Softened], sites: Range<usize>) -> &[Softened] {
    if bonds.is_empty() {
        return bonds;
    }
    let place = |site: usize| bonds.partition_point(|bond| (bond.site as usize) < site);
    &bonds[place(sites.start)..place(sites.end)]
}

/// Integrity d of a bond of a particle with the damaged bonds `own`.
pub(super) fn integrity(own: &[Softened], index: u32) -> f64 {
    own.iter().find(|bond| bond.index == index).map_or(1.0, |bond| bond.integrity)
}
