//! Steps of velocity Verlet on a device: launches of its kernels, and what the host reads of them.

use super::body::{DeviceBody, FOLDED, LANES, LISTED, MOST_STEPS, cubes, failed};
use super::kernels::{CUBE, KernelForm, LEAP_SUMS, SUMS, half_kick_and_drift, kick, pull};
use super::list_kernels::{copy, fold, scatter};
use crate::bonds::StretchRange;
use crate::error::Error;
use cubecl::ir::{ElemType, UIntKind};
use cubecl::prelude::*;
use cubecl::server::Handle;

/// Constants of a step from t to t + Δt.
#[derive(Clone, Copy, Debug)]
pub struct DeviceStep {
    /// Δt, s.
    pub time_step: f64,
    /// ρ, kg/m³.
    pub density: f64,
    /// Mass-proportional damping c, 1/s.
    pub damping: f64,
    /// Load factor before and after, of prescribed displacements.
    pub factors: [f64; 2],
    /// Factor of body forces before and after.
    pub loading: [f64; 2],
    /// Rate of the load factor after the step, 1/s.
    pub rate: f64,
}

/// Sums of a step, each half of it.
#[derive(Clone, Copy, Debug, Default)]
pub struct StepSums {
    /// Work of body forces and supports, J.
    pub work: [f64; 2],
    /// Work of the damping, J.
    pub damped: [f64; 2],
    /// Largest component of an increment of displacement, m.
    pub increment: f64,
    /// Kinetic energy after the step, J.
    pub kinetic: f64,
}

/// Bond beyond its limit: site, number among the site's bonds, e = λ² − 1.
pub type ListedBond = (u32, u32, f64);

impl<const D: usize> DeviceBody<D> {
    /// The first half of a step: half a kick and the drift.
    pub fn half_kick_and_drift(&mut self, step: &DeviceStep) {
        let half = 0.5 * step.damping * step.time_step;
        let push = 0.5 * step.time_step.powi(2) * self.unit / (step.density * self.spacing);
        let ratio = if self.time_step > 0.0 { step.time_step / self.time_step } else { 1.0 };
        self.time_step = step.time_step;
        let [displacement, velocity, force] = &self.fields;
        let number = |x: f64| InputScalar::new(x, self.precision.element());
        // SAFETY: every buffer has the length named here, and the sites of particles lie inside
        unsafe {
            half_kick_and_drift::launch_unchecked(
                &self.client,
                self.cubes_of(self.threads()),
                CubeDim::new_1d(CUBE as u32),
                buffer(force, D * self.sites),
                buffer(&self.sites_of_particles, self.particles),
                buffer(&self.held, self.held_words()),
                buffer(&self.full, if self.form.held { D * self.sites } else { 1 }),
                self.loads(),
                buffer(velocity, D * self.sites),
                buffer(displacement, D * self.sites),
                buffer(&self.partial, SUMS * self.threads()),
                number(ratio),
                number(1.0 - half),
                number(push),
                number(step.factors[1]),
                self.form,
                self.precision.element(),
            );
        }
    }

    /// Forces of the present displacement with body forces at a load factor, and of contact. Where it
    /// `looks`, [`Self::stretch_range`] has what it saw.
    pub fn pull(&mut self, factor: f64, looks: bool) {
        self.loading = factor;
        if looks {
            self.count = self.client.create_from_slice(u32::as_bytes(&[0]));
        }
        let [displacement, _, force] = &self.fields;
        let all = (&self.sites_of_particles, self.particles);
        self.launch_pull([displacement, force], all, factor, self.form, looks);
        self.press(None);
        self.push_pairs(None);
    }

    /// Forces of some sites, without those of contact.
    pub fn pull_at(&self, sites: &[u32], factor: f64) {
        let [displacement, _, force] = &self.fields;
        let some = self.client.create_from_slice(u32::as_bytes(sites));
        let form = KernelForm { tile: 1, ..self.form };
        self.launch_pull([displacement, force], (&some, sites.len()), factor, form, false);
    }

    /// The second half of a step: half a kick.
    pub fn kick(&self, step: &DeviceStep) {
        let half = 0.5 * step.damping * step.time_step;
        let push = 0.5 * step.time_step.powi(2) * self.unit / (step.density * self.spacing);
        let [_, velocity, force] = &self.fields;
        let number = |x: f64| InputScalar::new(x, self.precision.element());
        // SAFETY: as in `leap`
        unsafe {
            kick::launch_unchecked(
                &self.client,
                self.cubes_of(self.threads()),
                CubeDim::new_1d(CUBE as u32),
                buffer(force, D * self.sites),
                buffer(&self.sites_of_particles, self.particles),
                buffer(&self.held, self.held_words()),
                buffer(&self.full, if self.form.held { D * self.sites } else { 1 }),
                self.loads(),
                buffer(velocity, D * self.sites),
                buffer(&self.partial, SUMS * self.threads()),
                number(1.0 / (1.0 + half)),
                number(push),
                number(step.rate * step.time_step),
                number(step.factors[1] - step.factors[0]),
                self.form,
                self.precision.element(),
            );
        }
    }

    /// Keeps the sums of the step just taken, as number `slot` of those to be read.
    pub fn keep_sums(&self, slot: usize) {
        let greatest = 1 << (LEAP_SUMS - 1);
        let (from, length) = (&self.partial, self.threads());
        self.fold([from, &self.sums], length, LANES, (slot, MOST_STEPS), (SUMS, greatest, 0));
    }

    /// Sums of the steps kept in the first slots, each with the constants of its step.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn sums(&self, steps: &[DeviceStep]) -> Result<Vec<StepSums>, Error> {
        let bytes = (steps.len() * SUMS * LANES) as u64 * self.precision.bytes();
        let all = (MOST_STEPS * SUMS * LANES) as u64 * self.precision.bytes();
        let values = self.values(&self.sums.clone().offset_end(all - bytes))?;
        let sums = values.chunks(SUMS * LANES).zip(steps).map(|(slot, step)| self.sums_of(slot, step));
        Ok(sums.collect())
    }

    fn sums_of(&self, slot: &[f64], step: &DeviceStep) -> StepSums {
        let lists: Vec<&[f64]> = slot.chunks(LANES).collect();
        let sum = |row: usize| lists[row].iter().sum::<f64>();
        let work = self.unit * self.spacing * self.volume;
        let speed = self.spacing / step.time_step;
        let mass = 0.5 * step.density * self.volume;
        let damping = mass * step.damping * speed * self.spacing;
        let [before, after] = step.loading;
        let kick = LEAP_SUMS;
        StepSums {
            work: [
                0.5 * work * (before * sum(2) - sum(0)),
                mass * speed * speed * sum(kick + 2) + 0.5 * work * (after * sum(kick + 4) - sum(kick + 1)),
            ],
            damped: [damping * sum(1), damping * sum(kick + 3)],
            increment: self.spacing
                * lists[LEAP_SUMS - 1].iter().fold(0.0_f64, |most, &x| if most >= x { most } else { x }),
            kinetic: mass * speed * speed * sum(kick),
        }
    }

    /// Extremes of e over all intact bonds in the last forces that looked, and how many ends of bonds are
    /// listed.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn stretch_range(&self) -> Result<(StretchRange, usize), Error> {
        let length = cubes(self.particles, self.form.tile) * CUBE;
        let lanes = length.min(FOLDED);
        self.fold([&self.ranges, &self.folded], length, lanes, (0, 1), (2, 2, 1));
        self.fold([&self.folded, &self.extremes], lanes, LANES, (0, 1), (2, 2, 1));
        let values = self.values(&self.extremes)?;
        let bytes = self.client.read_one(self.count.clone()).map_err(|error| failed(&error))?;
        let (low, high) = values.split_at(LANES);
        // a stretch that is not a number is one to look at
        let least = |a: f64, b: &f64| if a <= *b { a } else { *b };
        let greatest = |a: f64, b: &f64| if a >= *b { a } else { *b };
        let range = StretchRange { low: low.iter().fold(0.0, least), high: high.iter().fold(0.0, greatest) };
        Ok((range, u32::from_bytes(&bytes)[0] as usize))
    }

    /// Listed bonds, by site and number; `None` where there were too many.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn listed(&self, count: usize) -> Result<Option<Vec<ListedBond>>, Error> {
        if count > LISTED {
            return Ok(None);
        }
        let left = (LISTED - count) as u64;
        let list = self.list.clone().offset_end(8 * left);
        let bytes = self.client.read_one(list).map_err(|error| failed(&error))?;
        let elongations = self.values(&self.elongations.clone().offset_end(left * self.precision.bytes()))?;
        let pairs = u32::from_bytes(&bytes).chunks(2).zip(elongations);
        let mut found: Vec<ListedBond> = pairs.map(|(pair, e)| (pair[0], pair[1], e)).collect();
        found.sort_unstable_by_key(|bond| (bond.0, bond.1));
        Ok(Some(found))
    }

    /// Takes words of 64 bonds of sites, as [`crate::bonds::BondDamage::intact`] has them: place and word.
    pub fn replace(&self, words: &[(usize, u64)]) {
        let rows = self.form.bonds.div_ceil(32);
        let (mut places, mut values) = (Vec::new(), Vec::new());
        for &(at, word) in words {
            let (row, site) = (at / self.sites, at % self.sites);
            for half in (0..2).filter(|half| 2 * row + half < rows) {
                places.push(((2 * row + half) * self.sites + site) as u32);
                values.push((word >> (32 * half)) as u32);
            }
        }
        let [from, into] = [&places, &values].map(|list| self.client.create_from_slice(u32::as_bytes(list)));
        // SAFETY: places lie inside of the words
        unsafe {
            scatter::launch_unchecked(
                &self.client,
                self.cubes_of(places.len()),
                CubeDim::new_1d(CUBE as u32),
                buffer(&from, places.len()),
                buffer(&into, places.len()),
                buffer(&self.intact, rows * self.sites),
            );
        }
    }

    /// Keeps the present fields for [`Self::take_back`].
    pub fn keep_state(&mut self) {
        let bytes = D * self.sites * self.precision.bytes() as usize;
        let kept = self.kept.take().unwrap_or_else(|| [(); 3].map(|()| self.client.empty(bytes)));
        for (from, into) in self.fields.iter().zip(&kept) {
            self.copy(from, into, D * self.sites);
        }
        self.kept = Some(kept);
    }

    /// Goes back to the fields kept, of the time step Δt, s.
    pub fn take_back(&mut self, time_step: f64) {
        let Some(kept) = &self.kept else { return };
        for (from, into) in kept.iter().zip(&self.fields) {
            self.copy(from, into, D * self.sites);
        }
        self.time_step = time_step;
    }

    /// Copies a list of `length` numbers.
    pub(super) fn copy(&self, from: &Handle, into: &Handle, length: usize) {
        // SAFETY: both have that length
        unsafe {
            copy::launch_unchecked(
                &self.client,
                self.cubes_of(length),
                CubeDim::new_1d(CUBE as u32),
                buffer(from, length),
                buffer(into, length),
                self.precision.element(),
            );
        }
    }

    pub(super) fn threads(&self) -> usize {
        self.particles.min(super::body::THREADS)
    }

    pub(super) fn cubes_of(&self, threads: usize) -> CubeCount {
        cubecl::calculate_cube_count_elemwise(&self.client, threads, CubeDim::new_1d(CUBE as u32))
    }

    /// Forces of the particles in a list of sites.
    pub(super) fn launch_pull(
        &self,
        [displacement, force]: [&Handle; 2],
        (sites, count): (&Handle, usize),
        factor: f64,
        form: KernelForm,
        looks: bool,
    ) {
        let element = self.precision.element();
        let threads = cubes(count, form.tile) * CUBE;
        // SAFETY: as in `leap`; shifts of intact bonds lead to sites
        unsafe {
            pull::launch_unchecked(
                &self.client,
                self.cubes_of(threads),
                CubeDim::new_1d(CUBE as u32),
                buffer(displacement, D * self.sites),
                self.factors(),
                buffer(sites, count),
                buffer(&self.shifts, form.bonds),
                buffer(&self.rows, form.bonds * (D + super::kernels::ROW)),
                buffer(&self.law, self.law_numbers),
                buffer(&self.intact, form.bonds.div_ceil(32) * self.sites),
                buffer(&self.body, if form.loaded { D * self.sites } else { 1 }),
                buffer(force, D * self.sites),
                buffer(&self.ranges, 2 * cubes(self.particles, self.form.tile) * CUBE),
                buffer(&self.count, 1),
                buffer(&self.list, 2 * LISTED),
                buffer(&self.elongations, LISTED),
                InputScalar::new(factor, element),
                form,
                looks,
                element,
            );
        }
    }

    /// Folds lists of `length` to `lanes` numbers each, into part `slot` of `slots`.
    pub(super) fn fold(
        &self,
        [from, into]: [&Handle; 2],
        length: usize,
        lanes: usize,
        (slot, slots): (usize, usize),
        (rows, greatest, least): (usize, u32, u32),
    ) {
        let index = |x: usize| InputScalar::new(x as u32, ElemType::UInt(UIntKind::U32));
        // SAFETY: `from` has `rows` lists of `length`, `into` has `slots` times `rows` of `lanes`
        unsafe {
            fold::launch_unchecked(
                &self.client,
                self.cubes_of(lanes),
                CubeDim::new_1d(CUBE as u32),
                buffer(from, rows * length),
                buffer(into, slots * rows * lanes),
                index(lanes),
                index(slot * rows * lanes),
                rows,
                greatest,
                least,
                self.precision.element(),
            );
        }
    }
}

/// A buffer as a kernel takes it.
pub(super) fn buffer(handle: &Handle, length: usize) -> BufferArg {
    // SAFETY: every buffer is made for at least `length` numbers of the kernel's type
    unsafe { BufferArg::from_raw_parts(handle.clone(), length) }
}
