//! Solids of the mean family deformation, with any Poisson ratio: correspondence and its stabilisation as one
//! energy.

use super::cloud_passes::CloudPasses;
use super::compression::CRUSH_LIMIT;
use super::past::Past;
use super::point::{GRADIENT, ReliefTerms, SolidPoint};
use super::point_law::{Deformation, PointLaw};
use super::solid_passes::SolidPasses;
use super::tensor::BodyTensor;
use super::{Bond, DeformedBody, Family, Material, Passes};
use crate::bonds::{BodyGeometry, BondKind, Bonds};
use crate::calibrate::modulus_in;
use crate::error::Error;
use nalgebra::SVector;
use std::sync::Arc;

/// Material of a [`PointLaw`]: W_I = I W(F, residual), an exact variation for any law, whose bonds carry
/// T_IJ = ω (A ζ + Q ξ) with A = D G, Q = P M⁻¹ − D G F and G = [`super::PointStress::stabilisation`]. A
/// homogeneous deformation gives its exact P in every particle, at edges too; bonds are not parallel to their
/// forces.
///
/// If too few bonds are left (D λ_min(M) ≤ 0.1) a particle has springs of the same shear modulus instead,
/// W_I = ½D(D + 2)μ Σ_J ω(|ζ| − |ξ|)². See the guide (*Solids with any Poisson ratio*); the stabilisation is
/// that of Silling 2017, doi:10.1016/j.cma.2017.03.043.
///
/// On an irregular cloud with [`super::relief`] F has one more term, Σ_J ω ζ⊗z(θ)/I with z(θ) = θ_J − θ_I − G
/// ξ, G = Σ_J ω (θ_J − θ_I)⊗ξ M⁻¹/I, and T_IJ gains ω P z(θ): uniform stress is in equilibrium.
///
/// Parts of the body may have laws of their own: each family has that of its particle, and a bond across the
/// border carries the force states of both.
#[derive(Clone, Debug)]
pub struct NonlocalSolid<L> {
    /// The law, and those of parts.
    laws: Vec<L>,
    /// Number of the law of each site; empty for one law.
    numbers: Arc<[u16]>,
}

impl<L> NonlocalSolid<L> {
    /// Creates a solid of one law.
    pub fn new(law: L) -> Self {
        Self { laws: vec![law], numbers: Arc::default() }
    }

    /// Gives parts of a body laws of their own: `numbers` are those of the laws by site, 0 for that of
    /// [`Self::new`], from 1 on for `laws`.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a number without a law.
    pub fn with_parts(mut self, laws: Vec<L>, numbers: Vec<u16>) -> Result<Self, Error> {
        self.laws.truncate(1);
        self.laws.extend(laws);
        if let Some(most) = numbers.iter().copied().max().filter(|&most| usize::from(most) >= self.laws.len())
        {
            let (name, allowed) = ("number of the law of a site", format!("below {}", self.laws.len()));
            return Err(Error::Parameter { name, found: f64::from(most), allowed });
        }
        self.numbers = numbers.into();
        Ok(self)
    }

    /// Applies a function to every law.
    pub fn map<M>(self, of: impl FnMut(L) -> M) -> NonlocalSolid<M> {
        NonlocalSolid { laws: self.laws.into_iter().map(of).collect(), numbers: self.numbers }
    }

    /// The laws, that of the rest first.
    pub fn laws(&self) -> &[L] {
        &self.laws
    }

    /// The law, that of the rest of a body with parts.
    pub fn law(&self) -> &L {
        &self.laws[0]
    }

    /// Law of the particle in a site.
    pub fn law_at(&self, site: usize) -> &L {
        &self.laws[usize::from(self.number(site))]
    }

    /// Law of the particle in a state.
    pub fn law_of<const D: usize>(&self, point: &SolidPoint<D>) -> &L {
        &self.laws[usize::from(point.law)]
    }

    fn number(&self, site: usize) -> u16 {
        self.numbers.get(site).copied().unwrap_or(0)
    }
}

/// ∂P₁₁/∂F₁₁ at rest, Pa, by a central difference: truncation and rounding are about 1e-10 of it.
fn longitudinal<const D: usize>(law: &impl PointLaw<D>) -> f64 {
    let at = |strain: f64| {
        let mut gradient = BodyTensor::<D>::zeros();
        gradient[(0, 0)] = strain;
        law.respond(&Deformation::homogeneous(gradient)).piola[(0, 0)]
    };
    (at(1e-5) - at(-1e-5)) / 2e-5
}

impl<L: PointLaw<D>, const D: usize> Material<D> for NonlocalSolid<L> {
    type Point = SolidPoint<D>;

    fn begin(&self, family: &Family<D>) -> SolidPoint<D> {
        let zero = BodyTensor::zeros();
        let relief = || Box::new(ReliefTerms { gradient: zero, part: zero, piola: zero });
        let relief = family.is_relieved().then(relief);
        let (whole, law) = (family.sum(|bond| bond.volume), self.number(family.site()));
        let mut point = SolidPoint { whole, law, relief, ..SolidPoint::default() };
        point.deformation.past = self.law_of(&point).past().map(Box::new);
        point
    }

    fn prepare(&self, family: &Family<D>, point: &mut SolidPoint<D>) {
        let (mut moment, mut intact, mut square) = (BodyTensor::<D>::zeros(), 0.0, 0.0);
        let (relieved, mut shifted) = (point.relief.is_some(), BodyTensor::<D>::zeros());
        family.each(|bond| {
            let share = bond.volume / (bond.length * bond.length);
            intact += bond.volume;
            for a in 0..D {
                let weighted = share * bond.change[a];
                square += weighted * bond.change[a];
                for b in 0..D {
                    moment[(a, b)] += weighted * bond.reference[b];
                }
                if relieved {
                    (0..D).for_each(|b| shifted[(a, b)] += weighted * bond.relief[b]);
                }
            }
        });
        if intact != point.intact {
            point.reshape(family);
        }
        if point.has_gradient() {
            point.deform(moment, shifted, square);
            point.answer(self.law_of(point));
        } else {
            point.spring(self.law_of(point));
        }
    }

    fn stiffen(&self, family: &Family<D>, point: &mut SolidPoint<D>) {
        let squares = family.sum(|bond| bond.volume / (bond.length * bond.length));
        point.own = if !point.has_gradient() {
            4.0 * point.spring * squares
        } else {
            // Σ_J ω 2(1 − cos kξ) is at most 2.6 (2D) or 2.4 (3D) Σ_J ω in all lattices
            let springs = if D == 2 { 2.6 } else { 2.4 } * point.steepest() * squares;
            let shear = point.slope * point.whole / D as f64;
            let gradient = self.law_of(point).stiffness(&point.deformation) - shear;
            // λ_max(M⁻¹)/D = 1/(D λ_min(M))
            let reach = GRADIENT.sqrt() / (family.horizon() * point.shape);
            springs + if gradient < 0.0 { 0.0 } else { point.integrity() * gradient * reach * reach }
        };
    }

    /// T_IJ/V_J = (A ζ + Q ξ + P (θ_J − θ_I))/(|ξ|² Σ_K V_K) of both ends, with ζ = ξ + η.
    fn force(&self, bond: &Bond<D>, own: &SolidPoint<D>, other: &SolidPoint<D>) -> [f64; D] {
        let (linear, pull) = (own.linear(other, bond), own.pull(other, bond));
        let unit = 1.0 / (bond.length * bond.length);
        std::array::from_fn(|a| unit * linear[a] + pull[a])
    }

    /// W − ½Gr + [z·PM⁻¹ξ + ½ D G|z|²]/|ξ|² with z = ζ − Fξ; for springs their energy per share. With θ, C =
    /// Σ_J ω ζ⊗z(θ)/I: z = ζ − (F − C)ξ, and z·Pz(θ)/|ξ|² − P:C in addition.
    fn released_energy(&self, bond: &Bond<D>, own: &SolidPoint<D>, weighed: f64) -> Option<f64> {
        let square = bond.length * bond.length;
        let Some(deformation) = own.deformation() else {
            return Some(0.5 * own.spring * own.whole * bond.strain().powi(2));
        };
        let reference = SVector::<f64, D>::from(bond.reference);
        let relief = own.relief.as_ref();
        let gradient = relief.map_or(deformation.displacement_gradient, |relief| {
            deformation.displacement_gradient - relief.part
        });
        let z = SVector::<f64, D>::from(bond.change) - gradient * reference;
        // A = D G, and P (M⁻¹ − G_θ) with G_θ the gradient of θ
        let slope = own.slope * own.whole;
        let piola = own.stress * own.whole + gradient * slope;
        let mut own_part = z.dot(&(piola * reference)) + 0.5 * slope * z.norm_squared();
        let mut energy = weighed / own.integrity() - 0.5 * slope / D as f64 * deformation.residual;
        if let Some(relief) = relief {
            own_part += z.dot(&(relief.piola * SVector::from(bond.relief))) * own.whole;
            energy -= relief.piola.dot(&relief.part) * own.whole;
        }
        Some(energy + own_part / square)
    }

    fn passes(&self, bonds: &dyn Bonds<D>) -> Option<Box<dyn Passes<Self, D>>> {
        if let BondKind::Cloud(cloud) = bonds.kind() {
            return Some(Box::new(CloudPasses::new(cloud)));
        }
        // 1 + D², which a type cannot compute
        if D == 2 {
            SolidPasses::<D, 5>::new(bonds).map(|passes| Box::new(passes) as _)
        } else {
            SolidPasses::<D, 10>::new(bonds).map(|passes| Box::new(passes) as _)
        }
    }

    fn energy(&self, family: &Family<D>, point: &SolidPoint<D>) -> f64 {
        match point.deformation() {
            Some(_) => point.integrity() * point.energy(self.law_of(point)).unwrap_or(0.0),
            None => 0.5 * point.spring * family.sum(|bond| bond.volume * bond.strain().powi(2)),
        }
    }

    /// Half of 1.75 (2D) or 1 (3D) times the greatest share of a particle and its neighbours: 1.1 to 3 times
    /// the true bound on lattices and clouds.
    fn stiffness(&self, family: &Family<D>, points: &[SolidPoint<D>]) -> f64 {
        let mut most = points[family.site()].own;
        family.each(|bond| most = most.max(points[bond.to].own));
        0.5 * if D == 2 { 1.75 } else { 1.0 } * most
    }

    fn frequency_bound(
        &self,
        body: DeformedBody<D>,
        points: &mut [SolidPoint<D>],
        enough: f64,
    ) -> Option<f64> {
        Some(super::frequency::bound(self, body, points, enough))
    }

    fn past<'p>(&self, point: &'p mut SolidPoint<D>) -> Option<&'p mut Past> {
        point.deformation.past.as_deref_mut()
    }

    fn stabilise(&self, point: &mut SolidPoint<D>, duration: f64) {
        if point.has_gradient() {
            self.law_of(point).stabilise(&mut point.deformation, duration);
        }
    }

    fn advance(&self, point: &mut SolidPoint<D>) -> f64 {
        if !point.has_gradient() {
            return 0.0;
        }
        point.integrity() * self.law_of(point).advance(&mut point.deformation)
    }

    fn is_crushed(&self, point: &SolidPoint<D>) -> bool {
        let change = point.deformation().map_or(0.0, Deformation::volume_change);
        change.is_nan() || change < CRUSH_LIMIT - 1.0
    }

    /// Micromodulus for Young's modulus E ≈ 3μ.
    fn micromodulus(&self, bonds: &dyn BodyGeometry<D>) -> f64 {
        modulus_in(bonds, 3.0 * self.law().shear_modulus())
    }

    fn longitudinal_modulus(&self, _bonds: &dyn BodyGeometry<D>) -> f64 {
        longitudinal(self.law())
    }

    fn relative_stiffness(&self, site: usize) -> f64 {
        if self.number(site) == 0 { 1.0 } else { longitudinal(self.law_at(site)) / longitudinal(self.law()) }
    }

    /// Bonds of E = 3μ have λ = 1.2μ and K = 2μ in space and in plane strain.
    fn volumetric(&self) -> f64 {
        (self.law().bulk_modulus() - 2.0 * self.law().shear_modulus()).max(0.0)
    }
}
