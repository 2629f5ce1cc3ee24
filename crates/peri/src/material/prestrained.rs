//! Bond laws in a body whose particles would have another shape if free: eigenstrains of printing, swelling,
//! heat.

use super::bonded::mixed;
use super::{Bond, BondMaterial, Family, Material};
use crate::bonds::BodyGeometry;
use std::sync::Arc;

/// A bond law whose bonds are at rest at the stretch λ* = |(1 + ε*)n|, with n = ξ/|ξ| and the mean ε* of the
/// prestrains of both ends: the energy of a bond is w = |ξ|λ*φ(λ/λ*), its tension t = φ′(λ/λ*). A free body
/// with a uniform ε* takes the displacement ε*X without any force, and rigid rotations change nothing. λ* =
/// 1 + n·ε*n would leave stresses of second order in a free body.
///
/// Evaluated by plain loops over bonds, several times slower than [`BondMaterial`].
#[derive(Clone)]
pub struct Prestrained<const D: usize> {
    bonded: BondMaterial<'static>,
    /// ε* site by site.
    strain: Arc<Vec<[[f64; D]; D]>>,
    /// Lower bound of λ*; below 1 if any ε* is negative.
    least_rest: f64,
    /// λ/λ* beyond which tension is constant.
    most: f64,
}

impl<const D: usize> Prestrained<D> {
    /// Creates the material from a law and ε* of each site; ε* is symmetric, above −1.
    pub fn new(bonded: BondMaterial<'static>, strain: Vec<[[f64; D]; D]>) -> Self {
        // no eigenvalue is farther from 0 than the largest row sum
        let row = |row: &[f64; D]| row.iter().map(|x| x.abs()).sum::<f64>();
        let most = strain.iter().flatten().map(row).fold(0.0, f64::max);
        let least_rest = (1.0 - most).max(0.0);
        Self { bonded, strain: Arc::new(strain), least_rest, most: f64::INFINITY }
    }

    /// Keeps the tension constant beyond λ/λ* = `most`, for bonds that break before.
    pub fn clamped(self, most: f64) -> Self {
        Self { most, ..self }
    }

    /// λ/λ* − 1 up to the limit, and the excess.
    fn relative(&self, bond: &Bond<D>) -> [f64; 2] {
        let rest = self.rest_strain(bond);
        let strain = (bond.strain() - rest) / (1.0 + rest);
        let within = strain.min(self.most - 1.0);
        [within, strain - within]
    }

    /// λ* − 1 of a bond, exact to all digits at small strains.
    fn rest_strain(&self, bond: &Bond<D>) -> f64 {
        let (own, other) = (&self.strain[bond.from], &self.strain[bond.to]);
        let (mut along, mut square) = (0.0, 0.0);
        for a in 0..D {
            let row = |b: usize| 0.5 * (own[a][b] + other[a][b]) * bond.reference[b] / bond.length;
            let component: f64 = (0..D).map(row).sum();
            along += component * bond.reference[a] / bond.length;
            square += component * component;
        }
        let elongation = 2.0 * along + square;
        elongation / (1.0 + (1.0 + elongation).max(0.0).sqrt())
    }
}

impl<const D: usize> Material<D> for Prestrained<D> {
    type Point = ();

    /// 2kθ t(λ/λ*) ζ/|ζ|.
    fn force(&self, bond: &Bond<D>, (): &(), (): &()) -> [f64; D] {
        let [strain, _] = self.relative(bond);
        let size = self.bonded.scale(bond) * self.bonded.law().tension_at_strain(strain);
        bond.direction().map(|x| size * x)
    }

    /// Σ_J kθ |ξ| λ* φ(λ/λ*) w V_J.
    fn energy(&self, family: &Family<D>, (): &()) -> f64 {
        let energy = |bond: Bond<D>| {
            let ([strain, beyond], law) = (self.relative(&bond), self.bonded.law());
            let within = law.energy(1.0 + strain);
            let density = if beyond > 0.0 { within + beyond * law.tension_at_strain(strain) } else { within };
            bond.weight * bond.length * (1.0 + self.rest_strain(&bond)) * density
        };
        self.bonded.modulus() * family.sum(energy)
    }

    /// Σ_J (2kθ w V_J/|ξ|)·max(|t′|/λ*, |t|/λ)(1 + max_{d≠e} |n_d n_e|).
    fn stiffness(&self, family: &Family<D>, _points: &[()]) -> f64 {
        let law = self.bonded.law();
        let bound = |bond: Bond<D>| {
            let rest = 1.0 + self.rest_strain(&bond);
            let stretch = bond.stretch().max(f64::MIN_POSITIVE);
            let within = (stretch / rest).min(self.most);
            let slope = law.tension_derivative(within).abs() / rest;
            let tangent = slope.max(law.tension(within).abs() / stretch);
            2.0 * bond.weight / bond.length * tangent * (1.0 + mixed(bond.direction()))
        };
        self.bonded.modulus() * family.sum(bound)
    }

    fn micromodulus(&self, bonds: &dyn BodyGeometry<D>) -> f64 {
        self.bonded.micromodulus(bonds)
    }

    fn rest(&self, bond: &Bond<D>) -> f64 {
        1.0 + self.rest_strain(bond)
    }

    fn least_rest(&self) -> f64 {
        self.least_rest
    }
}
