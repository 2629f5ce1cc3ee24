//! Time in equilibria: steps of a material with a state.

use super::state::State;
use super::system::System;
use crate::error::Error;

impl<const D: usize> System<'_, D> {
    /// Time at the end of a step, s; 0 before the first one and without times.
    pub(super) fn time_at(&self, step: Option<usize>) -> f64 {
        step.and_then(|step| self.times.get(step)).copied().unwrap_or(0.0)
    }

    /// Position of the end of a step among steps: time, or load factor without times.
    pub(super) fn place(&self, step: Option<usize>) -> f64 {
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

    /// Ends a step: histories change to those at its end.
    ///
    /// # Errors
    /// As [`Self::begin_time_step`].
    pub(super) fn end_time_step(&mut self, state: &mut State<D>) -> Result<(), Error> {
        state.memory.dissipated += self.material.advance(&*self.bonds, &state.displacement);
        state.memory.values = self.material.memory(&*self.bonds);
        self.set_duration(state, 0.0)
    }
}
