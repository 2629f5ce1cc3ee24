//! How long explicit steps may be where the stiffness is that of a displacement, of solids: it grows with every stretch, where a body is
//! crushed, and where bonds break.
//!
//! m, [`crate::material::Response::frequency_bound`], bounds ρω² of the present state at the cost of a force or less. The Lanczos iteration
//! gives ω² itself and with it the part r = ρω²/m that frequencies reach; between two of them ω² is taken as r m/ρ. Steps are those of
//! [`MARGIN`] times that, and are shortened where r m has grown by the margin. m is looked at after every step in which bonds break, and
//! otherwise the more seldom the slower it grows; ω² is measured again where m has grown or fallen by [`APART`]. All that follows from
//! the state alone.

use super::state::State;
use super::system::System;
use super::time_step::largest_frequency_squared;
use super::verlet::VelocityVerlet;
use serde::{Deserialize, Serialize};

/// Factor on ω² by which it may grow until steps are shortened …
const MARGIN: f64 = 1.3;
/// … of which this is kept for what grows between two looks.
const KEPT: f64 = 1.05;
/// Factor on m, up or down, after which ω² is measured again.
const APART: f64 = 1.6;
/// Least part of the bound that frequencies are taken to reach: another place may reach more than the one that was measured.
const LEAST_PART: f64 = 0.1;
/// Strain that a step may add at most, by the increments of displacements, between two looks.
const STRAIN: f64 = 0.2;
/// Most steps between two looks, and looks between two at whether steps may be longer.
const SELDOM: u32 = 8;
const WAITS: u32 = 16;

/// What is known of the greatest frequency.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pace {
    /// m and ρω² when it was last measured, N/m⁴, and r.
    bound: f64,
    measured: f64,
    part: f64,
    /// ρω² that steps are made for, without the margin.
    covered: f64,
    /// m at the last look, steps between it and the next, and steps until then; looks since steps were planned.
    last: f64,
    every: u32,
    due: u32,
    looks: u32,
    /// Strain since the last look, at most.
    strain: f64,
}

impl Pace {
    /// ω² by the bound and as it is allowed for, 1/s².
    pub(super) fn squares(&self, density: f64) -> [f64; 2] {
        let covered = MARGIN * self.covered;
        [self.bound.max(self.last).max(covered) / density, covered / density]
    }
}

impl VelocityVerlet {
    /// Takes note of ω² of the present state.
    pub(super) fn measure<const D: usize>(
        &self,
        system: &mut System<D>,
        state: &mut State<D>,
        frequency: f64,
    ) {
        system.prepare(&state.displacement);
        let bound = system.material.frequency_bound(&*system.bonds, &state.displacement, 0.0);
        let measured = self.density * frequency;
        // nothing oscillates, or the Lanczos iteration has failed: the bound alone
        let good = measured > 0.0 && measured.is_finite() && bound > 0.0;
        let part = if good { (measured / bound).max(LEAST_PART) } else { 1.0 };
        let covered = if good { measured } else { bound };
        state.motion.pace =
            Pace { bound, measured, part, covered, last: bound, every: 1, due: 1, looks: 0, strain: 0.0 };
    }

    /// Sees to it that steps are short enough after one, in which bonds have `broken` or not and strains have changed by `strain` at most.
    pub(super) fn follow<const D: usize>(
        &self,
        system: &mut System<D>,
        state: &mut State<D>,
        volumes: &[f64],
        broken: bool,
        strain: f64,
    ) {
        if !system.material.has_points() || self.time_step.is_some() {
            return;
        }
        let pace = &mut state.motion.pace;
        pace.due = pace.due.saturating_sub(1);
        pace.strain += strain;
        if pace.due > 0 && !broken && pace.strain <= STRAIN {
            return;
        }
        pace.strain = 0.0;
        pace.looks += 1;
        state.motion.bounds += 1;
        let pace = &mut state.motion.pace;
        let waited = pace.looks >= WAITS && pace.covered > 0.0;
        // up to here nothing changes
        let enough = pace.covered / pace.part / if waited { APART } else { 1.0 };
        if broken {
            system.prepare(&state.displacement);
        }
        let bound = system.material.frequency_bound(&*system.bonds, &state.displacement, enough);
        let pace = &mut state.motion.pace;
        let needed = bound * pace.part;
        let (grown, steps) = (bound / pace.last, f64::from(pace.every));
        pace.last = bound;
        let left = (MARGIN * pace.covered / needed / KEPT).max(1.0).ln();
        // half of what is left at the pace of before
        let slow = if grown > 1.0 { 0.5 * left * steps / grown.ln() } else { f64::from(SELDOM) };
        pace.every = (slow.min(2.0 * steps) as u32).clamp(1, SELDOM);
        pace.due = if broken { 1 } else { pace.every };
        if std::env::var_os("PERI_PACE").is_some() {
            eprintln!("t {:.5e} dt {:.3e} m {:.3e} needed {:.3e} covered {:.3e} part {:.3} every {} broken {broken} waited {waited} enough {enough:.3e} range {:?}", state.motion.time, state.motion.time_step, bound, needed, state.motion.pace.covered, state.motion.pace.part, state.motion.pace.every, state.motion.looked);
        }
        let pace = &mut state.motion.pace;
        let falls = waited && bound <= enough;
        if KEPT * needed <= MARGIN * pace.covered && !falls {
            pace.looks = if waited { 0 } else { pace.looks };
            return;
        }
        let apart = bound > APART * pace.bound || falls;
        if apart {
            let shortest = state.motion.shortest;
            let frequency = largest_frequency_squared(system, state, volumes, self.density, shortest);
            state.motion.searches += 1;
            self.measure(system, state, frequency);
        } else {
            (pace.covered, pace.looks) = (needed, 0);
        }
        self.cover(system, state);
    }
}
