//! Body of revolution of a scene, from a plane section.

use super::locate_error::{located, located_in};
use super::memory;
use super::voxels::{BuiltMesh, box_of};
use crate::error::Error;
use crate::mesh::{Mesh, PlaneSection, Rectangle, RevolvedCells, quality};
use harness::scene::{SceneError, Source};
use polycore::units::{Angle, Length};
use serde::Deserialize;
use std::path::PathBuf;

/// Default angle of the sector, rad: 4°, whose element lacks φ²/6, 8e-4, of its volume.
const ANGLE: f64 = std::f64::consts::PI / 45.0;

/// Parameters of the body and their keys.
const KEYS: [(&str, &str); 5] = [
    ("scale of the mesh", "unit"),
    ("angle of the sector", "angle"),
    ("angle of an element", "elements"),
    ("elements around the axis", "elements"),
    ("nodes of a body of revolution", "elements"),
];

/// A sector of a body of revolution around z, see [`PlaneSection::revolve`].
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RevolvedSpec {
    /// Mesh file of the plane section, triangles and quadrangles: x is the radius, y becomes z.
    pub file: Option<PathBuf>,
    /// Rectangles of the section, instead of a file.
    #[serde(default)]
    pub blocks: Vec<RectangleSpec>,
    /// Length of one unit of the file; default 1 m.
    pub unit: Option<Length>,
    /// Angle of the sector, starting at y = 0; default 4 deg.
    pub angle: Option<Angle>,
    /// Elements around the axis; default 1.
    pub elements: Option<usize>,
    /// Element type; default hexahedra and wedges.
    #[serde(default)]
    pub cells: RevolvedCells,
}

/// A rectangle of a section, see [`Rectangle`].
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RectangleSpec {
    /// Name of its element set; its free sides are `NAME-inner`, `NAME-outer`, `NAME-bottom`, `NAME-top`.
    pub name: String,
    /// Least radius and z.
    pub min: [Length; 2],
    /// Largest radius and z.
    pub max: [Length; 2],
    /// Elements along the radius and along z.
    pub elements: [usize; 2],
}

impl RevolvedSpec {
    /// Angle of the sector, rad.
    pub(super) fn angle(&self) -> f64 {
        self.angle.map_or(ANGLE, |angle| angle.si())
    }

    /// Builds and checks the mesh; `suspicion` returns an error for a part that is too large.
    ///
    /// # Errors
    /// Returns a [`SceneError`] for a file that holds no section, an invalid body, and too little memory.
    pub(super) fn build(
        &self,
        source: &Source,
        suspicion: impl Fn(&Mesh) -> Option<SceneError>,
    ) -> Result<BuiltMesh, SceneError> {
        let given = if self.file.is_some() { "mesh.revolved.file" } else { "mesh.revolved.blocks" };
        let at = |error: Error| match &error {
            Error::Parameter { .. } => located_in(source, "mesh.revolved", &KEYS, &error),
            _ => located(source, given, &error),
        };
        let (section, mut notes) = self.section(source, at)?;
        let around = self.elements.unwrap_or(1);
        let cells = [section.elements.len() as f64, around as f64, 1.0];
        memory::refuse_mesh(source, "mesh.revolved.elements", cells, 1)?;
        let body = section.revolve(self.angle(), around, self.cells).map_err(at)?;
        let found = quality::check(&body.mesh, Some(&body.labels)).map_err(at)?;
        if let Some(suspicion) = suspicion(&body.mesh) {
            return Err(suspicion);
        }
        if self.cells == RevolvedCells::Hexahedra && body.mesh.tetrahedra.len() == body.mesh.element_count() {
            notes
                .push("an element of the section has one node on the axis: the body is of tetrahedra".into());
        }
        notes.extend(body.mesh.bounds().map(|bounds| format!("the sector is {}", box_of(bounds))));
        notes.extend(found.notes);
        Ok(BuiltMesh { mesh: body.mesh, notes, volume: found.volume, filling: None })
    }

    /// Section of the file or the blocks, with notes.
    fn section(
        &self,
        source: &Source,
        at: impl Fn(Error) -> SceneError,
    ) -> Result<(PlaneSection, Vec<String>), SceneError> {
        let Some(file) = &self.file else {
            if self.blocks.is_empty() {
                return Err(source.missing("mesh.revolved.file", "a section needs a file or `blocks`"));
            }
            if self.unit.is_some() {
                return Err(source.unexpected("mesh.revolved.unit", "only a file has a unit here; remove it"));
            }
            let cells =
                self.blocks.iter().map(|block| block.elements.iter().map(|&n| n as f64).product::<f64>());
            memory::refuse_mesh(source, "mesh.revolved.blocks", [cells.sum(), 1.0, 1.0], 1)?;
            let rectangle = |block: &RectangleSpec| Rectangle {
                name: block.name.clone(),
                lower: block.min.each_ref().map(|x| x.si()),
                upper: block.max.each_ref().map(|x| x.si()),
                elements: block.elements,
            };
            let blocks: Vec<Rectangle> = self.blocks.iter().map(rectangle).collect();
            return Ok((PlaneSection::rectangles(&blocks).map_err(at)?, Vec::new()));
        };
        if !self.blocks.is_empty() {
            let why = "a section is one of a file and of blocks; remove one";
            return Err(source.conflict("mesh.revolved.file", "mesh.revolved.blocks", why));
        }
        let scale = self.unit.map_or(1.0, |unit| unit.si());
        PlaneSection::read(&source.file(file), scale).map_err(at)
    }
}
