//! What the crystal of Table 3.1, the grid of Table 3.2 and the networks of Table 3.4 are, in numbers and pictures.

use crate::cell::{Crystal, Element, LATTICE, Packing, amide_torsions};
use crate::error::Error;
use crate::md::{AXES, Grid, Protocol};
use crate::network::Architecture;
use crate::scene::CrystalSpec;
use polycore::output::picture::{LinePlot, Series};
use polycore::report::Report;
use std::path::Path;

/// Builds the crystal and measures it; writes `cell-xy.png`, `cell-yz.png` and the same of the supercell.
///
/// # Errors
/// A supercell of too many atoms; I/O errors.
pub fn measure(spec: &CrystalSpec, output: &Path, report: &mut Report) -> Result<(), Error> {
    let cell = Crystal::unit_cell(&LATTICE, Packing::default())?;
    let supercell = cell.replicate(spec.cells)?;
    let mut value = |name: String, value: f64, unit: &str| {
        report.value(&name, value, unit);
    };
    value("density".into(), cell.density(), "g/cm³");
    value("density of four chains in a cell".into(), 2.0 * cell.density(), "g/cm³");
    for (name, crystal) in [("cell", &cell), ("supercell", &supercell)] {
        value(format!("{name} atoms"), crystal.atoms.len() as f64, "");
        for (axis, length) in ["x", "y", "z"].iter().zip(crystal.lengths) {
            value(format!("{name} edge {axis}"), length, "Å");
        }
    }
    let nitrogens = cell.atoms.iter().filter(|(element, _)| *element == Element::N).count();
    value("cell monomers".into(), nitrogens as f64, "");
    let bonds = cell.bonds();
    value("cell bonds".into(), bonds.len() as f64, "");
    value("cell chains".into(), chains(&cell) as f64, "");
    let mut of_atom = vec![Vec::new(); cell.atoms.len()];
    for (i, j, d) in &bonds {
        of_atom[*i].push(*d);
        of_atom[*j].push(-d);
    }
    for element in Element::ALL {
        for count in 1..=4 {
            let with =
                |(atom, own): &(&(Element, [f64; 3]), &Vec<_>)| atom.0 == element && own.len() == count;
            let found = cell.atoms.iter().zip(&of_atom).filter(with).count();
            if found > 0 {
                value(format!("{element:?} with {count} bonds"), found as f64, "");
            }
        }
    }
    let mut carbon = [f64::INFINITY, f64::NEG_INFINITY];
    for (_, own) in cell.atoms.iter().zip(&of_atom).filter(|((e, _), own)| *e == Element::C && own.len() == 4)
    {
        for (index, a) in own.iter().enumerate() {
            for b in &own[..index] {
                let angle = a.angle(b).to_degrees();
                carbon = [carbon[0].min(angle), carbon[1].max(angle)];
            }
        }
    }
    value("least angle of a CH₂".into(), carbon[0], "°");
    value("greatest angle of a CH₂".into(), carbon[1], "°");
    let atoms = &cell.atoms;
    let lengths = |first: Element, second: Element| {
        let own = bonds.iter().filter(move |(i, j, _)| {
            let pair = [atoms[*i].0, atoms[*j].0];
            pair == [first, second] || pair == [second, first]
        });
        own.map(|(_, _, d)| d.norm()).collect::<Vec<f64>>()
    };
    for (first, second) in [
        (Element::C, Element::C),
        (Element::C, Element::H),
        (Element::C, Element::O),
        (Element::C, Element::N),
        (Element::N, Element::H),
    ] {
        let all = lengths(first, second);
        let name = format!("{first:?}–{second:?} bond");
        value(format!("shortest {name}"), all.iter().copied().fold(f64::INFINITY, f64::min), "Å");
        value(format!("longest {name}"), all.iter().copied().fold(0.0, f64::max), "Å");
    }
    for (index, torsion) in amide_torsions(LATTICE.b / 2.0)?.into_iter().enumerate() {
        value(format!("torsion {} beside the amide", index + 1), torsion.abs(), "°");
    }
    let (protocol, grid) = (Protocol::default(), Grid { levels: spec.levels, ..Grid::default() });
    let runs = grid.runs(&protocol)?;
    value("runs of the grid".into(), runs.len() as f64, "");
    let samples = (protocol.steps / protocol.every + 1) as f64 * runs.len() as f64;
    value("samples of the grid".into(), samples, "");
    let steps = protocol.steps as f64;
    for (axis, rates) in AXES.iter().zip(grid.rates(&protocol)) {
        let (Some(least), Some(greatest)) = (rates.first(), rates.last()) else { continue };
        // Table 3.2 prints them in 1e-6 a step of 0.5 fs, and calls them 1e-6/fs
        let printed = |rate: f64| rate * protocol.time_step * 1e6;
        value(format!("least rate in {axis}"), printed(*least), "1e-6 per step");
        value(format!("greatest rate in {axis}"), printed(*greatest), "1e-6 per step");
        let ends = greatest * steps * protocol.time_step;
        value(format!("strain that the greatest rate in {axis} reaches"), ends, "");
        value(
            format!("strain if the printed rate in {axis} were per fs"),
            printed(*greatest) * 1e-6 * steps * protocol.time_step,
            "",
        );
    }
    for number in 1..=4 {
        let network = Architecture::thesis(number)?;
        value(format!("ANN-{number} parameters"), network.parameters() as f64, "");
        value(format!("ANN-{number} hidden layers"), (network.widths.len() - 2) as f64, "");
    }
    for (name, crystal) in [("cell", &cell), ("supercell", &supercell)] {
        for (view, [across, up]) in [("xy", [0, 1]), ("yz", [1, 2])] {
            let axes = ["x (Å)", "y (Å)", "z (Å)"];
            let [wide, high] = [crystal.lengths[across], crystal.lengths[up]];
            let mut plot = LinePlot::new(&format!("γ-PA12, {name}"))
                .axes(axes[across], axes[up])
                .size(460.0, (340.0 * high / wide).clamp(340.0, 1000.0) + 80.0);
            for element in Element::ALL {
                let own = || crystal.atoms.iter().filter(|(other, _)| *other == element);
                let along = |axis: usize| own().map(|(_, p)| p[axis]).collect::<Vec<f64>>();
                plot = plot.series(Series::markers(&format!("{element:?}"), &along(across), &along(up)));
            }
            plot.write(output.join(format!("{name}-{view}.png")))?;
        }
    }
    Ok(())
}

/// Molecules of a periodic cell, by its bonds.
fn chains(cell: &Crystal) -> usize {
    let mut of: Vec<usize> = (0..cell.atoms.len()).collect();
    for (i, j, _) in cell.bonds() {
        let (from, to) = (of[i], of[j]);
        of.iter_mut().filter(|own| **own == from).for_each(|own| *own = to);
    }
    of.sort_unstable();
    of.dedup();
    of.len()
}
