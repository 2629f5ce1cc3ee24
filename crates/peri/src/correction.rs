//! The energy surface correction: bonds near a free surface are stiffened until a homogeneous strain stores
//! the energy that the continuum stores. Madenci & Oterkus, Peridynamic Theory and Its Applications (2014),
//! §4.2.

use crate::bonds::{BodyGeometry, Property};
use crate::field::Field;
use crate::parallel;

/// Computes per-particle factors g_d = W_exact/W_d for a uniaxial strain ε in each direction d, with
/// W_exact = ½ C₁₁₁₁ ε² and the bonds' W_d = ¼ Σ_J 6kθ V_J |ξ| n_d⁴ ε² (dual force f = 2t, linear bond t =
/// 3kθ(λ − 1)). A particle without bonds along d gets 1.
pub fn surface_factors<const D: usize>(
    bonds: &dyn BodyGeometry<D>,
    modulus: f64,
    stiffness_1111: f64,
) -> Field<D> {
    let mut factors = Field::zeros(bonds.sites());
    let values: Vec<[f64; D]> = parallel::map_each(bonds.particles(), |&site| {
        let mut energy = [0.0; D];
        bonds.neighbours(site as usize, &mut |bond| {
            for d in 0..D {
                let cosine = bond.bond[d] / bond.length;
                energy[d] += 1.5 * modulus * bond.volume * bond.length * cosine.powi(4);
            }
        });
        energy.map(|w| if w > 0.0 { 0.5 * stiffness_1111 / w } else { 1.0 })
    });
    for (&site, value) in bonds.particles().iter().zip(values) {
        factors.set(site as usize, value);
    }
    factors
}

/// Computes the factors of bonds, see [`crate::bonds::BondForces::set_factors`], from surface correction and
/// from the ratio of the micromodulus to that of the law: a bond has the mean of its two ends. `None` if all
/// are 1.
pub fn bond_factors<const D: usize>(
    bonds: &dyn BodyGeometry<D>,
    surface: Option<Field<D>>,
    micromodulus: &Property,
) -> Option<Field<D>> {
    if micromodulus.uniform() == Some(1.0) {
        return surface;
    }
    let mut factors = Field::zeros(bonds.sites());
    for site in bonds.particles().iter().map(|&site| site as usize) {
        let surface = surface.as_ref().map_or([1.0; D], |surface| surface.get(site));
        factors.set(site, surface.map(|g| g * micromodulus.value_at(site)));
    }
    Some(factors)
}
