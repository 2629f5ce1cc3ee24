//! Observers of a run: each defines its scalars, fields and files, and computes them from a state.

mod animation;
mod contact;
mod cracks;
mod exact;
mod expect;
mod flags;
mod frames;
mod history;
mod lines;
mod list;
mod maps;
mod material;
mod moment;
mod probes;
mod resistance;
mod rows;
mod scale;
mod sections;
mod solid;
mod stage;
mod stages;
mod tractions;
mod values;

pub use animation::animate;
pub use expect::{check, quantities_of};
pub use frames::FieldFrames;
pub(crate) use frames::in_space;
pub use history::{damped_energy, has_times};
pub use list::{observers, quantities};
pub use material::{BodyWithMaterial, Physics, SceneMaterial};
pub use moment::{Moment, SceneObservers};
pub use rows::columns;
pub use scale::{short, stress_unit};
