//! Stages: solve E(T) − E(start) + a Q(T) + known = 0 at the free nodes.

mod correction;

use super::Work;
use super::matrix::{Matrix, key};
use crate::error::Error;
use crate::ledger::REFERENCE_SHIFT;
use crate::problem::Problem;
use crate::solver::{
    Cached, Direct, Iterative, LinearMethod, Multigrid, Operator, PackedRows, StoppingCriterion, norm_squared,
};
use crate::system::vector::{dot, largest, set, sum};
use crate::system::{Evaluation, PointMemory, StepInput, ThermalSystem};

/// Limit on Newton iterations.
const MAX_ITERATIONS: usize = 60;
/// Fraction of the error that the linear solve of a Newton iteration leaves to the next one.
const FORCING: f64 = 1e-3;
/// Fraction of the tolerance that no linear solve of a Newton iteration needs to go below.
const LINEAR: f64 = 0.3;
/// Limit on halvings of a Newton step.
const MAX_HALVINGS: usize = 7;
/// Limit on consecutive full Newton steps at a jump of k while the residual does not fall.
const MAX_FULL_STEPS: usize = 8;
/// Limit on balance corrections of a linear stage.
const MAX_SHIFTS: usize = 3;
/// Largest sum of all residuals over the heat moved; the energy audit promises 1e-10.
const BALANCE_TOLERANCE: f64 = 2e-11;

/// Equation of a stage.
#[derive(Clone, Copy)]
pub struct StageEquation<'a> {
    /// Factor of Q, s.
    pub weight: f64,
    /// Length of the increment, s.
    pub dt: f64,
    /// Time at the end, s.
    pub time: f64,
    /// Heat of earlier stages, J; empty for none.
    pub known: &'a [f64],
    /// Temperatures at the start, K.
    pub start: &'a [f64],
    /// Points at the start.
    pub old: &'a PointMemory,
    /// Requests a stop.
    pub stop: &'a (dyn Fn() -> bool + Sync),
}

/// Solver of stages, with cached matrices.
#[derive(Default)]
pub struct Stages {
    /// E, Q and tangents at the last temperature.
    pub evaluation: Evaluation,
    /// E − E(start) + a Q + known at the last temperature, J, prescribed nodes included; also used as work
    /// vector by corrections.
    pub residual: Vec<f64>,
    /// Requested method; factors and levels are made when first needed.
    pub method: LinearMethod,
    matrix: Cached<Matrix>,
    /// Factors of the matrix, with their analysis for the present build.
    factors: Cached<Option<Direct>>,
    iterative: Iterative,
    packed: PackedRows,
    /// Right-hand side of a filter; image of a correction by factors.
    right: Vec<f64>,
    correction: Vec<f64>,
    trial: Vec<f64>,
}

impl Stages {
    /// Invalidates everything made for another system, but keeps the memory.
    pub fn reset(&mut self) {
        (self.factors, self.iterative.multigrid) = Default::default();
        self.matrix.forget();
        self.matrix.value.reset();
    }

    /// 1·A·1 over the free nodes, J/K.
    pub fn sensitivity(&self) -> f64 {
        self.matrix.value.sensitivity
    }

    /// Computes the matrix of the last evaluation, unless a linear system has it already.
    fn prepare(&mut self, system: &ThermalSystem, weight: f64) {
        let key = key(system, weight);
        if !(self.matrix.matches(key) && system.is_linear()) {
            self.matrix.value.compute(system, &self.evaluation, weight);
            self.matrix.set_key(key);
        }
    }

    /// Solves a stage; `temperature` is the initial guess and becomes the solution, at which `evaluation` and
    /// `residual` are valid.
    ///
    /// # Errors
    /// [`Error::NotConverged`], [`Error::NotFinite`].
    pub fn solve(
        &mut self,
        problem: &Problem,
        system: &mut ThermalSystem,
        stage: &StageEquation,
        temperature: &mut Vec<f64>,
        tolerance: f64,
        work: &mut Work,
    ) -> Result<(), Error> {
        system.prescribe(problem, stage.time, temperature);
        self.evaluate(problem, system, stage, temperature, work)?;
        if system.is_linear() {
            self.prepare(system, stage.weight);
            self.correct(problem, system, stage, [tolerance; 2], temperature, work)?;
            for (t, correction) in temperature.iter_mut().zip(&self.correction) {
                *t += correction;
            }
            self.evaluate(problem, system, stage, temperature, work)?;
            // for very long steps the residual of the linear solve and the true one differ by rounding
            for _ in 0..MAX_SHIFTS {
                if self.balanced(system, stage.weight) {
                    break;
                }
                let shift = -sum(system.size(), |k| system.free[k] * self.residual[k]) / self.sensitivity();
                for (t, free) in temperature.iter_mut().zip(&system.free) {
                    *t += shift * free;
                }
                self.evaluate(problem, system, stage, temperature, work)?;
            }
            return self.finite(problem, system, stage, temperature);
        }
        let mut error = f64::INFINITY;
        let mut best = (f64::INFINITY, 0);
        for iteration in 0..MAX_ITERATIONS {
            self.prepare(system, stage.weight);
            let square = norm_squared(&self.residual, &self.matrix.value.inverse);
            error = (square / self.matrix.value.capacity).sqrt();
            if (error <= tolerance || square <= self.matrix.value.floor)
                && (iteration > 0 || error == 0.0)
                && self.balanced(system, stage.weight)
            {
                return self.finite(problem, system, stage, temperature);
            }
            work.newton_iterations += 1;
            let goal = (FORCING * error).max(LINEAR * tolerance);
            self.correct(problem, system, stage, [goal, tolerance], temperature, work)?;
            // line search along the correction, in the norm of this iterate's matrix
            let inverse = std::mem::take(&mut self.matrix.value.inverse);
            let mut part = 1.0;
            let mut trial = std::mem::take(&mut self.trial);
            trial.resize(temperature.len(), 0.0);
            // across a kink of a convex or concave balance full steps recover by themselves, from one side;
            // shorter ones creep towards the kink
            if square < best.0 {
                best = (square, iteration);
            }
            let whole = !system.is_symmetric() && iteration - best.1 < MAX_FULL_STEPS;
            let mut reached = f64::INFINITY;
            for halving in 0..=MAX_HALVINGS {
                let correction = &self.correction;
                set(&mut trial, |k| temperature[k] + part * correction[k]);
                let evaluated = self.evaluate(problem, system, stage, &trial, work);
                reached = norm_squared(&self.residual, &inverse);
                let better = reached <= (1.0 - 0.1 * part) * square || reached <= self.matrix.value.floor;
                let better = better || (whole && reached.is_finite());
                if evaluated.is_ok() && (better || (halving == MAX_HALVINGS && reached.is_finite())) {
                    break;
                }
                if halving == MAX_HALVINGS {
                    evaluated?;
                    return Err(not_finite(problem, system, stage, &trial));
                }
                part *= 0.5;
            }
            std::mem::swap(temperature, &mut trial);
            (self.trial, self.matrix.value.inverse) = (trial, inverse);
            self.matrix.forget();
            // where only surfaces change the matrix, and hardly, its norm at the last iterate serves this one
            error = (reached / self.matrix.value.capacity).sqrt();
            let converged = error <= tolerance || reached <= self.matrix.value.floor;
            if system.is_linear_inside() && converged && self.balanced(system, stage.weight) {
                return self.finite(problem, system, stage, temperature);
            }
        }
        Err(Error::NotConverged {
            method: "Newton's iteration",
            time: stage.time,
            iterations: MAX_ITERATIONS,
            error,
            wanted: tolerance,
        })
    }

    /// Filters the error estimate: solves A e = right coarsely with the matrix of the last stage. Returns the
    /// largest |e|, K.
    pub fn filter(
        &mut self,
        problem: &Problem,
        system: &ThermalSystem,
        weight: f64,
        right: impl Fn(usize) -> f64 + Sync,
        tolerance: f64,
        work: &mut Work,
    ) -> f64 {
        self.prepare(system, weight);
        self.build_levels(problem, system, weight, work);
        let size = system.size();
        self.right.resize(size, 0.0);
        set(&mut self.right, |k| system.free[k] * right(k));
        let packed = pack(&mut self.packed, system, weight);
        let operator = Operator { packed, ..self.matrix.value.operator(system, weight, &self.evaluation) };
        let goal = StoppingCriterion {
            capacity: self.matrix.value.capacity,
            tolerance,
            floor: 0.0,
            limit: limit(size),
            stop: &|| false,
        };
        self.correction.resize(size, 0.0);
        let factored = self.factors.matches(key(system, weight)) && system.is_linear();
        match &mut self.factors.value {
            Some(factors) if self.method == LinearMethod::Factors && factored => {
                factors.solve(&self.right, &mut self.correction);
                work.direct_solves += 1;
            }
            _ => {
                let (inverse, right, found) =
                    (&self.matrix.value.inverse, &mut self.right, &mut self.correction);
                let symmetric = system.is_symmetric();
                let ended = self.iterative.solve(&operator, symmetric, inverse, right, found, &goal);
                work.cg_iterations += ended.iterations as u64;
                work.cg_solves += 1;
            }
        }
        largest(size, |k| self.correction[k].abs()).max(0.0)
    }

    fn evaluate(
        &mut self,
        problem: &Problem,
        system: &mut ThermalSystem,
        stage: &StageEquation,
        temperature: &[f64],
        work: &mut Work,
    ) -> Result<(), Error> {
        let at = StepInput { temperature, start: stage.start, dt: stage.dt, time: stage.time, tangent: true };
        self.evaluation.responses = 0;
        system.evaluate(problem, &at, stage.old, &mut self.evaluation)?;
        work.evaluations += 1;
        work.responses += self.evaluation.responses;
        self.residual.resize(system.size(), 0.0);
        let Evaluation { change, rate, .. } = &self.evaluation;
        if stage.known.is_empty() {
            set(&mut self.residual, |k| change[k] + stage.weight * rate[k]);
        } else {
            set(&mut self.residual, |k| change[k] + stage.known[k] + stage.weight * rate[k]);
        }
        Ok(())
    }

    /// Builds requested multigrid levels for the prepared matrix.
    fn build_levels(&mut self, problem: &Problem, system: &ThermalSystem, weight: f64, work: &mut Work) {
        if self.method != LinearMethod::Multigrid || !system.is_symmetric() {
            self.iterative.multigrid.value = None;
            return;
        }
        let levels = &mut self.iterative.multigrid;
        if !levels.matches_build(system.build) || levels.value.is_none() {
            let operator = self.matrix.value.operator(system, weight, &self.evaluation);
            let place = |k: usize| problem.mesh.points[system.nodes()[k] as usize];
            levels.value = Some(Multigrid::new(&operator, &system.free, place));
            levels.forget();
            work.levels += 1;
        }
        let key = key(system, weight);
        let set = levels.matches(key) && system.is_linear();
        if let Some(multigrid) = levels.value.as_mut().filter(|_| !set) {
            if system.consistent {
                let mut lumped = self.evaluation.capacity(system).to_vec();
                let one = vec![1.0; lumped.len()];
                self.evaluation.faces.iter().for_each(|face| face.add_product(weight, &one, &mut lumped));
                multigrid.set(&lumped, weight);
            } else {
                multigrid.set(&self.matrix.value.diagonal, weight);
            }
            levels.set_key(key);
        }
    }

    /// Returns true if the residuals of the free nodes sum to zero, within [`BALANCE_TOLERANCE`].
    fn balanced(&self, system: &ThermalSystem, weight: f64) -> bool {
        let size = system.size();
        let total = dot(&system.free, &self.residual);
        let mut gross = sum(size, |k| self.evaluation.change[k].abs());
        gross += weight * self.evaluation.exchange.gross();
        gross +=
            system.fixed.iter().map(|&(equation, _)| self.residual[equation as usize].abs()).sum::<f64>();
        total.abs() <= BALANCE_TOLERANCE * (gross + REFERENCE_SHIFT * self.sensitivity())
    }

    fn finite(
        &self,
        problem: &Problem,
        system: &ThermalSystem,
        stage: &StageEquation,
        found: &[f64],
    ) -> Result<(), Error> {
        if sum(found.len(), |k| found[k]).is_finite() && sum(found.len(), |k| self.residual[k]).is_finite() {
            return Ok(());
        }
        Err(not_finite(problem, system, stage, found))
    }
}

fn limit(size: usize) -> usize {
    (10 * size + 100).min(100_000)
}

/// Packs the rows of a symmetric matrix; `None` if none are packed.
fn pack<'a>(packed: &'a mut PackedRows, system: &ThermalSystem, weight: f64) -> Option<&'a PackedRows> {
    let weights = if system.consistent { [1.0, weight] } else { [0.0, 1.0] };
    (system.is_symmetric() && packed.update(&system.rows, weights)).then_some(packed)
}

fn not_finite(problem: &Problem, system: &ThermalSystem, stage: &StageEquation, found: &[f64]) -> Error {
    let place = match found.iter().position(|t| !t.is_finite()) {
        Some(k) => {
            let node = system.nodes()[k];
            format!("node {node} at {:?} m", problem.mesh.points[node as usize])
        }
        None => "some node".into(),
    };
    Error::NotFinite { quantity: "temperature", place, time: stage.time }
}
