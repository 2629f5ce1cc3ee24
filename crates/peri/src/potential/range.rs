//! Ranges of bond stretches.

/// Stretches observed, as the extremes of e = λ² − 1.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct StretchRange {
    /// Smallest e.
    pub low: f64,
    /// Largest e.
    pub high: f64,
}

impl StretchRange {
    /// The undeformed state.
    pub const REST: Self = Self { low: 0.0, high: 0.0 };

    /// The union of both.
    pub fn join(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }
}
