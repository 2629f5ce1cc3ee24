//! Limited-memory BFGS on the body's energy, from gradients only, with a two-level preconditioner: Nocedal &
//! Wright, Numerical Optimization (2006), §7.2; the step ends where the slope along the direction has fallen
//! enough (the curvature condition), found by secants.

use super::balance::SearchLimits;
use super::lbfgs_memory::LbfgsMemory;
use super::load_stepping::{Equilibrium, QuasiStatic};
use super::method::Watch;
use super::particle_map::ParticleMap;
use super::passes::{ForceSums, gradient_pass};
use super::preconditioner::Preconditioner;
use super::record::Status;
use super::state::State;
use super::system::System;
use crate::bonds::{StretchRange, stretch_range};
use crate::contact::Contact;
use crate::error::Error;
use crate::field::Field;

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

/// Largest change of a bond over its length in a step with softening bonds, so that none jumps over its
/// energy's maximum.
const LARGEST_CHANGE: f64 = 0.3;
/// Scale at which a direction exceeds the bonds by far; a power of 2, so that nothing is rounded.
const HUGE_SCALE: f64 = (1_u64 << 40) as f64;

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
    /// would become too large.
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

/// Solver of [`Lbfgs`].
pub struct LbfgsSolver<const D: usize> {
    settings: Lbfgs,
    preconditioner: Preconditioner<D>,
    memory: LbfgsMemory<D>,
    /// Positions of particles in storage: all fields below are over particles.
    places: ParticleMap,
    /// Gradients −V F of the energy at the iterate and at the trial, 0 where constrained.
    gradient: Field<D>,
    trial: Field<D>,
    /// z = B g at both.
    image: Field<D>,
    trial_image: Field<D>,
    direction: Field<D>,
    /// True if the coarse level is left out because it gave no descent direction.
    local_only: bool,
    /// Searches with this preconditioner, iterations of the first of them, and whether the last took too
    /// many.
    searches: u64,
    first: u64,
    worn: bool,
    /// Faces in contact with planes when the preconditioner was built.
    in_touch: Vec<[u32; 2]>,
}

/// A point along a search direction.
#[derive(Clone, Copy)]
struct LinePoint {
    sums: ForceSums,
    observed: StretchRange,
    /// Derivative of the energy along the direction.
    slope: f64,
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
        Self {
            settings,
            preconditioner: Preconditioner::new(),
            memory: LbfgsMemory::new(settings.memory),
            places: ParticleMap::default(),
            gradient: Field::zeros(0),
            trial: Field::zeros(0),
            image: Field::zeros(0),
            trial_image: Field::zeros(0),
            direction: Field::zeros(0),
            local_only: false,
            searches: 0,
            first: 0,
            worn: false,
            in_touch: Vec::new(),
        }
    }

    /// Degrees of freedom of the coarse level and entries of its factors.
    pub fn coarse_size(&self) -> [usize; 2] {
        self.preconditioner.coarse_size()
    }

    /// Builds the preconditioner for the present state and forgets everything else: a run that begins with
    /// this state takes the same steps.
    fn begin(
        &mut self,
        system: &mut System<D>,
        state: &mut State<D>,
        watch: &mut Watch<D>,
    ) -> Result<(), Error> {
        watch(&self.status(system, state, true), state)?;
        system.prepare(&mut state.displacement);
        let particles = system.bonds.particles().len();
        let fields = [
            &mut self.gradient,
            &mut self.trial,
            &mut self.image,
            &mut self.trial_image,
            &mut self.direction,
        ];
        if fields[0].sites() != particles {
            fields.into_iter().for_each(|field| *field = Field::zeros(particles));
            self.places = ParticleMap::new(&*system.bonds, &system.loads);
        }
        self.memory.clear(true);
        self.local_only = false;
        (self.searches, self.first, self.worn) = (0, 0, false);
        self.in_touch = in_touch(system, state);
        self.preconditioner.build(system, state, self.settings.weight, self.settings.coarsening.max(2.0));
        Ok(())
    }

    fn status(&self, system: &System<D>, state: &State<D>, restartable: bool) -> Status {
        state.status(system.factors.len(), self.settings.tolerance, 0.0, restartable)
    }

    /// Computes forces at the present displacement; their gradient goes to `self.trial`.
    fn evaluate(&mut self, system: &mut System<D>, state: &mut State<D>) -> LinePoint {
        let factor = system.loads.force_factor(system.factors[state.step]);
        system.prepare(&mut state.displacement);
        system.follow(&state.displacement);
        let body = (&self.places, self.preconditioner.volumes());
        let (sums, observed, slope) =
            gradient_pass(system, state, body, &self.direction, factor, &mut self.trial);
        system.count_evaluation(state);
        LinePoint { sums, observed, slope }
    }

    /// Evaluates, and again if the fitted law had to be widened.
    fn evaluate_covered(&mut self, system: &mut System<D>, state: &mut State<D>) -> Result<LinePoint, Error> {
        let point = self.evaluate(system, state);
        if !point.sums.is_finite() {
            return Ok(point);
        }
        state.stretches.observe(point.observed);
        Ok(if system.widen(state)? { self.evaluate(system, state) } else { point })
    }

    /// u += step·d.
    fn step(&self, state: &mut State<D>, step: f64) {
        self.places.add_scaled(&mut state.displacement, step, &self.direction);
    }

    /// Computes z = B g of the trial and the direction from it; returns the slope along it. Uses the
    /// remaining steepest descent if the memory gives no descent.
    fn direct(&mut self) -> f64 {
        let slope = self.memory.direction(&self.gradient, &self.image, &mut self.direction);
        if slope < 0.0 && slope.is_finite() {
            return slope;
        }
        self.memory.clear(true);
        self.preconditioner.apply(&self.places, &self.gradient, &mut self.image, self.local_only);
        self.memory.direction(&self.gradient, &self.image, &mut self.direction)
    }

    /// Searches along the direction from `start`, whose slope is `slope`, until the slope has fallen enough.
    fn search(
        &mut self,
        system: &mut System<D>,
        state: &mut State<D>,
        start: &LinePoint,
        slope: f64,
    ) -> Result<LineSearch, Error> {
        let [least, most] = allowed(start.observed);
        let longest = self.longest_step(system, state, most);
        // the slope is too steep below `low`; above `high` it has turned, or the body is torn
        let (mut low, mut low_slope, mut high) = (0.0, slope, f64::INFINITY);
        let (mut at, mut step) = (0.0, longest.min(1.0));
        for trial in 0..TRIALS {
            self.step(state, step - at);
            at = step;
            let rough = self.evaluate(system, state);
            let torn = !rough.sums.is_finite() || rough.observed.low < least || rough.observed.high > most;
            if torn {
                high = step;
                let excess = excess(start.observed, rough.observed);
                step = low + (high - low) * (1.0 / excess).clamp(1e-6, 0.5);
                continue;
            }
            state.stretches.observe(rough.observed);
            let point = if system.widen(state)? { self.evaluate(system, state) } else { rough };
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
        self.step(state, -at);
        Ok(LineSearch::Failed)
    }

    /// Longest step along the direction if bonds soften at stretches up to e = `most`, or particles are in
    /// contact: the energy is not convex there.
    fn longest_step(&mut self, system: &System<D>, state: &State<D>, most: f64) -> f64 {
        let softens = system.material.softens_at((1.0 + most).sqrt());
        if !softens && system.repulsion().is_none() {
            return f64::INFINITY;
        }
        let spread = |factor: f64| {
            let mut field = Field::zeros(state.displacement.sites());
            self.places.add_scaled(&mut field, factor, &self.direction);
            field
        };
        let touching =
            |contact: &Contact<D>| contact.longest_step(&*system.bonds, &state.displacement, &spread(1.0));
        let longest = system.repulsion().map_or(f64::INFINITY, touching);
        if !softens {
            return longest;
        }
        let range = stretch_range(&*system.bonds, &spread(HUGE_SCALE));
        (LARGEST_CHANGE * HUGE_SCALE / (1.0 + range.high).sqrt()).min(longest)
    }

    /// Runs one iteration from `point`; returns the next iterate, `None` if no direction gave a descent.
    fn iterate(
        &mut self,
        system: &mut System<D>,
        state: &mut State<D>,
        point: &LinePoint,
    ) -> Result<Option<LinePoint>, Error> {
        let slope = self.direct();
        if slope == 0.0 || !slope.is_finite() {
            return Ok(None);
        }
        match self.search(system, state, point, slope)? {
            LineSearch::Found(step, point) => {
                std::mem::swap(&mut self.gradient, &mut self.trial);
                self.preconditioner.apply(
                    &self.places,
                    &self.gradient,
                    &mut self.trial_image,
                    self.local_only,
                );
                self.memory.add(
                    step,
                    &self.direction,
                    (&self.trial, &self.image),
                    (&self.gradient, &self.trial_image),
                    CURVATURE * step * slope.abs(),
                );
                std::mem::swap(&mut self.image, &mut self.trial_image);
                Ok(Some(point))
            }
            LineSearch::Failed => Ok(None),
        }
    }

    /// Simplifies after a failed search: clears the memory, then drops the coarse level; then starts again.
    fn simplify(&mut self) {
        self.local_only = self.memory.is_empty() && !self.local_only;
        self.memory.clear(true);
    }

    /// Returns true if a tenth of the faces in contact with planes have changed since the preconditioner was
    /// built.
    fn others_touch(&self, system: &System<D>, state: &State<D>) -> bool {
        if system.repulsion().is_none_or(|contact| !contact.has_surfaces()) {
            return false;
        }
        let now = in_touch(system, state);
        let kept = now.iter().filter(|face| self.in_touch.binary_search(face).is_ok()).count();
        10 * (now.len() + self.in_touch.len() - 2 * kept) > now.len().max(1)
    }

    /// Computes forces and gradient of an iterate that no search produced.
    fn arrive(&mut self, system: &mut System<D>, state: &mut State<D>) -> Result<LinePoint, Error> {
        let point = self.evaluate_covered(system, state)?;
        if !point.sums.is_finite() {
            return Err(system.not_finite(state));
        }
        std::mem::swap(&mut self.gradient, &mut self.trial);
        self.preconditioner.apply(&self.places, &self.gradient, &mut self.image, self.local_only);
        Ok(point)
    }
}

impl<const D: usize> Equilibrium<D> for LbfgsSolver<D> {
    fn equilibrate(
        &mut self,
        system: &mut System<D>,
        state: &mut State<D>,
        watch: &mut Watch<D>,
    ) -> Result<Option<StretchRange>, Error> {
        let goal = self.settings.goal();
        self.memory.clear(false);
        // a run can be interrupted where it is built
        // small steps between which bonds break leave the body nearly unchanged; contact and large steps do
        // not
        let kept = system.breaking.is_some() && system.repulsion().is_none();
        let fresh = state.control.round == 0
            && state.contact.renewals == 0
            && (!kept || state.step.is_multiple_of(STEPS));
        let due = fresh || self.worn || self.searches >= SEARCHES;
        if !self.preconditioner.is_built() || (state.counts.iteration == 0 && due) {
            self.begin(system, state, watch)?;
        }
        let before = state.counts.total_iterations;
        let mut point = self.arrive(system, state)?;
        let mut broken = false;
        loop {
            state.record_sums(system, &point.sums, &goal);
            if state.is_balanced(&goal, broken)? {
                let took = state.counts.total_iterations - before;
                self.first = if self.searches == 0 { took } else { self.first };
                self.searches += 1;
                self.worn = took > WORN_GROWTH * self.first.max(FEW);
                return Ok(Some(point.observed));
            }
            broken = false;
            let next = self.iterate(system, state, &point)?;
            state.counts.iterate();
            if let Some(next) = next {
                point = next;
            } else {
                self.simplify();
                point = self.arrive(system, state)?;
            }
            if system.breaks_on_the_way() && system.is_overstretched(point.observed) {
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
                state.counts.iteration.is_multiple_of(TOUCHES) && self.others_touch(system, state);
            if state.counts.iteration.is_multiple_of(ITERATIONS) || others_touch {
                self.begin(system, state, watch)?;
                point = self.arrive(system, state)?;
            }
        }
    }

    fn bonds_broke(&mut self, system: &System<D>, sites: &[u32]) {
        self.preconditioner.bonds_broke(&*system.bonds, sites);
        self.memory.clear(false);
    }

    fn tolerance(&self) -> f64 {
        self.settings.tolerance
    }
}

/// Faces in contact with planes.
fn in_touch<const D: usize>(system: &System<D>, state: &State<D>) -> Vec<[u32; 2]> {
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
