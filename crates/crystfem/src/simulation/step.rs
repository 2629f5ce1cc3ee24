//! An accepted step: its length, attempts and result.

use super::{LinearMethod, LinearSolver, PointStates, Simulation, State};
use crate::error::Error;
use crate::ledger::StepBalance;
use crate::solver::LEVELS;
use crate::system::StepInput;
use crate::system::vector::{set, sum};
use crate::time::{Attempt, Scheme, Stepper, Steps, Work};

/// Safety factor on the step length of error control.
const SAFETY: f64 = 0.9;
/// Largest growth of the step length.
const MAX_GROWTH: f64 = 4.0;
/// Iterations of a solve below which no other method is cheaper.
const MIN_COSTLY_ITERATIONS: f64 = 16.0;
/// Expected number of solves with the matrix of equal steps.
const EQUAL_STEP_SOLVES: f64 = 20.0;

impl Simulation {
    /// Makes one accepted step.
    pub(super) fn step(
        &mut self,
        until: f64,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<StepBalance, Error> {
        let time = self.state.time;
        let next = self.breaks[self.breaks.partition_point(|&t| t <= time)..].first().copied();
        let target = next.map_or(until, |next| next.min(until));
        let jump = self.state.jump;
        let scheme = if jump { Scheme::BackwardEuler } else { self.settings.scheme };
        let adaptive = match self.settings.steps {
            Steps::Adaptive { tolerance, smallest, largest, .. } => Some((tolerance, smallest, largest)),
            Steps::Fixed { .. } => None,
        };
        if self.state.rate.is_empty() && (adaptive.is_some() || scheme == Scheme::TrBdf2) {
            let (rate, exchange) = self.stepper.rate(&self.problem, &mut self.system, &self.state.start())?;
            (self.state.rate, self.state.exchange) = (rate, exchange);
        }
        if jump {
            (self.state.method, self.state.excess) = (self.choose(until).method, 0.0);
        }
        let mut wanted = match self.settings.steps {
            Steps::Fixed { dt } => dt,
            Steps::Adaptive { largest, .. } => self.state.next_dt.min(largest),
        };
        let before = self.state.work;
        // step lengths from a ladder, so that factors serve many steps
        if let (LinearMethod::Factors, Steps::Adaptive { first, .. }, true) =
            (self.state.method, self.settings.steps, self.system.is_linear())
        {
            wanted = first * (wanted / first * (1.0 + 1e-9)).log2().floor().exp2();
        }
        loop {
            let left = target - time;
            let lands = wanted >= left * (1.0 - 1e-9);
            let end = if lands {
                target
            } else if adaptive.is_some() && wanted > 0.5 * left {
                time + 0.5 * left
            } else {
                time + wanted
            };
            // equal steps have the same length to the last bit, and so the same matrix
            let equal = (end - time - wanted).abs() <= 1e-9 * wanted;
            let dt = if equal { wanted } else { end - time };
            if end <= time {
                let allowed = format!("steps that change the time {time} s");
                return Err(Error::Parameter { name: "time step", found: wanted, allowed });
            }
            // factors serve many steps; a single step of another length does without them
            let single = adaptive.is_none() && (!equal || scheme != self.settings.scheme);
            let single = single && self.settings.solver != LinearSolver::Direct;
            self.stepper.stages.method = match self.state.method {
                LinearMethod::Factors if single => LinearMethod::Diagonal,
                method => method,
            };
            let accuracy = adaptive.map(|(tolerance, ..)| 0.05 * tolerance);
            let mut work = self.state.work;
            let attempt = self.stepper.attempt(
                &self.problem,
                &mut self.system,
                &self.state.start(),
                scheme,
                [dt, end],
                self.settings.tolerance,
                accuracy,
                stop,
                &mut work,
            );
            self.state.work = work;
            let attempt = attempt.and_then(|mut attempt| {
                let ratio = self.follow(dt)?;
                attempt.step_ratio = ratio.into_iter().chain(attempt.step_ratio).reduce(f64::min);
                Ok(attempt)
            });
            if let Err(Error::Stopped { .. }) = attempt {
                return Err(Error::Stopped { time });
            }
            let Some((tolerance, smallest, largest)) = adaptive else {
                let record = self.accept([dt, end], &attempt?);
                self.reconsider(&before, until);
                return Ok(record);
            };
            // the length as requested: rounding at large times may lengthen the actual one
            let shortest = wanted.min(dt) <= smallest * (1.0 + 1e-9);
            // a ratio below this repeats the step instead of shortening the next one
            const MIN_ACCEPTED_RATIO: f64 = 0.5;
            let factor = match &attempt {
                Ok(attempt) => {
                    let ratio = attempt.step_ratio.unwrap_or(f64::INFINITY);
                    let error = attempt.error.unwrap_or(0.0) / tolerance;
                    let grow = (SAFETY * error.powf(-1.0 / f64::from(attempt.order))).clamp(0.1, MAX_GROWTH);
                    if (error <= 1.0 && ratio >= MIN_ACCEPTED_RATIO) || shortest {
                        // a step shortened to end at a given time says little about the next one
                        let grown = (dt * grow).max(if lands { wanted } else { 0.0 });
                        self.state.next_dt = grown.min(dt * ratio).clamp(smallest, largest);
                        let record = self.accept([dt, end], attempt);
                        self.reconsider(&before, until);
                        return Ok(record);
                    }
                    grow.min(ratio.max(0.1)).min(0.9)
                }
                Err(_) => 0.25,
            };
            if shortest {
                return Ok(self.accept([dt, end], &attempt?));
            }
            self.state.work.rejected += 1;
            wanted = (dt * factor).max(smallest);
        }
    }

    /// Chooses the method again once steps with more than [`MIN_COSTLY_ITERATIONS`] iterations a solve have
    /// taken [`LEVELS`] in total, the cost of preparing another method. Work is counted, not timed, so that a
    /// resumed run decides alike.
    fn reconsider(&mut self, before: &Work, until: f64) {
        let work = &self.state.work;
        let solves = (work.cg_solves - before.cg_solves) as f64;
        let iterations = (work.cg_iterations - before.cg_iterations) as f64;
        let candidate = self.state.method == LinearMethod::Diagonal && self.system.is_symmetric();
        if self.settings.solver != LinearSolver::Auto
            || !candidate
            || iterations <= MIN_COSTLY_ITERATIONS * solves
        {
            return;
        }
        self.state.excess += iterations;
        if self.state.excess < LEVELS {
            return;
        }
        // both stages of a step, and the filter of its error
        let one = match (self.system.is_linear(), self.settings.scheme, self.settings.steps) {
            (false, ..) => 1.0,
            (_, _, Steps::Fixed { .. }) => EQUAL_STEP_SOLVES,
            (_, Scheme::BackwardEuler, _) => 2.0,
            (_, Scheme::TrBdf2, _) => 3.0,
        };
        self.state.method = self.task(until).method_after(iterations / solves, one);
        self.state.excess = 0.0;
    }

    /// Advances the states of materials whose energy does not depend on them, at the end of an attempt.
    fn follow(&mut self, dt: f64) -> Result<Option<f64>, Error> {
        let in_place = self.in_place();
        let State { temperature: start, memory, work, time, .. } = &mut self.state;
        let Stepper { temperature, stages, .. } = &mut self.stepper;
        let at = StepInput { temperature, start, dt, time: *time, tangent: false };
        let nodal = &self.system.nodal;
        let new = &mut stages.evaluation.memory.nodal;
        let points = if in_place {
            *new = PointStates::default();
            &mut memory.nodal
        } else {
            nodal.keep_followers(&memory.nodal, new);
            new
        };
        let (ratio, count) = nodal.follow(&self.problem, &at, &mut points.state)?;
        work.responses += count;
        Ok(ratio)
    }

    /// Returns true if points at nodes store one state instead of an old and a new one: fixed steps are never
    /// rejected, and nothing but the state itself depends on it.
    fn in_place(&self) -> bool {
        matches!(self.settings.steps, Steps::Fixed { .. }) && !self.system.nodal.coupled
    }

    /// Makes the end of the attempt the new state.
    fn accept(&mut self, [dt, end]: [f64; 2], attempt: &Attempt) -> StepBalance {
        let in_place = self.in_place();
        // fixed steps of backward Euler never use the previous rate
        let rated = self.settings.scheme != Scheme::BackwardEuler
            || matches!(self.settings.steps, Steps::Adaptive { .. });
        let Self { problem, state, stepper, system, .. } = self;
        let size = system.size();
        let Stepper { temperature, stages, .. } = stepper;
        let residual = &stages.residual;
        let change = &stages.evaluation.change;
        let record = StepBalance {
            time: end,
            dt,
            stored: sum(size, |k| change[k]),
            moved: sum(size, |k| change[k].abs()),
            sensitivity: stages.sensitivity(),
            exchange: attempt.exchange,
            reaction: system.fixed.iter().map(|&(equation, _)| residual[equation as usize]).sum(),
            held: system.fixed.iter().map(|&(equation, _)| residual[equation as usize].abs()).sum(),
            error: attempt.error,
            step_ratio: attempt.step_ratio,
        };
        // a due birth makes the next step one after a jump, which starts from the current temperatures
        if problem.births.get(state.births).is_some_and(|birth| birth.time <= end) {
            state.slope.clear();
        } else {
            state.slope.resize(size, 0.0);
            set(&mut state.slope, |k| (temperature[k] - state.temperature[k]) / dt);
        }
        std::mem::swap(&mut state.temperature, temperature);
        if rated {
            std::mem::swap(&mut state.rate, &mut stages.evaluation.rate);
        }
        state.exchange = stages.evaluation.exchange;
        let new = &mut stages.evaluation.memory;
        std::mem::swap(&mut state.memory.general, &mut new.general);
        if !in_place {
            std::mem::swap(&mut state.memory.nodal, &mut new.nodal);
        }
        state.time = end;
        state.jump = false;
        state.work.steps += 1;
        state.ledger.add(&record);
        record
    }
}
