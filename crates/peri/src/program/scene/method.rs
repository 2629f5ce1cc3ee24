//! What a scene says of its solver: quasi-static methods and explicit dynamics.

use super::Scene;
use super::formula::Formula;
use crate::solver::{
    DynamicRelaxation, Equilibrium, Lbfgs, LbfgsSolver, Policy, RelaxationSolver, VelocityVerlet,
};
use polycore::units::{Density, Rate, Time};
use serde::Deserialize;

/// Solver settings.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Solver {
    /// Method; default: [`Scene::method`].
    pub method: Option<Method>,
    /// Out-of-balance force over reference force; default: [`Scene::tolerance`].
    pub tolerance: Option<f64>,
    /// Load steps from 0 to the full load, or along the whole path.
    pub steps: usize,
    /// Load factors that are reached one after the other from 0, in equally many steps each; default: 1.
    pub path: Option<Vec<f64>>,
    /// Iterations a step may take.
    pub max_iterations: u64,
    /// Largest relative error of the fitted bond law; default 1e-9, or 1e-6 where bonds break or forces are in mixed precision.
    pub fit_bound: Option<f64>,
    /// Factor on the fictitious mass of dynamic relaxation; default by law.
    pub mass_safety: Option<f64>,
    /// Go on from a search that has used all its iterations if its residual is below this; default: that is an error.
    pub accept: Option<f64>,
    /// Where bonds would break in a load step, cut it: they break within this part, 1/`refine`, of a step.
    pub refine: usize,
    /// Lower the load after bonds broke, until no others would break at once; needs `refine`.
    pub snap_back: bool,
    /// When bonds are looked at that may break.
    pub breaking: Policy,
    /// Skip what is left of the load once it has fallen below this part of its peak.
    pub stop_below: Option<f64>,
}

impl Default for Solver {
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
        }
    }
}

impl Solver {
    /// Load factor at the end of each step.
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
pub enum Method {
    /// Adaptive dynamic relaxation, quasi-static.
    Adr,
    /// Preconditioned L-BFGS, quasi-static.
    Lbfgs,
    /// Velocity Verlet: explicit dynamics, with a `[dynamics]` block.
    Verlet,
}

impl Method {
    /// Its name in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Adr => "adr",
            Self::Lbfgs => "lbfgs",
            Self::Verlet => "verlet",
        }
    }
}

impl Scene {
    /// The method: L-BFGS unless told otherwise, and dynamic relaxation where particles touch, of which the coarse level
    /// of L-BFGS knows nothing.
    pub fn method(&self) -> Method {
        self.solver.method.unwrap_or(if self.contact.is_some() { Method::Adr } else { Method::Lbfgs })
    }

    /// The tolerance: 1e-3 unless told otherwise; where bonds break that at which those of equilibrium do
    /// (`cases/ch2/dent-events`), 1e-4 of L-BFGS and 1e-5 of relaxation.
    pub fn tolerance(&self) -> f64 {
        let plain = match (self.material.critical.is_some(), self.method()) {
            (false, _) => 1e-3,
            (true, Method::Lbfgs) => 1e-4,
            (true, _) => 1e-5,
        };
        self.solver.tolerance.unwrap_or(plain)
    }

    /// The quasi-static method with the settings of this scene.
    pub fn equilibria<const D: usize>(&self) -> Box<dyn Equilibrium<D>> {
        let (tolerance, max_iterations) = (self.tolerance(), self.solver.max_iterations);
        let accept = self.solver.accept.unwrap_or(0.0);
        match self.method() {
            Method::Lbfgs => {
                let plain = Lbfgs::default();
                Box::new(LbfgsSolver::new(Lbfgs { tolerance, max_iterations, accept, ..plain }))
            }
            Method::Adr | Method::Verlet => {
                let mass_safety =
                    self.solver.mass_safety.unwrap_or(self.material.law.unwrap_or_default().mass_safety());
                let settings = DynamicRelaxation { tolerance, max_iterations, accept, mass_safety };
                Box::new(RelaxationSolver::new(settings))
            }
        }
    }
}

/// Explicit dynamics: loads rise linearly over the ramp and then stay.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Dynamics {
    /// Mass density ρ.
    pub density: Density,
    /// When to end.
    pub end_time: Time,
    /// Time over which the loads rise; default: at once.
    pub ramp: Option<Time>,
    /// The load factor as a formula of the time `t`, s, instead of `ramp`.
    pub factor: Option<Formula>,
    /// Largest time step; default: `safety` times the critical one.
    pub time_step: Option<Time>,
    /// Part of the critical time step; default 0.9.
    pub safety: Option<f64>,
    /// Mass-proportional damping; default: none.
    pub damping: Option<Rate>,
    /// Rows of history, equally far apart; default 100.
    pub records: Option<usize>,
    /// Precision of the forces of bonds; default: double.
    #[serde(default)]
    pub precision: Precision,
    /// Device that takes the steps; default: the processor.
    #[serde(default)]
    pub device: DeviceChoice,
}

/// Device that takes the steps of explicit dynamics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DeviceChoice {
    /// The processor.
    #[default]
    Cpu,
    /// A graphics card: a lattice of a bond law, without contact, inclusions, surface correction and rotations.
    Gpu,
    /// A graphics card where there is one that can do it and the body is large enough to gain by it, the processor otherwise.
    Auto,
}

impl DeviceChoice {
    /// Its name in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cpu => "cpu",
            Self::Gpu => "gpu",
            Self::Auto => "auto",
        }
    }
}

/// Precision of the forces of bonds in a lattice; all else is in double precision, but on a graphics card in single precision.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Precision {
    /// Double precision.
    #[default]
    Double,
    /// Bonds in single precision, the sums of their forces in double precision; `mixed_error` of the report says what that costs.
    /// Double precision while bonds are stretched or crushed so far that single precision would miss the law by more than 1e-5.
    Mixed,
    /// Single precision throughout, on a graphics card.
    Single,
}

impl Dynamics {
    /// The method with these settings.
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
