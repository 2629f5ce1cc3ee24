//! Meshes of cells that a G-code file or an STL surface fills.

use super::fault::{located, located_in};
use super::file;
use super::memory;
use crate::error::Error;
use crate::mesh::path::{CellSettings, Deposit, ToolPath, read_gcode};
use crate::mesh::{Mesh, RATIOS, Voxels, quality, stl};
use harness::scene::{SceneError, Source};
use polycore::units::{Acceleration, Length, Speed};
use serde::Deserialize;
use std::path::PathBuf;

/// Cells are left out that are filled less: with the part that is filled, and where cells are full.
const LEAST: [f64; 2] = [0.1, 0.5];

/// Largest sides that printed parts have, m.
pub(super) const PRINTED: [f64; 2] = [1e-4, 10.0];

/// Where parameters stand in their block.
const KEYS: [(&str, &str); 7] = [
    ("size of a cell", "cell"),
    ("nodes of a structured mesh", "cell"),
    ("least filled part of a cell", "least"),
    ("diameter of the filament", "filament"),
    ("height of the bead", "bead_height"),
    ("acceleration", "acceleration"),
    ("jerk", "jerk"),
];

/// The cells that the beads of a G-code file fill, printed in the order of its moves.
///
/// ```toml
/// [mesh.path]
/// file = "part.gcode"
/// cell = ["0.5 mm", "0.5 mm", "0.25 mm"]
/// ```
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PathSpec {
    /// The file: G-code whose moves feed filament.
    pub file: PathBuf,
    /// Edges of a cell.
    pub cell: [Length; 3],
    /// Diameter of the filament; default: as the file states it, or 1.75 mm.
    pub filament: Option<Length>,
    /// Height of all beads; default: as the file tells, or down to what lies below.
    pub bead_height: Option<Length>,
    /// Features that are printed but left out of the part, as the file names them, or by one name for all
    /// slicers: `skirt`, `brim`, `raft`, `purge`, `support`, `wipe-tower`, ….
    #[serde(default)]
    pub leave_out: Vec<String>,
    /// Whether ρ and k of an element are scaled by the part of it that is filled, so that the printed mass is that of the file;
    /// otherwise elements are full.
    #[serde(default = "yes")]
    pub fill: bool,
    /// Cells filled to less are left out, their volume goes to the others; default 0.1, of full elements 0.5.
    pub least: Option<f64>,
    /// Limit of acceleration, for times; default: as the file states, or none: velocity is F.
    pub acceleration: Option<Acceleration>,
    /// Step of velocity at corners, with `acceleration`.
    pub jerk: Option<Speed>,
}

/// The cells inside a closed surface.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StlSpec {
    /// The file: STL, ASCII or binary.
    pub file: PathBuf,
    /// Length of one unit of the file: the format has none.
    pub unit: Length,
    /// Edges of a cell.
    pub cell: [Length; 3],
    /// As of a path.
    #[serde(default = "yes")]
    pub fill: bool,
    /// As of a path.
    pub least: Option<f64>,
}

fn yes() -> bool {
    true
}

/// How full the elements are, and the path that laid them down.
pub struct Filling {
    /// Filled parts, and which of them each element has; `None`: all are full.
    pub parts: Option<(Vec<f64>, Vec<usize>)>,
    /// Volume of the body, m³.
    pub volume: f64,
    /// Volume of the elements over it.
    pub ratio: f64,
    /// The path, with the time of each element, s.
    pub path: Option<(ToolPath, Vec<f64>)>,
}

/// A mesh, and what should be looked at.
pub struct BuiltMesh {
    /// The mesh.
    pub mesh: Mesh,
    /// Notes for the user.
    pub notes: Vec<String>,
    /// Volume of all elements, m³.
    pub volume: f64,
    /// How full the elements of a path or an STL surface are.
    pub filling: Option<Filling>,
}

impl PathSpec {
    pub(super) fn build(&self, source: &Source) -> Result<BuiltMesh, SceneError> {
        let block = "mesh.path";
        let at = |error: Error| located_in(source, block, &KEYS, &error);
        let file = source.file(&self.file);
        let mut path = read_gcode(&file).map_err(|error| located(source, "mesh.path.file", &error))?;
        let mut notes = std::mem::take(&mut path.notes);
        let filament = file::filament(source, block, &path, self.filament)?;
        path = file::timed(source, block, path, self.acceleration, self.jerk, &mut notes)?;
        notes.extend(path.summary(filament));
        path = file::purged(source, "mesh.path.file", path, &mut notes)?;
        let height = self.bead_height.map(|x| x.si());
        if height.is_none_or(|height| height > 0.0) && filament > 0.0 {
            path = path.with_heights(filament, height);
        }
        file::leave_out(source, block, &self.leave_out, &mut path, &mut notes)?;
        let cells = CellSettings {
            size: self.cell.map(|x| x.si()),
            filament,
            height,
            least: self.least.unwrap_or(LEAST[usize::from(!self.fill)]),
        };
        memory::refuse_mesh(source, "mesh.path.cell", path.cells(&cells).map_err(at)?, 1)?;
        let Deposit { voxels, times, tools } = path.deposit(&cells).map_err(at)?;
        if !tools.is_empty() {
            let sets: Vec<String> = path.tools().iter().map(|tool| format!("`tool-{tool}`")).collect();
            notes.push(format!(
                "several tools print: element sets {} for the materials of regions",
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
        self.plausible(source, surface.bounds(), size)?;
        memory::refuse_mesh(source, "mesh.stl.cell", surface.cells(size).map_err(at)?, 1)?;
        let least = self.least.unwrap_or(LEAST[usize::from(!self.fill)]);
        let (voxels, overlaps) = surface.voxels(size, least).map_err(at)?;
        surface.notes.extend(overlaps);
        surface.notes.push(format!("the part is {}", box_of(surface.bounds())));
        finish(source, block, voxels, self.fill, surface.notes, None)
    }

    /// Refuses a part that is too small or too large to be printed, or smaller than a cell: its unit is another.
    fn plausible(
        &self,
        source: &Source,
        [low, high]: [[f64; 3]; 2],
        cell: [f64; 3],
    ) -> Result<(), SceneError> {
        let size = [0, 1, 2].map(|d| high[d] - low[d]);
        let largest = size.into_iter().fold(0.0, f64::max);
        let [least, most] = PRINTED;
        let fits = (0..3).any(|d| size[d] >= 0.5 * cell[d]);
        if largest >= least && largest < most && fits {
            return Ok(());
        }
        let unit = self.unit.si();
        let found = format!("{unit} m per unit of the file, which makes the part {}", box_of([low, high]));
        let [x, y, z] = size.map(|x| rounded(x / unit));
        let allowed = format!(
            "a `unit` with which its largest side is between {} mm and {most} m, and it is no smaller than a cell: \
             the file's own numbers are {x} × {y} × {z}, e.g. \"1 m\" if these are metres",
            1e3 * least
        );
        Err(source.error("mesh.stl.unit", found, allowed))
    }
}

/// The sides of a box, in mm.
pub(super) fn box_of([low, high]: [[f64; 3]; 2]) -> String {
    let [x, y, z] = [0, 1, 2].map(|d| rounded(1e3 * (high[d] - low[d])));
    format!("{x} × {y} × {z} mm")
}

/// To five digits.
fn rounded(x: f64) -> f64 {
    format!("{x:.4e}").parse().unwrap_or(x)
}

/// Checks cells and notes what should be looked at.
fn finish(
    source: &Source,
    block: &str,
    voxels: Voxels,
    fill: bool,
    mut notes: Vec<String>,
    path: Option<(ToolPath, Vec<f64>)>,
) -> Result<BuiltMesh, SceneError> {
    let cubic = 1e9 * voxels.volume;
    let told = format!("cells have {:.4} times the volume of the body, {cubic:.3} mm³", voxels.ratio);
    if !fill && !voxels.can_be_full() {
        let [low, high] = RATIOS;
        let allowed = format!("{low} to {high} times with full cells: smaller ones, or `fill = true`");
        return Err(source.error(&format!("{block}.cell"), told, allowed));
    }
    let most = voxels.fill.iter().copied().fold(0.0, f64::max);
    notes.push(match fill {
        true => format!(
            "{told}; density and conductivity are scaled by the part that is filled, at most {most:.3}"
        ),
        false => told,
    });
    if voxels.left_out > 1e-6 {
        let share = 100.0 * voxels.left_out;
        notes.push(format!("{share:.2} % of the volume is in cells left out, and goes to the others"));
    }
    let parts = fill.then(|| voxels.bins());
    let found = quality::check(&voxels.mesh, None).map_err(|error| located(source, block, &error))?;
    notes.extend(found.notes);
    let filling = Filling { parts, volume: voxels.volume, ratio: voxels.ratio, path };
    Ok(BuiltMesh { mesh: voxels.mesh, notes, volume: found.volume, filling: Some(filling) })
}
