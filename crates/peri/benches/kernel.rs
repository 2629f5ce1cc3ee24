//! Bodies and materials on which force kernels are measured.

use peri::Error;
use peri::bonds::{Bonds, Lattice, LatticeBonds, LawShares, VolumeCorrection};
use peri::calibrate::{Space, modulus};
use peri::field::{CHUNK, Field};
use peri::geometry::{Operation, Shape, lattice};
use peri::material::{
    BondMaterial, Correspondence, EightChainSolid, Material, NonlocalSolid, PartLaw, SolverMaterial,
};
use peri::potential::{KernelFit, Law};
use polycore::constitutive::hyperelastic::{Compressible, NeoHookean, Volumetric};
use polycore::constitutive::network::Activation::Softplus;
use polycore::constitutive::surrogate::{Header, Kind, Surrogate, Symmetry};
use rayon::prelude::*;
use std::sync::Arc;

/// Horizon over spacing of every measurement.
pub const RATIO: f64 = 3.015;

/// Builds a square or cube of about `particles` particles.
pub fn block<const D: usize>(particles: f64) -> Result<Lattice<D>, Error> {
    let side = particles.powf(1.0 / D as f64).round();
    let body = [Operation::Add(Shape::Box { min: [0.0; D], max: [side; D] })];
    lattice(&body, 1.0, 1.0)
}

/// Returns the bonds of a box.
pub fn bonds<const D: usize>(lattice: Lattice<D>) -> Result<LatticeBonds<D>, Error> {
    LatticeBonds::new(lattice, RATIO, VolumeCorrection::None, &[])
}

/// Returns a law fitted for these stretches, and a displacement.
pub fn loaded<const D: usize>(
    bonds: &mut dyn Bonds<D>,
    law: Law,
    range: [f64; 2],
) -> Result<(KernelFit, Field<D>), Error> {
    let space = if D == 2 { Space::PlaneStress } else { Space::Solid };
    let built = law.build(720.0, 1200.0, false)?;
    let fit = KernelFit::new(&*built, range, 1e-9)?;
    bonds.set_law(&fit, modulus(space, 1.0, bonds.horizon(), 1.0));
    let mut displacement = Field::<D>::zeros(bonds.sites());
    for &site in bonds.particles() {
        let x = bonds.position(site as usize);
        displacement.set(site as usize, std::array::from_fn(|d| 1e-3 * (0.37 * x[d]).sin()));
    }
    Ok((fit, displacement))
}

/// Returns chains of 720 links with parts of 25 links where `is_part` is true of a place, m: all bonds have
/// one law, or two.
pub fn two_laws<const D: usize>(
    bonds: &dyn Bonds<D>,
    is_part: impl Fn([f64; D]) -> bool,
) -> Result<Box<dyn SolverMaterial<D>>, Error> {
    let [rest, law] = [720.0, 25.0].map(|links| Law::ChainOffset.build(links, 1200.0, false));
    let space = if D == 2 { Space::PlaneStress } else { Space::Solid };
    let material = BondMaterial::new(rest?, modulus(space, 1.0, bonds.horizon(), 1.0));
    let shares = LawShares::new(bonds, 2, |_, place| (usize::from(is_part(place)), 1.0))?;
    let part = PartLaw { part: "part".to_owned(), law: law?.into() };
    Ok(material.with_parts(vec![part], Arc::new(shares))?.respond(bonds))
}

/// Response of a material, and its name.
pub type Named<const D: usize> = (&'static str, Box<dyn SolverMaterial<D>>);

/// Returns solids with two passes: chains of 25 links, and by correspondence neo-Hookean rubber, K/μ = 100,
/// and a learnt law, a network of 209 random weights.
pub fn solids<const D: usize>(bonds: &dyn Bonds<D>) -> Result<[Named<D>; 3], Error> {
    let space = if D == 2 { Space::PlaneStrain } else { Space::Solid };
    let law =
        NeoHookean::new(1.0).and_then(|law| Compressible::new(law, Volumetric::Ciarlet { lame: 100.0 }));
    let law = law.map_err(|error| Error::geometry(error.to_string()))?;
    let kind = Kind::polyconvex_energy(Symmetry::Isotropic);
    let learnt = Surrogate::random(Header::new(kind, &[(16, Softplus), (8, Softplus)], 1), 1);
    let learnt = learnt.map_err(|error| Error::geometry(error.to_string()))?;
    let chains = NonlocalSolid::new(EightChainSolid::new(space, 1.0, 25.0, 100.0)?).respond(bonds);
    let neo_hookean = NonlocalSolid::new(Correspondence::new(law, space)?).respond(bonds);
    let learnt = NonlocalSolid::new(Correspondence::new(learnt, space)?).respond(bonds);
    Ok([
        ("eight-chain", chains),
        ("correspondence neo-hookean", neo_hookean),
        ("correspondence learnt", learnt),
    ])
}

/// Computes the states and forces of all particles.
pub fn both_passes<const D: usize>(
    solid: &mut dyn SolverMaterial<D>,
    bonds: &dyn Bonds<D>,
    displacement: &Field<D>,
    out: &mut Field<D>,
) {
    solid.prepare(bonds, displacement);
    forces(&*solid, bonds, displacement, out);
}

/// Computes the forces of all particles.
pub fn forces<const D: usize>(
    solid: &dyn SolverMaterial<D>,
    bonds: &dyn Bonds<D>,
    displacement: &Field<D>,
    out: &mut Field<D>,
) {
    out.chunks_mut()
        .into_par_iter()
        .enumerate()
        .for_each(|(chunk, mut force)| solid.force(bonds, displacement, chunk * CHUNK, &mut force, None));
}
