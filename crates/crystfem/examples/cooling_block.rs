//! Hot block of PA12 in still air: temperatures in its middle and at a corner, and energy balance.

use crystfem::boundary::{Condition, FaceSelection, Schedule};
use crystfem::material::{Conductor, ThermalProperty};
use crystfem::mesh::Grid;
use crystfem::problem::Problem;
use crystfem::simulation::{Settings, Simulation};
use std::sync::Arc;

pub(crate) fn main() -> Result<(), crystfem::Error> {
    let (density, conductivity, specific_heat) = (1010.0, 0.25, 2200.0);
    let material = Conductor::new(
        density,
        ThermalProperty::Constant(conductivity),
        ThermalProperty::Constant(specific_heat),
    )?;
    let mesh = Grid::uniform([0.0; 3], [0.01, 0.02, 0.03], [8, 16, 24])?.mesh("block")?;
    let film = Condition::Film {
        surface: FaceSelection::outer(),
        coefficient: Schedule::constant(15.0),
        ambient: Schedule::constant(293.15),
    };
    let problem = Problem { conditions: vec![film], ..Problem::new(mesh, Arc::new(material), 453.15) };
    let mut simulation = Simulation::new(problem, Settings::adaptive(0.1))?;
    for minute in 0..=5 {
        simulation.run_until(60.0 * f64::from(minute))?;
        let at = |place| simulation.temperature_at(place).unwrap_or(f64::NAN) - 273.15;
        let (middle, corner) = ([0.005, 0.01, 0.015], [0.0; 3]);
        println!("{minute} min: middle {:6.2} °C, corner {:6.2} °C", at(middle), at(corner));
    }
    let ledger = &simulation.state().ledger;
    println!(
        "{:.1} J lost through the surface, relative balance error {:.1e}",
        -ledger.exchange.total(),
        ledger.worst
    );
    Ok(())
}
