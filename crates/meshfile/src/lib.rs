//! Readers of mesh files: [`gmsh`] (MSH 2 and 4, text and binary), [`abaqus`] (input files of Abaqus and
//! CalculiX), [`stl`] (closed surfaces); with the feature `results` also `vtu` (VTK's unstructured grids),
//! `exodus` (Exodus II) and `dxf` (outlines of drawings).
//!
//! A file becomes a [`MeshFile`]: nodes, elements, named sets, with the line of each for messages. What they
//! mean is up to the reader of the file: `crystfem` makes a finite element mesh of it, `peri` fills it with
//! particles.

pub mod abaqus;
mod content;
#[cfg(feature = "results")]
pub mod dxf;
mod error;
#[cfg(feature = "results")]
pub mod exodus;
pub mod gmsh;
#[cfg(feature = "results")]
pub mod netcdf;
mod read;
mod shape;
pub mod stl;
#[cfg(feature = "results")]
mod vtk_cells;
#[cfg(feature = "results")]
pub mod vtu;

pub use content::{ElementKind, Face, FileElement, FileNode, MeshFile};
pub use error::{Error, line_error};
pub use read::{FORMATS, is_mesh, read};
pub use shape::{Cell, ElementShape, HEXAHEDRON_SIDES, TETRAHEDRON_SIDES};

#[cfg(all(test, feature = "results"))]
mod tests;
