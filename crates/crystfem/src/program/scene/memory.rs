//! Memory that the run of a part needs: as far as the mesh determines it before it is made, and the whole before a step is taken.
//!
//! Counted are the arrays that live at once, in bytes; the test `memory` of the workspace compares the sum with what whole
//! runs take.

use super::{Mechanics, PartScene};
use crate::simulation::Simulation;
use crate::time::Steps;
use harness::scene::{LineSpec, SceneError, Source};
use polycore::memory::{available, gib};

/// Threads and tables.
const ALWAYS: f64 = 20e6;
/// Canvases and letters of pictures, and what each stage adds to them.
const PICTURES: f64 = 40e6;
const STAGE: f64 = 12e6;
/// A node: its place, equation, a dozen vectors of a step and its solver, a checkpoint; an element: its nodes, its sets,
/// outer faces while they are sought. The mesh is there once.
const NODE: f64 = 290.0;
const ELEMENT: f64 = 115.0;
/// A node with adaptive steps: rates of all stages, what is known before one, the estimate of its error.
const ADAPTIVE: f64 = 40.0;
/// An element that is printed: births, layers, equations that are rebuilt.
const PRINTED: f64 = 300.0;
/// An element that bears stress: six branches and the stress at eight Gauss points, a copy of them and its bytes while a checkpoint is written; what it does
/// in a step. Motions, blocks and vectors of the solver at a node.
const STRESSED: f64 = 3.0 * 7.0 * 8.0 * 48.0 + 1800.0;
const STRESSED_NODE: f64 = 450.0;
/// Nodes of a group of the coarse level, six unknowns each.
const GROUP: f64 = 64.0;
/// A stored entry of the conduction matrix, while it is sorted.
const ENTRY: f64 = 40.0;
/// A material point: birth and material, both also while points move at a birth. Its mass, where it is stored. Each of its numbers: as it is,
/// while points move, in a checkpoint; and new, where it is not in its own place.
const POINT: f64 = 24.0;
const MASS: f64 = 8.0 * 2.0;
const STATE: f64 = 8.0 * 4.0;
const NEW: f64 = 8.0;
/// A point in an element has a place of its own, gradients, and a share of its element's matrix.
const POINT_IN_ELEMENT: f64 = 400.0;
/// An entry of factors: number, place, and its part of the front while they are made.
const FACTOR: f64 = 16.0;
/// Fields in a file and in pictures: nodes and cells, and each field as it is computed, packed, and read again.
const WRITTEN_NODE: f64 = 100.0;
const WRITTEN_ELEMENT: f64 = 80.0;
const FIELD: f64 = 64.0;
/// A point of a line: its element's nodes with their weights, the elements around it, its place; a number of a table.
const LINE_POINT: f64 = 24.0 + 2.0 * 56.0 + 8.0 * 16.0 + 32.0 + 24.0;
const CELL: f64 = 8.0;
/// Most fixed steps, and most times at which fields are written.
const MOST_STEPS: f64 = 1e9;
const MOST_FRAMES: f64 = 1e5;

/// Refuses a structured mesh of so many cells along each axis, with so many elements each, before anything of it is
/// allocated.
///
/// # Errors
/// What is needed and what there is, at `key`.
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

/// Refuses more steps and fields than any run takes.
///
/// # Errors
/// Their number, at the key that makes them so many.
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

/// Faces of an element, and up to three interfaces with their states and nodes.
const HEALED: f64 = 600.0;

impl PartScene {
    /// Bytes that a run up to `end` needs at most, of all that is printed.
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
            bytes += bearing * STRESSED + mechanics.matrices + nodes * STRESSED_NODE;
            // a band as wide as the section of a compact body
            let groups = nodes / GROUP + 1.0;
            bytes += 36.0 * groups * (groups.powf(2.0 / 3.0) + 2.0 * groups.cbrt() + 2.0) * 8.0;
            if self.output.fields {
                bytes += nodes * 3.0 * FIELD + elements * 7.0 * FIELD;
            }
        }
        bytes += system.rows.stored()[2] as f64 * ENTRY;
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
        bytes += simulation.factors(end) * FACTOR;
        if self.output.fields || self.output.pictures {
            bytes += nodes * (WRITTEN_NODE + fields * FIELD) + elements * WRITTEN_ELEMENT;
        }
        // the places of all lines, and one table at a time: arc length, position twice, fields
        let points = |line: &LineSpec| line.points as f64;
        bytes += LINE_POINT * self.output.line.iter().map(points).sum::<f64>();
        bytes += CELL * (7.0 + fields) * self.output.line.iter().map(points).fold(0.0, f64::max);
        // a row for each step in a list that grows, and a checkpoint of it
        let Steps::Fixed { dt } = simulation.settings.steps else { return bytes };
        bytes + 4.0 * 8.0 * (end / dt) * (1.0 + fields) * self.probe.len() as f64
    }

    /// Refuses a run that does not fit before it takes a step.
    ///
    /// # Errors
    /// What is needed and what there is.
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
