//! Materials: Abaqus' UMATHT without side effects: (input, old state) → (response, new state), with the old
//! state unchanged.

mod as_published;
mod conductor;
mod crystallization;
mod filled;
mod powder;
mod property;
mod rows;
mod semicrystalline;

pub use as_published::{PublishedSubroutine, Sign};
pub use conductor::Conductor;
pub use crystallization::{Crystallization, Grown};
pub use filled::{Filled, fill_elements};
pub use powder::Powder;
pub use property::{PropertyTable, REFERENCE_TEMPERATURE, ThermalProperty};
pub(crate) use rows::{Increments, Scratch};
pub use semicrystalline::{CONSTANT_NAMES, LARGEST_CHANGE, Polymer, Semicrystalline};

use crate::error::Error;
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;

/// Input of a material at one integration point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointInput {
    /// Temperature at the start of the increment, K.
    pub temperature: f64,
    /// Increment of temperature, K: the end is `temperature + increment`.
    pub increment: f64,
    /// ∇T at the end of the increment, K/m.
    pub gradient: Vector3<f64>,
    /// Time increment, s.
    pub dt: f64,
}

/// Output of a material at the end of an increment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThermalResponse {
    /// Internal energy per mass U, J/kg, from a fixed reference.
    pub energy: f64,
    /// ∂U/∂T at fixed Δt, the consistent tangent with ∂α/∂T, J/(kg K).
    pub d_energy_d_temperature: f64,
    /// Heat flux f = −k ∇T, W/m².
    pub flux: Vector3<f64>,
    /// ∂f/∂T, W/(m² K).
    pub d_flux_d_temperature: Vector3<f64>,
    /// ∂f/∂(∇T), W/(m K).
    pub d_flux_d_gradient: Matrix3<f64>,
    /// Suggested ratio of next to present increment (PNEWDT); `None` for no suggestion.
    pub step_ratio: Option<f64>,
}

/// A material for heat conduction, Eqs (4.16) and (4.17).
pub trait ThermalMaterial: Send + Sync {
    /// Mass density ρ, kg/m³.
    fn density(&self) -> f64;
    /// Names of the state variables (SDV), in order; empty for a plain conductor.
    fn state_names(&self) -> &'static [&'static str];
    /// State of fresh material at temperature T, K (SDVINI).
    fn initial_state(&self, temperature: f64, state: &mut [f64]);
    /// Names of the output quantities that follow from the state, in order; by default the state itself.
    fn field_names(&self) -> &'static [&'static str] {
        self.state_names()
    }
    /// Computes the output quantities from a state.
    fn fields(&self, state: &[f64], fields: &mut [f64]) {
        fields.copy_from_slice(state);
    }
    /// dα/dt of growing crystals at a temperature, 1/s; 0 for other materials.
    fn crystallization_rate(&self, _temperature: f64, _state: &[f64]) -> f64 {
        0.0
    }
    /// U of resting material at a temperature with a given state, J/kg: the energy brought in by a birth.
    fn energy(&self, temperature: f64, state: &[f64]) -> f64;
    /// Returns true if U is linear in T and the flux in ∇T for any state (which may evolve): no Newton
    /// iteration is needed.
    fn is_linear(&self) -> bool;
    /// Returns true if the flux is −k ∇T with the same k at any temperature and state: conduction is then
    /// assembled once, and with lumped capacity the energy is requested at nodes only, with ∇T = 0.
    fn constant_conductivity(&self) -> bool {
        self.is_linear()
    }
    /// Kirchhoff's potential θ = ∫k dT, W/m, and k at a temperature, if k changes so steeply that the flux in
    /// elements must follow from θ at their nodes, f = −D ∇θ (see [`ThermalProperty::jumps`]); `None` if the
    /// flux of [`Self::respond`] applies.
    fn potential(&self, _temperature: f64) -> Option<[f64; 2]> {
        None
    }
    /// Law of evolution if the state is z alone: points with the same law and temperature history share their
    /// growth. `None` if only [`Self::respond`] computes the state.
    fn crystals(&self) -> Option<&Crystallization> {
        None
    }
    /// Material of which this one fills a fraction; per mass, energies, states and their fields are the same.
    fn filling(&self) -> Option<&Arc<dyn ThermalMaterial>> {
        None
    }
    /// Computes the response to an increment, and the state at its end in `new`.
    ///
    /// # Errors
    /// [`Error::Parameter`] for temperatures that are not finite and a Δt that is not finite or below 0.
    fn respond(&self, at: &PointInput, old: &[f64], new: &mut [f64]) -> Result<ThermalResponse, Error>;
}

#[cfg(test)]
mod tests;
