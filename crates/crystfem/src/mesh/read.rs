//! Reading of mesh files by their extension.

use crate::error::Error;
use crate::mesh::abaqus::advice;
use crate::mesh::file_mesh::{ReadMesh, convert};
use std::path::Path;

/// Reads a mesh file of a format of [`meshfile::read`], with coordinates multiplied by `scale` (1e-3 for a
/// file in mm), and checks it.
///
/// # Errors
/// [`Error::Mesh`] for another extension, and errors of these functions.
pub fn read(path: &Path, scale: f64) -> Result<ReadMesh, Error> {
    convert(path, meshfile::read(path, advice)?, scale)
}
