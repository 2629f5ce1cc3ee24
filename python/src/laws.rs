//! The Langevin function and its inverses, hyperelastic laws and their fits.

use crate::error::value;
use crate::pool;
use crate::watch::stoppable;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use polycore::constitutive::Error;
use polycore::constitutive::hyperelastic::bulk::{VolumetricFit, VolumetricState};
use polycore::constitutive::hyperelastic::data::{Mode, TestData, TestState};
use polycore::constitutive::hyperelastic::{
    self, COMPRESSIBLE_MODELS, Compressible, Coupling, HELD_STRETCHES, Hyperelastic, MODELS, ModelKind,
    TwistedCylinder, Volumetric, check_torques, fit, homogeneous,
};
use polycore::langevin::{self as chain, Inverse};
use polycore::tensor::{DeformationGradient, Tensor};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;
use std::f64::consts::PI;
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

    /// Computes torque, N m, and axial force, N, (N, 2), of incompressible cylinders: twist, rad/m, radius,
    /// m, held stretch.
    fn torsion<'py>(
        &self,
        py: Python<'py>,
        twist: PyReadonlyArray1<'py, f64>,
        radius: PyReadonlyArray1<'py, f64>,
        stretch: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (twists, radii, stretches) = (twist.as_slice()?, radius.as_slice()?, stretch.as_slice()?);
        let count = twists.len().min(radii.len()).min(stretches.len());
        for k in 0..count {
            let refused = |what| value(format!("point {k}: {what}"));
            check_cylinder(twists[k], radii[k]).map_err(refused)?;
            if !(stretches[k] > 0.0 && stretches[k].is_finite()) {
                return Err(refused(format!("found a stretch of {}; allowed: above 0", stretches[k])));
            }
        }
        let law = &*self.law;
        let at = |k: usize| {
            let (twist, radius) = (twists[k], radii[k]);
            let cylinder = TwistedCylinder { stretch: stretches[k], shear: radius * twist.abs() };
            let [torque, force] = cylinder.stresses(law)?;
            let area = PI * radius * radius;
            Ok([twist.signum() * 0.5 * radius * area * torque, area * force])
        };
        let found = points(py, count, at)?;
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

/// Checks twist, rad/m, and radius, m, of a cylinder.
fn check_cylinder(twist: f64, radius: f64) -> Result<(), String> {
    if !twist.is_finite() {
        return Err(format!("found a twist of {twist} rad/m; allowed: a finite number"));
    }
    if !(radius > 0.0 && radius.is_finite()) {
        return Err(format!("found a radius of {radius} m; allowed: above 0"));
    }
    Ok(())
}

/// State of torsion from twist, rad/m, torque, N m, radius, m, axial force, N, and held stretch.
fn torsion_state([twist, torque, radius, force, stretch]: [f64; 5]) -> Result<TestState, String> {
    check_cylinder(twist, radius)?;
    if !HELD_STRETCHES.contains(&stretch) {
        let (low, high) = (HELD_STRETCHES.start(), HELD_STRETCHES.end());
        return Err(format!(
            "found a stretch of {stretch}; allowed: {low} to {high}, length over undeformed length"
        ));
    }
    let torque = if twist < 0.0 { -torque } else { torque };
    let surface = TwistedCylinder { stretch, shear: radius * twist.abs() }.surface();
    let area = PI * radius * radius;
    Ok(TestState::new(Mode::Torsion, surface, [2.0 * torque / (radius * area), force / area]))
}

/// Fits a law to nominal stresses: P₁ at λ₁ of a `mode`, (P₁, P₂) at (λ₁, λ₂) of `biaxial` rows, or to rows
/// of `torsion`: twist, torque, radius, axial force and held stretch.
#[pyfunction]
pub fn fit_law<'py>(
    py: Python<'py>,
    key: &str,
    tests: Vec<(String, PyReadonlyArray2<'py, f64>)>,
) -> PyResult<Bound<'py, PyDict>> {
    let (mut states, mut notes) = (Vec::new(), Vec::new());
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
        let begin = states.len();
        let rows = rows.as_array();
        if rows.nrows() == 0 {
            return Err(value(format!("{name}: found no rows; allowed: at least one measured state")));
        }
        for (k, row) in rows.rows().into_iter().enumerate() {
            if let Some(cell) = row.iter().find(|cell| !cell.is_finite()) {
                let allowed = "finite numbers; omit states without a measurement";
                return Err(value(format!("{name}: row {k}: found {cell}; allowed: {allowed}")));
            }
            let state = match (mode, row.as_slice()) {
                (Mode::Biaxial, Some(&[first, second, p, q])) => {
                    TestState::new(mode, [first, second], [p, q])
                }
                (Mode::Torsion, Some(&[twist, torque, radius, force, stretch])) => {
                    torsion_state([twist, torque, radius, force, stretch])
                        .map_err(|what| value(format!("{name}: row {k}: {what}")))?
                }
                (Mode::SimpleShear, Some(&[amount, stress])) => TestState::simple_shear(amount, stress),
                (_, Some(&[stretch, nominal])) if ![Mode::Biaxial, Mode::Torsion].contains(&mode) => {
                    TestState::new(mode, [stretch, mode.second_stretch(stretch)], [nominal, 0.0])
                }
                _ => {
                    return Err(value(format!(
                        "{name}: found {} columns; allowed: 2, of biaxial tests 4, of torsion 5",
                        row.len()
                    )));
                }
            };
            let refused = |error| value(format!("{name}: row {k}: {error}"));
            state.principal_stretches().map_err(refused)?;
            states.push(state);
        }
        if mode == Mode::Torsion {
            let refused = |(k, allowed): (usize, String)| {
                let (twist, torque) = (rows[[k, 0]], rows[[k, 1]]);
                let found = format!("a torque of {torque} N m at a twist of {twist} rad/m");
                value(format!("{name}: row {k}: found {found}; allowed: {allowed}"))
            };
            let note = check_torques(&states[begin..]).map_err(refused)?;
            notes.extend(note.map(|note| format!("{name}: {note}")));
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
    answer.set_item("notes", notes)?;
    answer.set_item("rms", found.rms)?;
    answer.set_item("measurements", found.measurements)?;
    answer.set_item("evaluations", found.iterations)?;
    answer.set_item("draws", PyArray2::from_vec2(py, &found.draws).map_err(value)?)?;
    Ok(answer)
}

/// Fits Dᵢ of U = Σ (J − 1)²ⁱ/Dᵢ to pressures, Pa, at ratios of volumes J.
#[pyfunction]
pub fn fit_volumetric<'py>(
    py: Python<'py>,
    ratios: PyReadonlyArray1<'py, f64>,
    pressures: PyReadonlyArray1<'py, f64>,
    terms: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let pairs = ratios.as_slice()?.iter().zip(pressures.as_slice()?);
    let states: Vec<VolumetricState> =
        pairs.map(|(&ratio, &pressure)| VolumetricState { ratio, pressure }).collect();
    let found = VolumetricFit::new(&states, terms).map_err(value)?;
    let answer = PyDict::new(py);
    answer.set_item("bulk", (found.bulk, found.bulk_error))?;
    answer.set_item("notes", found.warnings())?;
    answer.set_item("rms", found.rms)?;
    answer.set_item("compliances", found.compliances.into_pyarray(py))?;
    answer.set_item("errors", found.compliance_errors.into_pyarray(py))?;
    Ok(answer)
}
