//! Loads of some sites that change from step to step, on a device.

use super::body::{DeviceBody, DeviceLoads, numbers};
use super::kernels::CUBE;
use super::list_kernels::put;
use super::steps::buffer;
use crate::field::Field;
use cubecl::prelude::*;
use cubecl::server::Handle;

/// Sites whose prescribed displacement or body force changes, on a device.
pub struct DrivenSites {
    sites: Vec<u32>,
    places: Handle,
}

impl<const D: usize> DeviceBody<D> {
    /// Puts a list of sites on the device.
    pub fn list_driven(&self, sites: Vec<u32>) -> DrivenSites {
        let places =
            self.client.create_from_slice(u32::as_bytes(if sites.is_empty() { &[0] } else { &sites }));
        DrivenSites { sites, places }
    }

    /// Takes the prescribed displacement of sites anew.
    pub fn drive_held(&self, driven: &DrivenSites, loads: &DeviceLoads<D>) {
        if let Some(field) = loads.displacement.filter(|_| self.form.held) {
            self.put(driven, field, 1.0 / self.spacing, &self.full);
        }
    }

    /// Takes the body force of sites anew.
    pub fn drive_pushed(&self, driven: &DrivenSites, loads: &DeviceLoads<D>) {
        if let Some(field) = loads.body_force.filter(|_| self.form.loaded) {
            self.put(driven, field, 1.0 / self.unit, &self.body);
        }
    }

    fn put(&self, driven: &DrivenSites, field: &Field<D>, scale: f64, into: &Handle) {
        let count = driven.sites.len();
        if count == 0 {
            return;
        }
        let components = field.components().into_iter();
        let values = components.flat_map(|x| driven.sites.iter().map(move |&site| scale * x[site as usize]));
        let values = numbers(&self.client, self.precision, values);
        // SAFETY: sites lie inside of the field
        unsafe {
            put::launch_unchecked(
                &self.client,
                self.cubes_of(count),
                CubeDim::new_1d(CUBE as u32),
                buffer(&driven.places, count),
                buffer(&values, D * count),
                buffer(into, D * self.sites),
                D,
                self.precision.element(),
            );
        }
    }
}
