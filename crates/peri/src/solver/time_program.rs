//! Time in equilibria: steps of a material with a state.

use super::state::State;
use super::system::System;
use crate::error::Error;
use crate::material::EnergyPart;

impl<const D: usize> System<'_, D> {
    /// Time at the end of a step, s; 0 before the first one and without times.
    pub(super) fn time_at(&self, step: Option<usize>) -> f64 {
        step.and_then(|step| self.times.get(step)).copied().unwrap_or(0.0)
    }

    /// Position of the end of a step among steps: time, or load factor without times.
    pub(super) fn abscissa(&self, step: Option<usize>) -> f64 {
        let places = if self.times.is_empty() { &self.factors } else { &self.times };
        step.and_then(|step| places.get(step)).copied().unwrap_or(0.0)
    }

    /// Begins a step of this duration, s: sets the stabilisation and the duration of the law's step.
    ///
    /// # Errors
    /// [`Error::Geometry`] for the histories of another body.
    pub(super) fn begin_time_step(&mut self, state: &mut State<D>, duration: f64) -> Result<(), Error> {
        if self.times.is_empty() {
            return Ok(());
        }
        self.material.recall(&*self.bonds, 0.0, &[])?;
        let lost = self.material.stabilise(&*self.bonds, &state.displacement, duration);
        state.memory.dissipated += lost;
        state.memory.values = self.material.memory(&*self.bonds);
        self.set_duration(state, duration)
    }

    /// Sets the duration of the law's step, s.
    ///
    /// # Errors
    /// As [`Self::begin_time_step`].
    pub(super) fn set_duration(&mut self, state: &mut State<D>, duration: f64) -> Result<(), Error> {
        state.memory.duration = duration;
        self.material.recall(&*self.bonds, duration, &[])
    }

    /// Books the energy dissipated in the step so far, in its first equilibrium. What the jump to another one
    /// after bonds broke dissipates is no flow of this step: work less all other energies has it.
    pub(super) fn book_flow(&mut self, state: &mut State<D>) {
        if self.times.is_empty() || state.control.round > 0 {
            return;
        }
        let mut of = |part| self.material.energy_of(&*self.bonds, &state.displacement, part);
        if let (Some(trial), Some(stored)) = (of(EnergyPart::Trial), of(EnergyPart::Stored)) {
            state.memory.dissipated += trial - stored;
        }
    }

    /// Ends a step: histories change to those at its end; returns the energy dissipated in it, J.
    ///
    /// # Errors
    /// As [`Self::begin_time_step`].
    pub(super) fn end_time_step(&mut self, state: &mut State<D>) -> Result<f64, Error> {
        let dissipated = self.material.advance(&*self.bonds, &state.displacement);
        state.memory.values = self.material.memory(&*self.bonds);
        self.set_duration(state, 0.0)?;
        Ok(dissipated)
    }
}
