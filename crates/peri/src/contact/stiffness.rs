//! Stiffness of contact: for time steps, masses of relaxation, preconditioners and their step lengths.

use super::Contact;
use super::list::{ListedParticle, NearbyParticle};
use super::surface_friction::ActiveFriction;
use super::surfaces::RigidSurfaces;
use super::ties::Ties;
use crate::bonds::BodyGeometry;
use crate::field::{CHUNK, Field, chunk_range};
use crate::parallel;

/// Visitor of a held face: sites of the particles below with their weights; directions in which it is held,
/// at right angles to each other, with the stiffness along each, N/m.
pub type Spring<'a, const D: usize> = dyn FnMut(&[(usize, f64)], &[([f64; D], f64)]) + 'a;

/// All axes with one stiffness.
pub(super) fn all_axes<const D: usize>(stiffness: f64) -> Vec<([f64; D], f64)> {
    let axis = |axis: usize| std::array::from_fn(|d| f64::from(u8::from(d == axis)));
    (0..D).map(|d| (axis(d), stiffness)).collect()
}

impl<const D: usize> Contact<D> {
    /// Computes max_I Σ_J k V_J over all contacts plus half the stiffness of surfaces, N/m⁴: twice that over
    /// the density bounds the share of contact in the squared greatest frequency.
    pub fn greatest_stiffness(&self, bonds: &dyn BodyGeometry<D>, displacement: &Field<D>) -> f64 {
        let sites = displacement.sites();
        let of = |chunk: usize| {
            let pairs = self.pairs(bonds, displacement, chunk_range(chunk, sites), 0.0);
            let stiffness = |own: u32, touch: NearbyParticle<D>| {
                self.pair(own, touch.site) * bonds.volume(touch.site as usize)
            };
            let sums = pairs.map(|(own, touching)| touching.map(|t| stiffness(own.site, t)).sum::<f64>());
            sums.fold(0.0, f64::max)
        };
        let pairs = parallel::map(sites.div_ceil(CHUNK), of).into_iter().fold(0.0, f64::max);
        pairs + self.half_surface_stiffness()
    }

    pub(super) fn half_surface_stiffness(&self) -> f64 {
        let surfaces = self.surfaces.as_ref().map_or(0.0, RigidSurfaces::stiffness);
        0.5 * (surfaces + self.ties.as_ref().map_or(0.0, Ties::greatest))
    }

    /// Sums k V of the largest particle and half the stiffness of surfaces: the least value of
    /// [`Contact::greatest_stiffness`] with any contact, if all particles are alike.
    pub fn pair_stiffness(&self) -> f64 {
        self.stiffness * self.largest_volume + self.half_surface_stiffness()
    }

    /// Adds contacts, present or imminent, to the Gershgorin sums of dynamic relaxation, in units of
    /// `tangent`: Σ_J k V_J (1 + max_{d≠e} |n_d n_e|), and surfaces. A particle that became heavy only in
    /// contact would enter another as a light one and leave as a heavy one, and so on indefinitely. A
    /// particle without bonds has twice the sum: it starts each step from rest, see
    /// [`Contact::stop_detached`], and must not go farther than a gradient step.
    pub fn add_stiffness(
        &self,
        bonds: &dyn BodyGeometry<D>,
        displacement: &Field<D>,
        tangent: f64,
        masses: &mut [f64],
    ) {
        self.add_pairs(bonds, displacement, tangent, masses);
        self.near_springs(displacement, Some(self.near), &mut |below, directions| {
            let sum: f64 = below.iter().map(|(_, weight)| weight.abs()).sum();
            let [(normal, stiffness), ..] = *directions else { return };
            let mixed = 1.0 + if directions.len() == 1 { mixed(normal) } else { 0.0 };
            for &(site, weight) in below {
                let row = stiffness * weight.abs() * sum / bonds.volume(site);
                masses[site] += 0.5 * row * mixed / tangent;
            }
        });
    }

    /// Adds the sums of pairs only, as [`Self::add_stiffness`].
    fn add_pairs(
        &self,
        bonds: &dyn BodyGeometry<D>,
        displacement: &Field<D>,
        tangent: f64,
        masses: &mut [f64],
    ) {
        let of = |own: u32, NearbyParticle { site, zeta, r, .. }: NearbyParticle<D>| {
            let unit = zeta.map(|x| x / r.max(f64::MIN_POSITIVE));
            // friction acts in all directions
            let mixed = if self.friction > 0.0 { 1.0 } else { mixed(unit) };
            self.pair(own, site) * bonds.volume(site as usize) * (1.0 + mixed)
        };
        let sites = masses.len();
        let sums: Vec<Vec<(ListedParticle, f64)>> = parallel::map(sites.div_ceil(CHUNK), |chunk| {
            let pairs = self.pairs(bonds, displacement, chunk_range(chunk, sites), self.near);
            let all =
                pairs.map(|(own, near)| (own, near.map(|near| of(own.site, near)).sum::<f64>() / tangent));
            all.filter(|(_, sum)| *sum > 0.0).collect()
        });
        for (own, sum) in sums.into_iter().flatten() {
            let mass = &mut masses[own.site as usize];
            *mass = if own.alone { 2.0 * sum } else { *mass + sum };
        }
    }

    /// Adds contacts to the diagonal of the stiffness over volumes, N/m⁵: pairs present or imminent as in
    /// [`Self::add_stiffness`], faces in contact by k w²/V.
    pub fn add_to_diagonal(&self, bonds: &dyn BodyGeometry<D>, displacement: &Field<D>, springs: &mut [f64]) {
        let mut pairs = vec![0.0; springs.len()];
        self.add_pairs(bonds, displacement, 1.0, &mut pairs);
        springs.iter_mut().zip(&pairs).for_each(|(spring, pair)| *spring += 0.5 * pair);
        self.springs(displacement, &mut |below, directions| {
            let stiffness = directions.iter().map(|held| held.1).fold(0.0, f64::max);
            for &(site, weight) in below {
                springs[site] += stiffness * weight * weight / bonds.volume(site);
            }
        });
    }

    /// Visits pairs of particles in contact or about to touch, each once: the first with the weight 1, the
    /// second with −1.
    pub fn pair_springs(&self, bonds: &dyn BodyGeometry<D>, displacement: &Field<D>, visit: &mut Spring<D>) {
        for (own, near) in self.pairs(bonds, displacement, 0..displacement.sites(), self.near) {
            for other in near.filter(|other| own.site < other.site) {
                let [a, b] = [own.site, other.site].map(|site| site as usize);
                let stiffness = self.pair(own.site, other.site) * bonds.volume(a) * bonds.volume(b);
                let below = [(a, 1.0), (b, -1.0)];
                if self.friction > 0.0 {
                    visit(&below, &all_axes(stiffness));
                } else {
                    visit(&below, &[(other.direction(), stiffness)]);
                }
            }
        }
    }

    /// Visits faces in contact with surfaces or tied.
    pub fn springs(&self, displacement: &Field<D>, visit: &mut Spring<D>) {
        self.near_springs(displacement, None, visit);
    }

    fn near_springs(&self, displacement: &Field<D>, gap: Option<f64>, visit: &mut Spring<D>) {
        if let Some(surfaces) = &self.surfaces {
            surfaces.springs(displacement, gap, self.active_friction(), visit);
        }
        if let Some(ties) = &self.ties {
            ties.springs(visit);
        }
    }

    /// Surface and number of the faces in contact, ascending, and 1 where they slip.
    pub fn in_touch(&self, displacement: &Field<D>) -> Vec<[u32; 3]> {
        let in_touch = |surfaces: &RigidSurfaces<D>| surfaces.in_touch(displacement, self.active_friction());
        self.surfaces.as_ref().map_or_else(Vec::new, in_touch)
    }

    fn active_friction(&self) -> ActiveFriction<'_, D> {
        self.start.as_ref().map(|start| (&*self.held, start))
    }

    /// Longest step along a direction in which no particle jumps past another: a relative motion of a quarter
    /// of a spacing for contacts present or imminent, of half a spacing for all. ∞ along a zero direction.
    pub fn longest_step(
        &self,
        bonds: &dyn BodyGeometry<D>,
        displacement: &Field<D>,
        direction: &Field<D>,
    ) -> f64 {
        if !self.has_pairs() {
            // nothing jumps past a surface
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
        let parts = parallel::map(sites.div_ceil(CHUNK), of).into_iter();
        let [farthest, closing] =
            parts.fold([0.0; 2], |a: [f64; 2], b: [f64; 2]| [a[0].max(b[0]), a[1].max(b[1])]);
        self.step_of([farthest.sqrt(), closing.sqrt()])
    }

    /// [`Self::longest_step`] along a direction whose greatest length is the first number, and its greatest
    /// difference between particles in contact or about to touch the second.
    pub fn step_of(&self, [farthest, closing]: [f64; 2]) -> f64 {
        self.near / (0.5 * farthest).max(closing)
    }

    /// Sites of particles without bonds, ascending.
    pub fn detached(&self) -> &[u32] {
        &self.list.alone
    }

    /// Stops particles without bonds, so that they do not fly on in a search for equilibrium.
    pub fn stop_detached(&self, velocity: &mut Field<D>) {
        self.detached().iter().for_each(|&site| velocity.set(site as usize, [0.0; D]));
    }
}

/// max_{d≠e} |n_d n_e|.
pub(super) fn mixed<const D: usize>(n: [f64; D]) -> f64 {
    let pairs = (0..D).flat_map(|d| (0..d).map(move |e| (d, e)));
    pairs.map(|(d, e)| (n[d] * n[e]).abs()).fold(0.0, f64::max)
}
