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
//! The pairs come from a list of all that are within d, what is about to touch, and a skin, made anew where a particle
//! has moved by half of the skin. Pairs beyond d add nothing, not even a rounding: the list is no part of the state, and how often it is made
//! makes no difference to any bit.
//!
//! Limits. Contact knows distances only: a particle that leaps past another in one step stays there. Force and energy
//! are finite in full overlap (r = 0: κcd/δ along the reference ξ, the direction it came from; energy ½κcd²/δ V_I V_J),
//! so that loads beyond that press particles through each other. No friction.

use crate::bonds::{Bonds, CellGrid};
use crate::error::Error;
use crate::field::{CHUNK, Field, chunk_range};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// κ of Macek & Silling (2007).
pub const STIFFNESS: f64 = 15.0;
/// Largest contact distance over the reference distance, and over the sum of the radii.
const OF_REFERENCE: f64 = 0.9;
const OF_RADII: f64 = 1.35;
/// Skin of the list, in spacings.
const SKIN: f64 = 0.5;
/// Largest gap, in spacings, over which two particles may be about to touch.
const NEAR: f64 = 0.25;
/// Farther than this many cells from the origin, particles are looked for in one place.
const FAR: f64 = (1_u64 << 38) as f64;

/// Contact between the particles of a body.
pub struct Contact<const D: usize> {
    /// κc/δ, the force density on a particle per volume of the other and per overlap.
    stiffness: f64,
    /// Particles' radii, m; empty where all are `largest`.
    radii: Vec<f64>,
    largest: f64,
    largest_volume: f64,
    /// Largest gap of particles about to touch, m.
    near: f64,
    skin: f64,
    /// Displacement at which the list was made.
    listed_at: Field<D>,
    /// Particles with candidates, ascending, and where each one's begin.
    listed: Vec<Listed>,
    candidates: Vec<Candidate<D>>,
    /// Particles without bonds, ascending.
    alone: Vec<u32>,
    rebuilds: u64,
}

/// A particle that others are near to.
struct Listed {
    slot: u32,
    /// Ends of its candidates, of which the first begin where those of the particle before it end.
    end: usize,
    volume: f64,
    alone: bool,
}

/// A particle near another, seen from there.
#[derive(Clone, Copy)]
struct Candidate<const D: usize> {
    slot: u32,
    /// ξ, m.
    bond: [f64; D],
    /// d, m.
    distance: f64,
    volume: f64,
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
        let volumes: Vec<f64> = bonds.particles().iter().map(|&slot| bonds.volume(slot as usize)).collect();
        let largest_volume = volumes.iter().copied().fold(0.0, f64::max);
        let mean = volumes.iter().sum::<f64>() / volumes.len() as f64;
        let alike = volumes.iter().all(|&volume| volume == volumes[0]);
        let radius = |volume: f64| 0.5 * bonds.spacing() * (volume / mean).powf(1.0 / D as f64);
        let (mut radii, mut largest) = (Vec::new(), 0.5 * bonds.spacing());
        if !alike {
            radii = vec![0.0; bonds.slots()];
            bonds.particles().iter().zip(volumes).for_each(|(&slot, v)| radii[slot as usize] = radius(v));
            largest = radii.iter().copied().fold(0.0, f64::max);
        }
        let mut contact = Self {
            stiffness: stiffness * 6.0 * modulus / bonds.horizon(),
            radii,
            largest,
            largest_volume,
            near: NEAR * bonds.spacing(),
            skin: SKIN * bonds.spacing(),
            listed_at: Field::zeros(0),
            listed: Vec::new(),
            candidates: Vec::new(),
            alone: Vec::new(),
            rebuilds: 0,
        };
        contact.rebuild(bonds, &Field::zeros(bonds.slots()));
        Ok(contact)
    }

    /// With another skin, in m: a thin one is filled often, a thick one holds many pairs in vain. The list is made at the
    /// next update. Values that are not positive count as 0: made at every update.
    pub fn with_skin(mut self, skin: f64) -> Self {
        self.skin = skin.max(0.0).min(FAR * self.largest);
        self.listed_at = Field::zeros(0);
        self
    }

    /// Whether it repels: κ > 0.
    pub fn repels(&self) -> bool {
        self.stiffness > 0.0
    }

    /// How often the list was made.
    pub fn rebuilds(&self) -> u64 {
        self.rebuilds
    }

    /// Makes the list anew where a particle has moved by half of the skin since it was made.
    pub fn update(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>) {
        // a little less, for rounding
        let limit = (0.49 * self.skin).powi(2);
        let (now, then) = (displacement.components(), self.listed_at.components());
        let slots = bonds.slots();
        let moved = |chunk: usize| {
            let range = chunk_range(chunk, slots);
            let mut square = [0.0; CHUNK];
            for d in 0..D {
                let parts = now[d][range.clone()].iter().zip(&then[d][range.clone()]);
                square.iter_mut().zip(parts).for_each(|(s, (a, b))| *s += (a - b) * (a - b));
            }
            // NaN has moved, too
            !square[..range.len()].iter().all(|&s| s <= limit)
        };
        let stale = self.skin == 0.0 || self.listed_at.slots() != slots;
        if stale || (0..slots.div_ceil(CHUNK)).into_par_iter().any(moved) {
            self.rebuild(bonds, displacement);
        }
    }

    /// Makes the list for a displacement; to be called where bonds have changed.
    pub fn rebuild(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>) {
        let particles = bonds.particles();
        let reach = self.near + self.skin;
        let edge = 2.0 * OF_RADII * self.largest + reach;
        let far = FAR * edge;
        let place = |&slot: &u32| {
            let (position, moved) = (bonds.position(slot as usize), displacement.get(slot as usize));
            std::array::from_fn(|d| (position[d] + moved[d]).clamp(-far, far))
        };
        let places: Vec<[f64; D]> = particles.par_iter().map(place).collect();
        let grid = CellGrid::with_edge(&places, edge);
        let near = |own: usize, found: &mut Vec<u32>| {
            found.clear();
            let slot = particles[own] as usize;
            let radius = OF_RADII * (self.radius(slot) + self.largest) + reach;
            // a little more: far from the origin places are rounded to 2⁻¹⁴ of an edge
            grid.near(places[own], radius + 1e-3 * edge, |other| {
                if other != own {
                    found.push(particles[other]);
                }
            });
            found.sort_unstable();
        };
        let of = |part: usize| {
            let (mut listed, mut candidates, mut found) = (Vec::new(), Vec::new(), Vec::new());
            for own in chunk_range(part, particles.len()) {
                let slot = particles[own] as usize;
                near(own, &mut found);
                let before = candidates.len();
                for &other in &found {
                    let candidate = self.candidate(bonds, slot, other as usize);
                    let (_, r) = candidate.apart(displacement, slot);
                    if r < candidate.distance + reach && !bonds.is_bonded(slot, other as usize) {
                        candidates.push(candidate);
                    }
                }
                if candidates.len() > before {
                    let (volume, alone) = (bonds.volume(slot), bonds.is_alone(slot));
                    listed.push(Listed { slot: slot as u32, end: candidates.len(), volume, alone });
                }
            }
            (listed, candidates)
        };
        let parts: Vec<(Vec<Listed>, Vec<Candidate<D>>)> =
            (0..particles.len().div_ceil(CHUNK)).into_par_iter().map(of).collect();
        self.listed.clear();
        self.candidates.clear();
        for (listed, candidates) in parts {
            let before = self.candidates.len();
            self.listed.extend(listed.into_iter().map(|own| Listed { end: before + own.end, ..own }));
            self.candidates.extend(candidates);
        }
        self.alone = particles.iter().copied().filter(|&slot| bonds.is_alone(slot as usize)).collect();
        self.listed_at.clone_from(displacement);
        self.rebuilds += 1;
    }

    fn radius(&self, slot: usize) -> f64 {
        self.radii.get(slot).copied().unwrap_or(self.largest)
    }

    fn candidate(&self, bonds: &dyn Bonds<D>, slot: usize, other: usize) -> Candidate<D> {
        let (here, there) = (bonds.position(slot), bonds.position(other));
        let bond: [f64; D] = std::array::from_fn(|d| there[d] - here[d]);
        let distance =
            (OF_REFERENCE * length(&bond)).min(OF_RADII * (self.radius(slot) + self.radius(other)));
        Candidate { slot: other as u32, bond, distance, volume: bonds.volume(other) }
    }

    /// The particles of a work item that have candidates, with them.
    fn in_chunk(&self, chunk: usize) -> impl Iterator<Item = (&Listed, &[Candidate<D>])> {
        let at = |chunk: usize| self.listed.partition_point(|own| (own.slot as usize) < chunk * CHUNK);
        (at(chunk)..at(chunk + 1)).map(|k| {
            let start = k.checked_sub(1).map_or(0, |before| self.listed[before].end);
            (&self.listed[k], &self.candidates[start..self.listed[k].end])
        })
    }

    /// Adds the force densities −Σ_J κ(c/δ)(d − r) V_J ζ/r, N/m³, on the particles of work item `chunk`.
    pub fn force(&self, displacement: &Field<D>, chunk: usize, force: &mut [&mut [f64]; D]) {
        for (own, candidates) in self.in_chunk(chunk) {
            let mut sum = None;
            for touch in candidates.iter().filter_map(|c| c.touch(displacement, own.slot as usize)) {
                let push = self.stiffness * touch.overlap * touch.volume;
                let sum = sum.get_or_insert([0.0; D]);
                for d in 0..D {
                    sum[d] -= push * touch.direction[d];
                }
            }
            // what is listed but does not touch must not even turn −0 into 0
            let Some(sum) = sum else { continue };
            for d in 0..D {
                force[d][own.slot as usize - chunk * CHUNK] += sum[d];
            }
        }
    }

    /// What touches.
    pub fn touching(&self, displacement: &Field<D>) -> Touching {
        let none = Touching { pairs: 0, overlap: 0.0, energy: 0.0 };
        let of = |chunk: usize| {
            let mut part = none;
            for (own, candidates) in self.in_chunk(chunk) {
                for candidate in candidates {
                    let Some(touch) = candidate.touch(displacement, own.slot as usize) else { continue };
                    part.pairs += u64::from(own.slot < candidate.slot);
                    part.overlap = part.overlap.max(touch.overlap / candidate.distance);
                    // half of a pair's from either side
                    part.energy +=
                        0.25 * self.stiffness * touch.overlap * touch.overlap * touch.volume * own.volume;
                }
            }
            part
        };
        let parts: Vec<Touching> =
            (0..displacement.slots().div_ceil(CHUNK)).into_par_iter().map(of).collect();
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
            let sums = self.in_chunk(chunk).map(|(own, candidates)| {
                let touches = candidates.iter().filter_map(|c| c.touch(displacement, own.slot as usize));
                touches.map(|touch| self.stiffness * touch.volume).sum::<f64>()
            });
            sums.fold(0.0, f64::max)
        };
        (0..displacement.slots().div_ceil(CHUNK)).into_par_iter().map(of).reduce(|| 0.0, f64::max)
    }

    /// κ(c/δ) V of the largest particle: the least that [`Contact::greatest_stiffness`] is where anything touches, if all
    /// are alike.
    pub fn pair_stiffness(&self) -> f64 {
        self.stiffness * self.largest_volume
    }

    /// Adds to the Gershgorin sums of dynamic relaxation, in units of `tangent`, those of what touches or is about to:
    /// Σ_J κ(c/δ) V_J (1 + max_{d≠e} |n_d n_e|). A particle that became heavy only in touch would be driven far into
    /// another as a light one, out again as a heavy one, and so on for ever. A particle without bonds has twice that alone:
    /// it starts each step from rest, see [`Contact::still`], and so must not go farther than a gradient step may.
    pub fn add_stiffness(&self, displacement: &Field<D>, tangent: f64, masses: &mut [f64]) {
        let of = |own: &Listed, candidates: &[Candidate<D>]| {
            let mut sum = 0.0;
            for candidate in candidates {
                let (zeta, r) = candidate.apart(displacement, own.slot as usize);
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
            let all = self.in_chunk(chunk).map(|(own, candidates)| (own, of(own, candidates)));
            all.filter(|(_, sum)| *sum > 0.0).collect()
        });
        let sums: Vec<Vec<(&Listed, f64)>> = sums.collect();
        for (own, sum) in sums.into_iter().flatten() {
            let mass = &mut masses[own.slot as usize];
            *mass = if own.alone { 2.0 * sum } else { *mass + sum };
        }
    }

    /// How far a step along a direction may go so that none leaps past another: by a quarter of a spacing against each
    /// other where they touch or are about to, by half of one at all. ∞ along a direction of zeros.
    pub fn longest_step(&self, displacement: &Field<D>, direction: &Field<D>) -> f64 {
        let slots = displacement.slots();
        let of = |chunk: usize| {
            let (mut farthest, mut closing) = (0.0_f64, 0.0_f64);
            let parts = direction.components().map(|d| &d[chunk_range(chunk, slots)]);
            for k in 0..parts[0].len() {
                farthest = farthest.max((0..D).map(|d| parts[d][k] * parts[d][k]).sum());
            }
            for (own, candidates) in self.in_chunk(chunk) {
                let slot = own.slot as usize;
                let here = direction.get(slot);
                for candidate in candidates {
                    if candidate.apart(displacement, slot).1 < candidate.distance + self.near {
                        let there = direction.get(candidate.slot as usize);
                        closing = closing.max((0..D).map(|d| (there[d] - here[d]).powi(2)).sum());
                    }
                }
            }
            [farthest, closing]
        };
        let parts = (0..slots.div_ceil(CHUNK)).into_par_iter().map(of);
        let [farthest, closing] = parts.reduce(|| [0.0; 2], |a, b| [a[0].max(b[0]), a[1].max(b[1])]);
        self.near / (0.5 * farthest.sqrt()).max(closing.sqrt())
    }

    /// Brings particles without bonds to rest: what is pushed aside does not fly on in a search for equilibrium.
    pub fn still(&self, velocity: &mut Field<D>) {
        self.alone.iter().for_each(|&slot| velocity.set(slot as usize, [0.0; D]));
    }
}

/// A pair in contact, seen from one side.
struct Touch<const D: usize> {
    /// ζ/r.
    direction: [f64; D],
    /// d − r > 0, m.
    overlap: f64,
    /// V_J, m³.
    volume: f64,
}

impl<const D: usize> Candidate<D> {
    /// ζ and r; both have the same bits from either side, but for the sign of ζ.
    fn apart(&self, displacement: &Field<D>, own: usize) -> ([f64; D], f64) {
        let (here, there) = (displacement.get(own), displacement.get(self.slot as usize));
        let zeta = std::array::from_fn(|d| self.bond[d] + (there[d] - here[d]));
        (zeta, length(&zeta))
    }

    fn touch(&self, displacement: &Field<D>, own: usize) -> Option<Touch<D>> {
        let (zeta, r) = self.apart(displacement, own);
        if r < self.distance {
            let (along, size) = if r > 0.0 { (zeta, r) } else { (self.bond, length(&self.bond)) };
            let direction = along.map(|x| x / size);
            Some(Touch { direction, overlap: self.distance - r, volume: self.volume })
        } else {
            None
        }
    }
}

fn length<const D: usize>(vector: &[f64; D]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}
