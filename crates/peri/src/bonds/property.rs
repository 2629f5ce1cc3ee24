//! Properties as fields over the particles.

use super::Bonds;

/// A property of the particles: one value for all, which costs nothing, or a value for each site. A number is one: `3.0.into()`.
#[derive(Clone, Debug, PartialEq)]
pub struct Property {
    /// Site by site; empty where all particles have `least`.
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
    /// A field: `value` of the site and the position, m, of each particle.
    pub fn new<const D: usize>(bonds: &dyn Bonds<D>, value: impl Fn(usize, [f64; D]) -> f64) -> Self {
        let mut field =
            Self { values: vec![0.0; bonds.sites()], least: f64::INFINITY, greatest: f64::NEG_INFINITY };
        for site in bonds.particles().iter().map(|&site| site as usize) {
            let value = value(site, bonds.position(site));
            field.values[site] = value;
            field.least = field.least.min(value);
            field.greatest = field.greatest.max(value);
        }
        // no field where it would say nothing
        if field.least == field.greatest { field.least.into() } else { field }
    }

    /// The value of the particle in a site.
    #[inline]
    pub fn at(&self, site: usize) -> f64 {
        self.values.get(site).copied().unwrap_or(self.least)
    }

    /// The value of a bond that is as strong as the weaker of its ends.
    #[inline]
    pub fn weaker(&self, site: usize, other: usize) -> f64 {
        if self.values.is_empty() { self.least } else { self.at(site).min(self.at(other)) }
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
