//! Shared ground of the polymer-mechanics toolkit: tensors, Langevin statistics, hyperelastic laws,
//! units, scenes, reports and output.

pub mod checkpoint;
#[cfg(feature = "command")]
pub mod command;
pub mod error;
pub mod hyperelastic;
pub mod langevin;
pub mod output;
pub mod report;
pub mod scene;
pub mod tensor;
pub mod units;

pub use error::Error;
