//! Vectors of L-BFGS on a device: launches of its kernels, and the sums that the host reads.

use super::body::{DeviceBody, LANES, numbers};
use super::kernels::{CUBE, KernelForm};
use super::lbfgs_kernels::{
    LINE_SUMS, PAIR_SUMS, advance, combine, line_sums, pair_products, reach, record, spread,
};
use super::steps::buffer;
use super::{Device, Precision};
use crate::bonds::{LatticeBonds, StretchRange};
use crate::error::Error;
use crate::field::Field;
use crate::potential::KernelFit;
use cubecl::ir::{ElemType, UIntKind};
use cubecl::prelude::*;
use cubecl::server::Handle;

/// Threads that sum products of one pair.
const PAIR_THREADS: usize = 1 << 14;

/// Sums of forces and their slope along the direction.
#[derive(Clone, Copy, Debug, Default)]
pub struct DeviceLineSums {
    /// Σ F² where free, (N/m³)².
    pub free: f64,
    /// Σ F² where held, without body forces, (N/m³)².
    pub constrained: f64,
    /// Slope of the energy along the direction, in the device's units.
    pub slope: f64,
    /// √(Σ |s u|²) with the springs s, N/m³; 0 where it was not measured.
    pub moved: f64,
}

/// A lattice and the vectors of L-BFGS on a device, with a diagonal preconditioner. The direction is in the
/// place of the body's velocity.
pub struct DeviceSearch<const D: usize> {
    /// Bonds, law, loads and fields.
    pub body: DeviceBody<D>,
    /// Forces of the iterate; those of the body are the trial's.
    before: Handle,
    /// Diagonal of B.
    local: Handle,
    springs: Handle,
    spring_unit: f64,
    /// s and w of all pairs, and their number.
    steps: Handle,
    images: Handle,
    pairs: usize,
    /// Kernels take the length of a list from its buffer: one for each number of lists.
    partial: Handle,
    sums: Handle,
    slopes: Handle,
    slope: Handle,
    pair_partial: Handle,
    pair_sums: Handle,
    /// A displacement and its forces, for stretches along a direction.
    scratch: Option<[Handle; 2]>,
}

impl<const D: usize> DeviceSearch<D> {
    /// Puts a body on a device, as [`DeviceBody::new`] does, with room for `pairs` pairs, and the springs s
    /// of its sites, N/m⁴, that rounding of displacements pulls at.
    ///
    /// # Errors
    /// Those of [`DeviceBody::new`]; [`Error::Device`] for pairs that the device's memory does not hold, and
    /// for springs of another body.
    pub fn new(
        device: &Device,
        bonds: &LatticeBonds<D>,
        (law, modulus): (&KernelFit, f64),
        springs: &[f64],
        pairs: usize,
    ) -> Result<Self, Error> {
        let body = DeviceBody::new(device, bonds, law, modulus)?;
        body.refuse_other_sites("springs", springs)?;
        let (bytes, list) = (body.precision.bytes() as usize, D * body.sites);
        device.refuse_large(bonds, pairs)?;
        let zeros = || numbers(&body.client, body.precision, (0..list).map(|_| 0.0));
        let singles = || numbers(&body.client, Precision::Single, (0..pairs * list).map(|_| 0.0));
        let empty = |length: usize| body.client.empty(length * bytes);
        let unit = springs.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        Ok(Self {
            // sites without a particle have neither
            before: zeros(),
            local: empty(body.sites),
            springs: numbers(&body.client, body.precision, springs.iter().map(|s| s / unit)),
            spring_unit: unit,
            steps: singles(),
            images: singles(),
            pairs,
            partial: empty(LINE_SUMS * body.threads()),
            sums: empty(LINE_SUMS * LANES),
            slopes: empty(body.threads()),
            slope: empty(LANES),
            pair_partial: empty(PAIR_SUMS * pairs * body.particles.min(PAIR_THREADS)),
            pair_sums: empty(PAIR_SUMS * pairs * LANES),
            scratch: None,
            body,
        })
    }

    /// Takes the displacement per force of each particle, m/N, of the preconditioner.
    pub fn set_local(&mut self, bonds: &LatticeBonds<D>, local: &[f64]) {
        use crate::bonds::BodyGeometry;
        let (body, mut each) = (&self.body, vec![0.0; self.body.sites]);
        for (&site, local) in bonds.particles().iter().zip(local) {
            each[site as usize] = local * body.volume * body.unit / body.spacing;
        }
        self.local = numbers(&body.client, body.precision, each.into_iter());
    }

    /// Displacement, m, and forces of the iterate with body forces, N/m³.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn iterate(&self) -> Result<[Field<D>; 2], Error> {
        let body = &self.body;
        Ok([body.download(&body.fields[0], body.spacing)?, body.download(&self.before, body.unit)?])
    }

    /// Takes the forces last computed as those of the iterate.
    pub fn arrive(&mut self) {
        std::mem::swap(&mut self.body.fields[2], &mut self.before);
    }

    /// Sums of the forces last computed along the direction; also of what has `moved` where it `measures`.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn line_sums(&self, measures: bool) -> Result<DeviceLineSums, Error> {
        let (body, threads) = (&self.body, self.body.threads());
        let [displacement, direction, force] = &body.fields;
        // SAFETY: every buffer has the length named here, and the sites of particles lie inside
        unsafe {
            line_sums::launch_unchecked(
                &body.client,
                body.cubes_of(threads),
                CubeDim::new_1d(CUBE as u32),
                buffer(force, D * body.sites),
                buffer(direction, D * body.sites),
                buffer(displacement, D * body.sites),
                buffer(&body.sites_of_particles, body.particles),
                buffer(&body.held, body.held_words()),
                buffer(&self.springs, body.sites),
                body.loads(),
                buffer(&self.partial, LINE_SUMS * threads),
                InputScalar::new(body.loading, body.precision.element()),
                body.form,
                measures,
                body.precision.element(),
            );
        }
        body.fold([&self.partial, &self.sums], threads, LANES, (0, 1), (LINE_SUMS, 0, 0));
        let lists = sums_of(&body.values(&self.sums)?);
        let square = body.unit * body.unit;
        Ok(DeviceLineSums {
            free: square * lists[0],
            constrained: square * lists[1],
            slope: lists[2],
            moved: self.spring_unit * body.spacing * lists[3].sqrt(),
        })
    }

    /// Moves by `step` times the direction.
    pub fn advance(&self, step: f64) {
        let body = &self.body;
        // SAFETY: both are fields
        unsafe {
            advance::launch_unchecked(
                &body.client,
                body.cubes_of(D * body.sites),
                CubeDim::new_1d(CUBE as u32),
                buffer(&body.fields[1], D * body.sites),
                buffer(&body.fields[0], D * body.sites),
                InputScalar::new(step, body.precision.element()),
                body.precision.element(),
            );
        }
    }

    /// Records the pair of a step taken from the iterate to the forces last computed in place `slot`; for
    /// each place s·y, w·y, s·g, w·g with the newest y and g.
    ///
    /// # Errors
    /// [`Error::Device`] for a place beyond the last, and where the device fails.
    pub fn record(&self, slot: usize, step: f64) -> Result<Vec<[f64; PAIR_SUMS]>, Error> {
        if slot >= self.pairs {
            return Err(Error::Device(format!(
                "found place {slot} for a pair; allowed: 0 to {}",
                self.pairs - 1
            )));
        }
        let (body, threads) = (&self.body, self.body.threads());
        let (list, lanes) = (D * body.sites, body.particles.min(PAIR_THREADS));
        let [_, direction, force] = &body.fields;
        // SAFETY: as in `line_sums`; there are `pairs` places
        unsafe {
            record::launch_unchecked(
                &body.client,
                body.cubes_of(threads),
                CubeDim::new_1d(CUBE as u32),
                buffer(force, list),
                buffer(&self.before, list),
                buffer(direction, list),
                buffer(&body.sites_of_particles, body.particles),
                buffer(&body.held, body.held_words()),
                buffer(&self.local, body.sites),
                buffer(&self.steps, self.pairs * list),
                buffer(&self.images, self.pairs * list),
                index(threads),
                index(slot),
                InputScalar::new(step, body.precision.element()),
                body.form,
                body.precision.element(),
            );
            pair_products::launch_unchecked(
                &body.client,
                body.cubes_of(self.pairs * lanes),
                CubeDim::new_1d(CUBE as u32),
                buffer(force, list),
                buffer(&self.before, list),
                buffer(&body.sites_of_particles, body.particles),
                buffer(&body.held, body.held_words()),
                buffer(&self.steps, self.pairs * list),
                buffer(&self.images, self.pairs * list),
                buffer(&self.pair_partial, PAIR_SUMS * self.pairs * lanes),
                body.form,
                self.pairs,
                body.precision.element(),
            );
        }
        let rows = PAIR_SUMS * self.pairs;
        body.fold([&self.pair_partial, &self.pair_sums], lanes, LANES, (0, 1), (rows, 0, 0));
        let lists = sums_of(&body.values(&self.pair_sums)?);
        Ok(lists.as_chunks::<PAIR_SUMS>().0.to_vec())
    }

    /// Computes the direction −γ B g + Σ (γ a w − b s) from the iterate, with γ a and b of each place in
    /// `weights`; returns the slope along it, in the device's units.
    ///
    /// # Errors
    /// [`Error::Device`] for weights of another number of places, and where the device fails.
    pub fn combine(&self, scale: f64, weights: &[[f64; 2]]) -> Result<f64, Error> {
        if weights.len() != self.pairs {
            let (found, pairs) = (weights.len(), self.pairs);
            return Err(Error::Device(format!("found weights of {found} places; allowed: {pairs}")));
        }
        let (body, threads, list) = (&self.body, self.body.threads(), D * self.body.sites);
        let weights = numbers(&body.client, body.precision, weights.as_flattened().iter().copied());
        // SAFETY: as in `record`, with two weights a place
        unsafe {
            combine::launch_unchecked(
                &body.client,
                body.cubes_of(threads),
                CubeDim::new_1d(CUBE as u32),
                buffer(&self.before, list),
                buffer(&body.sites_of_particles, body.particles),
                buffer(&body.held, body.held_words()),
                buffer(&self.local, body.sites),
                buffer(&self.steps, self.pairs * list),
                buffer(&self.images, self.pairs * list),
                buffer(&weights, 2 * self.pairs),
                buffer(&body.fields[1], list),
                buffer(&self.slopes, threads),
                InputScalar::new(scale, body.precision.element()),
                body.form,
                body.precision.element(),
            );
        }
        body.fold([&self.slopes, &self.slope], threads, LANES, (0, 1), (1, 0, 0));
        Ok(sums_of(&body.values(&self.slope)?)[0])
    }

    /// Greatest length of the direction, m, and its greatest difference between particles in contact or about
    /// to touch.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn moves(&self) -> Result<[f64; 2], Error> {
        let (body, threads) = (&self.body, self.body.threads());
        // SAFETY: as in `line_sums`
        unsafe {
            reach::launch_unchecked(
                &body.client,
                body.cubes_of(threads),
                CubeDim::new_1d(CUBE as u32),
                buffer(&body.fields[1], D * body.sites),
                buffer(&body.sites_of_particles, body.particles),
                buffer(&self.slopes, threads),
                D,
                body.precision.element(),
            );
        }
        body.fold([&self.slopes, &self.slope], threads, LANES, (0, 1), (1, 1, 0));
        Ok([body.longest(&self.slope)?, body.closing()?])
    }

    /// Extremes of e of bonds in the direction, times `factor`, as a displacement.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn range_along(&mut self, factor: f64) -> Result<StretchRange, Error> {
        let list = D * self.body.sites;
        let body = &mut self.body;
        let bytes = list * body.precision.bytes() as usize;
        let scratch = self.scratch.take().unwrap_or_else(|| [(); 2].map(|()| body.client.empty(bytes)));
        // SAFETY: both are fields
        unsafe {
            spread::launch_unchecked(
                &body.client,
                body.cubes_of(list),
                CubeDim::new_1d(CUBE as u32),
                buffer(&body.fields[1], list),
                buffer(&scratch[0], list),
                InputScalar::new(factor, body.precision.element()),
                body.precision.element(),
            );
        }
        let form = KernelForm { loaded: false, ..body.form };
        let all = (&body.sites_of_particles, body.particles);
        body.launch_pull([&scratch[0], &scratch[1]], all, 0.0, form, true);
        self.scratch = Some(scratch);
        Ok(self.body.stretch_range()?.0)
    }
}

fn index(x: usize) -> InputScalar {
    InputScalar::new(x as u32, ElemType::UInt(UIntKind::U32))
}

/// Sums lists of [`LANES`] numbers.
fn sums_of(values: &[f64]) -> Vec<f64> {
    values.chunks(LANES).map(|list| list.iter().sum()).collect()
}
