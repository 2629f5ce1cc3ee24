//! The same bits on any number of threads, and after a restart.

use crate::bodies::{PA12, conductor, everywhere, film, grid, held, pa12, radiation, run};
use crystfem::boundary::Field;
use crystfem::material::{Conductor, Property};
use crystfem::problem::{Birth, Capacity, Problem};
use crystfem::simulation::{Settings, Simulation, State};
use std::sync::Arc;

/// More than two work items of nodes, with births, radiation, latent heat, and conductivity that follows temperature.
fn problem(general: bool) -> Problem {
    let mesh = grid([10e-3, 10e-3, 10e-3], [22, 20, 20]);
    let plane = 22 * 20;
    let table = Property::table("k", vec![300.0, 500.0], vec![0.9, 1.1]).unwrap();
    let glass = Conductor::new(2500.0, table, Property::constant("c", 800.0).unwrap()).unwrap();
    Problem {
        materials: vec![if general { Arc::new(glass) } else { conductor(PA12) }, pa12(Some(209e3))],
        material_of: (0..20 * plane).map(|e| u16::from(e >= 10 * plane)).collect(),
        conditions: vec![
            held(&mesh, "bottom", Field::constant(353.15)),
            film(everywhere(), 15.0, 300.0),
            radiation(everywhere(), 0.9, 300.0),
        ],
        births: (10..20)
            .map(|layer| Birth {
                time: (layer - 10) as f64,
                elements: (layer * plane..(layer + 1) * plane).collect(),
                temperature: 493.15,
            })
            .collect(),
        capacity: Capacity::Lumped,
        ..Problem::new(mesh, conductor(PA12), 353.15)
    }
}

fn bits(state: &State) -> Vec<u64> {
    state.temperature.iter().chain(&state.memory.nodal.state).map(|x| x.to_bits()).collect()
}

#[test]
fn on_any_number_of_threads() {
    for general in [false, true] {
        let runs: Vec<State> = [1, 2, 3]
            .into_iter()
            .map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| {
                    let mut simulation = Simulation::new(problem(general), Settings::adaptive(0.05)).unwrap();
                    run(&mut simulation, 1.02);
                    simulation.state().clone()
                })
            })
            .collect();
        assert!(runs[0].temperature.len() > 2 * 4096 - 3000);
        for other in &runs[1..] {
            assert!(bits(&runs[0]) == bits(other) && runs[0] == *other);
        }
    }
}

#[test]
fn after_a_restart() {
    let settings = Settings::adaptive(0.05);
    let mut whole = Simulation::new(problem(false), settings).unwrap();
    run(&mut whole, 0.5);
    run(&mut whole, 1.0);
    run(&mut whole, 1.5);
    let mut first = Simulation::new(problem(false), settings).unwrap();
    for stop in [0.5, 1.0] {
        run(&mut first, stop);
        let saved = postcard::to_stdvec(first.state()).unwrap();
        let state: State = postcard::from_bytes(&saved).unwrap();
        assert_eq!(&state, first.state());
        first = Simulation::resume(problem(false), settings, state).unwrap();
    }
    run(&mut first, 1.5);
    assert!(bits(whole.state()) == bits(first.state()));
    assert_eq!(whole.state().ledger, first.state().ledger);

    let mut other = problem(false);
    other.births.clear();
    assert!(Simulation::resume(other, settings, whole.state().clone()).is_ok(), "births are in the state");
    let small = Problem::new(grid([1e-3; 3], [2; 3]), conductor(PA12), 300.0);
    let error = Simulation::resume(small, settings, whole.state().clone()).err().unwrap();
    assert!(error.to_string().contains("found 8800 elements"), "{error}");
}
