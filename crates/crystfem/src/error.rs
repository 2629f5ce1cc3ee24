//! Errors of this crate.

use std::path::PathBuf;

/// Error of heat conduction and crystallization.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A mesh cannot be used.
    #[error("mesh: {0}")]
    Mesh(String),
    /// A parameter out of its domain.
    #[error("{name}: found {found}; allowed: {allowed}")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// Value found.
        found: f64,
        /// Allowed values.
        allowed: String,
    },
    /// An unknown name.
    #[error("no {what} `{name}`; allowed: {}", known.join(", "))]
    Unknown {
        /// Kind of thing named.
        what: &'static str,
        /// Name found.
        name: String,
        /// Known names.
        known: Vec<String>,
    },
    /// A line of a data or mesh file that cannot be used.
    #[error("{}:{line}: {what}: found {found:?}; allowed: {allowed}", path.display())]
    File {
        /// Path of the file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, key or section.
        what: String,
        /// Text found.
        found: String,
        /// Allowed text.
        allowed: String,
    },
    /// Measurements that do not suffice.
    #[error("{what}: {reason}")]
    Data {
        /// Purpose of the measurements.
        what: String,
        /// Defect, with the allowed values.
        reason: String,
    },
    /// A result that is not finite.
    #[error("{quantity} is not finite at {place}, t = {time} s")]
    NotFinite {
        /// Quantity.
        quantity: &'static str,
        /// Node or integration point, with its position.
        place: String,
        /// Time, s.
        time: f64,
    },
    /// A result that is finite although the scene expects values that are not.
    #[error("{place}: expected a non-finite value (`non_finite = true`), found only finite ones")]
    Finite {
        /// Point of the scene.
        place: String,
    },
    /// An iteration that did not converge.
    #[error(
        "{method} did not converge at t = {time} s: error {error} K after {iterations} iterations, wanted \
         {wanted} K"
    )]
    NotConverged {
        /// Name of the method.
        method: &'static str,
        /// Time at the end of the increment, s.
        time: f64,
        /// Number of iterations.
        iterations: usize,
        /// Remaining error, K.
        error: f64,
        /// Tolerance, K.
        wanted: f64,
    },
    /// A step stopped on request; earlier steps are kept.
    #[error("stopped on request at t = {time} s")]
    Stopped {
        /// Time before the step, s.
        time: f64,
    },
    /// A failed study.
    #[error("study {name}: {error}")]
    Study {
        /// Name of the study.
        name: String,
        /// Error of the study.
        error: Box<Error>,
    },
    /// An error of files, output or scenes.
    #[error(transparent)]
    Shared(#[from] polycore::Error),
}

impl From<meshfile::Error> for Error {
    fn from(error: meshfile::Error) -> Self {
        match error {
            meshfile::Error::Mesh(text) => Self::Mesh(text),
            meshfile::Error::Parameter { name, found, allowed } => Self::Parameter { name, found, allowed },
            meshfile::Error::File { path, line, what, found, allowed } => {
                Self::File { path, line, what, found, allowed }
            }
            meshfile::Error::Data { path, reason } => Self::Data { what: path.display().to_string(), reason },
            meshfile::Error::Shared(error) => Self::Shared(error),
        }
    }
}
