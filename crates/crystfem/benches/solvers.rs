//! Benchmark of the linear solvers: error against run time, in short and long steps.

use crate::Failure;
use crystfem::exact::cube::{Cube, CubeStart};
use crystfem::simulation::{LinearSolver, Settings, Simulation};
use evidence::measurement::Measurement;
use std::time::Instant;

/// Lengths of steps, s, and number of steps.
const LENGTHS: [f64; 3] = [0.5, 5.0, 50.0];
const STEPS: i32 = 6;
/// Rms tolerances of conjugate gradients, K.
const TOLERANCES: [f64; 5] = [1e-1, 1e-3, 1e-5, 1e-7, 1e-9];

/// Returns rows `SOLVER TOLERANCE: QUANTITY, LENGTH`; direct solves have the tolerance 0.
pub fn measure(elements: usize) -> Result<Vec<Measurement>, Failure> {
    let cube = Cube::new(elements, CubeStart::Quenched);
    let mut rows = Vec::new();
    for dt in LENGTHS {
        for tolerance in TOLERANCES {
            let solver = LinearSolver::ConjugateGradients;
            run(&cube, &format!("cg {tolerance:e}"), dt, tolerance, solver, &mut rows)?;
        }
        run(&cube, "factors 0", dt, TOLERANCES[0], LinearSolver::Direct, &mut rows)?;
    }
    Ok(rows)
}

fn run(
    cube: &Cube,
    name: &str,
    dt: f64,
    tolerance: f64,
    solver: LinearSolver,
    rows: &mut Vec<Measurement>,
) -> Result<(), Failure> {
    let settings = Settings { tolerance, solver, ..Settings::backward_euler(dt) };
    let mut simulation = Simulation::new(cube.problem()?, settings)?;
    let mut advance = |until: i32| -> Result<f64, Failure> {
        let since = Instant::now();
        simulation.run_until(f64::from(until) * dt)?;
        Ok(since.elapsed().as_secs_f64())
    };
    // the first step includes the set-up for all steps
    let first = advance(1)?;
    let step = advance(STEPS)? / f64::from(STEPS - 1);
    let error = cube.mean_square(&simulation, |lambda| (1.0 + dt * lambda).powi(-STEPS)).sqrt();
    let iterations = simulation.state().work.cg_iterations as f64 / f64::from(STEPS);
    let threads = rayon::current_num_threads();
    let mut push = |quantity: &str, value: f64, unit: &str| {
        let what = format!("{name}: {quantity}, {dt} s a step");
        rows.push(Measurement::new(what, cube.size(), threads, value, unit));
    };
    push("error", error, "K");
    push("time", step, "s/step");
    push("set-up", (first - step).max(0.0), "s");
    push("cg iterations", iterations, "/step");
    Ok(())
}
