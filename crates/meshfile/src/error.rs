//! Errors of this crate.

use std::path::{Path, PathBuf};

/// A mesh file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A mesh that is no valid body.
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
    /// A line that cannot be used.
    #[error("{}:{line}: {what}: found {found:?}; allowed: {allowed}", path.display())]
    File {
        /// Path of the file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Keyword, number or section.
        what: String,
        /// Text found.
        found: String,
        /// Allowed text.
        allowed: String,
    },
    /// A result file that cannot be used.
    #[error("{}: {reason}", path.display())]
    Data {
        /// Path of the file.
        path: PathBuf,
        /// Defect, with the allowed values.
        reason: String,
    },
    /// A file that cannot be read.
    #[error(transparent)]
    Shared(#[from] polycore::Error),
}

/// Builds an error at a line of a file; long text is cut.
pub fn line_error(
    path: &Path,
    line: usize,
    what: impl Into<String>,
    found: impl ToString,
    allowed: impl Into<String>,
) -> Error {
    let mut found = found.to_string();
    if let Some((end, _)) = found.char_indices().nth(80) {
        found.truncate(end);
        found.push('…');
    }
    Error::File { path: path.to_owned(), line, what: what.into(), found, allowed: allowed.into() }
}

/// Builds an error of a result file.
#[cfg(feature = "results")]
pub(crate) fn data_error(path: &Path, reason: &str) -> Error {
    Error::Data { path: path.to_owned(), reason: reason.to_owned() }
}

/// Refuses a scale, m per unit of the file, that is not positive and finite.
pub(crate) fn check_scale(scale: f64) -> Result<(), Error> {
    if scale > 0.0 && scale.is_finite() {
        return Ok(());
    }
    let allowed = "positive and finite, m per unit of the file".into();
    Err(Error::Parameter { name: "scale of the mesh", found: scale, allowed })
}

/// Reads a whole file.
pub(crate) fn read_bytes(path: &Path) -> Result<Vec<u8>, Error> {
    Ok(std::fs::read(path).map_err(polycore::Error::from_io("read", path))?)
}
