//! Memory: what the machine has left, and how an amount is told.
//!
//! A program states what a scene needs before it takes it: `check` and `--explain` print a line of [`needs`], and a scene
//! that needs more than [`available`] is refused.

/// Bytes of a GiB.
pub const GIB: f64 = (1_u64 << 30) as f64;

/// Bytes that a new program may take: `MemAvailable` of Linux, or 16 GiB where it is not told.
pub fn available() -> f64 {
    let told = std::fs::read_to_string("/proc/meminfo").ok().and_then(|text| {
        let line = text.lines().find(|line| line.starts_with("MemAvailable:"))?.to_owned();
        line.split_whitespace().nth(1)?.parse::<f64>().ok()
    });
    told.map_or(16.0 * GIB, |kib| kib * 1024.0)
}

/// The line that states an estimate in bytes: `at most about 120 MB of memory`.
pub fn needs(bytes: f64) -> String {
    format!("at most about {:.0} MB of memory", bytes / 1e6)
}

/// An amount in a message: `1.5 GiB`.
pub fn gib(bytes: f64) -> String {
    format!("{:.1} GiB", bytes / GIB)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amounts_as_they_are_told() {
        assert_eq!(needs(1.2e8), "at most about 120 MB of memory");
        assert_eq!(gib(1.5 * GIB), "1.5 GiB");
        assert!(available() > 1e6 && available().is_finite());
    }
}
