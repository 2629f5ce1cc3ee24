//! Interface of a material to the solvers.

use super::EnergyPart;
use crate::bonds::{Bonds, Overstretched, Property, StretchScan, overstretched};
use crate::error::Error;
use crate::field::{CHUNK, Field};
use crate::potential::{BondPotential, StretchRange, TangentTable};
use crate::stress::StressTensor;

/// Stretches over which a law is to be evaluated, and how.
#[derive(Clone, Copy, Debug)]
pub struct LawCover {
    /// Stretches [λ_low, λ_high].
    pub stretches: [f64; 2],
    /// Largest relative error of a fit.
    pub bound: f64,
    /// True if the law stays constant beyond the ends, as it must if bonds break.
    pub clamped: bool,
    /// Result of [`SolverMaterial::cover`] for these stretches in a resumed run.
    pub known: Option<f64>,
}

/// Bounds of a material over a range of stretches, in one unit.
#[derive(Clone, Copy, Debug)]
pub struct LawRange {
    /// max |t′| + (D − 1)·max(t/λ, 0): D times the greatest mean tangent of bonds in all directions.
    pub mean_tangent: f64,
    /// min |t′|.
    pub least_tangent: f64,
    /// min φ ≤ 0.
    pub least_energy: f64,
}

/// A material as solvers use it. Forces are computed by work items, so that a trait object costs nothing.
pub trait SolverMaterial<const D: usize>: Send + Sync {
    /// A bond law and its kθ, N/m⁶, of similar stiffness; the material's own for bond laws.
    fn bond_law(&self) -> (&dyn BondPotential, f64);

    /// Lamé's λ, Pa, in excess of that of [`Self::bond_law`]: the stiffness of volumes beyond that of bonds.
    fn volumetric(&self) -> f64 {
        0.0
    }

    /// Extends the law to a range of stretches; returns a bound of the relative tangent of bonds, N/m⁶: with
    /// u_I = Σ_J 2 w V_J/|ξ| no particle is stiffer than tangent × u_I.
    ///
    /// # Errors
    /// As [`crate::potential::KernelFit::new`].
    fn cover(
        &mut self,
        bonds: &mut dyn Bonds<D>,
        displacement: &Field<D>,
        cover: &LawCover,
    ) -> Result<f64, Error>;

    /// Runs the first pass: required before forces of a displacement, and after bonds have changed.
    fn prepare(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>);

    /// Returns true if forces of a particle depend on more than its own bonds.
    fn has_points(&self) -> bool;

    /// Whether forces are those of the bonds' fitted law, and nothing else, as graphics cards evaluate them.
    fn is_fitted_law(&self) -> bool {
        false
    }

    /// Tangents of bonds within stretches, and the least that bounds of stiffness take, for such a law;
    /// `None` for others.
    fn tangents(&mut self, stretches: [f64; 2]) -> Option<(&TangentTable, f64)> {
        let _ = stretches;
        None
    }

    /// Computes the force densities, N/m³, of whole pieces from the site `start` on; tracks the stretches
    /// observed if asked.
    fn force(
        &self,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        start: usize,
        force: &mut [&mut [f64]; D],
        track: Option<&mut StretchRange>,
    );

    /// Granularity of [`SolverMaterial::force`] in sites, see [`crate::bonds::BondForces::piece`].
    fn piece(&self, bonds: &dyn Bonds<D>) -> usize {
        let _ = bonds;
        CHUNK
    }

    /// Energy of the body, J; `observed` are the stretches within which the law itself is evaluated.
    fn energy(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>, observed: StretchRange) -> f64;

    /// Volume times the mean first Piola–Kirchhoff stress in the displacement last prepared, N·m, see
    /// [`super::virial`].
    fn virial(&self, bonds: &dyn Bonds<D>, displacement: &Field<D>) -> StressTensor<D>;

    /// Energy of bonds about to be severed, J, if it does not depend on others; `most` is the largest stretch
    /// of the law itself. `None`: the energy that the body loses when they break.
    fn released(&self, bonds: &dyn Bonds<D>, list: &[Overstretched], most: f64) -> Option<f64>;

    /// Least stretch λ* at which any bond is at rest; critical stretches are multiples of λ*.
    fn least_rest(&self) -> f64 {
        1.0
    }

    /// Lists overstretched bonds as [`overstretched`] does, with λ/λ* for λ if bonds have a stretch at rest.
    fn overstretched(
        &self,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        critical: &Property,
        seen: &StretchScan,
    ) -> Vec<Overstretched> {
        overstretched(bonds, displacement, critical, seen)
    }

    /// Lists intact, stretched bonds of free particles whose breaking would release more than `limit`, J/m³,
    /// with that energy, each from both ends, by site and index; none for materials without
    /// [`super::Material::released_energy`].
    fn overloaded(
        &mut self,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        limit: &Property,
        free: &(dyn Fn(usize) -> bool + Sync),
    ) -> Vec<(Overstretched, f64)> {
        let _ = (bonds, displacement, limit, free);
        Vec::new()
    }

    /// Returns true if bonds differ so much in their tangent, of which `tangent` is the greatest, that every
    /// particle needs its own stiffness.
    fn has_own_stiffness(&self, tangent: f64) -> bool;

    /// Bounds of the stiffness of all particles, in their order, over kθ: s_I of
    /// [`super::Material::stiffness`].
    fn own_stiffness(
        &mut self,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        stretches: [f64; 2],
    ) -> Vec<f64>;

    /// Bound of ρω², N/m⁴, of oscillations about the displacement last prepared, for materials with particle
    /// states; a result below `enough` may be replaced by `enough`. See [`super::Material::frequency_bound`].
    fn frequency_bound(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>, enough: f64) -> f64 {
        let _ = (bonds, displacement, enough);
        f64::INFINITY
    }

    /// Selects the sites that their bonds crush, see [`super::Material::is_crushed`].
    fn crushed(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>, sites: &[u32]) -> Vec<u32> {
        let _ = (bonds, displacement, sites);
        Vec::new()
    }

    /// Histories of the particles; no values without a material that has a state.
    fn memory(&mut self, bonds: &dyn Bonds<D>) -> Vec<f64> {
        let _ = bonds;
        Vec::new()
    }

    /// Restores histories, or sets the duration of a step alone where there are no values.
    ///
    /// # Errors
    /// [`Error::Geometry`] for the histories of another body.
    fn recall(&mut self, bonds: &dyn Bonds<D>, duration: f64, values: &[f64]) -> Result<(), Error> {
        let _ = (bonds, duration, values);
        Ok(())
    }

    /// Sets the stabilisation of a time step, s, at its start; returns the energy lost by its change, J.
    fn stabilise(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>, duration: f64) -> f64 {
        let _ = (bonds, displacement, duration);
        0.0
    }

    /// Ends a time step: updates the histories; returns the energy dissipated in it, J.
    fn advance(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>) -> f64 {
        let _ = (bonds, displacement);
        0.0
    }

    /// Energy, J, of a part of [`Self::energy`]; `None` for a material without a state.
    fn energy_of(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>, part: EnergyPart) -> Option<f64> {
        let _ = (bonds, displacement, part);
        None
    }

    /// Returns true if the tension of a bond falls as it is stretched beyond `stretch`.
    fn softens_at(&self, stretch: f64) -> bool {
        self.bond_law().0.tension_derivative(stretch) < 0.0
    }

    /// Tangents and energies over a range of stretches.
    fn range(&self, stretches: [f64; 2]) -> LawRange;
}
