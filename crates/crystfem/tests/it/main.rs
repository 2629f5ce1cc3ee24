//! Tests of the public interface.

mod births;
mod bodies;
mod brick;
mod examples;
mod extremes;
mod fields;
mod followers;
#[cfg(feature = "case")]
mod geometry;
mod order;
mod patch;
#[cfg(feature = "case")]
mod point;
#[cfg(feature = "case")]
mod printed;
mod readers;
mod revolved;
mod same_bits;
mod schedules;
mod solvers;
mod stresses;
mod tetrahedra;
mod verification;
