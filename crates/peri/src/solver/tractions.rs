//! Tractions of rigid surfaces in a state.

use super::state::State;
use crate::bonds::BodyGeometry;
use crate::contact::{ContactPair, RigidSurfaces, SurfaceTraction};

impl<const D: usize> State<D> {
    /// Returns the tractions of rigid surfaces, given beside the undeformed body, at the end of the last row
    /// of the history, or at an equilibrium within a step of a run with the load factors `factors`.
    pub fn tractions(
        &self,
        surfaces: &RigidSurfaces<D>,
        bonds: &dyn BodyGeometry<D>,
        factors: &[f64],
    ) -> Vec<SurfaceTraction<D>> {
        let (own, moved) = (&self.contact, &self.displacement);
        let mut surfaces = surfaces.clone();
        surfaces.place_surfaces(bonds, self.history.last().map_or(&[], |row| &row.resting));
        if self.control.round == 0 {
            let drags = own.grips.iter().map(|grip| (grip.pair, grip.slip.map(|x| -grip.stiffness * x)));
            return surfaces.tractions(bonds, moved, drags);
        }
        let factors = if self.control.factors.is_empty() { factors } else { &self.control.factors };
        let at = |step: usize| factors.get(step).copied().unwrap_or(1.0);
        // as a step begins
        surfaces.move_to(self.step.checked_sub(1).map_or(0.0, at), 0.0);
        let start = own.start.as_ref().unwrap_or(moved);
        surfaces.balance(start);
        surfaces.move_to(at(self.step), 0.0);
        surfaces.balance(moved);
        let drag = |pair: ContactPair| surfaces.slipped(pair, moved, start);
        let drags: Vec<(ContactPair, [f64; 3])> =
            own.active.iter().map(|grip| (grip.pair, grip.drag(drag(grip.pair)).force)).collect();
        surfaces.tractions(bonds, moved, drags.into_iter())
    }
}
