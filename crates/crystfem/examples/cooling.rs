//! PA12 cooled at three rates: temperature of half crystallization, and crystals that survive heating.

use crystfem::kinetics::{KineticConstants, Kinetics, cooling_curve};
use crystfem::melting::Melting;

pub(crate) fn main() -> Result<(), crystfem::Error> {
    let kinetics = Kinetics::new(KineticConstants::TABLE_4_1_COLUMN_1)?;
    for rate in [1.0, 2.0, 10.0] {
        let curve = cooling_curve(&kinetics, rate / 60.0, 473.15, 373.15, 0.0, 2);
        let half = curve.temperature_at(0.5).map_or(f64::NAN, |kelvin| kelvin - 273.15);
        println!("{rate:>4} K/min: half of the crystals at {half:.2} °C");
    }
    for temperature in [440.0, 450.0, 460.0] {
        let left = 1.0 - Melting::PA12.molten(temperature);
        println!("{temperature} K: {:.4} of the crystals survive", left);
    }
    Ok(())
}
