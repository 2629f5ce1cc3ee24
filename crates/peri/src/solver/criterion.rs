//! Criteria for breaking bonds.

use crate::bonds::Property;
use serde::Deserialize;

/// Criterion and time of breaking: in tension only, and irreversible.
#[derive(Clone, Debug, PartialEq)]
pub struct Breaking {
    /// Limit of a bond.
    pub criterion: Criterion,
    /// Time of the checks.
    pub policy: Policy,
}

/// Limit of a bond.
#[derive(Clone, Debug, PartialEq)]
pub enum Criterion {
    /// Critical bond stretch λ_c of the particles; a bond breaks at its own, else that of the weaker of its
    /// ends.
    Stretch(Property),
    /// Energy that breaking a bond releases, over its share of the family, J/m³: the mean of both ends; its
    /// limits as those of stretches. For materials with
    /// [`crate::material::Material::released_energy`]. Bonds of constrained particles do not break: grips do
    /// not tear.
    Energy(Property),
    /// The same for bonds with a strength: they soften before they break, by the [`Bilinear`] law of these.
    Softening {
        /// Y₀, at which bonds begin to soften, J/m³.
        onset: Property,
        /// Y_c, J/m³.
        limit: Property,
    },
}

/// Softening of a bond, with energies over its share of the family, J/m³: with the greatest energy κ that its
/// breaking would have released, e = √(κ/Y₀) and e_f = Y_c/Y₀ its integrity is d = 1 up to e = 1, (e_f −
/// e)/[e(e_f − 1)] up to e_f, then 0: force over stretch is bilinear, and ∫Y(−dd) = Y_c. Cf. Camanho &
/// Dávila, NASA/TM-2002-211737.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bilinear {
    /// Y₀, at which bonds begin to soften.
    pub onset: f64,
    /// Y_c ≥ Y₀, the total energy of breaking.
    pub limit: f64,
}

impl Bilinear {
    /// e_f = Y_c/Y₀.
    pub fn ductility(&self) -> f64 {
        self.limit / self.onset
    }

    /// Integrity d of a bond that would have released κ = `greatest`.
    pub fn integrity(&self, greatest: f64) -> f64 {
        let (e, last) = ((greatest / self.onset).sqrt(), self.ductility());
        if e <= 1.0 {
            1.0
        } else if e < last {
            (last - e) / (e * (last - 1.0))
        } else {
            0.0
        }
    }
}

impl From<Bilinear> for Criterion {
    fn from(law: Bilinear) -> Self {
        Self::Softening { onset: law.onset.into(), limit: law.limit.into() }
    }
}

impl From<Property> for Criterion {
    fn from(stretch: Property) -> Self {
        Self::Stretch(stretch)
    }
}

impl From<f64> for Criterion {
    fn from(stretch: f64) -> Self {
        Self::Stretch(stretch.into())
    }
}

impl Criterion {
    /// Least limit of any bond: a stretch, or an energy, J/m³.
    pub fn least(&self) -> f64 {
        match self {
            Self::Stretch(limit) | Self::Energy(limit) | Self::Softening { limit, .. } => limit.least(),
        }
    }

    /// Least energy at which any bond begins to soften, J/m³; without softening the least limit.
    pub fn onset(&self) -> f64 {
        match self {
            Self::Softening { onset, .. } => onset.least(),
            _ => self.least(),
        }
    }

    /// Stretch below which no bond breaks.
    pub fn least_stretch(&self) -> f64 {
        match self {
            Self::Stretch(stretch) => stretch.least(),
            Self::Energy(_) | Self::Softening { .. } => 1.0,
        }
    }

    /// Stretch beyond which every bond breaks.
    pub fn greatest_stretch(&self) -> f64 {
        match self {
            Self::Stretch(stretch) => stretch.greatest(),
            Self::Energy(_) | Self::Softening { .. } => f64::INFINITY,
        }
    }

    /// Largest stretch at which a law is evaluated: bonds beyond it are about to break, at any length.
    pub fn most(&self) -> f64 {
        1.25 * self.greatest_stretch() - 0.25
    }
}

/// Time at which stretches are compared with the critical one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Policy {
    /// Checks in equilibrium: all overstretched bonds break at once, and a new equilibrium is sought until
    /// none is left. Independent of the method.
    #[default]
    AtEquilibrium,
    /// Checks in every iteration of dynamic relaxation: cheaper, but breaks bonds that an overshoot
    /// stretches.
    EachIteration,
}

/// Stretches below this are not fitted …
const SMALLEST_STRETCH: f64 = 1e-3;
/// … nor below this if bonds break: beside a crack without contact bonds are crushed to zero.
const CRUSHED_STRETCH: f64 = 0.1;

/// Smallest fitted stretch.
pub(super) fn least(breaking: Option<&Breaking>) -> f64 {
    if breaking.is_some() { CRUSHED_STRETCH } else { SMALLEST_STRETCH }
}

/// Largest fitted stretch.
pub(super) fn most(breaking: Option<&Breaking>) -> f64 {
    breaking.map_or(f64::INFINITY, |b| b.criterion.most())
}
