//! Files of results: tables as CSV ([`csv`]), pictures of curves, fields and bodies as PNG ([`picture`]),
//! fields over time as VTKHDF ([`vtkhdf`]). [`lattice`] joins the particles of a lattice to cells.

pub mod csv;
pub mod lattice;
pub mod picture;
pub mod vtkhdf;
