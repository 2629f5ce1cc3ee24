//! Meshes of cells that are filled by a G-code file or an STL surface.

use super::gcode_file;
use super::locate_error::{located, located_in};
use super::memory;
use crate::error::Error;
use crate::mesh::path::{CellSettings, Deposit, ToolPath, read_gcode};
use crate::mesh::{Mesh, RATIOS, Voxels, quality, stl};
use harness::scene::{SceneError, Source};
use polycore::units::{Acceleration, Length, Speed};
use serde::Deserialize;
use std::path::PathBuf;

/// Default smallest filled fraction of a cell: with scaled cells, and with full cells.
const LEAST_FILLED: [f64; 2] = [0.1, 0.5];

/// Smallest and largest size of a printed part, m.
pub(super) const PRINTED_SIZES: [f64; 2] = [1e-4, 10.0];

/// Parameters and their keys in the block.
const KEYS: [(&str, &str); 7] = [
    ("size of a cell", "cell"),
    ("nodes of a structured mesh", "cell"),
    ("least filled part of a cell", "least"),
    ("diameter of the filament", "filament"),
    ("height of the bead", "bead_height"),
    ("acceleration", "acceleration"),
    ("jerk", "jerk"),
];

/// Cells that the beads of a G-code file fill, printed in the order of its moves.
///
/// ```toml
/// [mesh.path]
/// file = "part.gcode"
/// cell = ["0.5 mm", "0.5 mm", "0.25 mm"]
/// ```
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PathSpec {
    /// G-code file whose moves feed filament.
    pub file: PathBuf,
    /// Edges of a cell.
    pub cell: [Length; 3],
    /// Filament diameter; default: that of the file, or 1.75 mm.
    pub filament: Option<Length>,
    /// Height of all beads; default: that of the file, or down to the material below.
    pub bead_height: Option<Length>,
    /// Features that are left out of the part, as the file names them, or by a name for all slicers: `skirt`,
    /// `brim`, `raft`, `purge`, `support`, `wipe-tower`, ….
    #[serde(default)]
    pub leave_out: Vec<String>,
    /// Scales ρ and k of each element by its filled fraction, so that the printed mass is that of the file;
    /// if false, elements are full.
    #[serde(default = "super::default_true")]
    pub fill: bool,
    /// Smallest filled fraction of a cell; the volume of emptier cells goes to the others; default 0.1, or
    /// 0.5 for full elements.
    pub least: Option<f64>,
    /// Acceleration limit, for the times; default: that of the file, or none (velocity is F).
    pub acceleration: Option<Acceleration>,
    /// Jump of velocity at corners, with `acceleration`.
    pub jerk: Option<Speed>,
}

/// Cells inside a closed surface.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StlSpec {
    /// STL file, ASCII or binary.
    pub file: PathBuf,
    /// Length of one unit of the file; the format has none.
    pub unit: Length,
    /// Edges of a cell.
    pub cell: [Length; 3],
    /// Scales ρ and k of each element by its filled fraction, as in `mesh.path`.
    #[serde(default = "super::default_true")]
    pub fill: bool,
    /// Smallest filled fraction of a cell, as in `mesh.path`.
    pub least: Option<f64>,
}

/// Filled fractions of the elements, and the path that printed them.
pub struct Filling {
    /// Different filled fractions, and the index of each element's fraction; `None` if all are full.
    pub parts: Option<(Vec<f64>, Vec<usize>)>,
    /// Volume of the body, m³.
    pub volume: f64,
    /// Volume of the elements over that of the body.
    pub ratio: f64,
    /// Path, and the birth time of each element, s.
    pub path: Option<(ToolPath, Vec<f64>)>,
}

/// A mesh with notes for the user.
pub struct BuiltMesh {
    /// The mesh.
    pub mesh: Mesh,
    /// Notes for the user.
    pub notes: Vec<String>,
    /// Volume of all elements, m³.
    pub volume: f64,
    /// Filled fractions, for a mesh from a path or an STL surface.
    pub filling: Option<Filling>,
}

impl PathSpec {
    pub(super) fn build(&self, source: &Source) -> Result<BuiltMesh, SceneError> {
        let block = "mesh.path";
        let at = |error: Error| located_in(source, block, &KEYS, &error);
        let file = source.file(&self.file);
        let mut path = read_gcode(&file).map_err(|error| located(source, "mesh.path.file", &error))?;
        let mut notes = std::mem::take(&mut path.notes);
        let filament = gcode_file::filament(source, block, &path, self.filament)?;
        path = gcode_file::with_times(source, block, path, self.acceleration, self.jerk, &mut notes)?;
        notes.extend(path.summary(filament));
        path = gcode_file::without_loose_beads(source, "mesh.path.file", path, &mut notes)?;
        let height = self.bead_height.map(|x| x.si());
        if height.is_none_or(|height| height > 0.0) && filament > 0.0 {
            path = path.with_heights(filament, height);
        }
        gcode_file::leave_out(source, block, &self.leave_out, &mut path, &mut notes)?;
        let cells = CellSettings {
            size: self.cell.map(|x| x.si()),
            filament,
            height,
            least: self.least.unwrap_or(LEAST_FILLED[usize::from(!self.fill)]),
        };
        memory::refuse_mesh(source, "mesh.path.cell", path.cells(&cells).map_err(at)?, 1)?;
        let Deposit { voxels, times, tools } = path.deposit(&cells).map_err(at)?;
        if !tools.is_empty() {
            let sets: Vec<String> = path.tools().iter().map(|tool| format!("`tool-{tool}`")).collect();
            notes.push(format!(
                "the file uses several tools: element sets {} select their regions",
                sets.join(", ")
            ));
        }
        finish(source, block, voxels, self.fill, notes, Some((path, times)))
    }
}

impl StlSpec {
    pub(super) fn build(&self, source: &Source) -> Result<BuiltMesh, SceneError> {
        let block = "mesh.stl";
        let at = |error: Error| located_in(source, block, &KEYS, &error);
        let file = source.file(&self.file);
        let mut surface =
            stl::read(&file, self.unit.si()).map_err(|error| located(source, "mesh.stl.file", &error))?;
        let size = self.cell.map(|x| x.si());
        self.check_size(source, surface.bounds(), size)?;
        memory::refuse_mesh(source, "mesh.stl.cell", stl::cells(&surface, size).map_err(at)?, 1)?;
        let least = self.least.unwrap_or(LEAST_FILLED[usize::from(!self.fill)]);
        let (voxels, overlaps) = stl::voxels(&surface, size, least).map_err(at)?;
        surface.notes.extend(overlaps);
        surface.notes.push(format!("the part is {}", box_of(surface.bounds())));
        finish(source, block, voxels, self.fill, surface.notes, None)
    }

    /// Refuses a part that is too small or too large to be printed, or smaller than a cell: its unit is
    /// wrong.
    fn check_size(
        &self,
        source: &Source,
        [low, high]: [[f64; 3]; 2],
        cell: [f64; 3],
    ) -> Result<(), SceneError> {
        let size = [0, 1, 2].map(|d| high[d] - low[d]);
        let largest = size.into_iter().fold(0.0, f64::max);
        let [least, most] = PRINTED_SIZES;
        let fits = (0..3).any(|d| size[d] >= 0.5 * cell[d]);
        if largest >= least && largest < most && fits {
            return Ok(());
        }
        let unit = self.unit.si();
        let found = format!("{unit} m per unit of the file, which gives a part of {}", box_of([low, high]));
        let [x, y, z] = size.map(|x| rounded(x / unit));
        let allowed = format!(
            "a `unit` that makes the largest side {} mm to {most} m, and the part larger than a cell (the \
             file contains {x} × {y} × {z}; write e.g. \"1 m\" if these are metres)",
            1e3 * least
        );
        Err(source.error("mesh.stl.unit", found, allowed))
    }
}

/// Formats the sides of a box in mm.
pub(super) fn box_of([low, high]: [[f64; 3]; 2]) -> String {
    let [x, y, z] = [0, 1, 2].map(|d| rounded(1e3 * (high[d] - low[d])));
    format!("{x} × {y} × {z} mm")
}

/// Rounds to five digits.
fn rounded(x: f64) -> f64 {
    format!("{x:.4e}").parse().unwrap_or(x)
}

/// Checks the cells and adds notes for the user.
fn finish(
    source: &Source,
    block: &str,
    voxels: Voxels,
    fill: bool,
    mut notes: Vec<String>,
    path: Option<(ToolPath, Vec<f64>)>,
) -> Result<BuiltMesh, SceneError> {
    let cubic = 1e9 * voxels.volume;
    let text = format!("cells have {:.4} times the volume of the body, {cubic:.3} mm³", voxels.ratio);
    if !fill && !voxels.can_be_full() {
        let [low, high] = RATIOS;
        let allowed = format!("{low} to {high} times with full cells (use smaller cells or `fill = true`)");
        return Err(source.error(&format!("{block}.cell"), text, allowed));
    }
    let most = voxels.fill.iter().copied().fold(0.0, f64::max);
    notes.push(match fill {
        true => {
            format!("{text}; density and conductivity are scaled by the filled fraction, at most {most:.3}")
        }
        false => text,
    });
    if voxels.left_out > 1e-6 {
        let share = 100.0 * voxels.left_out;
        notes.push(format!("{share:.2} % of the volume lies in omitted cells and is added to the others"));
    }
    let parts = fill.then(|| voxels.bins());
    let found = quality::check(&voxels.mesh, None).map_err(|error| located(source, block, &error))?;
    notes.extend(found.notes);
    let filling = Filling { parts, volume: voxels.volume, ratio: voxels.ratio, path };
    Ok(BuiltMesh { mesh: voxels.mesh, notes, volume: found.volume, filling: Some(filling) })
}
