//! What solvers ask of a material at work in a body.

use crate::bonds::{Bonds, Overstretched, Property, StretchScan, overstretched};
use crate::error::Error;
use crate::field::{CHUNK, Field};
use crate::potential::{BondPotential, StretchRange};

/// Stretches over which a law is to be evaluated, and how.
#[derive(Clone, Copy, Debug)]
pub struct LawCover {
    /// Stretches [λ_low, λ_high].
    pub stretches: [f64; 2],
    /// Largest relative error of a fit.
    pub bound: f64,
    /// Whether the law stays what it is at the ends beyond them, as it must where bonds break.
    pub clamped: bool,
    /// What [`Response::cover`] gave for these stretches, of a resumed run.
    pub known: Option<f64>,
}

/// What a material does over a range of stretches, in one unit.
#[derive(Clone, Copy, Debug)]
pub struct LawRange {
    /// max |t′| + (D − 1)·max(t/λ, 0): D times the mean tangent of bonds in all directions, where it is greatest.
    pub mean_tangent: f64,
    /// min |t′|.
    pub least_tangent: f64,
    /// min φ ≤ 0.
    pub least_energy: f64,
}

/// A material at work. Forces are taken by work items, so that a trait object costs nothing.
pub trait Response<const D: usize>: Send + Sync {
    /// A bond law and its kθ, N/m⁶, about as stiff as this material: its own where it is one.
    fn bond_law(&self) -> (&dyn BondPotential, f64);

    /// Lamé's λ, Pa, in addition to that of [`Self::bond_law`]: how much stiffer volumes are than those of bonds.
    fn volumetric(&self) -> f64 {
        0.0
    }

    /// Brings the law to a range of stretches; a bound of the relative tangent of bonds, N/m⁶: with u_I = Σ_J 2 w V_J/|ξ|
    /// no particle is stiffer than tangent × u_I.
    ///
    /// # Errors
    /// As [`crate::potential::KernelFit::new`].
    fn cover(
        &mut self,
        bonds: &mut dyn Bonds<D>,
        displacement: &Field<D>,
        cover: &LawCover,
    ) -> Result<f64, Error>;

    /// The first pass: to be called before forces of a displacement, and where bonds have changed.
    fn prepare(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>);

    /// Whether forces of a particle depend on more than its own bonds.
    fn has_points(&self) -> bool;

    /// Whether forces are those of the bonds' fitted law, and nothing else, as graphics cards evaluate them.
    fn is_fitted_law(&self) -> bool {
        false
    }

    /// Force densities, N/m³, of whole pieces from the site `start` on; collects the stretches observed if asked.
    fn force(
        &self,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        start: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    );

    /// Sites that [`Response::force`] may begin with, see [`crate::bonds::BondForces::piece`].
    fn piece(&self, bonds: &dyn Bonds<D>) -> usize {
        let _ = bonds;
        CHUNK
    }

    /// Energy of the body, J; `observed` holds the stretches within which the law itself is to be taken.
    fn energy(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>, observed: StretchRange) -> f64;

    /// Energy of bonds about to be severed, J, where it does not depend on others; `most` is the largest stretch of the law
    /// itself. `None`: what the body loses when they are.
    fn released(&self, bonds: &dyn Bonds<D>, list: &[Overstretched], most: f64) -> Option<f64>;

    /// The least stretch λ* at which any bond is at rest; critical stretches are multiples of λ*.
    fn least_rest(&self) -> f64 {
        1.0
    }

    /// As [`overstretched`], with λ/λ* for λ where bonds are at rest at another stretch.
    fn overstretched(
        &self,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        critical: &Property,
        seen: &StretchScan,
    ) -> Vec<Overstretched> {
        overstretched(bonds, displacement, critical, seen)
    }

    /// Intact bonds of free particles that are stretched, and whose breaking would release more than `limit`, J/m³, with that
    /// energy, each from both ends, by site and index; none of materials without [`super::Material::released_energy`].
    fn overloaded(
        &mut self,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        limit: f64,
        free: &(dyn Fn(usize) -> bool + Sync),
    ) -> Vec<(Overstretched, f64)> {
        let _ = (bonds, displacement, limit, free);
        Vec::new()
    }

    /// Whether bonds differ so much in their tangent, of which `tangent` is the greatest, that every particle needs the
    /// stiffness of its own.
    fn has_own_stiffness(&self, tangent: f64) -> bool;

    /// Bounds of the stiffness of all particles, in their order, over kθ: s_I of [`super::Material::stiffness`].
    fn own_stiffness(
        &mut self,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        stretches: [f64; 2],
    ) -> Vec<f64>;

    /// A bound of ρω², N/m⁴, of oscillations about the displacement last prepared, of materials with states of particles; where it is
    /// below `enough`, `enough` will do. See [`super::Material::frequency_bound`].
    fn frequency_bound(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>, enough: f64) -> f64 {
        let _ = (bonds, displacement, enough);
        f64::INFINITY
    }

    /// Of some sites those that their bonds crush, see [`super::Material::is_crushed`].
    fn crushed(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>, sites: &[u32]) -> Vec<u32> {
        let _ = (bonds, displacement, sites);
        Vec::new()
    }

    /// Tangents and energies over a range of stretches.
    fn range(&self, stretches: [f64; 2]) -> LawRange;
}
