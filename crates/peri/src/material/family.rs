//! Families and bonds as a material sees them.

use crate::bonds::{BodyGeometry, Neighbour};
use crate::field::Field;

/// A particle with its intact bonds under a displacement.
pub struct Family<'a, const D: usize> {
    bonds: &'a dyn BodyGeometry<D>,
    displacement: &'a Field<D>,
    site: usize,
}

/// An intact bond from a particle I to a particle J.
#[derive(Clone, Copy, Debug)]
pub struct Bond<const D: usize> {
    /// Site of I.
    pub from: usize,
    /// Site of J.
    pub to: usize,
    /// ξ = X_J − X_I, m.
    pub reference: [f64; D],
    /// |ξ|, m.
    pub length: f64,
    /// u_J − u_I, m.
    pub change: [f64; D],
    /// Volume correction times V_J, m³: the weight of a bond in sums over a family.
    pub volume: f64,
    /// `volume` times the factors of surface correction and micromodulus, m³.
    pub weight: f64,
    /// θ_J − θ_I of [`super::relief`], m; zero if there is none.
    pub relief: [f64; D],
}

impl<const D: usize> Bond<D> {
    /// Builds the bond of the particle in `from` to a neighbour, under a displacement.
    pub fn new(from: usize, neighbour: &Neighbour<D>, displacement: &Field<D>) -> Self {
        let (own, other) = (displacement.get(from), displacement.get(neighbour.site));
        Self {
            from,
            to: neighbour.site,
            reference: neighbour.bond,
            length: neighbour.length,
            change: std::array::from_fn(|d| other[d] - own[d]),
            volume: neighbour.volume,
            weight: neighbour.weight,
            relief: neighbour.relief,
        }
    }

    /// ζ = ξ + η, m.
    pub fn current(&self) -> [f64; D] {
        std::array::from_fn(|d| self.reference[d] + self.change[d])
    }

    /// e = λ² − 1 = η·(2ξ + η)/|ξ|², exact to all digits at small strains.
    pub fn elongation(&self) -> f64 {
        let product = |d: usize| self.change[d] * (2.0 * self.reference[d] + self.change[d]);
        (0..D).map(product).sum::<f64>() / (self.length * self.length)
    }

    /// Stretch λ = |ζ|/|ξ|.
    pub fn stretch(&self) -> f64 {
        (1.0 + self.elongation()).max(0.0).sqrt()
    }

    /// λ − 1, exact to all digits at small strains.
    pub fn strain(&self) -> f64 {
        self.elongation() / (1.0 + self.stretch())
    }

    /// ζ/|ζ|; zero if both ends are at one point.
    pub fn direction(&self) -> [f64; D] {
        let current = self.current();
        let length = current.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length > 0.0 { current.map(|x| x / length) } else { [0.0; D] }
    }
}

impl<'a, const D: usize> Family<'a, D> {
    /// Family of the particle in a site.
    pub fn new(bonds: &'a dyn BodyGeometry<D>, displacement: &'a Field<D>, site: usize) -> Self {
        Self { bonds, displacement, site }
    }

    /// Site of the particle.
    pub fn site(&self) -> usize {
        self.site
    }

    /// Reference position of the particle, m.
    pub fn position(&self) -> [f64; D] {
        self.bonds.position(self.site)
    }

    /// Volume of the particle, m³.
    pub fn volume(&self) -> f64 {
        self.bonds.volume(self.site)
    }

    /// Horizon δ, m.
    pub fn horizon(&self) -> f64 {
        self.bonds.horizon()
    }

    /// Returns true if bonds have a [`Bond::relief`].
    pub fn is_relieved(&self) -> bool {
        self.bonds.relief().is_some()
    }

    /// Visits the intact bonds.
    pub fn each(&self, mut visit: impl FnMut(Bond<D>)) {
        self.bonds.neighbours(self.site, &mut |bond| visit(Bond::new(self.site, &bond, self.displacement)));
    }

    /// Sums a term over the intact bonds.
    pub fn sum(&self, mut term: impl FnMut(Bond<D>) -> f64) -> f64 {
        let mut sum = 0.0;
        self.each(|bond| sum += term(bond));
        sum
    }
}
