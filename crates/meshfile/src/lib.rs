//! Readers of mesh files: [`gmsh`] (MSH 2 and 4, text and binary), [`abaqus`] (input files of Abaqus and
//! CalculiX) and [`stl`] (closed surfaces).
//!
//! A file becomes a [`MeshFile`]: nodes, elements, named sets, with the line of each for messages. What they
//! mean is up to the reader of the file: `crystfem` makes a finite element mesh of it, `peri` fills it with
//! particles.

pub mod abaqus;
mod content;
mod error;
pub mod gmsh;
mod read;
mod shape;
pub mod stl;

pub use content::{ElementKind, Face, FileElement, FileNode, MeshFile};
pub use error::{Error, line_error};
pub use read::read;
pub use shape::{Cell, ElementShape, HEXAHEDRON_SIDES, TETRAHEDRON_SIDES};
