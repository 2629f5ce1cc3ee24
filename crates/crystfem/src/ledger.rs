//! The balance of energy, Eq. (4.14): stored = in − out, for each step and since the start.

pub use crate::system::Exchange;

/// Shift of temperature, K. A step that moves less heat than by which its balance would change if all
/// temperatures shifted by this has its balance measured against that: temperatures of 500 K are known to
/// 6e-14 K only.
pub const NOTHING: f64 = 1e-2;

/// Energy since the start, J. Heat into the body counts positive.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Ledger {
    /// Change of the energy of what exists.
    pub stored: f64,
    /// Heat through surfaces and from sources.
    pub exchange: Exchange,
    /// Heat that holds prescribed temperatures.
    pub reaction: f64,
    /// Energy that births brought in, from the reference of the material's energy.
    pub birth: f64,
    /// Sum of the magnitudes of what is missing in the balances of steps and births.
    pub missing: f64,
    /// The largest share that is missing of a step or a birth, see [`Record::relative`].
    pub worst: f64,
}

/// One accepted step, and its balance of energy in J.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Record {
    /// Time at its end, s.
    pub time: f64,
    /// Its length, s.
    pub dt: f64,
    /// Change of the energy of what exists.
    pub stored: f64,
    /// Σ|ΔE_i| over the nodes: heat moved within the body counts, too.
    pub moved: f64,
    /// Change of the balance with a uniform shift of the free temperatures, J/K: capacity, and over the step
    /// what goes through surfaces and to prescribed nodes.
    pub sensitivity: f64,
    /// Heat through surfaces and from sources.
    pub exchange: Exchange,
    /// Heat that holds prescribed temperatures.
    pub reaction: f64,
    /// The same with the magnitude of each node's: what goes in at one end and out at the other counts.
    pub held: f64,
    /// Largest temporal error of a node, K, where steps are adaptive.
    pub error: Option<f64>,
    /// The smallest wish of a material for the next step over this one.
    pub step_ratio: Option<f64>,
}

impl Record {
    /// stored − in + out, J.
    pub fn missing(&self) -> f64 {
        self.stored - self.exchange.total() - self.reaction
    }

    /// |[`Self::missing`]| over all heat moved, stored and exchanged, or over that of [`NOTHING`], 10 mK, where
    /// that is more.
    pub fn relative(&self) -> f64 {
        let scale = (self.moved + self.exchange.gross() + self.held).max(NOTHING * self.sensitivity);
        if scale > 0.0 { self.missing().abs() / scale } else { 0.0 }
    }
}

impl Ledger {
    /// Adds a step.
    pub fn add(&mut self, step: &Record) {
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
