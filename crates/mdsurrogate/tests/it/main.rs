//! Tests of the public interface against PROVENANCE.md of the data and `formulation.md`, chapter 3.

mod data;
mod examples;
mod md;
mod memory;
mod scenes;
