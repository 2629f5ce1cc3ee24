//! Benchmark of a block printed in short line segments: seconds per birth with its step, iterations, bytes
//! per equation.
//!
//! Layers have the height of one element; their lines alternate in direction and are cut into segments, one
//! birth each. All but the last segments exist from the start, colder with age; each of the last ones is
//! followed by a step.

use crate::Failure;
use crate::brick::peak_memory;
use crystfem::boundary::{Condition, FaceSelection, Schedule};
use crystfem::kinetics::{KineticConstants, Kinetics};
use crystfem::material::{Filled, Polymer, Semicrystalline, ThermalMaterial, ThermalProperty};
use crystfem::melting::Melting;
use crystfem::mesh::Grid;
use crystfem::problem::{Birth, Problem};
use crystfem::simulation::{Settings, Simulation};
use evidence::measurement::Measurement;
use std::sync::Arc;
use std::time::Instant;

const EDGE: f64 = 0.5e-3;
const HOT: f64 = 493.15;

/// Print a block in short line segments.
#[derive(clap::Args)]
pub struct Options {
    /// Elements along x and y.
    #[arg(long, default_value_t = 68, value_parser = crate::elements)]
    elements: usize,
    /// Number of layers, each one element high.
    #[arg(long, default_value_t = 22, value_parser = crate::elements)]
    layers: usize,
    /// Elements across a line.
    #[arg(long, default_value_t = 2, value_parser = crate::elements)]
    width: usize,
    /// Elements along a segment.
    #[arg(long, default_value_t = 40, value_parser = crate::elements)]
    piece: usize,
    /// Number of births followed by a step.
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..))]
    births: u32,
    /// Time between births, s: one step of backward Euler.
    #[arg(long, default_value_t = 0.5)]
    step: f64,
    /// Chamber temperature, °C.
    #[arg(long, default_value_t = 80.0)]
    chamber: f64,
    /// Use adaptive steps with this tolerance, K.
    #[arg(long)]
    tolerance: Option<f64>,
    /// Include latent heat.
    #[arg(long)]
    latent: bool,
    /// Number of different filled fractions, in random order as in G-code; with several, most rows are
    /// unequal.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=64))]
    fills: u16,
}

/// Returns the measurements of one run.
pub fn measure(options: &Options) -> Result<Vec<Measurement>, Failure> {
    let before = peak_memory();
    let problem = problem(options)?;
    let settings = match options.tolerance {
        Some(tolerance) => {
            let mut settings = Settings::adaptive(0.02 * options.step);
            if let crystfem::time::Steps::Adaptive { tolerance: own, .. } = &mut settings.steps {
                *own = tolerance;
            }
            settings
        }
        None => Settings::backward_euler(options.step),
    };
    let since = Instant::now();
    let mut simulation = Simulation::new(problem, settings)?;
    let built = since.elapsed().as_secs_f64();
    // building everything at the start needs more memory than adding birth by birth
    let at_start = peak_memory().zip(before).map(|(after, before)| after - before);
    let _ = std::fs::write("/proc/self/clear_refs", "5");
    let start = simulation.state().work;
    let since = Instant::now();
    simulation.run_until(options.step * f64::from(options.births))?;
    let solved = since.elapsed().as_secs_f64();
    let memory = peak_memory().zip(before).map(|(after, before)| after - before);
    let (work, births) = (simulation.state().work, f64::from(options.births));
    let size = simulation.state().temperature.len();
    let mut rows = Vec::new();
    let mut push = |what: &str, value: f64, unit: &str| {
        let threads = rayon::current_num_threads();
        rows.push(Measurement::new(what, size, threads, value, unit));
    };
    push("build", built, "s");
    push("birth and steps", solved / births, "s/birth");
    push("steps", (work.steps + work.rejected - start.steps) as f64 / births, "/birth");
    push("CG iterations", (work.cg_iterations - start.cg_iterations) as f64 / births, "/birth");
    let [points, distinct, bytes] = simulation.storage().map(|count| count as f64 / size as f64);
    push("material points", points, "/dof");
    push("distinct rows", distinct, "/dof");
    push("stored rows", bytes, "bytes/dof");
    for (what, memory) in [("memory at the start", at_start), ("memory", memory)] {
        if let Some(memory) = memory {
            push(what, memory / size as f64, "bytes/dof");
        }
    }
    let mean = simulation.state().temperature.iter().sum::<f64>() / size as f64;
    push("mean temperature", mean, "K");
    let alpha: Vec<f64> = simulation.field("alpha").into_iter().flatten().collect();
    push("mean alpha", alpha.iter().sum::<f64>() / alpha.len().max(1) as f64, "");
    push("worst balance", simulation.state().ledger.worst, "");
    Ok(rows)
}

fn problem(options: &Options) -> Result<Problem, crystfem::Error> {
    let (count, layers) = (options.elements, options.layers);
    let cold = options.chamber + 273.15;
    let side = EDGE * count as f64;
    let mesh =
        Grid::uniform([0.0; 3], [side, side, EDGE * layers as f64], [count, count, layers])?.mesh("block")?;
    let whole: Arc<dyn ThermalMaterial> = Arc::new(Semicrystalline::new(Polymer {
        density: 1010.0,
        conductivity: ThermalProperty::constant("k", 0.25)?,
        specific_heat: ThermalProperty::constant("c", 2200.0)?,
        kinetics: Kinetics::new(KineticConstants::TABLE_4_1_COLUMN_1)?,
        melting: Some(Melting::PA12),
        ultimate_crystallinity: 0.25,
        latent_heat: options.latent.then_some(209e3),
        seed: 0.0,
    })?);
    let filled = |part: f64| -> Result<Arc<dyn ThermalMaterial>, crystfem::Error> {
        Ok(Arc::new(Filled::new(whole.clone(), part)?))
    };
    // filled fractions from 0.5 to 1
    let parts = (1..=options.fills).map(|k| 0.5 + 0.5 * f64::from(k) / f64::from(options.fills));
    let materials = parts.map(filled).collect::<Result<Vec<_>, _>>()?;
    let fill_index = |element: usize| ((element as u64 * 2_654_435_761) >> 16) as u16 % options.fills;
    let mut births = Vec::new();
    for layer in 0..layers {
        for line in (0..count).step_by(options.width) {
            for piece in (0..count).step_by(options.piece) {
                let mut elements = Vec::new();
                for across in line..(line + options.width).min(count) {
                    for along in piece..(piece + options.piece).min(count) {
                        let [x, y] = if layer % 2 == 0 { [along, across] } else { [across, along] };
                        elements.push(((layer * count + y) * count + x) as u32);
                    }
                }
                elements.sort_unstable();
                let age = (layer + 1) as f64 / layers as f64;
                births.push(Birth { time: 0.0, elements, temperature: cold + (HOT - cold) * age.powi(4) });
            }
        }
    }
    let first = births.len().saturating_sub(options.births as usize);
    for (number, birth) in births[first..].iter_mut().enumerate() {
        (birth.time, birth.temperature) = (options.step * number as f64, HOT);
    }
    let film = |surface, coefficient: f64| Condition::Film {
        surface,
        coefficient: Schedule::constant(coefficient),
        ambient: Schedule::constant(cold),
    };
    let bottom = mesh.surfaces["bottom"].clone();
    let outer = FaceSelection::Outer { except: bottom.clone() };
    let conditions = vec![film(FaceSelection::Faces(bottom), 300.0), film(outer, 15.0)];
    let material_of = (0..mesh.element_count()).map(fill_index).collect();
    Ok(Problem { conditions, births, materials, material_of, ..Problem::new(mesh, whole, cold) })
}
