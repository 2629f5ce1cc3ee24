//! Peridynamics of elastomers: chain-network bond laws and solids of any Poisson ratio, on regular lattices
//! without neighbour lists and on clouds of particles; quasi-static equilibria, explicit dynamics, fracture,
//! contact and stress.
//!
//! [`prelude`] has the types of most programs: a [`Body`](model::Body), a material and loads make a
//! [`Model`](model::Model), which a method solves.
//!
//! ```
//! use peri::prelude::*;
//!
//! # fn main() -> Result<(), peri::Error> {
//! // a strip of 40 mm × 20 mm × 1 mm, particles 1 mm apart; its left end is clamped, its right end moves
//! // by 2 mm
//! let body = Body::lattice(Shape::rectangle([0.0, 0.0], [40e-3, 20e-3]), 1e-3).plane_stress(1e-3);
//! let model = Model::new(body, Rubber::new(Law::ChainOffset, 1e6))
//!     .clamp(|[x, _]| x < 3e-3)
//!     .displace(|[x, _]| x > 37e-3, [2e-3, 0.0]);
//! let mut simulation = model.build()?;
//! simulation.solve(Lbfgs::default())?;
//!
//! // σ₁₁ in the middle: about E times 2 mm over the 34 mm between the grips
//! let stress = simulation.cauchy(StressMethod::Hardy)?;
//! let middle = stress[stress.len() / 2 + 20][0][0];
//! assert!((middle / 60e3 - 1.0).abs() < 0.1, "{middle} Pa");
//! # Ok(())
//! # }
//! ```
//!
//! # Which method
//!
//! | problem | method |
//! |---|---|
//! | equilibria, with or without breaking bonds | [`Lbfgs`](solver::Lbfgs), the fastest |
//! | equilibria by the method of most publications | [`DynamicRelaxation`](solver::DynamicRelaxation) |
//! | impact, waves, running cracks | [`VelocityVerlet`](solver::VelocityVerlet) |
//!
//! # Which module
//!
//! The modules below are the parts of [`model`]. Use them directly for clouds of particles ([`bonds`]),
//! surface corrections ([`correction`]), your own material ([`material::Material`]) or bond law
//! ([`potential::BondPotential`]), contact ([`contact`]), and results such as section forces and J-integrals
//! ([`probe`]). All quantities are in SI units. The `peri` command line solves problems written as scenes
//! (`program::scene`, feature `case`).

pub mod amplitude;
pub mod bonds;
pub mod calibrate;
pub mod contact;
pub mod correction;
pub mod critical;
pub mod error;
pub mod exact;
pub mod field;
pub mod geometry;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod integrals;
pub mod material;
pub mod model;
mod parallel;
pub mod potential;
pub mod prelude;
pub mod probe;
mod quadrature;
pub mod solver;
pub mod stress;
pub mod surface;

#[cfg(feature = "case")]
pub mod program;

pub use error::Error;
