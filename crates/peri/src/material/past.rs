//! Histories of particles: the state of a law at the start of a time step.

use serde::{Deserialize, Serialize};

/// History of a particle whose law has a state. All forces of a time step follow from it; it changes once, at
/// the end of the step.
#[derive(Clone, Debug, PartialEq)]
pub struct Past {
    /// State at the start of the step, packed by the law.
    pub state: Box<[f64]>,
    /// Duration of the step, s; 0 between steps.
    pub duration: f64,
    /// Greatest shear modulus of the stabilisation in the step, Pa.
    pub stabilisation: f64,
    /// Energy that law and forces refer to.
    pub part: EnergyPart,
}

/// Parts of the energy of a law with a state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EnergyPart {
    /// Energy stored at the end of the step.
    #[default]
    Stored,
    /// Stored energy and that dissipated in the step: stored if nothing had flowed in it.
    Trial,
    /// Energy that drives breaking.
    Driving,
}

/// Energy of a law with branches that drives breaking.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Driving {
    /// Energy of the equilibrium law: the fracture energy is intrinsic (Shrimali and Lopez-Pamies 2023,
    /// doi:10.1016/j.eml.2022.101944).
    #[default]
    Equilibrium,
    /// Energy of the equilibrium law and of the branches.
    Total,
}

/// Histories of all particles, the part of a checkpoint that follows from no displacement.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// Duration of the present step, s; 0 between steps.
    pub duration: f64,
    /// State and stabilisation of each particle in their order; empty without a law that has a state.
    pub values: Vec<f64>,
    /// Energy dissipated so far by branches, softening by the largest strain, and changes of the
    /// stabilisation, J.
    pub dissipated: f64,
}
