//! Properties as fields over the particles.

use super::Bonds;

/// A property of the particles: one value for all, which costs nothing, or a value for each slot. A number is one: `3.0.into()`.
#[derive(Clone, Debug, PartialEq)]
pub struct Property {
    /// Slot by slot; empty where all particles have `least`.
    values: Vec<f64>,
    least: f64,
    greatest: f64,
}

impl From<f64> for Property {
    fn from(value: f64) -> Self {
        Self { values: Vec::new(), least: value, greatest: value }
    }
}

impl Property {
    /// A field: `value` of the slot and the position, m, of each particle.
    pub fn new<const D: usize>(bonds: &dyn Bonds<D>, value: impl Fn(usize, [f64; D]) -> f64) -> Self {
        let mut field =
            Self { values: vec![0.0; bonds.slots()], least: f64::INFINITY, greatest: f64::NEG_INFINITY };
        for slot in bonds.particles().iter().map(|&slot| slot as usize) {
            let value = value(slot, bonds.position(slot));
            field.values[slot] = value;
            field.least = field.least.min(value);
            field.greatest = field.greatest.max(value);
        }
        // no field where it would say nothing
        if field.least == field.greatest { field.least.into() } else { field }
    }

    /// The value of the particle in a slot.
    #[inline]
    pub fn at(&self, slot: usize) -> f64 {
        self.values.get(slot).copied().unwrap_or(self.least)
    }

    /// The value of a bond that is as strong as the weaker of its ends.
    #[inline]
    pub fn weaker(&self, slot: usize, other: usize) -> f64 {
        if self.values.is_empty() { self.least } else { self.at(slot).min(self.at(other)) }
    }

    /// The one value of all particles; `None` of a field.
    pub fn uniform(&self) -> Option<f64> {
        self.values.is_empty().then_some(self.least)
    }

    /// The smallest value of any particle.
    pub fn least(&self) -> f64 {
        self.least
    }

    /// The greatest value of any particle.
    pub fn greatest(&self) -> f64 {
        self.greatest
    }
}
