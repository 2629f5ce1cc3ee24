//! Our own reader, for tests, pictures and resumed runs.

use std::path::{Path, PathBuf};

use rust_hdf5::{H5Dataset, H5File};

use super::packed::{PackedRows, StoredTable};
use super::{Cells, Layout, OF_THE_FORMAT, format_error};
use polycore::Error;
use polycore::hdf5::dataset as checked;

/// An open VTKHDF file of particles or of a mesh; steps are read on demand.
pub struct Series {
    path: PathBuf,
    file: H5File,
    times: Vec<f64>,
    /// First point of each step.
    offsets: Vec<usize>,
    moves: bool,
    /// Numbers of the steps as a whole.
    moments: Vec<(String, Vec<f64>)>,
    layout: Layout,
}

/// Opens a file written by [`super::ParticleSeries`] or [`super::MeshSeries`] (the merged one or a frame).
///
/// # Errors
/// [`Error::Io`] if it cannot be read, [`Error::Format`] if it is not such a file.
pub fn read(path: impl AsRef<Path>) -> Result<Series, Error> {
    let path = path.as_ref();
    // tells a missing file from a damaged one
    let size = std::fs::File::open(path)
        .and_then(|file| file.metadata())
        .map_err(Error::from_io("open", path))?
        .len();
    let fail = |reason: &str| format_error(path, reason);
    let hdf5 = |error: rust_hdf5::Hdf5Error| format_error(path, error);
    let file = H5File::open(path).map_err(hdf5)?;
    let group = file.root_group().group("VTKHDF").map_err(hdf5)?;
    let kind = group.attr_string("Type").map_err(hdf5)?;
    let moves = match kind.trim_end_matches('\0') {
        "PolyData" => true,
        "UnstructuredGrid" => false,
        kind => return Err(fail(&format!("its type is `{kind}`, not `PolyData` or `UnstructuredGrid`"))),
    };
    let dataset = |name: &str| checked(&file, &format!("VTKHDF/{name}"), size).map_err(hdf5);
    let integers = |name: &str| dataset(name)?.read_raw::<i64>().map_err(hdf5);
    let counts = integers("NumberOfPoints")?;
    let [count] = counts[..] else { return Err(fail("the number of points changes from step to step")) };
    let points = usize::try_from(count).map_err(|_| fail("a negative number of points"))?;
    let times = dataset("Steps/Values")?.read_raw::<f64>().map_err(hdf5)?;
    let offsets: Vec<usize> =
        integers("Steps/PointOffsets")?.into_iter().map(|row| row.max(0) as usize).collect();
    let rows = dataset("Points")?.shape();
    let fits = |offset: &usize| offset.checked_add(points).is_some_and(|end| rows.first() >= Some(&end));
    if times.is_empty()
        || times.len() != offsets.len()
        || rows.get(1) != Some(&3)
        || !offsets.iter().all(fits)
    {
        return Err(fail("its steps and points do not fit together"));
    }
    let cells = match moves {
        true => 0,
        false => match integers("NumberOfCells")?[..] {
            [count] => usize::try_from(count).map_err(|_| fail("a negative number of cells"))?,
            _ => return Err(fail("the number of cells changes from step to step")),
        },
    };
    let arrays_of = |kind: &str, count: usize| -> Result<Vec<(String, usize)>, Error> {
        let mut arrays = Vec::new();
        for name in group.group(kind).and_then(|group| group.dataset_names()).map_err(hdf5)? {
            let shape = dataset(&format!("{kind}/{name}"))?.shape();
            if shape.first().copied() != count.checked_mul(times.len()) || shape.len() > 2 {
                return Err(fail(&format!("the array `{name}` does not fit its {count} places")));
            }
            arrays.push((name, shape.get(1).copied().unwrap_or(1)));
        }
        Ok(arrays)
    };
    let arrays = arrays_of("PointData", points)?;
    let cell_arrays = if moves { Vec::new() } else { arrays_of("CellData", cells)? };
    let mut moments = Vec::new();
    for name in group.group("Steps").and_then(|group| group.dataset_names()).map_err(hdf5)? {
        if !OF_THE_FORMAT.contains(&name.as_str()) {
            let values = dataset(&format!("Steps/{name}"))?.read_raw::<f64>().map_err(hdf5)?;
            if values.len() != times.len() {
                return Err(fail(&format!("`Steps/{name}` does not fit its {} steps", times.len())));
            }
            moments.push((name, values));
        }
    }
    moments.sort_by(|a, b| a.0.cmp(&b.0));
    let names = moments.iter().map(|(name, _)| name.clone()).collect();
    let layout = Layout { points, arrays, cells, cell_arrays, moments: names };
    Ok(Series { path: path.to_path_buf(), file, times, offsets, moves, moments, layout })
}

impl Series {
    /// Returns the times of the steps, in the unit the writer used.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Returns the number of steps, at least one.
    #[allow(clippy::len_without_is_empty)]
    pub fn len(&self) -> usize {
        self.times.len()
    }

    /// Returns a number of a step as a whole.
    pub fn moment(&self, step: usize, name: &str) -> Option<f64> {
        self.moments.iter().find(|(other, _)| other == name)?.1.get(step).copied()
    }

    /// Particles in every step.
    pub fn number_of_points(&self) -> usize {
        self.layout.points
    }

    /// Returns names and numbers of components of the point arrays.
    pub fn arrays(&self) -> &[(String, usize)] {
        &self.layout.arrays
    }

    /// Returns names and numbers of components of the cell arrays; none of particles.
    pub fn cell_arrays(&self) -> &[(String, usize)] {
        &self.layout.cell_arrays
    }

    /// Returns the cells of a mesh; none of particles.
    ///
    /// # Errors
    /// [`Error::Format`] for damaged data.
    pub fn cells(&self) -> Result<Cells, Error> {
        if self.moves {
            return Ok(Cells::default());
        }
        let fail = |error: String| format_error(&self.path, error);
        let size = std::fs::metadata(&self.path).map_or(0, |file| file.len());
        let dataset = |name: &str| {
            checked(&self.file, &format!("VTKHDF/{name}"), size).map_err(|error| fail(error.to_string()))
        };
        let integers = |name: &str| dataset(name)?.read_raw::<i64>().map_err(|error| fail(error.to_string()));
        let number =
            |value: &i64| u32::try_from(*value).map_err(|_| fail(format!("a cell has point {value}")));
        let connectivity = integers("Connectivity")?.iter().map(number).collect::<Result<_, _>>()?;
        let ends = integers("Offsets")?.iter().skip(1).map(|&end| end.max(0) as usize).collect();
        let types = dataset("Types")?.read_raw::<u8>().map_err(|error| fail(error.to_string()))?;
        let cells = Cells { connectivity, ends, types };
        cells.check(self.layout.points).map_err(|error| fail(error.to_string()))?;
        match cells.len() == self.layout.cells {
            true => Ok(cells),
            false => Err(fail(format!("{} types of {} cells", cells.len(), self.layout.cells))),
        }
    }

    /// Returns whether points have a position for each step.
    pub fn moves(&self) -> bool {
        self.moves
    }

    /// Returns the positions at a step.
    ///
    /// # Errors
    /// [`Error::Data`] beyond the last step, [`Error::Format`] for damaged data.
    pub fn points(&self, step: usize) -> Result<Vec<[f64; 3]>, Error> {
        let start = self.offsets.get(step).copied();
        let flat = self.rows("Points", 3, start.ok_or_else(|| self.beyond(step))?, self.layout.points)?;
        Ok(flat.chunks_exact(3).map(|point| [point[0], point[1], point[2]]).collect())
    }

    /// Returns a point array at a step, the components of a point together.
    ///
    /// # Errors
    /// [`Error::Data`] beyond the last step or for an unknown name, [`Error::Format`] for damaged data.
    pub fn data(&self, step: usize, name: &str) -> Result<Vec<f64>, Error> {
        self.array("point", &self.layout.arrays, self.layout.points, step, name)
    }

    /// Returns a cell array at a step, the components of a cell together.
    ///
    /// # Errors
    /// As [`Series::data`].
    pub fn cell_data(&self, step: usize, name: &str) -> Result<Vec<f64>, Error> {
        self.array("cell", &self.layout.cell_arrays, self.layout.cells, step, name)
    }

    fn array(
        &self,
        kind: &str,
        arrays: &[(String, usize)],
        count: usize,
        step: usize,
        name: &str,
    ) -> Result<Vec<f64>, Error> {
        let Some((_, components)) = arrays.iter().find(|(other, _)| other == name) else {
            let names: Vec<&str> = arrays.iter().map(|(name, _)| name.as_str()).collect();
            let reason = format!("there is no such array; there are {}", names.join(", "));
            return Err(Error::Data { what: format!("{kind} array `{name}`"), reason });
        };
        if step >= self.len() {
            return Err(self.beyond(step));
        }
        let group = if kind == "cell" { "CellData" } else { "PointData" };
        self.rows(&format!("{group}/{name}"), *components, step * count, count)
    }

    /// Returns an array at a step for a table of another file: packed as it is where both store it in the
    /// same way.
    pub(super) fn packed(
        &self,
        table: &StoredTable,
        kind: &str,
        name: &str,
        step: usize,
    ) -> Result<PackedRows<'static>, Error> {
        if let Some(bytes) = table.same_of(&self.file, &format!("VTKHDF/{kind}/{name}"), step) {
            return Ok(PackedRows::Packed(bytes));
        }
        let values = match kind {
            "PointData" => self.data(step, name),
            "CellData" => self.cell_data(step, name),
            _ => self.points(step).map(Vec::into_flattened),
        };
        values.map(|values| PackedRows::Values(values.into()))
    }

    pub(super) fn layout(&self) -> Layout {
        self.layout.clone()
    }

    fn beyond(&self, step: usize) -> Error {
        let reason = format!("there is no step {step}; there are {}", self.len());
        Error::Data { what: self.path.display().to_string(), reason }
    }

    fn rows(&self, name: &str, columns: usize, start: usize, count: usize) -> Result<Vec<f64>, Error> {
        let slice = |dataset: H5Dataset| match dataset.ndims() {
            1 => dataset.read_numeric_slice_as::<f64>(&[start], &[count]),
            _ => dataset.read_numeric_slice_as::<f64>(&[start, 0], &[count, columns]),
        };
        let read = self.file.dataset(&format!("VTKHDF/{name}")).and_then(slice);
        read.map_err(|error| format_error(&self.path, error))
    }
}

impl std::fmt::Debug for Series {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Series").field("path", &self.path).field("times", &self.times).finish_non_exhaustive()
    }
}
