//! Reading of mesh files by their extension.

use crate::error::Error;
use crate::mesh::{ReadMesh, abaqus, gmsh};
use std::path::Path;

/// Reads a mesh file, `.msh` of Gmsh ([`gmsh::read`]) or `.inp` of Abaqus and CalculiX ([`abaqus::read`]),
/// with coordinates multiplied by `scale` (1e-3 for a file in mm), and checks it.
///
/// # Errors
/// [`Error::Mesh`] for another extension, and errors of these functions.
pub fn read(path: &Path, scale: f64) -> Result<ReadMesh, Error> {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    match ending.as_str() {
        "msh" => gmsh::read(path, scale),
        "inp" => abaqus::read(path, scale),
        _ => Err(Error::Mesh(format!(
            "{}: allowed: .msh (Gmsh 2 and 4), .inp (Abaqus, CalculiX)",
            path.display()
        ))),
    }
}
