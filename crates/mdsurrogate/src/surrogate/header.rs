//! What a law is, without its weights.

use super::Symmetry;
use crate::Error;
use crate::kinematics::NAMES;
use crate::network::{Activation, Architecture};
use serde::{Deserialize, Serialize};

/// What the networks of a law compute.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum Kind {
    /// C → S (3.9).
    Ann,
    /// Invariants of C → W.
    Energy {
        /// What W is invariant under.
        symmetry: Symmetry,
        /// Material axes as rows, orthonormal and right-handed.
        axes: [[f64; 3]; 3],
    },
}

impl Kind {
    /// An energy in the axes of the data.
    pub fn energy(symmetry: Symmetry) -> Self {
        Self::Energy { symmetry, axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] }
    }

    /// Inputs of its networks: 6, or the number of invariants.
    pub fn inputs(&self) -> usize {
        match self {
            Self::Ann => 6,
            Self::Energy { symmetry, .. } => symmetry.invariants().len(),
        }
    }

    /// Outputs of its networks: 6 or 1.
    pub fn outputs(&self) -> usize {
        match self {
            Self::Ann => 6,
            Self::Energy { .. } => 1,
        }
    }
}

/// Everything about a law but its weights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// What the networks compute.
    pub kind: Kind,
    /// Their widths and activations.
    pub architecture: Architecture,
    /// Networks in the ensemble.
    pub members: usize,
    /// Mean of each input (3.8).
    pub input_mean: Vec<f64>,
    /// Standard deviation of each input (3.8); 0: the input had no variance and is mapped to 0.
    pub input_deviation: Vec<f64>,
    /// Added to the outputs after scaling, Pa; of an energy it has no effect.
    pub output_mean: Vec<f64>,
    /// One unit of each output, Pa (J/m³).
    pub output_deviation: Vec<f64>,
    /// Least and greatest C of each component in the training data; equal where a component was never seen to change.
    pub training_box: [[f64; 2]; 6],
    /// Spread of the ensemble, Pa, beyond which an answer is flagged.
    pub spread_limit: Option<f64>,
    /// Where data and weights come from.
    #[serde(default)]
    pub provenance: Vec<String>,
}

impl Header {
    /// A law with inputs as they are, outputs in MPa (or MJ/m³), and a box of nothing but C = I.
    pub fn new(kind: Kind, hidden: &[(usize, Activation)], members: usize) -> Self {
        let (inputs, outputs) = (kind.inputs(), kind.outputs());
        Self {
            architecture: Architecture::new(inputs, hidden, outputs),
            kind,
            members,
            input_mean: vec![0.0; inputs],
            input_deviation: vec![1.0; inputs],
            output_mean: vec![0.0; outputs],
            output_deviation: vec![1e6; outputs],
            training_box: [1.0, 1.0, 1.0, 0.0, 0.0, 0.0].map(|c| [c, c]),
            spread_limit: None,
            provenance: Vec::new(),
        }
    }

    /// # Errors
    /// [`Error::Parameter`] for parts that do not fit together or numbers that are not finite.
    pub fn check(&self) -> Result<(), Error> {
        self.architecture.check()?;
        let widths = &self.architecture.widths;
        let (inputs, outputs) = (self.kind.inputs(), self.kind.outputs());
        if widths.first() != Some(&inputs) || widths.last() != Some(&outputs) {
            let allowed = format!("{inputs} inputs and {outputs} outputs for {:?}", self.kind);
            return Err(Error::parameter("network", format!("widths {widths:?}"), allowed));
        }
        if !(1..=1000).contains(&self.members) {
            return Err(Error::parameter("members", self.members, "1 to 1000"));
        }
        for (name, list, length, least) in [
            ("input_mean", &self.input_mean, inputs, f64::NEG_INFINITY),
            ("input_deviation", &self.input_deviation, inputs, 0.0),
            ("output_mean", &self.output_mean, outputs, f64::NEG_INFINITY),
            ("output_deviation", &self.output_deviation, outputs, 0.0),
        ] {
            if list.len() != length || list.iter().any(|value| !value.is_finite() || *value < least) {
                let allowed = format!("{length} finite numbers, deviations not negative");
                return Err(Error::parameter(name, format!("{list:?}"), allowed));
            }
        }
        for (name, [low, high]) in NAMES.iter().zip(self.training_box) {
            if !(low.is_finite() && high.is_finite() && low <= high) {
                let found = format!("C{name} in [{low}, {high}]");
                return Err(Error::parameter("training box", found, "finite, ascending bounds"));
            }
        }
        match self.spread_limit {
            Some(limit) if !(limit.is_finite() && limit > 0.0) => {
                Err(Error::parameter("spread limit", limit, "a positive number of pascal"))
            }
            _ => Ok(()),
        }
    }
}
