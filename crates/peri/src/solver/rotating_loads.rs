//! Regions rotating about an axis: prescribed along the arc, not in proportion to the load factor.

use super::load::Loads;
use super::rotation::RotatingRegion;
use super::system::System;
use crate::bonds::BodyGeometry;
use crate::field::{CHUNK, Field};
use crate::parallel;

/// Particles of a region from which the first guess measures distances.
const SAMPLES: usize = 256;

/// A region that carries free particles: its rotation, its rate of displacement without one, m, and positions
/// of some of its particles.
type Carrier<'a, const D: usize> = (Option<&'a RotatingRegion<D>>, [f64; D], Vec<[f64; D]>);

impl<const D: usize> Loads<D> {
    /// Rotates a region whose components are already constrained.
    pub fn turn(&mut self, bonds: &dyn BodyGeometry<D>, turned: RotatingRegion<D>) {
        self.turned.push(turned);
        self.set_rates(bonds, 0.0, 0.0);
    }

    /// Sets [`Loads::displacement`] of rotating regions to the rate of their displacement over the load
    /// factor between two factors: the secant, or the tangent at one factor.
    pub(super) fn set_rates(&mut self, bonds: &dyn BodyGeometry<D>, before: f64, after: f64) {
        self.set_curved_rates(before, after);
        let Some(field) = self.displacement.as_mut() else { return };
        for turned in &self.turned {
            for (number, &site) in turned.sites.iter().enumerate() {
                let place = bonds.position(site as usize);
                let rate = if before == after {
                    turned.rate(number, place, [before, after], after)
                } else {
                    let [old, new] = [before, after].map(|factor| turned.displacement(number, place, factor));
                    std::array::from_fn(|d| (new[d] - old[d]) / (after - before))
                };
                turned.set(field, site, rate);
            }
        }
    }

    /// Sets [`Loads::displacement`] of rotating regions to their mean rate between two factors along the arc
    /// at `at`: the moment there times it is the work of the rotation.
    pub(super) fn set_arc_rates(&mut self, bonds: &dyn BodyGeometry<D>, between: [f64; 2], at: f64) {
        let Some(field) = self.displacement.as_mut() else { return };
        for turned in &self.turned {
            for (number, &site) in turned.sites.iter().enumerate() {
                turned.set(field, site, turned.rate(number, bonds.position(site as usize), between, at));
            }
        }
    }

    /// Sets [`Loads::displacement`] of rotating regions to their largest ones in the step, for scales.
    pub(super) fn set_turned_peaks(&mut self, bonds: &dyn BodyGeometry<D>) {
        let Some(field) = self.displacement.as_mut() else { return };
        for turned in &self.turned {
            for (number, &site) in turned.sites.iter().enumerate() {
                turned.set(field, site, turned.peak(number, bonds.position(site as usize)));
            }
        }
    }

    /// Returns true if a region rotates between two load factors.
    pub(super) fn turns_between(&self, [before, after]: [f64; 2]) -> bool {
        self.turned.iter().any(|turned| turned.turn_at(before).0 != turned.turn_at(after).0)
    }

    /// Sets [`Loads::displacement`] of regions not proportional to the load factor so that the factor
    /// times it is their displacement there.
    pub(super) fn set_ends(&mut self, bonds: &dyn BodyGeometry<D>, factor: f64) {
        if factor == 0.0 {
            return self.set_rates(bonds, factor, factor);
        }
        self.set_curved_ends(factor);
        let Some(field) = self.displacement.as_mut() else { return };
        for turned in &self.turned {
            for (number, &site) in turned.sites.iter().enumerate() {
                let moved = turned.displacement(number, bonds.position(site as usize), factor);
                turned.set(field, site, moved.map(|x| x / factor));
            }
        }
    }

    /// Sets the displacement of regions that are not proportional to the load factor.
    pub(super) fn place_turned(&self, bonds: &dyn BodyGeometry<D>, factor: f64, displacement: &mut Field<D>) {
        self.place_curved(factor, displacement);
        for turned in &self.turned {
            for (number, &site) in turned.sites.iter().enumerate() {
                let moved = turned.displacement(number, bonds.position(site as usize), factor);
                turned.set(displacement, site, moved);
            }
        }
    }

    /// Longest arc of rotating particles against the others, m, by the angle of each region, rad; for regions
    /// rotating both ways, the sum of both.
    pub(super) fn arc(&self, bonds: &dyn BodyGeometry<D>, angle: impl Fn(&RotatingRegion<D>) -> f64) -> f64 {
        let span = |d: usize| {
            let angles = self.turned.iter().map(|turned| angle(turned) * turned.rotation.axis[d]);
            let (low, high) = angles.fold((0.0_f64, 0.0_f64), |(low, high), x| (low.min(x), high.max(x)));
            high - low
        };
        self.radius(bonds) * (0..3).map(|d| span(d).powi(2)).sum::<f64>().sqrt()
    }

    /// Largest distance of a rotating particle from its axis, m.
    fn radius(&self, bonds: &dyn BodyGeometry<D>) -> f64 {
        let of = |turned: &RotatingRegion<D>| {
            let each = turned.sites.iter().map(|&site| turned.rotation.radius(bonds.position(site as usize)));
            each.fold(0.0, f64::max)
        };
        self.turned.iter().map(of).fold(0.0, f64::max)
    }

    /// Moment of the rotating regions about their axes over the largest radius, N, and its sign and that of
    /// their angles along those at a multiple of 1: the larger of the summed moments of either direction.
    pub(super) fn turning_force(
        &self,
        bonds: &dyn BodyGeometry<D>,
        part: f64,
        force: &Field<D>,
    ) -> (f64, [f64; 2]) {
        let (mut sums, mut signs) = ([[0.0; 3]; 2], [0.0; 2]);
        for turned in &self.turned {
            let (angle, whole) = (turned.turn_at(part).0, turned.rotation.angle);
            let moment: f64 = (turned.sites.iter().enumerate())
                .map(|(number, &site)| {
                    let arm = turned.arm(number, bonds.position(site as usize), part);
                    let force = force.get(site as usize);
                    let each = (0..D).filter(|&d| turned.prescribes(d)).map(|d| arm[d] * force[d]);
                    -bonds.volume(site as usize) * each.sum::<f64>()
                })
                .sum();
            for d in 0..3 {
                let along = moment * turned.rotation.axis[d];
                sums[usize::from(along < 0.0)][d] += along.abs();
            }
            signs = [signs[0] + moment * whole, signs[1] + angle * whole];
        }
        let largest = (0..3).map(|d| f64::max(sums[0][d], sums[1][d]).powi(2)).sum::<f64>().sqrt();
        (largest / self.radius(bonds).max(f64::MIN_POSITIVE), signs)
    }

    /// Moves free particles with the regions of prescribed displacement from one load factor to another: each
    /// region rotates a particle by a fraction of its rotation, in proportion to 1/distance.
    pub(super) fn carry(
        &self,
        bonds: &dyn BodyGeometry<D>,
        [before, after]: [f64; 2],
        displacement: &mut Field<D>,
    ) {
        let increment = after - before;
        let mean = |sites: &[u32]| {
            let mut sum = [0.0; D];
            let Some(field) = &self.displacement else { return sum };
            for &site in sites {
                let value = field.get(site as usize);
                (0..D)
                    .filter(|d| self.constrained(site as usize) >> d & 1 == 1)
                    .for_each(|d| sum[d] += value[d]);
            }
            sum.map(|x| x / sites.len().max(1) as f64)
        };
        let regions: Vec<Carrier<D>> = self
            .held_regions
            .iter()
            .enumerate()
            .filter(|(_, sites)| !sites.is_empty())
            .map(|(region, sites)| {
                let turned = self.turned.iter().find(|turned| turned.region == region);
                let shift = if turned.is_some() { [0.0; D] } else { mean(sites) };
                let step = sites.len().div_ceil(SAMPLES);
                let sample = sites.iter().step_by(step).map(|&site| bonds.position(site as usize)).collect();
                (turned, shift, sample)
            })
            .collect();
        let moved = |&site: &u32| {
            let (place, own) = (bonds.position(site as usize), displacement.get(site as usize));
            let near = |sample: &Vec<[f64; D]>| {
                let squares =
                    sample.iter().map(|there| (0..D).map(|d| (there[d] - place[d]).powi(2)).sum::<f64>());
                1.0 / squares.fold(f64::INFINITY, f64::min).sqrt().max(1e-9 * bonds.spacing())
            };
            let weights: Vec<f64> = regions.iter().map(|(_, _, sample)| near(sample)).collect();
            let sum: f64 = weights.iter().sum();
            let mut u = own;
            for ((turned, shift, _), weight) in regions.iter().zip(weights) {
                let part = weight / sum;
                let mut moves = shift.map(|x| increment * x);
                if let Some(region) = turned {
                    let [(old_angle, old), (angle, new)] = [before, after].map(|at| region.turn_at(at));
                    let from = std::array::from_fn(|d| place[d] + u[d] - region.rotation.centre[d] - old[d]);
                    let turn = region.rotation.turn(part * (angle - old_angle), from);
                    (0..D).for_each(|d| u[d] += turn[d]);
                    moves = std::array::from_fn(|d| new[d] - old[d]);
                }
                (0..D).for_each(|d| u[d] += part * moves[d]);
            }
            u
        };
        let moved: Vec<Vec<[f64; D]>> =
            parallel::map_chunks(bonds.particles(), CHUNK, |sites| sites.iter().map(moved).collect());
        for (&site, u) in bonds.particles().iter().zip(moved.into_iter().flatten()) {
            displacement.set(site as usize, u);
        }
    }
}

impl<const D: usize> System<'_, D> {
    /// Runs [`Loads::set_rates`] if any region rotates or follows a curve.
    pub(super) fn set_rates(&mut self, before: f64, after: f64) {
        if !self.loads.is_proportional() {
            self.loads.to_mut().set_rates(&*self.bonds, before, after);
            self.contact.iter_mut().for_each(|contact| contact.set_rates(before, after));
        }
    }

    /// Runs [`Loads::set_arc_rates`] if any region rotates.
    pub(super) fn set_arc_rates(&mut self, between: [f64; 2], at: f64) {
        if !self.loads.turned.is_empty() {
            self.loads.to_mut().set_arc_rates(&*self.bonds, between, at);
        }
    }

    /// Runs [`Loads::set_ends`] if any region rotates or follows a curve.
    pub(super) fn set_ends(&mut self, factor: f64) {
        if !self.loads.is_proportional() {
            self.loads.to_mut().set_ends(&*self.bonds, factor);
        }
    }
}
