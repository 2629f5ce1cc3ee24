//! The material point that is measured; `cargo bench` takes it, too.

use crystfem::kinetics::{KineticConstants, Kinetics};
use crystfem::material::{PointInput, Polymer, Semicrystalline, ThermalProperty};
use crystfem::melting::Melting;

/// What is asked of it: a name, the temperature before in K, and its increment.
pub const STEPS: [(&str, f64, f64); 3] =
    [("cooling", 425.0, -0.5), ("heating", 425.0, 0.5), ("heating above melting", 500.0, 0.5)];

/// PA12 after column 1 of Table 4.1, with latent heat in J/kg or without.
pub fn polymer(latent_heat: Option<f64>) -> Result<Semicrystalline, crystfem::Error> {
    Semicrystalline::new(Polymer {
        density: 1010.0,
        conductivity: ThermalProperty::Constant(0.25),
        specific_heat: ThermalProperty::Constant(2200.0),
        kinetics: Kinetics::new(KineticConstants::TABLE_4_1_COLUMN_1)?,
        melting: Some(Melting::PA12),
        ultimate_crystallinity: 0.25,
        latent_heat,
        seed: 0.3,
    })
}

/// A step of 0.5 s.
pub fn point(temperature: f64, increment: f64) -> PointInput {
    PointInput { temperature, increment, gradient: Default::default(), dt: 0.5 }
}
