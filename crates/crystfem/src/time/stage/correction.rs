//! Corrections of a stage's temperature by linear solves.

use super::{FORCING, LINEAR, StageEquation, Stages, key, limit, pack};
use crate::error::Error;
use crate::problem::Problem;
use crate::solver::{
    Direct, LinearMethod, Operator, PACKED_CHANGE, SolveOutcome, StoppingCriterion, norm_squared,
};
use crate::system::ThermalSystem;
use crate::system::vector::{combine, dot, sum};
use crate::time::Work;

/// Limit on solves of a correction.
const MAX_SOLVES: usize = 4;
/// Fraction of the tolerance to which they reduce the residual, which is known to the rounding of packed
/// rows.
const REACHED: f64 = 0.7;

impl Stages {
    /// Computes the correction of temperature: A δ = −residual, with Σ(residual + A δ) = 0 over the free
    /// nodes to rounding. It is solved to `goal`, K.
    ///
    /// Surfaces at `temperature` + δ take more heat than their tangent tells. Where elements are linear,
    /// that is all that an evaluation would find: it is added to the residual, and the same matrix solves
    /// the rest until the residual is below the tolerance, K.
    pub(super) fn correct(
        &mut self,
        problem: &Problem,
        system: &ThermalSystem,
        stage: &StageEquation,
        [goal, tolerance]: [f64; 2],
        temperature: &[f64],
        work: &mut Work,
    ) -> Result<(), Error> {
        let size = system.size();
        // both are work vectors here, and evaluated again after the correction
        self.iterative.swap_vectors(&mut self.evaluation.change, &mut self.evaluation.rate);
        self.build_levels(problem, system, stage.weight, work);
        combine(&mut self.residual, |k, residual| -system.free[k] * residual);
        let factored = self.factor(problem, system, stage, work);
        // 1·(r + A δ) from column sums, as the iterations know A to single precision only
        let mut total = 0.0;
        let iterated = system.is_symmetric() && !factored;
        if iterated {
            let right = &self.residual;
            total = sum(size, |k| right[k]);
        }
        self.solve_linear(system, stage, factored, goal, work)?;
        if system.is_linear_inside() && !system.is_linear() {
            self.trial.clear();
            self.trial.resize(size, 0.0);
            // packed rows leave this part of the first error, which must stay below the tolerance
            if iterated && PACKED_CHANGE / FORCING * goal > LINEAR * tolerance {
                let operator = self.matrix.value.operator(system, stage.weight, &self.evaluation);
                let inverse = &self.matrix.value.inverse;
                self.iterative.renew(&operator, inverse, &mut self.residual, &self.correction);
            }
            for turn in 0..MAX_SOLVES {
                // the iteration lends its vectors
                self.iterative.swap_vectors(&mut self.evaluation.change, &mut self.evaluation.rate);
                total -= self.add_surface_remainder(problem, system, stage, temperature);
                self.iterative.swap_vectors(&mut self.evaluation.change, &mut self.evaluation.rate);
                let (sums, correction) = (&mut self.trial, &self.correction);
                combine(sums, |k, sum| sum + correction[k]);
                let square = norm_squared(&self.residual, &self.matrix.value.inverse);
                let error = (square / self.matrix.value.capacity).sqrt();
                if error <= REACHED * tolerance || turn + 1 == MAX_SOLVES {
                    break;
                }
                let goal = (FORCING * error).max(LINEAR * tolerance);
                self.solve_linear(system, stage, factored, goal, work)?;
            }
            std::mem::swap(&mut self.trial, &mut self.correction);
        }
        // a uniform shift of the free nodes makes the balance of the whole body exact
        let left = match iterated {
            true => total - self.matrix.value.column_sums(system, stage.weight, &self.correction),
            false => dot(&system.free, &self.residual),
        };
        let shift = left / self.sensitivity();
        if shift.is_finite() {
            for (correction, free) in self.correction.iter_mut().zip(&system.free) {
                *correction += shift * free;
            }
        }
        self.iterative.swap_vectors(&mut self.evaluation.change, &mut self.evaluation.rate);
        Ok(())
    }

    /// Factors the matrix, if requested and possible; returns true if factors serve it.
    fn factor(
        &mut self,
        problem: &Problem,
        system: &ThermalSystem,
        stage: &StageEquation,
        work: &mut Work,
    ) -> bool {
        if self.method != LinearMethod::Factors || !system.is_symmetric() {
            return false;
        }
        let operator = self.matrix.value.operator(system, stage.weight, &self.evaluation);
        let key = key(system, stage.weight);
        if !self.factors.matches_build(system.build) {
            let place = |e: u32| problem.mesh.points[system.nodes()[e as usize] as usize];
            self.factors.value = Direct::analyse(&operator, &system.free, place);
            self.factors.forget();
        }
        // without memory for factors, or with a matrix singular to rounding, the other method takes over
        if !(self.factors.matches(key) && system.is_linear()) {
            work.factorizations += 1;
            if !self.factors.value.as_mut().is_some_and(|factors| factors.factor(&operator)) {
                self.factors.value = None;
            }
            self.factors.set_key(key);
        }
        self.factors.value.is_some()
    }

    /// Solves A δ = residual, by factors if `factored`; `residual` becomes the rest.
    fn solve_linear(
        &mut self,
        system: &ThermalSystem,
        stage: &StageEquation,
        factored: bool,
        tolerance: f64,
        work: &mut Work,
    ) -> Result<(), Error> {
        let size = system.size();
        self.correction.resize(size, 0.0);
        let operator = self.matrix.value.operator(system, stage.weight, &self.evaluation);
        let mut ended = SolveOutcome { iterations: 0, error: 0.0, converged: true };
        match &mut self.factors.value {
            Some(factors) if factored => {
                factors.solve(&self.residual, &mut self.correction);
                work.direct_solves += 1;
                self.right.resize(size, 0.0);
                operator.product(&self.correction, &mut self.right);
                for ((right, image), free) in self.residual.iter_mut().zip(&self.right).zip(&system.free) {
                    *right -= free * image;
                }
            }
            _ => {
                work.cg_solves += 1;
                let goal = StoppingCriterion {
                    capacity: self.matrix.value.capacity,
                    tolerance,
                    floor: self.matrix.value.floor,
                    limit: limit(size),
                    stop: stage.stop,
                };
                let packed = pack(&mut self.packed, system, stage.weight);
                let operator = Operator { packed, ..operator };
                let (inverse, right, found) =
                    (&self.matrix.value.inverse, &mut self.residual, &mut self.correction);
                let symmetric = system.is_symmetric();
                ended = self.iterative.solve(&operator, symmetric, inverse, right, found, &goal);
            }
        }
        work.cg_iterations += ended.iterations as u64;
        if (stage.stop)() {
            return Err(Error::Stopped { time: stage.time - stage.dt });
        }
        if !ended.converged {
            return Err(Error::NotConverged {
                method: if system.is_symmetric() { "conjugate gradients" } else { "biconjugate gradients" },
                time: stage.time,
                iterations: ended.iterations,
                error: ended.error,
                wanted: tolerance,
            });
        }
        Ok(())
    }

    /// Subtracts from the right-hand side the heat that surfaces take beyond their tangent at `temperature`,
    /// a·(Q(T + δ) − Q(T) − ∂Q/∂T δ), as the last correction has changed it; `trial` are the corrections
    /// before. Returns its sum over the free nodes, J.
    fn add_surface_remainder(
        &mut self,
        problem: &Problem,
        system: &ThermalSystem,
        stage: &StageEquation,
        temperature: &[f64],
    ) -> f64 {
        // a work vector until the evaluation after the correction
        let rest = &mut self.evaluation.rate;
        rest.resize(system.size(), 0.0);
        rest.fill(0.0);
        system.surfaces.add_remainder(problem, temperature, [&self.trial, &self.correction], rest);
        combine(rest, |k, rest| stage.weight * system.free[k] * rest);
        combine(&mut self.residual, |k, right| right - rest[k]);
        sum(system.size(), |k| rest[k])
    }
}
