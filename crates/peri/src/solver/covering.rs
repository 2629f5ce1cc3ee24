//! The stretches that a law is evaluated over, and how they follow those that are observed.

use super::criterion::{least, most};
use super::state::State;
use super::system::System;
use crate::bonds::stretch_range;
use crate::error::Error;
use crate::material::Cover;
use crate::potential::StretchRange;

impl<const D: usize> System<'_, D> {
    /// Brings bonds, law and loads to where a state is: at rest, or where an interrupted run was.
    ///
    /// # Errors
    /// [`Error::Geometry`] where the state belongs to another body, or as [`crate::potential::KernelFit::new`].
    pub fn restore(&mut self, state: &mut State<D>) -> Result<(), Error> {
        if let Some(words) = &state.intact {
            if !self.bonds.restore(words) {
                let found = format!("a state of {} words of bonds, which is another body's", words.len());
                return Err(Error::geometry(found));
            }
            let particles = self.bonds.particles().to_vec();
            self.release(particles.iter().copied());
        }
        if !state.softened.is_empty() {
            self.bonds.soften(state.softened.clone());
        }
        if !state.factors.is_empty() {
            self.factors.to_mut().clone_from(&state.factors);
        }
        self.rebuild_contact(&state.displacement);
        state.fitted[1] = state.fitted[1].min(most(self.breaking.as_ref()));
        // a bound that depends on the displacement stays that of the run before
        let known = Some(state.tangent).filter(|&tangent| tangent > 0.0);
        self.fit(state, known)
    }

    /// Whether every stretch of the state, `observed` if that is known, lies within the fit; widens it otherwise.
    pub(super) fn covers_stretches(
        &mut self,
        state: &mut State<D>,
        observed: Option<StretchRange>,
    ) -> Result<bool, Error> {
        let observed = observed.unwrap_or_else(|| stretch_range(&*self.bonds, &state.displacement));
        state.balanced_stretches = observed;
        state.observed = state.observed.join(observed);
        Ok(!self.widen(state)?)
    }

    /// Widens the fitted range where stretches have left it, and the tangent with it.
    pub(super) fn widen(&mut self, state: &mut State<D>) -> Result<bool, Error> {
        // bonds crushed below that are extrapolated: no fit covers l → 0
        let low = (1.0 + state.observed.low).max(0.0).sqrt().max(least(self.breaking.as_ref()));
        let high = (1.0 + state.observed.high).sqrt().min(most(self.breaking.as_ref()));
        if low >= state.fitted[0] && high <= state.fitted[1] {
            return Ok(false);
        }
        // twice the strain observed, so that a growing load does not refit at every look
        state.fitted[0] =
            state.fitted[0].min((1.0 - 2.0 * (1.0 - low)).max(0.5 * low)).max(least(self.breaking.as_ref()));
        state.fitted[1] = state.fitted[1].max(1.0 + 2.0 * (high - 1.0)).min(most(self.breaking.as_ref()));
        self.fit(state, None)?;
        Ok(true)
    }

    /// The part of stretches that the law itself covers; beyond it q is constant, and energies grow with e.
    pub fn fitted_part(&self, observed: StretchRange) -> StretchRange {
        if self.breaking.is_none() {
            return observed;
        }
        let (least, most) = (least(self.breaking.as_ref()), most(self.breaking.as_ref()));
        StretchRange {
            low: observed.low.max(least * least - 1.0),
            high: observed.high.min(most * most - 1.0),
        }
    }

    pub(super) fn fit(&mut self, state: &mut State<D>, known: Option<f64>) -> Result<(), Error> {
        let (bound, clamped) = (self.fit_bound, self.breaking.is_some());
        let cover = Cover { stretches: state.fitted, bound, clamped, known };
        state.tangent = self.material.cover(&mut *self.bonds, &state.displacement, &cover)?;
        Ok(())
    }
}
