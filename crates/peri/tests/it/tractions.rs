//! Tractions on solids balance uniform stresses exactly.

use crate::bodies::Body;
use crate::solids::neo_hooke;
use evidence::at_most;
use peri::bonds::Bonds;
use peri::calibrate::Space;
use peri::field::Field;
use peri::material::{
    BodyTensor, Deformation, NonlocalSolid, PointLaw, Pointwise, SolverMaterial, surface_load,
};

/// The surface load of the stress of a homogeneous deformation balances every particle of a body with a hole
/// and cracks, on a lattice and as a cloud; the area vectors sum to 0, and Σ h⊗X is the volume (Gauss).
fn judge<L: PointLaw<D>, const D: usize>(name: &str, bonds: &dyn Bonds<D>, solid: NonlocalSolid<L>) {
    let gradient =
        BodyTensor::<D>::from_fn(|a, b| [[0.3, -0.1, 0.05], [0.2, -0.2, 0.1], [0.0, 0.15, 0.1]][a][b]);
    let stress = solid.law().respond(&Deformation::homogeneous(gradient)).piola;
    let load = surface_load(bonds, stress);
    let mut displacement = Field::zeros(bonds.sites());
    for &site in bonds.particles() {
        let place = bonds.position(site as usize);
        let moved = (0..D).map(|a| (0..D).map(|b| gradient[(a, b)] * place[b]).sum());
        let moved: Vec<f64> = moved.collect();
        displacement.set(site as usize, std::array::from_fn(|a| moved[a]));
    }
    let mut material = Pointwise::new(solid, bonds);
    material.prepare(bonds, &displacement);
    let mut force = Field::zeros(bonds.sites());
    for (chunk, mut part) in force.chunks_mut().into_iter().enumerate() {
        material.force(bonds, &displacement, chunk, &mut part, None);
    }
    let area = surface_load(bonds, BodyTensor::<D>::identity());
    let (mut off, mut most, mut sum, mut volume) = (0.0_f64, 0.0_f64, [0.0; D], 0.0);
    let mut moment = BodyTensor::<D>::zeros();
    for &site in bonds.particles() {
        let site = site as usize;
        let (inner, outer, h) = (force.get(site), load.get(site), area.get(site));
        volume += bonds.volume(site);
        for a in 0..D {
            off = off.max((inner[a] + outer[a]).abs());
            most = most.max(outer[a].abs());
            sum[a] += bonds.volume(site) * h[a];
            for b in 0..D {
                moment[(a, b)] += bonds.volume(site) * h[a] * bonds.position(site)[b];
            }
        }
    }
    let gauss = (moment / volume - BodyTensor::identity()).norm();
    at_most(&format!("traction_balance_{name}"), off / most, 1e-12);
    at_most(&format!("traction_gauss_{name}"), gauss, 1e-12);
    at_most(&format!("traction_sum_{name}"), sum.iter().fold(0.0, |most: f64, x| most.max(x.abs())), 1e-10);
}

#[test]
fn uniform_stresses_are_balanced_in_every_particle() {
    let plane = Body::<2>::damaged([14, 12], 0.5, 3.015).build();
    judge("2d_lattice", &plane.lattice, neo_hooke(Space::PlaneStrain, 10.0));
    judge("2d_cloud", &plane.cloud, neo_hooke(Space::PlaneStress, 10.0));
    let space = Body::<3>::damaged([9, 8, 7], 0.5, 3.015).build();
    judge("3d_lattice", &space.lattice, neo_hooke(Space::Solid, 10.0));
    judge("3d_cloud", &space.cloud, neo_hooke(Space::Solid, 10.0));
}
