//! Bonds that bear a part of what they bore.

use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A bond, seen from one of its ends, of an integrity between 0 and 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Softened {
    /// Site of the particle.
    pub site: u32,
    /// Its number among the particle's bonds, see [`super::Neighbour::index`].
    pub index: u32,
    /// κ: the greatest energy that its breaking would have released, over its share of the family, J/m³.
    pub greatest: f64,
    /// d: the part of the bond's volume that acts.
    pub integrity: f64,
}

/// The softened bonds of a body, each from both of its ends, by site and index. All others are intact or
/// severed: they are few.
#[derive(Clone, Debug, Default)]
pub struct Softening {
    bonds: Vec<Softened>,
    revision: u64,
}

impl Softening {
    /// All of them.
    pub fn bonds(&self) -> &[Softened] {
        &self.bonds
    }

    /// Puts others in their place, in any order.
    pub fn replace(&mut self, mut bonds: Vec<Softened>) {
        bonds.sort_unstable_by_key(|bond| (bond.site, bond.index));
        self.bonds = bonds;
        self.revision += 1;
    }

    /// Grows with every [`Self::replace`].
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Those of some sites.
    pub fn among(&self, sites: Range<usize>) -> &[Softened] {
        among(&self.bonds, sites)
    }
}

/// Those of some sites, of a list by site.
pub fn among(bonds: &[Softened], sites: Range<usize>) -> &[Softened] {
    if bonds.is_empty() {
        return bonds;
    }
    let place = |site: usize| bonds.partition_point(|bond| (bond.site as usize) < site);
    &bonds[place(sites.start)..place(sites.end)]
}

/// d of a bond of a particle with the softened bonds `own`.
pub(super) fn integrity(own: &[Softened], index: u32) -> f64 {
    own.iter().find(|bond| bond.index == index).map_or(1.0, |bond| bond.integrity)
}
