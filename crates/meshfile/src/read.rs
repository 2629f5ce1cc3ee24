//! Reading of mesh files by their extension.

use crate::{Error, MeshFile, abaqus, gmsh};
use std::path::Path;

/// Formats of [`read`], for messages.
pub const FORMATS: &str = "`.msh` (Gmsh 2 and 4), `.inp` (Abaqus, CalculiX), `.vtu`, `.pvtu` (VTK), `.e`, \
    `.ex2`, `.exo`, `.g`, `.gen` (Exodus II)";

fn ending(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

/// Returns true for a file whose extension is one of those of [`read`].
pub fn is_mesh(path: &Path) -> bool {
    matches!(ending(path).as_str(), "msh" | "inp" | "vtu" | "pvtu" | "e" | "ex2" | "exo" | "g" | "gen")
}

/// Reads a mesh file: `.msh` of Gmsh ([`gmsh::read`]), `.inp` of Abaqus and CalculiX ([`abaqus::read`]),
/// `.vtu` and `.pvtu` of VTK (`vtu::read`), `.e`, `.ex2`, `.exo`, `.g` and `.gen` of Exodus II
/// (`exodus::read`). `advice` replaces keywords of Abaqus that have no effect on the mesh, see
/// [`abaqus::Advice`].
///
/// # Errors
/// [`Error::Mesh`] for another extension, or for one of VTK or Exodus without the feature `results`, and
/// errors of these functions.
pub fn read(path: &Path, advice: abaqus::Advice) -> Result<MeshFile, Error> {
    match ending(path).as_str() {
        "msh" => gmsh::read(path),
        "inp" => abaqus::read(path, advice),
        #[cfg(feature = "results")]
        "vtu" | "pvtu" => crate::vtu::read(path),
        #[cfg(feature = "results")]
        "e" | "ex2" | "exo" | "g" | "gen" => crate::exodus::read(path),
        #[cfg(not(feature = "results"))]
        "vtu" | "pvtu" | "e" | "ex2" | "exo" | "g" | "gen" => {
            Err(Error::Mesh(format!("{}: built without the feature `results`", path.display())))
        }
        "vtk" => {
            let advice = "save it as .vtu, e.g. with ParaView or meshio";
            Err(Error::Mesh(format!("{}: a legacy file of VTK; {advice}", path.display())))
        }
        _ => Err(Error::Mesh(format!("{}: allowed: {FORMATS}", path.display()))),
    }
}
