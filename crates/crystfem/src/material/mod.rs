//! Materials: Abaqus' UMATHT without side effects. (Input, old state) → (response, new state); the old state
//! is never changed.

mod as_published;
mod conductor;
mod crystallization;
mod filled;
mod powder;
mod property;
mod rows;
mod semicrystalline;

pub use as_published::{AsPublished, Sign};
pub use conductor::Conductor;
pub use crystallization::{Crystallization, Grown};
pub use filled::{Filled, fill_elements};
pub use powder::Powder;
pub use property::{Property, REFERENCE_TEMPERATURE, Table};
pub(crate) use rows::{Increments, Scratch};
pub use semicrystalline::{CONSTANT_NAMES, LARGEST_CHANGE, Polymer, Semicrystalline};

use crate::error::Error;
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;

/// Where a material is asked, at one integration point. Temperatures in K.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Temperature at the start of the increment, K.
    pub temperature: f64,
    /// Increment of temperature, K: the end is `temperature + increment`.
    pub increment: f64,
    /// ∇T at the end of the increment, K/m.
    pub gradient: Vector3<f64>,
    /// Time increment, s.
    pub dt: f64,
}

/// What a material answers, at the end of the increment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Response {
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
    /// Suggested next increment over this one (PNEWDT); `None`: no wish.
    pub step_ratio: Option<f64>,
}

/// A material of heat conduction, Eq. (4.16)–(4.17).
pub trait ThermalMaterial: Send + Sync {
    /// Mass density ρ, kg/m³.
    fn density(&self) -> f64;
    /// Names of the state variables (SDV), in order; empty for a plain conductor.
    fn state_names(&self) -> &'static [&'static str];
    /// State of fresh material at temperature T, K (SDVINI).
    fn initial_state(&self, temperature: f64, state: &mut [f64]);
    /// Names of the quantities to show that follow from the state, in order; by default the state itself.
    fn field_names(&self) -> &'static [&'static str] {
        self.state_names()
    }
    /// These quantities.
    fn fields(&self, state: &[f64], fields: &mut [f64]) {
        fields.copy_from_slice(state);
    }
    /// dα/dt of crystals that grow at a temperature, 1/s; 0 for material without.
    fn crystallization_rate(&self, _temperature: f64, _state: &[f64]) -> f64 {
        0.0
    }
    /// U of material at rest at a temperature with a given state, J/kg: what birth brings in.
    fn energy(&self, temperature: f64, state: &[f64]) -> f64;
    /// Whether U is linear in T and the flux in ∇T whatever the state (which may evolve all the same): no
    /// Newton iteration is needed.
    fn is_linear(&self) -> bool;
    /// Whether the flux is −k ∇T with the same k at any temperature and state: conduction is then assembled
    /// once, and with lumped capacity the energy is requested at nodes only, with ∇T = 0.
    fn constant_conductivity(&self) -> bool {
        self.is_linear()
    }
    /// Kirchhoff's potential θ = ∫k dT, W/m, and k at a temperature, where k depends on it so steeply that
    /// the flux of elements must follow from θ at their nodes, f = −D ∇θ (see [`Property::jumps`]); `None`: f
    /// is that of [`Self::respond`].
    fn potential(&self, _temperature: f64) -> Option<[f64; 2]> {
        None
    }
    /// The law by which the state evolves, where the state is its z alone: points of one law and one
    /// temperature history then share their growth. `None`: only [`Self::respond`] knows.
    fn crystals(&self) -> Option<&Crystallization> {
        None
    }
    /// The material of which this one fills a part: per mass, energies, states and their fields are the same.
    fn filling(&self) -> Option<&Arc<dyn ThermalMaterial>> {
        None
    }
    /// The response to an increment; `new` is the state at its end.
    ///
    /// # Errors
    /// [`Error::Parameter`] for temperatures that are not finite and a Δt that is not finite or below 0.
    fn respond(&self, at: &Point, old: &[f64], new: &mut [f64]) -> Result<Response, Error>;
}

#[cfg(test)]
mod tests;
