//! Tractions of rigid surfaces, and of particles on each other, in a state.

use super::state::State;
use crate::bonds::BodyGeometry;
use crate::contact::{Contact, ContactPair, SurfaceTraction};

impl<const D: usize> State<D> {
    /// Returns the tractions of a contact, given beside the undeformed body, at the end of the last row of
    /// the history, or at an equilibrium within a step of a run with the load factors `factors`.
    pub fn tractions(
        &self,
        contact: &Contact<D>,
        bonds: &dyn BodyGeometry<D>,
        factors: &[f64],
    ) -> Vec<SurfaceTraction<D>> {
        let (own, moved) = (&self.contact, &self.displacement);
        let mut contact = contact.clone();
        contact.prepare_tractions(bonds, moved, self.history.last().map_or(&[], |row| &row.resting));
        let drags: Vec<(ContactPair, [f64; 3])> = if self.control.round == 0 {
            own.grips.iter().map(|grip| (grip.pair, grip.slip.map(|x| -grip.stiffness * x))).collect()
        } else {
            let factors = if self.control.factors.is_empty() { factors } else { &self.control.factors };
            let at = |step: usize| factors.get(step).copied().unwrap_or(1.0);
            // as a step begins
            contact.move_surfaces(self.step.checked_sub(1).map_or(0.0, at), 0.0);
            let start = own.start.as_ref().unwrap_or(moved);
            contact.balance(start, Some(&own.grips));
            contact.move_surfaces(at(self.step), 0.0);
            contact.begin_friction(start, own.active.clone());
            contact.balance(moved, None);
            let drag = |pair: ContactPair| contact.slipped(pair, moved);
            own.active.iter().map(|grip| (grip.pair, grip.drag(drag(grip.pair)).force)).collect()
        };
        contact.tractions(bonds, moved, &drags)
    }
}
