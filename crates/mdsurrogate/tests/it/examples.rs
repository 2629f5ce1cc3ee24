//! Example programs: each runs to its end.

#[path = "../../examples/train.rs"]
mod train;

evidence::run_examples!(train; except predict);
