//! Solvers: the equations of a body, its loads, and methods for quasi-static equilibria or explicit dynamics.
//!
//! [`Lbfgs`] finds equilibria fastest and is the first choice; [`DynamicRelaxation`] finds the same
//! equilibria by the method of most publications; [`VelocityVerlet`] computes explicit dynamics: impact,
//! waves, running cracks.

mod balance;
mod breaking;
mod coarse;
mod criterion;
mod curves;
#[cfg(feature = "gpu")]
mod device_body;
#[cfg(feature = "gpu")]
mod device_pairs;
#[cfg(feature = "gpu")]
mod device_run;
mod dynamic_relaxation;
mod face_springs;
mod fit_range;
mod flights;
mod force_fields;
mod force_scale;
mod fracture;
mod held_contacts;
mod inverted;
mod lbfgs;
#[cfg(feature = "gpu")]
mod lbfgs_device;
mod lbfgs_host;
mod lbfgs_memory;
mod load;
mod load_stepping;
mod mass;
mod method;
mod motion;
mod pair_products;
mod particle_map;
mod passes;
mod preconditioner;
mod pressure;
mod record;
#[cfg(feature = "gpu")]
mod relaxation_device;
mod rigid;
mod rotating_loads;
mod rotation;
mod sliding;
mod snap_back;
mod stage;
mod state;
mod step_control;
mod step_cuts;
mod stiffness_control;
mod system;
mod time_program;
mod time_step;
mod tractions;
mod turned_sites;
mod unsupported;
mod verlet;
#[cfg(feature = "gpu")]
mod verlet_device;
mod verlet_friction;
mod verlet_step;

pub use crate::amplitude::Amplitude;
pub use criterion::{Bilinear, Breaking, Criterion, Policy};
pub use curves::{CurvedLoads, CurvedRegion};
pub use dynamic_relaxation::{DynamicRelaxation, RelaxationSolver};
pub use force_fields::{Centrifugal, ForceField, PlacedForce};
pub use force_scale::Balance;
pub use fracture::{BreakingEvent, Fracture};
pub use inverted::{INVERTS, flattened, inverted};
pub use lbfgs::{Lbfgs, LbfgsSearch, LbfgsSolver, LinePoint, SearchVectors};
#[cfg(feature = "gpu")]
pub use lbfgs_device::CardVectors;
pub use lbfgs_host::HostVectors;
pub use load::{Loads, Support};
pub use load_stepping::{Equilibrium, QuasiStatic, load_stepping};
pub use method::{Method, StepCallback, Watch};
pub use motion::{DynamicEnergies, EqualSteps, Motion, StepLimits};
pub use pressure::{FollowingPressure, ThicknessStretch};
pub use record::{Status, StepRecord};
#[cfg(feature = "gpu")]
pub use relaxation_device::CardRelaxation;
pub use rigid::RigidRegion;
pub use rotation::{RotatingRegion, Rotation, TurnStart};
pub use sliding::SlidingBonds;
pub use stage::{StageEnd, StepOrigin};
pub use state::{BodyStretches, Counts, ForceResiduals, State};
pub use step_control::StepControl;
pub use system::{LoadCurve, StateObserver, System};
pub use turned_sites::TurnedSites;
pub use unsupported::{ContactStops, Unsupported, find_unsupported};
pub use verlet::{VelocityVerlet, ramped};
