//! A printed part from the library equals that of the scene.

use crystfem::Error;
use crystfem::material::{Conductor, Semicrystalline, ThermalProperty};
use crystfem::mesh::layers::Layers;
use crystfem::mesh::{Bar, Grid, Substrate};
use crystfem::printed::PrintedPart;
use crystfem::program::scene::PartScene;
use crystfem::simulation::{Settings, Simulation};
use harness::scene::Source;
use std::sync::Arc;

const SCENE: &str = include_str!("../fixtures/printed_bar.toml");

fn glass() -> Conductor {
    Conductor::new(2500.0, ThermalProperty::Constant(1.0), ThermalProperty::Constant(800.0)).unwrap()
}

#[test]
fn equals_the_scene() {
    let substrate = Substrate { size: [0.06, 0.03], thickness: 4e-3, growth: 1.6 };
    let bar = Bar { substrate: Some(substrate), ..Bar::new([0.04, 0.01], 8, 5e-4) };
    let part = PrintedPart::bar(&bar, Semicrystalline::pa12().unwrap()).unwrap();
    let part = part.substrate(glass(), 353.15).layer_every(20.0).deposited_at(493.15);
    let part = part.hold_surface("bottom", 353.15).convection(15.0, 353.15).radiation(0.9, 353.15);
    let part = part.problem().unwrap();

    let source = Source::new("case.toml", SCENE);
    let scene: PartScene = source.parse().unwrap();
    let built = scene.mesh.build(&source).unwrap();
    let whole = scene.task(&source, built).unwrap().problem;
    assert_eq!(part.births, whole.births);
    assert_eq!(part.mesh.element_count(), whole.mesh.element_count());

    let settings = Settings::backward_euler(1.0);
    let temperatures = [Arc::new(part), whole].map(|problem| {
        let mut simulation = Simulation::new(problem, settings).unwrap();
        simulation.run_until(22.0).unwrap();
        simulation.temperatures(0.0)
    });
    // materials and conditions have another order, and so have sums
    let [a, b] = &temperatures;
    let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart < 1e-5, "{apart} K");
}

#[test]
fn errors_name_the_parameter() {
    let bar =
        || PrintedPart::bar(&Bar::new([0.01, 0.01], 2, 1e-3), Semicrystalline::pa12().unwrap()).unwrap();
    let fault = |part: PrintedPart| match part.problem() {
        Err(Error::Mesh(text)) => text,
        Err(Error::Parameter { name, .. }) => name.to_owned(),
        other => panic!("{:?}", other.map(|_| ())),
    };
    assert!(fault(bar().hold_surface("botom", 300.0)).starts_with("no surface `botom`; allowed: "));
    assert_eq!(fault(bar().layer_every(0.0)), "time between layers");
    let mesh = Grid::uniform([0.0; 3], [1.0; 3], [2, 2, 2]).unwrap().mesh("block").unwrap();
    let half: Vec<u32> = (0..4).collect();
    let layers = Layers { elements: vec![half], notes: Vec::new() };
    let part = PrintedPart::new(mesh, layers, Semicrystalline::pa12().unwrap());
    assert!(fault(part).starts_with("4 elements are in no layer"));
}
