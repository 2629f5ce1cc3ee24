//! Project tasks: validate, bench, test.
fn main() {}
