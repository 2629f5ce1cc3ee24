//! Materials: one trait for all forces between particles, implemented by bond laws and state-based materials,
//! inside and outside this crate.
//!
//! A material has two passes over every displacement. The first, [`Material::prepare`], fills the state of
//! each particle from its whole family; the second, [`Material::force`], computes the force of each bond from
//! the states of both ends. Bond laws need no state: their `Point` is `()`, they have no first pass, and the
//! second runs in the vectorised kernels of [`crate::bonds`].
//!
//! Solvers use a material through [`SolverMaterial`], which [`Material::respond`] makes of it: forces by work
//! items, the energy, bounds of the stiffness. A plain material need not implement it.

mod affine;
mod bond_kernels;
mod bonded;
mod cloud_passes;
mod compression;
mod constitutive;
mod eight_chain;
mod family;
mod filter;
mod fitted_law;
mod frequency;
mod nonlocal_solid;
mod past;
mod point;
mod point_law;
mod pointwise;
mod prestrained;
mod relief;
mod response;
mod softened;
mod solid_passes;
mod spline_levels;
mod strength;
mod tensor;
mod traction;
mod virial;
mod viscous;

pub use affine::{Affine, AffinePoint};
pub use bonded::{BondMaterial, PartLaw};
pub use constitutive::Correspondence;
pub use eight_chain::EightChainSolid;
pub use family::{Bond, Family};
pub use nonlocal_solid::NonlocalSolid;
pub use past::{Driving, EnergyPart, Memory, Past};
pub use point::SolidPoint;
pub use point_law::{Deformation, PointLaw, PointStress};
pub use pointwise::{Passes, Pointwise};
pub use prestrained::Prestrained;
pub use relief::relief;
pub use response::{LawCover, LawRange, SolverMaterial};
pub use strength::energy_at_strength;
pub use tensor::BodyTensor;
pub(crate) use tensor::cofactor;
pub use traction::surface_load;
pub use virial::virial;
pub use viscous::ViscousCorrespondence;

pub use crate::bonds::Property;

use crate::bonds::{BodyGeometry, Bonds};
use crate::calibrate::{Space, modulus_in, stiffness_1111};
use crate::field::Field;

/// A body in a state: its bonds and displacement.
pub type DeformedBody<'a, const D: usize> = (&'a dyn BodyGeometry<D>, &'a Field<D>);

/// A material: the forces between particles follow from an energy E = Σ_I V_I W_I.
///
/// With the force state τ_IJ = ∂W_I/∂ζ_IJ/V_J of particle I, N/m⁶, the force density on it is Σ_J (τ_IJ −
/// τ_JI) V_J, Silling et al. 2007, doi:10.1007/s10659-007-9125-1. A broken bond belongs to no family.
pub trait Material<const D: usize>: Send + Sync {
    /// State of a particle, computed from its family by [`Self::prepare`] before each pass over the bonds;
    /// `()` for bond laws.
    ///
    /// A run resumed from a checkpoint computes it again, so it must follow from the reference state, the
    /// displacement and the intact bonds only, not from any history but [`Self::past`].
    type Point: Default + Clone + Send + Sync;

    /// Computes the initial state of a particle, before any bond breaks: quantities of the whole family, such
    /// as weighted volumes. Called once, with a displacement of zero.
    fn begin(&self, family: &Family<D>) -> Self::Point {
        let _ = family;
        Self::Point::default()
    }

    /// Runs the first pass: updates the state of a particle to the present displacement of its family.
    fn prepare(&self, family: &Family<D>, point: &mut Self::Point) {
        let _ = (family, point);
    }

    /// Computes the parts of the stiffness bound that are equal for all bonds of a particle: called for every
    /// particle before [`Self::stiffness`], after [`Self::prepare`].
    fn stiffen(&self, family: &Family<D>, point: &mut Self::Point) {
        let _ = (family, point);
    }

    /// Runs the second pass: returns τ_IJ − τ_JI, N/m⁶, the force density on particle I = `bond.from` per
    /// volume of J = `bond.to`.
    ///
    /// Exchanging both ends must reverse its sign and change nothing else, or momentum is not conserved.
    fn force(&self, bond: &Bond<D>, own: &Self::Point, other: &Self::Point) -> [f64; D];

    /// Energy density W_I of a particle, J/m³.
    fn energy(&self, family: &Family<D>, point: &Self::Point) -> f64;

    /// Energy that breaking a bond releases at its first end, over the bond's share V_J/Σ_K V_K of the family
    /// and the particle's volume, J/m³: −(∂E/∂d_IJ)/(V_I ŵ_IJ) of a bond of integrity d. `weighed` is
    /// [`Self::energy`] of the particle. `None` for materials whose bonds break only at a stretch.
    fn released_energy(&self, bond: &Bond<D>, own: &Self::Point, weighed: f64) -> Option<f64> {
        let _ = (bond, own, weighed);
        None
    }

    /// Bound s_I of the stiffness, N/m⁴, with K ≤ 2 Σ_I s_I V_I for the Hessian K = ∂²E/∂u² of the present
    /// displacement. Half the sum of absolute values in the rows ∂f_I/∂u is such a bound (Gershgorin).
    ///
    /// It determines the fictitious mass of dynamic relaxation, the local part of the preconditioner and the
    /// bound ω² ≤ 2s/ρ of the time step. `points` are the states of all sites: of the particle,
    /// `points[family.site()]`, and of its neighbours.
    fn stiffness(&self, family: &Family<D>, points: &[Self::Point]) -> f64;

    /// Bound of ρω², N/m⁴, of all oscillations about the present displacement. Explicit dynamics needs it
    /// every few steps; it should be cheaper and sharper than twice the greatest [`Self::stiffness`], which
    /// is used if this returns `None`. A result below `enough` may be replaced by `enough`. `points` are the
    /// states of all sites.
    fn frequency_bound(&self, body: DeformedBody<D>, points: &mut [Self::Point], enough: f64) -> Option<f64> {
        let _ = (body, points, enough);
        None
    }

    /// History of a particle, if the material has a state: what checkpoints keep of its point.
    fn past<'p>(&self, point: &'p mut Self::Point) -> Option<&'p mut Past> {
        let _ = point;
        None
    }

    /// Sets the stabilisation of a time step, s, after [`Self::prepare`] at its start.
    fn stabilise(&self, point: &mut Self::Point, duration: f64) {
        let _ = (point, duration);
    }

    /// Ends a time step, after [`Self::prepare`] at its end: updates the history; returns the energy
    /// dissipated in the step, J/m³.
    fn advance(&self, point: &mut Self::Point) -> f64 {
        let _ = point;
        0.0
    }

    /// Returns true if the intact bonds of a particle describe a deformation that crushes or inverts it, as
    /// the few bonds left after a break may. Explicit dynamics then breaks these, too.
    fn is_crushed(&self, point: &Self::Point) -> bool {
        let _ = point;
        false
    }

    /// Modulus kθ, N/m⁶, of linear bonds t = 3kθ(λ − 1) of similar stiffness, see
    /// [`crate::calibrate::modulus_in`]: the scale of forces, of first guesses and of the preconditioner's
    /// coarse level. Equilibria do not depend on it.
    fn micromodulus(&self, bonds: &dyn BodyGeometry<D>) -> f64;

    /// Lamé's λ, Pa, in excess of that of bonds of [`Self::micromodulus`], for the preconditioner's coarse
    /// level: a solid of large bulk modulus needs it for speed, not for correctness.
    fn volumetric(&self) -> f64 {
        0.0
    }

    /// Longitudinal modulus C₁₁₁₁ at rest, Pa, which scales contact; default: that of bonds of
    /// [`Self::micromodulus`] plus [`Self::volumetric`].
    fn longitudinal_modulus(&self, bonds: &dyn BodyGeometry<D>) -> f64 {
        let space = if D == 2 { Space::PlaneStress } else { Space::Solid };
        let youngs_modulus = self.micromodulus(bonds) / modulus_in(bonds, 1.0);
        stiffness_1111(space, youngs_modulus) + self.volumetric()
    }

    /// Stiffness at rest of the particle in a site over that of the whole body; 1 by default.
    fn relative_stiffness(&self, site: usize) -> f64 {
        let _ = site;
        1.0
    }

    /// Stretch λ* at which a bond is at rest; it breaks at a multiple of λ*.
    fn rest(&self, bond: &Bond<D>) -> f64 {
        let _ = bond;
        1.0
    }

    /// Lower bound of [`Self::rest`]; 1 if all bonds are at rest in the reference state.
    fn least_rest(&self) -> f64 {
        1.0
    }

    /// Passes over a body that are faster than loops over bonds; `None` if there are none.
    fn passes(&self, bonds: &dyn Bonds<D>) -> Option<Box<dyn Passes<Self, D>>> {
        let _ = bonds;
        None
    }

    /// Makes the material ready for solvers. The default loops over bonds with [`Self::force`].
    fn respond<'a>(self, bonds: &dyn Bonds<D>) -> Box<dyn SolverMaterial<D> + 'a>
    where
        Self: Sized + 'a,
    {
        Box::new(Pointwise::new(self, bonds))
    }
}
