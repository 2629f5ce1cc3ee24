//! Brick with film and radiation on five sides, fixed bottom, 20 steps of 0.5 s by
//! backward Euler. References: scikit-fem 476.76311907 K (nodal mean at 26³ elements, consistent capacity),
//! CalculiX 476.763087 K (printed to 1e-3 K).

use crate::bodies::{PA12, conductor, film, grid, held, radiation, run};
use crystfem::boundary::{FaceSelection, Field};
use crystfem::mesh::Mesh;
use crystfem::problem::{Capacity, Problem};
use crystfem::simulation::{Settings, Simulation};

fn brick(elements: usize, capacity: Capacity) -> Simulation {
    brick_of(grid([0.02; 3], [elements; 3]), capacity)
}

fn brick_of(mesh: Mesh, capacity: Capacity) -> Simulation {
    let bottom = mesh.surfaces["bottom"].clone();
    let surface = || FaceSelection::Outer { except: bottom.clone() };
    let conditions = vec![
        held(&mesh, "bottom", Field::constant(353.15)),
        film(surface(), 15.0, 353.15),
        radiation(surface(), 0.9, 353.15),
    ];
    let problem = Problem { conditions, capacity, ..Problem::new(mesh, conductor(PA12), 493.15) };
    Simulation::new(problem, Settings::backward_euler(0.5)).unwrap()
}

fn mean(simulation: &Simulation) -> f64 {
    let all = simulation.temperatures(f64::NAN);
    all.iter().sum::<f64>() / all.len() as f64
}

#[test]
fn mean_temperature_agrees_with_peers() {
    let mut simulation = brick(26, Capacity::Consistent);
    let steps = run(&mut simulation, 10.0);
    assert_eq!(steps.len(), 20);
    assert!((mean(&simulation) - 476.763_119_07).abs() < 1e-7, "{}", mean(&simulation));
    let work = simulation.state().work;
    println!("{work:?}");
    // at most three Newton iterations per step; formulation.md: 10 to 15 iterations per linear solve
    assert!(work.newton_iterations <= 60 && work.cg_iterations <= 20 * 25, "{work:?}");
    assert!(simulation.state().ledger.worst < 1e-10, "{:?}", simulation.state().ledger);
}

/// All elements and matrix rows differ: scikit-fem 12 (`xtask/src/bench/brick.py` on the same nodes) gives
/// 472.69432700776 K, with nodal differences up to 8e-7 K; CalculiX 2.20 gives 472.694327 K.
#[test]
fn distorted_elements_agree_with_peers() {
    let mesh = grid([0.02; 3], [13; 3]).distorted(0.1).unwrap();
    let mut simulation = brick_of(mesh, Capacity::Consistent);
    run(&mut simulation, 10.0);
    assert!((mean(&simulation) - 472.694_327_008).abs() < 1e-7, "{}", mean(&simulation));
    assert!(simulation.state().ledger.worst < 1e-10, "{:?}", simulation.state().ledger);
}

/// Both capacities converge to the same solution: their difference falls with h², by about 4 from 13 to 26
/// elements.
#[test]
fn lumped_capacity_comes_close() {
    let difference = [13, 26].map(|elements| {
        let [lumped, consistent] = [Capacity::Lumped, Capacity::Consistent].map(|capacity| {
            let mut simulation = brick(elements, capacity);
            run(&mut simulation, 10.0);
            assert!(simulation.state().ledger.worst < 1e-10, "{:?}", simulation.state().ledger);
            simulation.temperature(simulation.problem().mesh.points.len() as u32 / 2).unwrap()
        });
        lumped - consistent
    });
    assert!(difference[1].abs() < 0.35 * difference[0].abs(), "{difference:?}");
}

/// Evaluations of a step whose only nonlinearity is radiation: at its first guess and at its end.
/// Temperatures are those of a tolerance of 1e-11 K, to the tolerance of 1e-7 K (rms) in each of 20 steps.
#[test]
fn a_step_takes_two_evaluations() {
    for distortion in [0.0, 0.15] {
        for capacity in [Capacity::Consistent, Capacity::Lumped] {
            let [found, exact] = [1e-7, 1e-11].map(|tolerance| {
                let mesh = grid([0.02; 3], [12; 3]);
                let mesh = if distortion > 0.0 { mesh.distorted(distortion).unwrap() } else { mesh };
                let problem = brick_of(mesh, capacity).problem().clone();
                let settings = Settings { tolerance, ..Settings::backward_euler(0.5) };
                let mut simulation = Simulation::new(problem, settings).unwrap();
                run(&mut simulation, 10.0);
                simulation
            });
            let work = found.state().work;
            println!("{distortion} {capacity:?}: {work:?}");
            assert!(work.steps == 20 && work.evaluations <= 2 * work.steps, "{work:?}");
            assert!(found.state().ledger.worst < 1e-10, "{:?}", found.state().ledger);
            let [found, exact] = [&found, &exact].map(|simulation| simulation.temperatures(f64::NAN));
            let square: f64 = found.iter().zip(&exact).map(|(a, b)| (a - b) * (a - b)).sum();
            let rms = (square / found.len() as f64).sqrt();
            assert!(rms <= 20.0 * 1e-7, "{distortion} {capacity:?}: {rms:e} K");
        }
    }
}
