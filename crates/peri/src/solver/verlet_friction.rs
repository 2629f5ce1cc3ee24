//! Friction and rigid planes in a step of velocity Verlet.
//!
//! Friction reads the half-step velocities of both sides, so that it has a pass of its own between the forces and the second half of the
//! kick: no work item changes a velocity that another one reads. Its work is Σ ½(force before + force after)·Δu like all
//! others, so that the energies balance to O(Δt²).

use super::state::State;
use super::system::System;
use super::verlet_step::{Two, VerletStep};
use crate::contact::{Rubbed, Rubbing};
use crate::field::{Field, chunk_range};
use rayon::prelude::*;

/// New forces of friction for the half-step velocities, added to the force; `old` are those of the step before. Adds to the energy that
/// friction has taken what it took in this step.
pub fn friction_pass<const D: usize>(
    system: &System<D>,
    state: &mut State<D>,
    volumes: &[f64],
    leap: &VerletStep,
    old: Option<Field<D>>,
) {
    let Some(contact) = system.friction() else { return };
    let sites = volumes.len();
    let rubbing = Rubbing { density: leap.density, step: leap.step };
    let (displacement, velocity, loads) = (&state.displacement, &state.velocity, &*system.loads);
    let moves = leap.factors[1] - leap.factors[0];
    let work = |chunk: usize, force: &[&mut [f64]; D]| {
        let mut sum = 0.0;
        for (k, site) in chunk_range(chunk, sites).enumerate() {
            let (v, constrained) = (velocity.get(site), loads.constrained(site));
            for d in (0..D).filter(|&d| force[d][k] != 0.0) {
                let held = loads.displacement.as_ref().filter(|_| constrained >> d & 1 == 1);
                let increment = held.map_or(leap.step * v[d], |full| moves * full.get(site)[d]);
                sum += volumes[site] * force[d][k] * increment;
            }
        }
        sum
    };
    let mut friction = old.unwrap_or_else(|| Field::zeros(sites));
    let of = |(chunk, (mut own, total)): (usize, Two<D>)| {
        let before = work(chunk, &own);
        own.iter_mut().for_each(|part| part.fill(0.0));
        let rubbed = contact.friction(&*system.bonds, displacement, velocity, &rubbing, chunk, &mut own);
        for d in 0..D {
            total[d].iter_mut().zip(&*own[d]).for_each(|(f, rub)| *f += rub);
        }
        (0.5 * (before + work(chunk, &own)), rubbed)
    };
    let parts: Vec<(f64, Rubbed)> =
        friction.chunks_mut().into_par_iter().zip(state.force.chunks_mut()).enumerate().map(of).collect();
    let mut taken = -parts.iter().map(|(work, _)| work).sum::<f64>();
    let none = Rubbed::new(contact.planes().count());
    let Rubbed { planes, slip } = parts.iter().fold(none, |sum, (_, rubbed)| sum.and(rubbed));
    // what planes drag is work of theirs, not heat
    taken += work_of_planes(contact.moved(), &state.rubbing, &planes);
    state.motion.rubbed += taken;
    state.motion.slip = state.motion.slip.max(slip);
    (state.friction, state.rubbing) = (Some(friction), planes);
}

/// Adds the work of planes that have moved; `rubbed` is their friction before this step.
pub fn plane_pass<const D: usize>(system: &System<D>, state: &mut State<D>, rubbed: &[[f64; 3]]) {
    let Some(contact) = system.repulsion() else { return };
    if contact.planes().all(|plane| plane.displacement == [0.0; D] && plane.velocity == [0.0; D]) {
        return;
    }
    let resting = contact.resting(&*system.bonds, &state.displacement);
    let pushing: Vec<[f64; 3]> = resting.iter().map(|plane| plane.force).collect();
    state.work += work_of_planes(contact.moved(), &state.pushing, &pushing)
        + work_of_planes(contact.moved(), rubbed, &state.rubbing);
    state.pushing = pushing;
}

/// Σ ½(force before + force after)·Δ; nothing before the first step.
fn work_of_planes<const D: usize>(
    moved: impl Iterator<Item = [f64; D]>,
    before: &[[f64; 3]],
    after: &[[f64; 3]],
) -> f64 {
    let each = moved.zip(before.iter().zip(after));
    each.map(|(moved, (a, b))| (0..D).map(|d| 0.5 * (a[d] + b[d]) * moved[d]).sum::<f64>()).sum()
}
