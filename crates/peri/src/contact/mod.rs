//! Contact: repulsion of unbonded particles, rigid surfaces, friction.
//!
//! Two particles at the distance r = |ζ| < d repel each other along ζ = ξ + η with the force density pair k(d
//! − r) and d = min(0.9|ξ|, 1.35(r_I + r_J)), radius r = ½(V/thickness)^(1/D), half the distance of
//! neighbours on a lattice. 0.9|ξ| makes the reference state free of contact, and a bond that breaks in
//! tension leaves no force behind; 1.35·2r exceeds the distance of neighbours, so that no particle slips
//! between two. The stiffness is
//!
//! - k = ½s M_IJ/(Δx²V̄), M_IJ = 2M_I M_J/(M_I + M_J), of [`Contact::new`], with the longitudinal modulus M
//!   and the mean volume V̄: an interface is as compliant as 2/s layers of confined material;
//! - k = κ(c/δ), c = 6kθ, of [`Contact::short_range`]: the bond constant of the linear bond as a dual force.
//!   κ = 15 is that of Macek & Silling (2007), doi:10.1016/j.finel.2007.08.012 (their c_s = 15c), and Parks
//!   et al. (2008), doi:10.1016/j.cpc.2008.06.011.
//!
//! Intact bonds repel by their own law only. Particles have their whole volume, whatever the corrections of
//! bonds.
//!
//! Pairs come from a list of all within d, a gap and a skin. It is rebuilt when nearby particles have moved
//! against each other by the skin; a broken bond adds its pair. Pairs beyond d add nothing, not even
//! rounding: the list is not part of the state, and the number of rebuilds changes no bit.
//!
//! Limits. Contact of particles depends on distances only: a particle that jumps past another in one step
//! stays there. Force and energy are finite at full overlap (r = 0: kd along the reference ξ; energy ½kd² V_I
//! V_J), so larger loads press particles through each other.
//!
//! Rigid surfaces act on faces, see `faces`. Friction is Coulomb's with an elastic slip, see `friction_pair`:
//! equal and opposite within a pair, but not along it. Particles have no spin, so friction does not conserve
//! angular momentum.

mod face_areas;
mod face_centres;
mod faces;
mod faceted;
mod flight;
mod forces;
mod friction;
mod friction_pair;
mod holds;
mod list;
mod pair_tractions;
mod pushed_surfaces;
#[cfg(feature = "gpu")]
mod rows;
mod stiffness;
mod stops;
mod surface;
mod surface_friction;
mod surface_reactions;
mod surfaces;
mod ties;
mod tractions;
mod vicinity;

use crate::bonds::{BodyGeometry, Bonds, LatticeBonds, Property};
use crate::error::Error;
use crate::field::{CHUNK, Field};
use crate::parallel;
use crate::surface::BodySurface;
#[cfg(feature = "case")]
pub(crate) use face_areas::{DEPTH, SideAreas, side_areas};
pub(crate) use faces::Faces;
pub use flight::{Flight, Inertia};
pub use friction::SlidingFriction;
pub use friction_pair::{ContactPair, Drag, FrictionPair, known_in};
use list::ContactList;
#[cfg(feature = "case")]
pub(crate) use pushed_surfaces::BEHIND;
use pushed_surfaces::PushFriction;
#[cfg(feature = "gpu")]
pub use rows::{PairRows, PlaneRows, numbers_within};
use serde::{Deserialize, Serialize};
pub use stiffness::Spring;
pub use surface::{RigidSurface, SurfaceReaction, SurfaceShape};
pub use surfaces::RigidSurfaces;
use ties::Ties;
pub use ties::{GripInterface, across, grips};
pub use tractions::SurfaceTraction;

/// κ of Macek & Silling (2007).
pub const SHORT_RANGE: f64 = 15.0;
/// Stiffness s of rigid surfaces in equilibria: at most 2 % of the compliance of a confined body of ten
/// layers.
pub const PLANE_STIFFNESS: f64 = 10.0;
/// Stiffness s of pairs, and of rigid surfaces in explicit dynamics.
pub const PAIR_STIFFNESS: f64 = 2.0;
/// Largest gap, in spacings, at which two particles count as about to touch.
const NEAR: f64 = 0.25;

/// Contact of a body.
#[derive(Clone)]
pub struct Contact<const D: usize> {
    /// Force density on a particle per volume of the other and per overlap, N/m⁷, for the greatest M.
    stiffness: f64,
    /// True if the stiffness was given in layers of the material, not as κ.
    layered: bool,
    /// M of each particle over the greatest M; `None` if uniform.
    moduli: Option<Property>,
    /// Volume of the largest particle, m³.
    largest_volume: f64,
    /// Largest gap of particles about to touch, m.
    near: f64,
    list: ContactList<D>,
    surfaces: Option<RigidSurfaces<D>>,
    ties: Option<Ties<D>>,
    /// μ of pairs of particles, and γ, m.
    friction: f64,
    elastic_slip: Option<f64>,
    /// Active friction, sorted by pair, and the displacement from which it counts.
    held: Vec<FrictionPair>,
    start: Option<Field<D>>,
}

/// Pairs, faces and energy in contact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactSummary {
    /// Pairs with r < d, and faces in contact with a surface.
    pub pairs: u64,
    /// Greatest overlap: 1 − r/d of a pair, overlap over half a spacing of a face; 0 without contact.
    pub overlap: f64,
    /// Energy of pairs, surfaces and elastic slip, J.
    pub energy: f64,
}

/// Checks that a contact parameter is finite and not negative.
fn non_negative(name: &'static str, found: f64) -> Result<(), Error> {
    if found >= 0.0 && found.is_finite() {
        return Ok(());
    }
    Err(Error::Parameter { name, found, allowed: "0 or above, finite".into() })
}

impl<const D: usize> Contact<D> {
    /// Contact of a body of the longitudinal modulus M = `modulus`, Pa, with the stiffness s = `stiffness`,
    /// see [`PAIR_STIFFNESS`]. s = 0 exerts no force: overlaps are only measured.
    ///
    /// # Errors
    /// [`Error::Parameter`] if s is negative, M is not positive, or either is not finite.
    pub fn new(
        bonds: &dyn BodyGeometry<D>,
        modulus: impl Into<Property>,
        stiffness: f64,
    ) -> Result<Self, Error> {
        let modulus = modulus.into();
        positive("modulus of contact", modulus.least())?;
        positive("modulus of contact", modulus.greatest())?;
        let count = bonds.particles().len().max(1) as f64;
        let mean = bonds.particles().iter().map(|&site| bonds.volume(site as usize)).sum::<f64>() / count;
        let unit = 0.5 * modulus.greatest() / (bonds.spacing().powi(2) * mean);
        let moduli = modulus
            .uniform()
            .is_none()
            .then(|| Property::new(bonds, |site, _| modulus.value_at(site) / modulus.greatest()));
        Ok(Self { moduli, layered: true, ..Self::with_stiffness(bonds, unit, stiffness)? })
    }

    /// Contact of a body with the bond modulus `modulus` = kθ, N/m⁶, and κ = `stiffness`, see
    /// [`SHORT_RANGE`].
    ///
    /// # Errors
    /// [`Error::Parameter`] if κ is negative, kθ is not positive, or either is not finite.
    pub fn short_range(bonds: &dyn BodyGeometry<D>, modulus: f64, stiffness: f64) -> Result<Self, Error> {
        positive("modulus of contact", modulus)?;
        let unit = 6.0 * modulus / bonds.horizon();
        // the same bits as κ·6kθ/δ
        let mut contact = Self::with_stiffness(bonds, unit, stiffness)?;
        contact.stiffness = stiffness * 6.0 * modulus / bonds.horizon();
        Ok(contact)
    }

    fn with_stiffness(bonds: &dyn BodyGeometry<D>, unit: f64, stiffness: f64) -> Result<Self, Error> {
        non_negative("contact.stiffness", stiffness)?;
        let volumes = bonds.particles().iter().map(|&site| bonds.volume(site as usize));
        let near = NEAR * bonds.spacing();
        Ok(Self {
            stiffness: stiffness * unit,
            layered: false,
            moduli: None,
            largest_volume: volumes.fold(0.0, f64::max),
            near,
            list: ContactList::new(bonds, near),
            surfaces: None,
            ties: None,
            friction: 0.0,
            elastic_slip: None,
            held: Vec::new(),
            start: None,
        })
    }

    /// Adds rigid surfaces in contact with the faces of `outside`, for a body of the longitudinal modulus M =
    /// `modulus`, Pa.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a normal without direction and for values that are negative or not finite;
    /// [`Error::Geometry`] for a bonded plane that touches no face, and for a surface with a force that meets
    /// none.
    pub fn with_surfaces(
        mut self,
        bonds: &dyn Bonds<D>,
        outside: &BodySurface<D>,
        modulus: impl Into<Property>,
        surfaces: Vec<RigidSurface<D>>,
    ) -> Result<Self, Error> {
        if !surfaces.is_empty() {
            let modulus = modulus.into();
            positive("modulus of contact", modulus.least())?;
            let radius = |site: usize| self.list.radius(site);
            self.surfaces = Some(RigidSurfaces::new(bonds, outside, &modulus, surfaces, radius)?);
        }
        Ok(self)
    }

    /// Ties held particles to the others at their interface with the stiffness s = `stiffness`, for a body of
    /// the outer surface `outside` and the longitudinal modulus M = `modulus`, Pa, without bonds [`across`]
    /// the interface.
    ///
    /// # Errors
    /// [`Error::Parameter`] if s is negative, M is not positive, or either is not finite.
    pub fn with_tied(
        mut self,
        bonds: &LatticeBonds<D>,
        interface: GripInterface<D>,
        outside: &BodySurface<D>,
        modulus: f64,
        stiffness: f64,
    ) -> Result<Self, Error> {
        positive("modulus of contact", modulus)?;
        non_negative("stiffness of ties", stiffness)?;
        let ties = Ties::new(bonds, interface, outside, stiffness * modulus / bonds.spacing());
        self.ties = (ties.len() > 0).then_some(ties);
        Ok(self)
    }

    /// Adds friction of the coefficient `friction` between particles; `elastic_slip` is the slip γ, m, at
    /// which it reaches Coulomb's limit; `None` makes tangential and normal stiffness equal.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the coefficient is negative, the slip is not positive, or either is not
    /// finite.
    pub fn with_friction(mut self, friction: f64, elastic_slip: Option<f64>) -> Result<Self, Error> {
        non_negative("contact.friction", friction)?;
        if let Some(slip) = elastic_slip {
            positive("elastic slip", slip)?;
        }
        (self.friction, self.elastic_slip) = (friction, elastic_slip);
        Ok(self)
    }

    /// Sets the skin, in m: a thin one is rebuilt often, a thick one holds many pairs in vain. The list is
    /// rebuilt at the next update. Values that are not positive count as 0: rebuilt at every update.
    pub fn with_skin(mut self, skin: f64) -> Self {
        self.list.set_skin(skin);
        self
    }

    /// Returns true if pairs, surfaces or ties exert forces.
    pub fn repels(&self) -> bool {
        self.has_pairs() || self.has_surfaces() || self.ties.is_some()
    }

    /// Returns true if particles repel each other.
    pub fn has_pairs(&self) -> bool {
        self.stiffness > 0.0
    }

    /// Returns true if there are surfaces.
    pub fn has_surfaces(&self) -> bool {
        self.surfaces.is_some()
    }

    /// Returns true if a friction coefficient is above 0.
    pub fn has_friction(&self) -> bool {
        (self.has_pairs() && self.friction > 0.0)
            || self.surfaces().any(|surface| surface.friction > 0.0 && !surface.bonded)
    }

    /// Returns true if bonded planes or grips hold faces in all directions.
    pub fn is_tied(&self) -> bool {
        self.ties.is_some() || self.surfaces().any(|surface| surface.bonded)
    }

    /// Moves rigid surfaces to their positions at a load factor and a time, s.
    pub fn move_surfaces(&mut self, factor: f64, time: f64) {
        if let Some(surfaces) = &mut self.surfaces {
            surfaces.move_to(factor, time);
        }
    }

    /// Sets the rates of displacements of rigid surfaces between two load factors.
    pub fn set_rates(&mut self, before: f64, after: f64) {
        if let Some(surfaces) = &mut self.surfaces {
            surfaces.set_rates(before, after);
        }
    }

    /// Sets the forces on rigid surfaces that follow amplitudes to their mean at two load factors, for
    /// [`Self::travelled`].
    pub fn set_weights(&mut self, factors: [f64; 2]) {
        if let Some(surfaces) = &mut self.surfaces {
            surfaces.set_weights(factors);
        }
    }

    /// Mean rates of the displacements of rigid surfaces over the load factor in the present step, m.
    pub fn rates(&self) -> impl Iterator<Item = [f64; D]> {
        self.surfaces.iter().flat_map(RigidSurfaces::rates)
    }

    /// The rigid surfaces, in their order.
    pub fn surfaces(&self) -> impl Iterator<Item = &RigidSurface<D>> {
        self.surfaces.iter().flat_map(RigidSurfaces::surfaces)
    }

    /// Returns true if a rigid surface has a force.
    pub fn has_pushed(&self) -> bool {
        self.surfaces().any(|surface| surface.force.is_some())
    }

    /// Moves rigid surfaces with a force to where contact balances it at a displacement, with the active
    /// friction, or with that at the end of a step, `resting`.
    pub fn balance(&mut self, displacement: &Field<D>, resting: Option<&[FrictionPair]>) {
        let Some(surfaces) = &mut self.surfaces else { return };
        let active = push_friction(&self.held, self.start.as_ref());
        surfaces.balance(displacement, resting.map_or(active, PushFriction::Resting));
    }

    /// Finds a rigid surface whose force contact does not balance: its title, the balanced part and the
    /// force, N.
    pub fn unbalanced(&self, displacement: &Field<D>) -> Option<(String, f64, f64)> {
        let active = push_friction(&self.held, self.start.as_ref());
        self.surfaces.as_ref()?.unbalanced(displacement, active)
    }

    /// Sums P·t of the forces on rigid surfaces at load factor 1, of those with amplitudes at their mean
    /// multiples, and their travels, N·m.
    pub fn travelled(&self) -> f64 {
        self.surfaces.as_ref().map_or(0.0, RigidSurfaces::travelled)
    }

    /// Last move of every rigid surface, m.
    pub fn moved(&self) -> impl Iterator<Item = [f64; D]> {
        self.surfaces.iter().flat_map(RigidSurfaces::moved)
    }

    /// Deepest overlap of a rigid surface that has moved, m, before its last move and after it; −∞ if none
    /// touches.
    pub fn approach(&self, displacement: &Field<D>) -> [f64; 2] {
        self.surfaces.as_ref().map_or([f64::NEG_INFINITY; 2], |surfaces| surfaces.approach(displacement))
    }

    /// Force, area and width of the contact with each rigid surface, without friction.
    pub fn surface_reactions(&self, displacement: &Field<D>) -> Vec<SurfaceReaction> {
        self.surfaces.as_ref().map_or_else(Vec::new, |surfaces| surfaces.reactions(displacement))
    }

    /// Greatest pressure of each rigid surface on the body, Pa; 0 where nothing is pressed.
    pub fn greatest_pressures(&self, bonds: &dyn BodyGeometry<D>, displacement: &Field<D>) -> Vec<f64> {
        self.surfaces.as_ref().map_or_else(Vec::new, |own| own.greatest_pressures(bonds, displacement))
    }

    /// Sum of the squares of the surfaces' force densities at the last update, (N/m³)².
    pub fn surface_force_square(&self) -> f64 {
        self.surfaces.as_ref().map_or(0.0, RigidSurfaces::square)
    }

    /// Force densities of the surfaces at the last update, N/m³; `None` without surfaces.
    pub fn surface_forces(&self, sites: usize) -> Option<Field<D>> {
        let surfaces = self.surfaces.as_ref()?;
        let mut field = Field::zeros(sites);
        let force = |chunk: usize, mut force: [&mut [f64]; D]| surfaces.force(chunk * CHUNK, &mut force);
        parallel::for_items(field.chunks_mut(), force);
        Some(field)
    }

    /// Number of rebuilds of the list.
    pub fn rebuilds(&self) -> u64 {
        self.list.rebuilds
    }

    /// Prepares the forces of a displacement: rebuilds the list if nearby particles may have moved against
    /// each other by the skin, and computes the forces of surfaces.
    pub fn update(&mut self, bonds: &dyn BodyGeometry<D>, displacement: &Field<D>) {
        if self.has_pairs() {
            self.list.update(bonds, displacement);
        }
        if let Some(surfaces) = &mut self.surfaces {
            surfaces.update(displacement, &self.held, self.start.as_ref());
        }
        if let Some(ties) = &mut self.ties {
            ties.update(displacement);
        }
    }

    /// Adds the pairs of sites whose bonds have just broken, each from both ends.
    pub fn add_broken_pairs(&mut self, bonds: &dyn BodyGeometry<D>, pairs: &[[u32; 2]]) {
        if self.has_pairs() {
            self.list.add_broken_pairs(bonds, pairs);
        }
        if let Some(surfaces) = &mut self.surfaces {
            surfaces.expose(bonds, pairs.iter().map(|pair| pair[0] as usize));
        }
    }

    /// Rebuilds the list for a displacement; required after bonds change other than by
    /// [`Self::add_broken_pairs`].
    pub fn rebuild(&mut self, bonds: &dyn BodyGeometry<D>, displacement: &Field<D>) {
        self.list.rebuild(bonds, displacement);
        if let Some(surfaces) = &mut self.surfaces {
            surfaces.expose(bonds, bonds.particles().iter().map(|&site| site as usize));
        }
    }
}

/// Active friction of surfaces with a force: none without a displacement at the start of the step.
fn push_friction<'a, const D: usize>(
    held: &'a [FrictionPair],
    start: Option<&'a Field<D>>,
) -> PushFriction<'a, D> {
    start.map_or(PushFriction::Resting(&[]), |start| PushFriction::Sliding(held, start))
}

/// Checks that a quantity is positive and finite.
fn positive(name: &'static str, found: f64) -> Result<(), Error> {
    if found > 0.0 && found.is_finite() {
        return Ok(());
    }
    Err(Error::Parameter { name, found, allowed: "above 0, finite".into() })
}
