//! Stress and warpage of a printed bar of PA12, on the bed and released.

use crystfem::coupling::{StressCoupling, StressSettings};
use crystfem::material::Semicrystalline;
use crystfem::mechanics::SolidifyingMaxwell;
use crystfem::mesh::Bar;
use crystfem::printed::PrintedPart;
use crystfem::simulation::{Settings, Simulation};
use std::sync::Arc;

/// Returns the largest Mises stress on the bed and after the release, Pa, and the warpage, m.
pub fn bar() -> Result<[f64; 3], crystfem::Error> {
    let part = PrintedPart::bar(&Bar::new([20e-3, 5e-3], 4, 0.5e-3), Semicrystalline::pa12()?)?;
    let problem =
        Arc::new(part.layer_every(20.0).hold_surface("bottom", 353.15).convection(15.0, 353.15).problem()?);
    let mut simulation = Simulation::new(problem.clone(), Settings::adaptive(1e-3))?;

    let bears = vec![true; problem.mesh.element_count()];
    let law = SolidifyingMaxwell::pa12();
    let settings = StressSettings::new(&problem.mesh, law, bears, Some("bottom"))?;
    let mut stress = StressCoupling::new(&problem.mesh, settings)?;
    stress.after_step(&simulation)?;
    simulation.observe(200.0, |simulation| stress.after_step(simulation))?;
    stress.finish(&simulation)?;
    Ok([stress.mises_on_bed(), stress.largest_mises(), stress.warpage()])
}

#[allow(dead_code, reason = "the tests include this file and call what it shows")]
pub(crate) fn main() -> Result<(), crystfem::Error> {
    let [on_bed, released, warpage] = bar()?;
    println!("largest Mises stress {:.2} MPa on the bed, {:.2} MPa released", on_bed / 1e6, released / 1e6);
    println!("warpage of the bed side {:.1} µm", warpage * 1e6);
    Ok(())
}
