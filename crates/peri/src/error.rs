//! Errors of this crate.

/// Errors of the peridynamics crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The body cannot be built.
    #[error("{0}")]
    Geometry(String),
    /// A material parameter or a law is out of its domain.
    #[error("{name}: found {found}; allowed: {allowed}")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// Value found.
        found: f64,
        /// Allowed values.
        allowed: String,
    },
    /// A law of one of several parts of a body cannot be fitted.
    #[error("bond law of {part}: {error}")]
    PartLaw {
        /// Name of the part.
        part: String,
        /// The error of the law.
        error: Box<Error>,
    },
    /// A result is not finite.
    #[error(
        "{quantity} is not finite at particle {particle} (X = {position:?} m), step {step}, \
        iteration {iteration}"
    )]
    NotFinite {
        /// Name of the quantity.
        quantity: &'static str,
        /// Index of the particle.
        particle: usize,
        /// Reference position, m.
        position: Vec<f64>,
        /// Load step.
        step: usize,
        /// Iteration within the step.
        iteration: u64,
    },
    /// The solver reached its limit of iterations.
    #[error(
        "not converged after {iterations} iterations of step {step}: residual {residual:.3e}, \
        needed {needed:.3e}"
    )]
    NotConverged {
        /// Load step.
        step: usize,
        /// Iterations used.
        iterations: u64,
        /// Relative residual reached.
        residual: f64,
        /// Relative residual requested.
        needed: f64,
    },
    /// Loads without equilibrium: a force acts on a part of the body that nothing holds, from the start or
    /// after the body is torn.
    #[error(
        "no equilibrium {}: {why}; {}",
        if *torn {
            format!("after {step} steps, torn at load factor {factor:.4}")
        } else {
            format!("at load factor {factor:.4}")
        },
        if *torn {
            "the last equilibrium is kept; prescribe a displacement instead of the force to follow \
            the body beyond its peak load"
        } else {
            "hold it by a `displacement` along that axis, balance the forces, or use explicit dynamics"
        }
    )]
    NoEquilibrium {
        /// Load steps finished.
        step: usize,
        /// Load factor of the next.
        factor: f64,
        /// True if bonds have broken.
        torn: bool,
        /// Part and force without support, or its displacement.
        why: String,
    },
    /// The time step of explicit dynamics is beyond the critical one.
    #[error("time step: found {found:.4e} s; allowed: up to the critical {critical:.4e} s")]
    TimeStep {
        /// Time step requested, s.
        found: f64,
        /// Critical time step 2/ω_max, s.
        critical: f64,
    },
    /// Kinetic energy exceeds the available energy in explicit dynamics.
    #[error(
        "unstable at t = {time:.4e} s (time step {step}): kinetic energy {kinetic:.3e} J where \
         {available:.3e} J are available; its time step is {time_step:.4e} s, the critical one for the \
         observed stretches {critical:.4e} s"
    )]
    Unstable {
        /// Time, s.
        time: f64,
        /// Steps taken.
        step: u64,
        /// Kinetic energy, J.
        kinetic: f64,
        /// Work of the loads less dissipation, J.
        available: f64,
        /// The time step, s.
        time_step: f64,
        /// Estimated critical time step for all stretches observed, s.
        critical: f64,
    },
    /// Loads press a body through a plane, or particles through each other.
    #[error(
        "{what} overlap by {overlap:.3e} m at step {step}, time {time:.4e} s; allowed: \
        {allowed:.3e} m; raise `contact.stiffness`, \
         take more or shorter steps, or a smaller load"
    )]
    Penetration {
        /// Bodies or planes.
        what: String,
        /// Load step, or row of the history.
        step: usize,
        /// Time, s; 0 without dynamics.
        time: f64,
        /// Overlap found, m.
        overlap: f64,
        /// Overlap allowed, m.
        allowed: f64,
    },
    /// A device does not support a feature or fails; see [`crate::gpu`].
    #[cfg(feature = "gpu")]
    #[error("device: {0}")]
    Device(String),
    /// An error of one of several variants.
    #[error("{variant}: {error}")]
    Within {
        /// Name of the variant.
        variant: String,
        /// Error of the variant.
        error: Box<Self>,
    },
    /// Errors of files, output and scenes.
    #[error(transparent)]
    Shared(#[from] polycore::Error),
}

impl Error {
    /// Creates a geometry error.
    pub fn geometry(what: String) -> Self {
        Self::Geometry(what)
    }
}
