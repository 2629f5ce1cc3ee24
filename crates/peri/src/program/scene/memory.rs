//! Estimates the memory of a variant before it is solved and, for a lattice, before it is built.
//!
//! The sum counts arrays that live at the same time, in bytes per site or particle; the test `memory` of the
//! workspace compares it with whole runs.

use super::{Scene, SolverMethod};
use crate::bonds::{Bonds, Stencil, storage};
use crate::material::{Past, SolidPoint};
use crate::solver::{Lbfgs, StepRecord};
use harness::scene::{SceneError, Source};
use polycore::constitutive::Flags;
use polycore::memory::{available, gib};

/// Bytes of threads, the fitted law and tables.
const ALWAYS: f64 = 20e6;
/// Vector fields of any method: displacement, velocity, force, loads, sums of a pass, and a checkpoint with
/// copies of the first three in a growing list.
const FIELDS: f64 = 10.0;
/// Vector fields of earlier equilibria, from which the next is predicted, with copies in a checkpoint, and of
/// springs.
const PAST: f64 = 6.0;
/// Vector fields of L-BFGS beside its pairs.
const FIELDS_OF_LBFGS: f64 = 8.0;
/// Bytes per particle of the coarse level of L-BFGS: factors in both precisions during the factorization.
const COARSE: f64 = 300.0;
/// Bytes per face of a plane body with its entries in both directions; a solid has about four times as many.
const FACE: f64 = 700.0;
/// Bytes per site of contact: cells, their order, the list of near pairs.
const CONTACT: f64 = 190.0;
/// Bytes per site of damage: bonds at the start, broken bonds.
const BREAKING: f64 = 24.0;
/// Bytes per particle of a field file: position, displacement, damage, line.
const WRITTEN: f64 = 64.0;
/// Bytes per particle and measure: two tensors of nine components.
const WRITTEN_TENSORS: f64 = 2.0 * 72.0;
/// Bytes per particle of compressed data.
const PACKED: f64 = 160.0;
/// Bytes of canvases and fonts of pictures.
const PICTURES: f64 = 60e6;
/// Bytes per particle in a picture: position, components, reach, cell.
const DRAWN: f64 = 150.0;
/// Bytes per particle in a picture of a solid: positions, values, lattice index, neighbours, faces.
const DRAWN_IN_SPACE: f64 = 350.0;
/// Bytes per particle near a line: site, position, cell, while they are sorted.
const NEAR_LINE: f64 = 100.0;
/// Bytes per bond of a cloud for the lists while they are built.
const BOND_LISTS: f64 = 12.0;

/// Returns the bytes of the bonds of a lattice and of solver fields.
fn bytes_of_sites<const D: usize>(scene: &Scene, sites: f64, stencil: usize) -> f64 {
    let masks = 8.0 * stencil.div_ceil(64) as f64;
    let vector = 8.0 * D as f64;
    // occupancy bits, site number, surface factors twice during their computation
    let mut each = masks + 8.0 + 2.0 * vector;
    each += FIELDS * vector + if scene.breaks() { PAST * vector } else { 8.0 };
    if scene.method() == SolverMethod::Lbfgs {
        // both fields of a pair are in single precision
        each += (FIELDS_OF_LBFGS + Lbfgs::default().memory as f64) * vector + COARSE;
    }
    if scene.has_followers() {
        // body force and displacement of the last equilibrium, in a checkpoint as well
        each += 4.0 * vector;
    }
    if let Some(contact) = &scene.contact {
        each += CONTACT;
        if contact.has_surfaces() {
            // radii, volumes, bonds; faces of the sides of a cube, each over a column of two horizons
            let side = 2.0 * D as f64 * sites.powf(-1.0 / D as f64);
            each += 20.0 + side.min(1.0) * FACE * if D == 2 { 1.0 } else { 4.0 };
        }
        each += if contact.has_friction() { 3.0 * vector } else { 0.0 };
    }
    each += super::part_law::memory_of_a_site(scene, masks);
    if scene.material.solid.is_some() {
        // histories in points, in the state, in a checkpoint; a heap block each
        let remembered = scene.solids().map(|(_, own)| own.memory_of_a_particle()).max().unwrap_or(0) as f64;
        each += if remembered > 0.0 {
            4.0 * 8.0 * remembered + 2.0 * (size_of::<Past>() as f64 + 32.0)
        } else {
            0.0
        };
        // states of particles, while they are made, and another set for outputs
        let (state, passes) = (size_of::<SolidPoint<D>>() as f64, 8.0 * (1 + D * D) as f64 + 5.0);
        each += if scene.observes_forces() { 3.0 * state + 2.0 * passes } else { 2.0 * state + passes };
    }
    if scene.breaks() {
        // the bonds at the start and at the end, a sum of each particle, for the area of cracks
        each += BREAKING + 2.0 * masks + 8.0;
    }
    if scene.is_mixed() {
        // displacement and surface factors in single precision
        each += vector;
    }
    sites * each
}

/// Returns the bytes of results.
fn bytes_of_results<const D: usize>(scene: &Scene, particles: f64) -> f64 {
    let tensor = 8.0 * (D * D) as f64;
    let measures = scene.stress.as_ref().map_or(0, |stress| stress.measures.len()) as f64;
    let kept = if scene.output.fields || !scene.output.line.is_empty() { 2.0 } else { 1.0 };
    let mut each = if measures > 0.0 { (3.0 + kept * measures) * tensor } else { 0.0 };
    if scene.output.fields {
        each += WRITTEN + PACKED + WRITTEN_TENSORS * measures;
    }
    if scene.is_learnt() {
        // flags, and as numbers
        each += size_of::<Flags>() as f64 + 16.0;
    }
    if scene.output.energy {
        each += 16.0;
    }
    if scene.output.contact {
        each += 8.0 * (1 + D) as f64;
    }
    if scene.output.pictures {
        each += if D == 2 { DRAWN } else { DRAWN_IN_SPACE };
    }
    let rows = match &scene.dynamics {
        Some(dynamics) => dynamics.method().records,
        None => scene.step_count(),
    };
    // a row of history and its copy in a checkpoint
    let row = size_of::<StepRecord>() + 24 * scene.boundary.len() + 48 * scene.output.section.len();
    // a table: arc length, position twice, every column; near particles and their cells
    let points = scene.output.line.iter().map(|line| line.points).max().unwrap_or(0) as f64;
    let line = points * 8.0 * (2.0 + 4.0 * D as f64 + 2.0 * measures * (D * D) as f64);
    if points > 0.0 {
        each += NEAR_LINE;
    }
    let canvas = if scene.output.pictures { PICTURES } else { 0.0 };
    canvas + line + particles * each + 2.0 * rows as f64 * row as f64
}

/// Returns the largest memory of a run, for a body that is built, bytes.
pub fn needed<const D: usize>(scene: &Scene, bonds: &dyn Bonds<D>) -> f64 {
    let (sites, particles) = (bonds.sites() as f64, bonds.particles().len() as f64);
    let body = match bonds.as_lattice() {
        Some(lattice) => bytes_of_sites::<D>(scene, sites, lattice.stencil().offsets.len()),
        None => {
            let directed = bonds.directed_bonds() as f64;
            // the weights by which bonds are shared out, in lists that grow
            let shared = if scene.stress.is_some() { 16.0 * directed + 24.0 * particles } else { 0.0 };
            bytes_of_sites::<D>(scene, sites, 0)
                + bytes_of_cloud::<D>(particles, directed)
                + bytes_of_relief::<D>(scene, particles)
                + bytes_of_pairs::<D>(scene, particles)
                + shared
                + super::part_law::memory_of_a_bond(scene) * directed
        }
    };
    ALWAYS + body + bytes_of_results::<D>(scene, particles)
}

/// Returns the bytes of a cloud: points as read, sorted and kept; bonds with weights, and their lists.
pub(super) fn bytes_of_cloud<const D: usize>(particles: f64, bonds: f64) -> f64 {
    let padded = bonds + 8.0 * particles;
    // and the rows that the kernel reads
    particles * (6.0 * 8.0 * D as f64 + 96.0 + 32.0 * (D as f64 - 1.0))
        + padded * (4.0 + 8.0 + 8.0 + BOND_LISTS)
}

/// Returns the bytes of the short bonds that give the crack area of a cloud, in a growing list, and of their
/// sums.
fn bytes_of_pairs<const D: usize>(scene: &Scene, particles: f64) -> f64 {
    let pairs = if D == 2 { 4.0 } else { 13.0 };
    if scene.breaks() { particles * pairs * (16.0 + 8.0) } else { 0.0 }
}

/// Returns the additional bytes of a solid in a cloud: θ, its part of the states, and the kernels' data of
/// particles.
fn bytes_of_relief<const D: usize>(scene: &Scene, particles: f64) -> f64 {
    if scene.material.solid.is_none() {
        return 0.0;
    }
    let (vector, tensor) = (8.0 * D as f64, 8.0 * (D * D) as f64);
    let (state, passes) = (3.0 * tensor + 24.0, 96.0 + 64.0 * D as f64 - tensor);
    let each = if scene.observes_forces() { 3.0 * state + 2.0 * passes } else { 2.0 * state + passes };
    particles * (vector + each)
}

/// Returns the sites of a lattice with these cells, and a lower bound of the memory of its run, bytes.
pub(super) fn bytes_of_lattice<const D: usize>(scene: &Scene, cells: [f64; D], ratio: f64) -> (f64, f64) {
    let sites = storage(cells, ratio);
    (sites, bytes_of_sites::<D>(scene, sites, Stencil::<D>::new(ratio).offsets.len()))
}

/// Refuses a body whose run exceeds the available memory.
///
/// # Errors
/// The needed and the available memory, at `key`.
pub(super) fn refuse_too_large<const D: usize>(
    source: &Source,
    scene: &Scene,
    key: &str,
    bonds: &dyn Bonds<D>,
) -> Result<(), SceneError> {
    let (needed, available) = (needed(scene, bonds), available());
    if needed <= available {
        return Ok(());
    }
    let found = format!("{} particles, whose run needs about {}", bonds.particles().len(), gib(needed));
    Err(source.error(key, found, format!("at most {} (the available memory)", gib(available))))
}
