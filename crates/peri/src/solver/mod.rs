//! What is to be solved, and how: quasi-static equilibria or explicit dynamics.

mod adr;
mod balance;
mod breaking;
mod coarse;
mod covering;
mod criterion;
mod cut;
mod lbfgs;
mod load;
mod load_stepping;
mod mass;
mod memory;
mod method;
mod motion;
mod passes;
mod places;
mod preconditioner;
mod scale;
mod snap_back;
mod state;
mod system;
mod time_step;
mod verlet;
mod verlet_friction;
mod verlet_step;

pub use adr::{DynamicRelaxation, RelaxationSolver};
pub use criterion::{Bilinear, Breaking, Criterion, Policy};
pub use lbfgs::{Lbfgs, LbfgsSolver};
pub use load::{Loads, Support};
pub use load_stepping::{Equilibrium, load_stepping};
pub use method::{Finished, Method};
pub use motion::Motion;
pub use scale::Balance;
pub use state::{Event, Record, State, Status, Watch};
pub use system::{Course, Observer, System};
pub use verlet::VelocityVerlet;
