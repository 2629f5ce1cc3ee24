//! Properties as fields over particles.

use super::{BodyGeometry, Bonds};

/// A property of the particles: one value for all, which costs nothing, or a value for each site. Numbers
/// convert: `3.0.into()`. Single bonds may have a value of their own.
#[derive(Clone, Debug, PartialEq)]
pub struct Property {
    /// Site by site; empty where all particles have `rest`.
    values: Vec<f64>,
    rest: f64,
    least: f64,
    greatest: f64,
    /// Bonds with a value of their own, by their sites, ascending, each from both ends.
    bonds: Vec<([u32; 2], f64)>,
    /// True at sites whose bonds have an infinite value; empty without any.
    guarded: Vec<bool>,
}

impl From<f64> for Property {
    fn from(value: f64) -> Self {
        let (values, bonds, guarded) = (Vec::new(), Vec::new(), Vec::new());
        Self { values, rest: value, least: value, greatest: value, bonds, guarded }
    }
}

impl Property {
    /// Evaluates `value` at the site and position, m, of each particle.
    pub fn new<const D: usize>(bonds: &dyn BodyGeometry<D>, value: impl Fn(usize, [f64; D]) -> f64) -> Self {
        let mut field = Self {
            values: vec![0.0; bonds.sites()],
            rest: 0.0,
            least: f64::INFINITY,
            greatest: f64::NEG_INFINITY,
            bonds: Vec::new(),
            guarded: Vec::new(),
        };
        for site in bonds.particles().iter().map(|&site| site as usize) {
            let value = value(site, bonds.position(site));
            field.values[site] = value;
            field.least = field.least.min(value);
            field.greatest = field.greatest.max(value);
        }
        for image in bonds.images() {
            field.values[image.site as usize] = field.values[image.origin as usize];
        }
        // a uniform field is stored as one value
        if field.least == field.greatest { field.least.into() } else { field }
    }

    /// Value of the particle in a site.
    #[inline]
    pub fn value_at(&self, site: usize) -> f64 {
        self.values.get(site).copied().unwrap_or(self.rest)
    }

    /// Weakens single bonds below the values of their ends; each is given once, by its two sites.
    #[must_use]
    pub fn weakened(self, bonds: Vec<([u32; 2], f64)>) -> Self {
        let below =
            |&([site, other], value): &([u32; 2], f64)| value < self.weaker(site as usize, other as usize);
        let weak = bonds.into_iter().filter(below).collect();
        self.with_bonds(weak)
    }

    /// Gives single bonds, each by its two sites, values of their own, whatever their ends have; the least of
    /// several.
    #[must_use]
    pub fn with_bonds(mut self, bonds: Vec<([u32; 2], f64)>) -> Self {
        self.least = bonds.iter().map(|bond| bond.1).fold(self.least, f64::min);
        self.greatest = bonds.iter().map(|bond| bond.1).fold(self.greatest, f64::max);
        let ends = bonds.iter().flat_map(|&([a, b], value)| [([a, b], value), ([b, a], value)]);
        // new values first: they replace those of before
        let mut all: Vec<([u32; 2], f64)> = ends.collect();
        all.sort_unstable_by(|one, other| one.0.cmp(&other.0).then(one.1.total_cmp(&other.1)));
        all.append(&mut self.bonds);
        all.sort_by_key(|bond| bond.0);
        all.dedup_by_key(|bond| bond.0);
        self.bonds = all;
        self
    }

    /// Gives all bonds of the particles in `sites`, of a body with `count` sites, an infinite value.
    #[must_use]
    pub fn guarded(mut self, sites: &[u32], count: usize) -> Self {
        if !sites.is_empty() {
            self.guarded.resize(count, false);
            sites.iter().for_each(|&site| self.guarded[site as usize] = true);
            self.greatest = f64::INFINITY;
        }
        self
    }

    /// Value of a bond: infinite at a guarded particle, else its own, else that of the weaker of its ends.
    #[inline]
    pub fn weaker(&self, site: usize, other: usize) -> f64 {
        if !self.guarded.is_empty() && (self.guarded[site] || self.guarded[other]) {
            return f64::INFINITY;
        }
        self.unguarded(site, other)
    }

    fn unguarded(&self, site: usize, other: usize) -> f64 {
        let ends =
            if self.values.is_empty() { self.rest } else { self.value_at(site).min(self.value_at(other)) };
        if self.bonds.is_empty() {
            return ends;
        }
        let found = self.bonds.binary_search_by_key(&[site as u32, other as u32], |bond| bond.0);
        found.map_or(ends, |at| self.bonds[at].1)
    }

    /// Replaces the value of every particle and bond by `of` that value, whether or not `of` keeps their
    /// order; guarded particles stay.
    #[must_use]
    pub fn replaced<const D: usize>(&self, bonds: &dyn Bonds<D>, of: impl Fn(f64) -> f64) -> Self {
        if let Some(value) = self.uniform() {
            return of(value).into();
        }
        let mut new = Self::new(bonds, |site, _| of(self.value_at(site)));
        let mut own = Vec::new();
        for &site in bonds.particles() {
            bonds.neighbours(site as usize, &mut |bond| {
                let value = of(self.unguarded(site as usize, bond.site));
                if site < bond.site as u32 && value != new.unguarded(site as usize, bond.site) {
                    own.push(([site, bond.site as u32], value));
                }
            });
        }
        new = new.with_bonds(own);
        if !self.guarded.is_empty() {
            (new.guarded, new.greatest) = (self.guarded.clone(), f64::INFINITY);
        }
        new
    }

    /// The single value of all particles and bonds; `None` for a field.
    pub fn uniform(&self) -> Option<f64> {
        let one = self.values.is_empty() && self.bonds.is_empty() && self.guarded.is_empty();
        one.then_some(self.rest)
    }

    /// The smallest value of any particle or bond.
    pub fn least(&self) -> f64 {
        self.least
    }

    /// The greatest value of any particle or bond.
    pub fn greatest(&self) -> f64 {
        self.greatest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_values_of_bonds() {
        let weak = Property::from(3.0).weakened(vec![([1, 2], 2.0), ([4, 5], 4.0)]);
        assert_eq!([[2, 1], [4, 5], [0, 9]].map(|[a, b]| weak.weaker(a, b)), [2.0, 3.0, 3.0]);
        let own = weak.with_bonds(vec![([1, 2], 5.0), ([7, 6], 1.0), ([6, 7], 0.5)]);
        assert_eq!([[2, 1], [1, 2], [7, 6], [0, 9]].map(|[a, b]| own.weaker(a, b)), [5.0, 5.0, 0.5, 3.0]);
        assert_eq!((own.least(), own.greatest(), own.value_at(1), own.uniform()), (0.5, 5.0, 3.0, None));
        assert_eq!(Property::from(3.0).with_bonds(Vec::new()), 3.0.into());
        let guarded = own.guarded(&[1], 10);
        assert_eq!(
            [[2, 1], [1, 3], [6, 7]].map(|[a, b]| guarded.weaker(a, b)),
            [f64::INFINITY, f64::INFINITY, 0.5]
        );
        assert_eq!((guarded.least(), guarded.greatest(), guarded.value_at(1)), (0.5, f64::INFINITY, 3.0));
    }
}
