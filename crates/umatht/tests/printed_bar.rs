//! A bar printed layer by layer in CalculiX with the material of this crate, and in `crystfem`: node by node.

use crystfem::kinetics::{KineticConstants, Kinetics};
use crystfem::material::{Polymer, Semicrystalline, ThermalProperty};
use crystfem::melting::Melting;
use crystfem::mesh::{Bar, HEXAHEDRON_SIDES, Mesh};
use crystfem::printed::PrintedPart;
use crystfem::simulation::Settings;
use evidence::hosts;
use std::fmt::Write;
use std::path::Path;

const LAYERS: usize = 3;
const HEIGHT: f64 = 0.5e-3;
const INTERVAL: f64 = 10.0;
/// ΔH·X∞, J/kg.
const LATENT: f64 = 52_250.0;
/// Thickness of the film under each layer, so small that it neither insulates nor conducts along it: each
/// layer has its own nodes, and a birth conserves its energy.
const FILM: f64 = 1e-7;
const HALF: [f64; 2] = [2e-3, 1e-3];

/// A bar of 4 × 2 × 1.5 mm, elements of 0.5 × 0.5 × 0.125 mm.
fn bar() -> Bar {
    let [x, y] = HALF.map(|half| 2.0 * half);
    Bar { elements_per_layer: 4, element_size: 0.5e-3, ..Bar::new([x, y], LAYERS, HEIGHT) }
}

/// Temperatures of all existing nodes, K, at the end of each layer.
fn ours(latent: bool) -> Vec<Vec<Option<f64>>> {
    let material = Semicrystalline::new(Polymer {
        density: 1010.0,
        conductivity: ThermalProperty::Constant(0.25),
        specific_heat: ThermalProperty::Constant(2200.0),
        kinetics: Kinetics::new(KineticConstants::TABLE_4_1_COLUMN_1).unwrap(),
        melting: Some(Melting::PA12),
        ultimate_crystallinity: 0.25,
        latent_heat: latent.then_some(LATENT / 0.25),
        seed: 0.0,
    });
    let part = PrintedPart::bar(&bar(), material.unwrap()).unwrap().layer_every(INTERVAL);
    let part = part.hold_surface("bottom", 353.15).convection(15.0, 353.15);
    let mut simulation = part.simulate(Settings::adaptive(1e-4)).unwrap();
    let nodes = bar().mesh().unwrap().points.len() as u32;
    (1..=LAYERS)
        .map(|layer| {
            simulation.run_until(layer as f64 * INTERVAL).unwrap();
            (0..nodes).map(|node| simulation.temperature(node)).collect()
        })
        .collect()
}

/// Returns the layer of an element, from 0, and the numbers of its nodes in CalculiX: a node between two
/// layers exists twice.
fn element(mesh: &Mesh, nodes: &[u32; 8]) -> (usize, [usize; 8]) {
    let middle = nodes.iter().map(|&node| mesh.points[node as usize][2]).sum::<f64>() / 8.0;
    let layer = (middle / HEIGHT) as usize;
    (layer, nodes.map(|node| number(mesh, node, layer)))
}

fn number(mesh: &Mesh, node: u32, layer: usize) -> usize {
    let upper = layer > 0 && mesh.points[node as usize][2] < (layer as f64 + 1e-6) * HEIGHT;
    1 + node as usize + if upper { mesh.points.len() } else { 0 }
}

fn deck(mesh: &Mesh, latent: bool) -> String {
    let mut text = String::from("*NODE, NSET=ALL\n");
    let elements: Vec<(usize, [usize; 8])> =
        mesh.hexahedra.iter().map(|nodes| element(mesh, nodes)).collect();
    let mut places = std::collections::BTreeMap::new();
    for ((layer, numbers), nodes) in elements.iter().zip(&mesh.hexahedra) {
        for (number, node) in numbers.iter().zip(nodes) {
            let [x, y, z] = mesh.points[*node as usize];
            places.insert(*number, [x, y, z + *layer as f64 * FILM]);
        }
    }
    for (number, [x, y, z]) in &places {
        writeln!(text, "{number},{x:.9e},{y:.9e},{z:.9e}").unwrap();
    }
    let list = |nodes: &[usize]| nodes.iter().map(usize::to_string).collect::<Vec<_>>().join(",");
    let (mut next, mut films) = (elements.len(), String::new());
    // for each layer its faces: a side on the surface, or its top, which the next layer covers
    let mut exposed = vec![(Vec::new(), Vec::new()); LAYERS];
    for layer in 0..LAYERS {
        writeln!(text, "*ELEMENT, TYPE=C3D8, ELSET=L{layer}").unwrap();
        for (index, (own, numbers)) in (1..).zip(&elements) {
            if *own == layer {
                writeln!(text, "{index},{}", list(numbers)).unwrap();
            }
        }
        if layer > 0 {
            writeln!(films, "*ELEMENT, TYPE=C3D8, ELSET=F{layer}").unwrap();
        }
        for (index, ((own, numbers), nodes)) in (1..).zip(elements.iter().zip(&mesh.hexahedra)) {
            for (side, corners) in (1..).zip(HEXAHEDRON_SIDES).filter(|_| *own == layer) {
                let on = |axis: usize, place: f64| {
                    corners.iter().all(|&c| (mesh.points[nodes[c] as usize][axis] - place).abs() < 1e-9)
                };
                let (below, above) = (layer as f64 * HEIGHT, (layer + 1) as f64 * HEIGHT);
                if (0..2).any(|axis| on(axis, -HALF[axis]) || on(axis, HALF[axis])) {
                    exposed[layer].0.push((index, side));
                } else if on(2, above) {
                    exposed[layer].1.push((index, side));
                } else if on(2, below) && layer > 0 {
                    next += 1;
                    let under = corners.map(|c| number(mesh, nodes[c], layer - 1));
                    let over = corners.map(|c| numbers[c]);
                    // anticlockwise as seen from above
                    let turned = |face: [usize; 4]| [face[0], face[3], face[2], face[1]];
                    writeln!(films, "{next},{}", list(&[turned(under), turned(over)].concat())).unwrap();
                }
            }
        }
    }
    let sets = |prefix: &str, first: usize| -> String {
        (first..LAYERS).map(|layer| format!("{prefix}{layer},\n")).collect()
    };
    writeln!(
        text,
        "{films}*ELSET, ELSET=BAR\n{}*ELSET, ELSET=FILMS\n{}*MATERIAL, NAME=PA12\n*USER MATERIAL, \
         TYPE=THERMAL, CONSTANTS=6\n\
         0.25, 2200., {LATENT}, 1., 0., 1.\n*SPECIFIC HEAT\n2200.\n*DENSITY\n1010.\n*DEPVAR\n4\n\
         *SOLID SECTION, ELSET=BAR, MATERIAL=PA12\n\
         *MATERIAL, NAME=FILM\n*CONDUCTIVITY\n1.\n*SPECIFIC HEAT\n1.\n*DENSITY\n1.\n\
         *SOLID SECTION, ELSET=FILMS, MATERIAL=FILM\n\
         *INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL, 493.15\n*AMPLITUDE, NAME=ONE\n0., 1., 1e6, 1.\n\
         *NSET, NSET=BOTTOM",
        sets("L", 0),
        sets("F", 1)
    )
    .unwrap();
    for (node, _) in (1..).zip(&mesh.points).filter(|(_, place)| place[2] == 0.0) {
        writeln!(text, "{node},").unwrap();
    }
    for layer in 0..LAYERS {
        for (phase, (step, duration)) in [(0.005, 0.5), (0.025, INTERVAL - 0.5)].into_iter().enumerate() {
            let count = (duration / step).round() as usize;
            writeln!(
                text,
                "*STEP, INC={}\n*HEAT TRANSFER, DIRECT\n{step}, {duration}\n*CONTROLS, \
                            PARAMETERS=FIELD\n1e-6, 1e-4, , , 1e-6",
                count + 1
            )
            .unwrap();
            if (layer, phase) == (0, 0) {
                writeln!(text, "*MODEL CHANGE, TYPE=ELEMENT, REMOVE\n{}{}", sets("L", 1), sets("F", 1))
                    .unwrap();
            } else if phase == 0 {
                writeln!(text, "*MODEL CHANGE, TYPE=ELEMENT, ADD\nL{layer},\nF{layer},").unwrap();
            }
            writeln!(text, "*BOUNDARY, AMPLITUDE=ONE\nBOTTOM, 11, 11, 353.15").unwrap();
            writeln!(text, "*FILM, OP=NEW, AMPLITUDE=ONE, FILM AMPLITUDE=ONE").unwrap();
            let faces = (0..=layer).flat_map(|own| &exposed[own].0).chain(&exposed[layer].1);
            for (element, side) in faces {
                writeln!(text, "{element}, F{side}, 353.15, 15.").unwrap();
            }
            if latent {
                writeln!(text, "*DFLUX, OP=NEW").unwrap();
                (0..=layer).for_each(|own| writeln!(text, "L{own}, BFNU1010.").unwrap());
            }
            writeln!(text, "*NODE PRINT, NSET=ALL, FREQUENCY={count}\nNT\n*END STEP").unwrap();
        }
    }
    text
}

/// Compares the temperatures of all nodes at the end of each layer, without latent heat and with it. CalculiX
/// integrates with first order in time, in steps of 5 and 25 ms.
#[test]
fn node_by_node() {
    let Some(source) = hosts::calculix() else { return };
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("ccx");
    let library = hosts::static_library("umatht");
    let latent_heat = Path::new(env!("CARGO_MANIFEST_DIR")).join("include/dflux.f");
    hosts::link_calculix(&source, &[&latent_heat, &library], &["-u,umatht_"], &program);
    let mesh = bar().mesh().unwrap();
    let (mut off, mut warmest, mut last) = (0.0_f64, 0.0_f64, Vec::new());
    for latent in [false, true] {
        let own = ours(latent);
        let (_, results) = hosts::run_calculix(&program, folder.path(), &deck(&mesh, latent));
        // the second half of each layer
        let blocks: Vec<&str> = results.split("temperatures").skip(1).collect();
        assert_eq!(blocks.len(), 2 * LAYERS);
        for (layer, (block, own)) in blocks.iter().skip(1).step_by(2).zip(&own).enumerate() {
            let mut compared = 0;
            for line in block.lines() {
                let numbers: Vec<f64> =
                    line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
                let [number, kelvin] = numbers[..] else { continue };
                // upper nodes of films do not exist here
                if let Some(Some(own)) = own.get(number as usize - 1) {
                    off = off.max((own - kelvin).abs());
                    compared += 1;
                }
            }
            assert_eq!(compared, own.iter().flatten().count(), "layer {layer}");
        }
        last.push(own.into_iter().last().unwrap());
    }
    let pairs = || last[0].iter().zip(&last[1]).filter_map(|(without, with)| Some(((*without)?, (*with)?)));
    let change = pairs().fold(0.0_f64, |most, (without, with)| most.max(with - without));
    pairs().for_each(|(_, with)| warmest = warmest.max(with - 353.15));
    eprintln!("latent heat changes {change} K of {warmest} K; CalculiX is off by {off} K");
    // with steps twice as long 0.16 K, which is first order; at its end the last layer is 29 K above the
    // chamber
    evidence::at_most("printed bar in CalculiX, K", off, 0.15);
    evidence::at_most("printed bar in CalculiX, of what latent heat changes", off / change, 0.03);
}
