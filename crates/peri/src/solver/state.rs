//! Where a solution is: everything a checkpoint holds of it.

use super::motion::Motion;
use super::scale::Balance;
use crate::bonds::{Bonds, Softened};
use crate::contact::{Grip, Resting, Touching};
use crate::error::Error;
use crate::field::Field;
use crate::potential::StretchRange;
use serde::{Deserialize, Serialize};

/// One load step in equilibrium.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Load factor.
    pub factor: f64,
    /// Force, N, that does the loads' work on `displacement`, see [`Loads::response`](super::Loads::response).
    pub load: f64,
    /// Displacement of the grips against each other, or of where forces act, m.
    pub displacement: f64,
    /// Reaction on each region of prescribed displacement, N.
    pub reactions: Vec<[f64; 3]>,
    /// Out-of-balance force over its reference.
    pub residual: f64,
    /// Iterations of this step.
    pub iterations: u64,
    /// Equilibria sought: 1, and one more for each time that bonds broke.
    pub rounds: u64,
    /// Bonds broken so far.
    pub broken: u64,
    /// Particles that have lost all their bonds so far.
    pub detached: u64,
    /// Energy stored in bonds and contact, J.
    pub stored: f64,
    /// Sums of all forces and moments.
    pub balance: Balance,
    /// What touches, where that is looked at.
    pub contact: Option<Touching>,
    /// Work of the loads so far, J.
    pub work: f64,
    /// Energy of broken bonds when they broke, J.
    pub released: f64,
    /// Smallest and largest stretch of intact bonds.
    pub smallest_stretch: f64,
    /// See `smallest_stretch`.
    pub largest_stretch: f64,
    /// Time, s; 0 without dynamics.
    pub time: f64,
    /// Kinetic energy, J.
    pub kinetic: f64,
    /// Energy that mass-proportional damping has taken so far, J.
    pub damped: f64,
    /// Energy that friction has taken so far, J.
    pub rubbed: f64,
    /// How the body rests on each rigid plane.
    pub resting: Vec<Resting>,
    /// What [`System::observer`](super::System::observer) sees.
    pub seen: Vec<f64>,
}

/// A scalar of a step: name, unit, value.
type Scalar = (&'static str, &'static str, fn(&Record) -> f64);

impl Record {
    /// The scalars that every step has.
    pub const SCALARS: [Scalar; 12] = [
        ("displacement", "m", |record| record.displacement),
        ("load", "N", |record| record.load),
        ("factor", "", |record| record.factor),
        ("time", "s", |record| record.time),
        ("broken_bonds", "", |record| record.broken as f64),
        ("largest_stretch", "", |record| record.largest_stretch),
        ("stored", "J", |record| record.stored),
        ("work", "J", |record| record.work),
        ("released", "J", |record| record.released),
        ("kinetic", "J", |record| record.kinetic),
        ("out_of_balance", "", |record| record.residual),
        ("iterations", "", |record| record.iterations as f64),
    ];
}

/// Bonds that broke together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Load step, from 0.
    pub step: usize,
    /// How many.
    pub bonds: u64,
    /// Which ones, as a number: two sets of bonds of one body that differ have different ones.
    pub fingerprint: u64,
    /// Load of the equilibrium before, N, see [`Record::load`]; 0 in dynamics.
    pub load: f64,
}

/// Everything an interrupted run needs to continue with the same bits.
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
    /// Whether this step's first guess is made.
    pub(super) predicted: bool,
    /// Equilibria found in this step.
    pub round: u64,
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
    /// Stretches [λ_low, λ_high] that the fitted law covers.
    pub fitted: [f64; 2],
    /// Stretches observed, as e = λ² − 1.
    pub observed: StretchRange,
    /// Stretches at the last equilibrium.
    pub(super) balanced_stretches: StretchRange,
    /// Largest relative bond tangent max(|t′|, |t|/λ) kθ over the fitted stretches.
    pub(super) tangent: f64,
    /// Greatest reference force of an equilibrium.
    pub(super) reference: f64,
    /// Reference force of the last iterate alone, and what it is at least.
    pub(super) present: f64,
    pub(super) floor: f64,
    /// Displacements of the two equilibria before the last, where no bond has broken since.
    pub(super) past: Vec<Field<D>>,
    /// Residual of the last iteration.
    pub residual: f64,
    /// Searches for equilibrium that ended above the tolerance.
    pub unconverged: u64,
    /// Bonds broken so far.
    pub broken: u64,
    /// When they broke.
    pub events: Vec<Event>,
    /// Particles that have lost all their bonds so far.
    pub detached: u64,
    /// Energy of broken bonds when they broke, and what softening took, J.
    pub released: f64,
    /// Work of the loads so far, J.
    pub work: f64,
    /// Factor, and the loads' conjugate sums, at the last equilibrium.
    pub(super) balanced: [f64; 3],
    /// Intact bonds, once any has broken.
    pub(super) intact: Option<Vec<u64>>,
    /// Bonds that bear a part of what they bore.
    pub softened: Vec<Softened>,
    /// Force densities of friction, a part of `force`, where anything rubs in dynamics …
    pub(super) friction: Option<Field<D>>,
    /// … and of it the force of each plane, N.
    pub(super) rubbing: Vec<[f64; 3]>,
    /// Displacement at the start of the load step, where anything rubs between equilibria.
    pub(super) started: Option<Field<D>>,
    /// Friction after the last step, friction in force towards the current equilibrium, and how often it has been renewed in this step.
    pub(super) grips: Vec<Grip>,
    pub(super) held: Vec<Grip>,
    pub(super) renewals: u32,
    /// Force of each plane, N, where one moves.
    pub(super) pushing: Vec<[f64; 3]>,
    /// Time and energies of explicit dynamics.
    pub motion: Motion,
    /// Load factors of all steps, where steps have been cut …
    pub(super) factors: Vec<f64>,
    /// … which of them nobody has prescribed, and how often the present one has been.
    pub(super) inserted: Vec<usize>,
    pub(super) cuts: u32,
    /// Factor and largest stretch of the equilibrium from which the load was lowered, see [`System::snap_back`](super::System::snap_back).
    pub(super) lowered: Option<[f64; 2]>,
    /// The last finished step under given forces, which may tear the body apart.
    pub(super) accepted: Option<Box<Accepted<D>>>,
    /// The finished steps.
    pub history: Vec<Record>,
}

/// A finished step, as far as the history does not have it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub(super) struct Accepted<const D: usize> {
    displacement: Field<D>,
    force: Field<D>,
    intact: Option<Vec<u64>>,
    softened: Vec<Softened>,
    events: usize,
    stretches: StretchRange,
}

impl<const D: usize> State<D> {
    /// The undeformed body.
    pub fn new(sites: usize) -> Self {
        Self {
            displacement: Field::zeros(sites),
            velocity: Field::zeros(sites),
            force: Field::zeros(sites),
            step: 0,
            predicted: false,
            round: 0,
            iteration: 0,
            step_iterations: 0,
            total_iterations: 0,
            evaluations: 0,
            bond_evaluations: 0,
            fitted: [0.95, 1.05],
            observed: StretchRange::REST,
            balanced_stretches: StretchRange::REST,
            tangent: 0.0,
            reference: 0.0,
            present: 0.0,
            floor: 0.0,
            past: Vec::new(),
            residual: 0.0,
            unconverged: 0,
            broken: 0,
            events: Vec::new(),
            detached: 0,
            released: 0.0,
            work: 0.0,
            balanced: [0.0; 3],
            intact: None,
            softened: Vec::new(),
            friction: None,
            rubbing: Vec::new(),
            started: None,
            grips: Vec::new(),
            held: Vec::new(),
            renewals: 0,
            pushing: Vec::new(),
            motion: Motion::default(),
            factors: Vec::new(),
            inserted: Vec::new(),
            cuts: 0,
            lowered: None,
            accepted: None,
            history: Vec::new(),
        }
    }
}

impl<const D: usize> State<D> {
    /// Keeps a finished step, see [`Self::retreat`].
    pub(super) fn accept(&mut self) {
        self.accepted = Some(Box::new(Accepted {
            displacement: self.displacement.clone(),
            force: self.force.clone(),
            intact: self.intact.clone(),
            softened: self.softened.clone(),
            events: self.events.len(),
            stretches: self.balanced_stretches,
        }));
    }

    /// Goes back to the last finished step, or to the undeformed body; counts of work stay. Bonds are another's: see [`Self::sever`].
    pub(super) fn retreat(&mut self) {
        let sites = self.displacement.sites();
        let accepted = self.accepted.take().map_or_else(
            || Accepted {
                displacement: Field::zeros(sites),
                force: Field::zeros(sites),
                intact: None,
                softened: Vec::new(),
                events: 0,
                stretches: StretchRange::REST,
            },
            |accepted| *accepted,
        );
        (self.displacement, self.force) = (accepted.displacement, accepted.force);
        (self.intact, self.softened) = (accepted.intact, accepted.softened);
        self.balanced_stretches = accepted.stretches;
        self.velocity = Field::zeros(sites);
        self.events.truncate(accepted.events);
        let last = self.history.last();
        self.broken = last.map_or(0, |row| row.broken);
        self.detached = last.map_or(0, |row| row.detached);
        self.released = last.map_or(0.0, |row| row.released);
        self.work = last.map_or(0.0, |row| row.work);
        (self.predicted, self.round, self.iteration, self.step_iterations) = (false, 0, 0, 0);
    }

    /// Severs and softens the bonds of a body as it was built as they are in this state.
    ///
    /// # Errors
    /// [`Error::Geometry`] for another body.
    pub fn sever(&self, bonds: &mut dyn Bonds<D>) -> Result<(), Error> {
        if let Some(words) = &self.intact
            && !bonds.restore(words)
        {
            let found = format!("a state of {} words of bonds, which is another body's", words.len());
            return Err(Error::geometry(found));
        }
        if !self.softened.is_empty() {
            bonds.soften(self.softened.clone());
        }
        Ok(())
    }
}

/// One iteration, for progress bars and logs.
#[derive(Clone, Copy, Debug)]
pub struct Status {
    /// Load step, from 0.
    pub step: usize,
    /// Load steps in all.
    pub steps: usize,
    /// Iteration towards the current equilibrium.
    pub iteration: u64,
    /// Out-of-balance force over its reference.
    pub residual: f64,
    /// The tolerance on it.
    pub tolerance: f64,
    /// Load of the last step that is finished, N.
    pub load: Option<f64>,
    /// Damping coefficient used.
    pub damping: f64,
    /// Bonds broken so far.
    pub broken: u64,
    /// Whether the state may be saved here: a run that begins from it takes the same way.
    pub restartable: bool,
}

/// Sees every iteration, and may stop the run by an error.
pub type Watch<'a, const D: usize> = dyn FnMut(&Status, &State<D>) -> Result<(), Error> + 'a;
