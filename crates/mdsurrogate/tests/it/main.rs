//! Tests of the public interface against the figures of the data's PROVENANCE.md and of `formulation.md`, chapter 3.

mod data;
mod md;
mod memory;
mod scenes;
