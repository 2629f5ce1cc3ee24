//! Meshes from files of Gmsh.

use std::path::Path;

use crate::error::Error;
use crate::mesh::file_mesh::{ReadMesh, convert};

/// Reads a mesh, with coordinates multiplied by `scale` (1e-3 for a file in mm). Physical groups of volumes
/// become element sets, those of surfaces become surfaces and node sets, those of curves and points node
/// sets, see [`meshfile::gmsh::read`].
///
/// # Errors
/// Errors of [`meshfile::gmsh::read`]; [`Error::Mesh`] from [`crate::mesh::quality::check`].
pub fn read(path: &Path, scale: f64) -> Result<ReadMesh, Error> {
    convert(path, meshfile::gmsh::read(path)?, scale)
}

/// Reads a mesh from bytes; `path` is for messages only.
///
/// # Errors
/// Errors of [`read`].
pub fn parse(path: &Path, bytes: &[u8], scale: f64) -> Result<ReadMesh, Error> {
    convert(path, meshfile::gmsh::parse(path, bytes)?, scale)
}

#[cfg(test)]
mod tests;
