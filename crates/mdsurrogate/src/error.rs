//! What can go wrong in this crate: where, what was found, what is allowed.

use std::path::{Path, PathBuf};

/// Errors of the surrogate crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A result is not finite.
    #[error("{quantity} is not finite at {place}")]
    NotFinite {
        /// What.
        quantity: &'static str,
        /// The row, or where else.
        place: String,
    },
    /// One cell of a table.
    #[error("{}:{line}: column `{column}`: found {found}; allowed: {allowed}", path.display())]
    Cell {
        /// The file.
        path: PathBuf,
        /// Its line, from 1 (of the unpacked text).
        line: u64,
        /// The heading.
        column: String,
        /// What stands there.
        found: String,
        /// What may stand there.
        allowed: String,
    },
    /// A column that a table needs and does not have.
    #[error("{}:1: column `{column}` is missing{}", path.display(), hint(similar))]
    MissingColumn {
        /// The file.
        path: PathBuf,
        /// The heading looked for.
        column: String,
        /// The nearest heading that is there.
        similar: Option<String>,
    },
    /// A file whose content is not what it should be.
    #[error("{}: found {found}; allowed: {allowed}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        found: String,
        /// What it should be.
        allowed: String,
    },
    /// Numbers that are no deformation or stress in the units stated.
    #[error("{place}: {quantity} = {found}, but {allowed}; is a unit wrong?")]
    Implausible {
        /// File and line, or the whole set.
        place: String,
        /// What.
        quantity: String,
        /// The offending value with its unit.
        found: String,
        /// The plausible range and its reason.
        allowed: &'static str,
    },
    /// Too few or repeated data for what was asked.
    #[error("{what}: found {found}; allowed: {allowed}")]
    Data {
        /// The operation.
        what: &'static str,
        /// What was found.
        found: String,
        /// What it needs.
        allowed: String,
    },
    /// A parameter out of its domain.
    #[error("{name}: found {found}; allowed: {allowed}")]
    Parameter {
        /// What.
        name: &'static str,
        /// The value found.
        found: String,
        /// What is allowed.
        allowed: String,
    },
    /// A training whose numbers left the range of f32.
    #[error(
        "training diverged in epoch {epoch}, batch {batch}: loss {loss} at learning rate {learning_rate:e}; \
         allowed: finite numbers (a smaller learning rate); the epochs before are kept"
    )]
    Diverged {
        /// From 1.
        epoch: u32,
        /// From 1.
        batch: usize,
        /// What was found.
        loss: f64,
        /// Adam's step.
        learning_rate: f64,
    },
    /// Files, output, scenes, tensors.
    #[error(transparent)]
    Shared(#[from] polycore::Error),
}

impl Error {
    /// For `map_err` on file operations.
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

/// What a model refuses is reported as this crate's own errors.
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

/// The nearest of some names, if one is near enough to be meant.
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
