//! Crystal of Table 3.1, grid of Table 3.2 and networks of Table 3.4, in numbers and pictures.

use crate::cell::{ChemicalElement, Crystal, LATTICE, Packing, amide_torsions};
use crate::error::Error;
use crate::md::{AXES, Protocol, RateGrid};
use crate::network::Architecture;
use crate::program::quantities as q;
use crate::program::scene::CrystalSpec;
use harness::output::picture::{LinePlot, Series};
use harness::report::{Named, Report};
use std::path::Path;

/// Builds and measures the crystal; draws `cell-xy.png`, `cell-yz.png` and the same for the supercell.
///
/// # Errors
/// Returns an error for a supercell with too many atoms, and I/O errors.
pub fn measure(spec: &CrystalSpec, output: &Path, report: &mut Report) -> Result<(), Error> {
    let cell = Crystal::unit_cell(&LATTICE, Packing::default())?;
    let supercell = cell.replicate(spec.cells)?;
    let mut value = |quantity: Named, value: f64| {
        report.value(quantity, value);
    };
    value(q::DENSITY.into(), cell.density());
    value(q::DENSITY_OF_FOUR.into(), 2.0 * cell.density());
    for (name, crystal) in [("cell", &cell), ("supercell", &supercell)] {
        value(q::ATOMS.named(&[name]), crystal.atoms.len() as f64);
        for (axis, length) in ["x", "y", "z"].iter().zip(crystal.lengths) {
            value(q::EDGE.named(&[name, axis]), length);
        }
    }
    let nitrogens = cell.atoms.iter().filter(|(element, _)| *element == ChemicalElement::N).count();
    value(q::MONOMERS.into(), nitrogens as f64);
    let bonds = cell.bonds();
    value(q::BONDS.into(), bonds.len() as f64);
    value(q::CHAINS.into(), cell.molecules() as f64);
    let neighbours = cell.bonds_of_atoms();
    for element in ChemicalElement::ALL {
        for count in 1..=4 {
            let matches = |(atom, own): &(&(ChemicalElement, [f64; 3]), &Vec<_>)| {
                atom.0 == element && own.len() == count
            };
            let found = cell.atoms.iter().zip(&neighbours).filter(matches).count();
            if found > 0 {
                value(
                    q::ATOMS_WITH_BONDS.named(&[&format!("{element:?}"), &count.to_string()]),
                    found as f64,
                );
            }
        }
    }
    let carbon = cell.angles(ChemicalElement::C, 4).map(f64::to_degrees);
    value(q::LEAST_ANGLE.into(), carbon[0]);
    value(q::GREATEST_ANGLE.into(), carbon[1]);
    for (first, second) in [
        (ChemicalElement::C, ChemicalElement::C),
        (ChemicalElement::C, ChemicalElement::H),
        (ChemicalElement::C, ChemicalElement::O),
        (ChemicalElement::C, ChemicalElement::N),
        (ChemicalElement::N, ChemicalElement::H),
    ] {
        let pair = format!("{first:?}{second:?}");
        let [shortest, longest] = cell.bond_lengths(first, second);
        value(q::SHORTEST_BOND.named(&[&pair]), shortest);
        value(q::LONGEST_BOND.named(&[&pair]), longest);
    }
    for (index, torsion) in amide_torsions(LATTICE.b / 2.0)?.into_iter().enumerate() {
        value(q::TORSION.named(&[&(index + 1).to_string()]), torsion.abs());
    }
    let (protocol, grid) = (Protocol::default(), RateGrid { levels: spec.levels, ..RateGrid::default() });
    let runs = grid.runs(&protocol)?;
    value(q::GRID_RUNS.into(), runs.len() as f64);
    let samples = (protocol.steps / protocol.every + 1) as f64 * runs.len() as f64;
    value(q::GRID_SAMPLES.into(), samples);
    let steps = protocol.steps as f64;
    for (axis, rates) in AXES.iter().zip(grid.rates(&protocol)) {
        let (Some(least), Some(greatest)) = (rates.first(), rates.last()) else { continue };
        // Table 3.2 prints the rates in 1e-6 per step of 0.5 fs, but states 1e-6/fs
        let printed = |rate: f64| rate * protocol.time_step * 1e6;
        value(q::LEAST_RATE.named(&[axis]), printed(*least));
        value(q::GREATEST_RATE.named(&[axis]), printed(*greatest));
        let ends = greatest * steps * protocol.time_step;
        value(q::GREATEST_STRAIN.named(&[axis]), ends);
        let per_fs = printed(*greatest) * 1e-6 * steps * protocol.time_step;
        value(q::STRAIN_IF_PER_FS.named(&[axis]), per_fs);
    }
    for number in 1..=4 {
        let network = Architecture::thesis(number)?;
        let name = format!("ANN-{number}");
        value(q::PARAMETERS.named(&[&name]), network.parameters() as f64);
        value(q::HIDDEN_LAYERS.named(&[&name]), (network.widths.len() - 2) as f64);
    }
    for (name, crystal) in [("cell", &cell), ("supercell", &supercell)] {
        for (view, [across, up]) in [("xy", [0, 1]), ("yz", [1, 2])] {
            let axes = ["x (Å)", "y (Å)", "z (Å)"];
            let [wide, high] = [crystal.lengths[across], crystal.lengths[up]];
            let mut plot = LinePlot::new(&format!("γ-PA12, {name}"))
                .axes(axes[across], axes[up])
                .size(460.0, (340.0 * high / wide).clamp(340.0, 1000.0) + 80.0);
            for element in ChemicalElement::ALL {
                let own = || crystal.atoms.iter().filter(|(other, _)| *other == element);
                let along = |axis: usize| own().map(|(_, p)| p[axis]).collect::<Vec<f64>>();
                plot = plot.series(Series::markers(&format!("{element:?}"), &along(across), &along(up)));
            }
            plot.write(output.join(format!("{name}-{view}.png")))?;
        }
    }
    Ok(())
}
