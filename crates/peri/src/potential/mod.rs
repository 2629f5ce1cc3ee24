//! Bond laws: tension t and energy φ of a bond of stretch l = |ζ|/|ξ|, in units of kθ.

mod chain;
mod energy;
mod fit;
mod laws;
mod range;
mod ratio;
mod softened;
#[cfg(test)]
mod tests;

pub use chain::{Chain, ChainPoint};
pub use energy::{EnergyTable, TangentTable};
pub use fit::KernelFit;
pub use laws::{BondStretch, LinearBond, NetworkStretch, PublishedChain, Scaled, Shifted};
pub use range::StretchRange;
pub use softened::BondSoftening;

use crate::error::Error;
use serde::Deserialize;

/// A law of bond stretches. Laws are sampled when a kernel is fitted, never in a hot loop.
///
/// Stretches are ≥ 0; at 0 and ∞ laws have their limits, NaN gives NaN.
pub trait BondPotential: Send + Sync {
    /// Force density t/kθ, Eq. (2.47) with the reference state of the law.
    fn tension(&self, stretch: f64) -> f64;
    /// t/kθ at the strain s = l − 1 ≥ −1: keeps the digits of small strains.
    fn tension_at_strain(&self, strain: f64) -> f64 {
        self.tension(1.0 + strain)
    }
    /// dt/dl/kθ.
    fn tension_derivative(&self, stretch: f64) -> f64;
    /// Energy φ/kθ per unit reference length of the bond, Eq. (2.39); zero at l = 1.
    fn energy(&self, stretch: f64) -> f64;
    /// Returns true if t(1) = 0.
    fn is_stress_free(&self) -> bool {
        true
    }
    /// Small-strain tangent K = t′(1); the calibration of kθ assumes K = 3.
    fn tangent(&self) -> f64 {
        self.tension_derivative(1.0)
    }
}

/// Implements the law for references, boxes and [`Arc`](std::sync::Arc).
macro_rules! pointers_are_laws {
    ($($pointer:ty),*) => {$(
        impl<L: BondPotential + ?Sized> BondPotential for $pointer {
            fn tension(&self, stretch: f64) -> f64 {
                (**self).tension(stretch)
            }
            fn tension_at_strain(&self, strain: f64) -> f64 {
                (**self).tension_at_strain(strain)
            }
            fn tension_derivative(&self, stretch: f64) -> f64 {
                (**self).tension_derivative(stretch)
            }
            fn energy(&self, stretch: f64) -> f64 {
                (**self).energy(stretch)
            }
            fn is_stress_free(&self) -> bool {
                (**self).is_stress_free()
            }
            fn tangent(&self) -> f64 {
                (**self).tangent()
            }
        }
    )*};
}
pointers_are_laws!(&L, Box<L>, std::sync::Arc<L>);

/// The laws by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "case", derive(schemars::JsonSchema, clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Law {
    /// t = T(l) − T(1): the printed chain force minus its value at rest.
    #[default]
    ChainOffset,
    /// t = T(l − 1), odd: the only law that obeys (2.70) literally.
    ChainShifted,
    /// t = T(g(l)) g′(l) with (2.38) as the chain stretch.
    ChainAffine,
    /// t = T(l) as printed: not stress-free, collapses.
    AsPublished,
    /// t = 3(l − 1): the linear bond of the prototype microelastic brittle material.
    Linear,
}

impl Law {
    /// All laws.
    pub const ALL: [Self; 5] =
        [Self::ChainOffset, Self::ChainShifted, Self::ChainAffine, Self::AsPublished, Self::Linear];

    /// Name in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::ChainOffset => "chain-offset",
            Self::ChainShifted => "chain-shifted",
            Self::ChainAffine => "chain-affine",
            Self::AsPublished => "as-published",
            Self::Linear => "linear",
        }
    }

    /// Returns true if the law has chain parameters n̄ and D̂.
    pub fn is_chain(self) -> bool {
        self != Self::Linear
    }

    /// Returns true if kθ is scaled to an exact small-strain modulus by default.
    pub fn rescales(self) -> bool {
        self == Self::ChainAffine
    }

    /// Factor on the fictitious mass of dynamic relaxation, for the law's stiffening.
    pub fn mass_safety(self) -> f64 {
        if self == Self::ChainAffine { 1.5 } else { 1.1 }
    }

    /// Builds the law with n̄ `links` and D̂ = `dissociation`, times 3/K if `rescale`.
    ///
    /// # Errors
    /// [`Error::Parameter`] if a chain parameter is out of its domain.
    pub fn build(
        self,
        links: f64,
        dissociation: f64,
        rescale: bool,
    ) -> Result<Box<dyn BondPotential>, Error> {
        let chain = || Chain::new(links, dissociation);
        Ok(match self {
            Self::ChainOffset => scaled(BondStretch::new(chain()?), rescale),
            Self::ChainShifted => scaled(Shifted(chain()?), rescale),
            Self::ChainAffine => scaled(NetworkStretch(chain()?), rescale),
            Self::AsPublished => scaled(PublishedChain(chain()?), rescale),
            Self::Linear => scaled(LinearBond, rescale),
        })
    }
}

fn scaled<L: BondPotential + 'static>(law: L, rescale: bool) -> Box<dyn BondPotential> {
    if rescale {
        let factor = 3.0 / law.tangent();
        Box::new(Scaled { law, factor })
    } else {
        Box::new(law)
    }
}
