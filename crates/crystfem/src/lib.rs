//! Heat conduction and crystallization of semicrystalline polymers printed layer by layer.

pub mod boundary;
mod element;
pub mod error;
pub mod exact;
pub mod kinetics;
mod layers;
pub mod ledger;
pub mod material;
pub mod melting;
pub mod mesh;
pub mod problem;
pub mod simulation;
mod solver;
mod system;
pub mod time;

pub use error::Error;
