//! What is to be solved, and how: quasi-static equilibria or explicit dynamics.

mod adr;
mod leap;
mod load;
mod march;
mod passes;
mod system;
mod time_step;
mod verlet;

pub use adr::{AdaptiveDynamicRelaxation, Relaxation};
pub use load::{Loads, Support};
pub use march::{Equilibrium, Watch, march, stored_energy};
pub use system::{Breaking, Policy, Record, State, Status, System};
pub use verlet::{Motion, VelocityVerlet};
