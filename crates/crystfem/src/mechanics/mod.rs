//! Stress of printed parts: a solidifying Maxwell body at small strains, with a free strain that is a
//! function of temperature and degree of crystallization. The guide's page *Stress of prints* describes the
//! model.

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
