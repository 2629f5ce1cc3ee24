//! Errors of constitutive laws, their fits, tables and files.

use crate::tensor;
use std::path::PathBuf;

/// Error of a law, a fit, a table of test data or a model file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Material parameter outside its domain.
    #[error("{law}: {parameter} = {value} is outside {allowed}")]
    Parameter {
        /// The law.
        law: &'static str,
        /// The parameter.
        parameter: String,
        /// The value given.
        value: f64,
        /// Allowed range.
        allowed: &'static str,
    },
    /// The chains are fully extended: energy and stress are infinite from here on.
    #[error("{law}: {quantity} = {value} has reached the locking value {limit}")]
    Locked {
        /// The law.
        law: &'static str,
        /// Quantity that reached its limit.
        quantity: &'static str,
        /// Value of the quantity.
        value: f64,
        /// The limit.
        limit: f64,
    },
    /// The result leaves the range of `f64`.
    #[error("{law}: the response at the stretches {stretches:?} leaves the range of f64")]
    Overflow {
        /// The law.
        law: &'static str,
        /// λ₁, λ₂, λ₃.
        stretches: [f64; 3],
    },
    /// The thesis prints no compressible form of this law.
    #[error("the thesis prints no compressible form of the {law} law; use the stress-free coupling")]
    NotPublished {
        /// The law.
        law: String,
    },
    /// Unknown name of a law.
    #[error("unknown hyperelastic law `{name}`")]
    UnknownLaw {
        /// The name requested.
        name: String,
    },
    /// An iteration did not converge.
    #[error("{iteration} did not converge in {steps} steps (residual {residual:e})")]
    NoConvergence {
        /// Name of the iteration.
        iteration: &'static str,
        /// Steps done.
        steps: usize,
        /// The last residual.
        residual: f64,
    },
    /// A fit was stopped on request.
    #[error("stopped on request")]
    Stopped,
    /// Data to which no law can be fitted.
    #[error("{what}: {reason}")]
    Data {
        /// The file, table or row.
        what: String,
        /// Defect of the data.
        reason: String,
    },
    /// Invalid C, or a part of a model that does not fit the others.
    #[error("{name}: found {found}; allowed: {allowed}")]
    Invalid {
        /// Name of the quantity.
        name: &'static str,
        /// The value found.
        found: String,
        /// Allowed values.
        allowed: String,
    },
    /// File without a valid model.
    #[error("{}: found {found}; allowed: {allowed}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Defect of the content.
        found: String,
        /// Expected content.
        allowed: String,
    },
    /// Inadmissible deformation.
    #[error(transparent)]
    Deformation(#[from] tensor::Error),
}

impl Error {
    pub(super) fn invalid(name: &'static str, found: impl ToString, allowed: impl ToString) -> Self {
        Self::Invalid { name, found: found.to_string(), allowed: allowed.to_string() }
    }

    #[cfg(feature = "surrogate")]
    pub(super) fn file(path: &std::path::Path, found: impl ToString, allowed: impl ToString) -> Self {
        Self::File { path: path.to_path_buf(), found: found.to_string(), allowed: allowed.to_string() }
    }
}
