//! Passes of an iteration over all sites: new forces with all sums over them; the move of dynamic relaxation;
//! the gradient of L-BFGS.

use super::load::Loads;
use super::particle_map::ParticleMap;
use super::state::State;
use super::system::System;
use crate::bonds::StretchRange;
use crate::field::{CHUNK, Field, chunk_range};
use crate::parallel;
use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;

/// Sums over all sites, item by item in a fixed order.
#[derive(Clone, Copy, Default)]
pub struct ForceSums {
    /// Σ v·ΔF over free components.
    pub quotient_top: f64,
    /// Σ M v² over free components.
    pub quotient_bottom: f64,
    /// Σ F² over free components.
    pub free: f64,
    /// Σ (F − b)² over constrained components: loads on held particles are no measure of a balance.
    pub constrained: f64,
    /// Σ b² of the body forces on components that are not prescribed.
    pub external: f64,
}

impl ForceSums {
    fn add(mut self, other: Self) -> Self {
        self.quotient_top += other.quotient_top;
        self.quotient_bottom += other.quotient_bottom;
        self.free += other.free;
        self.constrained += other.constrained;
        self.external += other.external;
        self
    }
}

/// Computes new forces and, in the same pass, all sums over them.
pub fn force_pass<const D: usize>(
    system: &System<D>,
    state: &mut State<D>,
    unit_mass: &[f64],
    mass: f64,
    factor: f64,
    look: bool,
) -> (ForceSums, StretchRange) {
    let sites = system.bonds.sites();
    let loads = &*system.loads;
    let (displacement, velocity) = (&state.displacement, state.velocity.components());
    let results: Vec<(ForceSums, StretchRange)> = state
        .force
        .chunks_mut()
        .into_par_iter()
        .enumerate()
        .map_init(
            || vec![0.0; D * CHUNK],
            |scratch, (chunk, old)| {
                let range = chunk_range(chunk, sites);
                let mut parts = scratch.chunks_mut(CHUNK);
                let mut new: [&mut [f64]; D] =
                    std::array::from_fn(|_| &mut parts.next().unwrap_or_default()[..range.len()]);
                let mut observed = StretchRange::REST;
                system.internal_force(displacement, chunk * CHUNK, &mut new, look.then_some(&mut observed));
                let mut sums = ForceSums::default();
                let constrained = loads.bound().get(range.clone()).unwrap_or_default();
                let prescribed = loads.constrained.get(range.clone()).unwrap_or_default();
                for d in 0..D {
                    let body = loads.body_force.as_ref().map(|body| &body.components()[d][range.clone()]);
                    if let Some(body) = body {
                        sums.external += add_body_force(new[d], body, factor, (prescribed, 1 << d));
                    }
                    let (v, m) = (&velocity[d][range.clone()], &unit_mass[range.clone()]);
                    if constrained.iter().all(|h| h >> d & 1 == 0) {
                        let free = FreeSums { new: &new[d][..], old: old[d], v, m, mass };
                        sums = sums.add(Arch::new().dispatch(free));
                        old[d].copy_from_slice(new[d]);
                        continue;
                    }
                    for k in 0..v.len() {
                        let f = new[d][k];
                        if constrained[k] >> d & 1 == 1 {
                            let load = own_load(body, prescribed, (k, d), factor);
                            sums.constrained += (f - load) * (f - load);
                        } else {
                            sums.quotient_top += v[k] * (f - old[d][k]);
                            sums.quotient_bottom += v[k] * v[k] * m[k] * mass;
                            sums.free += f * f;
                        }
                        old[d][k] = f;
                    }
                }
                (sums, observed)
            },
        )
        .collect();
    let all =
        results.into_iter().fold((ForceSums::default(), StretchRange::REST), |(sums, observed), (s, m)| {
            (sums.add(s), observed.join(m))
        });
    let (mut sums, observed) = all;
    // planes hold a body, too
    sums.constrained += system.repulsion().map_or(0.0, |contact| contact.surface_force_square());
    (sums, observed)
}

/// Computes new forces, the gradient −V F of the energy over particles (0 where constrained), the sums over
/// forces, the stretches, and the slope of the energy along a direction.
pub fn gradient_pass<const D: usize>(
    system: &System<D>,
    state: &mut State<D>,
    (places, volumes): (&ParticleMap, &[f64]),
    direction: &Field<D>,
    factor: f64,
    gradient: &mut Field<D>,
) -> (ForceSums, StretchRange, f64) {
    let (sites, loads, displacement) = (system.bonds.sites(), &*system.loads, &state.displacement);
    let directions = direction.components();
    let items = state.force.chunks_mut().into_par_iter().zip(places.parts_mut(gradient)).enumerate();
    // one work item at a time if there are hardly any
    let items = items.with_min_len(if sites <= 2 * CHUNK && D == 2 { 2 } else { 1 });
    let results: Vec<(ForceSums, StretchRange, f64)> = items
        .map(|(item, (mut force, gradient))| {
            let mut observed = StretchRange::REST;
            system.internal_force(displacement, item * CHUNK, &mut force, Some(&mut observed));
            let (mut sums, mut slope) = (ForceSums::default(), 0.0);
            let particles = places.of_item(item);
            let held = places.constrained(particles.clone());
            let prescribed = loads.constrained.get(chunk_range(item, sites)).unwrap_or_default();
            for d in 0..D {
                let body =
                    loads.body_force.as_ref().map(|body| &body.components()[d][chunk_range(item, sites)]);
                if let Some(body) = body {
                    sums.external += add_body_force(force[d], body, factor, (prescribed, 1 << d));
                }
                let g = &mut *gradient[d];
                places.gather(item, force[d], g);
                for own in held.iter().filter(|held| held.components >> d & 1 == 1) {
                    let force = &mut g[own.particle - particles.start];
                    let load = own_load(body, prescribed, (own.site, d), factor);
                    sums.constrained += (*force - load) * (*force - load);
                    *force = 0.0;
                }
                let (volumes, direction) = (&volumes[particles.clone()], &directions[d][particles.clone()]);
                let [free, along] = Arch::new().dispatch(EnergyGradient { force: g, volumes, direction });
                sums.free += free;
                slope += along;
            }
            (sums, observed, slope)
        })
        .collect();
    let start = (ForceSums::default(), StretchRange::REST, 0.0);
    let (mut sums, observed, mut slope) = results.into_iter().fold(start, |(sums, observed, slope), item| {
        (sums.add(item.0), observed.join(item.1), slope + item.2)
    });
    if !loads.rigid.is_empty() {
        slope += system.shared_gradient(state, places, direction, gradient, &mut sums);
    }
    // planes hold a body, too
    sums.constrained += system.repulsion().map_or(0.0, |contact| contact.surface_force_square());
    (sums, observed, slope)
}

/// Adds body forces to forces; returns the sum of their squares over components that are not prescribed;
/// `prescribed` is empty where none is.
fn add_body_force(force: &mut [f64], body: &[f64], factor: f64, (prescribed, bit): (&[u8], u8)) -> f64 {
    let mut square = 0.0;
    if prescribed.iter().all(|bits| bits & bit == 0) {
        for (f, b) in force.iter_mut().zip(body) {
            *f += factor * b;
            square += (factor * b) * (factor * b);
        }
        return square;
    }
    for ((f, b), bits) in force.iter_mut().zip(body).zip(prescribed) {
        *f += factor * b;
        square += if bits & bit == 0 { (factor * b) * (factor * b) } else { 0.0 };
    }
    square
}

/// Body force on a prescribed component; 0 on others.
fn own_load(body: Option<&[f64]>, prescribed: &[u8], (site, d): (usize, usize), factor: f64) -> f64 {
    match (body, prescribed.get(site)) {
        (Some(body), Some(bits)) if bits >> d & 1 == 1 => factor * body[site],
        _ => 0.0,
    }
}

/// Number of partial sums, so that a sum vectorises.
pub const LANES: usize = 8;

/// Replaces F by −V F; returns Σ F², and the sum of −V F along a direction.
struct EnergyGradient<'a> {
    force: &'a mut [f64],
    volumes: &'a [f64],
    direction: &'a [f64],
}

impl NullaryFnOnce for EnergyGradient<'_> {
    type Output = [f64; 2];
    #[inline(always)]
    fn call(self) -> [f64; 2] {
        let (force, last) = self.force.as_chunks_mut::<LANES>();
        let (volumes, last_volumes) = self.volumes.as_chunks::<LANES>();
        let (direction, last_direction) = self.direction.as_chunks::<LANES>();
        let (volumes, direction) = (&volumes[..force.len()], &direction[..force.len()]);
        let (mut square, mut slope) = ([0.0; LANES], [0.0; LANES]);
        for k in 0..force.len() {
            for lane in 0..LANES {
                let f = force[k][lane];
                let g = -volumes[k][lane] * f;
                square[lane] += f * f;
                slope[lane] += g * direction[k][lane];
                force[k][lane] = g;
            }
        }
        for lane in 0..last.len() {
            let f = last[lane];
            let g = -last_volumes[lane] * f;
            square[lane] += f * f;
            slope[lane] += g * last_direction[lane];
            last[lane] = g;
        }
        [sum(&square), sum(&slope)]
    }
}

/// Sums the lanes in their order.
#[inline(always)]
pub fn sum(lanes: &[f64; LANES]) -> f64 {
    let mut sum = 0.0;
    for lane in lanes {
        sum += lane;
    }
    sum
}

/// Sums over components that are all free, in eight interleaved parts so that they vectorise.
struct FreeSums<'a> {
    new: &'a [f64],
    old: &'a [f64],
    v: &'a [f64],
    m: &'a [f64],
    mass: f64,
}

impl NullaryFnOnce for FreeSums<'_> {
    type Output = ForceSums;
    #[inline(always)]
    fn call(self) -> ForceSums {
        let (mut top, mut bottom, mut square) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let [(new, last), (old, last_old), (v, last_v), (m, last_m)] =
            [self.new, self.old, self.v, self.m].map(|numbers| numbers.as_chunks::<LANES>());
        let (old, v, m) = (&old[..new.len()], &v[..new.len()], &m[..new.len()]);
        for k in 0..new.len() {
            for lane in 0..LANES {
                top[lane] += v[k][lane] * (new[k][lane] - old[k][lane]);
                bottom[lane] += v[k][lane] * v[k][lane] * m[k][lane];
                square[lane] += new[k][lane] * new[k][lane];
            }
        }
        for lane in 0..last.len() {
            top[lane] += last_v[lane] * (last[lane] - last_old[lane]);
            bottom[lane] += last_v[lane] * last_v[lane] * last_m[lane];
            square[lane] += last[lane] * last[lane];
        }
        ForceSums {
            quotient_top: sum(&top),
            quotient_bottom: sum(&bottom) * self.mass,
            free: sum(&square),
            ..ForceSums::default()
        }
    }
}

/// Factors (a, b) of v ← a v + b F with the damping c: v ← ((2 − c)v + 2F/M)/(2 + c), at rest v ← F/2M.
pub fn move_factors(iteration: u64, mass: f64, damping: f64) -> (f64, f64) {
    if iteration == 0 {
        (0.0, 0.5 / mass)
    } else {
        ((2.0 - damping) / (2.0 + damping), 2.0 / (2.0 + damping) / mass)
    }
}

/// Updates v by [`move_factors`] and u ← u + v; constrained components stay.
pub fn move_pass<const D: usize>(
    loads: &Loads<D>,
    state: &mut State<D>,
    unit_mass: &[f64],
    mass: f64,
    damping: f64,
) {
    let sites = unit_mass.len();
    let (keep, push) = move_factors(state.counts.iteration, mass, damping);
    let force = state.force.components();
    let (displacement, velocity) = (state.displacement.chunks_mut(), state.velocity.chunks_mut());
    parallel::for_items(displacement.into_iter().zip(velocity).collect(), |chunk, (u, v)| {
        let range = chunk_range(chunk, sites);
        let constrained = loads.constrained.get(range.clone()).unwrap_or_default();
        for d in 0..D {
            let (f, m) = (&force[d][range.clone()], &unit_mass[range.clone()]);
            let (u, v) = (&mut *u[d], &mut *v[d]);
            let held = if constrained.iter().all(|h| h >> d & 1 == 0) { &[] } else { constrained };
            Arch::new().dispatch(RelaxationMove { f, m, u, v, held, bit: 1 << d, keep, push });
        }
    });
}

/// Runs [`move_pass`] over a component of a work item. If `held` is not empty, components with the `bit`
/// stay.
struct RelaxationMove<'a> {
    f: &'a [f64],
    m: &'a [f64],
    u: &'a mut [f64],
    v: &'a mut [f64],
    held: &'a [u8],
    bit: u8,
    keep: f64,
    push: f64,
}

impl NullaryFnOnce for RelaxationMove<'_> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        let Self { f, m, u, v, held, bit, keep, push } = self;
        let count = f.len();
        let (m, u, v) = (&m[..count], &mut u[..count], &mut v[..count]);
        if held.is_empty() {
            for k in 0..count {
                v[k] = keep * v[k] + push * f[k] / m[k];
                u[k] += v[k];
            }
            return;
        }
        let held = &held[..count];
        for k in 0..count {
            // a product with 0 or 1 instead of a branch: v of held components stays 0
            let free = f64::from(u8::from(held[k] & bit == 0));
            v[k] = free * (keep * v[k] + push * f[k] / m[k]);
            u[k] += v[k];
        }
    }
}
