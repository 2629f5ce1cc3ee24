//! Files of a run: CSV curves, pictures, VTKHDF fields.

pub mod csv;
pub(crate) mod lattice;
pub mod picture;
pub mod vtkhdf;
