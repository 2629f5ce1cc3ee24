//! Rigid planes that particles cannot pass.

use super::friction::{Rubbed, Rubbing, tangential};
use super::push_is_valid;
use crate::bonds::Bonds;
use crate::error::Error;
use crate::field::{CHUNK, Field, chunk_range};
use crate::geometry::length;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Sites whose heights are computed together.
const BLOCK: usize = 256;

/// A rigid half-space behind a plane. A particle of radius r at the height h < r above it is pushed out with the force density
/// κ(c/δ)V(r − h) along the normal: the face of a lattice, half a spacing from its particles, may lie on a plane without force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane<const D: usize> {
    /// A point of the plane, m.
    pub point: [f64; D],
    /// Its normal, of any length, towards the body.
    pub normal: [f64; D],
    /// κ, as that of [`super::Contact::new`].
    pub stiffness: f64,
    /// Coefficient of friction μ.
    pub friction: f64,
    /// Displacement at load factor 1, m; the plane follows the factor.
    pub displacement: [f64; D],
    /// Velocity, m/s, in explicit dynamics; added to the displacement.
    pub velocity: [f64; D],
}

impl<const D: usize> Plane<D> {
    /// At rest, without friction, of stiffness [`super::STIFFNESS`].
    pub fn new(point: [f64; D], normal: [f64; D]) -> Self {
        let (stiffness, friction) = (super::STIFFNESS, 0.0);
        Self { point, normal, stiffness, friction, displacement: [0.0; D], velocity: [0.0; D] }
    }
}

/// How a body rests on a plane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Resting {
    /// Force of the plane on the body, N.
    pub force: [f64; 3],
    /// Area of the particles that touch it, m²: of each its volume over its diameter.
    pub area: f64,
    /// Root of the mean square distance from the centre of pressure, weighted with the pressure, m. A Hertzian strip of
    /// half-width b has b/2.
    pub spread: f64,
}

/// A plane and the body's heights above it.
pub struct Placed<const D: usize> {
    pub plane: Plane<D>,
    /// κc/δ, N/m⁷.
    stiffness: f64,
    /// h − r of every site at rest, m; ∞ where there is no particle.
    heights: Vec<f64>,
    /// Where the plane is now and where it was before, from where it was at first, m.
    now: [f64; D],
    before: [f64; D],
}

impl<const D: usize> Placed<D> {
    /// Above a body at rest with the particles' radii, m; `unit` is c/δ.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a normal without direction and for what is not finite or negative.
    pub fn new(
        bonds: &dyn Bonds<D>,
        mut plane: Plane<D>,
        unit: f64,
        radius: impl Fn(usize) -> f64,
    ) -> Result<Self, Error> {
        push_is_valid("stiffness of a plane", plane.stiffness)?;
        push_is_valid("friction of a plane", plane.friction)?;
        for (name, vector) in [
            ("point of a plane", plane.point),
            ("displacement of a plane", plane.displacement),
            ("velocity of a plane", plane.velocity),
        ] {
            if let Some(&found) = vector.iter().find(|x| !x.is_finite()) {
                return Err(Error::Parameter { name, found, allowed: "finite".into() });
            }
        }
        let size = length(plane.normal);
        if !(size.is_normal()) {
            let allowed = "a length above 0, finite".to_owned();
            return Err(Error::Parameter { name: "normal of a plane", found: size, allowed });
        }
        plane.normal = plane.normal.map(|n| n / size);
        let mut heights = vec![f64::INFINITY; bonds.sites()];
        for &site in bonds.particles() {
            let place = bonds.position(site as usize);
            let height: f64 = (0..D).map(|d| (place[d] - plane.point[d]) * plane.normal[d]).sum();
            heights[site as usize] = height - radius(site as usize);
        }
        let stiffness = plane.stiffness * unit;
        Ok(Self { plane, stiffness, heights, now: [0.0; D], before: [0.0; D] })
    }

    /// Moves it to where it is at a load factor and a time, s.
    pub fn place(&mut self, factor: f64, time: f64) {
        let Plane { displacement, velocity, .. } = self.plane;
        self.before = self.now;
        self.now = std::array::from_fn(|d| factor * displacement[d] + time * velocity[d]);
    }

    /// Its last move, m.
    pub fn moved(&self) -> [f64; D] {
        std::array::from_fn(|d| self.now[d] - self.before[d])
    }

    /// Visits those of some sites that are nearer to it than `reach`, m: site, and r − h.
    pub fn visit(
        &self,
        displacement: &Field<D>,
        sites: Range<usize>,
        reach: f64,
        visit: &mut dyn FnMut(usize, f64),
    ) {
        let shift: f64 = (0..D).map(|d| self.now[d] * self.plane.normal[d]).sum();
        for start in sites.clone().step_by(BLOCK) {
            let range = start..(start + BLOCK).min(sites.end);
            let mut gaps = [0.0; BLOCK];
            let gaps = &mut gaps[..range.len()];
            gaps.iter_mut().zip(&self.heights[range.clone()]).for_each(|(gap, h)| *gap = h - shift);
            for (d, u) in displacement.components().iter().enumerate() {
                let normal = self.plane.normal[d];
                gaps.iter_mut().zip(&u[range.clone()]).for_each(|(gap, u)| *gap += normal * u);
            }
            for (k, &gap) in gaps.iter().enumerate() {
                if gap < reach {
                    visit(start + k, -gap);
                }
            }
        }
    }

    /// Force density per overlap on a particle of a volume, N/m⁴.
    pub fn push(&self, volume: f64) -> f64 {
        self.stiffness * volume
    }

    /// Adds its force densities on the sites from `start` on.
    pub fn force(&self, volumes: &[f64], displacement: &Field<D>, start: usize, force: &mut [&mut [f64]; D]) {
        self.visit(displacement, start..start + force[0].len(), 0.0, &mut |site, overlap| {
            let push = self.push(volumes[site]) * overlap;
            for d in 0..D {
                force[d][site - start] += push * self.plane.normal[d];
            }
        });
    }

    /// Adds the force densities of friction on a work item; what they add up to, and v_ε.
    pub fn friction(
        &self,
        volumes: &[f64],
        fields: [&Field<D>; 2],
        slip_velocity: f64,
        rubbing: &Rubbing,
        chunk: usize,
        force: &mut [&mut [f64]; D],
    ) -> ([f64; 3], f64) {
        let (mut sum, mut most) = ([0.0; 3], 0.0_f64);
        let [displacement, velocity] = fields;
        let step = if rubbing.step > 0.0 { 1.0 / rubbing.step } else { 0.0 };
        let own = self.moved().map(|x| x * step);
        let mu = self.plane.friction;
        if mu == 0.0 {
            return (sum, most);
        }
        let sites = chunk_range(chunk, volumes.len());
        self.visit(displacement, sites, 0.0, &mut |site, overlap| {
            let bound = mu * self.push(volumes[site]) * overlap;
            let slip = rubbing.slip(slip_velocity, bound, 1.0);
            most = most.max(slip);
            let v = velocity.get(site);
            let relative = std::array::from_fn(|d| v[d] - own[d]);
            let rub = tangential(bound, slip, &self.plane.normal, relative);
            for d in 0..D {
                force[d][site - chunk * CHUNK] += rub[d];
                sum[d] += rub[d] * volumes[site];
            }
        });
        (sum, most)
    }

    /// How the body rests on it: the push of the plane, N, without friction.
    pub fn resting(&self, volumes: &[f64], displacement: &Field<D>, bonds: &dyn Bonds<D>) -> Resting {
        // N, area, N x, N x², of x from the plane's point
        let of = |chunk: usize| {
            let (mut sums, sites) = ([0.0; 8], chunk_range(chunk, volumes.len()));
            self.visit(displacement, sites, 0.0, &mut |site, overlap| {
                let push = self.push(volumes[site]) * overlap * volumes[site];
                let (rest, u) = (bonds.position(site), displacement.get(site));
                let place: [f64; D] = std::array::from_fn(|d| rest[d] + u[d] - self.plane.point[d]);
                let across = super::friction::across(&self.plane.normal, place);
                let height: f64 =
                    (0..D).map(|d| (rest[d] - self.plane.point[d]) * self.plane.normal[d]).sum();
                sums[0] += push;
                sums[1] += volumes[site] / (2.0 * (height - self.heights[site]));
                for d in 0..D {
                    sums[2 + d] += push * across[d];
                    sums[5 + d] += push * across[d] * across[d];
                }
            });
            sums
        };
        let parts: Vec<[f64; 8]> = (0..self.heights.len().div_ceil(CHUNK)).into_par_iter().map(of).collect();
        let sum = |k: usize| parts.iter().map(|part| part[k]).sum::<f64>();
        let (push, area) = (sum(0), sum(1));
        let mut force = [0.0; 3];
        (0..D).for_each(|d| force[d] = push * self.plane.normal[d]);
        let square: f64 = (0..D).map(|d| sum(5 + d) / push - (sum(2 + d) / push).powi(2)).sum();
        let spread = if push > 0.0 { square.max(0.0).sqrt() } else { 0.0 };
        Resting { force, area, spread }
    }
}

/// All planes of a scene.
#[derive(Default)]
pub struct Planes<const D: usize> {
    pub each: Vec<Placed<D>>,
    /// Volume of every site's particle, m³; empty without planes.
    pub volumes: Vec<f64>,
}

impl<const D: usize> Planes<D> {
    /// Adds the force densities on the sites from `start` on.
    pub fn force(&self, displacement: &Field<D>, start: usize, force: &mut [&mut [f64]; D]) {
        self.each.iter().for_each(|plane| plane.force(&self.volumes, displacement, start, force));
    }

    /// Sums what `of` makes of each touch, a particle's volume and its overlap, N/m⁴ and so on: particles, and the sum.
    fn sum(&self, displacement: &Field<D>, of: impl Fn(&Placed<D>, f64, f64) -> f64 + Sync) -> [f64; 2] {
        let part = |chunk: usize| {
            let mut sums = [0.0; 2];
            for plane in &self.each {
                plane.visit(
                    displacement,
                    chunk_range(chunk, self.volumes.len()),
                    0.0,
                    &mut |site, overlap| {
                        sums[0] += 1.0;
                        sums[1] += of(plane, self.volumes[site], overlap);
                    },
                );
            }
            sums
        };
        let parts: Vec<[f64; 2]> =
            (0..self.volumes.len().div_ceil(CHUNK)).into_par_iter().map(part).collect();
        parts.into_iter().fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]])
    }

    /// Touches, and the energy Σ ½κ(c/δ)(r − h)² V², J.
    pub fn energy(&self, displacement: &Field<D>) -> [f64; 2] {
        self.sum(displacement, |plane, volume, overlap| 0.5 * plane.push(volume) * volume * overlap * overlap)
    }

    /// Σ of the squares of the force densities, (N/m³)².
    pub fn square(&self, displacement: &Field<D>) -> f64 {
        self.sum(displacement, |plane, volume, overlap| (plane.push(volume) * overlap).powi(2))[1]
    }

    /// Deepest 1 − h/r.
    pub fn deepest(&self, displacement: &Field<D>, radius: impl Fn(usize) -> f64 + Sync) -> f64 {
        let part = |chunk: usize| {
            let mut deepest = 0.0_f64;
            for plane in &self.each {
                plane.visit(
                    displacement,
                    chunk_range(chunk, self.volumes.len()),
                    0.0,
                    &mut |site, overlap| {
                        deepest = deepest.max(overlap / radius(site));
                    },
                );
            }
            deepest
        };
        (0..self.volumes.len().div_ceil(CHUNK)).into_par_iter().map(part).reduce(|| 0.0, f64::max)
    }

    /// Half the greatest stiffness of all planes together on a particle, N/m⁴.
    pub fn stiffness(&self, largest_volume: f64) -> f64 {
        let mut matrix = nalgebra::Matrix3::<f64>::zeros();
        for plane in &self.each {
            let normal = nalgebra::Vector3::from_fn(|d, _| plane.plane.normal.get(d).copied().unwrap_or(0.0));
            matrix += normal * normal.transpose() * plane.push(largest_volume);
        }
        0.5 * matrix.symmetric_eigenvalues().max()
    }

    /// Adds to masses, in units of `tangent`, what touches or is nearer than `near`: as [`super::Contact::add_stiffness`].
    pub fn add_stiffness(&self, displacement: &Field<D>, tangent: f64, near: f64, masses: &mut [f64]) {
        for plane in &self.each {
            let normal = plane.plane.normal;
            let mixed = (0..D).flat_map(|d| (0..d).map(move |e| (d, e)));
            let mixed = mixed.map(|(d, e)| (normal[d] * normal[e]).abs()).fold(0.0, f64::max);
            masses.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, masses)| {
                let sites = chunk_range(chunk, self.volumes.len());
                plane.visit(displacement, sites, near, &mut |site, _| {
                    masses[site - chunk * CHUNK] += plane.push(self.volumes[site]) * (1.0 + mixed) / tangent;
                });
            });
        }
    }

    /// Friction on a work item, see [`Placed::friction`].
    pub fn friction(
        &self,
        fields: [&Field<D>; 2],
        slip_velocity: f64,
        rubbing: &Rubbing,
        chunk: usize,
        force: &mut [&mut [f64]; D],
        rubbed: &mut Rubbed,
    ) {
        for (plane, sum) in self.each.iter().zip(&mut rubbed.planes) {
            let (force, slip) = plane.friction(&self.volumes, fields, slip_velocity, rubbing, chunk, force);
            *sum = force;
            rubbed.slip = rubbed.slip.max(slip);
        }
    }
}
