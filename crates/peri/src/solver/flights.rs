//! Flight of rigid surfaces with a mass, in steps of velocity Verlet.

use super::state::State;
use super::system::System;
use crate::contact::Flight;

impl<const D: usize> System<'_, D> {
    /// Starts surfaces with a mass at their velocities, with the contact of the start; without any does
    /// nothing.
    pub(super) fn begin_flights(&mut self, state: &mut State<D>, factor: f64) {
        let surfaces = || self.contact.iter().flat_map(|contact| contact.surfaces());
        state.contact.flights.clear();
        if surfaces().any(|surface| surface.inertia.is_some()) {
            let velocity =
                |velocity: [f64; D]| std::array::from_fn(|d| velocity.get(d).copied().unwrap_or(0.0));
            let begin = |velocity| Flight { velocity, ..Flight::default() };
            state.contact.flights = surfaces().map(|surface| begin(velocity(surface.velocity))).collect();
            self.kick_flights(state, factor, 0.0);
        }
    }

    /// Moves surfaces with a mass by a step, s, from their motion `before`.
    pub(super) fn leap_flights(&mut self, state: &mut State<D>, before: &[Flight], step: f64) {
        state.contact.flights.clear();
        state.contact.flights.extend(before.iter().map(|flight| flight.drift_on(step)));
        self.place_flights(state);
    }

    /// Tells the contact where surfaces with a mass are.
    pub(super) fn place_flights(&mut self, state: &State<D>) {
        self.contact.iter_mut().for_each(|contact| contact.fly(&state.contact.flights));
    }

    /// Completes a step, s, of surfaces with a mass by the forces of their contact and friction at its end.
    pub(super) fn kick_flights(&self, state: &mut State<D>, factor: f64, step: f64) {
        let Some(contact) = self.contact.as_ref().filter(|_| !state.contact.flights.is_empty()) else {
            return;
        };
        let rubs = state.contact.surface_friction.iter().copied().chain(std::iter::repeat([0.0; 3]));
        let pushing: Vec<[f64; 3]> = (state.contact.surface_push.iter().zip(rubs))
            .map(|(push, rub)| std::array::from_fn(|d| push[d] + rub[d]))
            .collect();
        for (flight, acceleration) in
            state.contact.flights.iter_mut().zip(contact.accelerations(&pushing, factor))
        {
            *flight = flight.kick(step, acceleration);
        }
    }
}
