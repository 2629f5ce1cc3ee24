//! Bonds that break.

use super::criterion::{Criterion, Policy, most};
use super::state::{Event, State};
use super::system::System;
use crate::bonds::{fingerprint, overstretched};
use crate::potential::StretchRange;

impl<const D: usize> System<'_, D> {
    /// Severs all bonds beyond what they bear; the sites of their ends.
    pub fn break_bonds(&mut self, state: &mut State<D>) -> Vec<u32> {
        let Some(breaking) = &self.breaking else { return Vec::new() };
        let list = match &breaking.criterion {
            Criterion::Stretch(stretch) => overstretched(&*self.bonds, &state.displacement, stretch),
            Criterion::Energy(limit) => {
                let loads = &self.loads;
                let free = |site: usize| loads.constrained(site) == 0;
                self.material.overloaded(&*self.bonds, &state.displacement, *limit, &free)
            }
        };
        self.count_evaluation(state);
        if list.is_empty() {
            return Vec::new();
        }
        let released = self.material.released(&*self.bonds, &list, most(self.breaking.as_ref()));
        // what does not follow bond by bond is what the whole body loses
        let before = released.is_none().then(|| self.stored_energy(state, state.observed));
        let bonds = list.len() as u64 / 2;
        state.broken += bonds;
        let [factor, pull, push] = state.balanced;
        let load = self.loads.response(&*self.bonds, factor, (pull, push)).0;
        state.events.push(Event { step: state.step, bonds, fingerprint: fingerprint(&list), load });
        self.bonds.sever(&list);
        state.released +=
            released.unwrap_or_else(|| before.unwrap_or(0.0) - self.stored_energy(state, state.observed));
        self.rebuild_contact(&state.displacement);
        state.intact = Some(self.bonds.intact());
        let mut sites: Vec<u32> = list.iter().map(|bond| bond.site).collect();
        sites.dedup();
        state.detached += self.release(sites.iter().copied());
        sites
    }

    /// Takes the body forces off particles without bonds, which nothing could balance; their number.
    pub(super) fn release(&mut self, sites: impl Iterator<Item = u32>) -> u64 {
        let mut count = 0;
        for site in sites {
            if self.bonds.is_alone(site as usize) {
                count += 1;
                if self.loads.body_force.as_ref().is_some_and(|b| b.get(site as usize) != [0.0; D]) {
                    self.loads.to_mut().unload(site as usize);
                }
            }
        }
        count
    }

    /// Whether bonds break on the way to equilibrium.
    pub(super) fn breaks_on_the_way(&self) -> bool {
        self.breaking.as_ref().is_some_and(|b| b.policy == Policy::EachIteration)
    }

    /// Whether stretches reach the critical one.
    pub(super) fn is_overstretched(&self, observed: StretchRange) -> bool {
        let least = self.breaking.as_ref().map(|b| b.criterion.least_stretch());
        least.is_some_and(|least| observed.high > least * least - 1.0)
    }
}
