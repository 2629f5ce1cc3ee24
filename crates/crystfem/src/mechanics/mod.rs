//! Stress of printed parts: a solidifying Maxwell body at small strains, whose free strain is a function of
//! temperature and degree of crystallization. The guide's page *Stress of prints* has the model; here it is
//! at a material point.

mod body;
mod branch;
mod coarse;
mod eigenstrain;
mod element;
mod kind;
mod maxwell;
mod product;
mod solve;
mod tetrahedron;

pub use body::{Body, BodyState, EnergyBalance, Support};
pub use branch::{Change, Energies, Step};
pub use eigenstrain::SpecificVolume;
pub use element::{Hexahedron, POINTS, stiffness};
pub use kind::{Element, MOST, is_known, key, points, shares};
pub use maxwell::{Branch, Shift, SolidifyingMaxwell};
