//! Tractions on the surfaces as seen by the families of a solid.

use super::nonlocal_solid::NonlocalSolid;
use super::point_law::{Deformation, PointLaw, PointStress};
use super::tensor::BodyTensor;
use super::{Pointwise, SolverMaterial};
use crate::bonds::Bonds;
use crate::field::{CHUNK, Field};

/// A uniform stress, independent of the deformation.
struct Uniform<const D: usize>(BodyTensor<D>);

impl<const D: usize> PointLaw<D> for Uniform<D> {
    fn energy(&self, _: &Deformation<D>) -> f64 {
        0.0
    }
    fn respond(&self, _: &Deformation<D>) -> PointStress<D> {
        PointStress { piola: self.0, stabilisation: 0.0 }
    }
    fn stiffness(&self, _: &Deformation<D>) -> f64 {
        0.0
    }
    fn shear_modulus(&self) -> f64 {
        0.0
    }
    fn bulk_modulus(&self) -> f64 {
        0.0
    }
}

/// Body force P h_I/V_I, N/m³, that balances a uniform Piola stress P in a [`NonlocalSolid`], with h_I = Σ_J
/// (V_J I_J B_JI − V_I I_I B_IJ) and B_IJ = ω M⁻¹ξ/I: the area vector of the surface as seen by the families
/// of I and its neighbours. Σ h = 0; inside a lattice h = 0, and a flat face has a normal h within two
/// horizons below it.
pub fn surface_load<const D: usize>(bonds: &dyn Bonds<D>, piola: BodyTensor<D>) -> Field<D> {
    let mut solid = Pointwise::new(NonlocalSolid::new(Uniform(piola)), bonds);
    let rest = Field::zeros(bonds.sites());
    solid.prepare(bonds, &rest);
    let mut force = Field::zeros(bonds.sites());
    for (chunk, mut part) in force.chunks_mut().into_iter().enumerate() {
        solid.force(bonds, &rest, chunk * CHUNK, &mut part, None);
    }
    for &site in bonds.particles() {
        let inner = force.get(site as usize);
        force.set(site as usize, inner.map(|f| -f));
    }
    force
}
