//! Contact: short-range repulsion between particles that no intact bond joins.
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
//! The pairs come from a list of all that are within d, what is about to touch, and a skin, rebuilt where a particle
//! has moved by half of the skin. Pairs beyond d add nothing, not even a rounding: the list is no part of the state, and
//! how often it is made makes no difference to any bit.
//!
//! Limits. Contact knows distances only: a particle that leaps past another in one step stays there. Force and energy
//! are finite in full overlap (r = 0: κcd/δ along the reference ξ, the direction it came from; energy ½κcd²/δ V_I V_J),
//! so that loads beyond that press particles through each other. No friction.

mod list;

use crate::bonds::Bonds;
use crate::error::Error;
use crate::field::{CHUNK, Field, chunk_range};
use list::{Candidate, List, Listed};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

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
}

/// How particles touch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Touching {
    /// Pairs with r < d.
    pub pairs: u64,
    /// Greatest 1 − r/d: 0 where nothing touches, 1 for two particles in one place.
    pub overlap: f64,
    /// Energy Σ ½κ(c/δ)(d − r)² V_I V_J over pairs, J.
    pub energy: f64,
}

impl<const D: usize> Contact<D> {
    /// Contact of a body with the bond modulus `modulus` = kθ and κ = `stiffness`, see [`STIFFNESS`]. κ = 0 repels
    /// nothing: overlaps are looked at only.
    ///
    /// # Errors
    /// [`Error::Parameter`] where κ is negative, kθ is not positive, or either is not finite.
    pub fn new(bonds: &dyn Bonds<D>, modulus: f64, stiffness: f64) -> Result<Self, Error> {
        let kappa = ("contact.stiffness", stiffness, stiffness >= 0.0, "0 or above, finite");
        for (name, found, good, allowed) in
            [kappa, ("modulus of contact", modulus, modulus > 0.0, "above 0, finite")]
        {
            if !good || !found.is_finite() {
                return Err(Error::Parameter { name, found, allowed: allowed.into() });
            }
        }
        let volumes = bonds.particles().iter().map(|&site| bonds.volume(site as usize));
        let near = NEAR * bonds.spacing();
        Ok(Self {
            stiffness: stiffness * 6.0 * modulus / bonds.horizon(),
            largest_volume: volumes.fold(0.0, f64::max),
            near,
            list: List::new(bonds, near),
        })
    }

    /// With another skin, in m: a thin one is filled often, a thick one holds many pairs in vain. The list is made at the
    /// next update. Values that are not positive count as 0: made at every update.
    pub fn with_skin(mut self, skin: f64) -> Self {
        self.list.set_skin(skin);
        self
    }

    /// Whether it repels: κ > 0.
    pub fn repels(&self) -> bool {
        self.stiffness > 0.0
    }

    /// How often the list was made.
    pub fn rebuilds(&self) -> u64 {
        self.list.rebuilds
    }

    /// Rebuilds the list where a particle has moved by half of the skin since it was made.
    pub fn update(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>) {
        self.list.update(bonds, displacement);
    }

    /// Makes the list for a displacement; to be called where bonds have changed.
    pub fn rebuild(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>) {
        self.list.rebuild(bonds, displacement);
    }

    /// Adds the force densities −Σ_J κ(c/δ)(d − r) V_J ζ/r, N/m³, on the particles of work item `chunk`.
    pub fn force(&self, displacement: &Field<D>, chunk: usize, force: &mut [&mut [f64]; D]) {
        for (own, candidates) in self.list.in_chunk(chunk) {
            let mut sum = None;
            for touch in candidates.iter().filter_map(|c| c.touch(displacement, own.site as usize)) {
                let push = self.stiffness * touch.overlap * touch.volume;
                let sum = sum.get_or_insert([0.0; D]);
                for d in 0..D {
                    sum[d] -= push * touch.direction[d];
                }
            }
            // what is listed but does not touch must not even turn −0 into 0
            let Some(sum) = sum else { continue };
            for d in 0..D {
                force[d][own.site as usize - chunk * CHUNK] += sum[d];
            }
        }
    }

    /// What touches.
    pub fn touching(&self, displacement: &Field<D>) -> Touching {
        let none = Touching { pairs: 0, overlap: 0.0, energy: 0.0 };
        let of = |chunk: usize| {
            let mut part = none;
            for (own, candidates) in self.list.in_chunk(chunk) {
                for candidate in candidates {
                    let Some(touch) = candidate.touch(displacement, own.site as usize) else { continue };
                    part.pairs += u64::from(own.site < candidate.site);
                    part.overlap = part.overlap.max(touch.overlap / candidate.distance);
                    // half of a pair's from either side
                    part.energy +=
                        0.25 * self.stiffness * touch.overlap * touch.overlap * touch.volume * own.volume;
                }
            }
            part
        };
        let parts: Vec<Touching> =
            (0..displacement.sites().div_ceil(CHUNK)).into_par_iter().map(of).collect();
        parts.into_iter().fold(none, |a, b| Touching {
            pairs: a.pairs + b.pairs,
            overlap: a.overlap.max(b.overlap),
            energy: a.energy + b.energy,
        })
    }

    /// max_I Σ_J κ(c/δ) V_J over what touches, N/m⁴: twice that over the density bounds what contact adds to the squared
    /// greatest frequency.
    pub fn greatest_stiffness(&self, displacement: &Field<D>) -> f64 {
        let of = |chunk: usize| {
            let sums = self.list.in_chunk(chunk).map(|(own, candidates)| {
                let touches = candidates.iter().filter_map(|c| c.touch(displacement, own.site as usize));
                touches.map(|touch| self.stiffness * touch.volume).sum::<f64>()
            });
            sums.fold(0.0, f64::max)
        };
        (0..displacement.sites().div_ceil(CHUNK)).into_par_iter().map(of).reduce(|| 0.0, f64::max)
    }

    /// κ(c/δ) V of the largest particle: the least that [`Contact::greatest_stiffness`] is where anything touches, if all
    /// are alike.
    pub fn pair_stiffness(&self) -> f64 {
        self.stiffness * self.largest_volume
    }

    /// Adds to the Gershgorin sums of dynamic relaxation, in units of `tangent`, those of what touches or is about to:
    /// Σ_J κ(c/δ) V_J (1 + max_{d≠e} |n_d n_e|). A particle that became heavy only in touch would be driven far into
    /// another as a light one, out again as a heavy one, and so on indefinitely. A particle without bonds has twice that alone:
    /// it starts each step from rest, see [`Contact::still`], and so must not go farther than a gradient step may.
    pub fn add_stiffness(&self, displacement: &Field<D>, tangent: f64, masses: &mut [f64]) {
        let of = |own: &Listed, candidates: &[Candidate<D>]| {
            let mut sum = 0.0;
            for candidate in candidates {
                let (zeta, r) = candidate.apart(displacement, own.site as usize);
                if r < candidate.distance + self.near {
                    let mut mixed = 0.0_f64;
                    for d in 0..D {
                        for e in 0..d {
                            mixed = mixed.max((zeta[d] * zeta[e]).abs());
                        }
                    }
                    sum += self.stiffness * candidate.volume * (1.0 + mixed / (r * r).max(f64::MIN_POSITIVE));
                }
            }
            sum / tangent
        };
        let chunks = masses.len().div_ceil(CHUNK);
        let sums = (0..chunks).into_par_iter().map(|chunk| {
            let all = self.list.in_chunk(chunk).map(|(own, candidates)| (own, of(own, candidates)));
            all.filter(|(_, sum)| *sum > 0.0).collect()
        });
        let sums: Vec<Vec<(&Listed, f64)>> = sums.collect();
        for (own, sum) in sums.into_iter().flatten() {
            let mass = &mut masses[own.site as usize];
            *mass = if own.alone { 2.0 * sum } else { *mass + sum };
        }
    }

    /// How far a step along a direction may go so that none leaps past another: by a quarter of a spacing against each
    /// other where they touch or are about to, by half of one at all. ∞ along a direction of zeros.
    pub fn longest_step(&self, displacement: &Field<D>, direction: &Field<D>) -> f64 {
        let sites = displacement.sites();
        let of = |chunk: usize| {
            let (mut farthest, mut closing) = (0.0_f64, 0.0_f64);
            let parts = direction.components().map(|d| &d[chunk_range(chunk, sites)]);
            for k in 0..parts[0].len() {
                farthest = farthest.max((0..D).map(|d| parts[d][k] * parts[d][k]).sum());
            }
            for (own, candidates) in self.list.in_chunk(chunk) {
                let site = own.site as usize;
                let here = direction.get(site);
                for candidate in candidates {
                    if candidate.apart(displacement, site).1 < candidate.distance + self.near {
                        let there = direction.get(candidate.site as usize);
                        closing = closing.max((0..D).map(|d| (there[d] - here[d]).powi(2)).sum());
                    }
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
