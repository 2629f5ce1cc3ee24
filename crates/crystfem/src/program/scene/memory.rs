//! Memory of a part's run: a bound from the mesh settings before meshing, and the total before the first
//! step.
//!
//! Counts the bytes of arrays that are alive at the same time. The workspace test `memory` compares the sum
//! with measured peaks.

use super::{Mechanics, PartScene};
use crate::simulation::{LinearSolver, Simulation};
use crate::time::Steps;
use harness::scene::{LineSpec, SceneError, Source};
use polycore::memory::{available, gib};

/// Threads and tables.
const ALWAYS: f64 = 20e6;
/// Drawing surfaces and fonts, and each stage of a picture.
const PICTURES: f64 = 40e6;
const STAGE: f64 = 12e6;
/// Mesh data per node (position, equation, about twelve vectors of step and solver, checkpoint) and per
/// element (nodes, sets, outer faces during their search).
const NODE: f64 = 290.0;
const ELEMENT: f64 = 115.0;
/// Adaptive steps, per node: rates of all stages, previous state, error estimate.
const ADAPTIVE: f64 = 40.0;
/// Printing, per element: births, layers, rebuilt equations.
const PRINTED: f64 = 300.0;
/// Stress, per element: six branches and the stress at eight Gauss points, their copies during a step and a
/// checkpoint; per node: displacements, blocks and solver vectors.
const STRESSED: f64 = 3.0 * 7.0 * 8.0 * 48.0 + 1800.0;
const STRESSED_NODE: f64 = 450.0;
/// Flow, per element: strains, their change and the tangent with its modes, in a Newton step.
const FLOWING: f64 = 2.0 * 8.0 * 48.0 + (24.0 * 24.0 + 24.0 * 9.0 + 81.0) * 8.0 + 64.0;
/// Nodes per group of the coarse level, which has six unknowns per group.
const GROUP: f64 = 64.0;
/// Entry of the conduction matrix during sorting.
const ENTRY: f64 = 40.0;
/// Rows by diagonals with their copy in single precision, over their bytes.
const PACKED: f64 = 1.6;
/// Levels of multigrid, per entry of the conduction matrix: transfers and matrices.
const LEVELS: f64 = 28.0;
/// Material point: birth and material (twice during a birth); stored mass; each state variable (value, copy
/// during a birth, checkpoint), and its new value if stored separately.
const POINT: f64 = 24.0;
const MASS: f64 = 8.0 * 2.0;
const STATE: f64 = 8.0 * 4.0;
const NEW: f64 = 8.0;
/// Point inside an element: position, gradients, and its share of the element matrix.
const POINT_IN_ELEMENT: f64 = 400.0;
/// Entry of the factors: value, index, and its part of the front during factorization.
const FACTOR: f64 = 16.0;
/// Field output: per node, per element, and per value of a field (computed, packed, read back).
const WRITTEN_NODE: f64 = 100.0;
const WRITTEN_ELEMENT: f64 = 80.0;
const FIELD: f64 = 64.0;
/// Point of a line: element nodes and weights, neighbouring elements, position; value of a table.
const LINE_POINT: f64 = 24.0 + 2.0 * 56.0 + 8.0 * 16.0 + 32.0 + 24.0;
const CELL: f64 = 8.0;
/// Largest number of fixed steps, and of output times.
const MOST_STEPS: f64 = 1e9;
const MOST_FRAMES: f64 = 1e5;

/// Refuses a structured mesh that needs too much memory, before allocation: `cells` along each axis, `each`
/// elements per cell.
///
/// # Errors
/// Returns needed and available memory, at `key`.
pub(super) fn refuse_mesh(
    source: &Source,
    key: &str,
    cells: [f64; 3],
    each: usize,
) -> Result<(), SceneError> {
    let nodes: f64 = cells.iter().map(|count| count + 1.0).product();
    let needed = nodes * NODE + each as f64 * cells.iter().product::<f64>() * ELEMENT;
    refuse(source, key, &format!("{nodes:.3e} nodes"), needed)
}

/// Refuses too many steps or output times.
///
/// # Errors
/// Returns their number, at the key that determines it.
pub(super) fn refuse_times(source: &Source, scene: &PartScene, end: f64) -> Result<(), SceneError> {
    let counted = [
        ("time.step", scene.time.step, "steps", MOST_STEPS),
        ("output.every", scene.output.every, "times", MOST_FRAMES),
    ];
    for (key, each, what, most) in counted {
        let count = each.map_or(0.0, |each| (end / each.si()).ceil());
        if count > most {
            return Err(source.error(
                key,
                format!("{count:.1e} {what} up to {end} s"),
                format!("at most {most:e}"),
            ));
        }
    }
    Ok(())
}

/// Healing, per element: faces, and up to three interfaces with states and nodes.
const HEALED: f64 = 600.0;

impl PartScene {
    /// Returns the bytes that a run up to `end` needs at most, with all elements printed.
    pub fn memory(&self, simulation: &Simulation, mechanics: Option<&Mechanics>, end: f64) -> f64 {
        let (mesh, system) = (&simulation.problem().mesh, &simulation.system);
        let (nodes, elements) = (mesh.points.len() as f64, mesh.element_count() as f64);
        let fields = 1.0 + simulation.field_names().len() as f64;
        let mut bytes = ALWAYS + nodes * NODE + elements * ELEMENT;
        if self.output.pictures {
            bytes += PICTURES + STAGE * self.output.stages as f64;
        }
        if self.print.is_some() {
            bytes += elements * PRINTED;
        }
        if self.healing.is_some() {
            bytes += elements * HEALED;
        }
        if let Some(mechanics) = mechanics {
            let bearing = mechanics.counts[0] as f64;
            if mechanics.settings.law.flows() {
                bytes += bearing * FLOWING;
            }
            bytes += bearing * STRESSED + mechanics.matrices + nodes * STRESSED_NODE;
            // band as wide as the section of a compact body
            let groups = nodes / GROUP + 1.0;
            bytes += 36.0 * groups * (groups.powf(2.0 / 3.0) + 2.0 * groups.cbrt() + 2.0) * 8.0;
            if self.output.fields {
                bytes += nodes * 3.0 * FIELD + elements * 7.0 * FIELD;
            }
        }
        // simulation of the compensated shape beside the first
        let copies = if mechanics.is_some_and(|mechanics| mechanics.compensation) { 2.0 } else { 1.0 };
        bytes *= copies;
        let entries = system.rows.stored()[2] as f64;
        bytes += copies
            * match system.rows.bands() {
                Some(bands) => {
                    let wanted = simulation.settings.solver;
                    let levels = matches!(wanted, LinearSolver::Auto | LinearSolver::Multigrid);
                    PACKED * bands.bytes() as f64 + if levels { entries * LEVELS } else { 0.0 }
                }
                None => entries * ENTRY,
            };
        let states = simulation.behaviours.iter().map(|behaviour| behaviour.states).max().unwrap_or(0) as f64;
        let fixed = matches!(simulation.settings.steps, Steps::Fixed { .. });
        if !fixed {
            bytes += nodes * ADAPTIVE;
        }
        let nodal = &system.nodal;
        let numbers = states + f64::from(u8::from(nodal.energies));
        let number = if fixed && !nodal.energies { STATE } else { STATE + NEW };
        let mass = if nodal.weighed { MASS } else { 0.0 };
        bytes += nodal.material.len() as f64 * (POINT + mass + numbers * number);
        bytes += system.general.points() as f64 * (POINT_IN_ELEMENT + (states + 1.0) * (STATE + NEW));
        bytes += copies * simulation.factors(end) * FACTOR;
        if self.output.fields || self.output.pictures {
            bytes += nodes * (WRITTEN_NODE + fields * FIELD) + elements * WRITTEN_ELEMENT;
        }
        // positions of all lines, and one table at a time: arc length, position twice, fields
        let points = |line: &LineSpec| line.points as f64;
        bytes += LINE_POINT * self.output.line.iter().map(points).sum::<f64>();
        bytes += CELL * (7.0 + fields) * self.output.line.iter().map(points).fold(0.0, f64::max);
        // one row per step in a growing list, and its checkpoint
        let Steps::Fixed { dt } = simulation.settings.steps else { return bytes };
        bytes + 4.0 * 8.0 * (end / dt) * (1.0 + fields) * self.probe.len() as f64
    }

    /// Refuses a run that does not fit into memory, before its first step.
    ///
    /// # Errors
    /// Returns needed and available memory.
    pub fn refuse_too_large(
        &self,
        source: &Source,
        simulation: &Simulation,
        mechanics: Option<&Mechanics>,
        end: f64,
    ) -> Result<(), SceneError> {
        let nodes = simulation.problem().mesh.points.len();
        refuse(source, "mesh", &format!("{nodes} nodes"), self.memory(simulation, mechanics, end))
    }
}

fn refuse(source: &Source, key: &str, what: &str, needed: f64) -> Result<(), SceneError> {
    let available = available();
    if needed <= available {
        return Ok(());
    }
    let found = format!("{what}, which need about {}", gib(needed));
    Err(source.error(key, found, format!("at most {} (the available memory)", gib(available))))
}
