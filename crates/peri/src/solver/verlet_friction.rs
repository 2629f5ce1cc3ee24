//! Friction and rigid surfaces in a step of velocity Verlet.
//!
//! Friction reads the half-step velocities of both sides, so it has a pass of its own between the forces and
//! the second half of the kick: no work item changes a velocity that another one reads. Its work is Σ ½(force
//! before + force after)·Δu like all others, so that the energies balance to O(Δt²).

use super::state::State;
use super::system::System;
use super::verlet_step::{FieldPair, VerletStep};
use crate::contact::{Contact, RigidSurface};
use crate::field::{Field, chunk_range};
use crate::parallel;

/// Computes friction for the half-step velocities, and adds it to the force; `old` are the friction forces of
/// the previous step. Adds the work of friction in this step that is not stored to the dissipated energy.
pub fn friction_pass<const D: usize>(
    system: &mut System<D>,
    state: &mut State<D>,
    volumes: &[f64],
    leap: &VerletStep,
    old: Option<Field<D>>,
) {
    let Some(contact) = system.contact.as_mut().filter(|contact| contact.has_friction()) else { return };
    let sites = volumes.len();
    // a body moving at the start slides to its limit in the first step; after another one it has its slip
    let first = if state.stage.finished == 0 { state.motion.limits.longest } else { 0.0 };
    let span = if leap.step > 0.0 { leap.step } else { first };
    let sliding =
        contact.slide_on(&*system.bonds, &state.displacement, &state.velocity, span, &state.contact.grips);
    state.contact.grips = contact.active_grips().to_vec();
    let (contact, velocity, loads) = (&*contact, &state.velocity, &*system.loads);
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
    let of = |chunk: usize, (mut own, total): FieldPair<D>| {
        let before = work(chunk, &own);
        own.iter_mut().for_each(|part| part.fill(0.0));
        contact.add_friction(chunk, &mut own);
        for d in 0..D {
            total[d].iter_mut().zip(&*own[d]).for_each(|(f, drag)| *f += drag);
        }
        0.5 * (before + work(chunk, &own))
    };
    let items = friction.chunks_mut().into_iter().zip(state.force.chunks_mut()).collect();
    let mut taken = -parallel::map_items(items, of).iter().sum::<f64>();
    // the drag of surfaces is work, not heat
    taken += work_of_surfaces(contact.moved(), &state.contact.surface_friction, &sliding.surfaces);
    if leap.step > 0.0 {
        state.motion.energies.rubbed += taken - (sliding.stored - state.motion.energies.stuck);
    } else {
        state.work += sliding.stored;
    }
    state.motion.energies.stuck = sliding.stored;
    (state.contact.friction, state.contact.surface_friction) = (Some(friction), sliding.surfaces);
}

/// Adds the work of surfaces that have moved; `rubbed` is their friction before this step.
pub fn surface_pass<const D: usize>(system: &System<D>, state: &mut State<D>, rubbed: &[[f64; 3]]) {
    let Some(contact) = system.repulsion() else { return };
    if !contact.surfaces().any(RigidSurface::moves) {
        return;
    }
    let resting = contact.surface_reactions(&state.displacement);
    let pushing: Vec<[f64; 3]> = resting.iter().map(|resting| resting.force).collect();
    let rubbing = work_of_surfaces(contact.moved(), rubbed, &state.contact.surface_friction);
    state.work += work_of_pushes(contact, state, pushing) + rubbing;
}

/// Work of surfaces that have moved, J, which push the body with these forces, N, from now on.
pub fn work_of_pushes<const D: usize>(
    contact: &Contact<D>,
    state: &mut State<D>,
    pushing: Vec<[f64; 3]>,
) -> f64 {
    let before = std::mem::replace(&mut state.contact.surface_push, pushing);
    work_of_surfaces(contact.moved(), &before, &state.contact.surface_push)
}

/// Σ ½(force before + force after)·Δ; zero before the first step.
fn work_of_surfaces<const D: usize>(
    moved: impl Iterator<Item = [f64; D]>,
    before: &[[f64; 3]],
    after: &[[f64; 3]],
) -> f64 {
    let each = moved.zip(before.iter().zip(after));
    each.map(|(moved, (a, b))| (0..D).map(|d| 0.5 * (a[d] + b[d]) * moved[d]).sum::<f64>()).sum()
}
