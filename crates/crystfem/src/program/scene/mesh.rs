//! Mesh block of a scene.

use super::locate_error::{located, located_in};
use super::memory;
use super::revolved::RevolvedSpec;
use super::voxels::{BuiltMesh, PRINTED_SIZES, PathSpec, StlSpec, box_of};
use crate::error::Error;
use crate::mesh::{Bar, Block, CellSplit, Grid, Mesh, Substrate, Tube, quality, read};
use harness::scene::{SceneError, Source};
use polycore::units::{Angle, Length};
use serde::Deserialize;
use std::path::PathBuf;

/// Parameters of a bar and their keys.
const BAR_KEYS: [(&str, &str); 9] = [
    ("extent of the bar", "size"),
    ("layers", "layers"),
    ("height of a layer", "layer_height"),
    ("elements per layer", "elements_per_layer"),
    ("element size", "element_size"),
    ("elements along an axis", "element_size"),
    ("extent of the substrate", "substrate.size"),
    ("thickness of the substrate", "substrate.thickness"),
    ("growth of elements", "substrate.growth"),
];

/// A larger part, m, suggests that the unit of its file is missing.
const SUSPICIOUS_SIZE: f64 = 2.0;

/// Parameters of a tube and their keys.
const TUBE_KEYS: [(&str, &str); 6] = [
    ("radius of the bore", "radii"),
    ("outer radius", "radii"),
    ("angle of the sector", "angle"),
    ("angle of an element", "elements"),
    ("length of the tube", "length"),
    ("elements along an axis", "elements"),
];

/// A mesh: one of a printed bar, a brick, a sector of a tube or of another body of revolution, a G-code file,
/// the inside of an STL surface, and a mesh file.
///
/// ```toml
/// [mesh.bar]
/// size = ["80 mm", "10 mm"]
/// layers = 8
/// layer_height = "0.5 mm"
/// elements_per_layer = 2
/// element_size = "1 mm"
/// substrate = { size = ["120 mm", "40 mm"], thickness = "4 mm", growth = 1.4 }
/// ```
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshSpec {
    /// Bar in layers, with or without a substrate.
    pub bar: Option<BarSpec>,
    /// Box of equal elements.
    pub brick: Option<BrickSpec>,
    /// Sector of a hollow cylinder.
    pub tube: Option<TubeSpec>,
    /// Sector of a body of revolution, from a plane section.
    pub revolved: Option<RevolvedSpec>,
    /// Cells that the beads of a G-code file fill, printed along its path.
    pub path: Option<PathSpec>,
    /// Cells inside an STL surface.
    pub stl: Option<StlSpec>,
    /// Mesh file: Gmsh `.msh` (2 or 4), Abaqus or CalculiX `.inp`, VTK `.vtu`, Exodus II `.e`.
    pub file: Option<PathBuf>,
    /// Length of one unit of the file; default 1 m.
    pub unit: Option<Length>,
    /// Order of the shape functions; 2 adds a node in the middle of each edge; default: the order of the
    /// mesh.
    pub order: Option<u8>,
}

/// A printed bar, see [`Bar`].
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BarSpec {
    /// Extents along x and y.
    pub size: [Length; 2],
    /// Number of layers.
    pub layers: usize,
    /// Height of a layer.
    pub layer_height: Length,
    /// Elements through a layer; default 1.
    pub elements_per_layer: Option<usize>,
    /// Largest element along x and y.
    pub element_size: Length,
    /// Substrate below the bar.
    pub substrate: Option<SubstrateSpec>,
    /// Element type of the grid's cells; default hexahedra.
    #[serde(default)]
    pub cells: CellSplit,
}

/// Substrate of a bar, see [`Substrate`].
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SubstrateSpec {
    /// Extents along x and y.
    pub size: [Length; 2],
    /// Thickness.
    pub thickness: Length,
    /// Growth ratio of elements away from the bar; default 1.5.
    pub growth: Option<f64>,
}

/// A box with its lower corner at the origin.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BrickSpec {
    /// Extents along x, y and z.
    pub size: [Length; 3],
    /// Elements along each axis; tetrahedra or wedges subdivide each of these cells.
    pub elements: [usize; 3],
    /// Element type; default hexahedra.
    #[serde(default)]
    pub cells: CellSplit,
}

/// Sector of a tube, see [`Tube`].
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TubeSpec {
    /// Radii of the bore and of the outer surface.
    pub radii: [Length; 2],
    /// Angle of the sector, starting at y = 0.
    pub angle: Angle,
    /// Length along z.
    pub length: Length,
    /// Elements along the radius, around the axis, and along z.
    pub elements: [usize; 3],
}

impl MeshSpec {
    /// Builds and checks the mesh.
    ///
    /// # Errors
    /// Returns a [`SceneError`] for no or several kinds of mesh, and for invalid meshes.
    pub fn build(&self, source: &Source) -> Result<BuiltMesh, SceneError> {
        let mut built = self.first_order(source)?;
        match self.order {
            None | Some(1) => {}
            Some(2) if built.filling.is_none() => built.mesh = built.mesh.second_order(),
            Some(order) => {
                return Err(source.error(
                    "mesh.order",
                    order,
                    "1, or 2 for a bar, brick, tube, revolved section or file",
                ));
            }
        }
        Ok(built)
    }

    fn first_order(&self, source: &Source) -> Result<BuiltMesh, SceneError> {
        let structured = [self.bar.is_some(), self.brick.is_some(), self.tube.is_some()];
        let from_files =
            [self.revolved.is_some(), self.file.is_some(), self.path.is_some(), self.stl.is_some()];
        let kinds = structured.into_iter().chain(from_files);
        let given = kinds.filter(|&x| x).count();
        if given != 1 {
            let one = "one of `bar`, `brick`, `tube`, `revolved`, `path`, `stl`, `file`";
            return Err(match given {
                0 => source.missing("mesh", format!("the scene needs {one}")),
                _ => source.error("mesh", format!("{given} kinds of mesh"), one),
            });
        }
        if self.unit.is_some() && self.file.is_none() {
            return Err(source.unexpected("mesh.unit", "only `mesh.file` has a unit here; remove it"));
        }
        if let Some(revolved) = &self.revolved {
            return revolved.build(source, |mesh| self.without_unit(source, mesh));
        }
        if let Some(path) = &self.path {
            return path.build(source);
        }
        if let Some(stl) = &self.stl {
            return stl.build(source);
        }
        let at = |key: &str, error: Error| located(source, key, &error);
        let mut notes = Vec::new();
        let mesh = if let Some(bar) = &self.bar {
            memory::refuse_mesh(source, "mesh.bar", self.elements(source)?, bar.cells.count())?;
            bar.build().mesh().map_err(|error| located_in(source, "mesh.bar", &BAR_KEYS, &error))?
        } else if let Some(brick) = &self.brick {
            let size = brick.size.map(|x| x.si());
            memory::refuse_mesh(source, "mesh.brick.elements", self.elements(source)?, brick.cells.count())?;
            let grid = Grid::uniform([0.0; 3], size, brick.elements);
            let blocks = [Block { name: "brick".into(), lower: [0.0; 3], upper: size }];
            grid.and_then(|grid| grid.blocks(&blocks, brick.cells)).map_err(|error| match error {
                Error::Mesh(_) => at("mesh.brick.size", error),
                _ => at("mesh.brick.elements", error),
            })?
        } else if let Some(tube) = &self.tube {
            memory::refuse_mesh(source, "mesh.tube.elements", self.elements(source)?, 1)?;
            tube.build().mesh().map_err(|error| located_in(source, "mesh.tube", &TUBE_KEYS, &error))?
        } else {
            let file = self.file.clone().unwrap_or_default();
            let path = source.file(&file);
            let unit = self.unit.map_or(1.0, |unit| unit.si());
            let found = read(&path, unit).map_err(|error| at("mesh.file", error))?;
            notes = found.notes;
            if let Some(suspicion) = self.without_unit(source, &found.mesh) {
                let [low, high] = found.mesh.bounds().unwrap_or_default();
                if (0..3).any(|d| high[d] - low[d] > PRINTED_SIZES[1]) {
                    return Err(suspicion);
                }
                notes.push(suspicion.message().to_owned());
            }
            notes.extend(found.mesh.bounds().map(|bounds| format!("the part is {}", box_of(bounds))));
            notes.extend(found.quality.notes.clone());
            return Ok(BuiltMesh { volume: found.quality.volume, mesh: found.mesh, notes, filling: None });
        };
        let found = quality::check(&mesh, None).map_err(|error| at("mesh", error))?;
        notes.extend(found.notes);
        Ok(BuiltMesh { mesh, notes, volume: found.volume, filling: None })
    }
}

impl MeshSpec {
    /// Block and angle, rad, of a sector of a body of revolution, whose cuts are planes of symmetry.
    pub(super) fn sector(&self) -> Option<(&'static str, f64)> {
        let tube = self.tube.as_ref().map(|tube| ("tube", tube.angle.si()));
        tube.or(self.revolved.as_ref().map(|revolved| ("revolved", revolved.angle())))
    }

    /// Returns an error for a mesh file without `unit` whose part is metres large.
    pub(super) fn without_unit(&self, source: &Source, mesh: &Mesh) -> Option<SceneError> {
        let key = match &self.revolved {
            Some(own) => (own.file.is_some() && own.unit.is_none()).then_some("mesh.revolved.unit"),
            None => (self.file.is_some() && self.unit.is_none()).then_some("mesh.unit"),
        }?;
        let [low, high] = mesh.bounds()?;
        let [x, y, z] = [0, 1, 2].map(|d| ((high[d] - low[d]) * 1e6).round() / 1e6);
        let why = format!(
            "in metres the part is {x} × {y} × {z} m; write e.g. \"1 mm\", or \"1 m\" if it is so large"
        );
        (x.max(y).max(z) > SUSPICIOUS_SIZE).then(|| source.missing(key, why))
    }

    /// Returns the number of cells along each axis of a bar, brick or tube before allocation; zeros for a
    /// file.
    ///
    /// # Errors
    /// As [`MeshSpec::build`].
    pub fn elements(&self, source: &Source) -> Result<[f64; 3], SceneError> {
        match (&self.bar, &self.brick, &self.tube) {
            (Some(bar), ..) => {
                bar.build().elements().map_err(|error| located_in(source, "mesh.bar", &BAR_KEYS, &error))
            }
            (None, Some(BrickSpec { elements, .. }), _) | (None, None, Some(TubeSpec { elements, .. })) => {
                Ok(elements.map(|count| count as f64))
            }
            (None, None, None) => Ok([0.0; 3]),
        }
    }
}

impl BarSpec {
    fn build(&self) -> Bar {
        Bar {
            size: self.size.map(|x| x.si()),
            layers: self.layers,
            layer_height: self.layer_height.si(),
            elements_per_layer: self.elements_per_layer.unwrap_or(1),
            element_size: self.element_size.si(),
            substrate: self.substrate.as_ref().map(|substrate| Substrate {
                size: substrate.size.map(|x| x.si()),
                thickness: substrate.thickness.si(),
                growth: substrate.growth.unwrap_or(1.5),
            }),
            cells: self.cells,
        }
    }
}

impl TubeSpec {
    fn build(&self) -> Tube {
        let [inner, outer] = &self.radii;
        Tube {
            radii: [inner.si(), outer.si()],
            angle: self.angle.si(),
            length: self.length.si(),
            elements: self.elements,
        }
    }
}
