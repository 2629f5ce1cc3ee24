//! Passes of a velocity-Verlet step over all sites: half a kick and the drift; forces; the other half; and
//! the sums of a history row.

use super::load::Loads;
use super::state::State;
use super::system::System;
use crate::bonds::{StretchRange, StretchScan};
use crate::field::{CHUNK, chunk_range};
use crate::parallel;

/// Constants of one step from t to t + Δt.
#[derive(Clone, Copy, Debug)]
pub struct VerletStep {
    /// Δt, s.
    pub step: f64,
    /// ρ, kg/m³.
    pub density: f64,
    /// c of the damping force −cρv, 1/s.
    pub damping: f64,
    /// Load factor before and after.
    pub factors: [f64; 2],
    /// Rate of the load factor after the step, 1/s.
    pub rate: f64,
}

/// Sums over all sites, item by item in a fixed order.
#[derive(Clone, Copy, Default, Debug)]
pub struct VerletSums {
    /// Kinetic energy Σ ½ρV v², J (only after the whole step).
    pub kinetic: f64,
    /// Work of body forces and supports in this half, J.
    pub work: f64,
    /// Work of the damping in this half, J.
    pub damped: f64,
    /// Largest component of an increment of displacement, m (first half only).
    pub increment: f64,
}

impl VerletSums {
    fn add(self, other: Self) -> Self {
        Self {
            kinetic: self.kinetic + other.kinetic,
            work: self.work + other.work,
            damped: self.damped + other.damped,
            increment: self.increment.max(other.increment),
        }
    }
}

/// Sites whose stretches are tracked together if bonds may break, a divisor of [`CHUNK`]: near a crack, few
/// such ranges hold overstretched bonds, but many work items do.
const CHECKED_SITES: usize = 256;

/// Volumes of all sites, m³, 0 without a particle, and their densities over that of the method; none: 1.
#[derive(Clone, Debug, Default)]
pub struct SiteMasses {
    /// Volumes.
    pub volumes: Vec<f64>,
    /// Relative densities; empty: 1.
    pub ratios: Vec<f64>,
}

impl SiteMasses {
    /// Collects the volumes of a system and its densities.
    pub fn new<const D: usize>(system: &System<D>) -> Self {
        let mut volumes = vec![0.0; system.bonds.sites()];
        for &site in system.bonds.particles() {
            volumes[site as usize] = system.bonds.volume(site as usize);
        }
        Self { volumes, ratios: system.density_ratios.clone() }
    }

    /// Volumes times relative densities, m³.
    pub fn weights(&self) -> Vec<f64> {
        let ratios = self.ratios.iter().copied().chain(std::iter::repeat(1.0));
        self.volumes.iter().zip(ratios).map(|(volume, ratio)| volume * ratio).collect()
    }
}

/// A work item of two fields.
pub type FieldPair<'a, const D: usize> = ([&'a mut [f64]; D], [&'a mut [f64]; D]);

/// Updates v ← v + ½Δt a and u ← u + Δt v; constrained components go to F d.
pub fn leap_pass<const D: usize>(
    loads: &Loads<D>,
    state: &mut State<D>,
    masses: &SiteMasses,
    leap: &VerletStep,
) -> VerletSums {
    let force = state.force.components();
    let keep = 1.0 - 0.5 * leap.damping * leap.step;
    let push = 0.5 * leap.step / leap.density;
    let loading = loads.force_factor(leap.factors[0]);
    let (displacement, velocity) = (state.displacement.chunks_mut(), state.velocity.chunks_mut());
    let of = |chunk: usize, (u, v): FieldPair<D>| {
        let range = chunk_range(chunk, masses.volumes.len());
        let mut sums = VerletSums::default();
        for d in 0..D {
            let at = AxisLoads::new(loads, masses, range.clone(), d);
            let (u, v, f) = (&mut *u[d], &mut *v[d], &force[d][range.clone()]);
            if at.is_plain(leap) {
                sums.increment = sums.increment.max(leap.step * free_leap(u, v, f, keep, push, leap.step));
                continue;
            }
            for k in 0..f.len() {
                let increment = if let Some(full) = at.constrained(k) {
                    let increment = leap.factors[1] * full - u[k];
                    u[k] = leap.factors[1] * full;
                    sums.work -= 0.5 * f[k] * increment * at.volumes[k];
                    increment
                } else {
                    let (before, ratio) = (v[k], at.ratio(k));
                    v[k] = keep * before + push / ratio * f[k];
                    let increment = leap.step * v[k];
                    u[k] += increment;
                    let damping = leap.damping * leap.density;
                    sums.damped += 0.5 * damping * before * increment * at.volumes[k] * ratio;
                    increment
                };
                sums.work += 0.5 * loading * at.body(k) * increment * at.volumes[k];
                sums.increment = sums.increment.max(increment.abs());
            }
        }
        sums
    };
    let parts = parallel::map_items(displacement.into_iter().zip(velocity).collect(), of);
    parts.into_iter().fold(VerletSums::default(), VerletSums::add)
}

/// Computes new forces and, if it `kicks`, the second half of the kick in the same pass; not if stretches are
/// checked first, or friction follows.
pub fn force_pass<const D: usize>(
    system: &mut System<D>,
    state: &mut State<D>,
    masses: &SiteMasses,
    leap: &VerletStep,
    look: bool,
    kicks: bool,
) -> (VerletSums, StretchRange) {
    let (loads, displacement, body) = (&*system.loads, &state.displacement, &*system);
    let (force, velocity) = (state.force.chunks_mut(), state.velocity.chunks_mut());
    let part = if look { body.piece().max(CHECKED_SITES) } else { CHUNK };
    let of = |chunk: usize, (mut f, mut v): FieldPair<D>| {
        let (start, length) = (chunk * CHUNK, f[0].len());
        let mut seen = Vec::new();
        for from in (0..length).step_by(part) {
            let mut observed = StretchRange::REST;
            let mut f = f.each_mut().map(|f| &mut f[from..(from + part).min(length)]);
            body.internal_force(displacement, start + from, &mut f, look.then_some(&mut observed));
            seen.extend(look.then_some(observed));
        }
        load(loads, start, leap.factors[1], &mut f);
        let f = f.map(|f| &*f);
        (if kicks { kick(loads, masses, leap, chunk, f, &mut v) } else { VerletSums::default() }, seen)
    };
    let (sums, seen): (Vec<VerletSums>, Vec<Vec<StretchRange>>) =
        parallel::map_items(force.into_iter().zip(velocity).collect(), of).into_iter().unzip();
    let seen = StretchScan { part, ranges: seen.concat() };
    let observed = seen.ranges.iter().copied().fold(StretchRange::REST, StretchRange::join);
    system.seen_stretches = seen;
    (sums.into_iter().fold(VerletSums::default(), VerletSums::add), observed)
}

/// Runs the second half of the kick: v ← v + ½Δt a with the new a; constrained components have the rate of F
/// d.
pub fn kick_pass<const D: usize>(
    loads: &Loads<D>,
    state: &mut State<D>,
    masses: &SiteMasses,
    leap: &VerletStep,
) -> VerletSums {
    let force = state.force.components();
    let velocity = state.velocity.chunks_mut();
    let of = |chunk: usize, mut v: [&mut [f64]; D]| {
        let range = chunk_range(chunk, masses.volumes.len());
        kick(loads, masses, leap, chunk, force.map(|f| &f[range.clone()]), &mut v)
    };
    let parts = parallel::map_items(velocity, of);
    parts.into_iter().fold(VerletSums::default(), VerletSums::add)
}

/// Computes forces with loads and present friction, of some sites and their neighbours, or of all; bonds of
/// other sites have not changed.
pub fn refresh<const D: usize>(
    system: &mut System<D>,
    state: &mut State<D>,
    factor: f64,
    sites: Option<&[u32]>,
) {
    system.prepare(&mut state.displacement);
    system.follow(&state.displacement);
    // states of particles change beyond their own bonds, and forces of a region with all of them
    let whole = system.material.has_points() || !system.loads.rigid.is_empty();
    let sites = sites.filter(|_| !whole);
    let system = &*system;
    let piece = if sites.is_some() { system.piece() } else { CHUNK };
    let pieces = sites.map(|sites| {
        let mut pieces: Vec<usize> = sites.iter().map(|&site| site as usize / piece).collect();
        pieces.sort_unstable();
        pieces.dedup();
        pieces
    });
    let (displacement, friction) = (&state.displacement, state.contact.friction.as_ref());
    let of = |start: usize, mut f: [&mut [f64]; D]| {
        system.internal_force(displacement, start, &mut f, None);
        load(&system.loads, start, factor, &mut f);
        if let Some(friction) = friction {
            for (f, rub) in f.iter_mut().zip(friction.components()) {
                f.iter_mut().zip(&rub[start..]).for_each(|(f, rub)| *f += rub);
            }
        }
    };
    parallel::for_items(state.force.chunks_mut(), |chunk, mut f| {
        let (first, length) = (chunk * CHUNK, f[0].len());
        let Some(pieces) = &pieces else { return of(first, f) };
        let [from, to] = [first, first + length].map(|site| pieces.partition_point(|&p| p * piece < site));
        for start in pieces[from..to].iter().map(|p| p * piece - first) {
            let end = (start + piece).min(length);
            of(first + start, f.each_mut().map(|f| &mut f[start..end]));
        }
    });
    system.level_forces(state);
}

/// Adds the body forces of the sites from `start` on.
fn load<const D: usize>(loads: &Loads<D>, start: usize, factor: f64, force: &mut [&mut [f64]; D]) {
    let Some(body) = &loads.body_force else { return };
    let factor = loads.force_factor(factor);
    for (force, body) in force.iter_mut().zip(body.components()) {
        force.iter_mut().zip(&body[start..]).for_each(|(f, b)| *f += factor * b);
    }
}

fn kick<const D: usize>(
    loads: &Loads<D>,
    masses: &SiteMasses,
    leap: &VerletStep,
    chunk: usize,
    force: [&[f64]; D],
    velocity: &mut [&mut [f64]; D],
) -> VerletSums {
    let range = chunk_range(chunk, masses.volumes.len());
    let push = 0.5 * leap.step / leap.density;
    let keep = 1.0 / (1.0 + 0.5 * leap.damping * leap.step);
    let [before, after] = leap.factors;
    let loading = loads.force_factor(after);
    let mut sums = VerletSums::default();
    let mut square = 0.0;
    for d in 0..D {
        let at = AxisLoads::new(loads, masses, range.clone(), d);
        let (v, f) = (&mut *velocity[d], force[d]);
        if at.is_plain(leap) {
            square += free_kick(v, f, at.volumes, push);
            continue;
        }
        for k in 0..f.len() {
            let (volume, ratio) = (at.volumes[k], at.ratio(k));
            let increment = if let Some(full) = at.constrained(k) {
                let increment = (after - before) * full;
                let old = std::mem::replace(&mut v[k], leap.rate * full);
                // the support moves the particle's mass, too
                let gained = 0.5 * leap.density * (v[k] * v[k] - old * old) * ratio;
                sums.work += (gained - 0.5 * f[k] * increment) * volume;
                increment
            } else {
                let increment = leap.step * v[k];
                v[k] = keep * (v[k] + push / ratio * f[k]);
                sums.damped += 0.5 * leap.damping * leap.density * v[k] * increment * volume * ratio;
                increment
            };
            sums.work += 0.5 * loading * at.body(k) * increment * volume;
            square += v[k] * v[k] * volume * ratio;
        }
    }
    sums.kinetic = 0.5 * leap.density * square;
    sums
}

/// The loads on one axis of a work item.
struct AxisLoads<'a> {
    constrained: &'a [u8],
    bit: usize,
    prescribed: &'a [f64],
    body: &'a [f64],
    volumes: &'a [f64],
    ratios: &'a [f64],
}

impl<'a> AxisLoads<'a> {
    fn new<const D: usize>(
        loads: &'a Loads<D>,
        masses: &'a SiteMasses,
        range: std::ops::Range<usize>,
        axis: usize,
    ) -> Self {
        let constrained = loads.constrained.get(range.clone()).unwrap_or_default();
        let constrained = if constrained.iter().any(|h| h >> axis & 1 == 1) { constrained } else { &[] };
        let of = |field: &'a Option<crate::field::Field<D>>| {
            field.as_ref().map_or(&[][..], |field| &field.components()[axis][range.clone()])
        };
        let (prescribed, body) = (of(&loads.displacement), of(&loads.body_force));
        let ratios = masses.ratios.get(range.clone()).unwrap_or_default();
        Self { constrained, bit: axis, prescribed, body, volumes: &masses.volumes[range], ratios }
    }

    /// Returns true without constraints, loads, damping and densities of parts.
    fn is_plain(&self, leap: &VerletStep) -> bool {
        self.constrained.is_empty() && self.body.is_empty() && leap.damping == 0.0 && self.ratios.is_empty()
    }

    /// Relative density.
    fn ratio(&self, k: usize) -> f64 {
        self.ratios.get(k).copied().unwrap_or(1.0)
    }

    /// Prescribed displacement at factor 1, if constrained.
    fn constrained(&self, k: usize) -> Option<f64> {
        let constrained = self.constrained.get(k).is_some_and(|h| h >> self.bit & 1 == 1);
        constrained.then(|| self.prescribed.get(k).copied().unwrap_or(0.0))
    }

    fn body(&self, k: usize) -> f64 {
        self.body.get(k).copied().unwrap_or(0.0)
    }
}

const LANES: usize = 8;

/// First half without constraints and loads, in parts that vectorise; returns the largest |v|.
fn free_leap(u: &mut [f64], v: &mut [f64], f: &[f64], keep: f64, push: f64, step: f64) -> f64 {
    let mut largest = [0.0; LANES];
    let parts = u.chunks_mut(LANES).zip(v.chunks_mut(LANES)).zip(f.chunks(LANES));
    for ((u, v), f) in parts {
        for lane in 0..f.len() {
            v[lane] = keep * v[lane] + push * f[lane];
            u[lane] += step * v[lane];
            let size = v[lane].abs();
            largest[lane] = if size > largest[lane] { size } else { largest[lane] };
        }
    }
    largest.into_iter().fold(0.0, f64::max)
}

/// Second half likewise; returns Σ V v².
fn free_kick(v: &mut [f64], f: &[f64], volumes: &[f64], push: f64) -> f64 {
    let mut square = [0.0; LANES];
    let parts = v.chunks_mut(LANES).zip(f.chunks(LANES)).zip(volumes.chunks(LANES));
    for ((v, f), volumes) in parts {
        for lane in 0..f.len() {
            v[lane] += push * f[lane];
            square[lane] += v[lane] * v[lane] * volumes[lane];
        }
    }
    square.iter().sum()
}

/// Energy of material and contact, J; over all fitted stretches, so that the law is sampled once per fit.
pub fn stored<const D: usize>(system: &mut System<D>, state: &State<D>, observed: StretchRange) -> f64 {
    let [low, high] = state.stretches.fitted.map(|stretch| stretch * stretch - 1.0);
    let inside = observed.low >= low && observed.high <= high;
    system.stored_energy(state, if inside { StretchRange { low, high } } else { observed })
}
