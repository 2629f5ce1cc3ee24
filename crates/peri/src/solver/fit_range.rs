//! Range of stretches of a fitted law, and its extension to observed stretches.

use super::criterion::{Criterion, least, most};
use super::state::State;
use super::system::System;
use crate::bonds::stretch_range;
use crate::error::Error;
use crate::material::LawCover;
use crate::potential::StretchRange;

impl<const D: usize> System<'_, D> {
    /// Restores bonds, law and loads of a state: at rest, or of an interrupted run.
    ///
    /// # Errors
    /// [`Error::Geometry`] if the state belongs to another body or loads do not go with periodic sides, and
    /// errors of [`crate::potential::KernelFit::new`].
    pub fn restore(&mut self, state: &mut State<D>) -> Result<(), Error> {
        self.refuse_beside_images()?;
        state.fracture.restore(&mut *self.bonds)?;
        self.material.recall(&*self.bonds, state.memory.duration, &state.memory.values)?;
        if state.fracture.intact.is_some() {
            let particles = self.bonds.particles().to_vec();
            self.unload_detached(particles.iter().copied());
        }
        if !state.control.factors.is_empty() {
            self.factors.to_mut().clone_from(&state.control.factors);
            self.times.to_mut().clone_from(&state.control.times);
        }
        self.rebuild_contact(&state.displacement);
        state.stretches.fitted[1] = state.stretches.fitted[1].min(most(self.breaking.as_ref()));
        // a bound that depends on the displacement stays that of the previous run
        let known = Some(state.stretches.tangent).filter(|&tangent| tangent > 0.0);
        self.fit_law(state, known)
    }

    /// Refuses what does not follow images beyond periodic sides.
    fn refuse_beside_images(&self) -> Result<(), Error> {
        let loads = &self.loads;
        let refused = [
            (self.softens(), "bonds that soften"),
            (self.contact.is_some(), "contact"),
            (
                loads.curved.is_some() && loads.mean_gradient.is_some(),
                "curves of time beside a mean gradient",
            ),
            (!loads.turned.is_empty(), "rotations"),
            (!loads.rigid.is_empty(), "regions that move as a whole"),
            // their forces would do work beside the mean stress
            (self.acts_on_strained(), "particles held or loaded in a component that the mean gradient moves"),
        ];
        match refused.into_iter().find(|(given, _)| *given && !self.bonds.images().is_empty()) {
            Some((_, what)) => Err(Error::geometry(format!("periodic sides: found {what}; allowed: none"))),
            None => Ok(()),
        }
    }

    fn softens(&self) -> bool {
        self.breaking
            .as_ref()
            .is_some_and(|breaking| matches!(breaking.criterion, Criterion::Softening { .. }))
    }

    /// Returns true if a particle is held or loaded in a component whose row of the mean gradient is not 0.
    fn acts_on_strained(&self) -> bool {
        let (loads, particles) = (&self.loads, self.bonds.particles());
        let Some(rows) = &loads.mean_gradient else { return false };
        (0..D).filter(|&d| rows[d] != [0.0; D]).any(|d| {
            particles.iter().map(|&site| site as usize).any(|site| {
                let held = loads.constrained(site) >> d & 1 == 1;
                held || loads.body_force.as_ref().is_some_and(|force| force.get(site)[d] != 0.0)
            })
        })
    }

    /// Returns true if every stretch of the state, `observed` if known, lies within the fit; widens the fit
    /// otherwise.
    pub(super) fn covers_stretches(
        &mut self,
        state: &mut State<D>,
        observed: Option<StretchRange>,
    ) -> Result<bool, Error> {
        self.place_images(&mut state.displacement);
        let observed = observed.unwrap_or_else(|| stretch_range(&*self.bonds, &state.displacement));
        state.stretches.balanced = observed;
        state.stretches.observe(observed);
        Ok(!self.widen(state)?)
    }

    /// Widens the fitted range, and the tangent with it, if stretches have left it.
    pub(super) fn widen(&mut self, state: &mut State<D>) -> Result<bool, Error> {
        if !state.stretches.widen([least, most].map(|of| of(self.breaking.as_ref()))) {
            return Ok(false);
        }
        self.fit_law(state, None)?;
        Ok(true)
    }

    /// Part of a stretch range that the law itself covers; beyond it q is constant, and energies grow with e.
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

    pub(super) fn fit_law(&mut self, state: &mut State<D>, known: Option<f64>) -> Result<(), Error> {
        let (bound, clamped) = (self.fit_bound, self.breaking.is_some());
        let cover = LawCover { stretches: state.stretches.fitted, bound, clamped, known };
        state.stretches.tangent = self.material.cover(&mut *self.bonds, &state.displacement, &cover)?;
        Ok(())
    }
}
