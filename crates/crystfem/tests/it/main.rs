//! Tests of the public interface.

mod bodies;
mod brick;
mod readers;
