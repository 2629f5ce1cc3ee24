//! Patch tests: a linear field is exact on any mesh.

use crate::bodies::{PA12, conductor, run};
use crystfem::boundary::{Condition, Field, Where};
use crystfem::mesh::{BOX_SIDES, Block, Grid, Split};
use crystfem::problem::{Capacity, Problem};
use crystfem::simulation::{Settings, Simulation};

fn linear([x, y, z]: [f64; 3]) -> f64 {
    350.0 + 2e3 * x - 3e3 * y + 4e3 * z
}

#[test]
fn a_linear_field_is_exact_on_distorted_meshes() {
    for split in [Split::Hexahedra, Split::FiveTetrahedra, Split::SixTetrahedra] {
        for capacity in [Capacity::Lumped, Capacity::Consistent] {
            let block = Block { name: "all".into(), lower: [0.0; 3], upper: [0.01, 0.02, 0.03] };
            let grid = Grid::uniform([0.0; 3], [0.01, 0.02, 0.03], [4, 5, 6]).unwrap();
            let mesh = grid.blocks(&[block], split).unwrap().distorted(0.15).unwrap();
            let mut nodes: Vec<u32> =
                BOX_SIDES.iter().flat_map(|side| mesh.node_sets[*side].clone()).collect();
            nodes.sort_unstable();
            nodes.dedup();
            let inside = mesh.points.len() - nodes.len();
            assert!(inside > 20);
            let value = Field::function(|x, _| linear(x));
            let problem = Problem {
                conditions: vec![Condition::Temperature { nodes, value }],
                capacity,
                ..Problem::new(mesh, conductor(PA12), 293.15)
            };
            let settings = Settings { tolerance: 1e-10, ..Settings::backward_euler(1e9) };
            let mut simulation = Simulation::new(problem, settings).unwrap();
            // each step leaves τ/Δt ≈ 1e-7 of what was there
            run(&mut simulation, 4e9);
            let points = &simulation.problem().mesh.points;
            for (found, &place) in simulation.temperatures(0.0).iter().zip(points) {
                // rounding of a solve with 350 K
                assert!((found - linear(place)).abs() < 1e-9, "{split:?} {capacity:?}: {found} at {place:?}");
            }
        }
    }
}

/// The same with the gradient driven by a flux: 1000 W/m² through a bar with one end held.
#[test]
fn a_flux_makes_its_gradient() {
    for split in [Split::Hexahedra, Split::SixTetrahedra] {
        let block = Block { name: "all".into(), lower: [0.0; 3], upper: [0.02, 0.01, 0.01] };
        let grid = Grid::uniform([0.0; 3], [0.02, 0.01, 0.01], [6, 3, 4]).unwrap();
        let mesh = grid.blocks(&[block], split).unwrap().distorted(0.1).unwrap();
        let nodes = mesh.node_sets["left"].clone();
        let surface = Where::Faces(mesh.surfaces["right"].clone());
        let problem = Problem {
            conditions: vec![
                Condition::Temperature { nodes, value: Field::constant(300.0) },
                Condition::Flux { surface, inward: Field::constant(1e3) },
            ],
            ..Problem::new(mesh, conductor(PA12), 300.0)
        };
        let settings = Settings { tolerance: 1e-10, ..Settings::backward_euler(1e9) };
        let mut simulation = Simulation::new(problem, settings).unwrap();
        run(&mut simulation, 4e9);
        let points = &simulation.problem().mesh.points;
        for (found, place) in simulation.temperatures(0.0).iter().zip(points) {
            let exact = 300.0 + 1e3 / PA12[0] * place[0];
            assert!((found - exact).abs() < 1e-9, "{split:?}: {found}, {exact} at {place:?}");
        }
        // all heat that goes in is taken by the support: 1e3 W/m² × 1e-4 m²
        assert!(simulation.state().ledger.worst < 1e-10, "{:?}", simulation.state().ledger);
        assert!((simulation.state().exchange.flux - 0.1).abs() < 1e-15);
    }
}
