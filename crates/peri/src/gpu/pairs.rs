//! Contact between particles on a device: its buffers, and the launches of its kernels.

use super::body::{DeviceBody, LANES, MOST_STEPS, numbers};
use super::kernels::CUBE;
use super::pair_kernels::{PAIR, close_in, push_apart, weigh_pairs};
use super::steps::buffer;
use crate::contact::{PairRows, numbers_within};
use crate::error::Error;
use cubecl::prelude::*;
use cubecl::server::Handle;
use std::ops::Range;

/// Pairs of particles near each other on a device.
pub(super) struct DevicePairs {
    sites: Vec<u32>,
    entries: usize,
    near: f64,
    all: Handle,
    particles: Handle,
    ends: Handle,
    alone: Handle,
    others: Handle,
    pairs: Handle,
    stiff: Handle,
    greatest: Handle,
    square: Handle,
}

impl<const D: usize> DeviceBody<D> {
    /// Takes pairs, which act from now on in all forces of the body.
    pub fn set_pairs(&mut self, rows: Option<PairRows<D>>) {
        self.pairs = rows.filter(|rows| !rows.sites.is_empty()).map(|rows| self.upload_pairs(rows));
    }

    fn upload_pairs(&self, rows: PairRows<D>) -> DevicePairs {
        let (client, precision) = (&self.client, self.precision);
        let whole = |list: &[u32]| client.create_from_slice(u32::as_bytes(list));
        let empty = |length: usize| client.empty(length * precision.bytes() as usize);
        let ends = rows.distances.iter().zip(&rows.stiffness);
        let each = rows.bonds.iter().zip(ends).flat_map(|(bond, (distance, stiffness))| {
            let lengths = bond.iter().copied().chain([*distance]).map(|x| x / self.spacing);
            lengths.chain([stiffness * self.spacing / self.unit])
        });
        DevicePairs {
            entries: rows.others.len(),
            near: rows.near / self.spacing,
            all: whole(&(0..rows.sites.len() as u32).collect::<Vec<_>>()),
            particles: whole(&rows.sites),
            ends: whole(&rows.ends),
            alone: whole(&rows.alone.iter().map(|&alone| alone.into()).collect::<Vec<_>>()),
            others: whole(&rows.others),
            pairs: numbers(client, precision, each),
            stiff: empty(rows.sites.len()),
            greatest: empty(MOST_STEPS * LANES),
            square: empty(LANES),
            sites: rows.sites,
        }
    }

    /// Adds the forces of pairs to those of all particles, or of those whose sites lie in the ranges `among`.
    pub fn push_pairs(&self, among: Option<&[Range<usize>]>) {
        let Some(pairs) = &self.pairs else { return };
        match among.map(|ranges| numbers_within(&pairs.sites, ranges)) {
            None => self.launch_pairs(pairs, (&pairs.all, pairs.sites.len()), true),
            Some(list) if list.is_empty() => {}
            Some(list) => {
                let chosen = self.client.create_from_slice(u32::as_bytes(&list));
                self.launch_pairs(pairs, (&chosen, list.len()), true);
            }
        }
    }

    /// Measures the stiffness of all pairs, for [`Self::keep_stiffness`].
    pub fn measure_pairs(&self) {
        if let Some(pairs) = &self.pairs {
            self.launch_pairs(pairs, (&pairs.all, pairs.sites.len()), false);
        }
    }

    fn launch_pairs(&self, pairs: &DevicePairs, (chosen, count): (&Handle, usize), acts: bool) {
        let [displacement, _, force] = &self.fields;
        // SAFETY: every buffer has the length named here, and sites of pairs lie inside
        unsafe {
            push_apart::launch_unchecked(
                &self.client,
                self.cubes_of(count),
                CubeDim::new_1d(CUBE as u32),
                buffer(displacement, D * self.sites),
                buffer(chosen, count),
                buffer(&pairs.particles, pairs.sites.len()),
                buffer(&pairs.ends, pairs.sites.len() + 1),
                buffer(&pairs.others, pairs.entries),
                buffer(&pairs.pairs, (D + PAIR) * pairs.entries),
                buffer(force, D * self.sites),
                buffer(&pairs.stiff, pairs.sites.len()),
                self.form,
                acts,
                self.precision.element(),
            );
        }
    }

    /// Keeps the greatest stiffness of pairs on a particle, as number `slot` of those to be read.
    pub fn keep_stiffness(&self, slot: usize) {
        if let Some(pairs) = &self.pairs {
            let length = pairs.sites.len();
            self.fold([&pairs.stiff, &pairs.greatest], length, LANES, (slot, MOST_STEPS), (1, 1, 0));
        }
    }

    /// Greatest stiffness of pairs on a particle, N/m⁴, kept in the first `slots`.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn pair_stiffness(&self, slots: usize) -> Result<Vec<f64>, Error> {
        let Some(pairs) = &self.pairs else { return Ok(vec![0.0; slots]) };
        let values = self.values(&pairs.greatest)?;
        let greatest = |slot: &[f64]| self.unit / self.spacing * slot.iter().copied().fold(0.0, f64::max);
        Ok(values.chunks(LANES).take(slots).map(greatest).collect())
    }

    /// Adds the stiffness of pairs, present or about to touch, to the masses of a relaxation, times `factor`.
    pub(super) fn weigh_pairs(&self, mass: &Handle, factor: f64) {
        let Some(pairs) = &self.pairs else { return };
        let (count, element) = (pairs.sites.len(), self.precision.element());
        // SAFETY: as in `launch_pairs`
        unsafe {
            weigh_pairs::launch_unchecked(
                &self.client,
                self.cubes_of(count),
                CubeDim::new_1d(CUBE as u32),
                buffer(&self.fields[0], D * self.sites),
                buffer(&pairs.particles, count),
                buffer(&pairs.ends, count + 1),
                buffer(&pairs.alone, count),
                buffer(&pairs.others, pairs.entries),
                buffer(&pairs.pairs, (D + PAIR) * pairs.entries),
                buffer(mass, self.sites),
                InputScalar::new(pairs.near, element),
                InputScalar::new(factor, element),
                self.form,
                element,
            );
        }
    }

    /// Greatest difference, m, of the direction in the place of the velocity between particles in contact or
    /// about to touch.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub(super) fn closing(&self) -> Result<f64, Error> {
        let Some(pairs) = &self.pairs else { return Ok(0.0) };
        let (count, element) = (pairs.sites.len(), self.precision.element());
        let [displacement, direction, _] = &self.fields;
        // SAFETY: as in `launch_pairs`
        unsafe {
            close_in::launch_unchecked(
                &self.client,
                self.cubes_of(count),
                CubeDim::new_1d(CUBE as u32),
                buffer(displacement, D * self.sites),
                buffer(direction, D * self.sites),
                buffer(&pairs.particles, count),
                buffer(&pairs.ends, count + 1),
                buffer(&pairs.others, pairs.entries),
                buffer(&pairs.pairs, (D + PAIR) * pairs.entries),
                buffer(&pairs.stiff, count),
                InputScalar::new(pairs.near, element),
                self.form,
                element,
            );
        }
        self.fold([&pairs.stiff, &pairs.square], count, LANES, (0, 1), (1, 1, 0));
        self.longest(&pairs.square)
    }

    /// Root of the greatest of squares of lengths, m.
    pub(super) fn longest(&self, squares: &Handle) -> Result<f64, Error> {
        let greatest = self.values(squares)?.into_iter().fold(0.0, f64::max);
        Ok(self.spacing * greatest.sqrt())
    }

    /// Displacement, m.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn displacement(&self) -> Result<crate::field::Field<D>, Error> {
        self.download(&self.fields[0], self.spacing)
    }
}
