//! Errors of this crate: place, value found, allowed values.

use std::path::{Path, PathBuf};

/// Errors of this crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A result is not finite.
    #[error("{quantity} is not finite at {place}")]
    NotFinite {
        /// Name of the quantity.
        quantity: &'static str,
        /// Row, or other place.
        place: String,
    },
    /// Invalid cell of a table.
    #[error("{}:{line}: column `{column}`: found {found}; allowed: {allowed}", path.display())]
    Cell {
        /// File.
        path: PathBuf,
        /// Line, from 1 (in the unpacked text).
        line: u64,
        /// Heading of the column.
        column: String,
        /// Content of the cell.
        found: String,
        /// Allowed content.
        allowed: String,
    },
    /// Missing column of a table.
    #[error("{}:1: column `{column}` is missing{}", path.display(), hint(similar))]
    MissingColumn {
        /// File.
        path: PathBuf,
        /// Heading of the missing column.
        column: String,
        /// Most similar heading of the file.
        similar: Option<String>,
    },
    /// File with invalid content.
    #[error("{}: found {found}; allowed: {allowed}", path.display())]
    File {
        /// File.
        path: PathBuf,
        /// Content found.
        found: String,
        /// Allowed content.
        allowed: String,
    },
    /// Implausible deformation or stress, probably in a wrong unit.
    #[error("{place}: {quantity} = {found}, but {allowed}; is a unit wrong?")]
    Implausible {
        /// File and line, or the whole set.
        place: String,
        /// Name of the quantity.
        quantity: String,
        /// Value found, with its unit.
        found: String,
        /// Plausible range, with its reason.
        allowed: &'static str,
    },
    /// Insufficient or repeated data.
    #[error("{what}: found {found}; allowed: {allowed}")]
    Data {
        /// Operation.
        what: &'static str,
        /// Data found.
        found: String,
        /// Data needed.
        allowed: String,
    },
    /// Parameter out of its domain.
    #[error("{name}: found {found}; allowed: {allowed}")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// Value found.
        found: String,
        /// Allowed values.
        allowed: String,
    },
    /// Training that diverged: its numbers exceed f32.
    #[error(
        "training diverged in epoch {epoch}, batch {batch}: loss {loss} at learning rate {learning_rate:e}; \
         use a smaller learning rate (earlier epochs are kept)"
    )]
    Diverged {
        /// Epoch, from 1.
        epoch: u32,
        /// Batch, from 1.
        batch: usize,
        /// Loss of this batch.
        loss: f64,
        /// Learning rate of Adam.
        learning_rate: f64,
    },
    /// Error of files, output, scenes or tensors.
    #[error(transparent)]
    Shared(#[from] polycore::Error),
}

impl Error {
    /// Returns a function for `map_err` on file operations.
    pub fn from_io(operation: &'static str, path: impl AsRef<Path>) -> impl FnOnce(std::io::Error) -> Self {
        let error = polycore::Error::from_io(operation, path);
        move |source| Self::Shared(error(source))
    }

    pub(crate) fn file(path: &Path, found: impl ToString, allowed: impl ToString) -> Self {
        Self::File { path: path.to_path_buf(), found: found.to_string(), allowed: allowed.to_string() }
    }

    pub(crate) fn parameter(name: &'static str, found: impl ToString, allowed: impl ToString) -> Self {
        Self::Parameter { name, found: found.to_string(), allowed: allowed.to_string() }
    }
}

impl From<polycore::tensor::Error> for Error {
    fn from(error: polycore::tensor::Error) -> Self {
        Self::Shared(error.into())
    }
}

/// Converts errors of models to errors of this crate.
impl From<polycore::constitutive::Error> for Error {
    fn from(error: polycore::constitutive::Error) -> Self {
        use polycore::constitutive::Error as Law;
        match error {
            Law::Invalid { name, found, allowed } => Self::Parameter { name, found, allowed },
            Law::File { path, found, allowed } => Self::File { path, found, allowed },
            other => Self::Shared(other.into()),
        }
    }
}

/// Returns the most similar name, if it is similar enough.
pub(crate) fn nearest<'a>(name: &str, names: impl Iterator<Item = &'a str>) -> Option<String> {
    let first = |text: &str| text.chars().next();
    let scored =
        names.map(|other| (strsim::damerau_levenshtein(name, other), first(name) != first(other), other));
    let near = scored.filter(|(distance, ..)| *distance <= 1 + name.chars().count() / 3);
    near.min().map(|(_, _, other)| other.to_owned())
}

fn hint(similar: &Option<String>) -> String {
    similar.as_ref().map_or(String::new(), |name| format!("; did you mean `{name}`?"))
}
