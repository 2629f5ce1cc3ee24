//! Bounds of the stiffness of particles, for fictitious masses and preconditioners.

use super::state::State;
use super::system::System;
use crate::bonds::BodyGeometry;
use crate::parallel;

/// Returns true if bonds differ so much in their tangent that every particle has its own mass.
pub fn has_own_mass<const D: usize>(system: &System<D>, state: &State<D>) -> bool {
    system.material.has_own_stiffness(state.stretches.tangent)
}

/// Gershgorin sum of a particle for a unit bond tangent: Σ_J (2 w V_J/|ξ|)(1 + max_{d≠e} |n_d n_e|). 1
/// without bonds, so that empty sites and detached particles stay at rest.
pub fn update_unit_mass<const D: usize>(bonds: &dyn BodyGeometry<D>, sites: &[u32], mass: &mut [f64]) {
    let sum = |site: u32| {
        let mut sum = 0.0;
        bonds.neighbours(site as usize, &mut |bond| {
            let cosine: [f64; D] = bond.bond.map(|x| (x / bond.length).abs());
            let mixed = (0..D).flat_map(|d| (0..d).map(move |e| (d, e)));
            let mixed = mixed.map(|(d, e)| cosine[d] * cosine[e]).fold(0.0, f64::max);
            sum += 2.0 * bond.weight / bond.length * (1.0 + mixed);
        });
        if sum > 0.0 { sum } else { 1.0 }
    };
    let is_whole = |site: u32| bonds.has_whole_family(site as usize);
    let alike = sites.iter().find(|&&site| is_whole(site)).map(|&site| sum(site));
    let of = |&site: &u32| alike.filter(|_| is_whole(site)).unwrap_or_else(|| sum(site));
    let sums: Vec<f64> = parallel::map_each(sites, of);
    for (&site, sum) in sites.iter().zip(sums) {
        mass[site as usize] = sum;
    }
}

/// Bounds of all particles with each bond's own tangent, over kθ.
pub fn own_mass<const D: usize>(system: &mut System<D>, state: &State<D>, mass: &mut Vec<f64>) {
    let sums = system.material.own_stiffness(&*system.bonds, &state.displacement, state.stretches.fitted);
    mass.resize(system.bonds.sites(), 1.0);
    for (&site, sum) in system.bonds.particles().iter().zip(sums) {
        mass[site as usize] = if sum > 0.0 { sum } else { 1.0 };
    }
}
