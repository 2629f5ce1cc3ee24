//! Equations of the existing elements: Eq. (4.16) discretized in space, independent of the time integrator.
//!
//! At each node i, with the energy E_i and the heat Q_i that leaves the node,
//!
//! dE_i/dt + Q_i = 0, E_i = ∫ N_i ρU dV, Q_i = −∫ ∇N_i·f dV + ∮ N_i q dA − ∫ N_i r dV.
//!
//! A [`ThermalSystem`] grows when elements appear; nodes without existing elements have no equation. It holds
//! the pattern and constant coefficients; [`ThermalSystem::evaluate`] computes E, Q and their tangents at a
//! temperature.
//!
//! There are three kinds of materials: linear ones have no points; those with only the conductivity constant
//! are evaluated at nodes (one point per node, material and birth); all others at the integration points of
//! each element.

mod build;
mod classes;
mod face_matrices;
mod general;
mod nodal;
mod node_elements;
mod numbering;
mod rows;
mod surfaces;
pub mod vector;

pub use build::{Added, PointMoves};
pub use face_matrices::FaceMatrices;
pub use general::ElementPoints;
pub use nodal::NodalPoints;
#[cfg(test)]
pub use rows::RowBuilder;
pub(crate) use rows::bands;
pub use rows::{ConductionRows, Diagonal};
pub use surfaces::{Exchange, Surfaces};

use crate::error::Error;
use crate::material::{PointInput, ThermalMaterial};
use crate::problem::{Capacity, Problem};
use nalgebra::{Matrix3, Vector3};

/// No equation.
pub const NONE: u32 = u32::MAX;

/// Constant properties of a material.
#[derive(Clone, Copy, Debug)]
pub struct MaterialBehaviour {
    /// Conductivity k, W/(m K), if constant.
    pub conductivity: Option<Matrix3<f64>>,
    /// Heat capacity ρc, J/(m³ K), if U is linear in T.
    pub capacity: Option<f64>,
    /// Number of state variables.
    pub states: usize,
    /// True if the flux follows Kirchhoff's potential.
    pub potential: bool,
}

impl MaterialBehaviour {
    /// Returns true if the material has points at nodes.
    pub fn nodal(&self) -> bool {
        self.conductivity.is_some() && (self.capacity.is_none() || self.states > 0)
    }
}

impl MaterialBehaviour {
    /// Evaluates the material once to find its constant properties.
    ///
    /// # Errors
    /// Errors of the material; [`Error::Parameter`] for a conductivity or a capacity that is not positive.
    pub fn from_material(material: &dyn ThermalMaterial, capacity: Capacity) -> Result<Self, Error> {
        let states = material.state_names().len();
        let linear = material.is_linear();
        let potential = material.potential(300.0).is_some();
        let mut behaviour = Self { conductivity: None, capacity: None, states, potential };
        if !linear && (capacity == Capacity::Consistent || !material.constant_conductivity()) {
            return Ok(behaviour);
        }
        let at = PointInput { temperature: 300.0, increment: 0.0, gradient: Vector3::zeros(), dt: 1.0 };
        let mut old = vec![0.0; states];
        material.initial_state(at.temperature, &mut old);
        let mut new = old.clone();
        let response = material.respond(&at, &old, &mut new)?;
        let conductivity = -response.d_flux_d_gradient;
        let conductivity = 0.5 * (conductivity + conductivity.transpose());
        if !conductivity.iter().all(|k| k.is_finite()) || conductivity.cholesky().is_none() {
            return Err(Error::Parameter {
                name: "conductivity",
                found: conductivity[(0, 0)],
                allowed: "above 0 W/(m K) in every direction, finite".into(),
            });
        }
        behaviour.conductivity = Some(conductivity);
        if linear {
            let capacity = response.d_energy_d_temperature;
            if !(capacity > 0.0 && capacity.is_finite()) {
                return Err(Error::Parameter {
                    name: "specific heat",
                    found: capacity,
                    allowed: "above 0 J/(kg K), finite".into(),
                });
            }
            behaviour.capacity = Some(material.density() * capacity);
        }
        Ok(behaviour)
    }
}

/// States and energies of material points.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PointStates {
    /// State variables, point by point.
    pub state: Vec<f64>,
    /// Energies U, J/kg; empty at nodes if all materials are linear.
    pub energy: Vec<f64>,
}

/// Material points at nodes and in elements.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PointMemory {
    /// Points at nodes.
    pub nodal: PointStates,
    /// Points in elements.
    pub general: PointStates,
}

/// Input of an evaluation.
#[derive(Clone, Copy)]
pub struct StepInput<'a> {
    /// Temperatures of the existing nodes, K.
    pub temperature: &'a [f64],
    /// Temperatures at the start of the increment, K.
    pub start: &'a [f64],
    /// Length of the increment, s.
    pub dt: f64,
    /// Time at the end, s.
    pub time: f64,
    /// Requests tangents.
    pub tangent: bool,
}

/// Evaluated E, Q and tangents.
#[derive(Clone, Debug, Default)]
pub struct Evaluation {
    /// E_i − E_i(start), J.
    pub change: Vec<f64>,
    /// Q_i, W.
    pub rate: Vec<f64>,
    /// ∂E_i/∂T_i, J/K; row sums with consistent capacity; empty if equal to that of the system.
    pub capacity: Vec<f64>,
    /// Equations with contributions of surfaces to ∂Q_i/∂T_i, W/K; with consistent capacity see `faces`.
    pub conductance: Vec<(u32, f64)>,
    /// ∂Q/∂T of surfaces with consistent capacity.
    pub faces: FaceMatrices,
    /// Heat flow through surfaces and from sources, W.
    pub exchange: Exchange,
    /// Smallest ratio of next to present increment requested by a material.
    pub step_ratio: Option<f64>,
    /// Points at the end of the increment.
    pub memory: PointMemory,
    /// Number of calls of `respond`.
    pub responses: u64,
    scratch: Vec<f64>,
}

impl Evaluation {
    /// ∂E_i/∂T_i, J/K; row sums with consistent capacity.
    pub fn capacity<'a>(&'a self, system: &'a ThermalSystem) -> &'a [f64] {
        if self.capacity.is_empty() { &system.capacity } else { &self.capacity }
    }
}

/// Equations of the existing elements.
pub struct ThermalSystem {
    /// Number of elements.
    pub elements: usize,
    /// Equation of each node of the mesh, or [`NONE`].
    pub equation: Vec<u32>,
    /// Conduction K, and M with consistent capacity.
    pub rows: ConductionRows,
    /// Capacity of linear materials, row sums, J/K.
    pub capacity: Vec<f64>,
    /// Points at nodes.
    pub nodal: NodalPoints,
    /// Points in elements.
    pub general: ElementPoints,
    /// Conditions on faces, and sources.
    pub surfaces: Surfaces,
    /// Equations with prescribed temperature and their conditions, ascending.
    pub fixed: Vec<(u32, u32)>,
    /// 0 at equations that are prescribed or out of use, 1 elsewhere.
    pub free: Vec<f64>,
    /// True for consistent capacity.
    pub consistent: bool,
    /// Number of this build.
    pub build: u64,
    /// Number of tangents built: the matrix is unchanged while it is.
    pub generation: u64,
    /// Time of the last evaluation, s.
    evaluated_at: f64,
    plan: build::AssemblyPlan,
}

impl ThermalSystem {
    /// Number of equations, including those out of use.
    pub fn size(&self) -> usize {
        self.capacity.len()
    }

    /// Mesh node of each equation, also of those out of use, which are not free and have no capacity.
    pub fn nodes(&self) -> &[u32] {
        &self.plan.numbering.nodes[..self.size()]
    }

    /// Returns true if no Newton iteration is needed.
    pub fn is_linear(&self) -> bool {
        self.is_linear_inside() && !self.surfaces.radiates()
    }

    /// Returns true if energy and flux of all elements are linear in temperature.
    pub fn is_linear_inside(&self) -> bool {
        !self.nodal.coupled && self.general.is_empty()
    }

    /// Returns true for a symmetric tangent.
    pub fn is_symmetric(&self) -> bool {
        !self.general.potential
    }

    /// Sets the temperatures prescribed at a time.
    pub fn prescribe(&self, problem: &Problem, time: f64, temperature: &mut [f64]) {
        for &(equation, condition) in &self.fixed {
            if let crate::boundary::Condition::Temperature { value, .. } =
                &problem.conditions[condition as usize]
            {
                let node = self.nodes()[equation as usize];
                temperature[equation as usize] = value.value_at(problem.mesh.points[node as usize], time);
            }
        }
    }

    /// Evaluates E, Q and, if requested, their tangents; `old` are the points at the start of the increment.
    ///
    /// # Errors
    /// [`Error::NotFinite`] of a material.
    pub fn evaluate(
        &mut self,
        problem: &Problem,
        at: &StepInput,
        old: &PointMemory,
        out: &mut Evaluation,
    ) -> Result<(), Error> {
        let size = self.size();
        for field in [&mut out.change, &mut out.rate] {
            field.resize(size, 0.0);
        }
        out.step_ratio = None;
        self.rows.restore();
        // linear materials
        if self.consistent {
            out.scratch.resize(size, 0.0);
            vector::set(&mut out.scratch, |k| at.temperature[k] - at.start[k]);
            let Evaluation { scratch, rate, change, .. } = &mut *out;
            self.rows.flow_and_capacity(at.temperature, scratch, rate, change);
        } else {
            self.rows.flow(at.temperature, &mut out.rate);
            vector::set(&mut out.change, |k| self.capacity[k] * (at.temperature[k] - at.start[k]));
        }
        out.capacity.clear();
        if self.nodal.coupled || !self.general.is_empty() {
            out.capacity.extend_from_slice(&self.capacity);
        }
        out.conductance.clear();
        // other materials
        self.nodal.evaluate(problem, at, &old.nodal, out)?;
        if !self.general.is_empty() {
            self.general.evaluate(problem, self.consistent, at, &old.general, &mut self.rows, out)?;
            self.generation += u64::from(at.tangent);
        }
        self.generation += u64::from(self.surfaces.varies(problem, [self.evaluated_at, at.time]));
        self.evaluated_at = at.time;
        self.surfaces.evaluate(problem, &self.plan.numbering.nodes, at, out);
        Ok(())
    }
}
