//! When bonds break.

use crate::bonds::Property;
use serde::Deserialize;

/// When bonds break: in tension only, for good.
#[derive(Clone, Debug, PartialEq)]
pub struct Breaking {
    /// What a bond bears.
    pub criterion: Criterion,
    /// When bonds are looked at.
    pub policy: Policy,
}

/// What a bond bears.
#[derive(Clone, Debug, PartialEq)]
pub enum Criterion {
    /// Critical bond stretch λ_c of the particles; a bond breaks at that of the weaker of its ends.
    Stretch(Property),
    /// Energy that breaking a bond releases, over its share of the family, J/m³: the mean of both ends. For materials with
    /// [`crate::material::Material::released_energy`]. Bonds of constrained particles do not break by it: grips do not tear.
    Energy(f64),
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
    /// No bond breaks below this stretch.
    pub fn least_stretch(&self) -> f64 {
        match self {
            Self::Stretch(stretch) => stretch.least(),
            Self::Energy(_) => 1.0,
        }
    }

    /// Every bond breaks beyond this stretch.
    pub fn greatest_stretch(&self) -> f64 {
        match self {
            Self::Stretch(stretch) => stretch.greatest(),
            Self::Energy(_) => f64::INFINITY,
        }
    }
}

/// When stretches are compared with the critical one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Policy {
    /// In equilibrium: all overstretched bonds break at once, and a new equilibrium is sought until none is left.
    /// Independent of the method.
    #[default]
    AtEquilibrium,
    /// In every iteration of dynamic relaxation, on its way to equilibrium: cheaper, and breaks bonds that an overshoot
    /// stretches.
    EachIteration,
}

/// Stretches below this are not fitted …
const SMALLEST_STRETCH: f64 = 1e-3;
/// … nor below this where bonds break: beside a crack without contact bonds are crushed to nothing.
const CRUSHED: f64 = 0.1;

/// The smallest stretch that is fitted.
pub(super) fn least(breaking: Option<&Breaking>) -> f64 {
    if breaking.is_some() { CRUSHED } else { SMALLEST_STRETCH }
}

/// The largest stretch that is fitted: bonds beyond it are about to break, however long they are.
pub(super) fn most(breaking: Option<&Breaking>) -> f64 {
    let most = |stretch: f64| 1.25 * stretch - 0.25;
    breaking.map_or(f64::INFINITY, |b| most(b.criterion.greatest_stretch()))
}
