//! Types of most programs: `use peri::prelude::*;`.

pub use crate::Error;
pub use crate::calibrate::Space;
pub use crate::contact::RigidSurface;
pub use crate::geometry::{Cut, Shape};
pub use crate::material::{Correspondence, EightChainSolid, Material, NonlocalSolid};
pub use crate::model::{Body, CompositeRubber, Model, Rubber, Simulation};
pub use crate::potential::Law;
pub use crate::solver::{DynamicRelaxation, Lbfgs, Method, Rotation, Support, VelocityVerlet};
pub use crate::stress::StressMethod;
