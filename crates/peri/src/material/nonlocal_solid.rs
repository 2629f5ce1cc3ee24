//! Solids of the mean deformation of a family, with any Poisson ratio: correspondence and its stabilisation as one energy.

use super::cloud_passes::CloudPasses;
use super::eight_chain::{CRUSHED, cofactor};
use super::frequency::Reach;
use super::solid_passes::SolidPasses;
use super::tensor::{Tensor, embed, invert};
use super::{Body, Bond, Family, Material, Passes};
use crate::bonds::{Bonds, Columns, Kind};
use crate::calibrate::modulus_in;
use nalgebra::SVector;
use polycore::constitutive::Flags;
use std::sync::Arc;

/// The mean deformation of a family: with ω_IJ = V_J/(|ξ|² Σ_K V_K) over the whole family, I = Σ_J V_J/Σ_K V_K over the intact
/// bonds, M = Σ_J ω ξ⊗ξ/I and η = u_J − u_I.
#[derive(Clone, Copy, Debug)]
pub struct Deformation<const D: usize> {
    /// H = F − 1 = (Σ_J ω η⊗ξ/I) M⁻¹, and of a cloud the part of [`super::relief`].
    pub displacement_gradient: Tensor<D>,
    /// D Σ_J ω|ζ − Fξ|²/I, F without that part: the part of the deformation that no gradient describes. 0 where it is homogeneous.
    pub residual: f64,
}

impl<const D: usize> Deformation<D> {
    /// F.
    pub fn gradient(&self) -> Tensor<D> {
        self.displacement_gradient + Tensor::identity()
    }

    /// J − 1 = det F − 1, which loses no digits at small strains.
    pub fn volume_change(&self) -> f64 {
        let h = &self.displacement_gradient;
        let minor = |a: usize, b: usize| h[(a, a)] * h[(b, b)] - h[(a, b)] * h[(b, a)];
        if D == 2 {
            return h.trace() + minor(0, 1);
        }
        h.trace() + minor(0, 1) + minor(1, 2) + minor(0, 2) + embed(h, 1.0).determinant()
    }

    /// tr FᵀF − D + residual, which loses no digits at small strains.
    pub fn excess_trace(&self) -> f64 {
        2.0 * self.displacement_gradient.trace() + self.displacement_gradient.norm_squared() + self.residual
    }
}

/// What a solid does at a deformation.
#[derive(Clone, Copy, Debug)]
pub struct PointStress<const D: usize> {
    /// P = ∂W/∂F at a constant residual, Pa.
    pub piola: Tensor<D>,
    /// 2 ∂W/∂(residual), Pa: the shear modulus of the stabilisation.
    pub stabilisation: f64,
}

/// A solid whose energy follows from the mean deformation of a family. [`NonlocalSolid`] makes a material of it.
pub trait PointLaw<const D: usize>: Send + Sync {
    /// Energy density W, J/m³, 0 at rest.
    fn energy(&self, deformation: &Deformation<D>) -> f64;

    /// Stress. A deformation outside the law's domain gives values that are not finite; solvers report them.
    fn respond(&self, deformation: &Deformation<D>) -> PointStress<D>;

    /// A bound of ‖∂P/∂F‖₂, Pa.
    fn stiffness(&self, deformation: &Deformation<D>) -> f64;

    /// κ = 4 W_SS ≥ 0, Pa, of a law whose W depends on tr FᵀF + residual alone: `stiffness` holds the residual constant, and a
    /// change of both takes κ(F:δF + ½δ residual)² in all. 0 where W is linear in the residual.
    fn residual_stiffness(&self, deformation: &Deformation<D>) -> f64 {
        let _ = deformation;
        0.0
    }

    /// Shear modulus at rest, Pa.
    fn shear_modulus(&self) -> f64;

    /// Bulk modulus at rest, Pa; 0 in plane stress, where the thickness gives way.
    fn bulk_modulus(&self) -> f64;

    /// Stretch λ₃ of the thickness in plane stress; 1 elsewhere.
    fn thickness_stretch(&self, deformation: &Deformation<D>) -> f64 {
        let _ = deformation;
        1.0
    }

    /// Why the answer of a law learnt from data is uncertain; nothing of other laws.
    fn flags(&self, deformation: &Deformation<D>) -> Flags {
        let _ = deformation;
        Flags::default()
    }

    /// U and U′ at J = 1 + `change` of the part U(J) of W that is to depend on J averaged over nearest neighbours instead, on a lattice;
    /// `None`: no part.
    fn filtered(&self, change: f64) -> Option<[f64; 2]> {
        let _ = change;
        None
    }
}

impl<L: PointLaw<D> + ?Sized, const D: usize> PointLaw<D> for Arc<L> {
    fn energy(&self, deformation: &Deformation<D>) -> f64 {
        (**self).energy(deformation)
    }
    fn respond(&self, deformation: &Deformation<D>) -> PointStress<D> {
        (**self).respond(deformation)
    }
    fn stiffness(&self, deformation: &Deformation<D>) -> f64 {
        (**self).stiffness(deformation)
    }
    fn residual_stiffness(&self, deformation: &Deformation<D>) -> f64 {
        (**self).residual_stiffness(deformation)
    }
    fn shear_modulus(&self) -> f64 {
        (**self).shear_modulus()
    }
    fn bulk_modulus(&self) -> f64 {
        (**self).bulk_modulus()
    }
    fn thickness_stretch(&self, deformation: &Deformation<D>) -> f64 {
        (**self).thickness_stretch(deformation)
    }
    fn flags(&self, deformation: &Deformation<D>) -> Flags {
        (**self).flags(deformation)
    }
    fn filtered(&self, change: f64) -> Option<[f64; 2]> {
        (**self).filtered(change)
    }
}

/// A solid of [`PointLaw`] as a material: W_I = I W(F, residual), an exact variation for any law, whose bonds
/// carry T_IJ = ω (A ζ + Q ξ) with A = D G, Q = P M⁻¹ − D G F and G = [`PointStress::stabilisation`]. A homogeneous deformation
/// gives its exact P in every particle, at edges too; bonds are not parallel to their forces.
///
/// Where too few bonds are left (D λ_min(M) ≤ 0.1) a particle has springs of the same shear modulus instead,
/// W_I = ½D(D + 2)μ Σ_J ω(|ζ| − |ξ|)². The guide (*Solids with any Poisson ratio*) has more; the stabilisation is that of
/// Silling 2017, doi:10.1016/j.cma.2017.03.043.
///
/// On an irregular cloud with [`super::relief`] F has one more term, Σ_J ω ζ⊗z(θ)/I with z(θ) = θ_J − θ_I − G ξ, G = Σ_J ω (θ_J − θ_I)⊗ξ M⁻¹/I,
/// and T_IJ gains ω P z(θ): uniform stress is in equilibrium.
#[derive(Clone, Debug)]
pub struct NonlocalSolid<L>(pub L);

/// D λ_min(M) below which a family has no deformation gradient. Intact corners have 0.50 and more.
pub(super) const LEAST_SHAPE: f64 = 0.1;

/// (|q̂|δ)² of the largest gradient that particles one spacing apart feel: 2.69 to 3.09 for δ of 2 to 6 spacings.
pub(super) const GRADIENT: f64 = 3.1;

/// What a particle knows of its family.
#[derive(Clone, Debug)]
pub struct Point<const D: usize> {
    /// Σ_J V_J of the whole family, m³, and of the intact bonds that `inverse` and `shape` belong to.
    pub(super) whole: f64,
    pub(super) intact: f64,
    /// M⁻¹.
    pub(super) inverse: Tensor<D>,
    /// D λ_min(M).
    pub(super) shape: f64,
    pub(super) deformation: Deformation<D>,
    /// What [`super::filter`] adds to W and ∂W/∂J; 0 without.
    pub(super) filtered: [f64; 2],
    /// A, Q + A 1, both over Σ_J V_J, and the stiffness of the springs over it, Pa/m³.
    pub(super) slope: f64,
    stress: Tensor<D>,
    pub(super) spring: f64,
    /// The particle's own part in the bound of the stiffness, N/m⁴.
    own: f64,
    /// What the bound of the frequency needs, see [`super::frequency`].
    pub(super) reach: Reach,
    /// Where bonds have θ.
    relief: Option<Box<Relieved<D>>>,
}

/// What θ adds to a particle.
#[derive(Clone, Debug)]
struct Relieved<const D: usize> {
    /// G = Σ_J ω (θ_J − θ_I)⊗ξ M⁻¹/I.
    gradient: Tensor<D>,
    /// Σ_J ω ζ⊗z(θ)/I, a part of the displacement gradient.
    part: Tensor<D>,
    /// P over Σ_J V_J, Pa/m³.
    piola: Tensor<D>,
}

impl<const D: usize> Default for Point<D> {
    fn default() -> Self {
        let zero = Tensor::zeros();
        Self {
            whole: 0.0,
            intact: 0.0,
            inverse: zero,
            shape: 0.0,
            deformation: Deformation { displacement_gradient: zero, residual: 0.0 },
            filtered: [0.0; 2],
            slope: 0.0,
            stress: zero,
            spring: 0.0,
            own: 0.0,
            reach: Reach::default(),
            relief: None,
        }
    }
}

impl<const D: usize> Point<D> {
    /// Σ_J V_J, M⁻¹ and D λ_min(M) of the intact bonds.
    pub(super) fn reshape(&mut self, family: &Family<D>) {
        let (mut shape, mut shifted, mut intact) = (Tensor::<D>::zeros(), Tensor::<D>::zeros(), 0.0);
        let relieved = self.relief.is_some();
        family.each(|bond| {
            let share = bond.volume / (bond.length * bond.length);
            intact += bond.volume;
            shape += Tensor::from_fn(|a, b| share * bond.reference[a] * bond.reference[b]);
            if relieved {
                shifted += Tensor::from_fn(|a, b| share * bond.relief[a] * bond.reference[b]);
            }
        });
        self.intact = intact;
        self.reach.forget();
        let (inverse, least) = if intact > 0.0 { invert(&(shape / intact)) } else { (shape, 0.0) };
        (self.inverse, self.shape) = (inverse, D as f64 * least);
        if let Some(relief) = &mut self.relief {
            relief.gradient = if intact > 0.0 { shifted / intact * inverse } else { shifted };
        }
    }

    /// Whether the intact bonds span space.
    pub(super) fn has_gradient(&self) -> bool {
        self.shape > LEAST_SHAPE
    }

    /// A/Σ_K V_K and (Q + A 1)/Σ_K V_K, rows first.
    pub(super) fn terms(&self) -> impl Iterator<Item = f64> + '_ {
        let stress = (0..D * D).map(|k| self.stress[(k / D, k % D)]);
        std::iter::once(self.slope).chain(stress)
    }

    /// The same for the kernels of clouds; of a particle with θ, P/Σ_K V_K as well.
    pub(super) fn fill(&self, terms: &mut [Columns<D>]) {
        let tensors = std::iter::once(&self.stress).chain(self.relief.as_ref().map(|relief| &relief.piola));
        for (columns, tensor) in terms.iter_mut().zip(tensors) {
            (0..D).for_each(|b| (0..D).for_each(|a| columns[b][a] = tensor[(a, b)]));
        }
        terms[0][0][3] = self.slope;
    }

    /// A η + (Q + A 1) ξ + P (θ_J − θ_I), over Σ_K V_K, of both ends, Pa/m²: |ξ|² times the force density without springs.
    pub(super) fn linear(&self, other: &Self, bond: &Bond<D>) -> [f64; D] {
        let slope = self.slope + other.slope;
        let relief =
            self.relief.as_ref().zip(other.relief.as_ref()).map_or([0.0; D], |(own, other)| {
                ((own.piola + other.piola) * SVector::from(bond.relief)).into()
            });
        std::array::from_fn(|a| {
            let stress = (0..D).map(|b| (self.stress[(a, b)] + other.stress[(a, b)]) * bond.reference[b]);
            slope * bond.change[a] + stress.sum::<f64>() + relief[a]
        })
    }

    /// Force density of the springs of both ends, N/m⁶.
    pub(super) fn pull(&self, other: &Self, bond: &Bond<D>) -> [f64; D] {
        let spring = self.spring + other.spring;
        if spring <= 0.0 {
            return [0.0; D];
        }
        let size = spring * bond.strain() / bond.length;
        bond.direction().map(|x| size * x)
    }

    /// The part of a bond's force density that is its own, T_IJ/V_J.
    pub fn own_force(&self, bond: &Bond<D>) -> [f64; D] {
        let nothing = Self::default();
        let (linear, pull) = (self.linear(&nothing, bond), self.pull(&nothing, bond));
        let relief =
            self.relief.as_ref().map_or(SVector::zeros(), |own| own.piola * SVector::from(bond.relief));
        let unit = 1.0 / (bond.length * bond.length);
        std::array::from_fn(|a| unit * (linear[a] + relief[a]) + pull[a])
    }

    /// The mean deformation; `None` where too few bonds are left.
    pub fn deformation(&self) -> Option<&Deformation<D>> {
        self.has_gradient().then_some(&self.deformation)
    }

    /// Stress of a law at the mean deformation.
    pub fn respond(&self, law: &(impl PointLaw<D> + ?Sized)) -> PointStress<D> {
        let mut found = law.respond(&self.deformation);
        if self.filtered[1] != 0.0 {
            found.piola += cofactor(&self.deformation.gradient()) * self.filtered[1];
        }
        found
    }

    /// Energy density of a law at the mean deformation, J/m³; `None` where too few bonds are left.
    pub fn energy(&self, law: &(impl PointLaw<D> + ?Sized)) -> Option<f64> {
        Some(law.energy(self.deformation()?) + self.filtered[0])
    }

    /// I: the part of the family that is intact, 0 to 1.
    pub fn integrity(&self) -> f64 {
        if self.whole > 0.0 { self.intact / self.whole } else { 0.0 }
    }
}

impl<L: PointLaw<D>, const D: usize> Material<D> for NonlocalSolid<L> {
    type Point = Point<D>;

    fn begin(&self, family: &Family<D>) -> Point<D> {
        let zero = Tensor::zeros();
        let relief = || Box::new(Relieved { gradient: zero, part: zero, piola: zero });
        let relief = family.is_relieved().then(relief);
        Point { whole: family.sum(|bond| bond.volume), relief, ..Point::default() }
    }

    fn prepare(&self, family: &Family<D>, point: &mut Point<D>) {
        let (mut moment, mut intact, mut square) = (Tensor::<D>::zeros(), 0.0, 0.0);
        let (relieved, mut shifted) = (point.relief.is_some(), Tensor::<D>::zeros());
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
            self.deform(point, moment, shifted, square);
            self.answer(point);
        } else {
            self.spring(point);
        }
    }

    fn stiffen(&self, family: &Family<D>, point: &mut Point<D>) {
        let squares = family.sum(|bond| bond.volume / (bond.length * bond.length));
        point.own = if !point.has_gradient() {
            4.0 * point.spring * squares
        } else {
            // Σ_J ω 2(1 − cos kξ) is at most 2.6 (2D) or 2.4 (3D) Σ_J ω in all lattices
            let springs = if D == 2 { 2.6 } else { 2.4 } * point.slope * squares;
            let shear = point.slope * point.whole / D as f64;
            let gradient = self.0.stiffness(&point.deformation) - shear;
            // λ_max(M⁻¹)/D = 1/(D λ_min(M))
            let reach = GRADIENT.sqrt() / (family.horizon() * point.shape);
            springs + if gradient < 0.0 { 0.0 } else { point.integrity() * gradient * reach * reach }
        };
    }

    /// T_IJ/V_J = (A ζ + Q ξ + P (θ_J − θ_I))/(|ξ|² Σ_K V_K) of both ends, with ζ = ξ + η.
    fn force(&self, bond: &Bond<D>, own: &Point<D>, other: &Point<D>) -> [f64; D] {
        let (linear, pull) = (own.linear(other, bond), own.pull(other, bond));
        let unit = 1.0 / (bond.length * bond.length);
        std::array::from_fn(|a| unit * linear[a] + pull[a])
    }

    /// W − ½Gr + [z·PM⁻¹ξ + ½ D G|z|²]/|ξ|² with z = ζ − Fξ; of springs their energy per share. With θ, C = Σ_J ω ζ⊗z(θ)/I:
    /// z = ζ − (F − C)ξ, and z·Pz(θ)/|ξ|² − P:C in addition.
    fn released_energy(&self, bond: &Bond<D>, own: &Point<D>, weighed: f64) -> Option<f64> {
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
        if let Kind::Cloud(cloud) = bonds.kind() {
            return Some(Box::new(CloudPasses::new(cloud)));
        }
        // 1 + D², which a type cannot compute
        if D == 2 {
            SolidPasses::<D, 5>::new(bonds).map(|passes| Box::new(passes) as _)
        } else {
            SolidPasses::<D, 10>::new(bonds).map(|passes| Box::new(passes) as _)
        }
    }

    fn energy(&self, family: &Family<D>, point: &Point<D>) -> f64 {
        match point.deformation() {
            Some(_) => point.integrity() * point.energy(&self.0).unwrap_or(0.0),
            None => 0.5 * point.spring * family.sum(|bond| bond.volume * bond.strain().powi(2)),
        }
    }

    /// Half of 1.75 (2D) or 1 (3D) times the greatest part of a particle and its neighbours: 1.1 to 3 times the true bound on
    /// lattices and clouds.
    fn stiffness(&self, family: &Family<D>, points: &[Point<D>]) -> f64 {
        let mut most = points[family.site()].own;
        family.each(|bond| most = most.max(points[bond.to].own));
        0.5 * if D == 2 { 1.75 } else { 1.0 } * most
    }

    fn frequency_bound(&self, body: Body<D>, points: &mut [Point<D>], enough: f64) -> Option<f64> {
        Some(super::frequency::bound(&self.0, body, points, enough))
    }

    fn is_crushed(&self, point: &Point<D>) -> bool {
        let change = point.deformation().map_or(0.0, Deformation::volume_change);
        change.is_nan() || change < CRUSHED - 1.0
    }

    /// Of Young's modulus E ≈ 3μ.
    fn micromodulus(&self, bonds: &dyn Bonds<D>) -> f64 {
        modulus_in(bonds, 3.0 * self.0.shear_modulus())
    }

    /// ∂P₁₁/∂F₁₁ at rest, by a central difference: truncation and rounding are about 1e-10 of it.
    fn longitudinal_modulus(&self, _bonds: &dyn Bonds<D>) -> f64 {
        let at = |strain: f64| {
            let mut gradient = Tensor::<D>::zeros();
            gradient[(0, 0)] = strain;
            self.0.respond(&Deformation { displacement_gradient: gradient, residual: 0.0 }).piola[(0, 0)]
        };
        (at(1e-5) - at(-1e-5)) / 2e-5
    }

    /// Bonds of E = 3μ have λ = 1.2μ and K = 2μ in space and in plane strain.
    fn volumetric(&self) -> f64 {
        (self.0.bulk_modulus() - 2.0 * self.0.shear_modulus()).max(0.0)
    }
}

impl<L> NonlocalSolid<L> {
    /// Brings the deformation to Σ_J (V_J/|ξ|²) η⊗ξ, Σ_J (V_J/|ξ|²) η⊗(θ_J − θ_I) and Σ_J (V_J/|ξ|²)|η|² over the intact bonds.
    pub(super) fn deform<const D: usize>(
        &self,
        point: &mut Point<D>,
        moment: Tensor<D>,
        shifted: Tensor<D>,
        square: f64,
    ) {
        let (dimension, moment) = (D as f64, moment / point.intact);
        let gradient = moment * point.inverse;
        let residual = dimension * (square / point.intact - gradient.dot(&moment));
        // NaN stays: a state that is not finite is reported
        let residual = if residual < 0.0 { 0.0 } else { residual };
        point.deformation = Deformation { displacement_gradient: gradient, residual };
        if let Some(relief) = &mut point.relief {
            relief.part = shifted / point.intact - moment * relief.gradient.transpose();
            point.deformation.displacement_gradient += relief.part;
        }
    }

    /// What the law says of the deformation.
    pub(super) fn answer<const D: usize>(&self, point: &mut Point<D>)
    where
        L: PointLaw<D>,
    {
        let found = point.respond(&self.0);
        let relieved = point.relief.as_ref().map_or_else(Tensor::zeros, |relief| relief.part);
        let gradient = point.deformation.displacement_gradient - relieved;
        point.slope = D as f64 * found.stabilisation / point.whole;
        point.stress = found.piola * point.inverse / point.whole - gradient * point.slope;
        if let Some(relief) = &mut point.relief {
            relief.piola = found.piola / point.whole;
            point.stress -= relief.piola * relief.gradient;
        }
        point.spring = 0.0;
    }

    /// Springs in place of the law.
    pub(super) fn spring<const D: usize>(&self, point: &mut Point<D>)
    where
        L: PointLaw<D>,
    {
        let dimension = D as f64;
        let stiffness = dimension * (dimension + 2.0) * self.0.shear_modulus();
        (point.slope, point.stress) = (0.0, Tensor::zeros());
        if let Some(relief) = &mut point.relief {
            relief.piola = Tensor::zeros();
        }
        if point.whole > 0.0 {
            point.spring = stiffness / point.whole;
        }
    }
}
