//! The chain force with four reference states, and the linear bond.

use super::{BondPotential, Chain};
use crate::quadrature::mean;

/// Strains below which T(l) − T(1) is integrated from T′, without cancellation.
const SMALL_DIFFERENCE: f64 = 0.03;

/// Strains below which an energy is integrated from the tension, without cancellation.
const SMALL_ENERGY: f64 = 0.05;

/// `chain-offset`: t = T(l) − T(1).
///
/// K = T′(1) = 3 + 27/(5n̄) − 36/(n̄D̂) + O(n̄⁻²). Far beyond the greatest force of the chain t becomes
/// negative again and tends to −T(1); bonds break long before.
pub struct BondStretch {
    chain: Chain,
    force_at_rest: f64,
}

impl BondStretch {
    /// The law of a chain.
    pub fn new(chain: Chain) -> Self {
        Self { chain, force_at_rest: chain.stretched(1.0).force }
    }
}

impl BondPotential for BondStretch {
    fn tension(&self, stretch: f64) -> f64 {
        self.tension_at_strain(stretch - 1.0)
    }
    fn tension_at_strain(&self, strain: f64) -> f64 {
        if strain.abs() < SMALL_DIFFERENCE {
            strain * mean(0.0, strain, |part| self.chain.stretched(1.0 + part).stiffness)
        } else {
            self.chain.stretched(1.0 + strain).force - self.force_at_rest
        }
    }
    fn tension_derivative(&self, stretch: f64) -> f64 {
        self.chain.stretched(stretch).stiffness
    }
    fn energy(&self, stretch: f64) -> f64 {
        if stretch == f64::INFINITY {
            return f64::NEG_INFINITY;
        }
        energy_near_rest(self, stretch)
            .unwrap_or_else(|| energy_from_rest(&self.chain, stretch) - self.force_at_rest * (stretch - 1.0))
    }
}

/// `chain-shifted`: t = T(l − 1), odd in l − 1.
pub struct Shifted(pub Chain);

impl BondPotential for Shifted {
    fn tension(&self, stretch: f64) -> f64 {
        self.tension_at_strain(stretch - 1.0)
    }
    fn tension_at_strain(&self, strain: f64) -> f64 {
        self.0.stretched(strain).force.copysign(strain)
    }
    fn tension_derivative(&self, stretch: f64) -> f64 {
        self.0.stretched(stretch - 1.0).stiffness
    }
    fn energy(&self, stretch: f64) -> f64 {
        self.0.stretched(stretch - 1.0).energy
    }
}

/// `chain-affine`: the chain stretch is g(l) = √((l^{4/3} + 2l^{−2/3})/3), Eq. (2.38), and t = T(g) g′.
pub struct NetworkStretch(pub Chain);

impl NetworkStretch {
    /// g(l) of Eq. (2.38): stretch of a chain in a network stretched by l in one direction at constant
    /// volume. Minimum 1 at l = 1; ∞ at 0 and at ∞.
    pub fn chain_stretch(stretch: f64) -> f64 {
        if stretch == f64::INFINITY {
            return f64::INFINITY;
        }
        // g = l^{−1/3}√((l² + 2)/3), l² guarded against overflow
        let scale = if stretch > 1.0 { stretch } else { 1.0 };
        let reduced = stretch / scale;
        ((reduced * reduced + 2.0 / scale / scale) / 3.0).sqrt() * scale / stretch.cbrt()
    }

    /// g′(l) = g·(2/3)(l² − 1)/(l(l² + 2)).
    pub fn chain_stretch_derivative(stretch: f64) -> f64 {
        Self::chain_stretch(stretch) * Self::rate(stretch, stretch - 1.0) / stretch
    }

    /// l g′/g = (2/3)(l² − 1)/(l² + 2), l = 1 + s given twice, each as exact as possible.
    fn rate(stretch: f64, strain: f64) -> f64 {
        if stretch > 1e100 {
            2.0 / 3.0
        } else {
            2.0 / 3.0 * (strain * (2.0 + strain)) / (stretch * stretch + 2.0)
        }
    }

    fn force(&self, stretch: f64, strain: f64) -> f64 {
        if stretch == 0.0 {
            return f64::NEG_INFINITY;
        }
        if stretch == f64::INFINITY {
            return 0.0;
        }
        let g = Self::chain_stretch(stretch);
        self.0.stretched(g).force * g * Self::rate(stretch, strain) / stretch
    }
}

impl BondPotential for NetworkStretch {
    fn tension(&self, stretch: f64) -> f64 {
        self.force(stretch, stretch - 1.0)
    }
    fn tension_at_strain(&self, strain: f64) -> f64 {
        self.force(1.0 + strain, strain)
    }
    fn tension_derivative(&self, stretch: f64) -> f64 {
        if stretch == 0.0 {
            return f64::INFINITY;
        }
        if stretch > 1e75 {
            return 0.0;
        }
        // t = T g y with y = g′/g, so t′ = (T′g + T) g y² + T g y′, y′ = (2/3)(2 + 5l² − l⁴)/(l²(l² + 2)²)
        let square = stretch * stretch;
        let y = Self::rate(stretch, stretch - 1.0) / stretch;
        let slope = 2.0 / 3.0 * (2.0 + square * (5.0 - square)) / (square * (square + 2.0) * (square + 2.0));
        let g = Self::chain_stretch(stretch);
        let point = self.0.stretched(g);
        (point.stiffness * g + point.force) * g * y * y + point.force * g * slope
    }
    fn energy(&self, stretch: f64) -> f64 {
        energy_near_rest(self, stretch)
            .unwrap_or_else(|| energy_from_rest(&self.0, Self::chain_stretch(stretch)))
    }
}

/// `as-published`: t = T(l). Not stress-free; a body of it collapses.
pub struct PublishedChain(pub Chain);

impl BondPotential for PublishedChain {
    fn tension(&self, stretch: f64) -> f64 {
        self.0.stretched(stretch).force
    }
    fn tension_derivative(&self, stretch: f64) -> f64 {
        self.0.stretched(stretch).stiffness
    }
    fn energy(&self, stretch: f64) -> f64 {
        energy_near_rest(self, stretch).unwrap_or_else(|| energy_from_rest(&self.0, stretch))
    }
    fn is_stress_free(&self) -> bool {
        false
    }
}

/// `linear`: t = 3(l − 1), Silling & Askari 2005, doi:10.1016/j.compstruc.2004.11.026.
pub struct LinearBond;

impl BondPotential for LinearBond {
    fn tension(&self, stretch: f64) -> f64 {
        3.0 * (stretch - 1.0)
    }
    fn tension_at_strain(&self, strain: f64) -> f64 {
        3.0 * strain
    }
    fn tension_derivative(&self, _stretch: f64) -> f64 {
        3.0
    }
    fn energy(&self, stretch: f64) -> f64 {
        1.5 * (stretch - 1.0).powi(2)
    }
}

/// A law times a constant.
pub struct Scaled<L> {
    /// The law.
    pub law: L,
    /// The constant.
    pub factor: f64,
}

impl<L: BondPotential> BondPotential for Scaled<L> {
    fn tension(&self, stretch: f64) -> f64 {
        self.factor * self.law.tension(stretch)
    }
    fn tension_at_strain(&self, strain: f64) -> f64 {
        self.factor * self.law.tension_at_strain(strain)
    }
    fn tension_derivative(&self, stretch: f64) -> f64 {
        self.factor * self.law.tension_derivative(stretch)
    }
    fn energy(&self, stretch: f64) -> f64 {
        self.factor * self.law.energy(stretch)
    }
    fn is_stress_free(&self) -> bool {
        self.law.is_stress_free()
    }
}

/// φ(λ̄) − φ(1) of a chain.
fn energy_from_rest(chain: &Chain, stretch: f64) -> f64 {
    chain.stretched(stretch).energy - chain.stretched(1.0).energy
}

/// Integrates the tension to the energy if a difference of energies would cancel.
fn energy_near_rest(law: &impl BondPotential, stretch: f64) -> Option<f64> {
    let strain = stretch - 1.0;
    (strain.abs() < SMALL_ENERGY).then(|| strain * mean(0.0, strain, |part| law.tension_at_strain(part)))
}
