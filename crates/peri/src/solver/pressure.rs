//! Pressure that follows the surface: −p cof(F) N per reference area (Nanson's formula), in faces of the
//! body; in plane stress −p λ₃ cof(F) N with the stretch λ₃ of the thickness.

use super::force_fields::ForceField;
use crate::amplitude::Amplitude;
use crate::bonds::{BodyGeometry, Bonds};
use crate::contact::Faces;
use crate::field::Field;
use crate::material::{BodyTensor, cofactor};
use crate::stress::deformation_gradient;
use crate::surface::{BodySurface, SurfaceFace};
use rayon::prelude::*;
use std::fmt;

/// Faces of a work item.
const BATCH: usize = 256;

/// Stretch λ₃ of the thickness in plane stress of the particle of a site, from its displacement gradient.
pub type ThicknessStretch<const D: usize> = Box<dyn Fn(usize, BodyTensor<D>) -> f64 + Send + Sync>;

/// Pressure on some faces of a body.
pub struct FollowingPressure<const D: usize> {
    faces: Faces<D>,
    /// Particles below the pressed faces, ascending.
    sites: Vec<u32>,
    /// Numbers in `sites`, and weights, of the particles below each face; none in faces without pressure.
    below: Vec<Vec<(u32, f64)>>,
    /// Volume of the particle of each site, m³.
    volumes: Vec<f64>,
    /// Pressure at a multiple of 1, Pa.
    pressure: f64,
    amplitude: Amplitude,
    /// In plane stress.
    thickness: Option<ThicknessStretch<D>>,
}

impl<const D: usize> FollowingPressure<D> {
    /// Presses on the faces that are `inside`, Pa; `None` if there are none.
    pub fn new(
        bonds: &dyn Bonds<D>,
        surface: &BodySurface<D>,
        inside: impl Fn(&SurfaceFace<D>) -> bool,
        pressure: f64,
        amplitude: Amplitude,
    ) -> Option<Self> {
        let faces = Faces::new(bonds, surface, false);
        let pressed = |face: usize| inside(&surface.faces()[faces.sources[face] as usize]);
        let of = |face| if pressed(face) { faces.below(face).collect() } else { Vec::new() };
        let each: Vec<Vec<(usize, f64)>> = (0..faces.len()).map(of).collect();
        let mut sites: Vec<u32> = each.iter().flatten().map(|&(site, _)| site as u32).collect();
        sites.sort_unstable();
        sites.dedup();
        if sites.is_empty() {
            return None;
        }
        let number = |&(site, weight): &(usize, f64)| {
            (sites.partition_point(|&other| (other as usize) < site) as u32, weight)
        };
        let below = each.iter().map(|own| own.iter().map(number).collect()).collect();
        let mut volumes = vec![0.0; bonds.sites()];
        bonds.particles().iter().for_each(|&site| volumes[site as usize] = bonds.volume(site as usize));
        Some(Self { faces, sites, below, volumes, pressure, amplitude, thickness: None })
    }

    /// Lets the area change with the thickness, in plane stress.
    pub fn with_thickness(self, thickness: Option<ThicknessStretch<D>>) -> Self {
        Self { thickness, ..self }
    }
}

impl<const D: usize> fmt::Debug for FollowingPressure<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "FollowingPressure({} Pa above {} particles)", self.pressure, self.sites.len())
    }
}

impl<const D: usize> ForceField<D> for FollowingPressure<D> {
    /// F and λ₃ of a face are the means over the particles below it, each over its intact bonds: a gap of a
    /// crack is no pressed area.
    fn add(
        &self,
        bonds: &dyn BodyGeometry<D>,
        displacement: &Field<D>,
        part: f64,
        share: f64,
        force: &mut Field<D>,
    ) {
        let pressure = share * self.pressure * self.amplitude.multiple(part);
        let change = |&site: &u32| {
            let gradient = deformation_gradient(bonds, displacement, site as usize);
            let own = BodyTensor::from_fn(|a, b| gradient[a][b] - f64::from(u8::from(a == b)));
            (own, self.thickness.as_ref().map_or(1.0, |stretch| stretch(site as usize, own)))
        };
        let changes: Vec<(BodyTensor<D>, f64)> =
            self.sites.par_iter().with_min_len(BATCH).map(change).collect();
        let push = |(face, below): (usize, &Vec<(u32, f64)>)| {
            if below.is_empty() {
                return [0.0; D];
            }
            let (mut mean, mut thickness) = (BodyTensor::<D>::identity(), 1.0);
            for (number, weight) in below {
                let (own, stretch) = changes[*number as usize];
                mean += own * *weight;
                thickness += weight * (stretch - 1.0);
            }
            let (area, normal) = (cofactor(&mean), self.faces.normals[face]);
            std::array::from_fn(|a| {
                let along: f64 = (0..D).map(|b| area[(a, b)] * normal[b]).sum();
                -pressure * thickness * self.faces.areas[face] * along
            })
        };
        let each = self.below.par_iter().enumerate().with_min_len(BATCH);
        let pushes: Vec<[f64; D]> = each.map(push).collect();
        self.faces.spread(&pushes, &self.volumes, 0, &mut force.components_mut());
    }

    fn follows(&self) -> bool {
        true
    }
}
