//! Rows of a run's history, and what is shown of an iteration.

use super::scale::Balance;
use crate::contact::{ContactSummary, PlaneReaction};
use serde::{Deserialize, Serialize};

/// One load step in equilibrium.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Load factor.
    pub factor: f64,
    /// Force, N, that does the loads' work on `displacement`, see
    /// [`Loads::response`](super::Loads::response).
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
    pub contact: Option<ContactSummary>,
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
    pub resting: Vec<PlaneReaction>,
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
