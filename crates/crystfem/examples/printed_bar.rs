//! A bar of PA12 printed in eight layers on glass: temperature and crystallinity in the first and the last
//! layer.

use crystfem::material::{Conductor, Semicrystalline, ThermalProperty};
use crystfem::mesh::{Bar, Substrate};
use crystfem::printed::PrintedPart;
use crystfem::simulation::Settings;

pub(crate) fn main() -> Result<(), crystfem::Error> {
    let (plate, air) = (353.15, 353.15);
    let glass = Conductor::new(2500.0, ThermalProperty::Constant(1.0), ThermalProperty::Constant(800.0))?;
    let substrate = Substrate { size: [30e-3, 20e-3], thickness: 4e-3, growth: 1.6 };
    let bar = Bar { substrate: Some(substrate), ..Bar::new([20e-3, 10e-3], 8, 0.5e-3) };

    let part = PrintedPart::bar(&bar, Semicrystalline::pa12()?)?
        .substrate(glass, plate)
        .deposited_at(493.15)
        .layer_every(20.0)
        .hold_surface("bottom", plate)
        .convection(15.0, air)
        .radiation(0.9, air);
    let mut simulation = part.simulate(Settings::adaptive(1e-3))?;

    println!("{:>6} {:>26} {:>26}", "time", "layer 1", "layer 8");
    for time in [10.0, 50.0, 100.0, 150.0, 200.0, 300.0] {
        simulation.run_until(time)?;
        print!("{time:4.0} s");
        for place in [[0.0, 0.0, 0.25e-3], [0.0, 0.0, 3.75e-3]] {
            match (simulation.temperature_at(place), simulation.field_at("alpha", place)) {
                (Some(kelvin), Some(alpha)) => print!("{:13.2} °C, α {alpha:6.4}", kelvin - 273.15),
                _ => print!("{:>26}", "not printed yet"),
            }
        }
        println!();
    }
    Ok(())
}
