//! Load steps that are cut where bonds would break, until the load at which they do is known to a part of a step.

use super::state::State;
use super::system::System;
use crate::field::Field;

/// Cuts of one step, or lowerings of its load, by stretches; then it is halved.
pub(super) const BY_STRETCH: u32 = 3;
/// Motion of a plane beyond first touch in one step, in spacings.
const BEYOND: f64 = 0.5;
/// Part of the shortest step that is not worth one of its own.
const CRUMB: f64 = 0.25;

impl<const D: usize> System<'_, D> {
    /// The shortest load step: the least between two prescribed factors over [`Self::refine`].
    pub(super) fn shortest(&self) -> f64 {
        let before = [0.0].into_iter().chain(self.factors.iter().copied());
        let steps = before.zip(self.factors.iter()).map(|(before, after)| (after - before).abs());
        steps.filter(|&step| step > 0.0).fold(f64::INFINITY, f64::min) / self.refine.max(1) as f64
    }

    /// Whether bonds would break in the first equilibrium of a step that may still be cut. The step then is: to factors
    /// `shortest` apart, between which stretches, taken as linear in the load, come to the critical one; and `state` is
    /// at the equilibrium before.
    pub(super) fn cut(&mut self, state: &mut State<D>, shortest: f64) -> bool {
        let at = state.step;
        let before = at.checked_sub(1).map_or(0.0, |before| self.factors[before]);
        let length = self.factors[at] - before;
        let may = self.refine > 1 && state.round == 0 && length.abs() > (1.0 + CRUMB) * shortest;
        let stretched = self.is_overstretched(state.balanced_stretches);
        if !(may && stretched && !self.beyond(state).is_empty()) {
            return false;
        }
        let old = state.history.last().map_or(1.0, |record| record.largest_stretch);
        let new = if state.cuts < BY_STRETCH {
            self.around([before, old], [self.factors[at], state.largest_stretch()], shortest)
        } else {
            vec![before + 0.5 * length]
        };
        self.insert(state, &new);
        state.cuts += 1;
        let rest = || Field::zeros(state.displacement.sites());
        state.displacement = if at == 0 { rest() } else { state.past.pop().unwrap_or_else(rest) };
        (state.predicted, state.iteration) = (false, 0);
        true
    }

    /// Whether a plane would move by more than half a spacing beyond first touch in this step, which then is cut there.
    pub(super) fn cut_at_touch(&mut self, state: &mut State<D>) -> bool {
        let Some(contact) = self.repulsion().filter(|_| !self.snap_back) else { return false };
        let [before, after] = contact.approach(&state.displacement);
        let most = before.max(0.0) + BEYOND * self.bonds.spacing();
        if after.is_nan() || after <= most * (1.0 + 1e-6) {
            return false;
        }
        let start = state.step.checked_sub(1).map_or(0.0, |before| self.factors[before]);
        let part = (most - before) / (after - before);
        let factor = start + part * (self.factors[state.step] - start);
        self.insert(state, &[factor]);
        true
    }

    /// Load factors `shortest` apart between those of two equilibria, of which the second has overstretched bonds: the largest
    /// stretch, taken as linear in the load, becomes critical between them. Each equilibrium is a factor and a stretch.
    pub(super) fn around(&self, before: [f64; 2], after: [f64; 2], shortest: f64) -> Vec<f64> {
        let length = after[0] - before[0];
        let part = (self.breaking_stretch().unwrap_or(1.0) - before[1]) / (after[1] - before[1]);
        let shortest = shortest / length.abs();
        // parts of the step; 1 is its end
        let ends = if 0.0 < part && part < 1.0 {
            let low = part - 0.5 * shortest;
            [low.min(1.0 - shortest), (low + shortest).max(shortest)]
        } else {
            [0.5, 0.5]
        };
        let apart = |end: &f64| *end > CRUMB * shortest && *end < 1.0 - CRUMB * shortest;
        let mut new: Vec<f64> = ends.into_iter().filter(apart).map(|end| before[0] + end * length).collect();
        new.dedup();
        new
    }

    /// Puts load factors before that of the present step.
    pub(super) fn insert(&mut self, state: &mut State<D>, new: &[f64]) {
        state.insert(&self.factors, new);
        self.factors.to_mut().clone_from(&state.factors);
    }
}

impl<const D: usize> State<D> {
    /// Of the last equilibrium.
    pub(super) fn largest_stretch(&self) -> f64 {
        (1.0 + self.balanced_stretches.high).sqrt()
    }

    /// As [`System::insert`].
    fn insert(&mut self, factors: &[f64], new: &[f64]) {
        let (at, count) = (self.step, new.len());
        self.factors = factors.to_vec();
        self.factors.splice(at..at, new.iter().copied());
        self.inserted.iter_mut().filter(|row| **row >= at).for_each(|row| *row += count);
        self.inserted.extend(at..at + count);
        self.inserted.sort_unstable();
    }

    /// How many prescribed steps are over after the first `rows` of the history, the last of which is one of them.
    pub fn prescribed(&self, rows: usize) -> Option<usize> {
        let last = rows.checked_sub(1)?;
        let inserted = self.inserted.partition_point(|&row| row < last);
        (self.inserted.get(inserted) != Some(&last)).then(|| rows - inserted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prescribed_steps_keep_their_numbers() {
        let mut state = State::<2>::new(0);
        state.step = 1;
        state.insert(&[0.5, 1.0], &[0.6, 0.7]);
        state.step = 2;
        let factors = state.factors.clone();
        state.insert(&factors, &[0.65]);
        assert_eq!(state.factors, [0.5, 0.6, 0.65, 0.7, 1.0]);
        let numbers: Vec<_> = (0..=5).map(|rows| state.prescribed(rows)).collect();
        assert_eq!(numbers, [None, Some(1), None, None, None, Some(2)]);
    }
}
