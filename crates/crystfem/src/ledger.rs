//! Energy balance, Eq. (4.14): stored = in − out, for each step and since the start.

pub use crate::system::Exchange;

/// Shift of temperature, K, that sets the smallest reference of a relative balance: a step that moves less
/// heat than a uniform shift by this is measured against the latter. Temperatures of 500 K are known to 6e-14
/// K only.
pub const REFERENCE_SHIFT: f64 = 1e-2;

/// Energies since the start, J. Heat into the body is positive.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Ledger {
    /// Change of the energy of existing elements.
    pub stored: f64,
    /// Heat through surfaces and from sources.
    pub exchange: Exchange,
    /// Heat supplied by prescribed temperatures.
    pub reaction: f64,
    /// Energy brought in by births, from the reference of the material's energy.
    pub birth: f64,
    /// Sum of the magnitudes of the imbalances of steps and births.
    pub missing: f64,
    /// Largest relative imbalance of a step or a birth, see [`StepBalance::relative`].
    pub worst: f64,
}

/// Energy balance of an accepted step, J.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct StepBalance {
    /// Time at the end, s.
    pub time: f64,
    /// Length, s.
    pub dt: f64,
    /// Change of the energy of existing elements.
    pub stored: f64,
    /// Σ|ΔE_i| over the nodes, which includes heat moved within the body.
    pub moved: f64,
    /// Change of the balance per uniform shift of the free temperatures, J/K: capacity, and the exchange over
    /// the step through surfaces and with prescribed nodes.
    pub sensitivity: f64,
    /// Heat through surfaces and from sources.
    pub exchange: Exchange,
    /// Heat supplied by prescribed temperatures.
    pub reaction: f64,
    /// Sum of the magnitudes of this heat over nodes.
    pub held: f64,
    /// Largest temporal error of a node, K; `None` for fixed steps.
    pub error: Option<f64>,
    /// Smallest ratio of next to present step requested by a material.
    pub step_ratio: Option<f64>,
}

impl StepBalance {
    /// Imbalance stored − in + out, J.
    pub fn missing(&self) -> f64 {
        self.stored - self.exchange.total() - self.reaction
    }

    /// Relative imbalance: |[`Self::missing`]| over all heat moved, stored and exchanged, or over that of a
    /// shift by [`REFERENCE_SHIFT`], 10 mK, if larger.
    pub fn relative(&self) -> f64 {
        let scale = (self.moved + self.exchange.gross() + self.held).max(REFERENCE_SHIFT * self.sensitivity);
        if scale > 0.0 { self.missing().abs() / scale } else { 0.0 }
    }
}

impl Ledger {
    /// Adds a step.
    pub fn add(&mut self, step: &StepBalance) {
        self.stored += step.stored;
        self.exchange.add(1.0, &step.exchange);
        self.reaction += step.reaction;
        self.missing += step.missing().abs();
        self.worst = self.worst.max(step.relative());
    }

    /// Adds a birth: stored = brought + reaction.
    pub fn add_birth(&mut self, stored: f64, brought: f64, reaction: f64) {
        self.stored += stored;
        self.birth += brought;
        self.reaction += reaction;
        let missing = (stored - brought - reaction).abs();
        self.missing += missing;
        let scale = stored.abs() + brought.abs() + reaction.abs();
        if scale > 0.0 {
            self.worst = self.worst.max(missing / scale);
        }
    }
}
