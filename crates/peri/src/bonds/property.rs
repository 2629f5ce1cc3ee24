//! Properties as fields over particles.

use super::BodyGeometry;

/// A property of the particles: one value for all, which costs nothing, or a value for each site. Numbers
/// convert: `3.0.into()`. Single bonds may be weaker than both of their ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Property {
    /// Site by site; empty where all particles have `least`.
    values: Vec<f64>,
    least: f64,
    greatest: f64,
    /// Bonds weaker than both ends, by their sites, ascending, each from both ends.
    bonds: Vec<([u32; 2], f64)>,
}

impl From<f64> for Property {
    fn from(value: f64) -> Self {
        Self { values: Vec::new(), least: value, greatest: value, bonds: Vec::new() }
    }
}

impl Property {
    /// Evaluates `value` at the site and position, m, of each particle.
    pub fn new<const D: usize>(bonds: &dyn BodyGeometry<D>, value: impl Fn(usize, [f64; D]) -> f64) -> Self {
        let mut field = Self {
            values: vec![0.0; bonds.sites()],
            least: f64::INFINITY,
            greatest: f64::NEG_INFINITY,
            bonds: Vec::new(),
        };
        for site in bonds.particles().iter().map(|&site| site as usize) {
            let value = value(site, bonds.position(site));
            field.values[site] = value;
            field.least = field.least.min(value);
            field.greatest = field.greatest.max(value);
        }
        // a uniform field is stored as one value
        if field.least == field.greatest { field.least.into() } else { field }
    }

    /// Value of the particle in a site.
    #[inline]
    pub fn value_at(&self, site: usize) -> f64 {
        self.values.get(site).copied().unwrap_or(self.greatest)
    }

    /// Weakens single bonds below the values of their ends; each is given once, by its two sites.
    #[must_use]
    pub fn weakened(mut self, bonds: Vec<([u32; 2], f64)>) -> Self {
        let below =
            |&([site, other], value): &([u32; 2], f64)| value < self.weaker(site as usize, other as usize);
        let weak: Vec<([u32; 2], f64)> = bonds.into_iter().filter(below).collect();
        self.least = weak.iter().map(|bond| bond.1).fold(self.least, f64::min);
        self.bonds = weak.iter().flat_map(|&([a, b], value)| [([a, b], value), ([b, a], value)]).collect();
        self.bonds.sort_unstable_by_key(|bond| bond.0);
        self
    }

    /// Value of a bond: that of the weaker of its ends, unless the bond is weaker than both.
    #[inline]
    pub fn weaker(&self, site: usize, other: usize) -> f64 {
        let ends = if self.values.is_empty() {
            self.greatest
        } else {
            self.value_at(site).min(self.value_at(other))
        };
        if self.bonds.is_empty() {
            return ends;
        }
        let found = self.bonds.binary_search_by_key(&[site as u32, other as u32], |bond| bond.0);
        found.map_or(ends, |at| self.bonds[at].1)
    }

    /// The single value of all particles and bonds; `None` for a field.
    pub fn uniform(&self) -> Option<f64> {
        (self.values.is_empty() && self.bonds.is_empty()).then_some(self.least)
    }

    /// The smallest value of any particle or bond.
    pub fn least(&self) -> f64 {
        self.least
    }

    /// The greatest value of any particle.
    pub fn greatest(&self) -> f64 {
        self.greatest
    }
}
