//! Thermal analyses of other programs: a mesh, and its nodal temperatures over time.

mod exodus;
pub mod frd;
mod vtu;
mod xdmf;
mod xml;

use crate::error::Error;
use harness::output::vtkhdf::Cells;
use std::path::Path;

/// An analysis during reading.
pub struct Analysis {
    /// Positions of the nodes, in file order.
    pub points: Vec<[f64; 3]>,
    /// Elements of the highest dimension, by their corners: solids, else shells, else lines.
    pub cells: Cells,
    /// Temperatures, time by time.
    pub frames: Box<dyn Iterator<Item = Result<ThermalFrame, Error>>>,
}

/// Temperatures at one time.
pub struct ThermalFrame {
    /// Time.
    pub time: f64,
    /// Temperature of each node, in the unit of the file.
    pub temperature: Vec<f64>,
}

/// Opens a file of CalculiX (`.frd`), VTK (`.pvd`, `.vtu`, `.pvtu`), XDMF (`.xdmf`, `.xmf`) or Exodus II
/// (`.e`, `.ex2`, `.exo`, `.g`). `array` names the temperature; by default it is the only nodal scalar.
/// Meshes have one to three dimensions.
///
/// # Errors
/// Returns an error for other extensions, damaged files, meshes without elements, unknown arrays, and I/O
/// errors.
pub fn open(path: &Path, array: Option<&str>) -> Result<Analysis, Error> {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_lowercase();
    match ending.as_str() {
        "frd" => frd::open(path),
        "pvd" | "vtu" | "pvtu" => vtu::open(path, array),
        "xdmf" | "xdmf3" | "xmf" => xdmf::open(path, array),
        "e" | "ex2" | "exo" | "g" => exodus::open(path, array),
        _ => {
            let advice = match ending.as_str() {
                "vtk" | "vtp" | "vts" | "vtr" | "vti" => " (save it as .vtu, e.g. with ParaView)",
                "h5" | "hdf5" => " (open the .xdmf beside it)",
                "odb" | "rth" | "rst" | "inp" | "msh" => {
                    " (save the temperatures of the nodes as one of these)"
                }
                _ => "",
            };
            let reason = format!(
                "found extension `{ending}`; allowed: frd, pvd, vtu, pvtu, xdmf, xmf, e, ex2, exo, g{advice}"
            );
            Err(data_error(path, &reason))
        }
    }
}

/// Returns the name of the temperature array: `array`, or the only array of the file.
fn choose_array<'a>(path: &Path, names: &'a [String], array: Option<&str>) -> Result<&'a str, Error> {
    let found = match array {
        Some(array) => names.iter().find(|name| *name == array),
        None if names.len() == 1 => names.first(),
        None => None,
    };
    found.map(String::as_str).ok_or_else(|| match array {
        Some(array) => {
            Error::Unknown { what: "nodal scalar array", name: array.to_owned(), known: names.to_vec() }
        }
        None => {
            let allowed = "one nodal scalar array (otherwise `array` names the temperature)";
            data_error(path, &format!("found arrays {names:?}; allowed: {allowed}"))
        }
    })
}

/// Cell type of VTK, number of corners, cell type of first order, and dimension.
const TYPES: [(u64, usize, u8, usize); 28] = [
    (1, 1, 1, 0),
    (3, 2, 3, 1),
    (21, 2, 3, 1),
    (35, 2, 3, 1),
    (68, 2, 3, 1),
    (5, 3, 5, 2),
    (22, 3, 5, 2),
    (34, 3, 5, 2),
    (69, 3, 5, 2),
    (9, 4, 9, 2),
    (23, 4, 9, 2),
    (28, 4, 9, 2),
    (30, 4, 9, 2),
    (70, 4, 9, 2),
    (10, 4, 10, 3),
    (24, 4, 10, 3),
    (71, 4, 10, 3),
    (12, 8, 12, 3),
    (25, 8, 12, 3),
    (29, 8, 12, 3),
    (33, 8, 12, 3),
    (72, 8, 12, 3),
    (13, 6, 13, 3),
    (26, 6, 13, 3),
    (32, 6, 13, 3),
    (31, 6, 13, 3),
    (73, 6, 13, 3),
    (14, 5, 14, 3),
];

/// Cells by their dimension.
#[derive(Default)]
struct CellsByDimension([Cells; 4]);

impl CellsByDimension {
    /// Adds a cell of a VTK type; unknown types are skipped, their nodes remain.
    fn push(&mut self, kind: u64, nodes: &[u32]) {
        match kind {
            // pixels and voxels order their corners along x first
            8 if nodes.len() == 4 => self.0[2].push(9, &[0, 1, 3, 2].map(|corner: usize| nodes[corner])),
            11 if nodes.len() == 8 => {
                self.0[3].push(12, &[0, 1, 3, 2, 4, 5, 7, 6].map(|corner: usize| nodes[corner]));
            }
            2 => nodes.iter().for_each(|node| self.0[0].push(1, &[*node])),
            4 => nodes.windows(2).for_each(|two| self.0[1].push(3, two)),
            6 => nodes.windows(3).for_each(|three| self.0[2].push(5, three)),
            7 if nodes.len() > 2 => self.0[2].push(7, nodes),
            27 if nodes.len() == 13 => self.0[3].push(14, &nodes[..5]),
            _ => {
                let known = TYPES.iter().find(|(own, corners, ..)| *own == kind && nodes.len() >= *corners);
                if let Some(&(_, corners, linear, dimension)) = known {
                    self.0[dimension].push(linear, &nodes[..corners]);
                }
            }
        }
    }

    /// Returns the cells of the highest dimension; `None` without cells.
    fn highest(self) -> Option<Cells> {
        self.0.into_iter().rev().find(|cells| !cells.is_empty())
    }
}

fn data_error(path: &Path, reason: &str) -> Error {
    Error::Data { what: path.display().to_string(), reason: reason.to_owned() }
}

#[cfg(test)]
mod tests;
