//! Rows of a run's history, and the status of an iteration.

use super::force_scale::Balance;
use crate::contact::{ContactSummary, SurfaceReaction};
use serde::{Deserialize, Serialize};

/// Row of the history: a load step in equilibrium, or a time of a dynamic solution.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepRecord {
    /// Load factor.
    pub factor: f64,
    /// Force, N, that does the loads' work on `displacement`, see
    /// [`Loads::response`](super::Loads::response).
    pub load: f64,
    /// Relative displacement of the grips, or of the points where forces act, m.
    pub displacement: f64,
    /// Reaction on each region of prescribed displacement, N.
    pub reactions: Vec<[f64; 3]>,
    /// Out-of-balance force over its reference.
    pub residual: f64,
    /// Iterations of this step.
    pub iterations: u64,
    /// Equilibria sought: 1, plus one for each time that bonds broke.
    pub rounds: u64,
    /// Bonds broken so far.
    pub broken: u64,
    /// Particles that have lost all their bonds so far.
    pub detached: u64,
    /// Energy stored in bonds and contact, J.
    pub stored: f64,
    /// Sums of all forces and moments.
    pub balance: Balance,
    /// Contacts, if any are tracked.
    pub contact: Option<ContactSummary>,
    /// Work of the loads so far, J.
    pub work: f64,
    /// Energy of broken bonds when they broke, J.
    pub released: f64,
    /// Energy dissipated by a law with a state so far, J, see [`Memory`](crate::material::Memory).
    pub dissipated: f64,
    /// Smallest stretch of intact bonds.
    pub smallest_stretch: f64,
    /// Largest stretch of intact bonds.
    pub largest_stretch: f64,
    /// Time, s; 0 in equilibria without a programme of times.
    pub time: f64,
    /// Kinetic energy, J.
    pub kinetic: f64,
    /// Energy dissipated by mass-proportional damping so far, J.
    pub damped: f64,
    /// Energy dissipated by friction so far, J.
    pub rubbed: f64,
    /// Contact with each rigid plane.
    pub resting: Vec<SurfaceReaction>,
    /// Values of [`System::observer`](super::System::observer).
    pub seen: Vec<f64>,
}

/// Scalar of a step: name, unit, value.
type RecordScalar = (&'static str, &'static str, fn(&StepRecord) -> f64);

impl StepRecord {
    /// Number of the row with the greatest load of either sign; the positive one of a cycle whose peaks are
    /// equal to 0.1 %.
    pub fn peak(history: &[Self]) -> Option<usize> {
        let by_load = |&a: &usize, &b: &usize| history[a].load.total_cmp(&history[b].load);
        let (least, greatest) = ((0..history.len()).min_by(by_load)?, (0..history.len()).max_by(by_load)?);
        let pushed = -history[least].load > 1.001 * history[greatest].load;
        Some(if pushed { least } else { greatest })
    }

    /// Scalars of every step.
    pub const SCALARS: [RecordScalar; 12] = [
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

/// Status of an iteration, for progress bars and logs.
#[derive(Clone, Copy, Debug)]
pub struct Status {
    /// Load step, from 0.
    pub step: usize,
    /// Total number of load steps.
    pub steps: usize,
    /// Iteration towards the current equilibrium.
    pub iteration: u64,
    /// Out-of-balance force over its reference.
    pub residual: f64,
    /// Tolerance of the residual.
    pub tolerance: f64,
    /// Load of the last finished step, N.
    pub load: Option<f64>,
    /// Damping coefficient used.
    pub damping: f64,
    /// Bonds broken so far.
    pub broken: u64,
    /// True if the state may be saved here: a run that begins from it takes the same steps.
    pub restartable: bool,
}
