//! Solvers: the equations of a body, its loads, and methods for quasi-static equilibria or explicit dynamics.
//!
//! [`Lbfgs`] finds equilibria fastest and is the first choice; [`DynamicRelaxation`] finds the same
//! equilibria by the method of most publications; [`VelocityVerlet`] computes explicit dynamics: impact,
//! waves, running cracks.

mod adr;
mod adrift;
mod balance;
mod breaking;
mod coarse;
mod covering;
mod criterion;
mod cut;
mod fracture;
mod inverted;
mod lbfgs;
mod load;
mod load_stepping;
mod mass;
mod memory;
mod method;
mod motion;
mod pace;
mod passes;
mod places;
mod preconditioner;
mod record;
mod rotation;
mod scale;
mod snap_back;
mod state;
mod steps;
mod system;
mod time_step;
mod turn;
mod verlet;
mod verlet_friction;
mod verlet_step;

pub use adr::{DynamicRelaxation, RelaxationSolver};
pub use adrift::{Adrift, Stops, adrift};
pub use criterion::{Bilinear, Breaking, Criterion, Policy};
pub use fracture::{BreakingEvent, Fracture};
pub use inverted::{INVERTS, inverted};
pub use lbfgs::{Lbfgs, LbfgsSolver};
pub use load::{Loads, Support};
pub use load_stepping::{Equilibrium, QuasiStatic, load_stepping};
pub use method::{Method, StepCallback, Watch};
pub use motion::{DynamicEnergies, EqualSteps, Motion, StepLimits};
pub use record::{Status, StepRecord};
pub use scale::Balance;
pub use state::{BodyStretches, Counts, Residuals, State};
pub use steps::StepControl;
pub use system::{LoadCurve, StateObserver, System};
pub use turn::{Rotation, Turned};
pub use verlet::VelocityVerlet;
