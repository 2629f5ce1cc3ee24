//! Solver settings of a scene: quasi-static methods and explicit dynamics.

use super::formula::Formula;
use super::{DeviceChoice, ForcePrecision, Scene};
use crate::solver::{
    DynamicRelaxation, Equilibrium, Lbfgs, LbfgsSolver, Policy, RelaxationSolver, VelocityVerlet,
};
use polycore::units::{Density, Rate, Ratio, Time};
use serde::Deserialize;

/// Solver settings.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SolverSpec {
    /// Method; default: [`Scene::method`].
    pub method: Option<SolverMethod>,
    /// Out-of-balance force over reference force; default: [`Scene::tolerance`].
    pub tolerance: Option<f64>,
    /// Load steps from 0 to the full load, or along the whole path.
    pub steps: usize,
    /// Load factors to reach one after the other from 0, with equally many steps each; default: 1.
    pub path: Option<Vec<f64>>,
    /// Largest number of iterations of a step.
    pub max_iterations: u64,
    /// Largest relative error of the fitted bond law; default 1e-9, or 1e-6 where bonds break or forces are
    /// in mixed precision.
    pub fit_bound: Option<f64>,
    /// Factor on the fictitious mass of dynamic relaxation; default by law.
    pub mass_safety: Option<f64>,
    /// Residual below which a search that has used all its iterations is accepted; default: it is an error.
    pub accept: Option<f64>,
    /// Bisects load steps in which bonds would break, down to 1/`refine` of a step.
    pub refine: usize,
    /// Lowers the load after bonds break, until no other bond would break; needs `refine`.
    pub snap_back: bool,
    /// Times at which bonds are tested for breaking.
    pub breaking: Policy,
    /// Ends the run once the load has fallen below this fraction of its peak.
    pub stop_below: Option<Ratio>,
    /// Device that takes the iterations of equilibria; default: the processor.
    pub device: Option<DeviceChoice>,
    /// Precision of numbers on a graphics card, `double` or `single`; default: double.
    pub precision: Option<ForcePrecision>,
}

impl Default for SolverSpec {
    fn default() -> Self {
        Self {
            method: None,
            tolerance: None,
            steps: 1,
            path: None,
            max_iterations: 200_000,
            fit_bound: None,
            mass_safety: None,
            accept: None,
            refine: 1,
            snap_back: false,
            breaking: Policy::default(),
            stop_below: None,
            device: None,
            precision: None,
        }
    }
}

impl SolverSpec {
    /// Returns the load factor at the end of each step.
    pub fn factors(&self) -> Vec<f64> {
        let path = self.path.as_deref().unwrap_or(&[1.0]);
        let each = self.steps / path.len().max(1);
        let leg = |(index, &end): (usize, &f64)| {
            let start = index.checked_sub(1).map_or(0.0, |before| path[before]);
            (1..=each).map(move |step| {
                let part = step as f64 / each as f64;
                if step == each { end } else { start + (end - start) * part }
            })
        };
        path.iter().enumerate().flat_map(leg).collect()
    }
}

/// Methods.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SolverMethod {
    /// Adaptive dynamic relaxation, quasi-static.
    Adr,
    /// Preconditioned L-BFGS, quasi-static.
    Lbfgs,
    /// Velocity Verlet: explicit dynamics, with a `[dynamics]` block.
    Verlet,
}

impl SolverMethod {
    /// Returns the name in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Adr => "adr",
            Self::Lbfgs => "lbfgs",
            Self::Verlet => "verlet",
        }
    }
}

impl Scene {
    /// Returns the largest relative error of the fitted bond law.
    pub fn fit_bound(&self) -> f64 {
        let single = self.device().1 == ForcePrecision::Single;
        let rough = self.breaks() || self.is_mixed() || single;
        self.solver.fit_bound.unwrap_or(if rough { 1e-6 } else { 1e-9 })
    }

    /// Returns true if bond forces are in mixed precision.
    pub fn is_mixed(&self) -> bool {
        self.dynamics.as_ref().is_some_and(|dynamics| dynamics.precision == ForcePrecision::Mixed)
    }

    /// Returns the method; default: L-BFGS; with contact dynamic relaxation where bonds break, and on a card,
    /// which has the diagonal of contact only.
    pub fn method(&self) -> SolverMethod {
        let hard = self.breaks() || self.device().0 != DeviceChoice::Cpu;
        self.solver.method.unwrap_or(if self.contact.is_some() && hard {
            SolverMethod::Adr
        } else {
            SolverMethod::Lbfgs
        })
    }

    /// Returns the tolerance; default: 1e-3; with breaking bonds 1e-4 of L-BFGS and 1e-5 of relaxation, with
    /// which the bonds break as in exact equilibrium (`cases/ch2/dent-events`).
    pub fn tolerance(&self) -> f64 {
        let plain = match (self.breaks(), self.method()) {
            (false, _) => 1e-3,
            (true, SolverMethod::Lbfgs) => 1e-4,
            (true, _) => 1e-5,
        };
        self.solver.tolerance.unwrap_or(plain)
    }

    /// Builds the quasi-static method.
    pub fn equilibria<const D: usize>(&self) -> Box<dyn Equilibrium<D>> {
        match self.method() {
            SolverMethod::Lbfgs => Box::new(LbfgsSolver::new(self.lbfgs())),
            SolverMethod::Adr | SolverMethod::Verlet => Box::new(RelaxationSolver::new(self.relaxation())),
        }
    }

    /// Settings of L-BFGS.
    pub fn lbfgs(&self) -> Lbfgs {
        let (tolerance, max_iterations) = (self.tolerance(), self.solver.max_iterations);
        let accept = self.solver.accept.unwrap_or(0.0);
        Lbfgs { tolerance, max_iterations, accept, ..Lbfgs::default() }
    }

    /// Settings of dynamic relaxation.
    pub fn relaxation(&self) -> DynamicRelaxation {
        let (tolerance, max_iterations) = (self.tolerance(), self.solver.max_iterations);
        let accept = self.solver.accept.unwrap_or(0.0);
        let mass_safety = self.solver.mass_safety.unwrap_or(self.material.mass_safety());
        DynamicRelaxation { tolerance, max_iterations, accept, mass_safety }
    }
}

/// Settings of explicit dynamics: loads rise linearly over the ramp and then stay constant.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Dynamics {
    /// Mass density ρ.
    pub density: Density,
    /// Duration of the run.
    pub end_time: Time,
    /// Time over which the loads rise; default: 0.
    pub ramp: Option<Time>,
    /// Load factor as a formula of the time `t`, s, instead of `ramp`.
    pub factor: Option<Formula>,
    /// Largest time step; default: `safety` times the critical one.
    pub time_step: Option<Time>,
    /// Time step over the critical one; default: 0.9.
    pub safety: Option<f64>,
    /// Mass-proportional damping; default: none.
    pub damping: Option<Rate>,
    /// Number of history rows at equal intervals; default: 100.
    pub records: Option<usize>,
    /// Precision of bond forces; default: double.
    #[serde(default)]
    pub precision: ForcePrecision,
    /// Device that takes the steps; default: the processor.
    #[serde(default)]
    pub device: DeviceChoice,
}

impl Dynamics {
    /// Builds the method.
    pub fn method(&self) -> VelocityVerlet {
        let plain = VelocityVerlet::new(self.density.si(), self.end_time.si());
        VelocityVerlet {
            time_step: self.time_step.map(|t| t.si()),
            safety: self.safety.unwrap_or(plain.safety),
            damping: self.damping.map_or(0.0, |c| c.si()),
            ramp: self.ramp.map_or(0.0, |t| t.si()),
            records: self.records.unwrap_or(plain.records),
            ..plain
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use harness::scene::Source;

    #[test]
    fn fractions_may_be_percentages() {
        for text in ["0.02", "\"2 %\""] {
            let source = Source::new("scene.toml", format!("version = 1\nstop_below = {text}"));
            let solver = source.parse::<SolverSpec>().unwrap();
            assert_eq!(solver.stop_below.map(|part| part.si()), Some(0.02));
        }
    }
}
