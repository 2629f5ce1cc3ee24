//! Mesh of a tool path: cells with their fill fractions.

use super::{Move, ToolPath};
use crate::error::Error;
use crate::mesh::voxels::{VoxelGrid, Voxels};
use polycore::numerics::bounds;

/// Number of pieces per cell along each axis for the volume of beads.
const PIECES_PER_CELL: f64 = 4.0;
/// Smallest number of pieces across and down a bead.
const MIN_PIECES: f64 = 2.0;
/// Largest number of pieces across and down a bead.
const MAX_PIECES: f64 = 64.0;

/// Settings of the cells of a grid, at multiples of their size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellSettings {
    /// Edge lengths, m.
    pub size: [f64; 3],
    /// Diameter of the filament, m.
    pub filament: f64,
    /// Height of all beads, m; `None`: from the file, or down to the layer below.
    pub height: Option<f64>,
    /// Smallest fill fraction; the volume in emptier cells is distributed over the others in proportion.
    pub least: f64,
}

impl CellSettings {
    /// Returns cells of these edges, m, for filament of 1.75 mm, bead heights from the file, and a smallest
    /// fill fraction of a tenth.
    pub fn new(size: [f64; 3]) -> Self {
        Self { size, filament: super::FILAMENT, height: None, least: 0.1 }
    }
}

/// Deposited material as cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Deposit {
    /// Filled cells.
    pub voxels: Voxels,
    /// Time at which half of each element's filling is deposited, s.
    pub times: Vec<f64>,
    /// Tool that deposits most of each element, if several print; then there are element sets `tool-0`, ….
    pub tools: Vec<u16>,
}

impl ToolPath {
    /// Number of cells along each axis of the grid around all beads, before any is made.
    ///
    /// # Errors
    /// Errors of [`Self::deposit`].
    pub fn cells(&self, cells: &CellSettings) -> Result<[f64; 3], Error> {
        Ok(frame(&self.beads(cells)?, cells)?.counts().map(|count| count as f64))
    }

    /// Builds the cells filled by beads. Each bead is a box of its volume below the nozzle, as wide as its
    /// cross-section over its height, and is divided into pieces of a quarter of a cell.
    ///
    /// # Errors
    /// [`Error::Parameter`] or [`Error::Mesh`] for sizes that are not positive, a path without extrusion, a
    /// bead without height, too many cells, and a smallest fill fraction that leaves no cell.
    pub fn deposit(&self, cells: &CellSettings) -> Result<Deposit, Error> {
        let beads = self.beads(cells)?;
        let frame = frame(&beads, cells)?;
        let count = frame.counts().iter().product();
        let mut filled = vec![0.0; count];
        let mut volume = 0.0;
        for (one, height) in &beads {
            volume += one.volume(cells.filament);
            pieces(one, *height, cells, |at, own, _| filled[frame.cell(at)] += own);
        }
        let (mut voxels, taken) = frame.voxels(&filled, cells.least, volume)?;
        // time at which half of a cell's filling is deposited
        let mut sum = vec![0.0; count];
        let mut times = vec![f64::INFINITY; count];
        for (one, height) in &beads {
            pieces(one, *height, cells, |at, own, time| {
                let cell = frame.cell(at);
                sum[cell] += own;
                if sum[cell] >= 0.5 * filled[cell] && times[cell] == f64::INFINITY {
                    times[cell] = time;
                }
            });
        }
        let times =
            times.into_iter().zip(&taken).filter(|(_, taken)| **taken).map(|(time, _)| time).collect();
        let tools = by_tool(&beads, &frame, cells, count);
        let tools: Vec<u16> =
            tools.into_iter().zip(&taken).filter(|(_, taken)| **taken).map(|(tool, _)| tool).collect();
        for (element, tool) in (0..).zip(&tools) {
            voxels.mesh.element_sets.entry(format!("tool-{tool}")).or_default().push(element);
        }
        Ok(Deposit { voxels, times, tools })
    }

    /// Printing moves that feed filament, with the heights of their beads.
    fn beads(&self, cells: &CellSettings) -> Result<Vec<(&Move, f64)>, Error> {
        let positive = |name, found: f64| match found > 0.0 && found.is_finite() {
            true => Ok(()),
            false => Err(Error::Parameter { name, found, allowed: "positive and finite, m".into() }),
        };
        positive("diameter of the filament", cells.filament)?;
        positive("height of the bead", cells.height.unwrap_or(1.0))?;
        if !self.has_feed() {
            return Err(Error::Mesh(
                "the path extrudes nothing; allowed: G-code with E in printing moves".into(),
            ));
        }
        let beads: Vec<(&Move, f64)> = self
            .printing_moves()
            .zip(self.heights(cells.filament, cells.height))
            .filter(|(one, _)| one.fed > 0.0)
            .collect();
        if let Some((one, height)) = beads.iter().find(|(_, height)| !(*height > 0.0 && height.is_finite())) {
            let ([x, y, z], line) = (one.to.map(|x| 1e3 * x), one.line);
            return Err(Error::Mesh(format!(
                "line {line} of the path, bead to ({x}, {y}, {z}) mm: height {height} m; allowed: above 0, \
                 above the bed at z = 0"
            )));
        }
        Ok(beads)
    }
}

/// Returns the tool that deposits most in each cell; empty for a single tool.
fn by_tool(beads: &[(&Move, f64)], frame: &VoxelGrid, cells: &CellSettings, count: usize) -> Vec<u16> {
    let mut known: Vec<u16> = beads.iter().map(|(one, _)| one.tool).collect();
    known.sort_unstable();
    known.dedup();
    if known.len() < 2 {
        return Vec::new();
    }
    let (mut most, mut of) = (vec![0.0; count], vec![known[0]; count]);
    for tool in known {
        let mut own = vec![0.0; count];
        for (one, height) in beads.iter().filter(|(one, _)| one.tool == tool) {
            pieces(one, *height, cells, |at, volume, _| own[frame.cell(at)] += volume);
        }
        for (cell, volume) in own.into_iter().enumerate().filter(|(_, volume)| *volume > 0.0) {
            if volume > most[cell] {
                (most[cell], of[cell]) = (volume, tool);
            }
        }
    }
    of
}

/// Returns the grid around all beads.
fn frame(beads: &[(&Move, f64)], cells: &CellSettings) -> Result<VoxelGrid, Error> {
    let [low, high] = bounds(beads.iter().flat_map(|(one, height)| {
        let half = 0.5 * one.area(cells.filament) / height;
        let corners = move |[x, y, z]: [f64; 3]| [[x - half, y - half, z - height], [x + half, y + half, z]];
        [one.from, one.to].into_iter().flat_map(corners)
    }));
    VoxelGrid::around(low, high, cells.size)
}

/// Visits the pieces of a bead: centres, volumes and times.
fn pieces(one: &Move, height: f64, cells: &CellSettings, mut visit: impl FnMut([f64; 3], f64, f64)) {
    let along = [0, 1, 2].map(|d| one.to[d] - one.from[d]);
    let across = along[0].hypot(along[1]);
    let normal = [-along[1] / across, along[0] / across];
    let width = one.area(cells.filament) / height;
    let side = cells.size[0].min(cells.size[1]) / PIECES_PER_CELL;
    // tolerance of a billionth for whole numbers
    let count = |length: f64, piece: f64| (length / piece - 1e-9).ceil();
    let lengthwise = count(across, side).max(1.0);
    let crosswise = count(width, side).clamp(MIN_PIECES, MAX_PIECES);
    let down = count(height, cells.size[2] / PIECES_PER_CELL).clamp(MIN_PIECES, MAX_PIECES);
    let volume = one.volume(cells.filament) / (lengthwise * crosswise * down);
    let part = |k: u64, of: f64| (k as f64 + 0.5) / of;
    for i in 0..lengthwise as u64 {
        let share = part(i, lengthwise);
        let time = one.start + (one.end - one.start) * share;
        for j in 0..crosswise as u64 {
            let aside = (part(j, crosswise) - 0.5) * width;
            let place = [0, 1].map(|d| one.from[d] + along[d] * share + normal[d] * aside);
            for k in 0..down as u64 {
                let z = one.from[2] + along[2] * share - part(k, down) * height;
                visit([place[0], place[1], z], volume, time);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::path::parse;
    use std::f64::consts::PI;
    use std::path::Path;

    const MILLIMETRE: CellSettings =
        CellSettings { size: [5e-4, 5e-4, 2.5e-4], filament: 1.75e-3, height: None, least: 0.0 };

    fn parsed(text: &str) -> ToolPath {
        parse(Path::new("a.gcode"), text.as_bytes()).unwrap()
    }

    /// Cells of two layers of twenty lines of 10 mm, 0.5 mm apart and 0.25 mm high, with filament for 0.8 of
    /// that, are all filled to 0.8, in the order of the lines.
    #[test]
    fn lines_fill_their_cells() {
        let fed = 0.8 * 10.0 * 0.5 * 0.25 / (0.25 * PI * 1.75f64.powi(2));
        let mut text = "M83\nG1 F600 Z0.25\n".to_owned();
        for line in 0..40 {
            let (y, z) = (0.25 + 0.5 * f64::from(line % 20), 0.25 * f64::from(line / 20 + 1));
            text += &format!("G0 X0 Y{y} Z{z}\nG1 X10 E{fed}\n");
        }
        let path = parsed(&text);
        let Deposit { voxels: found, times, .. } = path.deposit(&MILLIMETRE).unwrap();
        assert_eq!(found.mesh.element_count(), 20 * 20 * 2);
        assert_eq!(found.mesh.element_sets["layer-2"].len(), 400);
        assert!((found.volume * 1e9 - 0.8 * 10.0 * 10.0 * 0.5).abs() < 1e-9);
        // lines are 0.4 mm wide in cells of 0.5
        assert!(found.fill.iter().all(|fill| (fill - 0.8).abs() < 1e-9), "{:?}", &found.fill[..5]);
        let (values, of) = found.bins();
        assert!(values.len() == 1 && (values[0] - 0.8).abs() < 1e-12 && of.iter().all(|bin| *bin == 0));
        assert!(!found.can_be_full());
        assert!((found.ratio - 1.25).abs() < 1e-9 && found.left_out.abs() < 1e-9);
        let whole: f64 = found.fill.iter().sum::<f64>() * 5e-4 * 5e-4 * 2.5e-4;
        assert!((whole / found.volume - 1.0).abs() < 1e-12);
        // half cells: 0.25 mm into each at 10 mm/s
        for (element, time) in times.iter().enumerate() {
            let (column, line) = (element % 20, element / 20);
            let start = path.printing_moves().nth(line).unwrap().start;
            let exact = start + (0.5 * column as f64 + 0.25) / 10.0;
            assert!((time - exact).abs() < 0.126 / 10.0, "{element}: {time} {exact}");
        }
        let error = |cells: CellSettings| path.deposit(&cells).unwrap_err().to_string();
        assert!(
            error(CellSettings { size: [0.0, 1.0, 1.0], ..MILLIMETRE }).contains("size of a cell: found 0")
        );
        assert!(
            error(CellSettings { least: 1.0, ..MILLIMETRE }).contains("least filled part of a cell: found 1")
        );
        assert!(error(CellSettings { size: [1e-9; 3], ..MILLIMETRE }).contains("nodes of a structured mesh"));
        assert!(
            parsed("G1 X1 F60\n").deposit(&MILLIMETRE).unwrap_err().to_string().contains("extrudes nothing")
        );
    }

    /// A slanted line and an arc keep their volume, also without thin cells.
    #[test]
    fn volume_is_kept() {
        let path = parsed("M83\nG1 F600 Z0.2\nG1 X7 Y3 E0.3\nG3 X0 Y10 R5 E0.9\n");
        for least in [0.0, 0.3] {
            let found = path.deposit(&CellSettings { least, ..MILLIMETRE }).unwrap().voxels;
            let sum: f64 = found.fill.iter().sum();
            assert!((sum * 6.25e-11 / (1.2e-3 * 0.25 * PI * 1.75e-3f64.powi(2)) - 1.0).abs() < 1e-12);
            assert!(found.fill.iter().all(|fill| *fill > least) && (found.left_out > 0.0) == (least > 0.0));
        }
    }

    /// Cells of slicer files agree with reference/print/gcode.py, whose grid encloses both ends of all moves,
    /// with the purge line at 0.3 mm down to the bed.
    #[test]
    fn files_in_cells() {
        let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures");
        let other = std::env::var_os("CRYSTFEM_GCODE").map_or_else(|| own.clone(), std::path::PathBuf::from);
        for (file, folder, size, count, volume, ratio) in [
            ("Zugstab_small.gcode", &own, [1e-3, 1e-4], 8971, 770.0621, 1.1650),
            ("Zugstab_small.gcode", &own, [5e-4, 1e-4], 33088, 770.0621, 1.0742),
            ("20x20x20_1wall_1bottom.gcode", &other, [5e-4, 2.5e-4], 29504, 1771.7213, 1.0408),
            ("20x20x20_1wall_1bottom.gcode", &other, [1e-3, 2.5e-4], 13316, 1771.7213, 1.8790),
        ] {
            let path = folder.join(file);
            if !path.exists() {
                evidence::skipped(&format!("{file} (CRYSTFEM_GCODE names its folder)"));
                continue;
            }
            let path = crate::mesh::path::read_gcode(&path).unwrap();
            let cells = CellSettings { size: [size[0], size[0], size[1]], least: 0.1, ..MILLIMETRE };
            let found = path.deposit(&cells).unwrap().voxels;
            assert_eq!(found.fill.len(), count, "{file} {size:?}");
            assert!((1e9 * found.volume - volume).abs() < 1e-4 && (found.ratio - ratio).abs() < 5.1e-5);
            bins_keep_the_volume(&found, size[0] * size[0] * size[1]);
        }
    }

    fn bins_keep_the_volume(found: &Voxels, whole: f64) {
        let (values, of) = found.bins();
        let sum: f64 = of.iter().map(|&bin| values[bin]).sum();
        assert!((sum * whole / found.volume - 1.0).abs() < 1e-12 && values.len() < 64);
        let off =
            of.iter().zip(&found.fill).map(|(&bin, fill)| (values[bin] - fill).abs()).fold(0.0, f64::max);
        assert!(off <= 0.05, "{off}");
    }
}
