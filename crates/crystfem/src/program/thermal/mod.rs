//! Thermal analyses of other programs: a mesh, and the temperatures of its nodes over time.

mod exodus;
pub mod frd;
mod netcdf;
mod vtu;
mod xdmf;
mod xml;

use crate::error::Error;
use harness::output::vtkhdf::Cells;
use std::path::Path;

/// An analysis that is being read.
pub struct Analysis {
    /// Places of the nodes, in the order of the file.
    pub points: Vec<[f64; 3]>,
    /// The elements of highest dimension, by their corners: solids, shells where there are none, lines where there are no shells.
    pub cells: Cells,
    /// The temperatures, time by time.
    pub frames: Box<dyn Iterator<Item = Result<Frame, Error>>>,
}

/// Temperatures at a time.
pub struct Frame {
    /// Time.
    pub time: f64,
    /// Of each node, in the unit of the file.
    pub temperature: Vec<f64>,
}

/// Opens `.frd` of CalculiX, `.pvd`, `.vtu` and `.pvtu` of VTK, `.xdmf` (`.xmf`), or Exodus II (`.e`, `.ex2`, `.exo`, `.g`); `array` is the
/// name of the temperature where a file names its arrays, by default that of its only scalar of nodes. Meshes are of one, two or three dimensions.
///
/// # Errors
/// Other endings; files that are none of these, damaged ones, meshes without elements, names of arrays that there are not; I/O errors.
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
            let reason =
                format!("ending `{ending}`; allowed: frd, pvd, vtu, pvtu, xdmf, xmf, e, ex2, exo, g{advice}");
            Err(unusable(path, &reason))
        }
    }
}

/// What `--array` or the file itself says about where the temperature is.
fn chosen<'a>(path: &Path, names: &'a [String], array: Option<&str>) -> Result<&'a str, Error> {
    let found = match array {
        Some(array) => names.iter().find(|name| *name == array),
        None if names.len() == 1 => names.first(),
        None => None,
    };
    found.map(String::as_str).ok_or_else(|| match array {
        Some(array) => {
            Error::Unknown { what: "scalar array of nodes", name: array.to_owned(), known: names.to_vec() }
        }
        None => {
            let allowed = "one scalar array of nodes, or `array` with the name of the temperature";
            unusable(path, &format!("arrays {names:?}; allowed: {allowed}"))
        }
    })
}

/// VTK's number of a type, its corners, the number of the type of first order, its dimension.
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

/// Elements by their dimension.
#[derive(Default)]
struct Shapes([Cells; 4]);

impl Shapes {
    /// An element from VTK's number of its type and its nodes; types that are not known are passed over, their nodes stay.
    fn push(&mut self, kind: u64, nodes: &[u32]) {
        match kind {
            // pixels and voxels count their corners along x first
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

    /// Those of the highest dimension; `None` of none.
    fn highest(self) -> Option<Cells> {
        self.0.into_iter().rev().find(|cells| !cells.is_empty())
    }
}

fn unusable(path: &Path, reason: &str) -> Error {
    Error::Data { what: path.display().to_string(), reason: reason.to_owned() }
}

#[cfg(test)]
mod tests;
