//! The Langevin function and its inverses, hyperelastic laws and their fits.

use crate::error::value;
use crate::pool;
use crate::watch::stoppable;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use polycore::constitutive::Error;
use polycore::constitutive::hyperelastic::data::{Mode, TestData, TestState};
use polycore::constitutive::hyperelastic::{
    self, COMPRESSIBLE_MODELS, Compressible, Coupling, Hyperelastic, MODELS, ModelKind, TwistedCylinder,
    Volumetric, fit, homogeneous,
};
use polycore::langevin::{self as chain, Inverse};
use polycore::tensor::{DeformationGradient, Tensor};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;
use std::sync::atomic::Ordering;

/// Least number of values that are distributed to threads.
const PARALLEL_FROM: usize = 1 << 14;

/// Number of values that a thread computes at once.
const CHUNK: usize = 1 << 12;

/// Evaluates a function of Langevin statistics at each number; `method` is the inverse.
#[pyfunction]
pub fn langevin<'py>(
    py: Python<'py>,
    function: &str,
    x: PyReadonlyArray1<'py, f64>,
    method: &str,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let known = Inverse::ALL.into_iter().find(|one| one.name() == method).ok_or_else(|| {
        let names: Vec<&str> = Inverse::ALL.iter().map(|one| one.name()).collect();
        value(format!("method: found {method:?}; allowed: {}", names.join(", ")))
    })?;
    let x = x.as_slice()?;
    let work = || match function {
        "langevin" => Some(evaluate(x, chain::langevin)),
        "derivative" => Some(evaluate(x, chain::derivative)),
        "free_energy" => Some(evaluate(x, chain::free_energy)),
        "inverse" => Some(evaluate(x, |x| known.value(x))),
        "inverse_derivative" => Some(evaluate(x, |x| known.derivative(x))),
        _ => None,
    };
    let found = py.detach(|| pool::in_pool(work))?;
    found.map(|found| found.into_pyarray(py)).ok_or_else(|| value(format!("no function {function}")))
}

fn evaluate(x: &[f64], function: impl Fn(f64) -> f64 + Sync) -> Vec<f64> {
    if x.len() < PARALLEL_FROM {
        return x.iter().map(|&x| function(x)).collect();
    }
    x.par_iter().with_min_len(CHUNK).map(|&x| function(x)).collect()
}

/// Lists name, source and published error, in per cent, of each inverse.
#[pyfunction]
pub fn langevin_methods() -> Vec<(&'static str, &'static str, Option<&'static str>)> {
    Inverse::ALL.iter().map(|one| (one.name(), one.source(), one.published_error())).collect()
}

/// Name, unit and example value.
type ParameterRow = (&'static str, &'static str, f64);

/// Lists each law, with name, unit and example value of each of its parameters.
#[pyfunction]
pub fn models() -> Vec<(&'static str, Vec<ParameterRow>)> {
    let parameters = |model: &hyperelastic::ModelDescriptor| {
        model.parameters.iter().zip(model.example).map(|(p, &example)| (p.name, p.unit, example)).collect()
    };
    MODELS.iter().chain(COMPRESSIBLE_MODELS).map(|model| (model.key, parameters(model))).collect()
}

/// Hyperelastic law.
#[pyclass(frozen, module = "polymech._polymech")]
pub struct Law {
    key: String,
    values: Vec<f64>,
    volumetric: Option<(String, f64)>,
    published: bool,
    law: Box<dyn Hyperelastic>,
}

#[pymethods]
impl Law {
    #[new]
    fn new(
        key: String,
        values: Vec<f64>,
        volumetric: Option<(String, f64)>,
        published: bool,
    ) -> PyResult<Self> {
        let known: Vec<&str> = MODELS.iter().chain(COMPRESSIBLE_MODELS).map(|model| model.key).collect();
        let refused = |_| value(format!("law: found {key:?}; allowed: {}", known.join(", ")));
        let model = hyperelastic::any_model(&key).map_err(refused)?;
        if model.kind == ModelKind::Compressible && (volumetric.is_some() || published) {
            return Err(value(format!("volumetric: allowed: none, {key} has its own")));
        }
        let law = model.law(&values).map_err(value)?;
        let term = match &volumetric {
            None => None,
            Some((name, lame)) => Some(match name.as_str() {
                "quadratic" => Volumetric::Quadratic { lame: *lame },
                "logarithmic" => Volumetric::Logarithmic { lame: *lame },
                "ciarlet" => Volumetric::Ciarlet { lame: *lame },
                "pressure" => Volumetric::Pressure { pressure: *lame },
                other => {
                    let allowed = "quadratic, logarithmic, ciarlet, pressure";
                    return Err(value(format!("volumetric: found {other:?}; allowed: {allowed}")));
                }
            }),
        };
        let coupling = if published { Coupling::AsPublished } else { Coupling::StressFree };
        let law: Box<dyn Hyperelastic> = match (term, published) {
            (None, false) => law,
            (term, _) => Box::new(
                Compressible::with_coupling(law, term.unwrap_or(Volumetric::None), coupling)
                    .map_err(value)?,
            ),
        };
        Ok(Self { key, values, volumetric, published, law })
    }

    fn __getnewargs__(&self) -> (String, Vec<f64>, Option<(String, f64)>, bool) {
        (self.key.clone(), self.values.clone(), self.volumetric.clone(), self.published)
    }

    fn name(&self) -> String {
        self.law.name()
    }

    fn parameters(&self) -> Vec<(String, f64)> {
        self.law.parameters()
    }

    fn shear_modulus(&self) -> f64 {
        self.law.shear_modulus()
    }

    /// Computes nominal stresses P₁, P₂, (N, 2), of an incompressible sheet stretched to λ₁, λ₂.
    fn biaxial<'py>(
        &self,
        py: Python<'py>,
        first: PyReadonlyArray1<'py, f64>,
        second: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (first, second) = (first.as_slice()?, second.as_slice()?);
        let law = &*self.law;
        let at = |k: usize| homogeneous::biaxial(law, first[k], second[k]);
        let found = points(py, first.len().min(second.len()), at)?;
        let count = found.len();
        found.into_iter().flatten().collect::<Vec<_>>().into_pyarray(py).reshape([count, 2])
    }

    /// Computes 2M/(πR³) and N/(πR²), (N, 2), of an incompressible cylinder of radius R, held at a stretch
    /// and twisted to an amount of shear at its surface.
    fn torsion<'py>(
        &self,
        py: Python<'py>,
        stretch: PyReadonlyArray1<'py, f64>,
        shear: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (stretch, shear) = (stretch.as_slice()?, shear.as_slice()?);
        let law = &*self.law;
        let at = |k: usize| TwistedCylinder { stretch: stretch[k], shear: shear[k] }.stresses(law);
        let found = points(py, stretch.len().min(shear.len()), at)?;
        let count = found.len();
        found.into_iter().flatten().collect::<Vec<_>>().into_pyarray(py).reshape([count, 2])
    }

    /// Computes W, (N, 1), P, σ or S, (N, 9), at each F, (N, 9).
    fn at_gradient<'py>(
        &self,
        py: Python<'py>,
        what: &str,
        gradients: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows = gradients.as_slice()?;
        if gradients.as_array().ncols() != 9 {
            return Err(value("F: allowed: (N, 9)"));
        }
        let law = &*self.law;
        let count = rows.len() / 9;
        let gradient = |k: usize| DeformationGradient::new(Tensor::from_row_slice(&rows[9 * k..9 * k + 9]));
        let flat = |tensor: Tensor| tensor.transpose().as_slice().to_vec();
        let at = |k: usize| -> Result<Vec<f64>, Error> {
            let f = gradient(k)?;
            Ok(match what {
                "energy" => vec![law.energy(&f)?],
                "piola" => flat(law.first_piola_kirchhoff(&f)?),
                "cauchy" => flat(law.cauchy(&f)?),
                _ => flat(law.second_piola_kirchhoff(&f)?),
            })
        };
        let found = points(py, count, at)?;
        let width = if what == "energy" { 1 } else { 9 };
        found.into_iter().flatten().collect::<Vec<_>>().into_pyarray(py).reshape([count, width])
    }

    fn predict<'py>(
        &self,
        py: Python<'py>,
        c: PyReadonlyArray2<'py, f64>,
        tangent: bool,
        rounding: f64,
    ) -> PyResult<Bound<'py, PyDict>> {
        crate::predict::predict(py, &self.law, &c, tangent, false, rounding)
    }
}

/// Evaluates a function at `count` points, on all threads if there are many; returns the first error.
fn points<T: Send>(
    py: Python<'_>,
    count: usize,
    at: impl Fn(usize) -> Result<T, Error> + Sync,
) -> PyResult<Vec<T>> {
    let one = |k: usize| at(k).map_err(|error| format!("point {k}: {error}"));
    let found: Result<Vec<T>, String> = match count < 256 {
        true => py.detach(|| (0..count).map(one).collect()),
        false => stoppable(py, |stop| {
            let stopped = |k| if stop.load(Ordering::Relaxed) { Err(String::new()) } else { one(k) };
            (0..count).into_par_iter().with_min_len(64).map(stopped).collect()
        })?,
    };
    found.map_err(value)
}

/// Fits a law to nominal stresses: P₁ at λ₁ of a `mode`, (P₁, P₂) at (λ₁, λ₂) of `biaxial` rows, or
/// (2M/(πR³), N/(πR²)) at (λ, ψR) of `torsion` rows.
#[pyfunction]
pub fn fit_law<'py>(
    py: Python<'py>,
    key: &str,
    tests: Vec<(String, PyReadonlyArray2<'py, f64>)>,
) -> PyResult<Bound<'py, PyDict>> {
    let mut states = Vec::new();
    for (name, rows) in &tests {
        let known = [
            Mode::Uniaxial,
            Mode::Equibiaxial,
            Mode::PureShear,
            Mode::SimpleShear,
            Mode::Biaxial,
            Mode::Torsion,
        ];
        let mode = known.into_iter().find(|mode| mode.name() == name).ok_or_else(|| {
            value(format!("test: found {name:?}; allowed: {}", known.map(Mode::name).join(", ")))
        })?;
        for row in rows.as_array().rows() {
            let state = match (mode, row.as_slice()) {
                (Mode::Biaxial, Some(&[first, second, p, q])) => {
                    TestState::new(mode, [first, second], [p, q])
                }
                (Mode::Torsion, Some(&[stretch, shear, torque, force])) => {
                    TestState::new(mode, TwistedCylinder { stretch, shear }.surface(), [torque, force])
                }
                (Mode::SimpleShear, Some(&[amount, stress])) => TestState::simple_shear(amount, stress),
                (_, Some(&[stretch, nominal])) if ![Mode::Biaxial, Mode::Torsion].contains(&mode) => {
                    TestState::new(mode, [stretch, mode.second_stretch(stretch)], [nominal, 0.0])
                }
                _ => {
                    return Err(value(format!(
                        "{name}: found {} columns; allowed: 2, of biaxial tests and torsion 4",
                        row.len()
                    )));
                }
            };
            state.principal_stretches().map_err(value)?;
            states.push(state);
        }
    }
    let table = TestData::new(String::new(), states);
    let model = hyperelastic::any_model(key).map_err(value)?;
    let found = stoppable(py, |stop| fit::fit_until(model, &table, &|| stop.load(Ordering::Relaxed)))?;
    let found = found.map_err(value)?;
    let answer = PyDict::new(py);
    let parameters: Vec<_> =
        found.parameters.iter().map(|p| (p.name, p.unit, p.value, p.standard_error)).collect();
    answer.set_item("parameters", parameters)?;
    answer.set_item("rms", found.rms)?;
    answer.set_item("measurements", found.measurements)?;
    answer.set_item("evaluations", found.iterations)?;
    answer.set_item("draws", PyArray2::from_vec2(py, &found.draws).map_err(value)?)?;
    Ok(answer)
}
