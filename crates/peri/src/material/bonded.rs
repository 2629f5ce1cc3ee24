//! Bond laws as materials without a state of a particle: one law, or one for each part of a body.

use super::bond_kernels::BondKernels;
use super::softened::BodySoftening;
use super::{Bond, Family, Material, SolverMaterial};
use crate::bonds::{BodyGeometry, Bonds, LawShares, Property};
use crate::error::Error;
use crate::potential::{BondPotential, BondSoftening, KernelFit};
use std::sync::Arc;

/// A bond law with its micromodulus, or several laws in parts of a body.
#[derive(Clone)]
pub struct BondMaterial<'a> {
    law: Arc<dyn BondPotential + 'a>,
    modulus: f64,
    /// Bonds that soften before they break.
    pub(super) soft: Option<BodySoftening>,
    /// Laws of parts of the body, and the particles of all laws.
    parts: Option<(Vec<PartLaw<'a>>, Arc<LawShares>)>,
}

/// Law of a part of a body.
#[derive(Clone)]
pub struct PartLaw<'a> {
    /// Name of the part in messages.
    pub part: String,
    /// The law.
    pub law: Arc<dyn BondPotential + 'a>,
}

impl<'a> BondMaterial<'a> {
    /// Creates the material of a law, or of a reference to one, in units of kθ = `modulus`, N/m⁶.
    pub fn new(law: impl BondPotential + 'a, modulus: f64) -> Self {
        Self { law: Arc::new(law), modulus, soft: None, parts: None }
    }

    /// Makes bonds soften to zero load at a stretch λ_f, that of the weaker of their ends; `onset` is the λ₀
    /// of each if they soften by several e_f.
    ///
    /// # Errors
    /// [`Error::Geometry`] for several laws.
    pub fn softening(
        self,
        law: BondSoftening,
        end: Property,
        onset: Option<Property>,
    ) -> Result<Self, Error> {
        Self { soft: Some(BodySoftening { law, end, onset }), ..self }.checked()
    }

    /// Refuses bonds that soften beside laws of parts.
    fn checked(self) -> Result<Self, Error> {
        if self.soft.is_some() && self.parts.is_some() {
            return Err(Error::geometry("laws of parts: found bonds that soften; allowed: none".to_owned()));
        }
        Ok(self)
    }

    /// Gives parts of a body laws of their own: `shares` number the law of [`Self::new`] 0, and those of
    /// `laws` from 1 on.
    ///
    /// Kernels evaluate the bonds of each law, those between two laws twice. If a law needs a table, plain
    /// loops sum the bonds of parts and of their neighbours, about eleven times slower.
    ///
    /// # Errors
    /// [`Error::Parameter`] unless `shares` have one law more than `laws`; [`Error::Geometry`] if bonds
    /// soften.
    pub fn with_parts(self, laws: Vec<PartLaw<'a>>, shares: Arc<LawShares>) -> Result<Self, Error> {
        if shares.laws() != laws.len() + 1 {
            let (name, found) = ("laws of parts", laws.len() as f64);
            let allowed = format!("{}, one less than the shares have", shares.laws().saturating_sub(1));
            return Err(Error::Parameter { name, found, allowed });
        }
        Self { parts: Some((laws, shares)), ..self }.checked()
    }

    /// All laws, that of the rest first.
    pub fn laws(&self) -> impl Iterator<Item = &Arc<dyn BondPotential + 'a>> {
        std::iter::once(&self.law)
            .chain(self.parts.iter().flat_map(|(laws, _)| laws.iter().map(|part| &part.law)))
    }

    /// Shares of several laws in bonds.
    pub fn shares(&self) -> Option<&LawShares> {
        self.parts.as_ref().map(|(_, shares)| &**shares)
    }

    /// Fits all laws, see [`KernelFit::new`].
    ///
    /// # Errors
    /// As [`KernelFit::new`].
    pub fn fits(&self, stretches: [f64; 2], bound: f64) -> Result<Vec<KernelFit>, Error> {
        let fit = |(number, law): (usize, &Arc<dyn BondPotential + 'a>)| {
            KernelFit::new(law, stretches, bound).map_err(|error| self.of_law(number, error))
        };
        self.laws().enumerate().map(fit).collect()
    }

    /// Names the part of the body whose law, by its number, has met an error.
    pub(super) fn of_law(&self, number: usize, error: Error) -> Error {
        let Some((laws, _)) = &self.parts else { return error };
        let part = number.checked_sub(1).map_or("the rest of the body", |number| &laws[number].part);
        Error::PartLaw { part: part.to_owned(), error: Box::new(error) }
    }

    /// Computes the mean of a quantity of the laws of a bond.
    pub(super) fn mean(&self, from: usize, to: usize, of: impl Fn(&dyn BondPotential) -> f64) -> f64 {
        match &self.parts {
            None => of(&*self.law),
            Some((laws, shares)) => shares.mean(from, to, |number| match number {
                0 => of(&*self.law),
                number => of(&*laws[number - 1].law),
            }),
        }
    }

    /// The law, that of the rest of a body with parts.
    pub fn law(&self) -> &(dyn BondPotential + 'a) {
        &*self.law
    }

    /// kθ, N/m⁶.
    pub fn modulus(&self) -> f64 {
        self.modulus
    }

    /// 2kθ times the factors of a bond.
    pub(super) fn scale<const D: usize>(&self, bond: &Bond<D>) -> f64 {
        2.0 * self.modulus * bond.weight / bond.volume
    }
}

impl<const D: usize> Material<D> for BondMaterial<'_> {
    type Point = ();

    /// 2kθ t(λ) ζ/|ζ|, Eqs (2.6), (2.47).
    fn force(&self, bond: &Bond<D>, (): &(), (): &()) -> [f64; D] {
        let strain = bond.strain();
        let tension = self.mean(bond.from, bond.to, |law| law.tension_at_strain(strain));
        let mut size = self.scale(bond) * tension;
        if let Some(soft) = &self.soft {
            let (softening, end) = soft.of_bond(bond.from, bond.to);
            size *= softening.integrity(bond.stretch(), end);
        }
        bond.direction().map(|x| size * x)
    }

    /// Σ_J kθ |ξ| φ w V_J, Eq. (2.39).
    fn energy(&self, family: &Family<D>, (): &()) -> f64 {
        let energy = |bond: &Bond<D>| match &self.soft {
            None => self.mean(bond.from, bond.to, |law| law.energy(bond.stretch())),
            Some(soft) => {
                let (softening, end) = soft.of_bond(bond.from, bond.to);
                softening.energy(&*self.law, bond.stretch(), end)
            }
        };
        self.modulus * family.sum(|bond| bond.weight * bond.length * energy(&bond))
    }

    /// Σ_J (2kθ w V_J/|ξ|)·max(|t′|, |t|/λ)(1 + max_{d≠e} |n_d n_e|).
    fn stiffness(&self, family: &Family<D>, _points: &[()]) -> f64 {
        self.modulus
            * family.sum(|bond| {
                let stretch = bond.stretch().max(f64::MIN_POSITIVE);
                let tangent = self.mean(bond.from, bond.to, |law| {
                    law.tension_derivative(stretch).abs().max(law.tension(stretch).abs() / stretch)
                });
                2.0 * bond.weight / bond.length * tangent * (1.0 + mixed(bond.direction()))
            })
    }

    fn micromodulus(&self, _bonds: &dyn BodyGeometry<D>) -> f64 {
        self.modulus * self.law.tangent() / 3.0
    }

    /// t′(1) of the law of a particle over that of the rest.
    fn relative_stiffness(&self, site: usize) -> f64 {
        self.mean(site, site, |law| law.tangent()) / self.law.tangent()
    }

    fn respond<'a>(self, _bonds: &dyn Bonds<D>) -> Box<dyn SolverMaterial<D> + 'a>
    where
        Self: 'a,
    {
        Box::new(BondKernels::new(self))
    }
}

/// max_{d≠e} |n_d n_e|.
pub(super) fn mixed<const D: usize>(n: [f64; D]) -> f64 {
    let pairs = (0..D).flat_map(|d| (0..d).map(move |e| (d, e)));
    pairs.map(|(d, e)| (n[d] * n[e]).abs()).fold(0.0, f64::max)
}
