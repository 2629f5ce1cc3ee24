//! Results are bit-identical on any number of threads, and after a restart.

use crate::bodies::{PA12, conductor, everywhere, film, grid, held, pa12, radiation, run};
use crystfem::boundary::Field;
use crystfem::material::{Conductor, ThermalProperty};
use crystfem::problem::{Birth, Capacity, Problem};
use crystfem::simulation::{Settings, Simulation, State};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Creates more than two work items of nodes, with births, radiation, latent heat, and temperature-dependent
/// conductivity.
fn problem(general: bool) -> Problem {
    let mesh = grid([10e-3, 10e-3, 10e-3], [22, 20, 20]);
    let plane = 22 * 20;
    let table = ThermalProperty::table("k", vec![300.0, 500.0], vec![0.9, 1.1]).unwrap();
    let glass = Conductor::new(2500.0, table, ThermalProperty::constant("c", 800.0).unwrap()).unwrap();
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

/// Creates the same problem with layers in lines of five elements: equations are numbered in groups, partly
/// unused.
fn path(general: bool) -> Problem {
    let mut problem = problem(general);
    let layers = std::mem::take(&mut problem.births);
    for layer in layers {
        let lines: Vec<&[u32]> = layer.elements.chunks(5).collect();
        let count = lines.len() as f64;
        for (number, line) in lines.iter().enumerate() {
            let time = layer.time + number as f64 / count;
            problem.births.push(Birth { time, elements: line.to_vec(), temperature: layer.temperature });
        }
    }
    problem
}

/// Distorts the elements: rows of the matrix are unequal.
fn distorted(problem: Problem) -> Problem {
    Problem { mesh: problem.mesh.distorted(0.1).unwrap(), ..problem }
}

fn bits(state: &State) -> Vec<u64> {
    state.temperature.iter().chain(&state.memory.nodal.state).map(|x| x.to_bits()).collect()
}

#[test]
fn on_any_number_of_threads() {
    for (general, unequal) in [(false, false), (true, false), (false, true)] {
        let problem = || if unequal { distorted(problem(general)) } else { problem(general) };
        let runs: Vec<State> = [1, 2, 3]
            .into_iter()
            .map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| {
                    let mut simulation = Simulation::new(problem(), Settings::adaptive(0.05)).unwrap();
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

/// A distorted body that exists from the start stores its rows by diagonals: 14 numbers of each matrix and a
/// word for a row, about a third of those of a body with births. A resumed run takes the same steps.
#[test]
fn of_a_distorted_body_without_births() {
    for capacity in [Capacity::Lumped, Capacity::Consistent] {
        // points of latent heat at nodes, or constant properties
        let upper = if capacity == Capacity::Lumped { pa12(Some(209e3)) } else { conductor(PA12) };
        let materials = || vec![conductor(PA12), upper.clone()];
        let problem =
            || Problem { materials: materials(), births: Vec::new(), capacity, ..distorted(problem(false)) };
        let runs: Vec<State> = [1, 2]
            .into_iter()
            .map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| {
                    let settings = Settings::adaptive(0.05);
                    let mut simulation = Simulation::new(problem(), settings).unwrap();
                    let [_, _, bytes] = simulation.storage();
                    let matrices = if capacity == Capacity::Consistent { 2 } else { 1 };
                    let rows = simulation.state().temperature.len() + 512;
                    assert!(bytes <= rows * (14 * 8 * matrices + 4), "{bytes} in {rows} rows");
                    run(&mut simulation, 0.3);
                    if threads == 2 {
                        let saved = simulation.state().clone();
                        simulation = Simulation::resume(problem(), settings, saved).unwrap();
                    }
                    run(&mut simulation, 0.6);
                    simulation.state().clone()
                })
            })
            .collect();
        assert!(bits(&runs[0]) == bits(&runs[1]) && runs[0] == runs[1]);
    }
}

/// Adding birth by birth equals building at once, as resumed simulations do. A birth visits its neighbourhood
/// only.
#[test]
fn along_a_path() {
    for (general, unequal) in [(false, false), (true, false), (false, true)] {
        let path = || if unequal { distorted(path(general)) } else { path(general) };
        let resumed =
            |of: &Simulation, settings| Simulation::resume(path(), settings, of.state().clone()).unwrap();
        let settings = Settings::adaptive(0.05);
        let mut whole = Simulation::new(path(), settings).unwrap();
        let mut parts = resumed(&whole, settings);
        let mut before = whole.state().clone();
        for stop in [0.05, 0.1, 0.17] {
            run(&mut whole, stop);
            run(&mut parts, stop);
            assert!(bits(whole.state()) == bits(parts.state()) && whole.state() == parts.state(), "{stop}");
            parts = resumed(&parts, settings);
            let (work, births) = (whole.state().work, whole.state().births - before.births);
            // a line of five with its neighbours in both layers: 7 × 3 × 2
            let visited = work.visited - before.work.visited;
            assert!(births > 2 && visited <= 42 * births as u64, "{visited} in {births}");
            before = whole.state().clone();
        }
    }
}

/// A stop within a step restores the state before that step; the simulation then continues bit-identically.
#[test]
fn stopped_within_a_step() {
    let settings = Settings::adaptive(0.05);
    let mut whole = Simulation::new(problem(false), settings).unwrap();
    run(&mut whole, 0.1);
    let mut stopped = Simulation::new(problem(false), settings).unwrap();
    let mut stops = 0;
    for most in [1, 7, 30, 100, 1000, usize::MAX] {
        let asked = AtomicUsize::new(0);
        let stop = || asked.fetch_add(1, Ordering::Relaxed) >= most;
        let flow = stopped.advance_unless(&stop, 0.1, &mut |_, _| ControlFlow::Continue(())).unwrap();
        stops += usize::from(flow.is_break());
        let saved = postcard::to_stdvec(stopped.state()).unwrap();
        let state = postcard::from_bytes(&saved).unwrap();
        stopped = Simulation::resume(problem(false), settings, state).unwrap();
    }
    assert!(stops >= 3, "{stops}");
    assert!(bits(whole.state()) == bits(stopped.state()) && whole.state() == stopped.state());
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
