//! Direct and iterative solvers give the same temperatures, and the automatic choice depends on the problem.

use crate::bodies::{PA12, conductor, everywhere, film, grid, held, radiation, run};
use crystfem::boundary::{Condition, FaceSelection, Field};
use crystfem::mesh::{Block, CellSplit, Grid};
use crystfem::problem::{Capacity, Problem};
use crystfem::simulation::{LinearMethod, LinearSolver, Settings, Simulation};
use crystfem::time::{Scheme, Steps};

fn brick(elements: usize, capacity: Capacity, settings: Settings) -> Simulation {
    let mesh = grid([0.02; 3], [elements; 3]);
    let bottom = mesh.surfaces["bottom"].clone();
    let conditions = vec![
        held(&mesh, "bottom", Field::constant(353.15)),
        film(FaceSelection::Outer { except: bottom }, 15.0, 353.15),
    ];
    Simulation::new(Problem { conditions, capacity, ..Problem::new(mesh, conductor(PA12), 493.15) }, settings)
        .unwrap()
}

fn settings(solver: LinearSolver, scheme: Scheme, dt: f64) -> Settings {
    Settings { solver, scheme, steps: Steps::Fixed { dt }, tolerance: 1e-9 }
}

#[test]
fn both_solvers_agree() {
    for capacity in [Capacity::Lumped, Capacity::Consistent] {
        for scheme in [Scheme::BackwardEuler, Scheme::TrBdf2] {
            let [cg, direct] = [LinearSolver::ConjugateGradients, LinearSolver::Direct].map(|solver| {
                let mut simulation = brick(12, capacity, settings(solver, scheme, 25.0));
                run(&mut simulation, 500.0);
                simulation
            });
            // tolerance of both solvers, and propagation over steps
            for (a, b) in cg.temperatures(0.0).iter().zip(direct.temperatures(0.0)) {
                assert!((a - b).abs() < 1e-6, "{capacity:?} {scheme:?}: {a}, {b}");
            }
            let work = direct.state().work;
            assert!(cg.state().work.cg_iterations > 0 && cg.state().work.factorizations == 0);
            // TR-BDF2 starts with one step of backward Euler, which has another matrix
            let (factorizations, solves) = if scheme == Scheme::TrBdf2 { (2, 39) } else { (1, 20) };
            assert_eq!(
                (work.factorizations, work.direct_solves, work.cg_iterations),
                (factorizations, solves, 0)
            );
            assert!(direct.state().ledger.worst < 1e-10, "{:?}", direct.state().ledger);
        }
    }
}

/// Factors on request are recomputed whenever the matrix changes.
#[test]
fn factors_of_a_nonlinear_problem() {
    let run_with = |solver| {
        let conditions = vec![radiation(everywhere(), 0.9, 300.0)];
        let problem =
            Problem { conditions, ..Problem::new(grid([0.02; 3], [8; 3]), conductor(PA12), 493.15) };
        let mut simulation = Simulation::new(problem, settings(solver, Scheme::BackwardEuler, 50.0)).unwrap();
        run(&mut simulation, 500.0);
        (simulation.temperature(0).unwrap(), simulation.state().work)
    };
    let (cg, _) = run_with(LinearSolver::Auto);
    let (direct, work) = run_with(LinearSolver::Direct);
    assert!((cg - direct).abs() < 1e-6, "{cg}, {direct}");
    assert!(work.cg_iterations == 0 && work.factorizations == work.newton_iterations, "{work:?}");
}

/// Conjugate gradients win for a brick of equal elements at any step; factors win along a line.
#[test]
fn the_choice_follows_the_scene() {
    let settings = |dt| settings(LinearSolver::Auto, Scheme::BackwardEuler, dt);
    assert_eq!(brick(12, Capacity::Lumped, settings(0.5)).choose(500.0).method, LinearMethod::Diagonal);
    let adaptive = brick(4, Capacity::Lumped, Settings::adaptive(1.0));
    assert!(adaptive.choose(1e6).reason.contains("adaptive"));
    let mesh = grid([0.2, 1e-3, 1e-3], [200, 1, 1]);
    let conditions = vec![held(&mesh, "left", Field::constant(353.15))];
    let problem = Problem { conditions, ..Problem::new(mesh, conductor(PA12), 493.15) };
    let mut line = Simulation::new(problem, settings(100.0)).unwrap();
    assert_eq!(line.choose(1e4).method, LinearMethod::Factors, "{:?}", line.choose(1e4));
    let lines = line.explain(1e4);
    assert!(lines.iter().any(|line| line.contains("804 equations for 200 of 200 elements")), "{lines:#?}");
    run(&mut line, 1e4);
    assert_eq!((line.state().work.factorizations, line.state().work.direct_solves), (1, 100));
}

/// Creates a cube with `elements` along an edge, of distorted hexahedra or five tetrahedra each.
fn distorted(elements: usize, tetrahedra: bool, surface: Condition, settings: Settings) -> Simulation {
    let into = if tetrahedra { CellSplit::FiveTetrahedra } else { CellSplit::Hexahedra };
    let block = Block { name: "body".into(), lower: [0.0; 3], upper: [0.02; 3] };
    let grid = Grid::uniform(block.lower, block.upper, [elements; 3]).unwrap();
    let mesh = grid.blocks(&[block], into).unwrap().distorted(0.1).unwrap();
    let nodes = &mesh.points;
    let bottom: Vec<u32> = (0..).zip(nodes).filter(|(_, p)| p[2] < 1e-9).map(|(node, _)| node).collect();
    let conditions = vec![Condition::Temperature { nodes: bottom, value: Field::constant(353.15) }, surface];
    Simulation::new(Problem { conditions, ..Problem::new(mesh, conductor(PA12), 493.15) }, settings).unwrap()
}

/// Iterations on unequal rows use a single-precision matrix and still reach 1e-9 K from 140 K: direct solves
/// with the exact matrix give the same temperatures in short and very long steps.
#[test]
fn packed_rows_and_factors_agree() {
    for (capacity, tetrahedra) in
        [(Capacity::Lumped, false), (Capacity::Consistent, false), (Capacity::Lumped, true)]
    {
        for dt in [10.0, 1e6] {
            let solvers = [LinearSolver::Direct, LinearSolver::ConjugateGradients, LinearSolver::Multigrid];
            let [direct, diagonal, multigrid] = solvers.map(|solver| {
                let settings = settings(solver, Scheme::BackwardEuler, dt);
                let surface = film(everywhere(), 15.0, 330.0);
                let problem = distorted(10, tetrahedra, surface, settings).problem().clone();
                let mut simulation = Simulation::new(Problem { capacity, ..problem }, settings).unwrap();
                run(&mut simulation, 2.0 * dt);
                assert!(simulation.state().ledger.worst < 1e-10, "{:?}", simulation.state().ledger);
                simulation.temperatures(0.0)
            });
            for found in [diagonal, multigrid] {
                let far = found.iter().zip(&direct).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                // the tolerance is a root mean square, and applies to two steps
                assert!(far < 1e-8, "{capacity:?}, tetrahedra {tetrahedra}, {dt} s: {far:e}");
            }
        }
    }
}

/// On meshes of 8³ to 24³ elements and steps of 10 to 1e5 s, multigrid needs at most 22 iterations, and gives
/// the same temperatures as the diagonal.
#[test]
fn few_iterations_with_multigrid() {
    let run_with = |simulation: &mut Simulation, until: f64| -> f64 {
        run(simulation, until);
        let work = simulation.state().work;
        work.cg_iterations as f64 / work.cg_solves as f64
    };
    let at = |solver, dt| settings(solver, Scheme::BackwardEuler, dt);
    for tetrahedra in [false, true] {
        let mut most = 0.0_f64;
        for elements in [8, 16, 24] {
            for dt in [10.0, 1e3, 1e5] {
                let [mut diagonal, mut multigrid] =
                    [LinearSolver::ConjugateGradients, LinearSolver::Multigrid].map(|solver| {
                        distorted(elements, tetrahedra, film(everywhere(), 15.0, 353.15), at(solver, dt))
                    });
                let many = run_with(&mut diagonal, 3.0 * dt);
                let few = run_with(&mut multigrid, 3.0 * dt);
                println!(
                    "tetrahedra: {tetrahedra}, {elements} elements, {dt} s: {many} with the diagonal, {few}"
                );
                most = most.max(few);
                assert_eq!(multigrid.state().work.levels, 1);
                for (a, b) in diagonal.temperatures(0.0).iter().zip(multigrid.temperatures(0.0)) {
                    // tolerance of both solvers
                    assert!((a - b).abs() < 1e-6, "{a} {b}");
                }
            }
        }
        evidence::at_most(&format!("multigrid_iterations_tetrahedra_{tetrahedra}"), most, 22.0);
    }
}

/// With many iterations per solve, the automatic choice switches to multigrid during the run, with the same
/// temperatures.
#[test]
fn multigrid_takes_over() {
    let run_with = |solver| {
        // a new matrix for each solve, so that factors do not pay
        let surface = radiation(everywhere(), 0.9, 300.0);
        let mut simulation = distorted(24, true, surface, settings(solver, Scheme::BackwardEuler, 1e3));
        let begun = simulation.choose(1e4).method;
        run(&mut simulation, 1e4);
        assert_eq!(begun, LinearMethod::Diagonal);
        simulation
    };
    let [diagonal, auto] = [LinearSolver::ConjugateGradients, LinearSolver::Auto].map(run_with);
    let [a, b] = [diagonal.state().work, auto.state().work];
    assert_eq!((a.levels, b.levels, b.factorizations), (0, 1, 0));
    assert!(2 * b.cg_iterations < a.cg_iterations, "{a:?} {b:?}");
    for (a, b) in diagonal.temperatures(0.0).iter().zip(auto.temperatures(0.0)) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
}
