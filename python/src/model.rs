//! Models of `peri`, described in a few lines of Python.

use crate::bond::BondLaw;
use crate::error::{fault, value};
use crate::pool;
use crate::watch::{RunLink, Watchers, watched};
use harness::case::{Fault, Step, StepField};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArray1};
use peri::Error;
use peri::bonds::{BodyGeometry, VolumeCorrection};
use peri::calibrate::Calibration;
use peri::critical::Convention;
use peri::geometry::{Cut, Shape};
use peri::material::BondMaterial;
use peri::model::{self, Body, Model, Rubber};
use peri::potential::Law;
use peri::solver::{DynamicRelaxation, Lbfgs, State, Status, StepRecord, Support, VelocityVerlet};
use peri::stress::{self, StressMethod, StressTensor};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::HashMap;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};

/// Prescribed region: a function that selects positions, (N, D); displacement and body force of the selected
/// points.
type PrescribedRegion = (Py<PyAny>, Vec<Option<f64>>, Vec<f64>);

/// Model as described in Python; lengths in m.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct SimulationSpec {
    /// `add` or `cut`, the shape, its numbers.
    shapes: Vec<(String, String, Vec<f64>)>,
    /// Two ends of a crack in a plane; in space a corner and two edges.
    cracks: Vec<Vec<f64>>,
    spacing: f64,
    horizon: f64,
    partial_volumes: bool,
    space: String,
    thickness: f64,
    law: Py<PyAny>,
    youngs_modulus: f64,
    links: f64,
    dissociation: f64,
    lattice_calibration: bool,
    critical_stretch: Option<f64>,
    fracture_energy: Option<f64>,
    convention: String,
    regions: Vec<PrescribedRegion>,
    steps: usize,
    contact: Option<f64>,
}

/// Solution method with its settings.
#[derive(Clone, Copy)]
enum SolutionMethod {
    Lbfgs(Lbfgs),
    Relaxation(DynamicRelaxation),
    Verlet(VelocityVerlet),
}

/// Body in the plane or in space.
trait AnyBody: Send + Sync {
    fn dimension(&self) -> usize;
    fn solve(&mut self, method: SolutionMethod, line: &RunLink<'_>) -> Result<(), Error>;
    fn positions(&self) -> Vec<f64>;
    fn displacements(&self) -> Vec<f64>;
    fn set_velocity(&mut self, velocity: &[f64]);
    fn history(&self) -> Vec<(&'static str, &'static str, Vec<f64>)>;
    fn stress(&self, which: &str, measure: StressMethod) -> Result<Vec<f64>, Error>;
    fn intact(&self) -> Vec<u32>;
    fn fragments(&self) -> usize;
    fn extend(&mut self, factors: Vec<f64>);
}

type BondSimulation<const D: usize> = model::Simulation<D, BondMaterial<'static>>;

fn interruption() -> Error {
    Error::Shared(polycore::Error::Interrupted { program: "peri", output: Default::default() })
}

impl<const D: usize> AnyBody for BondSimulation<D> {
    fn dimension(&self) -> usize {
        D
    }

    fn solve(&mut self, method: SolutionMethod, line: &RunLink<'_>) -> Result<(), Error> {
        let sites: Vec<usize> = self.bonds.particles().iter().map(|&site| site as usize).collect();
        let positions = line.wants_steps().then(|| self.positions());
        let watch =
            |_: &Status| if line.stop().load(Ordering::Relaxed) { Err(interruption()) } else { Ok(()) };
        let finished = |state: &State<D>| {
            let (Some(positions), Some(record)) = (&positions, state.history.last()) else { return Ok(()) };
            if state.control.round > 0 {
                return Ok(());
            }
            let field = |name, data| StepField { name, unit: "m", components: D, data };
            let displacement = sites.iter().flat_map(|&site| state.displacement.get(site)).collect();
            let step = Step {
                values: StepRecord::SCALARS.map(|(name, unit, get)| (name, unit, get(record))).to_vec(),
                fields: vec![field("position", positions.clone()), field("displacement", displacement)],
            };
            if line.step(step) { Ok(()) } else { Err(interruption()) }
        };
        match method {
            SolutionMethod::Lbfgs(method) => self.solve_watched(method, watch, finished),
            SolutionMethod::Relaxation(method) => self.solve_watched(method, watch, finished),
            SolutionMethod::Verlet(method) => self.solve_watched(method, watch, finished),
        }
    }

    fn positions(&self) -> Vec<f64> {
        BondSimulation::displacements(self).flat_map(|(position, _)| position).collect()
    }

    fn displacements(&self) -> Vec<f64> {
        BondSimulation::displacements(self).flat_map(|(_, displacement)| displacement).collect()
    }

    fn set_velocity(&mut self, velocity: &[f64]) {
        let sites = self.bonds.particles().iter().zip(velocity.chunks_exact(D));
        for (&site, value) in sites {
            self.state.velocity.set(site as usize, std::array::from_fn(|d| value[d]));
        }
    }

    fn history(&self) -> Vec<(&'static str, &'static str, Vec<f64>)> {
        let rows = BondSimulation::history(self);
        StepRecord::SCALARS.map(|(name, unit, get)| (name, unit, rows.iter().map(get).collect())).to_vec()
    }

    fn stress(&self, which: &str, measure: StressMethod) -> Result<Vec<f64>, Error> {
        let flat = |tensors: Vec<StressTensor<D>>| tensors.into_iter().flatten().flatten().collect();
        Ok(match which {
            "piola" => flat(self.piola(measure)?),
            "deformation" => flat(stress::deformation_gradients(&self.bonds, &self.state.displacement)),
            _ => flat(self.cauchy(measure)?),
        })
    }

    fn intact(&self) -> Vec<u32> {
        let count = |&site: &u32| {
            let mut count = 0;
            self.bonds.neighbours(site as usize, &mut |_| count += 1);
            count
        };
        self.bonds.particles().iter().map(count).collect()
    }

    fn fragments(&self) -> usize {
        BondSimulation::fragments(self)
    }

    fn extend(&mut self, factors: Vec<f64>) {
        self.factors.extend(factors);
    }
}

/// Model with particles, bonds and state.
#[pyclass(module = "polymech._polymech")]
pub struct Simulation {
    body: Box<dyn AnyBody>,
    whole: Vec<u32>,
}

#[pymethods]
impl Simulation {
    #[new]
    fn new(py: Python<'_>, spec: SimulationSpec) -> PyResult<Self> {
        let sampled = match spec.law.bind(py).cast::<BondLaw>() {
            Ok(law) => Some(law.get().law.clone()),
            Err(_) => None,
        };
        let named = if sampled.is_none() { Some(spec.law.extract::<String>(py)?) } else { None };
        // an exception of a region's function
        let raised = Arc::new(Mutex::new(None));
        let built = py.detach(|| match spec.space.as_str() {
            "solid" => build::<3>(spec, sampled, named, &raised),
            _ => build::<2>(spec, sampled, named, &raised),
        });
        if let Some(raised) = raised.lock().ok().and_then(|mut raised| raised.take()) {
            return Err(raised);
        }
        let body = built?;
        Ok(Self { whole: body.intact(), body })
    }

    /// Solves the remaining load steps; returns `False` if `on_step` stopped it.
    #[pyo3(signature = (method, settings, threads, on_step))]
    fn solve(
        &mut self,
        py: Python<'_>,
        method: &str,
        settings: HashMap<String, f64>,
        threads: Option<usize>,
        on_step: Option<Py<PyAny>>,
    ) -> PyResult<bool> {
        let method = parse_method(method, settings)?;
        let watchers = Watchers { progress: None, on_step };
        let body = &mut self.body;
        match watched(py, &watchers, threads, |line| body.solve(method, &line))? {
            Ok(()) => Ok(true),
            Err(error) if error.is_interruption() => Ok(false),
            Err(error) => Err(fault(&error)),
        }
    }

    /// Adds load steps.
    fn extend(&mut self, factors: Vec<f64>) {
        self.body.extend(factors);
    }

    fn set_velocity(&mut self, velocity: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        let found = velocity.as_slice()?;
        let allowed = self.body.positions().len();
        if found.len() != allowed {
            return Err(value(format!("velocity: found {} numbers; allowed: {allowed}", found.len())));
        }
        self.body.set_velocity(found);
        Ok(())
    }

    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.vectors(py, self.body.positions())
    }

    fn displacements<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.vectors(py, self.body.displacements())
    }

    /// Returns name and unit of each column, and its values, a row for each step.
    fn history<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let columns = PyDict::new(py);
        for (name, unit, values) in self.body.history() {
            columns.set_item(name, (unit, values.into_pyarray(py)))?;
        }
        Ok(columns)
    }

    /// Computes `cauchy` or `piola` stress, Pa, or the `deformation` gradient, (N, D, D).
    fn tensors<'py>(
        &self,
        py: Python<'py>,
        which: &str,
        measure: &str,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let known = StressMethod::ALL.into_iter().find(|one| one.name() == measure).ok_or_else(|| {
            let names: Vec<&str> = StressMethod::ALL.iter().map(|one| one.name()).collect();
            value(format!("measure: found {measure:?}; allowed: {}", names.join(", ")))
        })?;
        let found =
            py.detach(|| pool::in_pool(|| self.body.stress(which, known)))?.map_err(|error| fault(&error))?;
        let d = self.body.dimension();
        let count = found.len() / (d * d);
        found.into_pyarray(py).reshape(vec![count, d, d])
    }

    /// Share of its bonds that each particle has lost.
    fn damage<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let now = self.body.intact();
        let lost =
            now.iter().zip(&self.whole).map(|(&now, &whole)| 1.0 - f64::from(now) / f64::from(whole.max(1)));
        lost.collect::<Vec<f64>>().into_pyarray(py)
    }

    fn fragments(&self) -> usize {
        self.body.fragments()
    }
}

impl Simulation {
    fn vectors<'py>(&self, py: Python<'py>, flat: Vec<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let d = self.body.dimension();
        let count = flat.len() / d;
        flat.into_pyarray(py).reshape([count, d])
    }
}

/// Creates a shape from its name and numbers.
fn shape<const D: usize>(kind: &str, numbers: &[f64]) -> PyResult<Shape<D>> {
    let vector = |from: usize| -> [f64; D] { std::array::from_fn(|d| numbers[from + d]) };
    match (kind, numbers.len()) {
        ("box", n) if n == 2 * D => Ok(Shape::Box { min: vector(0), max: vector(D) }),
        ("ball", n) if n == D + 1 => Ok(Shape::Ball { centre: vector(0), radius: numbers[D] }),
        ("cylinder", n) if n == D + 3 && D == 3 && [0.0, 1.0, 2.0].contains(&numbers[D + 2]) => {
            Ok(Shape::Cylinder {
                centre: vector(0),
                radius: numbers[D],
                length: numbers[D + 1],
                axis: numbers[D + 2] as usize,
            })
        }
        _ => Err(value(format!("shape: found a {kind} of {} numbers in {D} dimensions", numbers.len()))),
    }
}

fn build<const D: usize>(
    spec: SimulationSpec,
    sampled: Option<Arc<crate::bond::Sampled>>,
    named: Option<String>,
    raised: &Arc<Mutex<Option<PyErr>>>,
) -> PyResult<Box<dyn AnyBody>>
where
    Body<D>: InSpace,
{
    let mut shapes = spec.shapes.iter();
    let Some((_, kind, numbers)) = shapes.next() else { return Err(value("a body needs a shape")) };
    let mut body = Body::<D>::lattice(shape(kind, numbers)?, spec.spacing).horizon(spec.horizon);
    for (operation, kind, numbers) in shapes {
        let shape = shape(kind, numbers)?;
        body = if operation == "cut" { body.cut(shape) } else { body.join(shape) };
    }
    for numbers in &spec.cracks {
        body = body.crack(cut::<D>(numbers)?);
    }
    if spec.partial_volumes {
        body = body.volume_correction(VolumeCorrection::Linear);
    }
    let body = body.in_space(&spec.space, spec.thickness)?;
    let calibration = if spec.lattice_calibration { Calibration::Lattice } else { Calibration::Continuum };
    let rubber = match (sampled, named) {
        (Some(law), _) => Rubber::with_law(law, spec.youngs_modulus),
        (None, name) => {
            let name = name.unwrap_or_default();
            let law = Law::ALL.into_iter().find(|law| law.name() == name).ok_or_else(|| {
                let known: Vec<&str> = Law::ALL.iter().map(|law| law.name()).collect();
                value(format!("law: found {name:?}; allowed: {}, or a function", known.join(", ")))
            })?;
            Rubber::new(law, spec.youngs_modulus).chains(spec.links, spec.dissociation)
        }
    };
    let rubber = rubber.calibration(calibration);
    let rubber = match (spec.critical_stretch, spec.fracture_energy) {
        (Some(stretch), _) => rubber.critical_stretch(stretch),
        (None, Some(energy)) => {
            let all = [Convention::Tearing, Convention::Bonds, Convention::Softening];
            let named = all.into_iter().find(|one| one.name() == spec.convention).ok_or_else(|| {
                let found = &spec.convention;
                value(format!("convention: found {found:?}; allowed: tearing, bonds, softening"))
            })?;
            rubber.fracture_energy_by(named, energy)
        }
        (None, None) => rubber,
    };
    let mut model = Model::new(body, rubber).steps(spec.steps);
    if let Some(stiffness) = spec.contact {
        model = model.contact(stiffness);
    }
    for (region, displacement, force) in spec.regions {
        if displacement.len() != D || force.len() != D {
            let found = displacement.len().max(force.len());
            return Err(value(format!("a load: found {found} components; allowed: {D}")));
        }
        let support = Support {
            displacement: std::array::from_fn(|d| displacement[d]),
            body_force: std::array::from_fn(|d| force[d]),
        };
        let raised = raised.clone();
        let inside = move |points: &[[f64; D]]| {
            select_points(&region, points).map_err(|error| {
                if let Ok(mut raised) = raised.lock() {
                    raised.get_or_insert(error);
                }
                Error::geometry("a region of Python failed".to_owned())
            })
        };
        model = model.support_where(inside, support);
    }
    model.build().map(|built| Box::new(built) as Box<dyn AnyBody>).map_err(|error| fault(&error))
}

/// Selects the points for which a function of Python returns true.
fn select_points<const D: usize>(region: &Py<PyAny>, points: &[[f64; D]]) -> PyResult<Vec<bool>> {
    Python::attach(|py| {
        let flat: Vec<f64> = points.iter().flatten().copied().collect();
        let points = flat.into_pyarray(py).reshape([points.len(), D])?;
        let answer = region.call1(py, (points,))?;
        Ok(answer.extract::<PyReadonlyArray1<'_, bool>>(py)?.as_array().to_vec())
    })
}

fn cut<const D: usize>(numbers: &[f64]) -> PyResult<Cut<D>> {
    if numbers.len() != D * D {
        return Err(value(format!("crack: found {} numbers; allowed: {}", numbers.len(), D * D)));
    }
    let vector = |from: usize| -> [f64; D] { std::array::from_fn(|d| numbers[from + d]) };
    // the other end in a plane, the edges in space
    let edge = |k: usize| match D {
        2 if k == 0 => std::array::from_fn(|d| numbers[2 + d] - numbers[d]),
        2 => [0.0; D],
        _ if k + 1 < D => vector(D * (k + 1)),
        _ => [0.0; D],
    };
    Ok(Cut { corner: vector(0), edges: std::array::from_fn(edge) })
}

/// Bodies of one dimension, placed in plane stress, plane strain or space.
trait InSpace: Sized {
    fn in_space(self, space: &str, thickness: f64) -> PyResult<Self>;
}

impl InSpace for Body<2> {
    fn in_space(self, space: &str, thickness: f64) -> PyResult<Self> {
        match space {
            "plane-stress" => Ok(self.plane_stress(thickness)),
            "plane-strain" => Ok(self.plane_strain(thickness)),
            _ => Err(value(format!("space: found {space:?}; allowed: plane-stress, plane-strain"))),
        }
    }
}

impl InSpace for Body<3> {
    fn in_space(self, _: &str, _: f64) -> PyResult<Self> {
        Ok(self)
    }
}

/// Creates a method from its name and some of its settings.
fn parse_method(name: &str, mut settings: HashMap<String, f64>) -> PyResult<SolutionMethod> {
    let mut take = |name: &str, default: f64| settings.remove(name).unwrap_or(default);
    let method = match name {
        "lbfgs" => {
            let own = Lbfgs::default();
            SolutionMethod::Lbfgs(Lbfgs {
                tolerance: take("tolerance", 1e-4),
                max_iterations: take("max_iterations", own.max_iterations as f64) as u64,
                accept: take("accept", own.accept),
                ..own
            })
        }
        "relaxation" => {
            let own = DynamicRelaxation::default();
            SolutionMethod::Relaxation(DynamicRelaxation {
                tolerance: take("tolerance", own.tolerance),
                max_iterations: take("max_iterations", own.max_iterations as f64) as u64,
                accept: take("accept", own.accept),
                mass_safety: take("mass_safety", own.mass_safety),
            })
        }
        "verlet" => {
            let step = take("time_step", 0.0);
            SolutionMethod::Verlet(VelocityVerlet {
                density: take("density", 1000.0),
                time_step: (step > 0.0).then_some(step),
                safety: take("safety", 0.8),
                damping: take("damping", 0.0),
                ramp: take("ramp", 0.0),
                end_time: take("end_time", 0.0),
                records: take("records", 100.0) as usize,
            })
        }
        _ => return Err(value(format!("method: found {name:?}; allowed: lbfgs, relaxation, verlet"))),
    };
    match settings.keys().next() {
        None => Ok(method),
        Some(other) => Err(value(format!("unexpected setting {other:?}: `{name}` has no such setting"))),
    }
}
