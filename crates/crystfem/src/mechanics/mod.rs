//! Stress of printed parts: a solidifying Maxwell body at small strains, with a free strain that is a
//! function of temperature and degree of crystallization. The guide's page *Stress of prints* describes the
//! model.

mod body;
mod branch;
mod coarse;
mod eigenstrain;
mod element;
mod element_kind;
mod flow;
mod maxwell;
mod phase;
mod product;
mod solve;
mod step;
mod tetrahedron;

pub use body::{Body, BodyState, EnergyBalance, FixedComponent, Roller};
pub use branch::{BranchEnergies, BranchInput, BranchStep};
pub use eigenstrain::SpecificVolume;
pub use element::{GAUSS_POINTS, Hexahedron, stiffness};
pub use element_kind::{MAX_NODES_PER_ELEMENT, MechanicalElement, is_supported, key, points, shares};
pub use maxwell::{MaxwellIncrement, SolidifyingMaxwell};
pub use phase::{Branch, EyringFlow, Phase};
pub use polycore::constitutive::viscoelastic::Shift;
