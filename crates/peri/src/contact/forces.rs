//! Forces, energy and overlaps of all contacts of a body.

use super::list::{ListedParticle, NearbyParticle};
use super::{Contact, ContactSummary};
use crate::bonds::BodyGeometry;
use crate::field::{CHUNK, Field, chunk_range};
use crate::parallel;
use std::ops::Range;

impl<const D: usize> Contact<D> {
    /// Stiffness of a pair, N/m⁷.
    pub(super) fn pair(&self, own: u32, other: u32) -> f64 {
        let Some(moduli) = &self.moduli else { return self.stiffness };
        let [a, b] = [own, other].map(|site| moduli.value_at(site as usize));
        self.stiffness * 2.0 * a * b / (a + b)
    }

    /// Iterates over the particles of `sites` that have others at r < d + `gap`, with these; empty if
    /// particles do not repel each other.
    pub(super) fn pairs<'a>(
        &'a self,
        bonds: &'a dyn BodyGeometry<D>,
        displacement: &'a Field<D>,
        sites: Range<usize>,
        gap: f64,
    ) -> impl Iterator<Item = (ListedParticle, impl Iterator<Item = NearbyParticle<D>> + 'a)> + 'a {
        self.has_pairs().then(|| self.list.pairs(bonds, displacement, sites, gap)).into_iter().flatten()
    }

    /// Adds the force densities of pairs, −Σ_J k(d − r) V_J ζ/r, of surfaces, and of friction between
    /// equilibria, N/m³, on the particles from the site `start` on, of one work item.
    pub fn force(
        &self,
        bonds: &dyn BodyGeometry<D>,
        displacement: &Field<D>,
        start: usize,
        force: &mut [&mut [f64]; D],
    ) {
        if let Some(surfaces) = &self.surfaces {
            surfaces.force(start, force);
        }
        if let Some(ties) = &self.ties {
            ties.force(start, force);
        }
        self.hold_pairs(displacement, start, force);
        for (own, touching) in self.pairs(bonds, displacement, start..start + force[0].len(), 0.0) {
            let mut sum = None;
            for touch in touching {
                let push =
                    self.pair(own.site, touch.site) * touch.overlap() * bonds.volume(touch.site as usize);
                let (sum, direction) = (sum.get_or_insert([0.0; D]), touch.direction());
                for d in 0..D {
                    sum[d] -= push * direction[d];
                }
            }
            // pairs beyond contact must not even turn −0 into 0
            let Some(sum) = sum else { continue };
            for d in 0..D {
                force[d][own.site as usize - start] += sum[d];
            }
        }
    }

    /// Greatest overlap 1 − r/d of the pairs as stiff as the material, with their distance d, m.
    pub fn deepest_pair(&self, bonds: &dyn BodyGeometry<D>, displacement: &Field<D>) -> Option<[f64; 2]> {
        if !self.layered {
            return None;
        }
        let of = |chunk: usize| {
            let pairs = self.pairs(bonds, displacement, chunk_range(chunk, displacement.sites()), 0.0);
            let each = pairs
                .flat_map(|(_, near)| near.map(|touch| [touch.overlap() / touch.distance, touch.distance]));
            each.max_by(|a, b| a[0].total_cmp(&b[0]))
        };
        let parts: Vec<Option<[f64; 2]>> = parallel::map(displacement.sites().div_ceil(CHUNK), of);
        parts.into_iter().flatten().max_by(|a, b| a[0].total_cmp(&b[0]))
    }

    /// Counts and measures all contacts.
    pub fn summary(&self, bonds: &dyn BodyGeometry<D>, displacement: &Field<D>) -> ContactSummary {
        let none = ContactSummary { pairs: 0, overlap: 0.0, energy: 0.0 };
        let of = |chunk: usize| {
            let (mut part, sites) = (none, chunk_range(chunk, displacement.sites()));
            for (own, touching) in self.list.pairs(bonds, displacement, sites, 0.0) {
                for touch in touching {
                    let overlap = touch.overlap();
                    let [volume, other] = [own.site, touch.site].map(|site| bonds.volume(site as usize));
                    part.pairs += u64::from(own.site < touch.site);
                    part.overlap = part.overlap.max(overlap / touch.distance);
                    // half of a pair's energy from either side
                    let stiffness = self.pair(own.site, touch.site);
                    part.energy += 0.25 * stiffness * overlap * overlap * other * volume;
                }
            }
            part
        };
        let parts: Vec<ContactSummary> = parallel::map(displacement.sites().div_ceil(CHUNK), of);
        let mut all = parts.into_iter().fold(none, |a, b| ContactSummary {
            pairs: a.pairs + b.pairs,
            overlap: a.overlap.max(b.overlap),
            energy: a.energy + b.energy,
        });
        if let Some(surfaces) = &self.surfaces {
            let (count, overlap, energy) = surfaces.summary(displacement);
            all.pairs += count;
            all.energy += energy;
            all.overlap = all.overlap.max(overlap);
        }
        all.energy += self.slip_energy(displacement);
        all.energy += self.ties.as_ref().map_or(0.0, |ties| ties.energy(displacement));
        all
    }
}
