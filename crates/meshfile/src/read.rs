//! Reading of mesh files by their extension.

use crate::{Error, MeshFile, abaqus, gmsh};
use std::path::Path;

/// Reads a mesh file, `.msh` of Gmsh ([`gmsh::read`]) or `.inp` of Abaqus and CalculiX ([`abaqus::read`]).
/// `advice` replaces keywords of Abaqus that have no effect on the mesh, see [`abaqus::Advice`].
///
/// # Errors
/// [`Error::Mesh`] for another extension, and errors of these functions.
pub fn read(path: &Path, advice: abaqus::Advice) -> Result<MeshFile, Error> {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    match ending.as_str() {
        "msh" => gmsh::read(path),
        "inp" => abaqus::read(path, advice),
        _ => Err(Error::Mesh(format!(
            "{}: allowed: .msh (Gmsh 2 and 4), .inp (Abaqus, CalculiX)",
            path.display()
        ))),
    }
}
