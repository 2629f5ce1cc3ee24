//! Contact: short-range repulsion between particles that no intact bond joins, rigid planes, friction.
//!
//! Two particles at the distance r = |ζ| < d repel each other along ζ = ξ + η with the force density pair
//! κ (c/δ)(d − r), c = 6kθ: the bond constant of the linear bond as a dual force, f = 2t = c(l − 1). κ = 15 and
//! d = min(0.9|ξ|, 1.35(r_I + r_J)) are those of Macek & Silling (2007), doi:10.1016/j.finel.2007.08.012 (their
//! c_s = 15c), and Parks et al. (2008), doi:10.1016/j.cpc.2008.06.011, with the radius r = ½(V/thickness)^(1/D), half
//! the distance of neighbours on a lattice. 0.9|ξ| makes the reference state free of contact, and a bond that breaks in
//! tension leaves no force behind; 1.35·2r exceeds the distance of neighbours, so that no particle slips between two.
//! Other than there, intact bonds never repel: their own law resists compression. Particles have their whole volume,
//! whatever the corrections of bonds.
//!
//! The pairs come from a list of all that are within d, what is about to touch, and a skin, rebuilt where particles near
//! each other have moved against each other by the skin; where a bond breaks its pair is added. Pairs beyond d add
//! nothing, not even a rounding: the list is no part of the state, and how often it is made makes no difference to any bit.
//!
//! Limits. Contact knows distances only: a particle that leaps past another in one step stays there. Force and energy
//! are finite in full overlap (r = 0: κcd/δ along the reference ξ, the direction it came from; energy ½κcd²/δ V_I V_J),
//! so that loads beyond that press particles through each other.
//!
//! Friction acts across the pair, −μN f₁(|v_t|/v_ε) v_t/|v_t| with the repulsion N and the relative velocity v_t, see
//! [`Contact::friction`]. It is equal and opposite, but not along the pair: particles have no spin, so that it does not
//! conserve angular momentum.

mod friction;
mod lagged;
mod list;
mod plane;
mod vicinity;

use crate::bonds::Bonds;
use crate::error::Error;
use crate::field::{CHUNK, Field, chunk_range};
use friction::tangential;
pub use friction::{Rubbed, Rubbing};
use lagged::{Grip, Lagged, Other};
use list::{List, Listed, Near};
use plane::{Placed, Planes};
pub use plane::{Plane, Resting};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// κ of Macek & Silling (2007).
pub const STIFFNESS: f64 = 15.0;
/// Largest gap, in spacings, over which two particles may be about to touch.
const NEAR: f64 = 0.25;

/// Contact between the particles of a body.
pub struct Contact<const D: usize> {
    /// κc/δ, the force density on a particle per volume of the other and per overlap.
    stiffness: f64,
    /// Volume of the largest particle, m³.
    largest_volume: f64,
    /// Largest gap of particles about to touch, m.
    near: f64,
    list: List<D>,
    /// c/δ, N/m⁷.
    unit: f64,
    planes: Planes<D>,
    /// μ of pairs of particles; v_ε, m/s, or ε, m.
    friction: f64,
    slip: f64,
    /// Friction between equilibria.
    lagged: Option<Lagged<D>>,
}

/// How particles touch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Touching {
    /// Pairs with r < d, and particles that touch a plane.
    pub pairs: u64,
    /// Greatest 1 − r/d: 0 where nothing touches, 1 for two particles in one place, or for one whose middle is on a plane.
    pub overlap: f64,
    /// Energy Σ ½κ(c/δ)(d − r)² V_I V_J over pairs, and that of planes, J.
    pub energy: f64,
}

/// Checks that a factor of contact is finite and not negative.
fn push_is_valid(name: &'static str, found: f64) -> Result<(), Error> {
    if found >= 0.0 && found.is_finite() {
        return Ok(());
    }
    Err(Error::Parameter { name, found, allowed: "0 or above, finite".into() })
}

impl<const D: usize> Contact<D> {
    /// Contact of a body with the bond modulus `modulus` = kθ and κ = `stiffness`, see [`STIFFNESS`]. κ = 0 repels
    /// nothing: overlaps are looked at only.
    ///
    /// # Errors
    /// [`Error::Parameter`] where κ is negative, kθ is not positive, or either is not finite.
    pub fn new(bonds: &dyn Bonds<D>, modulus: f64, stiffness: f64) -> Result<Self, Error> {
        push_is_valid("contact.stiffness", stiffness)?;
        if !(modulus > 0.0 && modulus.is_finite()) {
            let allowed = "above 0, finite".to_owned();
            return Err(Error::Parameter { name: "modulus of contact", found: modulus, allowed });
        }
        let volumes = bonds.particles().iter().map(|&site| bonds.volume(site as usize));
        let near = NEAR * bonds.spacing();
        Ok(Self {
            stiffness: stiffness * 6.0 * modulus / bonds.horizon(),
            largest_volume: volumes.fold(0.0, f64::max),
            near,
            list: List::new(bonds, near),
            unit: 6.0 * modulus / bonds.horizon(),
            planes: Planes::default(),
            friction: 0.0,
            slip: 0.0,
            lagged: None,
        })
    }

    /// With one more rigid plane.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a normal without direction, and for what is not finite or negative.
    pub fn with_plane(mut self, bonds: &dyn Bonds<D>, plane: Plane<D>) -> Result<Self, Error> {
        let placed = Placed::new(bonds, plane, self.unit, |site| self.list.radius(site))?;
        if self.planes.each.is_empty() {
            self.planes.volumes = vec![0.0; bonds.sites()];
            let particles = bonds.particles().iter().map(|&site| site as usize);
            particles.for_each(|site| self.planes.volumes[site] = bonds.volume(site));
        }
        self.planes.each.push(placed);
        Ok(self)
    }

    /// With friction of the coefficient `friction` between particles, and the slip from which on pairs and planes resist in full: in
    /// explicit dynamics a velocity v_ε, m/s, where 0 is Coulomb's law without regularisation; for quasi-static methods the length ε > 0, m,
    /// of the slip in a load step.
    ///
    /// # Errors
    /// [`Error::Parameter`] where either is negative or not finite.
    pub fn with_friction(mut self, friction: f64, slip: f64) -> Result<Self, Error> {
        push_is_valid("contact.friction", friction)?;
        push_is_valid("slip of friction", slip)?;
        (self.friction, self.slip) = (friction, slip);
        Ok(self)
    }

    /// With another skin, in m: a thin one is filled often, a thick one holds many pairs in vain. The list is made at the
    /// next update. Values that are not positive count as 0: made at every update.
    pub fn with_skin(mut self, skin: f64) -> Self {
        self.list.set_skin(skin);
        self
    }

    /// Whether it repels: κ > 0, or planes.
    pub fn repels(&self) -> bool {
        self.has_pairs() || !self.planes.each.is_empty()
    }

    /// Whether particles repel each other: κ > 0.
    pub fn has_pairs(&self) -> bool {
        self.stiffness > 0.0
    }

    /// Whether anything rubs: a coefficient of friction above 0.
    pub fn rubs(&self) -> bool {
        (self.has_pairs() && self.friction > 0.0)
            || self.planes.each.iter().any(|plane| plane.plane.friction > 0.0)
    }

    /// Moves planes to where they are at a load factor and a time, s.
    pub fn place(&mut self, factor: f64, time: f64) {
        self.planes.each.iter_mut().for_each(|plane| plane.place(factor, time));
    }

    /// The planes, in their order.
    pub fn planes(&self) -> impl Iterator<Item = &Plane<D>> {
        self.planes.each.iter().map(|plane| &plane.plane)
    }

    /// The last move of every plane, m.
    pub fn moved(&self) -> impl Iterator<Item = [f64; D]> {
        self.planes.each.iter().map(Placed::moved)
    }

    /// How the body rests on each plane, without friction.
    pub fn resting(&self, bonds: &dyn Bonds<D>, displacement: &Field<D>) -> Vec<Resting> {
        let each = self.planes.each.iter();
        each.map(|plane| plane.resting(&self.planes.volumes, displacement, bonds)).collect()
    }

    /// Σ of the squares of the planes' force densities, (N/m³)².
    pub fn square_of_planes(&self, displacement: &Field<D>) -> f64 {
        if self.planes.each.is_empty() { 0.0 } else { self.planes.square(displacement) }
    }

    /// Force densities of the planes, N/m³; `None` without any.
    pub fn of_planes(&self, displacement: &Field<D>) -> Option<Field<D>> {
        if self.planes.each.is_empty() {
            return None;
        }
        let mut field = Field::zeros(displacement.sites());
        let moved = self.moves();
        field.chunks_mut().into_par_iter().enumerate().for_each(|(chunk, mut force)| {
            self.planes.force(displacement, chunk * CHUNK, &mut force);
            if let Some(lagged) = &self.lagged {
                lagged.force(displacement, &moved, chunk * CHUNK, true, &mut force);
            }
        });
        Some(field)
    }

    fn moves(&self) -> Vec<[f64; D]> {
        self.moved().collect()
    }

    /// Begins a load step of friction: the normal forces μN are those at the displacement `start`, with planes where they were last
    /// placed.
    pub fn lag(&mut self, bonds: &dyn Bonds<D>, start: &Field<D>) {
        if self.has_pairs() {
            self.list.rebuild(bonds, start);
        }
        let of = |chunk: usize| {
            let (mut grips, sites) = (Vec::new(), chunk_range(chunk, start.sites()));
            for (number, plane) in self.planes.each.iter().enumerate() {
                let mu = plane.plane.friction;
                plane.visit(start, sites.clone(), 0.0, &mut |site, overlap| {
                    let volume = self.planes.volumes[site];
                    let bound = mu * plane.push(volume) * overlap;
                    let (site, other) = (site as u32, Other::Plane(number));
                    grips.push(Grip { site, other, bound, normal: plane.plane.normal, volume });
                });
            }
            for (own, touching) in self.pairs(bonds, start, sites, 0.0).filter(|_| self.friction > 0.0) {
                for touch in touching {
                    let volume = bonds.volume(touch.site as usize);
                    let bound = self.friction * self.stiffness * touch.overlap() * volume;
                    let (site, other, normal) = (own.site, Other::Site(touch.site), touch.direction());
                    grips.push(Grip { site, other, bound, normal, volume: bonds.volume(site as usize) });
                }
            }
            grips.retain(|grip| grip.bound > 0.0);
            grips.sort_by_key(|grip| grip.site);
            grips
        };
        let grips = (0..start.sites().div_ceil(CHUNK)).into_par_iter().map(of).collect();
        self.lagged = Some(Lagged { start: start.clone(), grips, slip: self.slip });
    }

    /// Ends friction between equilibria.
    pub fn unlag(&mut self) {
        self.lagged = None;
    }

    /// The slip from which on it resists in full, see [`Contact::with_friction`].
    pub fn slip(&self) -> f64 {
        self.slip
    }

    /// Energy that friction has taken since [`Contact::lag`], J, and its force of each plane, N.
    pub fn taken(&self, displacement: &Field<D>) -> (f64, Vec<[f64; 3]>) {
        self.lagged.as_ref().map_or((0.0, Vec::new()), |lagged| lagged.taken(displacement, &self.moves()))
    }

    /// How often the list was made.
    pub fn rebuilds(&self) -> u64 {
        self.list.rebuilds
    }

    /// Rebuilds the list where particles near each other may have moved against each other by the skin since it was made.
    pub fn update(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>) {
        if self.has_pairs() {
            self.list.update(bonds, displacement);
        }
    }

    /// Takes in the pairs of sites whose bonds have just broken, each from both of its ends.
    pub fn part(&mut self, bonds: &dyn Bonds<D>, pairs: &[[u32; 2]]) {
        self.list.part(bonds, pairs);
    }

    /// Makes the list for a displacement; to be called where bonds have changed, otherwise than by [`Self::part`].
    pub fn rebuild(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>) {
        self.list.rebuild(bonds, displacement);
    }

    /// Of `sites`, the particles with those at r < d + `gap` from them; none where particles do not repel each other.
    fn pairs<'a>(
        &'a self,
        bonds: &'a dyn Bonds<D>,
        displacement: &'a Field<D>,
        sites: Range<usize>,
        gap: f64,
    ) -> impl Iterator<Item = (Listed, impl Iterator<Item = Near<D>> + 'a)> + 'a {
        self.has_pairs().then(|| self.list.pairs(bonds, displacement, sites, gap)).into_iter().flatten()
    }

    /// Adds the force densities −Σ_J κ(c/δ)(d − r) V_J ζ/r, N/m³, on the particles from the site `start` on, of one work item.
    pub fn force(
        &self,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        start: usize,
        force: &mut [&mut [f64]; D],
    ) {
        self.planes.force(displacement, start, force);
        if let Some(lagged) = &self.lagged {
            lagged.force(displacement, &self.moves(), start, false, force);
        }
        for (own, touching) in self.pairs(bonds, displacement, start..start + force[0].len(), 0.0) {
            let mut sum = None;
            for touch in touching {
                let push = self.stiffness * touch.overlap() * bonds.volume(touch.site as usize);
                let (sum, direction) = (sum.get_or_insert([0.0; D]), touch.direction());
                for d in 0..D {
                    sum[d] -= push * direction[d];
                }
            }
            // what is listed but does not touch must not even turn −0 into 0
            let Some(sum) = sum else { continue };
            for d in 0..D {
                force[d][own.site as usize - start] += sum[d];
            }
        }
    }

    /// What touches.
    pub fn touching(&self, bonds: &dyn Bonds<D>, displacement: &Field<D>) -> Touching {
        let none = Touching { pairs: 0, overlap: 0.0, energy: 0.0 };
        let of = |chunk: usize| {
            let (mut part, sites) = (none, chunk_range(chunk, displacement.sites()));
            for (own, touching) in self.list.pairs(bonds, displacement, sites, 0.0) {
                for touch in touching {
                    let overlap = touch.overlap();
                    let [volume, other] = [own.site, touch.site].map(|site| bonds.volume(site as usize));
                    part.pairs += u64::from(own.site < touch.site);
                    part.overlap = part.overlap.max(overlap / touch.distance);
                    // half of a pair's from either side
                    part.energy += 0.25 * self.stiffness * overlap * overlap * other * volume;
                }
            }
            part
        };
        let parts: Vec<Touching> =
            (0..displacement.sites().div_ceil(CHUNK)).into_par_iter().map(of).collect();
        let mut all = parts.into_iter().fold(none, |a, b| Touching {
            pairs: a.pairs + b.pairs,
            overlap: a.overlap.max(b.overlap),
            energy: a.energy + b.energy,
        });
        if !self.planes.each.is_empty() {
            let [count, energy] = self.planes.energy(displacement);
            all.pairs += count as u64;
            all.energy += energy;
            all.overlap = all.overlap.max(self.planes.deepest(displacement, |site| self.list.radius(site)));
        }
        all
    }

    /// Adds the force densities of friction, N/m³, on the particles of work item `chunk`, in explicit dynamics:
    /// −Σ_J μ κ(c/δ)(d − r) V_J f₁(|v_t|/v_ε) v_t/|v_t| with the relative velocity v_t across the pair at the half step, and
    /// likewise of planes. A pair's v_ε is no less than 2μN nΔt/m_eff with the reduced mass m_eff = ρV_I V_J/(V_I + V_J) and n = 3^(D−1), about the
    /// number of particles of a facing row in reach; a plane's with m_eff = ρV and n = 1.
    pub fn friction(
        &self,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        velocity: &Field<D>,
        rubbing: &Rubbing,
        chunk: usize,
        force: &mut [&mut [f64]; D],
    ) -> Rubbed {
        let mut rubbed = Rubbed::new(self.planes.each.len());
        let fields = [displacement, velocity];
        self.planes.friction(fields, self.slip, rubbing, chunk, force, &mut rubbed);
        if self.friction == 0.0 {
            return rubbed;
        }
        let touches = if D == 2 { 3.0 } else { 9.0 };
        for (own, touching) in self.pairs(bonds, displacement, chunk_range(chunk, displacement.sites()), 0.0)
        {
            let site = own.site as usize;
            for touch in touching {
                let bound = self.friction * self.stiffness * touch.overlap();
                let [volume, other] = [own.site, touch.site].map(|site| bonds.volume(site as usize));
                let slip = rubbing.slip(self.slip, bound * (volume + other), touches);
                rubbed.slip = rubbed.slip.max(slip);
                let (here, there) = (velocity.get(site), velocity.get(touch.site as usize));
                let relative = std::array::from_fn(|d| here[d] - there[d]);
                let rub = tangential(bound * other, slip, &touch.direction(), relative);
                for d in 0..D {
                    force[d][site - chunk * CHUNK] += rub[d];
                }
            }
        }
        rubbed
    }

    /// max_I Σ_J κ(c/δ) V_J over what touches, N/m⁴: twice that over the density bounds what contact adds to the squared
    /// greatest frequency.
    pub fn greatest_stiffness(&self, bonds: &dyn Bonds<D>, displacement: &Field<D>) -> f64 {
        let sites = displacement.sites();
        let of = |chunk: usize| {
            let pairs = self.pairs(bonds, displacement, chunk_range(chunk, sites), 0.0);
            let volume = |touch: Near<D>| bonds.volume(touch.site as usize);
            let sums = pairs.map(|(_, touching)| touching.map(|t| self.stiffness * volume(t)).sum::<f64>());
            sums.fold(0.0, f64::max)
        };
        let pairs = (0..sites.div_ceil(CHUNK)).into_par_iter().map(of).reduce(|| 0.0, f64::max);
        pairs + self.of_plane_stiffness()
    }

    /// Half of the planes' stiffness on a particle, whose other side does not give way.
    fn of_plane_stiffness(&self) -> f64 {
        if self.planes.each.is_empty() { 0.0 } else { self.planes.stiffness(self.largest_volume) }
    }

    /// κ(c/δ) V of the largest particle: the least that [`Contact::greatest_stiffness`] is where anything touches, if all
    /// are alike.
    pub fn pair_stiffness(&self) -> f64 {
        self.stiffness * self.largest_volume + self.of_plane_stiffness()
    }

    /// Adds to the Gershgorin sums of dynamic relaxation, in units of `tangent`, those of what touches or is about to:
    /// Σ_J κ(c/δ) V_J (1 + max_{d≠e} |n_d n_e|). A particle that became heavy only in touch would be driven far into
    /// another as a light one, out again as a heavy one, and so on indefinitely. A particle without bonds has twice that alone:
    /// it starts each step from rest, see [`Contact::still`], and so must not go farther than a gradient step may.
    pub fn add_stiffness(
        &self,
        bonds: &dyn Bonds<D>,
        displacement: &Field<D>,
        tangent: f64,
        masses: &mut [f64],
    ) {
        let of = |Near { site, zeta, r, .. }: Near<D>| {
            let mut mixed = 0.0_f64;
            for d in 0..D {
                for e in 0..d {
                    mixed = mixed.max((zeta[d] * zeta[e]).abs());
                }
            }
            let direction = 1.0 + mixed / (r * r).max(f64::MIN_POSITIVE);
            self.stiffness * bonds.volume(site as usize) * direction
        };
        let sites = masses.len();
        let sums = (0..sites.div_ceil(CHUNK)).into_par_iter().map(|chunk| {
            let pairs = self.pairs(bonds, displacement, chunk_range(chunk, sites), self.near);
            let all = pairs.map(|(own, near)| (own, near.map(of).sum::<f64>() / tangent));
            all.filter(|(_, sum)| *sum > 0.0).collect()
        });
        let sums: Vec<Vec<(Listed, f64)>> = sums.collect();
        for (own, sum) in sums.into_iter().flatten() {
            let mass = &mut masses[own.site as usize];
            *mass = if own.alone { 2.0 * sum } else { *mass + sum };
        }
        self.planes.add_stiffness(displacement, tangent, self.near, masses);
        if let Some(lagged) = &self.lagged {
            lagged.add_stiffness(tangent, masses);
        }
    }

    /// How far a step along a direction may go so that none leaps past another: by a quarter of a spacing against each
    /// other where they touch or are about to, by half of one at all. ∞ along a direction of zeros.
    pub fn longest_step(&self, bonds: &dyn Bonds<D>, displacement: &Field<D>, direction: &Field<D>) -> f64 {
        if !self.has_pairs() {
            // nothing leaps past a plane
            return f64::INFINITY;
        }
        let sites = displacement.sites();
        let of = |chunk: usize| {
            let (mut farthest, mut closing) = (0.0_f64, 0.0_f64);
            let range = chunk_range(chunk, sites);
            let parts = direction.components().map(|d| &d[range.clone()]);
            for k in 0..parts[0].len() {
                farthest = farthest.max((0..D).map(|d| parts[d][k] * parts[d][k]).sum());
            }
            for (own, near) in self.pairs(bonds, displacement, range, self.near) {
                let here = direction.get(own.site as usize);
                for other in near {
                    let there = direction.get(other.site as usize);
                    closing = closing.max((0..D).map(|d| (there[d] - here[d]).powi(2)).sum());
                }
            }
            [farthest, closing]
        };
        let parts = (0..sites.div_ceil(CHUNK)).into_par_iter().map(of);
        let [farthest, closing] = parts.reduce(|| [0.0; 2], |a, b| [a[0].max(b[0]), a[1].max(b[1])]);
        self.near / (0.5 * farthest.sqrt()).max(closing.sqrt())
    }

    /// Brings particles without bonds to rest: what is pushed aside does not fly on in a search for equilibrium.
    pub fn still(&self, velocity: &mut Field<D>) {
        self.list.alone.iter().for_each(|&site| velocity.set(site as usize, [0.0; D]));
    }
}
