//! What acts between the particles of a body: one trait, which bond laws and state-based materials implement,
//! inside this crate and outside of it.
//!
//! A material has two passes over every displacement. The first, [`Material::prepare`], fills the state of
//! each particle from its whole family; the second, [`Material::force`], takes the force of each bond from
//! the states of both ends. Bond laws need no state: their `Point` is `()`, the first pass does not exist,
//! and the second runs in the vectorised kernels of [`crate::bonds`].
//!
//! Solvers know a material as a [`Response`], which [`Material::respond`] makes of it: forces by work items,
//! the energy, bounds of the stiffness. A material of the first kind needs no word about them.

mod affine;
mod bonded;
mod cloud_passes;
mod constitutive;
mod crushed;
mod eight_chain;
mod family;
mod filter;
mod frequency;
mod levels;
mod nonlocal_solid;
mod point;
mod point_law;
mod pointwise;
mod prestrained;
mod relief;
mod response;
mod softened;
mod solid_passes;
mod strength;
mod tensor;
mod traction;

pub use affine::{Affine, AffinePoint};
pub use bonded::BondMaterial;
pub use constitutive::Correspondence;
pub use eight_chain::EightChain;
pub use family::{Bond, Family};
pub use point::Point;
pub use point_law::{Deformation, NonlocalSolid, PointLaw, PointStress};
pub use pointwise::{Passes, Pointwise};
pub use prestrained::Prestrained;
pub use relief::relief;
pub use response::{LawCover, LawRange, Response};
pub use strength::energy_at_strength;
pub use tensor::Tensor;
pub use traction::surface_load;

pub use crate::bonds::Property;

use crate::bonds::{BodyGeometry, Bonds};
use crate::calibrate::{Space, modulus_in, stiffness_1111};
use crate::field::Field;

/// A body in a state: its bonds and displacement.
pub type Body<'a, const D: usize> = (&'a dyn BodyGeometry<D>, &'a Field<D>);

/// A material: the forces between particles follow from an energy E = Σ_I V_I W_I.
///
/// With the force state τ_IJ = ∂W_I/∂ζ_IJ/V_J of particle I, N/m⁶, the force density on it is
/// Σ_J (τ_IJ − τ_JI) V_J, Silling et al. 2007, doi:10.1007/s10659-007-9125-1. A bond that is broken belongs
/// to no family.
pub trait Material<const D: usize>: Send + Sync {
    /// What a particle knows of its family: filled by [`Self::prepare`] before each pass over the bonds; `()`
    /// for bond laws.
    ///
    /// A run that resumes from a checkpoint computes it again: it must follow from the body as it was built,
    /// the displacement and the intact bonds alone, and from no history.
    type Point: Default + Clone + Send + Sync;

    /// The state of a particle of the body as it was built, before any bond breaks: what refers to the whole
    /// family, such as weighted volumes. Called once, with a displacement of zero.
    fn begin(&self, family: &Family<D>) -> Self::Point {
        let _ = family;
        Self::Point::default()
    }

    /// The first pass: brings the state of a particle to the present displacement of its family.
    fn prepare(&self, family: &Family<D>, point: &mut Self::Point) {
        let _ = (family, point);
    }

    /// What bounds the stiffness, and is the same for all bonds of a particle: called for every particle
    /// before [`Self::stiffness`], after [`Self::prepare`].
    fn stiffen(&self, family: &Family<D>, point: &mut Self::Point) {
        let _ = (family, point);
    }

    /// The second pass: τ_IJ − τ_JI, N/m⁶, the force density on particle I = `bond.from` per volume of J =
    /// `bond.to`.
    ///
    /// Exchanging both ends must turn its sign and nothing else, or momentum is not conserved.
    fn force(&self, bond: &Bond<D>, own: &Self::Point, other: &Self::Point) -> [f64; D];

    /// Energy density W_I of a particle, J/m³.
    fn energy(&self, family: &Family<D>, point: &Self::Point) -> f64;

    /// Energy that breaking a bond releases at its first end, over the bond's share V_J/Σ_K V_K of the family
    /// and the particle's volume, J/m³: −(∂E/∂d_IJ)/(V_I ŵ_IJ) of a bond of integrity d. `weighed` is
    /// [`Self::energy`] of the particle. `None` for materials whose bonds break at a stretch only.
    fn released_energy(&self, bond: &Bond<D>, own: &Self::Point, weighed: f64) -> Option<f64> {
        let _ = (bond, own, weighed);
        None
    }

    /// A bound s_I of the stiffness, N/m⁴, with K ≤ 2 Σ_I s_I V_I for the Hessian K = ∂²E/∂u² of the present
    /// displacement. Half the sum of absolute values in the rows ∂f_I/∂u is one (Gershgorin).
    ///
    /// From it follow the fictitious mass of dynamic relaxation, the local part of the preconditioner and the
    /// bound ω² ≤ 2s/ρ of the time step. `points` are the states of all sites: of the particle,
    /// `points[family.site()]`, and of its neighbours.
    fn stiffness(&self, family: &Family<D>, points: &[Self::Point]) -> f64;

    /// A bound of ρω², N/m⁴, of all oscillations about the present displacement, for explicit dynamics, which
    /// asks for it every few steps: cheaper and sharper than twice the greatest [`Self::stiffness`], which is
    /// taken where there is none. Where it is below `enough`, `enough` will do. `points` are the states of
    /// all sites.
    fn frequency_bound(&self, body: Body<D>, points: &mut [Self::Point], enough: f64) -> Option<f64> {
        let _ = (body, points, enough);
        None
    }

    /// Whether the intact bonds of a particle describe a deformation that crushes it to nothing or turns it
    /// inside out: few bonds that are left by a break may. Explicit dynamics then break these, too.
    fn is_crushed(&self, point: &Self::Point) -> bool {
        let _ = point;
        false
    }

    /// kθ, N/m⁶, of linear bonds t = 3kθ(λ − 1) that are about as stiff, see
    /// [`crate::calibrate::modulus_in`]: the scale of forces, of first guesses and of the preconditioner's
    /// coarse level. Equilibria do not depend on it.
    fn micromodulus(&self, bonds: &dyn BodyGeometry<D>) -> f64;

    /// Lamé's λ, Pa, in addition to that of bonds of [`Self::micromodulus`], for the preconditioner's coarse
    /// level: a solid of large bulk modulus needs it for fast solutions, not for right ones.
    fn volumetric(&self) -> f64 {
        0.0
    }

    /// Longitudinal modulus C₁₁₁₁ at rest, Pa, which scales contact; default: that of bonds of
    /// [`Self::micromodulus`], and [`Self::volumetric`].
    fn longitudinal_modulus(&self, bonds: &dyn BodyGeometry<D>) -> f64 {
        let space = if D == 2 { Space::PlaneStress } else { Space::Solid };
        let youngs_modulus = self.micromodulus(bonds) / modulus_in(bonds, 1.0);
        stiffness_1111(space, youngs_modulus) + self.volumetric()
    }

    /// The stretch λ* at which a bond is at rest; it breaks at a multiple of it.
    fn rest(&self, bond: &Bond<D>) -> f64 {
        let _ = bond;
        1.0
    }

    /// A lower bound of [`Self::rest`]; 1 where all bonds are at rest as the body was built.
    fn least_rest(&self) -> f64 {
        1.0
    }

    /// Faster passes over a body than bond by bond, where there are any.
    fn passes(&self, bonds: &dyn Bonds<D>) -> Option<Box<dyn Passes<Self, D>>> {
        let _ = bonds;
        None
    }

    /// The material at work in a body. The default loops over bonds as [`Self::force`] says.
    fn respond<'a>(self, bonds: &dyn Bonds<D>) -> Box<dyn Response<D> + 'a>
    where
        Self: Sized + 'a,
    {
        Box::new(Pointwise::new(self, bonds))
    }
}
