//! Laws with time at a material point, and Prony series.

use crate::error::value;
use crate::watch::stoppable;
use harness::scene::{BranchSpec, SpringKind, ViscosityKind};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use polycore::constitutive::hyperelastic;
use polycore::constitutive::viscoelastic::fit::Test;
use polycore::constitutive::viscoelastic::linear::{PronySettings, fit_oscillation, fit_relaxation};
use polycore::constitutive::viscoelastic::{Branch, Mullins, Pace, Viscoelastic};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;

/// Spring, viscosity and constants of a branch, SI.
type BranchRow = (String, String, BTreeMap<String, f64>);

/// Computes the nominal stress, Pa, of a law with branches along strains that are linear between times, from
/// rest at time 0; `error` bounds the local error of S, Pa.
#[pyfunction]
#[pyo3(signature = (*, key, values, branches, mullins, test, time, strain, error))]
#[expect(clippy::too_many_arguments, reason = "the keywords of the function in Python")]
pub fn follow<'py>(
    py: Python<'py>,
    key: &str,
    values: Vec<f64>,
    branches: Vec<BranchRow>,
    mullins: Option<(f64, f64, f64)>,
    test: &str,
    time: PyReadonlyArray1<'py, f64>,
    strain: PyReadonlyArray1<'py, f64>,
    error: f64,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let branches = branches.iter().map(branch).collect::<PyResult<Vec<_>>>()?;
    let law = hyperelastic::model(key).map_err(value)?.law(&values).map_err(value)?;
    let mut law = Viscoelastic::new(Box::new(law), branches).map_err(value)?;
    if let Some((ratio, offset, slope)) = mullins {
        law = law.with_softening(Mullins { ratio, offset, slope }).map_err(value)?;
    }
    let test = match test {
        "uniaxial" => Test::Uniaxial,
        "simple-shear" => Test::SimpleShear,
        other => return Err(value(format!("test: found {other:?}; allowed: uniaxial, simple-shear"))),
    };
    let (times, strains) = (time.as_slice()?, strain.as_slice()?);
    let mut path = vec![[0.0, test.rest()]];
    for (row, (&time, &strain)) in times.iter().zip(strains).enumerate() {
        let before = path[path.len() - 1][0];
        if !(time > before && time.is_finite() && strain.is_finite()) {
            let allowed = format!("a time above {before} s and a finite strain");
            return Err(value(format!("row {row}: found {time} s, {strain}; allowed: {allowed}")));
        }
        path.push([time, strain]);
    }
    let found = py.detach(|| test.follow(&law, &path, Pace::Within(error))).map_err(value)?;
    Ok(found[1..].to_vec().into_pyarray(py))
}

fn branch((spring, viscosity, constants): &BranchRow) -> PyResult<Branch> {
    let spring: SpringKind = serde_json::from_value(spring.as_str().into()).map_err(value)?;
    let viscosity: ViscosityKind = serde_json::from_value(viscosity.as_str().into()).map_err(value)?;
    BranchSpec::from_constants(spring, viscosity, constants).map_err(value)
}

/// Fits a Prony series to rows of time (s) and modulus, or of frequency (Hz), storage and loss modulus (Pa).
#[pyfunction]
pub fn prony<'py>(
    py: Python<'py>,
    rows: PyReadonlyArray2<'py, f64>,
    terms: Option<usize>,
    per_decade: usize,
    loss_weight: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let settings = PronySettings { per_decade, most: terms.unwrap_or(usize::MAX), loss: loss_weight };
    let rows = rows.as_array();
    let found = stoppable(py, |_| match rows.ncols() {
        2 => fit_relaxation(
            &rows.rows().into_iter().map(|row| [row[0], row[1]]).collect::<Vec<_>>(),
            &settings,
        ),
        _ => {
            let points: Vec<[f64; 3]> = rows.rows().into_iter().map(|row| [row[0], row[1], row[2]]).collect();
            fit_oscillation(&points, &settings)
        }
    })?;
    let found = found.map_err(value)?;
    let answer = PyDict::new(py);
    answer.set_item("equilibrium", found.series.equilibrium)?;
    let moduli: Vec<f64> = found.series.terms.iter().map(|term| term.modulus).collect();
    let times: Vec<f64> = found.series.terms.iter().map(|term| term.time).collect();
    answer.set_item("moduli", moduli.into_pyarray(py))?;
    answer.set_item("times", times.into_pyarray(py))?;
    answer.set_item("rms", found.rms)?;
    Ok(answer)
}
