//! Physics driven by the temperatures of a simulation: stress and warpage, healing of interfaces.
//!
//! A coupling is called at the start and after each accepted step
//! ([`Simulation::observe`](crate::simulation::Simulation::observe)), and saves and restores its state for
//! checkpoints.

mod bed;
pub mod compensation;
mod healing;
mod stress;

pub use bed::{bed_nodes, loose_elements};
pub use healing::{HealingCoupling, HealingInterface, HealingSettings, HealingState};
pub use stress::{STRAIN_STEP, StressCoupling, StressSettings, StressState};
