//! Iterations of dynamic relaxation on a device: launches of its kernels, and the sums that the host reads.

use super::Device;
use super::body::{DeviceBody, LANES, numbers};
use super::kernels::CUBE;
use super::relaxation_kernels::{RELAXATION_SUMS, WAY, relax, relaxation_sums, stiffen};
use super::steps::buffer;
use crate::bonds::LatticeBonds;
use crate::error::Error;
use crate::potential::{KernelFit, TangentTable};
use cubecl::ir::{ElemType, UIntKind};
use cubecl::prelude::*;
use cubecl::server::Handle;

/// Sums of an iteration over particles, in SI.
#[derive(Clone, Copy, Debug, Default)]
pub struct RelaxationSums {
    /// Σ v·ΔF where free.
    pub quotient_top: f64,
    /// Σ M v² where free, M the sum of stiffness of a particle, m², without the factor on it.
    pub quotient_bottom: f64,
    /// Σ F² where free.
    pub free: f64,
    /// Σ F² where held, without body forces.
    pub constrained: f64,
    /// √(Σ |s u|²) with the springs s, N/m³; 0 where it was not measured.
    pub moved: f64,
    /// Greatest component of the last move, m.
    pub way: f64,
}

/// A lattice in relaxation on a device: velocities are in metres an iteration.
pub struct DeviceRelaxation<const D: usize> {
    /// Bonds, law, loads and fields.
    pub body: DeviceBody<D>,
    /// Forces of the iteration before.
    before: Handle,
    mass: Handle,
    /// Masses with the stiffness of contact.
    weighed: Option<Handle>,
    springs: Handle,
    partial: Handle,
    sums: Handle,
    /// Unit of masses on the device, m², and of springs, N/m⁴.
    mass_unit: f64,
    spring_unit: f64,
}

impl<const D: usize> DeviceRelaxation<D> {
    /// Puts a body on a device, as [`DeviceBody::new`] does, with the springs s of its sites, N/m⁴, that
    /// rounding of displacements pulls at.
    ///
    /// # Errors
    /// Those of [`DeviceBody::new`]; [`Error::Device`] for springs of another body.
    pub fn new(
        device: &Device,
        bonds: &LatticeBonds<D>,
        (law, modulus): (&KernelFit, f64),
        springs: &[f64],
    ) -> Result<Self, Error> {
        let body = DeviceBody::new(device, bonds, law, modulus)?;
        body.refuse_other_sites("springs", springs)?;
        let bytes = body.precision.bytes() as usize;
        let empty = |length: usize| body.client.empty(length * bytes);
        let unit = springs.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        Ok(Self {
            // sites without a particle have no force
            before: numbers(&body.client, body.precision, (0..D * body.sites).map(|_| 0.0)),
            mass: empty(body.sites),
            weighed: None,
            springs: numbers(&body.client, body.precision, springs.iter().map(|s| s / unit)),
            partial: numbers(
                &body.client,
                body.precision,
                (0..RELAXATION_SUMS * body.threads()).map(|_| 0.0),
            ),
            sums: empty(RELAXATION_SUMS * LANES),
            mass_unit: body.unit / (body.spacing * modulus),
            spring_unit: unit,
            body,
        })
    }

    /// Takes the sum of stiffness of each site for a unit tangent of bonds, m².
    ///
    /// # Errors
    /// [`Error::Device`] for masses of another body.
    pub fn set_masses(&mut self, masses: &[f64]) -> Result<(), Error> {
        let body = &self.body;
        body.refuse_other_sites("masses", masses)?;
        self.mass = numbers(&body.client, body.precision, masses.iter().map(|mass| mass / self.mass_unit));
        Ok(())
    }

    /// Adds the stiffness of contact at the present displacement to the masses, whose unit is a bond's
    /// `tangent`, N/m⁶; `None` without contact.
    pub fn weigh(&mut self, tangent: Option<f64>) {
        let Some(tangent) = tangent else {
            self.weighed = None;
            return;
        };
        let body = &self.body;
        let bytes = body.sites * body.precision.bytes() as usize;
        let weighed = self.weighed.get_or_insert_with(|| body.client.empty(bytes));
        body.copy(&self.mass, weighed, body.sites);
        let factor = body.unit / (body.spacing * self.mass_unit * tangent);
        body.weigh_pairs(weighed, factor);
        body.weigh(weighed, 0.5 * factor);
    }

    fn masses(&self) -> &Handle {
        self.weighed.as_ref().unwrap_or(&self.mass)
    }

    /// Takes the sums of stiffness of the present displacement, with each bond's own tangent from a table,
    /// but at least `least`.
    pub fn stiffen(&self, table: &TangentTable, least: f64) {
        let body = &self.body;
        let (low, step, pieces) = table.pieces();
        let number = |x: f64| InputScalar::new(x, body.precision.element());
        let values = numbers(&body.client, body.precision, pieces.iter().copied());
        let bonds = body.form.bonds;
        // SAFETY: every buffer has the length named here; shifts of intact bonds lead to sites
        unsafe {
            stiffen::launch_unchecked(
                &body.client,
                body.cubes_of(body.particles),
                CubeDim::new_1d(CUBE as u32),
                buffer(&body.fields[0], D * body.sites),
                body.factors(),
                buffer(&body.sites_of_particles, body.particles),
                buffer(&body.shifts, bonds),
                buffer(&body.rows, bonds * (D + super::kernels::ROW)),
                buffer(&body.intact, bonds.div_ceil(32) * body.sites),
                buffer(&values, pieces.len()),
                buffer(&self.mass, body.sites),
                number(low),
                number(1.0 / step),
                number(least),
                number(1.0 / self.mass_unit),
                body.form,
                body.precision.element(),
            );
        }
    }

    /// Keeps the forces until now as those before.
    pub fn keep_forces(&mut self) {
        std::mem::swap(&mut self.body.fields[2], &mut self.before);
    }

    /// Sums of the present forces; also of what has `moved` where it `measures`.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn sums(&self, measures: bool) -> Result<RelaxationSums, Error> {
        let (body, threads) = (&self.body, self.body.threads());
        let [displacement, velocity, force] = &body.fields;
        // SAFETY: every buffer has the length named here, and the sites of particles lie inside
        unsafe {
            relaxation_sums::launch_unchecked(
                &body.client,
                body.cubes_of(threads),
                CubeDim::new_1d(CUBE as u32),
                buffer(force, D * body.sites),
                buffer(&self.before, D * body.sites),
                buffer(velocity, D * body.sites),
                buffer(displacement, D * body.sites),
                buffer(&body.sites_of_particles, body.particles),
                buffer(&body.held, body.held_words()),
                buffer(self.masses(), body.sites),
                buffer(&self.springs, body.sites),
                body.loads(),
                buffer(&self.partial, RELAXATION_SUMS * threads),
                InputScalar::new(body.loading, body.precision.element()),
                body.form,
                measures,
                body.precision.element(),
            );
        }
        body.fold([&self.partial, &self.sums], threads, LANES, (0, 1), (RELAXATION_SUMS, 1 << WAY, 0));
        let values = body.values(&self.sums)?;
        let lists: Vec<&[f64]> = values.chunks(LANES).collect();
        let sum = |row: usize| lists[row].iter().sum::<f64>();
        let (length, force) = (body.spacing, body.unit);
        Ok(RelaxationSums {
            quotient_top: length * force * sum(0),
            quotient_bottom: length * length * self.mass_unit * sum(1),
            free: force * force * sum(2),
            constrained: force * force * sum(3),
            moved: self.spring_unit * length * sum(4).sqrt(),
            way: length * lists[WAY].iter().copied().fold(0.0, f64::max),
        })
    }

    /// Moves free components: v ← `keep`·v + `push`·F/M, u ← u + v, with `push` over the factor on M.
    pub fn relax(&self, keep: f64, push: f64) {
        let (body, threads) = (&self.body, self.body.threads());
        let number = |x: f64| InputScalar::new(x, body.precision.element());
        let [displacement, velocity, force] = &body.fields;
        // SAFETY: as in `sums`
        unsafe {
            relax::launch_unchecked(
                &body.client,
                body.cubes_of(threads),
                CubeDim::new_1d(CUBE as u32),
                buffer(force, D * body.sites),
                buffer(&body.sites_of_particles, body.particles),
                buffer(&body.held, body.held_words()),
                buffer(self.masses(), body.sites),
                buffer(velocity, D * body.sites),
                buffer(displacement, D * body.sites),
                buffer(&self.partial, RELAXATION_SUMS * threads),
                InputScalar::new(threads as u32, ElemType::UInt(UIntKind::U32)),
                number(keep),
                number(push * body.unit / (body.spacing * self.mass_unit)),
                body.form,
                body.precision.element(),
            );
        }
    }
}
