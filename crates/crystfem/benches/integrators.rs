//! Benchmark of the time integrators: error against run time.

use crate::Failure;
use crate::median;
use crystfem::exact::cube::{Cube, CubeStart, END};
use crystfem::simulation::{LinearSolver, Settings, Simulation};
use crystfem::time::{Scheme, Steps};
use evidence::measurement::Measurement;
use std::ops::ControlFlow;
use std::time::Instant;

/// Numbers of fixed steps, and tolerances of adaptive steps, K.
const STEPS: [u32; 8] = [4, 8, 16, 32, 64, 128, 256, 512];
const TOLERANCES: [f64; 7] = [10.0, 3.0, 1.0, 0.3, 0.1, 0.03, 0.01];
/// Number of timings; the median is reported.
const REPEATS: usize = 3;
/// Tolerance of linear solves, K, well below the errors of the steps.
const SOLVER_TOLERANCE: f64 = 1e-6;

/// Returns rows `SCHEME-MODE LENGTH: QUANTITY, PROBLEM`.
pub fn measure(elements: usize) -> Result<Vec<Measurement>, Failure> {
    let mut rows = Vec::new();
    for (problem, start) in [("smooth", CubeStart::Smooth), ("quenched", CubeStart::Quenched)] {
        let cube = Cube::new(elements, start);
        for (name, scheme) in [("backward-euler", Scheme::BackwardEuler), ("tr-bdf2", Scheme::TrBdf2)] {
            let fixed = STEPS.map(|count| {
                let dt = END / f64::from(count);
                (format!("{name}-fixed {count}"), Steps::Fixed { dt })
            });
            let adaptive = TOLERANCES.map(|tolerance| {
                let (first, largest) = (1e-6 * END, END);
                let steps = Steps::Adaptive { tolerance, first, smallest: 1e-6 * first, largest };
                (format!("{name}-adaptive {tolerance}"), steps)
            });
            for (name, steps) in fixed.into_iter().chain(adaptive) {
                let solver = LinearSolver::ConjugateGradients;
                let labels = [name.as_str(), problem];
                run(
                    &cube,
                    labels,
                    Settings { scheme, steps, tolerance: SOLVER_TOLERANCE, solver },
                    &mut rows,
                )?;
            }
        }
    }
    Ok(rows)
}

fn run(
    cube: &Cube,
    [name, problem]: [&str; 2],
    settings: Settings,
    rows: &mut Vec<Measurement>,
) -> Result<(), Failure> {
    let mut seconds = Vec::new();
    let mut work = Default::default();
    for _ in 0..REPEATS {
        let mut simulation = Simulation::new(cube.problem()?, settings)?;
        let since = Instant::now();
        simulation.run_until(END)?;
        seconds.push(since.elapsed().as_secs_f64());
        work = simulation.state().work;
    }
    // another run measures the error after each step
    let mut squares = 0.0;
    let mut simulation = Simulation::new(cube.problem()?, settings)?;
    let _ = simulation.advance(END, &mut |simulation, step| {
        squares += step.dt * cube.mean_square(simulation, |lambda| (-lambda * step.time).exp());
        ControlFlow::Continue(())
    })?;
    let threads = rayon::current_num_threads();
    let mut push = |quantity: &str, value: f64, unit: &str| {
        let what = format!("{name}: {quantity}, {problem}");
        rows.push(Measurement::new(what, cube.size(), threads, value, unit));
    };
    push("error", (squares / END).sqrt(), "K");
    push("time", median(seconds), "s");
    push("steps", (work.steps + work.rejected) as f64, "");
    push("cg iterations", work.cg_iterations as f64, "");
    Ok(())
}
