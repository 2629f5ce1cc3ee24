//! Heat conduction and crystallization of semicrystalline polymers printed layer by layer.

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
pub mod table;
pub mod time;

#[cfg(feature = "cli")]
pub mod run;
#[cfg(feature = "cli")]
pub mod scene;

pub use error::Error;
