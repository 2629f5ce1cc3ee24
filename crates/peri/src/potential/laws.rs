//! The chain force with four reference states, and the linear bond.

use super::{BondPotential, Chain};

/// `subtract`: t = T(l) − T(1).
pub struct BondStretch(pub Chain);

impl BondPotential for BondStretch {
    fn tension(&self, stretch: f64) -> f64 {
        self.0.stretched(stretch).force - self.0.stretched(1.0).force
    }
    fn tension_derivative(&self, stretch: f64) -> f64 {
        self.0.stretched(stretch).stiffness
    }
    fn energy(&self, stretch: f64) -> f64 {
        let rest = self.0.stretched(1.0);
        self.0.stretched(stretch).energy - rest.energy - rest.force * (stretch - 1.0)
    }
}

/// `shift`: t = T(l − 1), odd in l − 1.
pub struct Shifted(pub Chain);

impl BondPotential for Shifted {
    fn tension(&self, stretch: f64) -> f64 {
        let strain = stretch - 1.0;
        self.0.stretched(strain).force.copysign(strain)
    }
    fn tension_derivative(&self, stretch: f64) -> f64 {
        // the derivative at β → 0 is a quotient of zeros: start just beside it
        self.0.stretched((stretch - 1.0).abs().max(1e-12)).stiffness
    }
    fn energy(&self, stretch: f64) -> f64 {
        self.0.stretched(stretch - 1.0).energy
    }
}

/// `chain`: the chain stretch is g(l) = √((l^{4/3} + 2l^{−2/3})/3), Eq. (2.38), and t = T(g) g′.
pub struct NetworkStretch(pub Chain);

impl NetworkStretch {
    /// g(l) of Eq. (2.38): stretch of a chain in a network of which one direction is stretched by l at constant volume.
    pub fn chain_stretch(stretch: f64) -> f64 {
        ((stretch.powf(4.0 / 3.0) + 2.0 * stretch.powf(-2.0 / 3.0)) / 3.0).sqrt()
    }

    /// g′(l).
    pub fn chain_stretch_derivative(stretch: f64) -> f64 {
        // l^{1/3} − l^{−5/3} = l^{−5/3}(l − 1)(l + 1), without cancellation near l = 1
        let difference = stretch.powf(-5.0 / 3.0) * (stretch - 1.0) * (stretch + 1.0);
        2.0 / 9.0 * difference / Self::chain_stretch(stretch)
    }
}

impl BondPotential for NetworkStretch {
    fn tension(&self, stretch: f64) -> f64 {
        self.0.stretched(Self::chain_stretch(stretch)).force * Self::chain_stretch_derivative(stretch)
    }
    fn tension_derivative(&self, stretch: f64) -> f64 {
        let (g, slope) = (Self::chain_stretch(stretch), Self::chain_stretch_derivative(stretch));
        let outer = 2.0 / 9.0 * (stretch.powf(-2.0 / 3.0) + 5.0 * stretch.powf(-8.0 / 3.0)) / 3.0;
        let curvature = (outer - slope * slope) / g;
        let point = self.0.stretched(g);
        point.stiffness * slope * slope + point.force * curvature
    }
    fn energy(&self, stretch: f64) -> f64 {
        self.0.stretched(Self::chain_stretch(stretch)).energy - self.0.stretched(1.0).energy
    }
}

/// `printed`: t = T(l). Not stress-free; a body of it collapses.
pub struct Printed(pub Chain);

impl BondPotential for Printed {
    fn tension(&self, stretch: f64) -> f64 {
        self.0.stretched(stretch).force
    }
    fn tension_derivative(&self, stretch: f64) -> f64 {
        self.0.stretched(stretch).stiffness
    }
    fn energy(&self, stretch: f64) -> f64 {
        self.0.stretched(stretch).energy - self.0.stretched(1.0).energy
    }
    fn is_stress_free(&self) -> bool {
        false
    }
}

/// `pmb`: t = 3(l − 1), Silling & Askari 2005, doi:10.1016/j.compstruc.2004.11.026.
pub struct LinearBond;

impl BondPotential for LinearBond {
    fn tension(&self, stretch: f64) -> f64 {
        3.0 * (stretch - 1.0)
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
