//! Time integration.
//!
//! E' = −Q is integrated in terms of energy, so that every scheme conserves it: with stage rates Q_s and
//! weights b_s, E(t+Δt) = E(t) − Δt Σ b_s Q_s. A stage solves E(T) − E(t) + a Q(T) + known = 0, by one linear
//! solve for linear problems and by Newton's iteration otherwise.
//!
//! - backward Euler: one stage, order 1, L-stable; temperatures with lumped capacity never overshoot.
//! - TR-BDF2 (Bank et al. 1985, doi:10.1109/T-ED.1985.22232; Hosea & Shampine 1996,
//!   doi:10.1016/0168-9274(95)00115-8): two implicit stages with one matrix, order 2, L-stable. The first
//!   step after a jump (start, birth) is backward Euler, which does not use the rate before the jump.
//!
//! The temporal error is the difference to the embedded formula of the other order, filtered by the matrix of
//! the stage (A e = Δt Σ(b_s − b̂_s) Q_s) to exclude stiff components, which are damped at once.

mod matrix;
mod stage;
mod step;

pub(crate) use stage::{StageEquation, Stages};
pub(crate) use step::{Attempt, StepStart, Stepper};

/// Time integrators.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// Backward Euler, order 1.
    BackwardEuler,
    /// TR-BDF2, order 2.
    #[default]
    TrBdf2,
}

/// Step lengths.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Steps {
    /// Fixed, but shortened to end at given times.
    Fixed {
        /// Δt, s.
        dt: f64,
    },
    /// Adapted to the temporal error and to the steps suggested by materials.
    Adaptive {
        /// Largest temporal error of a node in a step, K.
        tolerance: f64,
        /// First step, and first step after a birth, s.
        first: f64,
        /// Smallest step, s.
        smallest: f64,
        /// Largest step, s.
        largest: f64,
    },
}

/// Counts of work.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Work {
    /// Accepted steps.
    pub steps: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Newton iterations; none for linear problems.
    pub newton_iterations: u64,
    /// Iterations of conjugate gradients.
    pub cg_iterations: u64,
    /// Solves by conjugate gradients.
    pub cg_solves: u64,
    /// Constructions of multigrid levels.
    pub levels: u64,
    /// Factorizations.
    pub factorizations: u64,
    /// Solves with factors.
    pub direct_solves: u64,
    /// Evaluations of the equations.
    pub evaluations: u64,
    /// Responses of materials at points.
    pub responses: u64,
    /// Additions of elements to the equations.
    pub builds: u64,
    /// Elements visited in these: those added and their neighbours.
    pub visited: u64,
}
