//! The `polycore` command line.
fn main() {}
