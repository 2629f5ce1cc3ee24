//! Laws of the mean deformation of a family.

use super::past::Past;
use super::tensor::{BodyTensor, embed};
use polycore::constitutive::Flags;
use std::sync::Arc;

/// Mean deformation of a family: with ω_IJ = V_J/(|ξ|² Σ_K V_K) over the whole family, I = Σ_J V_J/Σ_K V_K
/// over the intact bonds, M = Σ_J ω ξ⊗ξ/I and η = u_J − u_I.
#[derive(Clone, Debug)]
pub struct Deformation<const D: usize> {
    /// H = F − 1 = (Σ_J ω η⊗ξ/I) M⁻¹, on clouds plus the part of [`super::relief`].
    pub displacement_gradient: BodyTensor<D>,
    /// D Σ_J ω|ζ − Fξ|²/I, F without that part: the part of the deformation that no gradient describes. 0 for
    /// a homogeneous deformation.
    pub residual: f64,
    /// History of the particle, for a law with a state.
    pub past: Option<Box<Past>>,
}

impl<const D: usize> Deformation<D> {
    /// Creates a homogeneous deformation H = F − 1 without a past.
    pub fn homogeneous(displacement_gradient: BodyTensor<D>) -> Self {
        Self { displacement_gradient, residual: 0.0, past: None }
    }

    /// F.
    pub fn gradient(&self) -> BodyTensor<D> {
        self.displacement_gradient + BodyTensor::identity()
    }

    /// J − 1 = det F − 1, exact to all digits at small strains.
    pub fn volume_change(&self) -> f64 {
        let h = &self.displacement_gradient;
        let minor = |a: usize, b: usize| h[(a, a)] * h[(b, b)] - h[(a, b)] * h[(b, a)];
        if D == 2 {
            return h.trace() + minor(0, 1);
        }
        h.trace() + minor(0, 1) + minor(1, 2) + minor(0, 2) + embed(h, 1.0).determinant()
    }

    /// tr FᵀF − D + residual, exact to all digits at small strains.
    pub fn excess_trace(&self) -> f64 {
        2.0 * self.displacement_gradient.trace() + self.displacement_gradient.norm_squared() + self.residual
    }
}

/// Stress of a solid at a deformation.
#[derive(Clone, Copy, Debug)]
pub struct PointStress<const D: usize> {
    /// P = ∂W/∂F at a constant residual, Pa.
    pub piola: BodyTensor<D>,
    /// 2 ∂W/∂(residual), Pa: the shear modulus of the stabilisation.
    pub stabilisation: f64,
}

/// A solid whose energy follows from the mean deformation of a family. [`super::NonlocalSolid`] makes it a
/// material.
pub trait PointLaw<const D: usize>: Send + Sync {
    /// Energy density W, J/m³, 0 at rest.
    fn energy(&self, deformation: &Deformation<D>) -> f64;

    /// Computes the stress. A deformation outside the law's domain gives values that are not finite; solvers
    /// report them.
    fn respond(&self, deformation: &Deformation<D>) -> PointStress<D>;

    /// Bound of ‖∂P/∂F‖₂, Pa.
    fn stiffness(&self, deformation: &Deformation<D>) -> f64;

    /// κ = 4 W_SS ≥ 0, Pa, of a law whose W depends only on tr FᵀF + residual: `stiffness` holds the residual
    /// constant, and a change of both takes κ(F:δF + ½δ residual)² in all. 0 if W is linear in the residual.
    fn residual_stiffness(&self, deformation: &Deformation<D>) -> f64 {
        let _ = deformation;
        0.0
    }

    /// Shear modulus at rest, Pa.
    fn shear_modulus(&self) -> f64;

    /// Bulk modulus at rest, Pa; 0 in plane stress, where the thickness adapts.
    fn bulk_modulus(&self) -> f64;

    /// Stretch λ₃ of the thickness in plane stress; 1 elsewhere.
    fn thickness_stretch(&self, deformation: &Deformation<D>) -> f64 {
        let _ = deformation;
        1.0
    }

    /// Reasons why a learnt law is uncertain here; none for other laws.
    fn flags(&self, deformation: &Deformation<D>) -> Flags {
        let _ = deformation;
        Flags::default()
    }

    /// U and U′ at J = 1 + `change` of the part U(J) of W to be averaged over nearest neighbours of a
    /// lattice; `None`: no part.
    fn filtered(&self, change: f64) -> Option<[f64; 2]> {
        let _ = change;
        None
    }

    /// History of a virgin particle; `None` for a law without a state. It then answers at a deformation with
    /// this history.
    fn past(&self) -> Option<Past> {
        None
    }

    /// Sets the stabilisation of a time step of this duration, s, at the deformation at its start.
    fn stabilise(&self, deformation: &mut Deformation<D>, duration: f64) {
        let _ = (deformation, duration);
    }

    /// Replaces the state of the history by that at the end of its step, which this deformation is; returns
    /// the energy dissipated in the step, J/m³.
    fn advance(&self, deformation: &mut Deformation<D>) -> f64 {
        let _ = deformation;
        0.0
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
    fn past(&self) -> Option<Past> {
        (**self).past()
    }
    fn stabilise(&self, deformation: &mut Deformation<D>, duration: f64) {
        (**self).stabilise(deformation, duration);
    }
    fn advance(&self, deformation: &mut Deformation<D>) -> f64 {
        (**self).advance(deformation)
    }
}
