//! Bodies of several bond laws: the law of each particle, and the share of both ends in a bond.

use super::{BodyGeometry, TILE};
use crate::error::Error;
use std::ops::Range;

/// Laws of the particles, by number, and their shares in bonds: half of a bond belongs to each of its ends.
/// A bond with the law of stiffness c_I at I and that of c_J at J has the mean (c_I x_I + c_J x_J)/(c_I +
/// c_J) of both laws' tensions, energies and tangents x, times the mean stiffness, as all its other weights.
#[derive(Debug)]
pub struct LawShares {
    /// Number of the law, by site.
    numbers: Vec<u16>,
    /// For each law the stiffness c of its particles, 0 at others, by site.
    stiffness: Vec<Vec<f64>>,
}

impl LawShares {
    /// Evaluates the number of the law, below `laws`, and the relative stiffness at the site and position, m,
    /// of each particle.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a law that does not exist, or a stiffness that is not positive.
    pub fn new<const D: usize>(
        bonds: &dyn BodyGeometry<D>,
        laws: usize,
        of: impl Fn(usize, [f64; D]) -> (usize, f64),
    ) -> Result<Self, Error> {
        let mut numbers = vec![0; bonds.sites()];
        let mut stiffness = vec![vec![0.0; bonds.sites()]; laws];
        let most = laws.min(usize::from(u16::MAX));
        let fault = |name, found, allowed: String| Err(Error::Parameter { name, found, allowed });
        for site in bonds.particles().iter().map(|&site| site as usize) {
            let (number, own) = of(site, bonds.position(site));
            if number >= most {
                return fault("number of a bond law", number as f64, format!("less than {most}"));
            }
            if !(own > 0.0 && own.is_finite()) {
                return fault("stiffness of a particle", own, "above 0, finite".to_owned());
            }
            numbers[site] = number as u16;
            stiffness[number][site] = own;
        }
        for image in bonds.images() {
            let [site, origin] = [image.site, image.origin].map(|site| site as usize);
            numbers[site] = numbers[origin];
            stiffness.iter_mut().for_each(|own| own[site] = own[origin]);
        }
        Ok(Self { numbers, stiffness })
    }

    /// Number of laws.
    pub fn laws(&self) -> usize {
        self.stiffness.len()
    }

    /// Number of the law of the particle in a site; 0 in sites of another body.
    #[inline]
    pub fn number_at(&self, site: usize) -> usize {
        self.numbers.get(site).map_or(0, |&number| usize::from(number))
    }

    /// Refuses shares of a body that has not this number of `sites`.
    ///
    /// # Errors
    /// [`Error::Geometry`].
    pub fn check(&self, sites: usize) -> Result<(), Error> {
        let found = self.numbers.len();
        if found == sites {
            return Ok(());
        }
        Err(Error::geometry(format!(
            "laws of parts: found those of another body, of {found} sites; allowed: \
            of this body, of {sites}"
        )))
    }

    /// Stiffness of the particle in a site.
    pub fn stiffness_at(&self, site: usize) -> f64 {
        self.stiffness[self.number_at(site)][site]
    }

    /// Stiffness of the particles of a law, by site, 0 elsewhere.
    pub fn stiffness_of(&self, law: usize) -> &[f64] {
        &self.stiffness[law]
    }

    /// Computes the mean of a quantity of both ends' laws in a bond; the same bits from either end.
    #[inline]
    pub fn mean(&self, from: usize, to: usize, of: impl Fn(usize) -> f64) -> f64 {
        let (own, other) = (self.number_at(from), self.number_at(to));
        if own == other {
            return of(own);
        }
        let stiffness = |law: usize, site: usize| self.stiffness[law].get(site).copied().unwrap_or(1.0);
        let (a, b) = (stiffness(own, from), stiffness(other, to));
        (a * of(own) + b * of(other)) / (a + b)
    }

    /// Finds the particles that have, or whose neighbours have, another law than the first.
    pub fn beside_others<const D: usize>(&self, bonds: &dyn BodyGeometry<D>) -> Vec<u32> {
        let is_beside = |&site: &u32| {
            let mut other = self.number_at(site as usize) != 0;
            bonds.neighbours(site as usize, &mut |bond| other |= self.number_at(bond.site) != 0);
            other
        };
        bonds.particles().iter().copied().filter(is_beside).collect()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.numbers.len() * (size_of::<u16>() + self.stiffness.len() * size_of::<f64>())
    }
}

/// Sites whose forces of one law are added at once.
const BLOCK: usize = 16 * TILE;

/// Adds the forces of the sites `range`, which `run` computes for blocks of whole tiles from its start, to
/// `force` of the sites from `start` on.
pub(super) fn add_force<const D: usize>(
    force: &mut [&mut [f64]; D],
    start: usize,
    range: Range<usize>,
    mut run: impl FnMut(usize, &mut [&mut [f64]; D]),
) {
    for first in range.clone().step_by(BLOCK) {
        let count = BLOCK.min(range.end - first);
        let mut part = [[0.0; BLOCK]; D];
        run(first, &mut part.each_mut().map(|part| &mut part[..count]));
        for (force, part) in force.iter_mut().zip(&part) {
            force[first - start..].iter_mut().zip(&part[..count]).for_each(|(sum, own)| *sum += own);
        }
    }
}
