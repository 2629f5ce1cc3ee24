//! Material of a print at a point, and fits of its kinetics.

use crate::error::fault;
use crate::watch::left_alone;
use crystfem::fit::{FixedConstants, KineticFit, Run, nakamura};
use crystfem::history::TemperatureHistory;
use crystfem::kinetics::{KineticConstants, Kinetics};
use crystfem::material::{Polymer, Semicrystalline, ThermalMaterial, ThermalProperty};
use crystfem::melting::Melting;
use crystfem::point::{Drive, PointProcess, Stepping};
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Polymer as described in Python, SI.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct MaterialPointSpec {
    density: f64,
    /// Temperatures, K (none for a constant), and values.
    conductivity: (Vec<f64>, Vec<f64>),
    specific_heat: (Vec<f64>, Vec<f64>),
    /// K₀, K_G, U, T₀, T∞, n.
    kinetics: [f64; 6],
    /// k_m, d, T_p.
    melting: Option<[f64; 3]>,
    crystallinity: f64,
    latent_heat: Option<f64>,
    seed: f64,
}

impl MaterialPointSpec {
    fn polymer(self) -> Result<Semicrystalline, crystfem::Error> {
        let property = |name: &'static str, (temperatures, values): (Vec<f64>, Vec<f64>)| match values[..] {
            [value] if temperatures.is_empty() => ThermalProperty::constant(name, value),
            _ => ThermalProperty::table(name, temperatures, values),
        };
        let [growth_rate, nucleation, activation_energy, equilibrium_melting, frozen, avrami_exponent] =
            self.kinetics;
        let constants = KineticConstants {
            growth_rate,
            nucleation,
            activation_energy,
            equilibrium_melting,
            frozen,
            avrami_exponent,
        };
        let melting = self.melting.map(|[sharpness, shape, peak]| Melting::new(sharpness, shape, peak));
        Semicrystalline::new(Polymer {
            density: self.density,
            conductivity: property("conductivity, W/(m K)", self.conductivity)?,
            specific_heat: property("specific heat, J/(kg K)", self.specific_heat)?,
            kinetics: Kinetics::new(constants)?,
            melting: melting.transpose()?,
            ultimate_crystallinity: self.crystallinity,
            latent_heat: self.latent_heat,
            seed: self.seed,
        })
    }
}

/// Computes the material under a temperature history (s, K): columns `time`, `temperature`, `energy`, `rate`
/// and its fields.
#[pyfunction]
pub fn course<'py>(
    py: Python<'py>,
    material: MaterialPointSpec,
    time: Vec<f64>,
    temperature: Vec<f64>,
    degree: f64,
    kelvin: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let solved = left_alone(py, move || {
        let material = material.polymer()?;
        let drive = Drive::Prescribed(TemperatureHistory::new(time, temperature)?);
        let stepping = Stepping::Adaptive { degree, kelvin };
        let curves = PointProcess { material: &material, drive, stepping }.run()?;
        Ok((curves, material.field_names()))
    })?;
    let (curves, names) = solved.map_err(|error: crystfem::Error| fault(&error))?;
    let columns = PyDict::new(py);
    for (index, name) in names.iter().enumerate() {
        let column: Vec<f64> = curves.fields.iter().map(|row| row[index]).collect();
        columns.set_item(*name, column.into_pyarray(py))?;
    }
    columns.set_item("time", curves.time.into_pyarray(py))?;
    columns.set_item("temperature", curves.temperature.into_pyarray(py))?;
    columns.set_item("energy", curves.energy.into_pyarray(py))?;
    columns.set_item("rate", curves.rate.into_pyarray(py))?;
    Ok(columns)
}

/// Fits K₀, K_G and n to α along temperature histories (s, K) that begin in the melt, after a first row in
/// it.
#[pyfunction]
pub fn fit_kinetics<'py>(
    py: Python<'py>,
    runs: Vec<[PyReadonlyArray1<'py, f64>; 3]>,
    known: [f64; 3],
) -> PyResult<Bound<'py, PyDict>> {
    let [equilibrium_melting, frozen, activation_energy] = known;
    let known = FixedConstants { equilibrium_melting, frozen, activation_energy };
    let run = |[times, temperatures, degrees]: &[PyReadonlyArray1<'py, f64>; 3]| Run {
        times: times.as_array().to_vec(),
        temperatures: temperatures.as_array().to_vec(),
        degrees: degrees.as_array().to_vec(),
        history: Vec::new(),
    };
    let runs: Vec<Run> = runs.iter().map(run).collect();
    let KineticFit { estimates, draws, rms, measurements, evaluations, model } =
        left_alone(py, move || nakamura(&runs, &known))?.map_err(|error| fault(&error))?;
    let answer = PyDict::new(py);
    let rows: Vec<_> =
        estimates.into_iter().map(|e| (e.name, e.unit, e.value, e.standard_error, e.interval)).collect();
    answer.set_item("parameters", rows)?;
    answer.set_item("draws", PyArray2::from_vec2(py, &draws).map_err(crate::error::value)?)?;
    answer.set_item("rms", rms)?;
    answer.set_item("measurements", measurements)?;
    answer.set_item("evaluations", evaluations)?;
    answer.set_item("model", model.into_pyarray(py))?;
    Ok(answer)
}
