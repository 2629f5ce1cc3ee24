//! Time integration of a problem: [`Simulation::advance`] runs from one time to the next, through births, in
//! steps that end at every given time.

mod step;

use crate::error::Error;
pub use crate::fields::Statistics;
use crate::ledger::{Ledger, StepBalance};
use crate::problem::Problem;
use crate::solver::LinearTask;
pub use crate::solver::{LinearMethod, LinearSolver, SolverChoice};
use crate::system::{Exchange, MaterialBehaviour, NONE, ThermalSystem};
pub use crate::system::{PointMemory, PointStates};
use crate::time::{Scheme, StepStart, Stepper, Steps, Work};
use polycore::numerics::bounds;
use std::ops::ControlFlow;
use std::sync::Arc;

/// Settings of the time integration.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Settings {
    /// Time integrator.
    pub scheme: Scheme,
    /// Step lengths.
    pub steps: Steps,
    /// Rms error of temperature, K, allowed in linear solves and Newton's iteration.
    pub tolerance: f64,
    /// Linear solver.
    pub solver: LinearSolver,
}

impl Settings {
    /// Returns TR-BDF2 with a temporal error of at most 0.1 K per step.
    pub fn adaptive(first: f64) -> Self {
        let steps = Steps::Adaptive { tolerance: 0.1, first, smallest: 1e-6 * first, largest: f64::INFINITY };
        Self { scheme: Scheme::TrBdf2, steps, tolerance: 1e-7, solver: LinearSolver::Auto }
    }

    /// Returns backward Euler with fixed steps.
    pub fn backward_euler(dt: f64) -> Self {
        Self {
            scheme: Scheme::BackwardEuler,
            steps: Steps::Fixed { dt },
            tolerance: 1e-7,
            solver: LinearSolver::Auto,
        }
    }

    fn check(&self) -> Result<(), Error> {
        let positive = |name, found: f64| {
            if found > 0.0 {
                return Ok(());
            }
            Err(Error::Parameter { name, found, allowed: "above 0".into() })
        };
        positive("tolerance", self.tolerance)?;
        match self.steps {
            Steps::Fixed { dt } => positive("time step", dt),
            Steps::Adaptive { tolerance, first, smallest, largest } => {
                positive("temporal tolerance", tolerance)?;
                positive("first step", first)?;
                positive("smallest step", smallest)?;
                if largest >= smallest && first >= smallest {
                    return Ok(());
                }
                let found = largest.min(first);
                let allowed = format!("{smallest} s (the smallest step) or more");
                Err(Error::Parameter { name: "largest step, first step", found, allowed })
            }
        }
    }
}

/// State of a simulation: everything needed to continue with the same bits.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct State {
    /// Time, s.
    pub time: f64,
    /// Temperature of each equation, K.
    pub temperature: Vec<f64>,
    /// Rate of change over the last step, K/s; empty after a jump.
    pub slope: Vec<f64>,
    /// Q of each equation, W; empty if unknown.
    pub rate: Vec<f64>,
    /// Heat supplied at this time, W.
    pub exchange: Exchange,
    /// Material points.
    pub memory: PointMemory,
    /// Birth of each element, from 1; 0 for elements from the start, [`u32::MAX`] for unborn ones.
    pub born: Vec<u32>,
    /// Number of past births.
    pub births: usize,
    /// Length of the next step by error control, s.
    pub next_dt: f64,
    /// True right after a jump.
    pub jump: bool,
    /// Method for linear systems since the last jump.
    pub method: LinearMethod,
    /// Iterations since the last choice of method, in steps whose solves took many.
    pub excess: f64,
    /// Energies since the start.
    pub ledger: Ledger,
    /// Work since the start.
    pub work: Work,
}

impl State {
    /// Initial values of a step.
    pub(crate) fn start(&self) -> StepStart<'_> {
        let Self { time, temperature, slope, rate, exchange, memory, .. } = self;
        StepStart { time: *time, temperature, slope, rate, exchange, memory }
    }
}

/// A problem during its time integration.
pub struct Simulation {
    pub(crate) problem: Arc<Problem>,
    pub(crate) settings: Settings,
    pub(crate) behaviours: Vec<MaterialBehaviour>,
    pub(crate) system: ThermalSystem,
    pub(crate) state: State,
    stepper: Stepper,
    breaks: Vec<f64>,
}

impl Simulation {
    /// Number of material points, number of distinct matrix rows, and bytes of all stored rows.
    pub fn storage(&self) -> [usize; 3] {
        let rows = &self.system.rows;
        [self.system.nodal.material.len(), rows.stored()[0], rows.bytes()]
    }

    /// Starts at time 0 with the elements that exist then. Share a problem by an [`Arc`] if others use it.
    ///
    /// # Errors
    /// Errors of [`Problem::check`] and of the materials.
    pub fn new(problem: impl Into<Arc<Problem>>, settings: Settings) -> Result<Self, Error> {
        let problem = problem.into();
        let (behaviours, breaks) = Self::prepare(&problem, &settings)?;
        let mut state = State { born: vec![0; problem.material_of.len()], jump: true, ..State::default() };
        let later = problem.births.iter().flat_map(|birth| &birth.elements);
        for &element in later.chain(&problem.absent) {
            state.born[element as usize] = NONE;
        }
        if let Steps::Adaptive { first, .. } = settings.steps {
            state.next_dt = first;
        }
        let system = ThermalSystem::build(&problem, &behaviours, &state.born, 0)?;
        (state.work.builds, state.work.visited) = (1, system.elements as u64);
        state.temperature = system
            .nodes()
            .iter()
            .map(|&n| problem.initial.value_at(problem.mesh.points[n as usize], 0.0))
            .collect();
        if let Some(found) = state.temperature.iter().copied().find(|t| !(*t >= 0.0 && t.is_finite())) {
            let allowed = "an absolute temperature, 0 K or above".into();
            return Err(Error::Parameter { name: "initial temperature", found, allowed });
        }
        let mut simulation =
            Self { problem, settings, behaviours, system, state, stepper: Stepper::default(), breaks };
        // temperatures prescribed at the start are part of the initial state
        simulation.system.prescribe(&simulation.problem, 0.0, &mut simulation.state.temperature);
        simulation.fresh_points()?;
        simulation.give_birth()?;
        Ok(simulation)
    }

    /// Continues from a state of the same problem.
    ///
    /// # Errors
    /// Errors of [`Self::new`]; [`Error::Mesh`] if the state does not belong to the problem.
    pub fn resume(problem: impl Into<Arc<Problem>>, settings: Settings, state: State) -> Result<Self, Error> {
        let problem = problem.into();
        let (behaviours, breaks) = Self::prepare(&problem, &settings)?;
        if state.born.len() != problem.material_of.len() {
            return Err(Error::Mesh(format!(
                "state: found {} elements; allowed: the mesh's {}",
                state.born.len(),
                problem.material_of.len()
            )));
        }
        let system = ThermalSystem::build(&problem, &behaviours, &state.born, state.births)?;
        let size = system.size();
        let fits = |list: &[f64]| list.is_empty() || list.len() == size;
        let memory = &state.memory;
        if state.temperature.len() != size
            || !fits(&state.slope)
            || !fits(&state.rate)
            || memory.nodal.energy.len()
                != if system.nodal.energies { system.nodal.material.len() } else { 0 }
            || memory.nodal.state.len() != system.nodal.material.len() * system.nodal.stride
            || memory.general.energy.len() != system.general.points()
            || memory.general.state.len() != system.general.points() * system.general.stride
        {
            return Err(Error::Mesh(format!(
                "state: found {} temperatures and {} + {} points; allowed: {size} and {} + {} of this \
                 problem",
                state.temperature.len(),
                memory.nodal.state.len() / system.nodal.stride.max(1),
                memory.general.energy.len(),
                system.nodal.material.len(),
                system.general.points()
            )));
        }
        Ok(Self { problem, settings, behaviours, system, state, stepper: Stepper::default(), breaks })
    }

    fn prepare(problem: &Problem, settings: &Settings) -> Result<(Vec<MaterialBehaviour>, Vec<f64>), Error> {
        settings.check()?;
        problem.check()?;
        let behaviours = problem
            .materials
            .iter()
            .map(|material| MaterialBehaviour::from_material(&**material, problem.capacity))
            .collect::<Result<_, _>>()?;
        Ok((behaviours, problem.breaks()))
    }

    /// Returns the problem.
    pub fn problem(&self) -> &Problem {
        &self.problem
    }

    /// Returns the state, which can be serialized to continue later with the same bits.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Time, s.
    pub fn time(&self) -> f64 {
        self.state.time
    }

    /// Returns true if a node of the mesh exists.
    pub fn exists(&self, node: u32) -> bool {
        self.system.equation.get(node as usize).is_some_and(|&equation| equation != NONE)
    }

    /// Returns true if an element exists.
    pub fn is_born(&self, element: u32) -> bool {
        self.state.born.get(element as usize).is_some_and(|&birth| birth != NONE)
    }

    /// Temperature of a node, K; `None` if it does not exist.
    pub fn temperature(&self, node: u32) -> Option<f64> {
        let equation = *self.system.equation.get(node as usize)?;
        self.state.temperature.get(equation as usize).copied()
    }

    /// Temperatures of all nodes of the mesh, K; `missing` for nodes that do not exist.
    pub fn temperatures(&self, missing: f64) -> Vec<f64> {
        (0..self.problem.mesh.points.len() as u32).map(|n| self.temperature(n).unwrap_or(missing)).collect()
    }

    /// Interpolates the temperature at a position, K; `None` outside existing elements.
    pub fn temperature_at(&self, place: [f64; 3]) -> Option<f64> {
        self.problem.mesh.locate(place)?.value(|node| self.temperature(node))
    }

    /// Runs to a time. `observe` is called after every accepted step, and may stop the run. Births at `until`
    /// itself are left to the next call, so that outputs at that time show the state before them.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a past time; errors of the materials; [`Error::NotConverged`] if a step of
    /// the smallest length has no solution.
    pub fn advance(
        &mut self,
        until: f64,
        observe: &mut (dyn FnMut(&Self, &StepBalance) -> ControlFlow<()> + Send),
    ) -> Result<ControlFlow<()>, Error> {
        self.advance_unless(&|| false, until, observe)
    }

    /// Runs like [`Self::advance`], but also stops within a step once `stop` returns true (and keeps
    /// returning it); the step is then discarded.
    ///
    /// # Errors
    /// Errors of [`Self::advance`].
    pub fn advance_unless(
        &mut self,
        stop: &(dyn Fn() -> bool + Sync),
        until: f64,
        observe: &mut (dyn FnMut(&Self, &StepBalance) -> ControlFlow<()> + Send),
    ) -> Result<ControlFlow<()>, Error> {
        if !(until >= self.state.time && until.is_finite()) {
            let allowed = format!("{} s (now) or later, finite", self.state.time);
            return Err(Error::Parameter { name: "end time", found: until, allowed });
        }
        // one entry into the thread pool for all small parallel loops of a run
        rayon::scope(|_| {
            while self.state.time < until {
                self.give_birth()?;
                let work = self.state.work;
                let record = match self.step(until, stop) {
                    Err(Error::Stopped { .. }) => {
                        self.state.work = work;
                        return Ok(ControlFlow::Break(()));
                    }
                    step => step?,
                };
                if observe(self, &record).is_break() {
                    return Ok(ControlFlow::Break(()));
                }
            }
            Ok(ControlFlow::Continue(()))
        })
    }

    /// Runs to a time without an observer.
    ///
    /// # Errors
    /// Errors of [`Self::advance`].
    pub fn run_until(&mut self, until: f64) -> Result<(), Error> {
        self.advance(until, &mut |_, _| ControlFlow::Continue(())).map(|_| ())
    }

    /// Runs to a time with a callback after each accepted step; its first error ends the run.
    /// # Errors
    /// Errors of [`Self::advance`] and of `after_step`.
    pub fn observe(
        &mut self,
        until: f64,
        mut after_step: impl FnMut(&Self) -> Result<(), Error> + Send,
    ) -> Result<(), Error> {
        let mut result = Ok(());
        let _ = self.advance(until, &mut |simulation, _| {
            result = after_step(simulation);
            if result.is_err() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        result
    }

    /// Returns the linear solver for a run to a time, with the reason.
    pub fn choose(&self, until: f64) -> SolverChoice {
        self.task(until).choose()
    }

    /// Estimates the entries of the matrix factors in a run to a time; 0 without factors.
    pub fn factors(&self, until: f64) -> f64 {
        let task = self.task(until);
        if task.choose().method == LinearMethod::Factors { task.factor_entries() } else { 0.0 }
    }

    pub(crate) fn task(&self, until: f64) -> LinearTask {
        let (equal_steps, dt) = match self.settings.steps {
            Steps::Fixed { dt } => (true, dt),
            Steps::Adaptive { first, .. } => (false, first),
        };
        let next = self.breaks[self.breaks.partition_point(|&t| t <= self.state.time)..].first().copied();
        let span = next.map_or(until, |next| next.min(until)) - self.state.time;
        // A_ii of backward Euler over the capacity
        let capacity = |k: usize| self.system.capacity[k];
        let size = self.system.size();
        let [low, high] =
            bounds(self.system.nodes().iter().map(|&node| self.problem.mesh.points[node as usize]));
        let extent = [0, 1, 2].map(|d| (high[d] - low[d]).max(0.0));
        let longest = extent.into_iter().fold(0.0, f64::max);
        let spacing = (extent.iter().product::<f64>() / size as f64).cbrt().max(1e-6 * longest);
        let stiffness = self.system.rows.largest(|k, conduction| match capacity(k) > 0.0 {
            true => 1.0 + dt * conduction / capacity(k),
            false => 1.0,
        });
        LinearTask {
            size,
            length: longest / spacing,
            entries: self.system.rows.stored()[2],
            stiffness,
            solves: span / dt,
            linear: self.system.is_linear(),
            symmetric: self.system.is_symmetric(),
            constant: self.system.general.is_empty(),
            equal_steps,
            wanted: self.settings.solver,
        }
    }

    /// Describes the computation of a run to a time and what is left out: one sentence a line.
    pub fn explain(&self, until: f64) -> Vec<String> {
        let system = &self.system;
        let [rows, segments, entries] = system.rows.stored();
        let mut lines = vec![
            format!(
                "{} equations for {} of {} elements; {} nodes have no equation, {} are prescribed",
                system.equation.iter().filter(|equation| **equation != NONE).count(),
                system.elements,
                self.problem.material_of.len(),
                system.equation.iter().filter(|equation| **equation == NONE).count(),
                system.fixed.len()
            ),
            format!("conduction: {rows} distinct rows ({entries} entries) in {segments} runs of equal rows"),
        ];
        lines.push(match system.is_linear() {
            true => "linear: one linear solve a stage, no Newton iteration".into(),
            false => "not linear: Newton's iteration with line search".into(),
        });
        if !system.nodal.is_empty() {
            lines.push(format!("{} material points at nodes", system.nodal.material.len()));
        }
        if !system.general.is_empty() {
            lines.push(format!("{} material points in elements", system.general.points()));
        }
        lines.push(self.choose(until).reason);
        lines
    }

    /// Invalidates everything prepared for earlier equations.
    pub(crate) fn forget(&mut self) {
        self.stepper.reset();
    }
}
