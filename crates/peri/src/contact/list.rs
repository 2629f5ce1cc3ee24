//! Which particles without a bond are near each other, and how near.

use crate::bonds::{Bonds, CellGrid};
use crate::field::{CHUNK, Field, chunk_range};
use crate::geometry::length;
use rayon::prelude::*;

/// Largest contact distance over the reference distance, and over the sum of the radii.
const OF_REFERENCE: f64 = 0.9;
const OF_RADII: f64 = 1.35;
/// Skin of the list, in spacings.
const SKIN: f64 = 0.5;
/// Farther than this many cells from the origin, particles are looked for in one place.
const FAR: f64 = (1_u64 << 38) as f64;

/// Pairs of particles without a bond that are nearer than their contact distance, a gap and a skin.
pub struct List<const D: usize> {
    /// Particles' radii, m; empty where all are `largest`.
    radii: Vec<f64>,
    largest: f64,
    gap: f64,
    skin: f64,
    /// Displacement at which the list was made.
    listed_at: Field<D>,
    /// Particles with candidates, ascending, and where each one's end.
    listed: Vec<Listed>,
    candidates: Vec<Candidate<D>>,
    /// Particles without bonds, ascending.
    pub alone: Vec<u32>,
    /// How often it was made.
    pub rebuilds: u64,
}

/// A particle that others are near to.
pub struct Listed {
    pub site: u32,
    /// Ends of its candidates, of which the first begin where those of the particle before it end.
    end: usize,
    pub volume: f64,
    /// Whether it has no bonds.
    pub alone: bool,
}

/// A particle near another, seen from there.
#[derive(Clone, Copy)]
pub struct Candidate<const D: usize> {
    pub site: u32,
    /// ξ, m.
    bond: [f64; D],
    /// d, m.
    pub distance: f64,
    pub volume: f64,
}

impl<const D: usize> List<D> {
    /// Of the undeformed body.
    pub fn new(bonds: &dyn Bonds<D>, gap: f64) -> Self {
        let volumes: Vec<f64> = bonds.particles().iter().map(|&site| bonds.volume(site as usize)).collect();
        let mean = volumes.iter().sum::<f64>() / volumes.len() as f64;
        let alike = volumes.iter().all(|&volume| volume == volumes[0]);
        let radius = |volume: f64| 0.5 * bonds.spacing() * (volume / mean).powf(1.0 / D as f64);
        let (mut radii, mut largest) = (Vec::new(), 0.5 * bonds.spacing());
        if !alike {
            radii = vec![0.0; bonds.sites()];
            bonds.particles().iter().zip(volumes).for_each(|(&site, v)| radii[site as usize] = radius(v));
            largest = radii.iter().copied().fold(0.0, f64::max);
        }
        let mut list = Self {
            radii,
            largest,
            gap,
            skin: SKIN * bonds.spacing(),
            listed_at: Field::zeros(0),
            listed: Vec::new(),
            candidates: Vec::new(),
            alone: Vec::new(),
            rebuilds: 0,
        };
        list.rebuild(bonds, &Field::zeros(bonds.sites()));
        list
    }

    /// Sets the skin, m; the list is made at the next update.
    pub fn set_skin(&mut self, skin: f64) {
        self.skin = skin.max(0.0).min(FAR * self.largest);
        self.listed_at = Field::zeros(0);
    }

    /// Rebuilds the list where a particle has moved by half of the skin since it was made.
    pub fn update(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>) {
        // a little less, for rounding
        let limit = (0.49 * self.skin).powi(2);
        let (now, then) = (displacement.components(), self.listed_at.components());
        let sites = bonds.sites();
        let moved = |chunk: usize| {
            let range = chunk_range(chunk, sites);
            let mut square = [0.0; CHUNK];
            for d in 0..D {
                let parts = now[d][range.clone()].iter().zip(&then[d][range.clone()]);
                square.iter_mut().zip(parts).for_each(|(s, (a, b))| *s += (a - b) * (a - b));
            }
            // NaN has moved, too
            !square[..range.len()].iter().all(|&s| s <= limit)
        };
        let stale = self.skin == 0.0 || self.listed_at.sites() != sites;
        if stale || (0..sites.div_ceil(CHUNK)).into_par_iter().any(moved) {
            self.rebuild(bonds, displacement);
        }
    }

    /// Takes in the pairs of sites whose bonds have just broken, each from both of its ends: the list is then that which would
    /// have been made of the bonds that are left.
    pub fn part(&mut self, bonds: &dyn Bonds<D>, pairs: &[[u32; 2]]) {
        if self.listed_at.sites() != bonds.sites() {
            // the next update makes it anew
            return;
        }
        let reach = self.gap + self.skin;
        let near = |&[own, other]: &[u32; 2]| {
            let candidate = self.candidate(bonds, own as usize, other as usize);
            let (_, r) = candidate.apart(&self.listed_at, own as usize);
            (r < candidate.distance + reach).then_some((own, candidate))
        };
        let mut found: Vec<(u32, Candidate<D>)> = pairs.par_iter().filter_map(near).collect();
        found.sort_unstable_by_key(|(own, candidate)| (*own, candidate.site));
        let (listed, candidates) = (std::mem::take(&mut self.listed), std::mem::take(&mut self.candidates));
        self.candidates.reserve(candidates.len() + found.len());
        let (mut at, mut start, mut found) = (0, 0, &found[..]);
        loop {
            let next = [listed.get(at).map(|own| own.site), found.first().map(|new| new.0)];
            let Some(site) = next.into_iter().flatten().min() else { break };
            let from = self.candidates.len();
            if let Some(own) = listed.get(at).filter(|own| own.site == site) {
                self.candidates.extend_from_slice(&candidates[start..own.end]);
                (at, start) = (at + 1, own.end);
            }
            let (new, others) = found.split_at(found.partition_point(|new| new.0 == site));
            found = others;
            if !new.is_empty() {
                self.candidates.extend(new.iter().map(|new| new.1));
                self.candidates[from..].sort_unstable_by_key(|candidate| candidate.site);
            }
            let (volume, alone) = (bonds.volume(site as usize), bonds.is_alone(site as usize));
            self.listed.push(Listed { site, end: self.candidates.len(), volume, alone });
        }
        let alone = pairs.iter().map(|pair| pair[0]).filter(|&site| bonds.is_alone(site as usize));
        self.alone.extend(alone);
        self.alone.sort_unstable();
        self.alone.dedup();
    }

    /// Makes the list for a displacement.
    pub fn rebuild(&mut self, bonds: &dyn Bonds<D>, displacement: &Field<D>) {
        let particles = bonds.particles();
        let reach = self.gap + self.skin;
        let edge = 2.0 * OF_RADII * self.largest + reach;
        let far = FAR * edge;
        let place = |&site: &u32| {
            let (position, moved) = (bonds.position(site as usize), displacement.get(site as usize));
            std::array::from_fn(|d| (position[d] + moved[d]).clamp(-far, far))
        };
        let places: Vec<[f64; D]> = particles.par_iter().map(place).collect();
        let grid = CellGrid::with_edge(&places, edge);
        let near = |own: usize, found: &mut Vec<u32>| {
            found.clear();
            let site = particles[own] as usize;
            // a little more: far from the origin places are rounded to 2⁻¹⁴ of an edge
            let radius = OF_RADII * (self.radius(site) + self.largest) + reach + 1e-3 * edge;
            let here = places[own];
            grid.near(here, radius, |other| {
                let there = places[other];
                let square: f64 = (0..D).map(|d| (there[d] - here[d]) * (there[d] - here[d])).sum();
                if other != own && square <= radius * radius {
                    found.push(particles[other]);
                }
            });
            found.sort_unstable();
        };
        let of = |part: usize| {
            let (mut listed, mut candidates, mut found) = (Vec::new(), Vec::new(), Vec::new());
            for own in chunk_range(part, particles.len()) {
                let site = particles[own] as usize;
                near(own, &mut found);
                let before = candidates.len();
                for &other in &found {
                    let candidate = self.candidate(bonds, site, other as usize);
                    let (_, r) = candidate.apart(displacement, site);
                    if r < candidate.distance + reach && !bonds.is_bonded(site, other as usize) {
                        candidates.push(candidate);
                    }
                }
                if candidates.len() > before {
                    let (volume, alone) = (bonds.volume(site), bonds.is_alone(site));
                    listed.push(Listed { site: site as u32, end: candidates.len(), volume, alone });
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
        self.alone = particles.iter().copied().filter(|&site| bonds.is_alone(site as usize)).collect();
        self.listed_at.clone_from(displacement);
        self.rebuilds += 1;
    }

    /// Radius of a particle, m.
    pub fn radius(&self, site: usize) -> f64 {
        self.radii.get(site).copied().unwrap_or(self.largest)
    }

    fn candidate(&self, bonds: &dyn Bonds<D>, site: usize, other: usize) -> Candidate<D> {
        let (here, there) = (bonds.position(site), bonds.position(other));
        let bond: [f64; D] = std::array::from_fn(|d| there[d] - here[d]);
        let distance = (OF_REFERENCE * length(bond)).min(OF_RADII * (self.radius(site) + self.radius(other)));
        Candidate { site: other as u32, bond, distance, volume: bonds.volume(other) }
    }

    /// The particles of a work item that have candidates, with them.
    pub fn in_chunk(&self, chunk: usize) -> impl Iterator<Item = (&Listed, &[Candidate<D>])> {
        let at = |chunk: usize| self.listed.partition_point(|own| (own.site as usize) < chunk * CHUNK);
        (at(chunk)..at(chunk + 1)).map(|k| {
            let start = k.checked_sub(1).map_or(0, |before| self.listed[before].end);
            (&self.listed[k], &self.candidates[start..self.listed[k].end])
        })
    }
}

/// A pair in contact, seen from one side.
pub struct Touch<const D: usize> {
    /// ζ/r.
    pub direction: [f64; D],
    /// d − r > 0, m.
    pub overlap: f64,
    /// V_J, m³.
    pub volume: f64,
}

impl<const D: usize> Candidate<D> {
    fn zeta(&self, displacement: &Field<D>, own: usize) -> [f64; D] {
        let (here, there) = (displacement.get(own), displacement.get(self.site as usize));
        std::array::from_fn(|d| self.bond[d] + (there[d] - here[d]))
    }

    /// ζ and r; both have the same bits from either side, but for the sign of ζ.
    pub fn apart(&self, displacement: &Field<D>, own: usize) -> ([f64; D], f64) {
        let zeta = self.zeta(displacement, own);
        (zeta, length(zeta))
    }

    /// Where it touches.
    pub fn touch(&self, displacement: &Field<D>, own: usize) -> Option<Touch<D>> {
        let zeta = self.zeta(displacement, own);
        // most are farther apart by much more than rounding, which costs no root to see
        if zeta.iter().map(|x| x * x).sum::<f64>() > (1.0 + 1e-9) * self.distance * self.distance {
            return None;
        }
        let r = length(zeta);
        if r < self.distance {
            let (along, size) = if r > 0.0 { (zeta, r) } else { (self.bond, length(self.bond)) };
            let direction = along.map(|x| x / size);
            Some(Touch { direction, overlap: self.distance - r, volume: self.volume })
        } else {
            None
        }
    }
}
