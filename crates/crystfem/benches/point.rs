//! Material point of the benchmarks.

use crystfem::kinetics::{KineticConstants, Kinetics};
use crystfem::material::{PointInput, Polymer, Semicrystalline, ThermalProperty};
use crystfem::melting::Melting;

/// Steps to measure: name, start temperature in K, and increment.
pub const STEPS: [(&str, f64, f64); 3] =
    [("cooling", 425.0, -0.5), ("heating", 425.0, 0.5), ("heating above melting", 500.0, 0.5)];

/// Creates PA12 with column 1 of Table 4.1, and latent heat in J/kg if given.
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

/// Creates a step of 0.5 s.
pub fn point(temperature: f64, increment: f64) -> PointInput {
    PointInput { temperature, increment, gradient: Default::default(), dt: 0.5 }
}
