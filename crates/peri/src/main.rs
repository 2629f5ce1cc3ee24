//! The `peri` command line.
fn main() {}
