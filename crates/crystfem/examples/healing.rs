//! Healing between layers of PA12: with longer layer times, layers are colder and interfaces heal less.

use crystfem::coupling::{HealingCoupling, HealingSettings};
use crystfem::healing::Healing;
use crystfem::material::Semicrystalline;
use crystfem::mesh::Bar;
use crystfem::printed::PrintedPart;
use crystfem::simulation::{Settings, Simulation};
use std::sync::Arc;

/// Returns the least and mean degree of healing of a bar with a layer every `interval`, s.
pub fn healed(interval: f64) -> Result<Option<[f64; 2]>, crystfem::Error> {
    let part = PrintedPart::bar(&Bar::new([10e-3, 5e-3], 4, 0.5e-3), Semicrystalline::pa12()?)?;
    let part = part.layer_every(interval).hold_surface("bottom", 353.15).convection(15.0, 353.15);
    let problem = Arc::new(part.problem()?);
    let mut simulation = Simulation::new(problem.clone(), Settings::adaptive(1e-3))?;

    // relaxation time 2 s at 180 °C, activation energy 60 kJ/mol (assumed)
    let law = Healing::new(2.0, 453.15, 60e3)?;
    let settings = HealingSettings::new(&problem.mesh, &problem.material_of, &problem.births, 0, law)?;
    let mut healing = HealingCoupling::new(settings);
    healing.after_step(&simulation);
    simulation.observe(4.0 * interval + 60.0, |simulation| {
        healing.after_step(simulation);
        Ok(())
    })?;
    Ok(healing.least_and_mean(1.0))
}

#[allow(dead_code, reason = "the tests include this file and call what it shows")]
pub(crate) fn main() -> Result<(), crystfem::Error> {
    for interval in [2.0, 10.0, 50.0] {
        println!("a layer every {interval:2} s: least and mean degree of healing {:.3?}", healed(interval)?);
    }
    Ok(())
}
