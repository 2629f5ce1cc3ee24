//! Observed convergence orders for the manufactured solution of formulation.md.

use crate::bodies::{PA12, conductor, grid, run};
use crystfem::boundary::{Field, HeatSource};
use crystfem::exact::Manufactured;
use crystfem::mesh::{Block, CellSplit, Grid, Mesh};
use crystfem::problem::{Capacity, Problem};
use crystfem::simulation::{Settings, Simulation};
use crystfem::time::{Scheme, Steps};

const EXACT: Manufactured = Manufactured {
    base: 400.0,
    amplitude: 50.0,
    rate: 0.1,
    length: 0.01,
    conductivity: PA12[0],
    heat_capacity: PA12[1] * PA12[2],
};

fn simulation(mesh: Mesh, capacity: Capacity, scheme: Scheme, dt: f64) -> Simulation {
    let elements = (0..mesh.element_count() as u32).collect();
    let problem = Problem {
        initial: Field::function(|x, _| EXACT.temperature(x, 0.0)),
        sources: vec![HeatSource { elements, power: Field::function(|x, t| EXACT.source(x, t)) }],
        capacity,
        ..Problem::new(mesh, conductor(PA12), 0.0)
    };
    let settings = Settings { scheme, steps: Steps::Fixed { dt }, ..Settings::backward_euler(dt) };
    Simulation::new(problem, settings).unwrap()
}

fn mesh(elements: usize, split: CellSplit, distortion: f64) -> Mesh {
    let block = Block { name: "all".into(), lower: [0.0; 3], upper: [EXACT.length; 3] };
    let grid = Grid::uniform([0.0; 3], [EXACT.length; 3], [elements; 3]).unwrap();
    grid.blocks(&[block], split).unwrap().distorted(distortion).unwrap()
}

/// Computes the root mean square error over the nodes.
fn error(simulation: &Simulation) -> f64 {
    let points = &simulation.problem().mesh.points;
    let squares = simulation.temperatures(f64::NAN).into_iter().zip(points).map(|(found, &place)| {
        let exact = EXACT.temperature(place, simulation.time());
        (found - exact).powi(2)
    });
    (squares.sum::<f64>() / points.len() as f64).sqrt()
}

#[test]
fn order_two_in_space() {
    for (split, distortion) in [
        (CellSplit::Hexahedra, 0.0),
        (CellSplit::Hexahedra, 0.1),
        (CellSplit::SixTetrahedra, 0.0),
        (CellSplit::SixTetrahedra, 0.1),
        (CellSplit::Wedges, 0.1),
    ] {
        for capacity in [Capacity::Lumped, Capacity::Consistent] {
            let errors = [4, 8, 16].map(|elements| {
                let mut simulation =
                    simulation(mesh(elements, split, distortion), capacity, Scheme::TrBdf2, 0.25);
                run(&mut simulation, 5.0);
                error(&simulation)
            });
            let orders = [0, 1].map(|k| (errors[k] / errors[k + 1]).log2());
            println!("{split:?} {distortion} {capacity:?}: {errors:?}, orders {orders:?}");
            // 2 in the limit
            assert!(
                orders[1] > 1.85 && orders[1] < 2.3,
                "{split:?} {capacity:?}: {errors:?}, orders {orders:?}"
            );
        }
    }
}

/// Second-order elements of any shape: order three in L2 (Strang & Fix, 1973), here at the nodes.
#[test]
fn order_three_in_space_of_second_order_elements() {
    for (split, distortion) in [
        (CellSplit::Hexahedra, 0.0),
        (CellSplit::Hexahedra, 0.1),
        (CellSplit::SixTetrahedra, 0.1),
        (CellSplit::Wedges, 0.1),
    ] {
        let errors = [6, 8].map(|elements| {
            let mesh = mesh(elements, split, distortion).second_order();
            let mut simulation = simulation(mesh, Capacity::Consistent, Scheme::TrBdf2, 0.05);
            run(&mut simulation, 1.0);
            let simulation = &simulation;
            let points = &simulation.problem().mesh.points;
            let exact = |k: usize| EXACT.temperature(points[k], simulation.time());
            // L2 over the elements, weighted by nodal volumes
            let found = simulation.temperatures(f64::NAN);
            let volumes = simulation
                .volumes(&(0..simulation.problem().mesh.element_count() as u32).collect::<Vec<_>>());
            let square: f64 = (0..points.len()).map(|k| volumes[k] * (found[k] - exact(k)).powi(2)).sum();
            (square / volumes.iter().sum::<f64>()).sqrt()
        });
        let order = (errors[0] / errors[1]).ln() / (8.0f64 / 6.0).ln();
        println!("{split:?} {distortion} second order: {errors:?}, order {order}");
        // 3 in the limit; more at nodes of regular meshes
        assert!(order > 2.9 && order < 4.0, "{split:?} {distortion}: {errors:?}, order {order}");
    }
}

/// Differences between halved steps on one mesh, which exclude the error in space.
#[test]
fn order_in_time_is_the_schemes() {
    for (scheme, order) in [(Scheme::BackwardEuler, 1.0), (Scheme::TrBdf2, 2.0)] {
        let middle = [2.0, 1.0, 0.5, 0.25].map(|dt| {
            let mut simulation = simulation(grid([EXACT.length; 3], [6; 3]), Capacity::Lumped, scheme, dt);
            run(&mut simulation, 8.0);
            simulation.temperature(0).unwrap()
        });
        let differences = [0, 1, 2].map(|k| (middle[k] - middle[k + 1]).abs());
        let orders = [0, 1].map(|k| (differences[k] / differences[k + 1]).log2());
        println!("{scheme:?}: {differences:?}, orders {orders:?}");
        assert!((orders[1] - order).abs() < 0.15, "{scheme:?}: {differences:?}, orders {orders:?}");
    }
}

/// Error control: the true temporal error falls with the tolerance, with fewer steps than Euler's.
#[test]
fn adaptive_steps_follow_their_tolerance() {
    let end = |scheme, tolerance| {
        let mut simulation = simulation(grid([EXACT.length; 3], [6; 3]), Capacity::Lumped, scheme, 1.0);
        let steps = Steps::Adaptive { tolerance, first: 0.01, smallest: 1e-9, largest: 1e9 };
        let problem = simulation.problem().clone();
        simulation =
            Simulation::new(problem, Settings { steps, ..Settings { scheme, ..Settings::adaptive(1.0) } })
                .unwrap();
        run(&mut simulation, 20.0);
        (simulation.temperature(0).unwrap(), simulation.state().work.steps)
    };
    let (exact, _) = end(Scheme::TrBdf2, 1e-6);
    for scheme in [Scheme::BackwardEuler, Scheme::TrBdf2] {
        let runs = [1e-1, 1e-2, 1e-3].map(|tolerance| {
            let (found, steps) = end(scheme, tolerance);
            ((found - exact).abs(), steps)
        });
        println!("{scheme:?}: {runs:?}");
        // errors of the steps add up at most
        for ((error, steps), tolerance) in runs.into_iter().zip([1e-1, 1e-2, 1e-3]) {
            assert!(error < tolerance * steps as f64, "{scheme:?}: {runs:?}");
        }
        assert!(runs[2].0 < 0.3 * runs[0].0, "{scheme:?}: {runs:?}");
        if scheme == Scheme::TrBdf2 {
            assert!(runs[2].1 < 100, "{runs:?}");
        }
    }
}
