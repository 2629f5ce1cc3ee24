//! Breaking and softening of bonds.

use super::criterion::{Bilinear, Criterion, Policy, most};
use super::fracture::BreakingEvent;
use super::state::State;
use super::system::System;
use crate::bonds::{Neighbour, Overstretched, Softened, add_counterparts, counterpart, fingerprint};
use crate::contact::Contact;
use crate::field::Field;
use crate::material::EnergyPart;
use crate::potential::StretchRange;

/// Softening that an equilibrium may lag behind: its bonds carry up to this fraction of an intact bond's
/// force too much.
const SOFTENING_LAG: f64 = 0.01;

/// Applies softening to bonds beyond the onset, each given with the energy that its breaking would release:
/// returns those that break, and all softened bonds; `None` if no integrity falls by more than `lag`. `law`
/// is that of a bond.
fn soften(
    law: impl Fn(&Overstretched) -> Bilinear,
    soft: &[Softened],
    found: Vec<(Overstretched, f64)>,
    lag: f64,
) -> Option<(Vec<Overstretched>, Vec<Softened>)> {
    let (mut after, mut list, mut fall) = (soft.to_vec(), Vec::new(), 0.0_f64);
    for (bond, energy) in found {
        let known = soft.binary_search_by_key(&(bond.site, bond.index), |b| (b.site, b.index)).ok();
        let before = known.map_or(1.0, |at| soft[at].integrity);
        if known.is_some_and(|at| energy <= soft[at].greatest) {
            continue;
        }
        let integrity = law(&bond).integrity(energy);
        fall = fall.max(before - integrity);
        if integrity <= 0.0 {
            list.push(bond);
        }
        let bond = Softened { site: bond.site, index: bond.index, greatest: energy, integrity };
        match known {
            Some(at) => after[at] = bond,
            None => after.push(bond),
        }
    }
    after.retain(|bond| bond.integrity > 0.0);
    (fall > lag).then_some((list, after))
}

impl<const D: usize> System<'_, D> {
    /// Lists bonds beyond their limit, for a criterion without softening.
    pub(super) fn beyond(&mut self, state: &State<D>) -> Vec<Overstretched> {
        let mut list = match self.breaking.as_ref().map(|breaking| &breaking.criterion) {
            Some(Criterion::Stretch(stretch)) => {
                let seen = std::mem::take(&mut self.seen_stretches);
                let mut list = self.material.overstretched(&*self.bonds, &state.displacement, stretch, &seen);
                let slid = self.slid(state);
                if !slid.is_empty() {
                    list.extend(slid);
                    list.sort_unstable_by_key(|bond| (bond.site, bond.index));
                }
                list
            }
            Some(Criterion::Energy(limit)) => {
                let bound = self.loads.bound();
                let free = |site: usize| bound.get(self.bonds.origin(site)).is_none_or(|bits| *bits == 0);
                let found = self.material.overloaded(&*self.bonds, &state.displacement, limit, &free);
                found.into_iter().map(|(bond, _)| bond).collect()
            }
            _ => Vec::new(),
        };
        add_counterparts(&*self.bonds, &mut list);
        list
    }

    /// Severs all bonds beyond their limit, and softens those beyond the onset; returns the sites of their
    /// ends.
    pub fn break_bonds(&mut self, state: &mut State<D>) -> Vec<u32> {
        let mut softened = None;
        let list = match self.breaking.as_ref().map(|breaking| &breaking.criterion) {
            Some(Criterion::Softening { onset, limit }) => {
                let bound = self.loads.bound();
                let free = |site: usize| bound.get(self.bonds.origin(site)).is_none_or(|bits| *bits == 0);
                let bonds = &*self.bonds;
                let found = self.material.overloaded(bonds, &state.displacement, onset, &free);
                let law = |bond: &Overstretched| {
                    let site = bond.site as usize;
                    let other = bonds.bond(site, bond.index).site;
                    Bilinear { onset: onset.weaker(site, other), limit: limit.weaker(site, other) }
                };
                // in dynamics forces follow at once
                let lag = if state.motion.begun { 0.0 } else { SOFTENING_LAG };
                let changed = soften(law, &state.fracture.softened, found, lag);
                changed.map_or_else(Vec::new, |(list, after)| {
                    softened = Some(after);
                    list
                })
            }
            _ => self.beyond(state),
        };
        self.sever_bonds(state, list, softened)
    }

    /// Severs bonds, and softens those on the way there; the sites of their ends.
    pub(super) fn sever_bonds(
        &mut self,
        state: &mut State<D>,
        mut list: Vec<Overstretched>,
        softened: Option<Vec<Softened>>,
    ) -> Vec<u32> {
        if list.is_empty() && softened.is_none() {
            return Vec::new();
        }
        let released = self.material.released(&*self.bonds, &list, most(self.breaking.as_ref()));
        // energies that do not follow bond by bond are the loss of the whole body
        let before = released.is_none().then(|| self.energies_at_break(state));
        let touches = self.contact.as_ref().is_some_and(Contact::repels);
        let pair =
            |bond: &Overstretched| [bond.site, self.bonds.bond(bond.site as usize, bond.index).site as u32];
        let mut parted: Vec<[u32; 2]> = if touches { list.iter().map(pair).collect() } else { Vec::new() };
        if !list.is_empty() {
            self.bonds.break_bonds(&list);
        }
        if state.motion.begun && released.is_none() && !list.is_empty() {
            let more = self.crumble(state, &mut list);
            parted.extend(more.into_iter().filter(|_| touches));
        }
        let bonds = list.len() as u64 / 2;
        state.fracture.broken += bonds;
        let [factor, pull, push] = state.control.balanced;
        let load = self.response(state, factor, (pull, push)).0;
        if bonds > 0 {
            state.fracture.events.push(BreakingEvent {
                step: state.stage.rows + state.step,
                bonds,
                fingerprint: fingerprint(&list),
                load,
            });
        }
        let mut sites: Vec<u32> = list.iter().map(|bond| bond.site).collect();
        if let Some(mut softened) = softened {
            softened.sort_unstable_by_key(|bond| (bond.site, bond.index));
            sites.extend(softened.iter().map(|bond| bond.site));
            sites.sort_unstable();
            self.bonds.soften(softened.clone());
            state.fracture.softened = softened;
        }
        match before {
            Some([driving, stored]) => {
                let after = self.energies_at_break(state);
                state.fracture.released += driving - after[0];
                state.memory.dissipated += (stored - after[1]) - (driving - after[0]);
            }
            None => state.fracture.released += released.unwrap_or(0.0),
        }
        if let Some(contact) = self.contact.as_mut().filter(|_| touches) {
            contact.add_broken_pairs(&*self.bonds, &parted);
        }
        if bonds > 0 {
            let words = state.fracture.intact.get_or_insert_with(|| self.bonds.intact());
            for bond in &list {
                let (word, bit) = self.bonds.bit(bond.site as usize, bond.index);
                words[word] &= !bit;
            }
        }
        sites.dedup();
        state.fracture.detached += self.unload_detached(sites.iter().copied());
        sites
    }

    /// Energy that drives breaking, and all stored energy, J: equal without a state.
    fn energies_at_break(&mut self, state: &State<D>) -> [f64; 2] {
        let mut of = |part| self.material.energy_of(&*self.bonds, &state.displacement, part);
        match (of(EnergyPart::Driving), of(EnergyPart::Stored)) {
            (Some(driving), Some(stored)) => [driving, stored],
            _ => [self.stored_energy(state, state.stretches.observed); 2],
        }
    }

    /// Severs the bonds of particles that the bonds left after `list` crush, and adds them to it: otherwise
    /// energies too steep for any step would appear. Returns both ends of each.
    fn crumble(&mut self, state: &State<D>, list: &mut Vec<Overstretched>) -> Vec<[u32; 2]> {
        let mut pairs = Vec::new();
        let mut ends: Vec<u32> = list.iter().map(|bond| bond.site).collect();
        while !ends.is_empty() {
            ends.sort_unstable();
            ends.dedup();
            let crushed = self.material.crushed(&*self.bonds, &state.displacement, &ends);
            let mut more = Vec::new();
            for &site in &crushed {
                self.bonds.neighbours(site as usize, &mut |bond| more.push((site, bond)));
            }
            let of = |site: u32, bond: &Neighbour<D>| Overstretched {
                site,
                index: bond.index,
                elongation: 0.0,
                length: bond.length,
                weight: bond.weight,
            };
            let mut found: Vec<Overstretched> = more.iter().map(|(site, bond)| of(*site, bond)).collect();
            let back = |(site, bond): &(u32, Neighbour<D>)| counterpart(&*self.bonds, *site as usize, bond);
            found.extend(more.iter().filter_map(back).map(|(site, bond)| of(site as u32, &bond)));
            found.sort_unstable_by_key(|bond| (bond.site, bond.index));
            found.dedup_by_key(|bond| (bond.site, bond.index));
            for bond in &found {
                pairs.push([bond.site, self.bonds.bond(bond.site as usize, bond.index).site as u32]);
            }
            self.bonds.break_bonds(&found);
            ends = found.iter().map(|bond| bond.site).collect();
            list.append(&mut found);
        }
        list.sort_unstable_by_key(|bond| (bond.site, bond.index));
        pairs
    }

    /// Removes the body forces from particles without bonds, which nothing could balance; returns their
    /// number.
    pub(super) fn unload_detached(&mut self, sites: impl Iterator<Item = u32>) -> u64 {
        let mut count = 0;
        for site in sites {
            if self.bonds.is_alone(site as usize) {
                count += 1;
                // a force that follows a curve may vanish now and return
                let bears = |force: &Field<D>| force.get(site as usize) != [0.0; D];
                if self.loads.curved.is_some() || self.loads.body_force.as_ref().is_some_and(bears) {
                    self.loads.to_mut().unload(site as usize);
                }
            }
        }
        count
    }

    /// Returns true if bonds break on the way to equilibrium.
    pub(super) fn breaks_on_the_way(&self) -> bool {
        self.breaking.as_ref().is_some_and(|b| b.policy == Policy::EachIteration)
    }

    /// Returns true if stretches reach the critical one.
    pub(super) fn is_overstretched(&self, observed: StretchRange) -> bool {
        self.breaking_stretch().is_some_and(|least| observed.high > least * least - 1.0)
    }

    /// Returns true if bonds may break in a state with these stretches.
    pub(super) fn may_break(&self, observed: StretchRange) -> bool {
        self.is_overstretched(observed) || !self.sliding.is_empty()
    }

    /// Stretch below which no bond breaks; `None` if bonds do not break.
    pub(super) fn breaking_stretch(&self) -> Option<f64> {
        let breaking = self.breaking.as_ref()?;
        Some(self.material.least_rest() * breaking.criterion.least_stretch())
    }
}
