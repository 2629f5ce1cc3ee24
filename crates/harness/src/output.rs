//! Files of a run: CSV curves, pictures, VTKHDF fields.

pub mod csv;
pub mod picture;
pub mod vtkhdf;
