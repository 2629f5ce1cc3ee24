//! Fields over time as VTKHDF, the HDF5 format that VTK (≥ 9.3) and ParaView (≥ 5.12) read natively.
//!
//! Layout: <https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/index.html>. Particles that
//! move are `PolyData`, one vertex cell each, with the topology once, points and point data for every step;
//! meshes that do not are `UnstructuredGrid`, with points and cells once, point and cell data for every step.
//!
//! A run can be killed at any moment: each step becomes a complete file `NAME.frames/000k.vtkhdf` of its own,
//! written under another name and renamed. `finish` merges them into `NAME.vtkhdf` in the same way and
//! removes the frames. A resumed run goes on with the frame after its checkpoint. Each dataset stores a step
//! as one chunk, and the merge copies chunks without unpacking them. Second-order tensors are stored in
//! single precision, all other numbers in double.

use std::fs;
use std::path::{Path, PathBuf};

use polycore::Error;
use polycore::file::{parent, sync_directory};

mod content;
mod frames;
mod mesh;
mod packed;
mod particles;
mod read;
#[cfg(test)]
mod tests;
mod write;

pub use content::Cells;
pub use mesh::MeshSeries;
pub use particles::ParticleSeries;
pub use read::{Series, read};

/// An array: name, number of components, values `[points · components]`, the components of a point (or cell)
/// together.
pub type Data<'a> = (&'a str, usize, &'a [f64]);

/// A number of a step as a whole: name and value, NaN where it has none.
pub type Moment<'a> = (&'a str, f64);

/// Datasets of the group `Steps` that VTK knows, or that say where the steps lie.
const OF_THE_FORMAT: [&str; 6] =
    ["Values", "PartOffsets", "NumberOfParts", "PointOffsets", "CellOffsets", "ConnectivityIdOffsets"];

/// Layout that all steps share.
#[derive(Clone, Debug, PartialEq)]
struct Layout {
    points: usize,
    /// Names and numbers of components.
    arrays: Vec<(String, usize)>,
    cells: usize,
    cell_arrays: Vec<(String, usize)>,
    /// Names of the numbers of each step.
    moments: Vec<String>,
}

impl Layout {
    /// Checks arrays against the number of points and cells.
    fn from_data(counts: [usize; 2], point_data: &[Data<'_>], cell_data: &[Data<'_>]) -> Result<Self, Error> {
        let arrays = named("point", counts[0], point_data)?;
        let cell_arrays = named("cell", counts[1], cell_data)?;
        Ok(Self { points: counts[0], arrays, cells: counts[1], cell_arrays, moments: Vec::new() })
    }
}

/// Returns names and numbers of components of arrays on `count` points or cells.
fn named(kind: &str, count: usize, data: &[Data<'_>]) -> Result<Vec<(String, usize)>, Error> {
    let mut arrays: Vec<(String, usize)> = Vec::new();
    for &(name, components, values) in data {
        let fail = |reason: String| Err(Error::Data { what: format!("{kind} array `{name}`"), reason });
        if name.is_empty() || name == "." || name.contains('/') || name.contains('\0') {
            return fail("not a valid name".into());
        }
        if arrays.iter().any(|(other, _)| other == name) {
            return fail("given twice".into());
        }
        if components == 0 || count.checked_mul(components) != Some(values.len()) {
            return fail(format!("{} values for {count} {kind}s of {components} components", values.len()));
        }
        arrays.push((name.to_owned(), components));
    }
    Ok(arrays)
}

impl Layout {
    /// Adds numbers of each step.
    fn and(mut self, moments: &[Moment<'_>]) -> Result<Self, Error> {
        for &(name, _) in moments {
            if name.is_empty() || name.contains('/') || OF_THE_FORMAT.contains(&name) {
                let what = format!("number `{name}` of a step");
                return Err(Error::Data { what, reason: "not a valid name".into() });
            }
            self.moments.push(name.to_owned());
        }
        // as a reader lists them
        self.moments.sort();
        Ok(self)
    }
}

/// Points must be there, and finite.
fn check_points(points: &[[f64; 3]]) -> Result<(), Error> {
    let fail = |reason: String| Err(Error::Data { what: "point array `Points`".into(), reason });
    if points.is_empty() {
        return fail("there are no points".into());
    }
    match points.iter().position(|point| point.iter().any(|x| !x.is_finite())) {
        Some(index) => fail(format!("point {index} is {:?}", points[index])),
        None => Ok(()),
    }
}

impl std::fmt::Display for Layout {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let list = |arrays: &[(String, usize)]| {
            let names = arrays.iter().map(|(name, components)| format!("{name}[{components}]"));
            names.collect::<Vec<_>>().join(", ")
        };
        write!(f, "{} points with {}", self.points, list(&self.arrays))?;
        if self.cells > 0 {
            write!(f, ", {} cells with {}", self.cells, list(&self.cell_arrays))?;
        }
        Ok(())
    }
}

/// Lets `write` make a complete HDF5 file under another name, then renames it to `target`.
fn whole_file(target: &Path, write: impl FnOnce(&Path) -> Result<(), Error>) -> Result<(), Error> {
    let temporary = temporary_name(target);
    remove(&temporary)?;
    let result = write(&temporary)
        .and_then(|()| fs::rename(&temporary, target).map_err(Error::from_io("rename to", target)));
    if result.is_err() {
        let _ = remove(&temporary);
    }
    sync_directory(parent(target));
    result
}

fn temporary_name(target: &Path) -> PathBuf {
    let name = target.file_name().unwrap_or_default().to_string_lossy();
    target.with_file_name(format!(".{name}.part"))
}

fn remove(path: &Path) -> Result<(), Error> {
    let removed = match fs::symlink_metadata(path) {
        Err(_) => return Ok(()),
        Ok(metadata) if metadata.is_dir() => fs::remove_dir_all(path),
        Ok(_) => fs::remove_file(path),
    };
    removed.map_err(Error::from_io("remove", path))
}

fn data_error(path: &Path, reason: String) -> Error {
    Error::Data { what: path.display().to_string(), reason }
}

fn format_error(path: &Path, reason: impl ToString) -> Error {
    Error::Format { path: path.to_path_buf(), format: "VTKHDF file", reason: reason.to_string() }
}
