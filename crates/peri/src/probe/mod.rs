//! Quantities of a body in a state: forces across sections, J-integrals and crack tips, motion of parts,
//! fields along lines, and quantities of their histories.

mod crack;
mod evaluator;
mod line;
mod motion;
mod path;
mod section;

pub use crack::{CrackTip, JIntegral};
pub use evaluator::{AnySolid, StressEvaluator};
pub use line::LineSampler;
pub use motion::{WaveFront, mark_distances, mean_displacement, rotation};
pub use path::{
    crossing, driven_loop_energy, envelope, first_swing, load_at, loop_energy, resistance, stiffness_at,
    unwrapped,
};
pub use section::Section;
