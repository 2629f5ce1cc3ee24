//! Rows of benches: printed by `benches/measure.rs` of a crate, read by `cargo xtask bench`.

use serde::{Deserialize, Serialize};

/// Measured number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measurement {
    /// Quantity that was measured.
    pub what: String,
    /// Size of the problem: particles, equations, steps, points.
    pub size: u64,
    /// Threads used.
    pub threads: usize,
    /// Value; `None` if there is none.
    pub value: Option<f64>,
    /// Unit, empty for a ratio.
    pub unit: String,
}

impl Measurement {
    /// Creates a row with a value.
    pub fn new(what: impl Into<String>, size: usize, threads: usize, value: f64, unit: &str) -> Self {
        Self { what: what.into(), size: size as u64, threads, value: Some(value), unit: unit.to_owned() }
    }
}

/// Prints rows as text or, for `cargo xtask bench`, as JSON.
pub fn print(rows: &[Measurement], json: bool) {
    if json {
        println!("{}", serde_json::to_string_pretty(rows).unwrap_or_default());
        return;
    }
    for Measurement { what, size, threads, value, unit } in rows {
        println!("{what:<44} {size:>9} {threads:>2} threads {:>12.4e} {unit}", value.unwrap_or(f64::NAN));
    }
}
