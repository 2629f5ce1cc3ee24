//! Reading of files, and errors with their line.

use crate::error::Error;
use std::path::Path;

/// Reads a file.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, Error> {
    std::fs::read(path).map_err(|source| {
        Error::Shared(polycore::Error::Io { operation: "read", path: path.to_owned(), source })
    })
}

/// Builds an error at a line of a file; long text is cut.
pub fn line_error(
    path: &Path,
    line: usize,
    what: impl Into<String>,
    found: impl ToString,
    allowed: impl Into<String>,
) -> Error {
    meshfile::line_error(path, line, what, found, allowed).into()
}
