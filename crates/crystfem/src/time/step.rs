//! Attempted steps of the schemes.

use super::{Scheme, StageEquation, Stages, Work};
use crate::error::Error;
use crate::problem::Problem;
use crate::system::vector::set;
use crate::system::{Evaluation, Exchange, PointMemory, StepInput, ThermalSystem};

/// γ of TR-BDF2, 2 − √2.
const GAMMA: f64 = 2.0 - std::f64::consts::SQRT_2;
/// Weight w = √2/4 of the first two rates.
const W: f64 = 0.25 * std::f64::consts::SQRT_2;
/// Weight d = γ/2 of the last rate.
const D: f64 = 0.5 * GAMMA;

/// State at the start of a step.
#[derive(Clone, Copy)]
pub struct StepStart<'a> {
    /// Time, s.
    pub time: f64,
    /// Temperatures, K.
    pub temperature: &'a [f64],
    /// Rates of change over the last step, K/s; empty after a jump.
    pub slope: &'a [f64],
    /// Q, W; empty if unknown.
    pub rate: &'a [f64],
    /// Heat supplied, W.
    pub exchange: &'a Exchange,
    /// Material points.
    pub memory: &'a PointMemory,
}

/// Result of a step.
#[derive(Clone, Copy, Debug)]
pub struct Attempt {
    /// Largest temporal error of a node, K; `None` if not requested.
    pub error: Option<f64>,
    /// Order of the error estimate in Δt.
    pub order: i32,
    /// Smallest ratio of next to present step requested by a material.
    pub step_ratio: Option<f64>,
    /// Heat supplied over the step, J.
    pub exchange: Exchange,
}

/// Stepper; after an attempt, `temperature` and `stages` hold its end.
#[derive(Default)]
pub struct Stepper {
    /// Last stage.
    pub stages: Stages,
    /// Temperatures at the end, K.
    pub temperature: Vec<f64>,
    middle: Vec<f64>,
    known: Vec<f64>,
}

impl Stepper {
    /// Invalidates everything made for another system, but keeps the memory.
    pub fn reset(&mut self) {
        self.stages.reset();
    }

    /// Computes Q at the start, if a step needs it and it is unknown after a jump.
    ///
    /// # Errors
    /// Errors of the materials.
    pub fn rate(
        &mut self,
        problem: &Problem,
        system: &mut ThermalSystem,
        state: &StepStart,
    ) -> Result<(Vec<f64>, Exchange), Error> {
        let mut evaluation = Evaluation::default();
        let temperature = state.temperature;
        let at = StepInput { temperature, start: temperature, dt: 0.0, time: state.time, tangent: false };
        system.evaluate(problem, &at, state.memory, &mut evaluation)?;
        Ok((evaluation.rate, evaluation.exchange))
    }

    /// Attempts a step of length `dt` that ends at `end`; the temporal error is estimated to a fraction of
    /// `accuracy`, if given.
    ///
    /// # Errors
    /// Errors of the stages.
    #[allow(clippy::too_many_arguments)]
    pub fn attempt(
        &mut self,
        problem: &Problem,
        system: &mut ThermalSystem,
        state: &StepStart,
        scheme: Scheme,
        [dt, end]: [f64; 2],
        tolerance: f64,
        accuracy: Option<f64>,
        stop: &(dyn Fn() -> bool + Sync),
        work: &mut Work,
    ) -> Result<Attempt, Error> {
        let size = system.size();
        let StepStart { temperature: start, slope, memory: old, .. } = *state;
        self.temperature.resize(size, 0.0);
        let ahead = |time: f64, guess: &mut [f64]| match slope.is_empty() {
            true => guess.copy_from_slice(start),
            false => set(guess, |k| start[k] + time * slope[k]),
        };
        let stage = StageEquation { weight: dt, dt, time: end, known: &[], start, old, stop };
        let mut exchange = Exchange::default();
        if scheme == Scheme::BackwardEuler {
            ahead(dt, &mut self.temperature);
            self.stages.solve(problem, system, &stage, &mut self.temperature, tolerance, work)?;
            exchange.add(dt, &self.stages.evaluation.exchange);
            let step_ratio = self.stages.evaluation.step_ratio;
            let error = accuracy.map(|accuracy| {
                let (before, after) = (state.rate, std::mem::take(&mut self.stages.evaluation.rate));
                let difference = |k: usize| 0.5 * dt * (after[k] - before[k]);
                let error = self.stages.filter(problem, system, dt, difference, accuracy, work);
                self.stages.evaluation.rate = after;
                error
            });
            return Ok(Attempt { error, order: 2, step_ratio, exchange });
        }
        let weight = D * dt;
        self.known.resize(size, 0.0);
        set(&mut self.known, |k| weight * state.rate[k]);
        let middle = StageEquation {
            weight,
            dt: GAMMA * dt,
            time: state.time + GAMMA * dt,
            known: &self.known,
            ..stage
        };
        ahead(GAMMA * dt, &mut self.temperature);
        self.stages.solve(problem, system, &middle, &mut self.temperature, tolerance, work)?;
        self.middle.clone_from(&self.stages.evaluation.rate);
        exchange.add(W * dt, state.exchange);
        exchange.add(W * dt, &self.stages.evaluation.exchange);
        set(&mut self.known, |k| W * dt * (state.rate[k] + self.middle[k]));
        for (guess, start) in self.temperature.iter_mut().zip(start) {
            *guess = start + (*guess - start) / GAMMA;
        }
        let last = StageEquation { weight, known: &self.known, ..stage };
        self.stages.solve(problem, system, &last, &mut self.temperature, tolerance, work)?;
        exchange.add(D * dt, &self.stages.evaluation.exchange);
        let step_ratio = self.stages.evaluation.step_ratio;
        let error = accuracy.map(|accuracy| {
            // weights of the embedded formula of order 3: (1 − w)/3, (3w + 1)/3, d/3
            let after = std::mem::take(&mut self.stages.evaluation.rate);
            let (before, middle) = (state.rate, &self.middle);
            let difference = |k: usize| {
                let first = (W - (1.0 - W) / 3.0) * before[k];
                dt * (first - middle[k] / 3.0 + (D - D / 3.0) * after[k])
            };
            let error = self.stages.filter(problem, system, weight, difference, accuracy, work);
            self.stages.evaluation.rate = after;
            error
        });
        Ok(Attempt { error, order: 3, step_ratio, exchange })
    }
}
