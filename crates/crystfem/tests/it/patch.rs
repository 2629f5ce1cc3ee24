//! Patch tests: a linear field is exact on any mesh.

use crate::bodies::{PA12, conductor, run};
use crystfem::boundary::{Condition, FaceSelection, Field};
use crystfem::mesh::{BOX_SIDES, Block, CellSplit, Grid};
use crystfem::problem::{Capacity, Problem};
use crystfem::simulation::{Settings, Simulation};

fn linear([x, y, z]: [f64; 3]) -> f64 {
    350.0 + 2e3 * x - 3e3 * y + 4e3 * z
}

#[test]
fn a_linear_field_is_exact_on_distorted_meshes() {
    let splits =
        [CellSplit::Hexahedra, CellSplit::FiveTetrahedra, CellSplit::SixTetrahedra, CellSplit::Wedges];
    for (split, second) in splits.into_iter().flat_map(|split| [(split, false), (split, true)]) {
        for capacity in [Capacity::Lumped, Capacity::Consistent] {
            if second && capacity == Capacity::Lumped {
                continue;
            }
            let block = Block { name: "all".into(), lower: [0.0; 3], upper: [0.01, 0.02, 0.03] };
            let grid = Grid::uniform([0.0; 3], [0.01, 0.02, 0.03], [4, 5, 6]).unwrap();
            let mut mesh = grid.blocks(&[block], split).unwrap().distorted(0.15).unwrap();
            if second {
                mesh = mesh.second_order();
            }
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
            let tolerance = if second { 1e-11 } else { 1e-10 };
            let settings = Settings { tolerance, ..Settings::backward_euler(1e9) };
            let mut simulation = Simulation::new(problem, settings).unwrap();
            // each step leaves τ/Δt ≈ 1e-7 of the initial field
            run(&mut simulation, 4e9);
            let points = &simulation.problem().mesh.points;
            for (found, &place) in simulation.temperatures(0.0).iter().zip(points) {
                // rounding of a solve at 350 K
                let error = (found - linear(place)).abs();
                assert!(error < 1e-9, "{split:?} {second} {capacity:?}: {found} at {place:?}");
            }
        }
    }
}

/// A flux gives its gradient: 1000 W/m² through a bar with one fixed end.
#[test]
fn a_flux_makes_its_gradient() {
    for (split, second) in [
        (CellSplit::Hexahedra, false),
        (CellSplit::SixTetrahedra, false),
        (CellSplit::Wedges, false),
        (CellSplit::Hexahedra, true),
        (CellSplit::SixTetrahedra, true),
        (CellSplit::Wedges, true),
    ] {
        let block = Block { name: "all".into(), lower: [0.0; 3], upper: [0.02, 0.01, 0.01] };
        let grid = Grid::uniform([0.0; 3], [0.02, 0.01, 0.01], [6, 3, 4]).unwrap();
        let mut mesh = grid.blocks(&[block], split).unwrap().distorted(0.1).unwrap();
        if second {
            mesh = mesh.second_order();
        }
        let nodes = mesh.node_sets["left"].clone();
        let surface = FaceSelection::Faces(mesh.surfaces["right"].clone());
        let problem = Problem {
            conditions: vec![
                Condition::Temperature { nodes, value: Field::constant(300.0) },
                Condition::Flux { surface, inward: Field::constant(1e3) },
            ],
            capacity: if second { Capacity::Consistent } else { Capacity::Lumped },
            ..Problem::new(mesh, conductor(PA12), 300.0)
        };
        let settings = Settings { tolerance: 1e-10, ..Settings::backward_euler(1e9) };
        let mut simulation = Simulation::new(problem, settings).unwrap();
        run(&mut simulation, 4e9);
        let points = &simulation.problem().mesh.points;
        for (found, place) in simulation.temperatures(0.0).iter().zip(points) {
            let exact = 300.0 + 1e3 / PA12[0] * place[0];
            assert!((found - exact).abs() < 1e-9, "{split:?} {second}: {found}, {exact} at {place:?}");
        }
        // the support takes all supplied heat: 1e3 W/m² × 1e-4 m²
        assert!(simulation.state().ledger.worst < 1e-10, "{:?}", simulation.state().ledger);
        assert!((simulation.state().exchange.flux - 0.1).abs() < 1e-15);
    }
}
