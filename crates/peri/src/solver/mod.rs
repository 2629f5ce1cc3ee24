//! Quasi-static solution: what is to be solved, and how.

mod adr;
mod load;
mod march;
mod passes;
mod system;

pub use adr::{AdaptiveDynamicRelaxation, Relaxation};
pub use load::{Loads, Support};
pub use march::{Equilibrium, Watch, march, stored_energy};
pub use system::{Breaking, Policy, Record, State, Status, System};
