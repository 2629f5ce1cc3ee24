//! Responses that snap back: if more bonds would break at once after a break, the load is lowered until none
//! would. The next break then controls the load, so that a crack advances event by event through equilibria.

use super::state::State;
use super::step_cuts::BY_STRETCH;
use super::system::System;

impl<const D: usize> System<'_, D> {
    /// Lowers the load if more bonds would break in the equilibrium after some broke; returns whether it did.
    /// The load becomes half a `shortest` step below that at which the largest stretch is critical, λ − 1
    /// assumed proportional to the load; `state` is then near the equilibrium there.
    pub(super) fn lower(&mut self, state: &mut State<D>, shortest: f64) -> bool {
        let at = state.step;
        let factor = self.factors[at];
        let may = self.snap_back && state.control.round > 0 && factor.abs() > shortest;
        if !(may && self.is_overstretched(state.stretches.balanced) && !self.beyond(state).is_empty()) {
            return false;
        }
        let (least, stretch) = (self.breaking_stretch().unwrap_or(1.0), state.stretches.largest());
        let margin = 0.5 * shortest / factor.abs();
        let part = (least - 1.0) / (stretch - 1.0) - margin;
        let part = if state.control.cuts < BY_STRETCH && part > 0.0 { part.min(1.0 - margin) } else { 0.5 };
        if state.control.inserted.binary_search(&at).is_ok() {
            state.control.factors[at] = part * factor;
            self.factors.to_mut()[at] = part * factor;
        } else {
            self.insert(state, &[part * factor]);
        }
        (state.control.cuts, state.counts.iteration) = (state.control.cuts + 1, 0);
        state.control.lowered = Some([factor, stretch]);
        for &site in self.bonds.particles() {
            let site = site as usize;
            state.displacement.set(site, state.displacement.get(site).map(|u| part * u));
            state.velocity.set(site, [0.0; D]);
        }
        self.begin_step(state);
        self.loads.place_turned(&*self.bonds, self.factors[at], &mut state.displacement);
        true
    }

    /// Inserts load factors before the next step after one whose load was lowered; bonds break between them.
    pub(super) fn raise(&mut self, state: &mut State<D>, shortest: f64) {
        let Some(above) = state.control.lowered.take() else { return };
        if state.step == self.factors.len() {
            return;
        }
        let below = [self.factors[state.step - 1], state.stretches.largest()];
        let new = self.around(below, above, shortest);
        self.insert(state, &new);
    }
}
