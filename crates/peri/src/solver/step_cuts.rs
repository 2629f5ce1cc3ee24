//! Bisects load steps until the load at which bonds break is known to a fraction of a step.

use super::state::State;
use super::system::System;
use crate::field::Field;

/// Number of cuts of one step, or reductions of its load, estimated from stretches; then it is halved.
pub(super) const BY_STRETCH: u32 = 3;
/// Motion of a plane beyond first contact in one step, in spacings.
const TOUCH_MOTION: f64 = 0.5;
/// Least part of a step that a surface on a curve is followed to touch, and least overlap there over the
/// largest.
const LEAST_TOUCH: f64 = 1e-6;
const NEAR_TOUCH: f64 = 0.8;
/// Fraction of the shortest step below which a remainder is no step of its own.
const LEAST_REMAINDER: f64 = 0.25;

impl<const D: usize> System<'_, D> {
    /// Shortest step: the least difference of two prescribed factors, or times, over [`Self::refine`].
    pub(super) fn shortest(&self) -> f64 {
        let steps = 0..self.factors.len();
        let steps = steps.map(|at| (self.abscissa(Some(at)) - self.abscissa(at.checked_sub(1))).abs());
        steps.filter(|&step| step > 0.0).fold(f64::INFINITY, f64::min) / self.refine.max(1) as f64
    }

    /// Cuts a step if bonds would break in its first equilibrium and it may still be cut; returns whether it
    /// did. The step then ends at factors, or times, `shortest` apart, between which stretches, assumed
    /// linear in them, become critical; `state` returns to the previous equilibrium.
    pub(super) fn cut(&mut self, state: &mut State<D>, shortest: f64) -> bool {
        let at = state.step;
        let before = self.abscissa(at.checked_sub(1));
        let length = self.abscissa(Some(at)) - before;
        let may =
            self.refine > 1 && state.control.round == 0 && length.abs() > (1.0 + LEAST_REMAINDER) * shortest;
        let stretched = self.is_overstretched(state.stretches.balanced);
        if !(may && stretched && !self.beyond(state).is_empty()) {
            return false;
        }
        let old = state.history.last().map_or(1.0, |record| record.largest_stretch);
        let new = if state.control.cuts < BY_STRETCH {
            self.around([before, old], [self.abscissa(Some(at)), state.stretches.largest()], shortest)
        } else {
            vec![before + 0.5 * length]
        };
        self.insert(state, &new);
        state.control.cuts += 1;
        let rest = || Field::zeros(state.displacement.sites());
        state.displacement = if at == 0 { rest() } else { state.control.past.pop().unwrap_or_else(rest) };
        if let Some(force) = &state.control.start_force {
            state.force.clone_from(force);
        }
        (state.control.predicted, state.counts.iteration) = (false, 0);
        true
    }

    /// Cuts a step in which a rigid surface would move by more than half a spacing beyond first contact;
    /// returns whether it did. A surface that jumps along its curve is not followed.
    pub(super) fn cut_at_touch(&mut self, state: &mut State<D>) -> bool {
        let Some(contact) = self.repulsion().filter(|_| !self.snap_back) else { return false };
        let [before, after] = contact.approach(&state.displacement);
        let most = before.max(0.0) + TOUCH_MOTION * self.bonds.spacing();
        if after.is_nan() || after <= most * (1.0 + 1e-6) {
            return false;
        }
        let start = self.abscissa(state.step.checked_sub(1));
        let is_linear = contact.surfaces().all(|surface| surface.amplitudes.is_none());
        let part =
            if is_linear { (most - before) / (after - before) } else { self.touch_on_curve(state, most) };
        if !is_linear && part < LEAST_TOUCH {
            return false;
        }
        let place = start + part * (self.abscissa(Some(state.step)) - start);
        self.insert(state, &[place]);
        true
    }

    /// Returns the part of the present step after which the deepest overlap of surfaces that follow curves
    /// is at most `most`, m, and nearly that; the surfaces end at the end of the step.
    fn touch_on_curve(&mut self, state: &State<D>, most: f64) -> f64 {
        let before = state.step.checked_sub(1).map_or(0.0, |before| self.factors[before]);
        let after = self.factors[state.step];
        let (mut low, mut high) = (0.0, 1.0);
        while high - low > LEAST_TOUCH {
            let part = 0.5 * (low + high);
            // from the start, as a surface that has not moved approaches nothing
            self.move_surfaces(before, 0.0);
            self.move_surfaces(before + part * (after - before), 0.0);
            let overlap =
                self.contact.as_ref().map_or(0.0, |contact| contact.approach(&state.displacement)[1]);
            if overlap <= most {
                low = part;
                if overlap >= NEAR_TOUCH * most {
                    break;
                }
            } else {
                high = part;
            }
        }
        self.place_surfaces_at_start(state, before);
        self.move_surfaces(after, 0.0);
        low
    }

    /// Load factors `shortest` apart between those of two equilibria, of which the second has overstretched
    /// bonds: the largest stretch, assumed linear in the load, becomes critical between them. Each
    /// equilibrium is a factor and a stretch.
    pub(super) fn around(&self, before: [f64; 2], after: [f64; 2], shortest: f64) -> Vec<f64> {
        let length = after[0] - before[0];
        let part = (self.breaking_stretch().unwrap_or(1.0) - before[1]) / (after[1] - before[1]);
        let shortest = shortest / length.abs();
        // fractions of the step; 1 is its end
        let ends = if 0.0 < part && part < 1.0 {
            let low = part - 0.5 * shortest;
            [low.min(1.0 - shortest), (low + shortest).max(shortest)]
        } else {
            [0.5, 0.5]
        };
        let apart = |end: &f64| *end > LEAST_REMAINDER * shortest && *end < 1.0 - LEAST_REMAINDER * shortest;
        let mut new: Vec<f64> = ends.into_iter().filter(apart).map(|end| before[0] + end * length).collect();
        new.dedup();
        new
    }

    /// Inserts steps that end at load factors, or times, before the end of the present step.
    pub(super) fn insert(&mut self, state: &mut State<D>, new: &[f64]) {
        let at = state.step;
        if self.times.is_empty() {
            state.control.insert(at, &self.factors, new);
        } else {
            let [start, end] = [at.checked_sub(1), Some(at)].map(|step| self.abscissa(step));
            let before = at.checked_sub(1).map_or(0.0, |before| self.factors[before]);
            let factor = |time: &f64| before + (time - start) / (end - start) * (self.factors[at] - before);
            let factors: Vec<f64> = new.iter().map(factor).collect();
            state.control.insert(at, &self.factors, &factors);
            self.times.to_mut().splice(at..at, new.iter().copied());
            state.control.times = self.times.to_vec();
        }
        self.factors.to_mut().clone_from(&state.control.factors);
    }
}
