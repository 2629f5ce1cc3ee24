//! From one time to the next.
//!
//! E' = −Q is integrated in terms of energy, so that every scheme conserves it: with stage rates Q_s and
//! weights b_s, E(t+Δt) = E(t) − Δt Σ b_s Q_s. A stage solves E(T) − E(t) + a Q(T) + known = 0; a linear
//! scene needs one linear solve for it, others Newton's iteration.
//!
//! - backward Euler: one stage, order 1, L-stable; temperatures with lumped capacity never overshoot.
//! - TR-BDF2 (Bank et al. 1985, doi:10.1109/T-ED.1985.22232; Hosea & Shampine 1996,
//!   doi:10.1016/0168-9274(95)00115-8): two implicit stages with one matrix, order 2, L-stable. The first
//!   step after a jump (start, birth) is backward Euler, which does not need the rate on the other side of
//!   the jump.
//!
//! The temporal error is the difference to the embedded formula of the other order, filtered by the matrix of
//! the stage (A e = Δt Σ(b_s − b̂_s) Q_s) so that stiff parts, which are damped at once, do not count.

mod matrix;
mod stage;
mod step;

pub(crate) use stage::{Stage, Stages};
pub(crate) use step::{Attempt, Start, Stepper};

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

/// Lengths of steps.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Steps {
    /// Always the same, but shorter before a given time.
    Fixed {
        /// Δt, s.
        dt: f64,
    },
    /// By the temporal error and by the material's wish.
    Adaptive {
        /// Largest temporal error of a node in a step, K.
        tolerance: f64,
        /// The first step, and the first after a birth, s.
        first: f64,
        /// Never shorter, s.
        smallest: f64,
        /// Never longer, s.
        largest: f64,
    },
}

/// Work done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Work {
    /// Accepted steps.
    pub steps: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Newton iterations; linear scenes have none.
    pub newton_iterations: u64,
    /// Iterations of conjugate gradients.
    pub cg_iterations: u64,
    /// Solves by conjugate gradients.
    pub cg_solves: u64,
    /// Times the levels of multigrid were made.
    pub levels: u64,
    /// Factorizations.
    pub factorizations: u64,
    /// Solves with factors.
    pub direct_solves: u64,
    /// Evaluations of the equations.
    pub evaluations: u64,
    /// Responses of materials at points.
    pub responses: u64,
    /// Times that elements were added to the equations.
    pub builds: u64,
    /// Elements visited for that: those added and their neighbours.
    pub visited: u64,
}
