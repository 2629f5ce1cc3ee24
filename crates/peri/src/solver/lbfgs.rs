//! Limited-memory BFGS on the body's energy, from gradients only, with a two-level preconditioner: Nocedal &
//! Wright, Numerical Optimization (2006), §7.2; the step ends where the slope along the direction has fallen
//! enough (the curvature condition), found by secants.

use super::balance::SearchLimits;
use super::lbfgs_host::HostVectors;
use super::load_stepping::{Equilibrium, QuasiStatic};
use super::method::Watch;
use super::passes::ForceSums;
use super::record::Status;
use super::state::State;
use super::system::System;
use crate::bonds::StretchRange;
use crate::error::Error;

/// Searches, load steps, and iterations of one search, after which the preconditioner is rebuilt …
const SEARCHES: u64 = 25;
const STEPS: usize = 10;
const ITERATIONS: u64 = 200;
/// Iterations between checks of contact.
const TOUCHES: u64 = 10;
/// … and growth of a search over the first one with it, or over so few iterations.
const WORN_GROWTH: u64 = 2;
const FEW: u64 = 10;
/// σ: fraction of the first slope that may remain.
const SLOPE: f64 = 0.9;
/// Force evaluations of one line search.
const TRIALS: usize = 12;
/// Growth and decay of a trial step.
const GROWTH: f64 = 4.0;
const DECAY: f64 = 0.1;
/// A pair's curvature s·y over the slope's share α|g·d|, at least.
const CURVATURE: f64 = 1e-3;
/// Largest growth of the greatest stretch in a step, and least fraction of the smallest that remains.
const STRETCH: f64 = 0.3;
const CRUSH: f64 = 0.6;

/// Quasi-static solution by limited-memory BFGS with a two-level preconditioner: the fastest method and the
/// first choice for equilibria, with and without breaking bonds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lbfgs {
    /// Out-of-balance force over reference force at which a step is converged.
    pub tolerance: f64,
    /// Iterations that a search for equilibrium may take.
    pub max_iterations: u64,
    /// Number of pairs of steps and gradient changes kept.
    pub memory: usize,
    /// Edge of a cell of the coarse level over the particle spacing, at least 2; larger if the coarse level
    /// would become too large. ∞: no coarse level.
    pub coarsening: f64,
    /// Weight ω of the local part of the preconditioner.
    pub weight: f64,
    /// Residual below which a search continues after all its iterations are used; the residual is recorded in
    /// the history.
    pub accept: f64,
}

impl Default for Lbfgs {
    fn default() -> Self {
        Self {
            tolerance: 1e-3,
            max_iterations: 20_000,
            memory: 10,
            coarsening: 4.0,
            weight: 1.0,
            accept: 0.0,
        }
    }
}

impl Lbfgs {
    fn goal(&self) -> SearchLimits {
        SearchLimits { tolerance: self.tolerance, max_iterations: self.max_iterations, accept: self.accept }
    }
}

impl<const D: usize> QuasiStatic<D> for Lbfgs {
    fn solver(&self) -> impl Equilibrium<D> {
        LbfgsSolver::new(*self)
    }
}

/// Vectors of a search for equilibrium, on the host or on a device.
pub trait SearchVectors<const D: usize> {
    /// True if contacts may be held in a search.
    const HOLDS: bool;
    /// Builds the preconditioner for the present state.
    ///
    /// # Errors
    /// `Error::Device` for what a device cannot do, or where it fails; so below.
    fn build(&mut self, system: &mut System<D>, state: &State<D>, settings: &Lbfgs) -> Result<(), Error>;
    /// Returns true if there is a preconditioner.
    fn is_built(&self) -> bool;
    /// Begins from the fields of a state.
    fn take(&mut self, system: &mut System<D>, state: &State<D>) -> Result<(), Error>;
    /// Gives displacement and forces of the iterate to a state.
    fn give(&self, system: &mut System<D>, state: &mut State<D>) -> Result<(), Error>;
    /// Computes forces at the present displacement, those of the trial.
    fn evaluate(&mut self, system: &mut System<D>, state: &mut State<D>) -> Result<LinePoint, Error>;
    /// Faces in contact with rigid surfaces in the last forces, surface by surface, and 1 where they slip.
    fn in_touch(&self, system: &System<D>, state: &State<D>) -> Result<Vec<[u32; 3]>, Error> {
        Ok(in_touch(system, state))
    }
    /// ‖s u‖₂ with the springs s of the reference force, N/m³, and the precision of u.
    fn rounding(&mut self, system: &System<D>, state: &State<D>) -> Result<(f64, f64), Error>;
    /// u += step·d.
    fn step(&mut self, state: &mut State<D>, step: f64);
    /// Longest step along the direction, at stretches up to e = `most`.
    fn longest_step(&mut self, system: &System<D>, state: &State<D>, most: f64) -> Result<f64, Error>;
    /// The direction from the pairs; returns the slope along it.
    fn direct(&mut self) -> Result<f64, Error>;
    /// The direction without pairs, anew.
    fn direct_anew(&mut self) -> Result<f64, Error>;
    /// Makes the trial after a step the iterate; keeps its pair if s·y is above `least`.
    fn accept(&mut self, step: f64, least: f64) -> Result<(), Error>;
    /// Makes a trial that no search produced the iterate.
    fn arrive(&mut self);
    /// Forgets all pairs, and their scale if it is `scale_too`.
    fn forget(&mut self, scale_too: bool);
    /// Simplifies after a failed search: clears the pairs first, the next time drops the coarse level.
    fn simplify(&mut self);
    /// Updates for the sites whose bonds have broken.
    fn bonds_broke(&mut self, system: &System<D>, sites: &[u32]);
}

/// Solver of [`Lbfgs`] with vectors on the host.
pub type LbfgsSolver<const D: usize> = LbfgsSearch<HostVectors<D>>;

/// Solver of [`Lbfgs`].
pub struct LbfgsSearch<V> {
    settings: Lbfgs,
    vectors: V,
    /// Searches with this preconditioner, iterations of the first of them, and whether the last took too
    /// many.
    searches: u64,
    first: u64,
    worn: bool,
    /// Faces in contact with rigid surfaces when the preconditioner was built, and which of them slip.
    in_touch: Vec<[u32; 3]>,
}

/// A point along a search direction.
#[derive(Clone, Copy)]
pub struct LinePoint {
    /// Sums of forces.
    pub sums: ForceSums,
    /// Stretches.
    pub observed: StretchRange,
    /// Derivative of the energy along the direction.
    pub slope: f64,
}

/// Result of a line search.
enum LineSearch {
    /// Accepted step.
    Found(f64, LinePoint),
    /// No step found: the iterate is unchanged.
    Failed,
}

impl<const D: usize> LbfgsSolver<D> {
    /// Creates a solver without any computed data.
    pub fn new(settings: Lbfgs) -> Self {
        Self::with_vectors(settings, HostVectors::new(settings.memory))
    }

    /// Degrees of freedom of the coarse level and entries of its factors.
    pub fn coarse_size(&self) -> [usize; 2] {
        self.vectors.coarse_size()
    }
}

impl<V> LbfgsSearch<V> {
    /// Creates a solver with vectors of its own.
    pub(super) fn with_vectors(settings: Lbfgs, vectors: V) -> Self {
        Self { settings, vectors, searches: 0, first: 0, worn: false, in_touch: Vec::new() }
    }

    /// Builds the preconditioner for the present state and forgets everything else: a run that begins with
    /// this state takes the same steps.
    fn begin<const D: usize>(
        &mut self,
        system: &mut System<D>,
        state: &mut State<D>,
        watch: &mut Watch<D>,
    ) -> Result<(), Error>
    where
        V: SearchVectors<D>,
    {
        watch(&self.status(system, state, true), state)?;
        if self.holds(system) {
            system.hold_touching(state);
        }
        system.prepare(&mut state.displacement);
        (self.searches, self.first, self.worn) = (0, 0, false);
        self.in_touch = in_touch(system, state);
        self.vectors.build(system, state, &self.settings)
    }

    fn status<const D: usize>(&self, system: &System<D>, state: &State<D>, restartable: bool) -> Status {
        state.status(system.factors.len(), self.settings.tolerance, 0.0, restartable)
    }

    /// Returns true if contacts are held in a search: where bonds may break in it they must not be pulled.
    fn holds<const D: usize>(&self, system: &System<D>) -> bool
    where
        V: SearchVectors<D>,
    {
        V::HOLDS && !system.breaks_on_the_way()
    }

    /// Evaluates, and again if the fitted law had to be widened.
    fn evaluate_covered<const D: usize>(
        &mut self,
        system: &mut System<D>,
        state: &mut State<D>,
    ) -> Result<LinePoint, Error>
    where
        V: SearchVectors<D>,
    {
        let point = self.vectors.evaluate(system, state)?;
        if !point.sums.is_finite() {
            return Ok(point);
        }
        state.stretches.observe(point.observed);
        if system.widen(state)? { self.vectors.evaluate(system, state) } else { Ok(point) }
    }

    /// Computes the direction; returns the slope along it. Uses the remaining steepest descent if the memory
    /// gives no descent.
    fn direct<const D: usize>(&mut self) -> Result<f64, Error>
    where
        V: SearchVectors<D>,
    {
        let slope = self.vectors.direct()?;
        if slope < 0.0 && slope.is_finite() {
            return Ok(slope);
        }
        self.vectors.forget(true);
        self.vectors.direct_anew()
    }

    /// Searches along the direction from `start`, whose slope is `slope`, until the slope has fallen enough.
    fn search<const D: usize>(
        &mut self,
        system: &mut System<D>,
        state: &mut State<D>,
        start: &LinePoint,
        slope: f64,
    ) -> Result<LineSearch, Error>
    where
        V: SearchVectors<D>,
    {
        let [least, most] = allowed(start.observed);
        let longest = self.vectors.longest_step(system, state, most)?;
        // the slope is too steep below `low`; above `high` it has turned, or the body is torn
        let (mut low, mut low_slope, mut high) = (0.0, slope, f64::INFINITY);
        let (mut at, mut step) = (0.0, longest.min(1.0));
        for trial in 0..TRIALS {
            self.vectors.step(state, step - at);
            at = step;
            let rough = self.vectors.evaluate(system, state)?;
            let torn = !rough.sums.is_finite() || rough.observed.low < least || rough.observed.high > most;
            if torn {
                high = step;
                let excess = excess(start.observed, rough.observed);
                step = low + (high - low) * (1.0 / excess).clamp(1e-6, 0.5);
                continue;
            }
            state.stretches.observe(rough.observed);
            let point = if system.widen(state)? { self.vectors.evaluate(system, state)? } else { rough };
            if point.sums.residual(state.convergence.floor) <= self.settings.tolerance
                || point.slope.abs() <= SLOPE * slope.abs()
            {
                return Ok(LineSearch::Found(step, point));
            }
            let change = point.slope - low_slope;
            let secant = if change > 0.0 { low - low_slope * (step - low) / change } else { f64::INFINITY };
            if point.slope > 0.0 {
                high = step;
                step = secant.clamp(low + DECAY * (high - low), high - DECAY * (high - low));
            } else {
                // hardly any curvature so far: farther, unless the step is limited or long enough
                if high.is_finite() || trial > 2 || step >= longest {
                    return Ok(LineSearch::Found(step, point));
                }
                (low, low_slope) = (step, point.slope);
                step = secant.clamp(1.5 * step, GROWTH * step).min(longest);
            }
        }
        self.vectors.step(state, -at);
        Ok(LineSearch::Failed)
    }

    /// Runs one iteration from `point`; returns the next iterate, `None` if no direction gave a descent.
    fn iterate<const D: usize>(
        &mut self,
        system: &mut System<D>,
        state: &mut State<D>,
        point: &LinePoint,
    ) -> Result<Option<LinePoint>, Error>
    where
        V: SearchVectors<D>,
    {
        let slope = self.direct()?;
        if slope == 0.0 || !slope.is_finite() {
            return Ok(None);
        }
        match self.search(system, state, point, slope)? {
            LineSearch::Found(step, point) => {
                self.vectors.accept(step, CURVATURE * step * slope.abs())?;
                Ok(Some(point))
            }
            LineSearch::Failed => Ok(None),
        }
    }

    /// Returns true if a tenth of the faces in contact with rigid surfaces, or of their slips, have changed
    /// since the preconditioner was built.
    fn others_touch<const D: usize>(&self, system: &System<D>, state: &State<D>) -> Result<bool, Error>
    where
        V: SearchVectors<D>,
    {
        if system.repulsion().is_none_or(|contact| !contact.has_surfaces()) {
            return Ok(false);
        }
        let now = self.vectors.in_touch(system, state)?;
        let kept = now.iter().filter(|face| self.in_touch.binary_search(face).is_ok()).count();
        Ok(10 * (now.len() + self.in_touch.len() - 2 * kept) > now.len().max(1))
    }

    /// Computes forces and gradient of an iterate that no search produced.
    fn arrive<const D: usize>(
        &mut self,
        system: &mut System<D>,
        state: &mut State<D>,
    ) -> Result<LinePoint, Error>
    where
        V: SearchVectors<D>,
    {
        let point = self.evaluate_covered(system, state)?;
        self.vectors.arrive();
        if !point.sums.is_finite() {
            self.vectors.give(system, state)?;
            return Err(system.not_finite(state));
        }
        Ok(point)
    }

    /// Iterates until the forces balance.
    fn find_balance<const D: usize>(
        &mut self,
        system: &mut System<D>,
        state: &mut State<D>,
        watch: &mut Watch<D>,
    ) -> Result<LinePoint, Error>
    where
        V: SearchVectors<D>,
    {
        let goal = self.settings.goal();
        // since the preconditioner was built, where a run may begin
        let mut before = state.counts.total_iterations;
        let mut point = self.arrive(system, state)?;
        let mut broken = false;
        loop {
            let measured = state.measures_rounding().then(|| self.vectors.rounding(system, state));
            let (moved, epsilon) = measured.transpose()?.unzip();
            state.record_measured(system, &point.sums, &goal, (epsilon.unwrap_or(0.0), moved));
            let spent = state.counts.iteration >= goal.max_iterations;
            if system.release_contacts(state, goal.tolerance.max(state.contact.loose), spent) {
                self.vectors.forget(false);
                if self.others_touch(system, state)? {
                    self.begin(system, state, watch)?;
                    before = state.counts.total_iterations;
                }
                point = self.arrive(system, state)?;
                continue;
            }
            if state.is_balanced(&goal, broken)? {
                let took = state.counts.total_iterations - before;
                self.first = if self.searches == 0 { took } else { self.first };
                self.searches += 1;
                self.worn = took > WORN_GROWTH * self.first.max(FEW);
                return Ok(point);
            }
            broken = false;
            let next = self.iterate(system, state, &point)?;
            state.counts.iterate();
            if let Some(next) = next {
                point = next;
            } else {
                self.vectors.simplify();
                point = self.arrive(system, state)?;
            }
            if system.breaks_on_the_way() && system.is_overstretched(point.observed) {
                self.vectors.give(system, state)?;
                let sites = system.break_bonds(state);
                broken = !sites.is_empty();
                if broken {
                    self.bonds_broke(system, &sites);
                    system.refuse_unsupported(state, self.settings.tolerance)?;
                    point = self.arrive(system, state)?;
                }
            }
            watch(&self.status(system, state, false), state)?;
            let others_touch =
                state.counts.iteration.is_multiple_of(TOUCHES) && self.others_touch(system, state)?;
            if state.counts.iteration.is_multiple_of(ITERATIONS) || others_touch {
                self.vectors.give(system, state)?;
                self.begin(system, state, watch)?;
                self.vectors.take(system, state)?;
                before = state.counts.total_iterations;
                point = self.arrive(system, state)?;
            }
        }
    }
}

impl<const D: usize, V: SearchVectors<D>> Equilibrium<D> for LbfgsSearch<V> {
    fn equilibrate(
        &mut self,
        system: &mut System<D>,
        state: &mut State<D>,
        watch: &mut Watch<D>,
    ) -> Result<Option<StretchRange>, Error> {
        self.vectors.forget(false);
        // a run can be interrupted where it is built
        // small steps between which bonds break leave the body nearly unchanged; contact and large steps do
        // not
        let kept = system.breaking.is_some() && system.repulsion().is_none();
        let fresh = state.control.round == 0
            && state.contact.renewals == 0
            && (!kept || state.step.is_multiple_of(STEPS));
        let due = fresh || self.worn || self.searches >= SEARCHES;
        if !self.vectors.is_built() || (state.counts.iteration == 0 && due) {
            self.begin(system, state, watch)?;
        }
        self.vectors.take(system, state)?;
        if self.holds(system) {
            system.hold_contacts(state);
        }
        let found = self.find_balance(system, state, watch);
        if let Some(contact) = &mut system.contact {
            contact.set_held(&[]);
        }
        if matches!(found, Ok(_) | Err(Error::NotConverged { .. })) {
            self.vectors.give(system, state)?;
        }
        found.map(|point| Some(point.observed))
    }

    fn bonds_broke(&mut self, system: &System<D>, sites: &[u32]) {
        self.vectors.bonds_broke(system, sites);
        self.vectors.forget(false);
    }

    fn tolerance(&self) -> f64 {
        self.settings.tolerance
    }
}

/// Faces in contact with rigid surfaces, and which of them slip.
fn in_touch<const D: usize>(system: &System<D>, state: &State<D>) -> Vec<[u32; 3]> {
    system.repulsion().map_or_else(Vec::new, |contact| contact.in_touch(&state.displacement))
}

/// Range of stretches allowed in one step, as e = λ² − 1.
fn allowed(observed: StretchRange) -> [f64; 2] {
    let [low, high] = [observed.low, observed.high].map(|e| (1.0 + e).max(0.0).sqrt());
    [(CRUSH * low).powi(2) - 1.0, (high + STRETCH * high.max(1.0)).powi(2) - 1.0]
}

/// Ratio of the change of stretches to the allowed change.
fn excess(start: StretchRange, observed: StretchRange) -> f64 {
    let root = |e: f64| (1.0 + e).max(0.0).sqrt();
    let far = (root(observed.high) - root(start.high)) / (STRETCH * root(start.high).max(1.0));
    if far.is_finite() { far.max(2.0) } else { 10.0 }
}
