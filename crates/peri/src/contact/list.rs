//! Lists unbonded pairs of particles near each other, with their distances.

use super::vicinity::Vicinity;
use crate::bonds::{BodyGeometry, CellGrid};
use crate::field::{CHUNK, Field, chunk_range};
use crate::geometry::length;
use crate::parallel;
use std::ops::Range;

/// Largest contact distance over the reference distance, and over the sum of the radii.
const REFERENCE_FACTOR: f64 = 0.9;
const RADII_FACTOR: f64 = 1.35;
/// Skin of the list, in spacings.
const SKIN: f64 = 0.5;
/// Upper bound of the relative rounding error of a squared length in single precision.
const ROUNDED: f64 = 1e-6;
/// Particles farther than this many cells from the origin share one cell.
const FARTHEST_CELLS: f64 = (1_u64 << 38) as f64;

/// Pairs of particles without a bond that are nearer than their contact distance, a gap and a skin.
#[derive(Clone)]
pub struct ContactList<const D: usize> {
    /// Particles' radii, m; empty where all are `largest`.
    radii: Vec<f64>,
    largest: f64,
    /// Volumes, m³, likewise; empty where all are `volume`.
    volumes: Vec<f64>,
    volume: f64,
    spacing: f64,
    gap: f64,
    skin: f64,
    /// Positions of particles when the list was made; `None` before, and if it must be rebuilt.
    vicinity: Option<Vicinity<D>>,
    /// Particles with candidates, ascending, with the end of each one's candidates.
    listed: Vec<ListedParticle>,
    candidates: Vec<ContactCandidate<D>>,
    /// Particles without bonds, ascending.
    pub alone: Vec<u32>,
    /// Number of rebuilds.
    pub rebuilds: u64,
}

/// A particle with others near it.
#[derive(Clone, Copy)]
pub struct ListedParticle {
    pub site: u32,
    /// End of its candidates, which begin at the end of those of the previous particle.
    end: usize,
    /// True if it has no bonds.
    pub alone: bool,
}

/// A particle near another, as seen from the latter. Lists are long and most pairs are apart, so it holds
/// only what shows that.
#[derive(Clone, Copy)]
struct ContactCandidate<const D: usize> {
    site: u32,
    /// ξ in spacings, rounded.
    bond: [f32; D],
}

/// A particle near enough to another, as seen from the latter.
pub struct NearbyParticle<const D: usize> {
    pub site: u32,
    /// ξ, m.
    bond: [f64; D],
    /// d, m.
    pub distance: f64,
    /// ζ, m, and r = |ζ|: the same bits from either side, except for the sign of ζ.
    pub zeta: [f64; D],
    pub r: f64,
}

impl<const D: usize> NearbyParticle<D> {
    /// ζ/r; ξ/|ξ| for two particles at one point.
    pub fn direction(&self) -> [f64; D] {
        let (along, size) = if self.r > 0.0 { (self.zeta, self.r) } else { (self.bond, length(self.bond)) };
        along.map(|x| x / size)
    }

    /// d − r, m.
    pub fn overlap(&self) -> f64 {
        self.distance - self.r
    }

    /// d − r at another displacement, m; `own` is the site of the first particle.
    pub fn overlap_at(&self, displacement: &Field<D>, own: usize) -> f64 {
        let (here, there) = (displacement.get(own), displacement.get(self.site as usize));
        self.distance - length(std::array::from_fn::<f64, D, _>(|d| self.bond[d] + (there[d] - here[d])))
    }
}

impl<const D: usize> ContactList<D> {
    /// Creates an empty list for the undeformed body.
    pub fn new(bonds: &dyn BodyGeometry<D>, gap: f64) -> Self {
        let volumes: Vec<f64> = bonds.particles().iter().map(|&site| bonds.volume(site as usize)).collect();
        let mean = volumes.iter().sum::<f64>() / volumes.len() as f64;
        let alike = volumes.iter().all(|&volume| volume == volumes[0]);
        let radius = |volume: f64| 0.5 * bonds.spacing() * (volume / mean).powf(1.0 / D as f64);
        let (mut radii, mut largest) = (Vec::new(), 0.5 * bonds.spacing());
        let (volume, mut of_sites) = (volumes.first().copied().unwrap_or(0.0), Vec::new());
        if !alike {
            (radii, of_sites) = (vec![0.0; bonds.sites()], vec![0.0; bonds.sites()]);
            for (&site, v) in bonds.particles().iter().zip(volumes) {
                (radii[site as usize], of_sites[site as usize]) = (radius(v), v);
            }
            largest = radii.iter().copied().fold(0.0, f64::max);
        }
        let mut list = Self {
            radii,
            largest,
            volumes: of_sites,
            volume,
            spacing: bonds.spacing(),
            gap,
            skin: SKIN * bonds.spacing(),
            vicinity: None,
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
        self.skin = skin.max(0.0).min(FARTHEST_CELLS * self.largest);
        self.vicinity = None;
    }

    /// Rebuilds the list if pairs outside it may have come near since it was made.
    pub fn update(&mut self, bonds: &dyn BodyGeometry<D>, displacement: &Field<D>) {
        if !self
            .vicinity
            .as_mut()
            .is_some_and(|vicinity| vicinity.is_current(bonds.particles(), displacement))
        {
            self.rebuild(bonds, displacement);
        }
    }

    /// Makes the list hold for a displacement and as long as possible.
    #[cfg(feature = "gpu")]
    pub fn renew(&mut self, bonds: &dyn BodyGeometry<D>, displacement: &Field<D>) {
        let compares = |vicinity: &mut Vicinity<D>| vicinity.compare_at(bonds.particles(), displacement);
        let holds = self.skin > 0.0 && self.vicinity.as_mut().is_some_and(compares);
        if !holds {
            self.rebuild(bonds, displacement);
        }
    }

    /// Distance by which every particle may move since [`Self::renew`] until the list must be renewed, m.
    #[cfg(feature = "gpu")]
    pub fn room(&self) -> f64 {
        self.vicinity.as_ref().map_or(0.0, Vicinity::room)
    }

    /// Iterates over the particles with candidates, and the sites of these, ascending.
    #[cfg(feature = "gpu")]
    pub fn candidates(&self) -> impl Iterator<Item = (u32, impl Iterator<Item = u32> + '_)> + '_ {
        self.listed.iter().enumerate().map(|(k, own)| {
            let start = k.checked_sub(1).map_or(0, |before| self.listed[before].end);
            (own.site, self.candidates[start..own.end].iter().map(|candidate| candidate.site))
        })
    }

    /// Adds the pairs of sites whose bonds have just broken, each from both ends: the result equals a list
    /// made from the remaining bonds.
    pub fn add_broken_pairs(&mut self, bonds: &dyn BodyGeometry<D>, pairs: &[[u32; 2]]) {
        // otherwise the next update rebuilds it
        let Some(vicinity) = &self.vicinity else { return };
        let reach = self.gap + self.skin;
        let near = |&[own, other]: &[u32; 2]| {
            let bond = difference(bonds.position(own as usize), bonds.position(other as usize));
            let near = self.near(own as usize, other as usize, bond, &vicinity.listed_at, reach)?;
            Some((own, self.candidate(&near)))
        };
        let found: Vec<Option<(u32, ContactCandidate<D>)>> = parallel::map_each(pairs, near);
        let mut found: Vec<(u32, ContactCandidate<D>)> = found.into_iter().flatten().collect();
        found.sort_unstable_by_key(|(own, candidate)| (*own, candidate.site));
        let (listed, candidates) = (std::mem::take(&mut self.listed), std::mem::take(&mut self.candidates));
        self.candidates.reserve(candidates.len() + found.len());
        let (mut at, mut start, mut found) = (0, 0, &found[..]);
        loop {
            let next = [listed.get(at).map(|own| own.site), found.first().map(|new| new.0)];
            let Some(site) = next.into_iter().flatten().min() else { break };
            let (from, mut known) = (self.candidates.len(), &[][..]);
            if let Some(own) = listed.get(at).filter(|own| own.site == site) {
                known = &candidates[start..own.end];
                self.candidates.extend_from_slice(known);
                (at, start) = (at + 1, own.end);
            }
            let (new, others) = found.split_at(found.partition_point(|new| new.0 == site));
            found = others;
            if !new.is_empty() {
                // a list made after the bonds broke has these pairs
                let lacks = |new: &&(u32, ContactCandidate<D>)| {
                    known.binary_search_by_key(&new.1.site, |c| c.site).is_err()
                };
                self.candidates.extend(new.iter().filter(lacks).map(|new| new.1));
                self.candidates[from..].sort_unstable_by_key(|candidate| candidate.site);
            }
            self.listed.push(ListedParticle {
                site,
                end: self.candidates.len(),
                alone: bonds.is_alone(site as usize),
            });
        }
        let alone = pairs.iter().map(|pair| pair[0]).filter(|&site| bonds.is_alone(site as usize));
        self.alone.extend(alone);
        self.alone.sort_unstable();
        self.alone.dedup();
    }

    /// Rebuilds the list for a displacement.
    pub fn rebuild(&mut self, bonds: &dyn BodyGeometry<D>, displacement: &Field<D>) {
        // frees its memory first
        self.vicinity = None;
        let particles = bonds.particles();
        let reach = self.gap + self.skin;
        let edge = 2.0 * RADII_FACTOR * self.largest + reach;
        let far = FARTHEST_CELLS * edge;
        let home: Vec<[f64; D]> = parallel::map_each(particles, |&site| bonds.position(site as usize));
        let place = |own: usize| {
            let moved = displacement.get(particles[own] as usize);
            std::array::from_fn(|d| (home[own][d] + moved[d]).clamp(-far, far))
        };
        let places: Vec<[f64; D]> = parallel::map(particles.len(), place);
        let grid = CellGrid::with_edge(&places, edge);
        let near = |own: usize, found: &mut Vec<u32>| {
            found.clear();
            let site = particles[own] as usize;
            // a little more: far from the origin positions are rounded to 2⁻¹⁴ of an edge
            let radius = RADII_FACTOR * (self.radius(site) + self.largest) + reach + 1e-3 * edge;
            let here = places[own];
            grid.near(here, radius, |other| {
                let there = places[other];
                let square: f64 = (0..D).map(|d| (there[d] - here[d]) * (there[d] - here[d])).sum();
                if other != own && square <= radius * radius {
                    found.push(other as u32);
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
                    let there = particles[other as usize] as usize;
                    let bond = difference(home[own], home[other as usize]);
                    let near = self.near(site, there, bond, displacement, reach);
                    candidates.extend(
                        near.filter(|_| !bonds.is_bonded(site, there)).map(|near| self.candidate(&near)),
                    );
                }
                if candidates.len() > before {
                    let alone = bonds.is_alone(site);
                    listed.push(ListedParticle { site: site as u32, end: candidates.len(), alone });
                }
            }
            (listed, candidates)
        };
        let parts: Vec<(Vec<ListedParticle>, Vec<ContactCandidate<D>>)> =
            parallel::map(particles.len().div_ceil(CHUNK), of);
        self.listed.clear();
        self.candidates.clear();
        for (listed, candidates) in parts {
            let before = self.candidates.len();
            self.listed.extend(listed.into_iter().map(|own| ListedParticle { end: before + own.end, ..own }));
            self.candidates.extend(candidates);
        }
        self.alone = particles.iter().copied().filter(|&site| bonds.is_alone(site as usize)).collect();
        self.vicinity = Some(Vicinity::new(grid, displacement, edge, self.skin));
        self.rebuilds += 1;
    }

    /// Volume of a particle, m³.
    pub fn volume(&self, site: usize) -> f64 {
        self.volumes.get(site).copied().unwrap_or(self.volume)
    }

    /// Radius of a particle, m.
    pub fn radius(&self, site: usize) -> f64 {
        self.radii.get(site).copied().unwrap_or(self.largest)
    }

    /// Contact distance d of two particles with the reference bond ξ, m.
    pub fn distance(&self, own: usize, other: usize, bond: [f64; D]) -> f64 {
        let radii = RADII_FACTOR * (self.radius(own) + self.radius(other));
        (REFERENCE_FACTOR * length(bond)).min(radii)
    }

    /// Returns the pair of two particles with the reference bond ξ if r < d + `gap`.
    fn near(
        &self,
        own: usize,
        other: usize,
        bond: [f64; D],
        displacement: &Field<D>,
        gap: f64,
    ) -> Option<NearbyParticle<D>> {
        let distance = self.distance(own, other, bond);
        let (here, there) = (displacement.get(own), displacement.get(other));
        let zeta = std::array::from_fn(|d| bond[d] + (there[d] - here[d]));
        let r = length(zeta);
        (r < distance + gap).then_some(NearbyParticle { site: other as u32, bond, distance, zeta, r })
    }

    fn candidate(&self, near: &NearbyParticle<D>) -> ContactCandidate<D> {
        ContactCandidate { site: near.site, bond: near.bond.map(|x| (x / self.spacing) as f32) }
    }

    /// Iterates over the particles of `sites` that have others at r < d + `gap`, up to the gap of the list,
    /// with these.
    pub fn pairs<'a>(
        &'a self,
        bonds: &'a dyn BodyGeometry<D>,
        displacement: &'a Field<D>,
        sites: Range<usize>,
        gap: f64,
    ) -> impl Iterator<Item = (ListedParticle, impl Iterator<Item = NearbyParticle<D>> + 'a)> + 'a {
        let at = |site: usize| self.listed.partition_point(|own| (own.site as usize) < site);
        let most = 2.0 * RADII_FACTOR * self.largest;
        (at(sites.start)..at(sites.end)).map(move |k| {
            let start = k.checked_sub(1).map_or(0, |before| self.listed[before].end);
            let listed = self.listed[k];
            let own = listed.site as usize;
            let here = displacement.get(own);
            let near = move |candidate: &ContactCandidate<D>| {
                let other = candidate.site as usize;
                let there = displacement.get(other);
                let (mut reference, mut square) = (0.0, 0.0);
                for d in 0..D {
                    let bond = self.spacing * f64::from(candidate.bond[d]);
                    let zeta = bond + (there[d] - here[d]);
                    reference += bond * bond;
                    square += zeta * zeta;
                }
                // most are apart by far more than the single-precision rounding of ξ; no root is needed to
                // see it
                let closest = (REFERENCE_FACTOR * REFERENCE_FACTOR * reference).min(most * most);
                if square
                    > 2.0 * gap * gap + (1.0 + f64::from(gap > 0.0) + ROUNDED) * closest + ROUNDED * reference
                {
                    return None;
                }
                let bond = difference(bonds.position(own), bonds.position(other));
                self.near(own, other, bond, displacement, gap)
            };
            (listed, self.candidates[start..listed.end].iter().filter_map(near))
        })
    }
}

pub fn difference<const D: usize>(from: [f64; D], to: [f64; D]) -> [f64; D] {
    std::array::from_fn(|d| to[d] - from[d])
}
