//! Time-dependent conditions against closed forms of a body with uniform temperature.

use crate::bodies::{PA12, conductor, everywhere, grid, run};
use crystfem::boundary::{Condition, Schedule};
use crystfem::problem::Problem;
use crystfem::simulation::{LinearSolver, Settings, Simulation};
use crystfem::time::{Scheme, Steps};

const START: f64 = 450.0;
const AMBIENT: f64 = 350.0;
const FILM: f64 = 50.0;
const EDGE: f64 = 1e-3;

/// Returns the time constant ρcV/(hA) of a cube.
fn time_constant() -> f64 {
    PA12[1] * PA12[2] * EDGE / (6.0 * FILM)
}

/// Solves one element with a film: all nodes have the same temperature.
fn cube(coefficient: &Schedule, ambient: &Schedule, settings: Settings) -> (f64, Vec<f64>) {
    let film =
        Condition::Film { surface: everywhere(), coefficient: coefficient.clone(), ambient: ambient.clone() };
    let problem =
        Problem { conditions: vec![film], ..Problem::new(grid([EDGE; 3], [1; 3]), conductor(PA12), START) };
    let mut simulation = Simulation::new(problem, settings).unwrap();
    let records = run(&mut simulation, 30.0);
    (simulation.temperature(0).unwrap(), records.iter().map(|record| record.time).collect())
}

fn precise() -> Settings {
    let steps = Steps::Adaptive { tolerance: 1e-6, first: 1e-4, smallest: 1e-9, largest: 1e9 };
    Settings { steps, tolerance: 1e-9, ..Settings::adaptive(1.0) }
}

/// Surroundings that warm at r = 2 K/s for 10 s, then constant: T = T_a + r(t − τ) + (T₀ − T_a + rτ)e^{−t/τ}.
#[test]
fn surroundings_that_change() {
    let (tau, rate) = (time_constant(), 2.0);
    let ambient = Schedule::linear(&[(0.0, AMBIENT), (10.0, AMBIENT + 10.0 * rate)]).unwrap();
    let (found, times) = cube(&Schedule::constant(FILM), &ambient, precise());
    let at_10 = AMBIENT + rate * (10.0 - tau) + (START - AMBIENT + rate * tau) * (-10.0 / tau).exp();
    let last = AMBIENT + 10.0 * rate;
    let exact = last + (at_10 - last) * (-20.0 / tau).exp();
    // second order with an error of 1e-6 K per step
    assert!((found - exact).abs() < 1e-3, "{found} {exact}");
    assert!(times.contains(&10.0), "a step ends at the kink");
}

/// A film that grows as h(1 + t/t₁) for t₁ = 10 s, then constant: T = T_a + (T₀ − T_a)e^{−(t + t²/2t₁)/τ}.
/// The matrix changes in each linear solver.
#[test]
fn a_film_that_changes() {
    let film = Schedule::linear(&[(0.0, FILM), (10.0, 2.0 * FILM)]).unwrap();
    let exact = AMBIENT + (START - AMBIENT) * (-(15.0 + 2.0 * 20.0) / time_constant()).exp();
    let ambient = Schedule::constant(AMBIENT);
    for solver in [LinearSolver::ConjugateGradients, LinearSolver::Direct] {
        let (found, times) = cube(&film, &ambient, Settings { solver, ..precise() });
        assert!((found - exact).abs() < 1e-3, "{solver:?}: {found} {exact}");
        assert!(times.contains(&10.0), "a step ends at the kink");
        // equal steps, whose matrix is otherwise reused: first order, 100 K over τ times the step
        let fixed =
            Settings { scheme: Scheme::BackwardEuler, steps: Steps::Fixed { dt: 0.01 }, solver, ..precise() };
        let (found, _) = cube(&film, &ambient, fixed);
        assert!((found - exact).abs() < 0.15, "{solver:?}, equal steps: {found} {exact}");
    }
}
