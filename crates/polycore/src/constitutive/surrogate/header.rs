//! Metadata of a learnt law.

use super::invariants::SymmetryInvariants;
use super::{Softening, Support, Symmetry};
use crate::constitutive::Error;
use crate::constitutive::network::{Activation, Architecture};
use crate::tensor::voigt::NAMES;
use serde::{Deserialize, Serialize};

/// Axes of the data.
const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Convex functions that never decrease.
const CONVEX: [Activation; 4] = [Activation::Linear, Activation::Relu, Activation::Softplus, Activation::Elu];

/// Function that the networks compute.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum Kind {
    /// C → S (3.9).
    Ann,
    /// Invariants of C → W.
    Energy {
        /// Symmetry of W.
        symmetry: Symmetry,
        /// Material axes as rows, orthonormal and right-handed.
        axes: [[f64; 3]; 3],
        /// True if W is polyconvex by construction: see [`Kind::non_negative`].
        #[serde(default)]
        polyconvex: bool,
        /// True if ‖F‖ = √I₁ and ‖cof F‖ = √I₂ replace their squares as inputs of a polyconvex isotropic
        /// energy: it is convex in F and cof F too, and may grow as slowly as the first power of a stretch.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        norms: bool,
    },
}

impl Kind {
    /// Creates an energy in the axes of the data.
    pub fn energy(symmetry: Symmetry) -> Self {
        Self::Energy { symmetry, axes: AXES, polyconvex: false, norms: false }
    }

    /// A polyconvex energy in the axes of the data: convex in (F, cof F, J), and so elliptic everywhere; it
    /// cannot follow data that soften (Ball 1976, <https://doi.org/10.1007/BF00279992>).
    pub fn polyconvex_energy(symmetry: Symmetry) -> Self {
        Self::Energy { symmetry, axes: AXES, polyconvex: true, norms: false }
    }

    /// A polyconvex isotropic energy of ‖F‖, ‖cof F‖ and J.
    pub fn energy_of_norms() -> Self {
        Self::Energy { symmetry: Symmetry::Isotropic, axes: AXES, polyconvex: true, norms: true }
    }

    /// Returns true for a polyconvex energy.
    pub fn is_polyconvex(&self) -> bool {
        matches!(self, Self::Energy { polyconvex: true, .. })
    }

    /// Returns true if the weight of `layer` (0 follows the inputs) for its input `input` must not be
    /// negative, so that a polyconvex energy is convex and increasing in all its inputs but J, the last one,
    /// whose weight may have any sign.
    ///
    /// With convex increasing activations (`softplus`, `relu`, `elu`, `linear`) a network of such weights is
    /// input-convex (Amos et al. 2017, <https://arxiv.org/abs/1609.07152>).
    pub fn non_negative(&self, layer: usize, input: usize) -> bool {
        self.is_polyconvex() && (layer > 0 || input + 1 < self.inputs())
    }

    /// The invariants of an energy.
    pub fn invariants(&self) -> Option<SymmetryInvariants> {
        match self {
            Self::Ann => None,
            Self::Energy { symmetry, polyconvex, norms, .. } => {
                Some(SymmetryInvariants::new(*symmetry, *polyconvex, *norms))
            }
        }
    }

    /// Inputs of its networks: 6, or the number of invariants.
    pub fn inputs(&self) -> usize {
        self.invariants().map_or(6, SymmetryInvariants::count)
    }

    /// Outputs of its networks: 6 or 1.
    pub fn outputs(&self) -> usize {
        match self {
            Self::Ann => 6,
            Self::Energy { .. } => 1,
        }
    }
}

/// Metadata of a law: everything but its weights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// Function of the networks.
    pub kind: Kind,
    /// Widths and activations of the networks.
    pub architecture: Architecture,
    /// Networks in the ensemble.
    pub members: usize,
    /// Mean of each input (3.8).
    pub input_mean: Vec<f64>,
    /// Standard deviation of each input (3.8); 0: the input had no variance and is mapped to 0.
    pub input_deviation: Vec<f64>,
    /// Added to the outputs after scaling, Pa; without effect on an energy.
    pub output_mean: Vec<f64>,
    /// Unit of each output, Pa (J/m³).
    pub output_deviation: Vec<f64>,
    /// Least and greatest value of each component of C in the training data; equal for a component that never
    /// changed.
    pub training_box: [[f64; 2]; 6],
    /// Representatives of the training strains: a prediction is flagged if it is farther from them than any
    /// training row.
    #[serde(default)]
    pub support: Option<Support>,
    /// Spread of the ensemble, Pa, beyond which a prediction is flagged
    /// ([`super::Surrogate::with_spread_limit`]).
    pub spread_limit: Option<f64>,
    /// Softening of an energy on unloading.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub softening: Option<Softening>,
    /// Sources of data and weights.
    #[serde(default)]
    pub provenance: Vec<String>,
}

impl Header {
    /// Creates the header of a law with unscaled inputs, outputs in MPa (or MJ/m³), and a box that contains C
    /// = I alone.
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
            support: None,
            spread_limit: None,
            softening: None,
            provenance: Vec::new(),
        }
    }

    /// Checks that the parts fit together.
    ///
    /// # Errors
    /// [`Error::Invalid`] for parts that do not fit together or numbers that are not finite.
    pub fn check(&self) -> Result<(), Error> {
        if let Kind::Energy { symmetry, polyconvex, norms: true, .. } = self.kind
            && !(polyconvex && symmetry == Symmetry::Isotropic)
        {
            let found = format!("norms of a symmetry {symmetry:?}, polyconvex: {polyconvex}").to_lowercase();
            return Err(Error::invalid("norms", found, "a polyconvex isotropic energy"));
        }
        if let Kind::Energy { symmetry, polyconvex: true, .. } = self.kind {
            if symmetry.polyconvex_invariants().is_none() {
                let allowed = "orthotropic, transverse or isotropic for a polyconvex energy";
                return Err(Error::invalid("symmetry", format!("{symmetry:?}"), allowed));
            }
            if let Some(other) = self.architecture.activations.iter().find(|a| !CONVEX.contains(a)) {
                let allowed = format!("{CONVEX:?} in a polyconvex energy");
                return Err(Error::invalid("activation", format!("{other:?}"), allowed));
            }
        }
        self.architecture.check()?;
        let widths = &self.architecture.widths;
        let (inputs, outputs) = (self.kind.inputs(), self.kind.outputs());
        if widths.first() != Some(&inputs) || widths.last() != Some(&outputs) {
            let allowed = format!("{inputs} inputs and {outputs} outputs for {:?}", self.kind);
            return Err(Error::invalid("network", format!("widths {widths:?}"), allowed));
        }
        if !(1..=1000).contains(&self.members) {
            return Err(Error::invalid("members", self.members, "1 to 1000"));
        }
        for (name, list, length, least) in [
            ("input_mean", &self.input_mean, inputs, f64::NEG_INFINITY),
            ("input_deviation", &self.input_deviation, inputs, 0.0),
            ("output_mean", &self.output_mean, outputs, f64::NEG_INFINITY),
            ("output_deviation", &self.output_deviation, outputs, 0.0),
        ] {
            if list.len() != length || list.iter().any(|value| !value.is_finite() || *value < least) {
                let allowed = format!("{length} finite numbers, deviations not negative");
                return Err(Error::invalid(name, format!("{list:?}"), allowed));
            }
        }
        for (name, [low, high]) in NAMES.iter().zip(self.training_box) {
            if !(low.is_finite() && high.is_finite() && low <= high) {
                let found = format!("C{name} in [{low}, {high}]");
                return Err(Error::invalid("training box", found, "finite, ascending bounds"));
            }
        }
        if let Some(support) = &self.support {
            support.check()?;
        }
        if let Some(softening) = &self.softening {
            softening.check()?;
            if self.kind == Kind::Ann {
                return Err(Error::invalid("softening", "a law of the kind `ann`", "an energy"));
            }
        }
        match self.spread_limit {
            Some(limit) if !(limit.is_finite() && limit > 0.0) => {
                Err(Error::invalid("spread limit", limit, "a positive number of pascal"))
            }
            _ => Ok(()),
        }
    }
}
