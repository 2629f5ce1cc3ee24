//! Solids of the mean family deformation, with any Poisson ratio: correspondence and its stabilisation as one
//! energy.

use super::cloud_passes::CloudPasses;
use super::compression::CRUSH_LIMIT;
use super::past::Past;
use super::point::{GRADIENT, ReliefTerms, SolidPoint};
use super::point_law::{Deformation, NonlocalSolid, PointLaw};
use super::solid_passes::SolidPasses;
use super::tensor::BodyTensor;
use super::{Bond, DeformedBody, Family, Material, Passes};
use crate::bonds::{BodyGeometry, BondKind, Bonds};
use crate::calibrate::modulus_in;
use nalgebra::SVector;

impl<L: PointLaw<D>, const D: usize> Material<D> for NonlocalSolid<L> {
    type Point = SolidPoint<D>;

    fn begin(&self, family: &Family<D>) -> SolidPoint<D> {
        let zero = BodyTensor::zeros();
        let relief = || Box::new(ReliefTerms { gradient: zero, part: zero, piola: zero });
        let relief = family.is_relieved().then(relief);
        let mut point = SolidPoint { whole: family.sum(|bond| bond.volume), relief, ..SolidPoint::default() };
        point.deformation.past = self.0.past().map(Box::new);
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
            point.answer(&self.0);
        } else {
            point.spring(&self.0);
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
            let gradient = self.0.stiffness(&point.deformation) - shear;
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
            Some(_) => point.integrity() * point.energy(&self.0).unwrap_or(0.0),
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
        Some(super::frequency::bound(&self.0, body, points, enough))
    }

    fn past<'p>(&self, point: &'p mut SolidPoint<D>) -> Option<&'p mut Past> {
        point.deformation.past.as_deref_mut()
    }

    fn stabilise(&self, point: &mut SolidPoint<D>, duration: f64) {
        if point.has_gradient() {
            self.0.stabilise(&mut point.deformation, duration);
        }
    }

    fn advance(&self, point: &mut SolidPoint<D>) -> f64 {
        if !point.has_gradient() {
            return 0.0;
        }
        point.integrity() * self.0.advance(&mut point.deformation)
    }

    fn is_crushed(&self, point: &SolidPoint<D>) -> bool {
        let change = point.deformation().map_or(0.0, Deformation::volume_change);
        change.is_nan() || change < CRUSH_LIMIT - 1.0
    }

    /// Micromodulus for Young's modulus E ≈ 3μ.
    fn micromodulus(&self, bonds: &dyn BodyGeometry<D>) -> f64 {
        modulus_in(bonds, 3.0 * self.0.shear_modulus())
    }

    /// ∂P₁₁/∂F₁₁ at rest, by a central difference: truncation and rounding are about 1e-10 of it.
    fn longitudinal_modulus(&self, _bonds: &dyn BodyGeometry<D>) -> f64 {
        let at = |strain: f64| {
            let mut gradient = BodyTensor::<D>::zeros();
            gradient[(0, 0)] = strain;
            self.0.respond(&Deformation::homogeneous(gradient)).piola[(0, 0)]
        };
        (at(1e-5) - at(-1e-5)) / 2e-5
    }

    /// Bonds of E = 3μ have λ = 1.2μ and K = 2μ in space and in plane strain.
    fn volumetric(&self) -> f64 {
        (self.0.bulk_modulus() - 2.0 * self.0.shear_modulus()).max(0.0)
    }
}
