//! Quasi-static solution: what is to be solved, and how.

mod adr;
mod load;
mod passes;

pub use adr::{AdaptiveDynamicRelaxation, State, Status, System};
pub use load::{Loads, Support};
