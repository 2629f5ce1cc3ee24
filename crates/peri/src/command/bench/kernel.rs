//! What force kernels are measured on; `cargo bench` takes it, too.

use peri::bonds::{Bonds, Lattice, LatticeBonds, VolumeCorrection};
use peri::calibrate::{Space, modulus};
use peri::field::Field;
use peri::geometry::{Operation, Shape, lattice};
use peri::potential::{KernelFit, Law};
use peri::run::Failure;

/// Horizon over spacing of every measurement.
pub const RATIO: f64 = 3.015;

/// A square or cube of about so many particles.
pub fn block<const D: usize>(particles: f64) -> Result<Lattice<D>, Failure> {
    let side = particles.powf(1.0 / D as f64).round();
    let body = [Operation::Add(Shape::Box { min: [0.0; D], max: [side; D] })];
    Ok(lattice(&body, 1.0, 1.0)?)
}

/// Its bonds.
pub fn bonds<const D: usize>(lattice: Lattice<D>) -> Result<LatticeBonds<D>, Failure> {
    Ok(LatticeBonds::new(lattice, RATIO, VolumeCorrection::None, &[])?)
}

/// Gives bonds a law, fitted for these stretches, and a displacement for them to act on.
pub fn loaded<const D: usize>(
    bonds: &mut dyn Bonds<D>,
    law: Law,
    range: [f64; 2],
) -> Result<(KernelFit, Field<D>), Failure> {
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
