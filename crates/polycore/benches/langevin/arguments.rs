//! Arguments of the benchmark of inverse Langevin functions, shared with `cargo xtask bench langevin`.

/// A row that stays in the first-level cache.
pub const ROW: usize = 1024;

/// Uniform in (0, 1) and shuffled, so that no branch can be foreseen.
pub fn arguments() -> Vec<f64> {
    // multiples of the golden section modulo 1: equidistributed, in no order
    const GOLDEN: f64 = 0.618_033_988_749_894_8;
    (1..=ROW).map(|k| (GOLDEN * k as f64).fract()).collect()
}
