//! What can go wrong in this crate.

use std::path::PathBuf;

/// Errors of the heat and crystallization crate.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A mesh cannot be used.
    #[error("mesh: {0}")]
    Mesh(String),
    /// A parameter is out of its domain.
    #[error("{name}: found {found}; allowed: {allowed}")]
    Parameter {
        /// What.
        name: &'static str,
        /// The value found.
        found: f64,
        /// What is allowed.
        allowed: String,
    },
    /// A name that is none of those known.
    #[error("no {what} `{name}`; allowed: {}", known.join(", "))]
    Unknown {
        /// What it would name.
        what: &'static str,
        /// The name found.
        name: String,
        /// Names that there are.
        known: Vec<String>,
    },
    /// A line of a data or mesh file cannot be used.
    #[error("{}:{line}: {what}: found {found:?}; allowed: {allowed}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, key or section.
        what: String,
        /// What is there.
        found: String,
        /// What may be there.
        allowed: String,
    },
    /// Measurements from which nothing can be concluded.
    #[error("{what}: {reason}")]
    Data {
        /// What was asked of them.
        what: String,
        /// What is wrong with them, and what is allowed.
        reason: String,
    },
    /// A result is not finite.
    #[error("{quantity} is not finite at {place}, t = {time} s")]
    NotFinite {
        /// The quantity.
        quantity: &'static str,
        /// Node or integration point, with its position.
        place: String,
        /// Time, s.
        time: f64,
    },
    /// A result that the scene says leaves the finite numbers does not.
    #[error("{place}: all its values are finite; allowed: some that are not, as `non_finite` says")]
    Finite {
        /// The point of the scene.
        place: String,
    },
    /// An iteration did not end.
    #[error(
        "{method} did not converge at t = {time} s: error {error} K after {iterations} iterations, wanted {wanted} K"
    )]
    NotConverged {
        /// The iteration.
        method: &'static str,
        /// Time at the end of the increment, s.
        time: f64,
        /// Iterations spent.
        iterations: usize,
        /// Error at the end, K.
        error: f64,
        /// Tolerance, K.
        wanted: f64,
    },
    /// A step was stopped on request; what was before it stays.
    #[error("stopped on request at t = {time} s")]
    Stopped {
        /// Time before the step, s.
        time: f64,
    },
    /// One of several studies failed.
    #[error("study {name}: {error}")]
    Study {
        /// Its name.
        name: String,
        /// What went wrong in it.
        error: Box<Error>,
    },
    /// Files, output, scenes.
    #[error(transparent)]
    Shared(#[from] polycore::Error),
}
