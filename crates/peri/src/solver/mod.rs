//! What is to be solved, and how: quasi-static equilibria or explicit dynamics.

mod adr;
mod balance;
mod coarse;
mod lbfgs;
mod leap;
mod load;
mod march;
mod memory;
mod passes;
mod preconditioner;
mod system;
mod time_step;
mod verlet;

pub use adr::{AdaptiveDynamicRelaxation, Relaxation};
pub use balance::Balance;
pub use lbfgs::{LimitedMemory, PreconditionedLbfgs};
pub use load::{Loads, Support};
pub use march::{Equilibrium, Watch, march, stored_energy};
pub use system::{Breaking, Course, Event, Observer, Policy, Record, State, Status, System};
pub use verlet::{Motion, VelocityVerlet};
