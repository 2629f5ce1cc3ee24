//! Bodies and loads that a graphics card can take, for all methods on one.

use super::criterion::Criterion;
use super::system::System;
use crate::bonds::{LatticeBonds, Property};
use crate::contact::{Contact, PairRows, PlaneRows};
use crate::error::Error;
use crate::field::Field;
use crate::gpu::DeviceLoads;
use crate::potential::KernelFit;

/// Lattice of a system with its fitted law q and the modulus kθ, N/m⁶.
///
/// # Errors
/// [`Error::Device`] for other bonds.
pub fn lattice_with_law<'a, const D: usize>(
    system: &'a System<D>,
) -> Result<(&'a LatticeBonds<D>, (&'a KernelFit, f64)), Error> {
    let known = lattice(system).and_then(|bonds| Some((bonds, bonds.law()?)));
    known.ok_or_else(|| Error::Device("expected a lattice with a law".to_owned()))
}

/// Loads as kernels take them.
pub fn loads<'a, const D: usize>(system: &'a System<D>) -> DeviceLoads<'a, D> {
    let loads = &system.loads;
    DeviceLoads {
        held: &loads.constrained,
        displacement: loads.displacement.as_ref(),
        body_force: loads.body_force.as_ref(),
    }
}

/// Rows of the planes of a system.
pub fn planes<const D: usize>(system: &System<D>) -> Option<PlaneRows<D>> {
    system.repulsion().and_then(Contact::plane_rows)
}

/// Rows of the pairs of particles that may touch in a system.
pub fn pairs<const D: usize>(system: &System<D>) -> Option<PairRows<D>> {
    system.repulsion().and_then(|contact| contact.pair_rows(&*system.bonds))
}

/// Lattice of a system.
pub fn lattice<'a, const D: usize>(system: &'a System<D>) -> Option<&'a LatticeBonds<D>> {
    system.bonds.as_lattice()
}

/// Critical stretch, where bonds break at one.
pub fn critical<'a, const D: usize>(system: &'a System<D>) -> Option<&'a Property> {
    match system.breaking.as_ref().map(|breaking| &breaking.criterion) {
        Some(Criterion::Stretch(stretch)) => Some(stretch),
        _ => None,
    }
}

/// e from which bonds are listed: those that break, and some within rounding of them.
pub fn limit<const D: usize>(system: &System<D>) -> f64 {
    critical(system)
        .map_or(f64::INFINITY, |critical| (critical.least() * critical.least() - 1.0) * (1.0 - 1e-6) - 1e-12)
}

/// Σ b² of the body forces at load factor 1 on components that are not prescribed, (N/m³)².
pub fn squares<const D: usize>(system: &System<D>) -> f64 {
    let Some(body) = &system.loads.body_force else { return 0.0 };
    let square = |(site, d, b): (usize, usize, f64)| {
        if system.loads.constrained(site) >> d & 1 == 1 { 0.0 } else { b * b }
    };
    let components = body.components().into_iter().enumerate();
    let all = components.flat_map(|(d, each)| each.iter().enumerate().map(move |(site, b)| (site, d, *b)));
    all.map(square).sum()
}

/// Puts held components of a displacement from a device back to those before, which rounding may have
/// changed.
pub fn held_as_before<const D: usize>(
    system: &System<D>,
    before: &Field<D>,
    mut displacement: Field<D>,
) -> Field<D> {
    for (site, held) in system.loads.constrained.iter().enumerate().filter(|(_, held)| **held != 0) {
        let (known, mut found) = (before.get(site), displacement.get(site));
        (0..D).filter(|d| held >> d & 1 == 1).for_each(|d| found[d] = known[d]);
        displacement.set(site, found);
    }
    displacement
}

/// Refuses what only the host can do.
pub fn refuse<const D: usize>(system: &System<D>) -> Result<(), Error> {
    let softens = matches!(
        system.breaking.as_ref().map(|breaking| &breaking.criterion),
        Some(Criterion::Energy(_) | Criterion::Softening { .. })
    );
    let what = [
        (system.bonds.as_lattice().is_none(), "a body of points"),
        (!system.bonds.images().is_empty(), "periodic sides"),
        (
            !system.material.is_fitted_law(),
            "a solid, or bonds with prestrains, of several laws, or that soften",
        ),
        (softens, "bonds that break by their energy"),
        (!system.loads.rigid.is_empty(), "a region that moves as a whole"),
        (system.loads.follows(), "a body force that follows the displacement"),
    ];
    let contact = system.repulsion().and_then(Contact::beyond_rows);
    match what.iter().find(|(has, _)| *has).map(|(_, what)| *what).or(contact) {
        Some(what) => Err(Error::Device(format!("unexpected {what}: only the processor does that"))),
        None => Ok(()),
    }
}
