//! Contact with planes on a device: its buffers, and the launches of its kernels.

use super::body::{DeviceBody, LANES, MOST_STEPS, numbers};
use super::kernels::CUBE;
use super::plane_kernels::{PLANE, press, spread_pushes, stop, weigh};
use super::steps::buffer;
use crate::contact::{PlaneRows, numbers_within};
use crate::error::Error;
use cubecl::prelude::*;
use cubecl::server::Handle;
use std::ops::Range;

/// Contact with planes on a device: forces on elements are in units of the body's unit force times its
/// volume.
pub(super) struct DevicePlanes<const D: usize> {
    rows: PlaneRows<D>,
    ends: Handle,
    below: Handle,
    weights: Handle,
    planes: Handle,
    heights: Handle,
    stiffness: Handle,
    shifts: Handle,
    sizes: Handle,
    pushes: Handle,
    stiff: Handle,
    /// All particles below elements, by their numbers.
    all: Handle,
    particles: Handle,
    particle_ends: Handle,
    above: Handle,
    shares: Handle,
    squares: Handle,
    square: Handle,
    sums: Handle,
}

impl<const D: usize> DevicePlanes<D> {
    fn planes(&self) -> usize {
        self.rows.normals.len()
    }
}

impl<const D: usize> DeviceBody<D> {
    /// Takes planes, which act from now on in all forces of the body; without elements there are none.
    pub fn set_planes(&mut self, rows: Option<PlaneRows<D>>) {
        let rows = rows.filter(|rows| rows.elements() > 0 && !rows.normals.is_empty());
        self.planes = rows.map(|rows| self.upload_planes(rows));
    }

    fn upload_planes(&self, rows: PlaneRows<D>) -> DevicePlanes<D> {
        let (client, precision) = (&self.client, self.precision);
        let whole = |list: &[u32]| client.create_from_slice(u32::as_bytes(list));
        let places = |entries: &[(u32, f64)]| whole(&entries.iter().map(|entry| entry.0).collect::<Vec<_>>());
        let values = |entries: &[(u32, f64)], scale: f64| {
            numbers(client, precision, entries.iter().map(|entry| entry.1 * scale))
        };
        let scaled =
            |list: &[f64], scale: f64| numbers(client, precision, list.iter().map(|value| value * scale));
        let empty = |length: usize| client.empty(length * precision.bytes() as usize);
        let (elements, planes, sites) = (rows.elements(), rows.normals.len(), rows.sites.len());
        let of_planes = rows.normals.iter().zip(&rows.mixed);
        let of_planes = of_planes.flat_map(|(normal, mixed)| normal.iter().copied().chain([*mixed]));
        DevicePlanes {
            ends: whole(&rows.ends),
            below: places(&rows.below),
            weights: values(&rows.below, 1.0),
            planes: numbers(client, precision, of_planes),
            heights: scaled(&rows.heights, 1.0 / self.spacing),
            stiffness: scaled(&rows.stiffness, self.spacing / (self.unit * self.volume)),
            shifts: scaled(&rows.shifts, 1.0 / self.spacing),
            sizes: scaled(&vec![0.0; planes * elements], 1.0),
            pushes: empty(D * elements),
            stiff: empty(elements),
            all: whole(&(0..sites as u32).collect::<Vec<_>>()),
            particles: whole(&rows.sites),
            particle_ends: whole(&rows.particle_ends),
            above: places(&rows.above),
            shares: values(&rows.above, self.volume),
            squares: empty(sites),
            square: empty(LANES),
            sums: empty(MOST_STEPS * planes * LANES),
            rows,
        }
    }

    /// Places planes for the next forces by their displacements along their normals, m.
    pub fn place_planes(&mut self, shifts: &[f64]) {
        let Some(planes) = &mut self.planes else { return };
        let shifts = shifts.iter().map(|shift| shift / self.spacing);
        planes.shifts = numbers(&self.client, self.precision, shifts);
    }

    /// Adds the forces of planes to those of all particles, or of those whose sites lie in the ranges
    /// `among`.
    pub fn press(&self, among: Option<&[Range<usize>]>) {
        let Some(planes) = &self.planes else { return };
        self.launch_press(planes, false);
        let rows = &planes.rows;
        let chosen = among.map(|ranges| numbers_within(&rows.sites, ranges));
        let count = chosen.as_ref().map_or(rows.sites.len(), Vec::len);
        if count == 0 {
            return;
        }
        let chosen = chosen.map(|list| self.client.create_from_slice(u32::as_bytes(&list)));
        let [_, _, force] = &self.fields;
        // SAFETY: every buffer has the length named here, and entries lie inside
        unsafe {
            spread_pushes::launch_unchecked(
                &self.client,
                self.cubes_of(count),
                CubeDim::new_1d(CUBE as u32),
                buffer(chosen.as_ref().unwrap_or(&planes.all), count),
                buffer(&planes.particles, rows.sites.len()),
                buffer(&planes.particle_ends, rows.particle_ends.len()),
                buffer(&planes.above, rows.above.len()),
                buffer(&planes.shares, rows.above.len()),
                buffer(&planes.pushes, D * rows.elements()),
                buffer(force, D * self.sites),
                buffer(&planes.squares, rows.sites.len()),
                self.form,
                self.precision.element(),
            );
        }
    }

    fn launch_press(&self, planes: &DevicePlanes<D>, weighs: bool) {
        let (rows, count) = (&planes.rows, planes.planes());
        let (elements, element) = (rows.elements(), self.precision.element());
        // SAFETY: as in `press`
        unsafe {
            press::launch_unchecked(
                &self.client,
                self.cubes_of(elements),
                CubeDim::new_1d(CUBE as u32),
                buffer(&self.fields[0], D * self.sites),
                buffer(&planes.ends, elements + 1),
                buffer(&planes.below, rows.below.len()),
                buffer(&planes.weights, rows.below.len()),
                buffer(&planes.planes, (D + PLANE) * count),
                buffer(&planes.heights, count * elements),
                buffer(&planes.stiffness, count * elements),
                buffer(&planes.shifts, count),
                buffer(&planes.sizes, count * elements),
                buffer(&planes.pushes, D * elements),
                buffer(&planes.stiff, elements),
                InputScalar::new(rows.near / self.spacing, element),
                self.form,
                count,
                weighs,
                element,
            );
        }
    }

    /// Keeps the sizes of the forces of planes, as number `slot` of those to be read.
    pub fn keep_pushes(&self, slot: usize) {
        let Some(planes) = &self.planes else { return };
        let (rows, elements) = (planes.planes(), planes.rows.elements());
        self.fold([&planes.sizes, &planes.sums], elements, LANES, (slot, MOST_STEPS), (rows, 0, 0));
    }

    /// Sizes of the forces of planes, N, kept in the first `slots`.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn pushes(&self, slots: usize) -> Result<Vec<Vec<f64>>, Error> {
        let Some(planes) = &self.planes else { return Ok(vec![Vec::new(); slots]) };
        let unit = self.unit * self.volume;
        let values = self.values(&planes.sums)?;
        let sizes = |slot: &[f64]| slot.chunks(LANES).map(|list| unit * list.iter().sum::<f64>()).collect();
        Ok(values.chunks(planes.planes() * LANES).take(slots).map(sizes).collect())
    }

    /// Σ f² of the force densities of planes in the last forces of all particles, (N/m³)²; 0 without planes.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn plane_square(&self) -> Result<f64, Error> {
        let Some(planes) = &self.planes else { return Ok(0.0) };
        let length = planes.rows.sites.len();
        self.fold([&planes.squares, &planes.square], length, LANES, (0, 1), (1, 0, 0));
        Ok(self.unit * self.unit * self.values(&planes.square)?.iter().sum::<f64>())
    }

    /// Planes and elements that touched in the last forces, in order, and 0 as none slips.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn plane_touches(&self) -> Result<Vec<[u32; 3]>, Error> {
        let Some(planes) = &self.planes else { return Ok(Vec::new()) };
        let elements = planes.rows.elements();
        let sizes = self.values(&planes.sizes)?;
        let touching = sizes.iter().enumerate().filter(|(_, size)| **size > 0.0);
        Ok(touching.map(|(at, _)| [(at / elements) as u32, (at % elements) as u32, 0]).collect())
    }

    /// Adds the stiffness of planes present or about to touch to the masses of a relaxation, times `factor`.
    pub(super) fn weigh(&self, mass: &Handle, factor: f64) {
        let Some(planes) = &self.planes else { return };
        self.launch_press(planes, true);
        let rows = &planes.rows;
        // SAFETY: as in `press`
        unsafe {
            weigh::launch_unchecked(
                &self.client,
                self.cubes_of(rows.sites.len()),
                CubeDim::new_1d(CUBE as u32),
                buffer(&planes.particles, rows.sites.len()),
                buffer(&planes.particle_ends, rows.particle_ends.len()),
                buffer(&planes.above, rows.above.len()),
                buffer(&planes.shares, rows.above.len()),
                buffer(&planes.stiff, rows.elements()),
                buffer(mass, self.sites),
                InputScalar::new(factor, self.precision.element()),
                self.precision.element(),
            );
        }
    }

    /// Stops the particles of some sites.
    pub fn stop(&self, sites: &[u32]) {
        if sites.is_empty() {
            return;
        }
        let list = self.client.create_from_slice(u32::as_bytes(sites));
        // SAFETY: sites lie inside of the field
        unsafe {
            stop::launch_unchecked(
                &self.client,
                self.cubes_of(sites.len()),
                CubeDim::new_1d(CUBE as u32),
                buffer(&list, sites.len()),
                buffer(&self.fields[1], D * self.sites),
                self.form,
                self.precision.element(),
            );
        }
    }
}
