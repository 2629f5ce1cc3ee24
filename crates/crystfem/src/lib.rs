//! Heat conduction and crystallization of semicrystalline polymers printed layer by layer.

pub mod error;
pub mod exact;
pub mod kinetics;
pub mod material;
pub mod melting;
pub mod mesh;

pub use error::Error;
