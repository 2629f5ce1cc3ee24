//! Length of explicit steps for solids, whose stiffness depends on the displacement: it grows with every
//! stretch, under compression, and when bonds break.
//!
//! m, [`crate::material::SolverMaterial::frequency_bound`], bounds ρω² of a state at the cost of at most a
//! force. The Lanczos iteration gives ω² itself and with it the ratio r = ρω²/m; between two of them ω² is
//! estimated as r m/ρ. Steps are those of [`MARGIN`] times that. m is checked at the end of a step, before
//! its forces act: a step whose end would have required a shorter one, such as one that crushes a particle,
//! is undone and cut, so that no kick follows from it. Checks follow every step in which bonds broke or
//! strains may have changed by [`STRAIN`], and are otherwise the rarer the slower m grows; ω² is measured
//! again if m or the stretches have changed much, since r changes with the stretches. All this follows from
//! the state alone.

use super::motion::StiffnessControl;
use super::state::State;
use super::system::System;
use super::time_step::largest_frequency_squared;
use super::verlet::VelocityVerlet;
use super::verlet_step::SiteMasses;
use crate::bonds::stretch_range;

/// Factor by which ω² may grow before steps are shortened.
const MARGIN: f64 = 1.3;
/// Largest growth of the assumed ω² when a step is undone: its end says little about that of half the step.
const CUT: f64 = 4.0;
/// Factors on m, up and down, beyond which ω² is measured again.
const ABOVE: f64 = 1.5;
const BELOW: f64 = 1.6;
/// Least ratio of frequencies to the bound.
const LEAST_PART: f64 = 0.05;
/// Growth of strains, relative to themselves or to [`LEAST`], beyond which ω² is measured again.
const STRAIN_GROWTH: f64 = 0.25;
const LEAST: f64 = 0.1;
/// Largest strain that steps may add between two checks, by the increments of displacements.
const STRAIN: f64 = 0.2;
/// Most steps between two checks, and checks between two attempts at longer steps.
const MOST_INTERVAL: u32 = 8;
const LENGTHENING_INTERVAL: u32 = 32;

impl StiffnessControl {
    /// ω² by the bound and as assumed for the steps, 1/s².
    pub(super) fn squares(&self, density: f64) -> [f64; 2] {
        let covered = MARGIN * self.covered;
        [self.bound.max(self.last).max(covered) / density, covered / density]
    }

    /// Returns true if a step that has changed strains by at most `strain` must be checked.
    fn is_due(&mut self, strain: f64) -> bool {
        self.due = self.due.saturating_sub(1);
        self.strain += strain;
        self.due == 0 || self.strain > STRAIN
    }

    /// Records m: sets the time of the next check to half of the remaining margin at the previous rate of
    /// growth.
    fn record_bound(&mut self, bound: f64) {
        let (grown, steps) = (bound / self.last, f64::from(self.every));
        let left = (MARGIN * self.covered / (self.part * bound)).max(1.0).ln();
        let slow = if grown > 1.0 { 0.5 * left * steps / grown.ln() } else { f64::from(MOST_INTERVAL) };
        self.every = (slow.min(2.0 * steps) as u32).clamp(1, MOST_INTERVAL);
        (self.last, self.due, self.strain) = (bound, self.every, 0.0);
        self.looks += 1;
    }
}

impl VelocityVerlet {
    /// Returns true if steps follow a stiffness that depends on the displacement.
    pub(super) fn follows<const D: usize>(&self, system: &System<D>) -> bool {
        system.material.has_points() && self.time_step.is_none()
    }

    /// Records ω² of the present state.
    pub(super) fn measure<const D: usize>(
        &self,
        system: &mut System<D>,
        state: &mut State<D>,
        frequency: f64,
    ) {
        system.prepare(&mut state.displacement);
        let bound = system.material.frequency_bound(&*system.bonds, &state.displacement, 0.0);
        let measured = self.density * system.lightest_ratio() * frequency;
        // nothing oscillates, or the Lanczos iteration has failed: only the bound remains
        let good = measured > 0.0 && measured.is_finite() && bound > 0.0;
        let part = if good { (measured / bound).max(LEAST_PART) } else { 1.0 };
        let [low, high] = stretches(system, state);
        let known =
            [low - STRAIN_GROWTH * (1.0 - low).max(LEAST), high + STRAIN_GROWTH * (high - 1.0).max(LEAST)];
        let covered = part * bound;
        state.motion.pace = StiffnessControl {
            bound,
            part,
            covered,
            last: bound,
            every: 1,
            due: 1,
            known,
            ..StiffnessControl::default()
        };
    }

    /// Checks the prepared state at the end of a step, if that is due. Returns true if the step was too long;
    /// steps are then shorter.
    pub(super) fn is_too_long<const D: usize>(
        &self,
        system: &mut System<D>,
        state: &mut State<D>,
        strain: f64,
    ) -> bool {
        let pace = &mut state.motion.pace;
        if !pace.is_due(strain) {
            return false;
        }
        state.motion.limits.bounds += 1;
        let enough = pace.covered / pace.part;
        let bound = system.material.frequency_bound(&*system.bonds, &state.displacement, enough);
        let [low, high] = stretches(system, state);
        let pace = &mut state.motion.pace;
        pace.record_bound(bound);
        pace.outgrown |= low < pace.known[0] || high > pace.known[1];
        let needed = pace.part * bound;
        if needed <= MARGIN * pace.covered {
            return false;
        }
        pace.covered = if pace.covered > 0.0 { needed.min(CUT * pace.covered) } else { needed };
        (pace.looks, pace.due) = (0, 1);
        self.cover(system, state);
        true
    }

    /// Adapts steps to the stiffness after a step, in which bonds have `broken` or not: shorter ones if the
    /// margin is used up, longer ones if there is far more.
    pub(super) fn follow<const D: usize>(
        &self,
        system: &mut System<D>,
        state: &mut State<D>,
        masses: &SiteMasses,
        broken: bool,
    ) {
        let pace = &mut state.motion.pace;
        let waited = pace.looks >= LENGTHENING_INTERVAL;
        let known = pace.last;
        let grown = pace.part * known > pace.covered;
        if !broken && !waited && !grown && !pace.outgrown {
            return;
        }
        let enough = pace.covered / pace.part / if waited { BELOW } else { 1.0 };
        let mut bound = known;
        if broken || waited {
            state.motion.limits.bounds += 1;
            system.prepare(&mut state.displacement);
            bound = system.material.frequency_bound(&*system.bonds, &state.displacement, enough);
            state.motion.pace.record_bound(bound);
        }
        let pace = &mut state.motion.pace;
        pace.due = if broken { 1 } else { pace.due };
        let falls = waited && bound <= enough;
        pace.looks = if waited { 0 } else { pace.looks };
        if bound * pace.part <= pace.covered && !falls && !pace.outgrown {
            return;
        }
        if pace.outgrown || bound > ABOVE * pace.bound || falls && BELOW * bound <= pace.bound {
            let shortest = state.motion.limits.bonds.shortest;
            let frequency = largest_frequency_squared(system, state, masses, self.density, shortest);
            state.motion.limits.searches += 1;
            self.measure(system, state, frequency);
        } else {
            pace.covered = pace.part * bound;
        }
        self.cover(system, state);
    }
}

/// Least and greatest stretch of the intact bonds.
fn stretches<const D: usize>(system: &System<D>, state: &State<D>) -> [f64; 2] {
    let range = stretch_range(&*system.bonds, &state.displacement);
    [range.low, range.high].map(|square| (1.0 + square).max(0.0).sqrt())
}
