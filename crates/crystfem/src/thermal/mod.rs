//! Thermal analyses of other programs: a mesh, and the temperatures of its nodes over time.

mod exodus;
pub mod frd;
mod netcdf;
mod vtu;

use crate::error::Error;
use polycore::output::vtkhdf::Cells;
use std::path::Path;

/// An analysis that is being read.
pub struct Analysis {
    /// Places of the nodes, in the order of the file.
    pub points: Vec<[f64; 3]>,
    /// The solids, by their corners.
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

/// Opens `.frd` of CalculiX, `.pvd` and `.vtu` of VTK, or Exodus II (`.e`, `.ex2`, `.exo`, `.g`); `array` is the name of the temperature
/// where a file names its arrays, by default that of its only scalar of nodes.
///
/// # Errors
/// Other endings; files that are none of these, damaged ones, meshes without solids, names of arrays that there are not; I/O errors.
pub fn open(path: &Path, array: Option<&str>) -> Result<Analysis, Error> {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
    match ending {
        "frd" => frd::open(path),
        "pvd" | "vtu" => vtu::open(path, array),
        "e" | "ex2" | "exo" | "g" => exodus::open(path, array),
        _ => {
            let reason = format!("ending `{ending}`; allowed: frd, pvd, vtu, e, ex2, exo, g");
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

/// The corners of a solid from VTK's number of its type and its nodes.
fn push(cells: &mut Cells, kind: u64, nodes: &[u32]) {
    let (corners, linear) = match kind {
        10 | 24 => (4, 10),
        12 | 25 | 29 => (8, 12),
        13 | 26 | 32 => (6, 13),
        11 if nodes.len() == 8 => {
            // a voxel counts its corners along x first
            return cells.push(12, &[0, 1, 3, 2, 4, 5, 7, 6].map(|corner: usize| nodes[corner]));
        }
        // shells and beams have temperatures at their nodes all the same
        _ => return,
    };
    if nodes.len() >= corners {
        cells.push(linear, &nodes[..corners]);
    }
}

fn unusable(path: &Path, reason: &str) -> Error {
    Error::Data { what: path.display().to_string(), reason: reason.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(name: &str) -> std::path::PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/thermal").join(name)
    }

    /// Files that VTK and netCDF wrote (`make.py` beside them): T = 400 + 100 x + 10 y + z + t.
    #[test]
    fn files_of_others() {
        for (name, array) in [
            ("blocks.pvd", None),
            ("blocks.pvd", Some("Temperature")),
            ("blocks.e", Some("temperature")),
            ("blocks-netcdf4.e", Some("temperature")),
        ] {
            let analysis = open(&file(name), array).unwrap();
            let cells = &analysis.cells;
            assert_eq!((analysis.points.len(), cells.types.as_slice()), (14, &[12, 12, 13][..]), "{name}");
            assert_eq!(cells.connectivity[16..], [2, 12, 5, 8, 13, 11], "{name}");
            let points = analysis.points;
            let mut times = Vec::new();
            for frame in analysis.frames {
                let frame = frame.unwrap();
                times.push(frame.time);
                for ([x, y, z], found) in points.iter().zip(&frame.temperature) {
                    let expected = 400.0 + 100.0 * x + 10.0 * y + z + frame.time;
                    assert!((found - expected).abs() < 1e-9, "{name}: {found}, {expected}");
                }
            }
            assert_eq!(times, [0.0, 2.0, 5.0], "{name}");
        }
    }

    #[test]
    fn names_that_there_are_not() {
        for (name, array, says) in [
            ("blocks.e", None, "allowed: one scalar array"),
            ("blocks.e", Some("temprature"), "allowed: velocity, temperature"),
            ("blocks.pvd", Some("T"), "allowed: Temperature"),
            ("make.py", None, "allowed: frd"),
        ] {
            let error = open(&file(name), array).err().unwrap().to_string();
            assert!(error.contains(says), "{name}: {error}");
        }
    }

    /// Cut anywhere and with any byte changed: an error or other numbers, never a panic, and no more memory than a file can fill.
    #[test]
    fn damaged_files() {
        let directory = tempfile::tempdir().unwrap();
        for name in ["blocks_0.vtu", "blocks_1.vtu", "blocks_2.vtu", "blocks.e", "blocks-netcdf4.e"] {
            let good = std::fs::read(file(name)).unwrap();
            let path = directory.path().join(name);
            let mut refused = 0;
            let mut read = |bytes: &[u8]| {
                std::fs::write(&path, bytes).unwrap();
                let array = if name.ends_with(".e") { "temperature" } else { "Temperature" };
                let whole = open(&path, Some(array)).and_then(|analysis| {
                    analysis.frames.collect::<Result<Vec<Frame>, Error>>().map(|frames| frames.len())
                });
                refused += usize::from(whole.is_err());
            };
            let stride = 1 + good.len() / 700;
            for place in (0..good.len()).step_by(stride) {
                read(&good[..place]);
                let mut changed = good.clone();
                changed[place] ^= 0xff;
                read(&changed);
                changed[place] = good[place] ^ 0x04;
                read(&changed);
            }
            assert!(refused > good.len() / stride, "{name}: {refused}");
        }
    }
}
