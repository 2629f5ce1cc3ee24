//! Fields over particles only: storage sites without a particle, of which a lattice has many, take no part in
//! sums and products.
//!
//! Particle k of such a field is that of site `particles()[k]`: work item after work item of the storage, so
//! that each item has its own part.

use super::load::Loads;
use super::rigid::RigidRegion;
use crate::bonds::BodyGeometry;
use crate::field::{CHUNK, Field};
use crate::parallel;
use std::ops::Range;

/// Particles in consecutive sites of one work item.
struct SiteRun {
    /// First site, in its work item.
    site: usize,
    /// First particle, in its work item.
    particle: usize,
    length: usize,
}

/// A particle with constrained or shared components.
pub struct HeldParticle {
    pub particle: usize,
    /// Number of the site in its work item.
    pub site: usize,
    /// Bits of these components.
    pub components: u8,
}

/// Positions of particles in storage.
#[derive(Default)]
pub struct ParticleMap {
    runs: Vec<SiteRun>,
    /// The runs of each work item, its first particle, and the number of particles at the end.
    items: Vec<Range<usize>>,
    first: Vec<usize>,
    held: Vec<HeldParticle>,
    /// Regions that move as a whole: bits of the shared components, particles.
    shared: Vec<(u8, Vec<usize>)>,
}

impl ParticleMap {
    /// Maps the particles of a body and its loads.
    pub fn new<const D: usize>(bonds: &dyn BodyGeometry<D>, loads: &Loads<D>) -> Self {
        let mut places = Self { first: vec![0], ..Self::default() };
        let particles = bonds.particles();
        let mut next = 0;
        for item in 0..bonds.sites().div_ceil(CHUNK) {
            let (begin, first) = (places.runs.len(), next);
            while next < particles.len() && particles[next] as usize / CHUNK == item {
                let (site, particle) = (particles[next] as usize % CHUNK, next - first);
                match places.runs[begin..].last_mut() {
                    Some(run) if run.site + run.length == site => run.length += 1,
                    _ => places.runs.push(SiteRun { site, particle, length: 1 }),
                }
                next += 1;
            }
            places.items.push(begin..places.runs.len());
            places.first.push(next);
        }
        let bound = |(particle, &site): (usize, &u32)| {
            let components = loads.bound().get(site as usize).copied().unwrap_or(0);
            (components != 0).then_some(HeldParticle { particle, site: site as usize % CHUNK, components })
        };
        places.held = particles.iter().enumerate().filter_map(bound).collect();
        let place = |site: &u32| particles.binary_search(site).ok();
        let of_region =
            |region: &RigidRegion| (region.components, region.sites.iter().filter_map(place).collect());
        places.shared = loads.rigid.iter().map(of_region).collect();
        places
    }

    /// Bits of the shared components and particles of each region that moves as a whole.
    pub fn shared(&self) -> &[(u8, Vec<usize>)] {
        &self.shared
    }

    /// Particles of a range with constrained or shared components.
    pub fn constrained(&self, particles: Range<usize>) -> &[HeldParticle] {
        let place = |particle: usize| self.held.partition_point(|held| held.particle < particle);
        &self.held[place(particles.start)..place(particles.end)]
    }

    /// The particles of a work item of the storage.
    pub fn of_item(&self, item: usize) -> Range<usize> {
        self.first[item]..self.first[item + 1]
    }

    /// Splits a field over particles at the work items of the storage.
    pub fn parts_mut<'a, const D: usize>(&self, field: &'a mut Field<D>) -> Vec<[&'a mut [f64]; D]> {
        let mut rest = field.components_mut();
        let cut = |item: usize| {
            let length = self.of_item(item).len();
            rest.each_mut().map(|rest| {
                let (part, others) = std::mem::take(rest).split_at_mut(length);
                *rest = others;
                part
            })
        };
        (0..self.items.len()).map(cut).collect()
    }

    /// Gathers the particles of a work item from its sites, in one component.
    pub fn gather(&self, item: usize, sites: &[f64], particles: &mut [f64]) {
        for run in &self.runs[self.items[item].clone()] {
            let of_run = run.particle..run.particle + run.length;
            particles[of_run].copy_from_slice(&sites[run.site..run.site + run.length]);
        }
    }

    /// sites += factor·particles.
    pub fn add_scaled<const D: usize>(&self, sites: &mut Field<D>, factor: f64, particles: &Field<D>) {
        let values = particles.components();
        let add = |item: usize, sites: [&mut [f64]; D]| {
            let first = self.first[item];
            for run in &self.runs[self.items[item].clone()] {
                let from = first + run.particle;
                for d in 0..D {
                    let value = &values[d][from..from + run.length];
                    let there = &mut sites[d][run.site..run.site + run.length];
                    for k in 0..run.length {
                        there[k] += factor * value[k];
                    }
                }
            }
        };
        let items = sites.chunks_mut();
        if items.len() < FEW {
            items.into_iter().enumerate().for_each(|(item, sites)| add(item, sites));
        } else {
            parallel::for_items(items, add);
        }
    }
}

/// Number of work items of vector operations above which other threads are used.
pub const FEW: usize = 8;

/// Collects the results of `work` for all items, in their order.
pub fn in_order<T: Send, R: Send>(items: Vec<T>, work: impl Fn(usize, T) -> R + Sync + Send) -> Vec<R> {
    if items.len() < FEW {
        items.into_iter().enumerate().map(|(index, item)| work(index, item)).collect()
    } else {
        parallel::map_items(items, work)
    }
}
