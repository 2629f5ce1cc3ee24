//! What is to be solved, and how: quasi-static equilibria or explicit dynamics.

mod adr;
mod balance;
mod breaking;
mod coarse;
mod covering;
mod lbfgs;
mod leap;
mod load;
mod march;
mod mass;
mod memory;
mod motion;
mod passes;
mod preconditioner;
mod scale;
mod severing;
mod state;
mod system;
mod time_step;
mod verlet;

pub use adr::{AdaptiveDynamicRelaxation, Relaxation};
pub use breaking::{Breaking, Policy};
pub use lbfgs::{LimitedMemory, PreconditionedLbfgs};
pub use load::{Loads, Support};
pub use march::{Equilibrium, march};
pub use motion::Motion;
pub use scale::Balance;
pub use state::{Event, Record, State, Status, Watch};
pub use system::{Course, Observer, System};
pub use verlet::VelocityVerlet;
