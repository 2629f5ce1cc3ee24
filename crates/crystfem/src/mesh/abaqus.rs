//! Meshes from input files of Abaqus and CalculiX (`.inp`), and to them.

use std::path::Path;

use crate::error::Error;
use crate::mesh::file_mesh::{ReadMesh, convert};

mod advice;
mod write;

pub use advice::advice;
pub use write::write;

/// Reads a mesh, with coordinates multiplied by `scale` (1e-3 for a file in mm), see
/// [`meshfile::abaqus::read`]. Triangles and quadrangles of shells and membranes name surfaces; lines are
/// ignored. Notes name keywords that are not used, with the equivalent scene key.
///
/// # Errors
/// Errors of [`meshfile::abaqus::read`]; [`Error::Mesh`] from [`crate::mesh::quality::check`].
pub fn read(path: &Path, scale: f64) -> Result<ReadMesh, Error> {
    convert(path, meshfile::abaqus::read(path, advice)?, scale)
}

/// Reads a mesh from bytes; `path` is for messages only.
///
/// # Errors
/// Errors of [`read`].
pub fn parse(path: &Path, bytes: &[u8], scale: f64) -> Result<ReadMesh, Error> {
    convert(path, meshfile::abaqus::parse(path, bytes, advice)?, scale)
}

#[cfg(test)]
mod tests;
