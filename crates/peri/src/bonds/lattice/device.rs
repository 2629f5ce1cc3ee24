//! Bonds of a lattice as a graphics card takes them.

use super::LatticeBonds;
use crate::field::Field;
use crate::potential::KernelFit;

impl<const D: usize> LatticeBonds<D> {
    /// Returns true if bonds have softened.
    pub(crate) fn has_softened(&self) -> bool {
        !self.softening.bonds().is_empty()
    }

    /// Factors of particles, over their interior value, and whether they are equal along all axes.
    pub(crate) fn factors(&self) -> Option<(&Field<D>, bool)> {
        Some((self.factors.as_ref()?, self.even))
    }

    /// The fitted law and kθ, N/m⁶, where they are set.
    pub(crate) fn law(&self) -> Option<(&KernelFit, f64)> {
        self.law.as_ref().map(|(fit, modulus)| (fit, *modulus))
    }
}
