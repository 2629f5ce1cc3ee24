//! Particle states of a [`super::NonlocalSolid`].

use super::family::{Bond, Family};
use super::point_law::{Deformation, PointLaw, PointStress};
use super::tensor::{BodyTensor, cofactor, invert};
use crate::bonds::MomentColumns;
use nalgebra::SVector;

/// D λ_min(M) below which a family has no deformation gradient. Intact corners have at least 0.50.
pub(super) const LEAST_SHAPE: f64 = 0.1;

/// (|q̂|δ)² of the largest gradient that particles one spacing apart feel: 2.69 to 3.09 for δ of 2 to 6
/// spacings.
pub(super) const GRADIENT: f64 = 3.1;

/// State of a particle's family.
#[derive(Clone, Debug)]
pub struct SolidPoint<const D: usize> {
    /// Σ_J V_J of the whole family, m³, and of the intact bonds of `inverse` and `shape`.
    pub(super) whole: f64,
    pub(super) intact: f64,
    /// M⁻¹.
    pub(super) inverse: BodyTensor<D>,
    /// D λ_min(M).
    pub(super) shape: f64,
    pub(super) deformation: Deformation<D>,
    /// Number of the particle's law.
    pub(super) law: u16,
    /// Contributions of [`super::filter`] to W and ∂W/∂J; 0 without.
    pub(super) filtered: [f64; 2],
    /// A and Q + A 1, both over Σ_J V_J, and the stiffness of the springs over Σ_J V_J, Pa/m³.
    pub(super) slope: f64,
    pub(super) stress: BodyTensor<D>,
    pub(super) spring: f64,
    /// Share of the particle in the bound of the stiffness, N/m⁴.
    pub(super) own: f64,
    /// Terms of the frequency bound, see [`super::frequency`].
    pub(super) reach: FrequencyTerms,
    /// Correction by θ, if bonds have one.
    pub(super) relief: Option<Box<ReliefTerms<D>>>,
}

/// Correction of a particle by θ.
#[derive(Clone, Debug)]
pub(super) struct ReliefTerms<const D: usize> {
    /// G = Σ_J ω (θ_J − θ_I)⊗ξ M⁻¹/I.
    pub(super) gradient: BodyTensor<D>,
    /// Σ_J ω ζ⊗z(θ)/I, a part of the displacement gradient.
    pub(super) part: BodyTensor<D>,
    /// P over Σ_J V_J, Pa/m³.
    pub(super) piola: BodyTensor<D>,
}

impl<const D: usize> Default for SolidPoint<D> {
    fn default() -> Self {
        let zero = BodyTensor::zeros();
        Self {
            whole: 0.0,
            intact: 0.0,
            inverse: zero,
            shape: 0.0,
            deformation: Deformation::homogeneous(zero),
            law: 0,
            filtered: [0.0; 2],
            slope: 0.0,
            stress: zero,
            spring: 0.0,
            own: 0.0,
            reach: FrequencyTerms::default(),
            relief: None,
        }
    }
}

impl<const D: usize> SolidPoint<D> {
    /// Computes Σ_J V_J, M⁻¹ and D λ_min(M) of the intact bonds.
    pub(super) fn reshape(&mut self, family: &Family<D>) {
        let (mut shape, mut shifted, mut intact) = (BodyTensor::<D>::zeros(), BodyTensor::<D>::zeros(), 0.0);
        let relieved = self.relief.is_some();
        family.each(|bond| {
            let share = bond.volume / (bond.length * bond.length);
            intact += bond.volume;
            shape += BodyTensor::from_fn(|a, b| share * bond.reference[a] * bond.reference[b]);
            if relieved {
                shifted += BodyTensor::from_fn(|a, b| share * bond.relief[a] * bond.reference[b]);
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

    /// Returns true if the intact bonds span space.
    pub(super) fn has_gradient(&self) -> bool {
        self.shape > LEAST_SHAPE
    }

    /// A/Σ_K V_K and (Q + A 1)/Σ_K V_K, row by row.
    pub(super) fn terms(&self) -> impl Iterator<Item = f64> + '_ {
        let stress = (0..D * D).map(|k| self.stress[(k / D, k % D)]);
        std::iter::once(self.slope).chain(stress)
    }

    /// Writes the same terms for the cloud kernels; for a particle with θ, also P/Σ_K V_K.
    pub(super) fn fill(&self, terms: &mut [MomentColumns<D>]) {
        let tensors = std::iter::once(&self.stress).chain(self.relief.as_ref().map(|relief| &relief.piola));
        for (columns, tensor) in terms.iter_mut().zip(tensors) {
            (0..D).for_each(|b| (0..D).for_each(|a| columns[b][a] = tensor[(a, b)]));
        }
        terms[0][0][3] = self.slope;
    }

    /// Computes A η + (Q + A 1) ξ + P (θ_J − θ_I), over Σ_K V_K, of both ends, Pa/m²: |ξ|² times the force
    /// density without springs.
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

    /// Own part T_IJ/V_J of a bond's force density.
    pub fn own_force(&self, bond: &Bond<D>) -> [f64; D] {
        let nothing = Self::default();
        let (linear, pull) = (self.linear(&nothing, bond), self.pull(&nothing, bond));
        let relief =
            self.relief.as_ref().map_or(SVector::zeros(), |own| own.piola * SVector::from(bond.relief));
        let unit = 1.0 / (bond.length * bond.length);
        std::array::from_fn(|a| unit * (linear[a] + relief[a]) + pull[a])
    }

    /// Sets the deformation from Σ_J (V_J/|ξ|²) η⊗ξ, Σ_J (V_J/|ξ|²) η⊗(θ_J − θ_I) and Σ_J (V_J/|ξ|²)|η|² over
    /// the intact bonds.
    pub(super) fn deform(&mut self, moment: BodyTensor<D>, shifted: BodyTensor<D>, square: f64) {
        let (dimension, moment) = (D as f64, moment / self.intact);
        let gradient = moment * self.inverse;
        let residual = dimension * (square / self.intact - gradient.dot(&moment));
        // NaN stays: a state that is not finite is reported
        let residual = if residual < 0.0 { 0.0 } else { residual };
        (self.deformation.displacement_gradient, self.deformation.residual) = (gradient, residual);
        if let Some(relief) = &mut self.relief {
            relief.part = shifted / self.intact - moment * relief.gradient.transpose();
            self.deformation.displacement_gradient += relief.part;
        }
    }

    /// Evaluates a law at the deformation.
    pub(super) fn answer(&mut self, law: &(impl PointLaw<D> + ?Sized)) {
        let found = self.respond(law);
        let relieved = self.relief.as_ref().map_or_else(BodyTensor::zeros, |relief| relief.part);
        let gradient = self.deformation.displacement_gradient - relieved;
        self.slope = D as f64 * found.stabilisation / self.whole;
        self.stress = found.piola * self.inverse / self.whole - gradient * self.slope;
        if let Some(relief) = &mut self.relief {
            relief.piola = found.piola / self.whole;
            self.stress -= relief.piola * relief.gradient;
        }
        self.spring = 0.0;
    }

    /// Greatest slope of the stabilisation: that of `slope`, or of all of a history.
    pub(super) fn steepest(&self) -> f64 {
        let history = self.deformation.past.as_ref().map_or(0.0, |past| past.stabilisation);
        self.slope.max(D as f64 * history / self.whole)
    }

    /// Replaces the law by springs.
    pub(super) fn spring(&mut self, law: &(impl PointLaw<D> + ?Sized)) {
        let dimension = D as f64;
        let stiffness = dimension * (dimension + 2.0) * law.shear_modulus();
        (self.slope, self.stress) = (0.0, BodyTensor::zeros());
        if let Some(relief) = &mut self.relief {
            relief.piola = BodyTensor::zeros();
        }
        if self.whole > 0.0 {
            self.spring = stiffness / self.whole;
        }
    }

    /// Mean deformation; `None` if too few bonds are left.
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

    /// Energy density of a law at the mean deformation, J/m³; `None` if too few bonds are left.
    pub fn energy(&self, law: &(impl PointLaw<D> + ?Sized)) -> Option<f64> {
        Some(law.energy(self.deformation()?) + self.filtered[0])
    }

    /// I: intact fraction of the family, 0 to 1.
    pub fn integrity(&self) -> f64 {
        if self.whole > 0.0 { self.intact / self.whole } else { 0.0 }
    }
}

/// Terms of a particle in the frequency bound, see [`super::frequency`].
#[derive(Clone, Copy, Debug)]
pub(super) struct FrequencyTerms {
    /// R and b, 1/m, and Σ_J V_J/|ξ|² of the intact bonds, m; NaN until computed.
    pub(super) size: f64,
    pub(super) own: f64,
    pub(super) squares: f64,
    /// R if all neighbours are such particles: larger than R if few bonds are left.
    pub(super) among: f64,
    /// WAVES·a, Pa/m, and A of the springs including the residual's part, over Σ_K V_K.
    pub(super) front: f64,
    pub(super) slope: f64,
}

impl Default for FrequencyTerms {
    fn default() -> Self {
        Self { size: f64::NAN, own: f64::NAN, squares: f64::NAN, among: f64::NAN, front: 0.0, slope: 0.0 }
    }
}

impl FrequencyTerms {
    /// Marks the terms as outdated after bonds have changed.
    pub fn forget(&mut self) {
        self.size = f64::NAN;
    }
}
