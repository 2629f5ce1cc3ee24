//! Fields over time, read from VTKHDF files.

use crate::error::file;
use harness::output::vtkhdf;
use numpy::{IntoPyArray, PyArray1, PyArrayDyn, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// Content of a file: `times`, `points` (a number), `arrays` and `cell_arrays` (names and components), and
/// for a mesh `connectivity`, `ends`, `types`.
#[pyfunction]
pub fn layout(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyDict>> {
    let series = vtkhdf::read(&path).map_err(|error| file(&error))?;
    let cells = series.cells().map_err(|error| file(&error))?;
    let found = PyDict::new(py);
    found.set_item("times", series.times().to_vec().into_pyarray(py))?;
    found.set_item("points", series.number_of_points())?;
    found.set_item("arrays", series.arrays().to_vec())?;
    found.set_item("cell_arrays", series.cell_arrays().to_vec())?;
    found.set_item("cells", cells.types.len())?;
    found.set_item("connectivity", cells.connectivity.into_pyarray(py))?;
    let ends: Vec<u64> = cells.ends.into_iter().map(|end| end as u64).collect();
    found.set_item("ends", ends.into_pyarray(py))?;
    found.set_item("types", PyArray1::from_vec(py, cells.types))?;
    Ok(found)
}

/// Reads an array at some steps, (steps, places, components), or (steps, places) for scalars: of `point`s, of
/// `cell`s, or the `position`s.
#[pyfunction]
pub fn field<'py>(
    py: Python<'py>,
    path: PathBuf,
    kind: &str,
    name: &str,
    steps: Vec<usize>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let (data, components) = py
        .detach(|| {
            let series = vtkhdf::read(&path)?;
            let arrays = if kind == "cell" { series.cell_arrays() } else { series.arrays() };
            let known = arrays.iter().find(|(other, _)| other == name).map(|(_, components)| *components);
            let mut data = Vec::new();
            for &step in &steps {
                match kind {
                    "position" => data.extend(series.points(step)?.into_iter().flatten()),
                    "cell" => data.append(&mut series.cell_data(step, name)?),
                    _ => data.append(&mut series.data(step, name)?),
                }
            }
            Ok((data, if kind == "position" { 3 } else { known.unwrap_or(1) }))
        })
        .map_err(|error: polycore::Error| file(&error))?;
    let places = data.len() / (steps.len() * components).max(1);
    let shape = match components {
        1 => vec![steps.len(), places],
        _ => vec![steps.len(), places, components],
    };
    data.into_pyarray(py).reshape(shape)
}
