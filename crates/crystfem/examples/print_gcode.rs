//! A block printed from G-code: cells are added along its moves; temperature and crystallinity near the top.

use crystfem::material::Semicrystalline;
use crystfem::mesh::path::{CellSettings, parse};
use crystfem::printed::PrintedPart;
use crystfem::simulation::{Settings, Simulation};
use std::path::Path;

/// Returns four layers of twelve lines, 10 mm × 6 mm × 1 mm; `read_gcode` reads a file instead.
fn gcode() -> String {
    let mut lines = String::from("M104 S220\nM83\nG1 X0 Y0 Z0.25 F1800\n");
    for (layer, line) in (1..=4).flat_map(|layer| (0..12).map(move |line| (layer, line))) {
        let [from, to] = if line % 2 == 0 { [0, 10] } else { [10, 0] };
        let (y, z) = (0.5 * f64::from(line), 0.25 * f64::from(layer));
        lines += &format!("G0 X{from} Y{y} Z{z}\nG1 X{to} E0.52\n");
    }
    lines
}

/// Simulates the block until `later` seconds after the print.
pub fn printed(later: f64) -> Result<Simulation, crystfem::Error> {
    let path = parse(Path::new("block.gcode"), gcode().as_bytes())?;
    let end = path.duration();
    let cells = CellSettings::new([1e-3, 1e-3, 0.25e-3]);
    let part = PrintedPart::along_path(path, &cells, Semicrystalline::pa12()?)?;
    let mut simulation =
        part.hold_surface("bottom", 373.15).convection(15.0, 353.15).simulate(Settings::adaptive(1e-3))?;
    simulation.run_until(end + later)?;
    Ok(simulation)
}

#[allow(dead_code, reason = "the tests include this file and call what it shows")]
pub(crate) fn main() -> Result<(), crystfem::Error> {
    for later in [1.0, 10.0, 100.0] {
        let (simulation, top) = (printed(later)?, [5e-3, 3e-3, 0.9e-3]);
        let (kelvin, alpha) = (simulation.temperature_at(top), simulation.field_at("alpha", top));
        println!("{later:3} s after the print: {kelvin:.2?} K, α {alpha:.4?}");
    }
    Ok(())
}
