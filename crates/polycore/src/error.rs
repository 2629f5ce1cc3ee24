//! The error of this crate: what failed, on which file or value.

use crate::constitutive;
use std::io;
use std::path::{Path, PathBuf};

/// Exit code of the command lines for bad input.
pub const EXIT_BAD_INPUT: u8 = 2;

/// Exit code of a run that the user stopped.
pub const EXIT_INTERRUPTED: u8 = 130;

/// Error outside reading a scene (for which there is `scene::SceneError`).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused an operation on a file.
    #[error("cannot {operation} {}: {}{source}", path.display(), explanation(source))]
    Io {
        /// A verb: `create`, `rename`, …
        operation: &'static str,
        /// The file or directory.
        path: PathBuf,
        /// The reason given by the operating system.
        source: io::Error,
    },
    /// The output directory cannot be used; detected before any computation.
    #[error("the output directory {} cannot be used: {reason}", path.display())]
    OutputDirectory {
        /// The directory.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// A file with invalid content.
    #[error("{} is not a valid {format}: {reason}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// `VTKHDF file`, `report`, …
        format: &'static str,
        /// Defect of the content.
        reason: String,
    },
    /// Data that cannot be written or drawn.
    #[error("{what}: {reason}")]
    Data {
        /// The array, curve or picture.
        what: String,
        /// Defect of the data.
        reason: String,
    },
    /// A checkpoint cannot be used.
    #[error("checkpoint {}: {why}", path.display())]
    Checkpoint {
        /// The file.
        path: PathBuf,
        /// Why not.
        why: String,
    },
    /// An option of a command line cannot be used.
    #[error("`{option}`: {reason}")]
    Option {
        /// The option, as it was written.
        option: String,
        /// Defect of the option, and allowed values.
        reason: String,
    },
    /// A run was asked to stop; its checkpoint is written.
    #[error("interrupted; resume with `{program} resume {}`", output.display())]
    Interrupted {
        /// The program.
        program: &'static str,
        /// The output directory of the run.
        output: PathBuf,
    },
    /// A sweep was asked to stop; finished runs are kept.
    #[error("interrupted; the same command continues with the results in {}", .0.display())]
    SweepInterrupted(PathBuf),
    /// A number outside the range on which an operation is defined.
    #[error("{quantity} = {value} is outside {allowed}")]
    Domain {
        /// The name of the argument.
        quantity: &'static str,
        /// The offending value.
        value: f64,
        /// The allowed range.
        allowed: &'static str,
    },
    /// An iteration that did not converge.
    #[error("{iteration} did not converge in {steps} steps (residual {residual:e})")]
    NoConvergence {
        /// The name of the iteration.
        iteration: &'static str,
        /// Steps done.
        steps: usize,
        /// The last residual.
        residual: f64,
    },
    /// Invalid deformation gradient.
    #[error(transparent)]
    Tensor(#[from] crate::tensor::Error),
    /// Error of a constitutive law, its fit, table or file.
    #[error(transparent)]
    Constitutive(#[from] constitutive::Error),
    /// Composition without a network.
    #[error(transparent)]
    Network(#[from] crate::network::Error),
    /// Table of numbers that cannot be read.
    #[cfg(feature = "tables")]
    #[error(transparent)]
    Table(#[from] crate::table::Error),
}

/// Returns a plain explanation of an error that the user can act on, to precede the system's text.
fn explanation(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::StorageFull => "the disk is full: ",
        io::ErrorKind::QuotaExceeded => "the disk quota is exhausted: ",
        io::ErrorKind::FileTooLarge => "the file exceeds the size limit: ",
        _ => "",
    }
}

/// Returns true if a file could not be written for lack of space, which is no fault of the input.
#[cfg(feature = "files")]
pub(crate) fn no_room(error: &io::Error) -> bool {
    !explanation(error).is_empty()
}

impl Error {
    /// Returns a closure for `map_err`: `fs::rename(a, b).map_err(Error::from_io("rename", b))`.
    pub fn from_io(operation: &'static str, path: impl AsRef<Path>) -> impl FnOnce(io::Error) -> Self {
        let path = path.as_ref().to_path_buf();
        move |source| Self::Io { operation, path, source }
    }

    /// Exit code of the command lines: 2 for bad input (an unreadable file, an unusable output directory or
    /// checkpoint), 130 for an interrupted run, 1 for a failed one.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Interrupted { .. } | Self::SweepInterrupted(_) => EXIT_INTERRUPTED,
            Self::Option { .. }
            | Self::OutputDirectory { .. }
            | Self::Checkpoint { .. }
            | Self::Format { .. }
            | Self::Network(_) => EXIT_BAD_INPUT,
            #[cfg(feature = "tables")]
            Self::Table(_) => EXIT_BAD_INPUT,
            Self::Constitutive(constitutive::Error::Invalid { .. } | constitutive::Error::File { .. }) => {
                EXIT_BAD_INPUT
            }
            Self::Io { operation, .. } if operation.starts_with("read") || *operation == "open" => {
                EXIT_BAD_INPUT
            }
            _ => 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_disk_in_plain_words() {
        let full = Error::from_io("write", "a.csv")(io::ErrorKind::StorageFull.into());
        assert!(full.to_string().starts_with("cannot write a.csv: the disk is full: "), "{full}");
        assert_eq!(full.exit_code(), 1);
        assert_eq!(Error::from_io("read", "a.csv")(io::ErrorKind::NotFound.into()).exit_code(), 2);
    }
}
