//! Materials, meshes and conditions shared by tests.

use crystfem::boundary::{Condition, FaceSelection, Field, Schedule};
use crystfem::kinetics::{KineticConstants, Kinetics};
use crystfem::ledger::StepBalance;
use crystfem::material::{Conductor, Polymer, Semicrystalline, ThermalMaterial, ThermalProperty};
use crystfem::melting::Melting;
use crystfem::mesh::{Grid, Mesh};
use crystfem::simulation::Simulation;
use std::ops::ControlFlow;
use std::sync::Arc;

/// PA12 as in `reference/ch4/analytic.py`: k, ρ, c.
pub const PA12: [f64; 3] = [0.25, 1010.0, 2200.0];

pub fn conductor([k, density, c]: [f64; 3]) -> Arc<dyn ThermalMaterial> {
    let property = |name, value| ThermalProperty::constant(name, value).unwrap();
    Arc::new(Conductor::new(density, property("k", k), property("c", c)).unwrap())
}

/// Creates semicrystalline PA12, Table 4.1, column 1.
pub fn pa12(latent_heat: Option<f64>) -> Arc<dyn ThermalMaterial> {
    let polymer = Polymer {
        density: PA12[1],
        conductivity: ThermalProperty::constant("k", PA12[0]).unwrap(),
        specific_heat: ThermalProperty::constant("c", PA12[2]).unwrap(),
        kinetics: Kinetics::new(KineticConstants::TABLE_4_1_COLUMN_1).unwrap(),
        melting: Some(Melting::PA12),
        ultimate_crystallinity: 0.25,
        latent_heat,
        seed: 0.0,
    };
    Arc::new(Semicrystalline::new(polymer).unwrap())
}

pub fn grid(lengths: [f64; 3], elements: [usize; 3]) -> Mesh {
    Grid::uniform([0.0; 3], lengths, elements).unwrap().mesh("body").unwrap()
}

pub fn held(mesh: &Mesh, side: &str, value: Field) -> Condition {
    Condition::Temperature { nodes: mesh.node_sets[side].clone(), value }
}

pub fn film(surface: FaceSelection, coefficient: f64, ambient: f64) -> Condition {
    Condition::Film {
        surface,
        coefficient: Schedule::constant(coefficient),
        ambient: Schedule::constant(ambient),
    }
}

pub fn radiation(surface: FaceSelection, emissivity: f64, ambient: f64) -> Condition {
    Condition::Radiation { surface, emissivity, ambient: Schedule::constant(ambient) }
}

pub fn everywhere() -> FaceSelection {
    FaceSelection::Outer { except: Vec::new() }
}

/// Advances the simulation and returns all steps.
pub fn run(simulation: &mut Simulation, until: f64) -> Vec<StepBalance> {
    let mut records = Vec::new();
    let _ = simulation
        .advance(until, &mut |_, record| {
            records.push(*record);
            ControlFlow::Continue(())
        })
        .unwrap();
    records
}
