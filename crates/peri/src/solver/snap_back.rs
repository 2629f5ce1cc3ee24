//! Responses that snap back: where bonds break and others would follow at once, the load is lowered until none would. The next
//! break then controls the load, so that a crack advances event by event through equilibria.

use super::state::State;
use super::system::System;

/// Lowerings of one step by stretches; then the load is halved.
const BY_STRETCH: u32 = 3;

impl<const D: usize> System<'_, D> {
    /// Whether bonds would break in an equilibrium that others have left by breaking. The load of the step then is lowered to
    /// half a `shortest` step below where the largest stretch, less one taken as proportional to the load, is critical; and
    /// `state` is near the equilibrium there.
    pub(super) fn lower(&mut self, state: &mut State<D>, shortest: f64) -> bool {
        let at = state.step;
        let factor = self.factors[at];
        let may = self.snap_back && state.round > 0 && factor.abs() > shortest;
        if !(may && self.is_overstretched(state.balanced_stretches) && !self.beyond(state).is_empty()) {
            return false;
        }
        let (least, stretch) = (self.breaking_stretch().unwrap_or(1.0), state.largest_stretch());
        let margin = 0.5 * shortest / factor.abs();
        let part = (least - 1.0) / (stretch - 1.0) - margin;
        let part = if state.cuts < BY_STRETCH && part > 0.0 { part.min(1.0 - margin) } else { 0.5 };
        if state.inserted.binary_search(&at).is_ok() {
            state.factors[at] = part * factor;
        } else {
            state.insert(&self.factors, &[part * factor]);
        }
        self.factors.to_mut().clone_from(&state.factors);
        state.cuts += 1;
        state.lowered = Some([factor, stretch]);
        for &site in self.bonds.particles() {
            let site = site as usize;
            state.displacement.set(site, state.displacement.get(site).map(|u| part * u));
            state.velocity.set(site, [0.0; D]);
        }
        self.lag(state);
        true
    }

    /// After a step whose load was lowered: puts factors before that of the next one, between which bonds break.
    pub(super) fn raise(&mut self, state: &mut State<D>, shortest: f64) {
        let Some(above) = state.lowered.take() else { return };
        if state.step == self.factors.len() {
            return;
        }
        let below = [self.factors[state.step - 1], state.largest_stretch()];
        let new = self.around(below, above, shortest);
        state.insert(&self.factors, &new);
        self.factors.to_mut().clone_from(&state.factors);
    }
}
