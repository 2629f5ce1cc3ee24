//! Benchmark of a brick with film and radiation: seconds per step, iterations, memory. Other programs solve
//! it too.
//!
//! 20 mm cube of PA12 at 220 °C; bottom fixed at 80 °C, other sides with h = 15 W/m²K and ε = 0.9 against 80
//! °C; backward Euler.

use crate::Failure;
use crystfem::boundary::{Condition, FaceSelection, Field, Schedule};
use crystfem::material::{Conductor, ThermalProperty};
use crystfem::mesh::{Grid, abaqus};
use crystfem::problem::{Capacity, Problem};
use crystfem::simulation::{LinearSolver, Settings, Simulation};
use evidence::measurement::Measurement;
use harness::output::csv;
use polycore::file::atomic_write;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

const EDGE: f64 = 0.02;
const COLD: f64 = 353.15;
const HOT: f64 = 493.15;

/// Solve a brick with film and radiation.
#[derive(clap::Args)]
pub struct Options {
    /// Elements along an edge.
    #[arg(long, default_value_t = 26, value_parser = crate::elements)]
    elements: usize,
    /// Number of steps.
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..))]
    steps: u32,
    /// Length of a step, s.
    #[arg(long, default_value_t = 0.5)]
    step: f64,
    /// Use lumped instead of consistent capacity.
    #[arg(long)]
    lumped: bool,
    /// Distort the mesh: inner nodes move smoothly by up to this fraction of an edge, so that all elements
    /// differ.
    #[arg(long, default_value_t = 0.0, value_parser = amplitude)]
    distorted: f64,
    /// Linear solver, as in a scene: `auto`, `conjugate-gradients`, `multigrid` or `direct`.
    #[arg(long, default_value = "auto", value_parser = solver)]
    solver: LinearSolver,
    /// Write the mesh as a CalculiX file (`.inp`).
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// Write the nodes with their final temperatures (CSV).
    #[arg(long, value_name = "FILE")]
    temperatures: Option<PathBuf>,
}

fn amplitude(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| format!("`{text}` is not a number"))?;
    if (0.0..=0.2).contains(&value) { Ok(value) } else { Err(format!("{value} is outside 0 to 0.2")) }
}

fn solver(text: &str) -> Result<LinearSolver, String> {
    let name = serde_json::Value::String(text.to_owned());
    serde_json::from_value(name).map_err(|error| error.to_string())
}

/// Returns the measurements of one run.
pub fn measure(options: &Options) -> Result<Vec<Measurement>, Failure> {
    let before = peak_memory();
    let since = Instant::now();
    let problem = problem(options)?;
    if let Some(path) = &options.mesh {
        atomic_write(path, |file| abaqus::write(&problem.mesh, false, file))?;
    }
    let meshed = since.elapsed().as_secs_f64();
    let settings = Settings { solver: options.solver, ..Settings::backward_euler(options.step) };
    let since = Instant::now();
    let mut simulation = Simulation::new(problem, settings)?;
    let built = since.elapsed().as_secs_f64();
    let since = Instant::now();
    let end = options.step * f64::from(options.steps);
    simulation.run_until(end)?;
    let solved = since.elapsed().as_secs_f64();
    let memory = peak_memory().zip(before).map(|(after, before)| after - before);
    let temperatures = simulation.temperatures(f64::NAN);
    let (work, steps) = (simulation.state().work, f64::from(options.steps));
    let size = temperatures.len();
    let mut rows = Vec::new();
    let mut push = |what: &str, value: f64, unit: &str| {
        let threads = rayon::current_num_threads();
        rows.push(Measurement::new(what, size, threads, value, unit));
    };
    push("mesh", meshed, "s");
    push("build", built, "s");
    push("step", solved / steps, "s/step");
    push("Newton iterations", work.newton_iterations as f64 / steps, "/step");
    push("evaluations", work.evaluations as f64 / steps, "/step");
    push("CG iterations", work.cg_iterations as f64 / steps, "/step");
    if let Some(memory) = memory {
        push("memory", memory / size as f64, "bytes/dof");
    }
    push("mean temperature", temperatures.iter().sum::<f64>() / size as f64, "K");
    push("worst balance", simulation.state().ledger.worst, "");
    if let Some(path) = &options.temperatures {
        let points = &simulation.problem().mesh.points;
        let column = |d: usize| points.iter().map(|place| place[d]).collect::<Vec<f64>>();
        let [x, y, z] = [0, 1, 2].map(column);
        let columns =
            [("x", "m", &x[..]), ("y", "m", &y), ("z", "m", &z), ("temperature", "K", &temperatures)];
        csv::write(path, &columns)?;
    }
    Ok(rows)
}

fn problem(options: &Options) -> Result<Problem, crystfem::Error> {
    let mesh = Grid::uniform([0.0; 3], [EDGE; 3], [options.elements; 3])?.mesh("brick")?;
    let mesh = if options.distorted > 0.0 { mesh.distorted(options.distorted)? } else { mesh };
    let property = ThermalProperty::constant;
    let material = Arc::new(Conductor::new(1010.0, property("k", 0.25)?, property("c", 2200.0)?)?);
    let surface = || FaceSelection::Outer { except: mesh.surfaces["bottom"].clone() };
    let ambient = || Schedule::constant(COLD);
    let conditions = vec![
        Condition::Temperature { nodes: mesh.node_sets["bottom"].clone(), value: Field::constant(COLD) },
        Condition::Film { surface: surface(), coefficient: Schedule::constant(15.0), ambient: ambient() },
        Condition::Radiation { surface: surface(), emissivity: 0.9, ambient: ambient() },
    ];
    let capacity = if options.lumped { Capacity::Lumped } else { Capacity::Consistent };
    Ok(Problem { conditions, capacity, ..Problem::new(mesh, material, HOT) })
}

/// Returns the peak memory of this process, bytes; `None` if the system does not report it.
pub fn peak_memory() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: f64 = line.split_whitespace().next()?.parse().ok()?;
    Some(1024.0 * kibibytes)
}
