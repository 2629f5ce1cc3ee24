//! Heat conduction and crystallization of semicrystalline polymers printed layer by layer.
//!
//! The `crystfem` command line solves problems written as scenes (`scene`, feature `case`); the same from
//! Rust:
//!
//! ```
//! use crystfem::material::Semicrystalline;
//! use crystfem::mesh::Bar;
//! use crystfem::printed::PrintedPart;
//! use crystfem::simulation::Settings;
//!
//! # fn main() -> Result<(), crystfem::Error> {
//! // four layers of PA12, 20 mm × 10 mm × 0.5 mm each, one every 20 s, onto a plate at 80 °C in air of 80 °C
//! let bar = Bar::new([20e-3, 10e-3], 4, 0.5e-3);
//! let part = PrintedPart::bar(&bar, Semicrystalline::pa12()?)?
//!     .layer_every(20.0)
//!     .hold_surface("bottom", 353.15)
//!     .convection(15.0, 353.15);
//! let mut simulation = part.simulate(Settings::adaptive(1e-3))?;
//! simulation.run_until(200.0)?;
//!
//! // in the middle all that can crystallize has crystallized, X = X∞ = 25 %
//! let place = [0.0, 0.0, 1e-3];
//! let (kelvin, x) = (simulation.temperature_at(place), simulation.field_at("crystallinity", place));
//! assert!(kelvin.is_some_and(|kelvin| (kelvin - 353.15).abs() < 5.0), "{kelvin:?}");
//! assert!(x.is_some_and(|x| (x - 0.25).abs() < 2e-3), "{x:?}");
//! # Ok(())
//! # }
//! ```
//!
//! The modules below are the parts of [`printed`]. Use them directly for meshes from files, tool paths, other
//! conditions and materials of your own.

mod births;
pub mod boundary;
pub mod coupling;
mod element;
pub mod error;
pub mod exact;
mod fields;
mod file;
pub mod fit;
pub mod healing;
pub mod history;
pub mod kinetics;
pub mod ledger;
pub mod material;
pub mod mechanics;
pub mod melting;
pub mod mesh;
pub mod point;
pub mod print_plan;
pub mod printed;
pub mod problem;
mod simd_math;
pub mod simulation;
mod solver;
mod system;
pub mod table;
pub mod time;

#[cfg(feature = "case")]
pub mod program;

pub use error::Error;
