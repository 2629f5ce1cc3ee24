//! Heat conduction and crystallization of semicrystalline polymers printed layer by layer.
//!
//! The `crystfem` command line solves problems written as scenes (`scene`, feature `case`); the same parts from Rust:
//!
//! ```
//! use crystfem::kinetics::{Constants, Kinetics, cooling_curve};
//! use crystfem::melting::Melting;
//!
//! // PA12 with column 1 of Table 4.1, cooled from 200 to 120 °C at 10 K/min
//! let kinetics = Kinetics::new(Constants::TABLE_4_1_COLUMN_1)?;
//! let curve = cooling_curve(&kinetics, 10.0 / 60.0, 473.15, 393.15, 0.0, 2);
//! let half = curve.temperature_at(0.5).expect("it crystallizes whole");
//! assert!((half - (152.77 + 273.15)).abs() < 0.02);
//!
//! // heated again, 24.7 % of the crystals survive 450 K
//! assert!((1.0 - Melting::PA12.molten(450.0) - 0.2468).abs() < 1e-4);
//! # Ok::<(), crystfem::Error>(())
//! ```

pub mod boundary;
mod element;
pub mod error;
pub mod exact;
mod fields;
pub mod fit;
pub mod history;
pub mod kinetics;
mod layers;
pub mod ledger;
pub mod material;
pub mod melting;
pub mod mesh;
pub mod point;
pub mod problem;
pub mod simulation;
mod solver;
mod system;
#[cfg(feature = "case")]
pub mod table;
pub mod time;

#[cfg(feature = "case")]
pub mod run;
#[cfg(feature = "case")]
pub mod scene;

pub use error::Error;
