//! Friction of all contacts: between equilibria and in explicit dynamics.

use super::Contact;
use super::friction_pair::{ContactPair, FrictionPair, known_in};
use crate::bonds::BodyGeometry;
use crate::field::{CHUNK, Field, chunk_range};
use crate::parallel;
use std::ops::Range;

/// Friction after a step of explicit dynamics.
#[derive(Clone, Debug, Default)]
pub struct SlidingFriction {
    /// Force on the body by each rigid surface, N.
    pub surfaces: Vec<[f64; 3]>,
    /// Energy of elastic slip, J.
    pub stored: f64,
}

impl<const D: usize> Contact<D> {
    /// Sets the friction of `grips`, from the displacement `start` on.
    pub fn begin_friction(&mut self, start: &Field<D>, grips: Vec<FrictionPair>) {
        self.held = grips;
        self.start = Some(start.clone());
    }

    /// Ends friction between equilibria.
    pub fn end_friction(&mut self) {
        self.held.clear();
        self.start = None;
    }

    /// Computes the friction of all contacts at a displacement, sorted by pair: the slips of `old` continue
    /// with the present normal forces. Contacts that began after `start` slip for the rest of their way only.
    pub fn grips(
        &self,
        bonds: &dyn BodyGeometry<D>,
        displacement: &Field<D>,
        start: &Field<D>,
        old: &[FrictionPair],
    ) -> Vec<FrictionPair> {
        let of = |chunk: usize| {
            let mut grips = Vec::new();
            let sites = chunk_range(chunk, displacement.sites());
            for (own, touching) in self.pairs(bonds, displacement, sites, 0.0).filter(|_| self.friction > 0.0)
            {
                for touch in touching {
                    let pair = ContactPair::Particles(own.site, touch.site);
                    let known = known_in(old, pair);
                    let volumes = [own.site, touch.site].map(|site| bonds.volume(site as usize));
                    let push = self.pair(own.site, touch.site) * volumes[0] * volumes[1];
                    let bound = self.friction * push * touch.overlap();
                    let direction = touch.direction();
                    let normal = std::array::from_fn(|d| direction.get(d).map_or(0.0, |n| -n));
                    let stiffness = self.elastic_slip.map_or(push, |slip| bound / slip);
                    let then = touch.overlap_at(start, own.site as usize);
                    let share = if then >= 0.0 { 1.0 } else { touch.overlap() / (touch.overlap() - then) };
                    let slip = known.map_or([0.0; 3], |grip| grip.slip);
                    let mut grip = FrictionPair { pair, slip, bound, stiffness, normal, share, growth: 0.0 };
                    grip.project();
                    if bound > 0.0 {
                        grips.push(grip);
                    }
                }
            }
            grips.sort_unstable_by_key(|grip| grip.pair);
            grips
        };
        let parts: Vec<Vec<FrictionPair>> = parallel::map(displacement.sites().div_ceil(CHUNK), of);
        let mut grips = parts.concat();
        grips.extend(self.surfaces.iter().flat_map(|surfaces| surfaces.grips(displacement, start, old)));
        grips
    }

    /// Returns the friction after a load step, sorted by pair, for the next one, with its growth since `old`;
    /// the energy dissipated in the step, J; and the friction force of each rigid surface, N.
    pub fn slide(
        &self,
        displacement: &Field<D>,
        old: &[FrictionPair],
    ) -> (Vec<FrictionPair>, f64, Vec<[f64; 3]>) {
        let mut forces = vec![[0.0; 3]; self.surfaces().count()];
        let (mut dissipated, mut grips) = (0.0, self.held.clone());
        for grip in &mut grips {
            let drag = grip.drag(self.slipped(grip.pair, displacement));
            grip.slip = drag.slip;
            grip.growth = grip.bound - known_in(old, grip.pair).map_or(0.0, |known| known.bound);
            match grip.pair {
                // the other half is counted from the other side
                ContactPair::Particles(..) => dissipated += 0.5 * drag.dissipated,
                ContactPair::Face(surface, _) | ContactPair::Particle(surface, _) => {
                    dissipated += drag.dissipated;
                    (0..3).for_each(|d| forces[surface as usize][d] += drag.force[d]);
                }
            }
        }
        (grips, dissipated, forces)
    }

    /// Motion of the first side of a pair against the second since friction began to act, m.
    pub fn slipped(&self, pair: ContactPair, displacement: &Field<D>) -> [f64; 3] {
        let Some(start) = &self.start else { return [0.0; 3] };
        let ContactPair::Particles(own, other) = pair else {
            return self
                .surfaces
                .as_ref()
                .map_or([0.0; 3], |surfaces| surfaces.slipped(pair, displacement, start));
        };
        let since = |site: u32, d: usize| {
            displacement.components()[d][site as usize] - start.components()[d][site as usize]
        };
        std::array::from_fn(|d| if d < D { since(own, d) - since(other, d) } else { 0.0 })
    }

    /// Energy of elastic slip, J.
    pub(super) fn slip_energy(&self, displacement: &Field<D>) -> f64 {
        let of = |grip: &FrictionPair| {
            let slip = grip.drag(self.slipped(grip.pair, displacement)).slip;
            let part = if matches!(grip.pair, ContactPair::Particles(..)) { 0.5 } else { 1.0 };
            part * FrictionPair { slip, ..*grip }.energy()
        };
        self.held.iter().map(of).sum()
    }

    /// Adds the force densities of friction between particles, N/m³, on the sites from `start` on, of one
    /// work item.
    pub(super) fn hold_pairs(&self, displacement: &Field<D>, start: usize, force: &mut [&mut [f64]; D]) {
        if self.start.is_none() {
            return;
        }
        let end = start + force[0].len();
        for grip in self.active_on(start..end) {
            let ContactPair::Particles(own, _) = grip.pair else { continue };
            let drag = grip.drag(self.slipped(grip.pair, displacement)).force;
            let volume = self.list.volume(own as usize);
            (0..D).for_each(|d| force[d][own as usize - start] += drag[d] / volume);
        }
    }

    /// Returns the active friction between particles of a range of sites.
    fn active_on(&self, sites: Range<usize>) -> &[FrictionPair] {
        let before = |end: usize| {
            self.held.partition_point(
                |grip| matches!(grip.pair, ContactPair::Particles(own, _) if (own as usize) < end),
            )
        };
        &self.held[before(sites.start)..before(sites.end)]
    }

    /// Computes the friction after a step of explicit dynamics, s, with the velocity at the half step, m/s:
    /// the slips of `old` continue with the present normal forces. It acts in [`Self::add_friction`].
    pub fn slide_on(
        &mut self,
        bonds: &dyn BodyGeometry<D>,
        displacement: &Field<D>,
        velocity: &Field<D>,
        step: f64,
        old: &[FrictionPair],
    ) -> SlidingFriction {
        let mut grips = self.grips(bonds, displacement, displacement, old);
        let mut sliding = SlidingFriction {
            surfaces: vec![[0.0; 3]; self.surfaces().count()],
            ..SlidingFriction::default()
        };
        let at = |site: u32| velocity.get(site as usize);
        for grip in &mut grips {
            grip.share = 1.0;
            let moved = match (grip.pair, &self.surfaces) {
                (ContactPair::Particles(own, other), _) => {
                    let (own, other) = (at(own), at(other));
                    std::array::from_fn(|d| if d < D { step * (own[d] - other[d]) } else { 0.0 })
                }
                (pair, Some(surfaces)) => surfaces.carried(pair, velocity, step),
                (_, None) => [0.0; 3],
            };
            let drag = grip.drag(moved);
            grip.slip = drag.slip;
            let part = if matches!(grip.pair, ContactPair::Particles(..)) { 0.5 } else { 1.0 };
            sliding.stored += part * grip.energy();
            if let ContactPair::Face(surface, _) | ContactPair::Particle(surface, _) = grip.pair {
                (0..3).for_each(|d| sliding.surfaces[surface as usize][d] += drag.force[d]);
            }
        }
        self.held = grips;
        if let Some(surfaces) = &mut self.surfaces {
            surfaces.drag(&self.held);
        }
        sliding
    }

    /// Active friction, sorted by pair.
    pub fn active_grips(&self) -> &[FrictionPair] {
        &self.held
    }

    /// Sets the friction of explicit dynamics.
    pub fn resume_friction(&mut self, grips: &[FrictionPair]) {
        self.held = grips.to_vec();
        self.start = None;
    }

    /// Adds the force densities of friction after [`Self::slide_on`], N/m³, on the particles of work item
    /// `chunk`.
    pub fn add_friction(&self, chunk: usize, force: &mut [&mut [f64]; D]) {
        let start = chunk * CHUNK;
        for grip in self.active_on(start..start + force[0].len()) {
            let ContactPair::Particles(own, _) = grip.pair else { continue };
            let volume = self.list.volume(own as usize);
            (0..D).for_each(|d| force[d][own as usize - start] -= grip.stiffness * grip.slip[d] / volume);
        }
        if let Some(surfaces) = &self.surfaces {
            surfaces.friction(start, force);
        }
    }
}
