//! Stress of a lattice on a device: each measure is, bond by bond of half the stencil, a convolution of that
//! bond's forces with fixed weights, as on the host (see [`crate::stress`]).

use super::Device;
use super::body::{DeviceBody, numbers};
use super::kernels::{CUBE, ROW};
use super::steps::buffer;
use super::stress_kernels::{COMPLETED, OCCUPIED, distribute, offset_forces};
use crate::bonds::{BodyGeometry, LatticeBonds};
use crate::error::Error;
use crate::field::Field;
use crate::stress::{BallVolume, MeasuredStress, StressInput, StressMethod, StressPlan};
use cubecl::ir::{ElemType, UIntKind};
use cubecl::prelude::*;
use cubecl::server::Handle;
use std::time::Instant;

/// Weights of a measure on a device.
struct DeviceTaps {
    flags: Handle,
    shifts: Handle,
    weights: Handle,
    /// First tap of each bond, and the number of all taps.
    starts: Vec<usize>,
}

/// Computes the first Piola–Kirchhoff stress of every particle by several measures, Pa, in the order of
/// [`BodyGeometry::particles`], as [`crate::stress::piolas`] does.
///
/// # Errors
/// [`Error::Device`] for several laws, measures without bond forces, periodic sides, a body or sums that the
/// device's memory does not hold, and where the device fails.
pub fn piolas<const D: usize>(
    device: &Device,
    bonds: &LatticeBonds<D>,
    state: &StressInput<D>,
    measures: &[StressMethod],
    ball: BallVolume,
) -> Result<Vec<MeasuredStress<D>>, Error> {
    let law = state.fit.single().ok_or_else(|| Error::Device("expected one law".to_owned()))?;
    if !bonds.images().is_empty() || measures.contains(&StressMethod::Constitutive) {
        return Err(Error::Device("expected bond forces without periodic sides".to_owned()));
    }
    let sums = (D * D * bonds.particles().len()) as u64 * device.precision.bytes();
    device.refuse_buffers(&[("stress", sums)])?;
    let mut body = DeviceBody::new(device, bonds, law, state.modulus)?;
    let zero = Field::zeros(bonds.sites());
    body.set_state(bonds, [state.displacement, &zero, &zero], 0.0)?;
    let one = |&measure: &StressMethod| {
        let started = Instant::now();
        let plan = StressPlan::new(bonds, state, measure);
        let sums = body.stress_sums(&DeviceTaps::new(&body, bonds, &plan), plan.taps.len())?;
        let (all, unit) = (bonds.particles().len(), body.unit * body.volume * body.spacing);
        let volumes = plan.volumes(bonds, state, ball);
        let of = |(particle, volume): (usize, &f64)| {
            std::array::from_fn(|a| {
                std::array::from_fn(|b| unit * sums[(a * D + b) * all + particle] / volume)
            })
        };
        let piola = volumes.iter().enumerate().map(of).collect();
        Ok(MeasuredStress { piola, seconds: started.elapsed().as_secs_f64() })
    };
    measures.iter().map(one).collect()
}

impl DeviceTaps {
    fn new<const D: usize>(body: &DeviceBody<D>, bonds: &LatticeBonds<D>, plan: &StressPlan<D>) -> Self {
        let flag = |occupied: bool| if occupied { OCCUPIED } else { 0 };
        let mut flags: Vec<u32> = bonds.occupancy().into_iter().map(flag).collect();
        plan.rim.iter().for_each(|&site| flags[site as usize] |= COMPLETED);
        let mut starts = vec![0];
        for taps in &plan.taps {
            starts.push(starts.last().unwrap_or(&0) + taps.len());
        }
        let shifts: Vec<i32> = plan.taps.iter().flatten().map(|tap| tap.shift as i32).collect();
        Self {
            flags: body.client.create_from_slice(u32::as_bytes(&flags)),
            shifts: body.client.create_from_slice(i32::as_bytes(&shifts)),
            weights: numbers(&body.client, body.precision, plan.taps.iter().flatten().map(|tap| tap.weight)),
            starts,
        }
    }
}

impl<const D: usize> DeviceBody<D> {
    /// Sums Σ w f ⊗ ξ over the first bonds of the stencil, component by component over the particles.
    fn stress_sums(&self, taps: &DeviceTaps, bonds: usize) -> Result<Vec<f64>, Error> {
        let all = D * D * self.particles;
        let sums = numbers(&self.client, self.precision, (0..all).map(|_| 0.0));
        let [displacement, _, forces] = &self.fields;
        let element = self.precision.element();
        let index = |x: usize| InputScalar::new(x as u32, ElemType::UInt(UIntKind::U32));
        let cubes = || self.cubes_of(self.particles);
        let dim = || CubeDim::new_1d(CUBE as u32);
        let count = taps.starts.last().copied().unwrap_or(0);
        let shifts = || buffer(&self.shifts, self.form.bonds);
        let rows = || buffer(&self.rows, self.form.bonds * (D + ROW));
        let particles = || buffer(&self.sites_of_particles, self.particles);
        for bond in 0..bonds {
            let [first, last] = [taps.starts[bond], taps.starts[bond + 1]];
            // SAFETY: every buffer has the length named here, sites of particles lie inside, and so do the
            // ends of their bonds
            unsafe {
                offset_forces::launch_unchecked(
                    &self.client,
                    cubes(),
                    dim(),
                    buffer(displacement, D * self.sites),
                    self.factors(),
                    particles(),
                    shifts(),
                    rows(),
                    buffer(&self.law, self.law_numbers),
                    buffer(&self.intact, self.form.bonds.div_ceil(32) * self.sites),
                    buffer(forces, D * self.sites),
                    index(bond),
                    self.form,
                    element,
                );
                distribute::launch_unchecked(
                    &self.client,
                    cubes(),
                    dim(),
                    buffer(forces, D * self.sites),
                    buffer(&taps.flags, self.sites),
                    particles(),
                    shifts(),
                    rows(),
                    buffer(&taps.shifts, count),
                    buffer(&taps.weights, count),
                    buffer(&sums, all),
                    index(bond),
                    index(first),
                    index(last - first),
                    self.form,
                    element,
                );
            }
        }
        self.values(&sums)
    }
}
