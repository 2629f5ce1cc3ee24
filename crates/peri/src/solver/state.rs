//! State of a solution: the content of its checkpoints.

use super::fracture::Fracture;
use super::motion::Motion;
use super::record::{Status, StepRecord};
use super::stage::StepOrigin;
use super::step_control::{Accepted, StepControl};
use crate::contact::{ContactPair, Flight, FrictionPair};
use crate::field::Field;
use crate::material::Memory;
use crate::potential::StretchRange;
use serde::{Deserialize, Serialize};

/// State that an interrupted run needs to continue with the same bits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct State<const D: usize> {
    /// Displacement, m.
    pub displacement: Field<D>,
    /// Velocity, m per (fictitious) second.
    pub velocity: Field<D>,
    /// Force density with loads, N/m³: out of balance where free, reaction where constrained.
    pub force: Field<D>,
    /// Load steps finished.
    pub step: usize,
    /// Work of the solution.
    pub counts: Counts,
    /// Stretches of the body, and of the fitted law.
    pub stretches: BodyStretches,
    /// Out-of-balance forces and their references.
    pub convergence: ForceResiduals,
    /// Broken and softened bonds.
    pub fracture: Fracture,
    /// Histories of the particles.
    pub memory: Memory,
    /// Friction and moving planes.
    pub(super) contact: ContactState<D>,
    /// Load steps and their cuts.
    pub control: StepControl<D>,
    /// Time and energies of explicit dynamics.
    pub motion: Motion,
    /// Start of the present step of a programme.
    pub stage: StepOrigin<D>,
    /// Work of the loads so far, J.
    pub work: f64,
    /// Finished steps.
    pub history: Vec<StepRecord>,
}

/// Counts of iterations and evaluations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Counts {
    /// Iterations towards the current equilibrium.
    pub iteration: u64,
    /// Iterations of the current step.
    pub step_iterations: u64,
    /// Iterations of all steps.
    pub total_iterations: u64,
    /// Force evaluations so far.
    pub evaluations: u64,
    /// Bond evaluations so far: intact directed bonds at each force evaluation.
    pub bond_evaluations: u64,
    /// Searches for equilibrium that ended above the tolerance.
    pub unconverged: u64,
}

impl Counts {
    /// Counts an iteration.
    pub(super) fn iterate(&mut self) {
        self.iteration += 1;
        self.step_iterations += 1;
        self.total_iterations += 1;
    }
}

/// Stretches of a body, as e = λ² − 1, and those of the fitted law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyStretches {
    /// Stretches [λ_low, λ_high] that the fitted law covers.
    pub fitted: [f64; 2],
    /// Stretches observed so far.
    pub observed: StretchRange,
    /// Stretches at the last equilibrium.
    pub(super) balanced: StretchRange,
    /// Largest relative bond tangent max(|t′|, |t|/λ) kθ over the fitted stretches.
    pub(super) tangent: f64,
}

impl BodyStretches {
    /// Records observed stretches.
    pub(super) fn observe(&mut self, observed: StretchRange) {
        self.observed = self.observed.join(observed);
    }

    /// Widens the fitted range within `[least, most]` if stretches have left it; returns whether they had.
    pub(super) fn widen(&mut self, [least, most]: [f64; 2]) -> bool {
        // bonds crushed below that are extrapolated: no fit covers l → 0
        let low = (1.0 + self.observed.low).max(0.0).sqrt().max(least);
        let high = (1.0 + self.observed.high).sqrt().min(most);
        if low >= self.fitted[0] && high <= self.fitted[1] {
            return false;
        }
        // twice the strain observed, so that a growing load does not refit at every check
        self.fitted[0] = self.fitted[0].min((1.0 - 2.0 * (1.0 - low)).max(0.5 * low)).max(least);
        self.fitted[1] = self.fitted[1].max(1.0 + 2.0 * (high - 1.0)).min(most);
        true
    }

    /// Largest stretch at the last equilibrium.
    pub(super) fn largest(&self) -> f64 {
        (1.0 + self.balanced.high).sqrt()
    }
}

impl Default for BodyStretches {
    fn default() -> Self {
        Self {
            fitted: [0.95, 1.05],
            observed: StretchRange::REST,
            balanced: StretchRange::REST,
            tangent: 0.0,
        }
    }
}

/// Forces out of balance over their reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ForceResiduals {
    /// Residual of the last iteration.
    pub residual: f64,
    /// Greatest reference force of an equilibrium.
    pub(super) reference: f64,
    /// Reference force of the last iterate only.
    pub(super) present: f64,
    /// Least reference force.
    pub(super) floor: f64,
}

/// Friction and rigid surfaces of a state.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub(super) struct ContactState<const D: usize> {
    /// Force densities of friction in explicit dynamics, a part of [`State::force`], N/m³.
    pub friction: Option<Field<D>>,
    /// Friction of each rigid surface, N.
    pub surface_friction: Vec<[f64; 3]>,
    /// Force of each rigid surface, N, if any moves.
    pub surface_push: Vec<[f64; 3]>,
    /// Motion of rigid surfaces with a mass, in the order of all; empty without any.
    pub flights: Vec<Flight>,
    /// Displacement at the start of the load step, with friction between equilibria.
    pub start: Option<Field<D>>,
    /// Friction after the last step.
    pub grips: Vec<FrictionPair>,
    /// Active friction in the search for the current equilibrium, and its number of renewals in this step.
    pub active: Vec<FrictionPair>,
    pub renewals: u32,
    /// Residual at which a search ends whose friction is not final.
    pub loose: f64,
    /// Pairs held by rigid surfaces in the search for the current equilibrium, the residual at which those
    /// that pull are released (0: not set), and the number of releases in this search.
    pub held: Vec<ContactPair>,
    pub release_at: f64,
    pub releases: u32,
}

impl<const D: usize> ContactState<D> {
    /// Begins the next step of a programme: elastic slips stay.
    pub fn begin_stage(&mut self) {
        (self.friction, self.start, self.renewals) = (None, None, 0);
        (self.active, self.surface_push, self.held) = (Vec::new(), Vec::new(), Vec::new());
    }
}

impl<const D: usize> State<D> {
    /// Creates the state of an undeformed body.
    pub fn new(sites: usize) -> Self {
        let [displacement, velocity, force] = [(); 3].map(|()| Field::zeros(sites));
        Self {
            displacement,
            velocity,
            force,
            step: 0,
            counts: Counts::default(),
            stretches: BodyStretches::default(),
            convergence: ForceResiduals::default(),
            fracture: Fracture::default(),
            memory: Memory::default(),
            contact: ContactState::default(),
            control: StepControl::default(),
            motion: Motion::default(),
            stage: StepOrigin::default(),
            work: 0.0,
            history: Vec::new(),
        }
    }

    /// Keeps a finished step for [`Self::retreat`].
    pub(super) fn accept(&mut self) {
        self.control.accepted = Some(Box::new(Accepted {
            displacement: self.displacement.clone(),
            force: self.force.clone(),
            fracture: self.fracture.clone(),
            stretches: self.stretches.balanced,
        }));
    }

    /// Returns to the last finished step, or to the undeformed body; counts of work stay. Bonds are restored
    /// by [`Fracture::restore`].
    pub(super) fn retreat(&mut self) {
        let zero = || Field::zeros(self.velocity.sites());
        let accepted = self.control.accepted.take().map_or_else(
            || Accepted {
                displacement: zero(),
                force: zero(),
                fracture: Fracture::default(),
                stretches: StretchRange::REST,
            },
            |accepted| *accepted,
        );
        self.velocity = zero();
        (self.displacement, self.force) = (accepted.displacement, accepted.force);
        (self.fracture, self.stretches.balanced) = (accepted.fracture, accepted.stretches);
        self.work = self.history.last().map_or(0.0, |row| row.work);
        // histories change at the end of a step only
        self.memory.dissipated = self.history.last().map_or(0.0, |row| row.dissipated);
        self.memory.duration = 0.0;
        (self.control.predicted, self.control.round) = (false, 0);
        (self.counts.iteration, self.counts.step_iterations) = (0, 0);
    }

    /// Status of an iteration in a run of `steps` steps.
    pub(super) fn status(&self, steps: usize, tolerance: f64, damping: f64, restartable: bool) -> Status {
        Status {
            step: self.step,
            steps,
            iteration: self.counts.iteration,
            residual: self.convergence.residual,
            tolerance,
            load: self.history.last().map(|record| record.load),
            damping,
            broken: self.fracture.broken,
            restartable,
        }
    }
}
