//! Breaking of compressed bonds across interfaces that slide.

use super::criterion::Criterion;
use super::state::State;
use super::system::System;
use crate::bonds::Overstretched;
use std::collections::HashSet;

impl<const D: usize> System<'_, D> {
    /// Lists the bonds across sliding interfaces that are compressed as much as breaks them in tension, λ <
    /// 1/λ_c, and one end of which has lost a bond across; each from both ends. Where two parts slide, one
    /// half of the bonds is stretched and the other compressed alike, so that mode II takes the energy of
    /// mode I; where they are only pressed together, no bond across is lost.
    pub(super) fn slid(&self, state: &State<D>) -> Vec<Overstretched> {
        let Some(Criterion::Stretch(critical)) = self.breaking.as_ref().map(|b| &b.criterion) else {
            return Vec::new();
        };
        let is_intact = |&&[a, b]: &&[u32; 2]| self.bonds.is_bonded(a as usize, b as usize);
        let square = |[a, b]: [u32; 2]| {
            let (here, there) = (self.bonds.position(a as usize), self.bonds.position(b as usize));
            let (from, to) = (state.displacement.get(a as usize), state.displacement.get(b as usize));
            let [mut now, mut rest] = [0.0; 2];
            for d in 0..D {
                now += (there[d] - here[d] + to[d] - from[d]).powi(2);
                rest += (there[d] - here[d]).powi(2);
            }
            now / rest
        };
        let is_compressed =
            |&&[a, b]: &&[u32; 2]| square([a, b]) * critical.weaker(a as usize, b as usize).powi(2) < 1.0;
        let compressed: Vec<&[u32; 2]> =
            self.sliding.iter().filter(is_compressed).filter(is_intact).collect();
        if compressed.is_empty() {
            return Vec::new();
        }
        let lost: HashSet<u32> =
            self.sliding.iter().filter(|bond| !is_intact(bond)).flatten().copied().collect();
        let mut found = Vec::new();
        for &&[a, b] in compressed.iter().filter(|ends| ends.iter().any(|site| lost.contains(site))) {
            let elongation = square([a, b]) - 1.0;
            for [site, other] in [[a, b], [b, a]] {
                self.bonds.neighbours(site as usize, &mut |bond| {
                    if bond.site == other as usize {
                        let (index, length, weight) = (bond.index, bond.length, bond.weight);
                        found.push(Overstretched { site, index, elongation, length, weight });
                    }
                });
            }
        }
        found.sort_unstable_by_key(|bond| (bond.site, bond.index));
        found
    }
}
