//! Bond-based peridynamics of elastomers: chain-network bond laws, lattices without neighbour lists and clouds with
//! them, adaptive dynamic relaxation, Hardy stress.
//!
//! The `peri` command line solves problems written as scenes ([`scene`], feature `case`); the same parts from Rust:
//!
//! ```
//! use peri::bonds::{Bonds, LatticeBonds, VolumeCorrection, stretch_range};
//! use peri::calibrate::{Space, modulus};
//! use peri::geometry::{Operation, Shape, lattice};
//! use peri::material::BondMaterial;
//! use peri::potential::{KernelFit, Law};
//! use peri::solver::{DynamicRelaxation, Loads, State, Support, System};
//! use peri::stress::{BallVolume, Loaded, Measure, Missing, piola_on_lattice};
//!
//! fn main() -> Result<(), peri::Error> {
//!     // a strip of 40 mm × 20 mm × 1 mm, particles 1 mm apart, horizon 3.015 mm; E = 1 MPa
//!     let (spacing, thickness, ratio) = (1e-3, 1e-3, 3.015);
//!     let body = [Operation::Add(Shape::Box { min: [0.0, 0.0], max: [40e-3, 20e-3] })];
//!     let mut bonds = LatticeBonds::new(lattice(&body, spacing, thickness)?, ratio, VolumeCorrection::None, &[])?;
//!     let law = Law::ChainOffset.build(720.0, 1200.0, false)?;
//!     let modulus = modulus(Space::PlaneStress, 1e6, bonds.horizon(), thickness);
//!
//!     // three layers at each end: the left held, the right moved by 2 mm along x
//!     let end = |from: f64, to: f64| -> Vec<u32> {
//!         let inside = |&slot: &u32| (from..to).contains(&bonds.position(slot as usize)[0]);
//!         bonds.particles().iter().copied().filter(inside).collect()
//!     };
//!     let held = |x| Support { displacement: [Some(x), Some(0.0)], body_force: [0.0; 2] };
//!     let loads = Loads::new(bonds.slots(), &[(end(0.0, 3e-3), held(0.0)), (end(37e-3, 40e-3), held(2e-3))]);
//!
//!     let mut state = State::new(bonds.slots());
//!     let mut system = System::new(&mut bonds, BondMaterial::new(&*law, modulus), &loads, &[1.0]);
//!     DynamicRelaxation::default().solve(&mut system, &mut state, &mut |_, _| Ok(()), &mut |_, _| Ok(()))?;
//!     drop(system);
//!
//!     // σ₁₁ in the middle: about E times 2 mm over the free 34 mm
//!     let met = stretch_range(&bonds, &state.displacement);
//!     let range = [(1.0 + met.low).sqrt() - 1e-3, (1.0 + met.high).sqrt() + 1e-3];
//!     let fit = KernelFit::new(&*law, range, 1e-9)?;
//!     let loaded = Loaded { displacement: &state.displacement, fit: &fit, modulus, missing: Missing::Bonds };
//!     let piola = piola_on_lattice(&bonds, &loaded, Measure::Hardy, BallVolume::Particles);
//!     let middle = piola[piola.len() / 2 + 20][0][0];
//!     assert!((middle / 60e3 - 1.0).abs() < 0.1, "{middle} Pa");
//!     Ok(())
//! }
//! ```

pub mod bonds;
pub mod calibrate;
pub mod contact;
pub mod correction;
pub mod critical;
pub mod error;
pub mod exact;
pub mod field;
pub mod geometry;
pub mod integrals;
pub mod material;
pub mod potential;
mod quadrature;
pub mod solver;
pub mod stress;

#[cfg(feature = "case")]
pub mod run;
#[cfg(feature = "case")]
pub mod scene;

pub use error::Error;
