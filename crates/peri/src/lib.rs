//! Bond-based peridynamics of elastomers: chain-network bond laws, lattices without neighbour lists and clouds with
//! them, adaptive dynamic relaxation, Hardy stress.

pub mod bonds;
pub mod calibrate;
pub mod correction;
pub mod critical;
pub mod error;
pub mod exact;
pub mod field;
pub mod geometry;
pub mod potential;
mod quadrature;
pub mod solver;
pub mod stress;

#[cfg(feature = "cli")]
pub mod checkpoint;
#[cfg(feature = "cli")]
pub mod run;
#[cfg(feature = "cli")]
pub mod scene;

pub use error::Error;
