//! Pressure that follows the surface: −p cof(F) N per reference area (Nanson's formula), in faces of the
//! body.

use super::curves::Amplitude;
use super::force_fields::ForceField;
use crate::bonds::{BodyGeometry, Bonds};
use crate::contact::Faces;
use crate::field::Field;
use crate::material::{BodyTensor, cofactor};
use crate::surface::{BodySurface, SurfaceFace};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::fmt;

/// Least eigenvalue over the largest of a family's shape tensor with which it has a gradient.
const FLAT: f64 = 1e-6;
/// Faces of a work item.
const BATCH: usize = 256;

/// Pressure on some faces of a body in plane strain or in space.
pub struct FollowingPressure<const D: usize> {
    faces: Faces<D>,
    /// Gradient of each face: F = 1 + Σ u ⊗ G over sites; none in faces without pressure.
    gradients: Vec<Vec<(u32, [f64; D])>>,
    /// Volume of the particle of each site, m³.
    volumes: Vec<f64>,
    /// Pressure at a multiple of 1, Pa.
    pressure: f64,
    amplitude: Amplitude,
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
        let chosen = |face: usize| inside(&surface.faces()[faces.sources[face] as usize]);
        let of = |face| if chosen(face) { gradient(bonds, faces.below(face)) } else { Vec::new() };
        let gradients: Vec<Vec<(u32, [f64; D])>> = (0..faces.len()).map(of).collect();
        if gradients.iter().all(Vec::is_empty) {
            return None;
        }
        let mut volumes = vec![0.0; bonds.sites()];
        bonds.particles().iter().for_each(|&site| volumes[site as usize] = bonds.volume(site as usize));
        Some(Self { faces, gradients, volumes, pressure, amplitude })
    }

    /// Number of faces under pressure.
    pub fn len(&self) -> usize {
        self.gradients.iter().filter(|gradient| !gradient.is_empty()).count()
    }

    /// Returns false: without faces there is no pressure.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Mean of the families' deformation gradients, with the weights of particles, as a sum over displacements:
/// (Σ w ζ ⊗ ξ)(Σ w ξ ⊗ ξ)⁻¹ as [`crate::stress::deformation_gradients`].
fn gradient<const D: usize>(
    bonds: &dyn Bonds<D>,
    below: impl Iterator<Item = (usize, f64)>,
) -> Vec<(u32, [f64; D])> {
    let mut sum: BTreeMap<u32, [f64; D]> = BTreeMap::new();
    for (site, share) in below {
        let (mut shape, mut family) = (nalgebra::DMatrix::<f64>::zeros(D, D), Vec::new());
        bonds.neighbours(site, &mut |bond| {
            let ray = bond.bond.map(|x| x / bond.length);
            (0..D).for_each(|a| (0..D).for_each(|b| shape[(a, b)] += bond.volume * ray[a] * ray[b]));
            family.push((bond.site as u32, bond.volume / bond.length, ray));
        });
        let size = shape.trace();
        let Ok(inverse) = shape.pseudo_inverse(FLAT * size) else { continue };
        for (other, weight, ray) in family {
            let part: [f64; D] = std::array::from_fn(|a| {
                share * weight * (0..D).map(|b| inverse[(a, b)] * ray[b]).sum::<f64>()
            });
            let mut add = |site: u32, sign: f64| {
                let own = sum.entry(site).or_insert([0.0; D]);
                (0..D).for_each(|a| own[a] += sign * part[a]);
            };
            add(other, 1.0);
            add(site as u32, -1.0);
        }
    }
    sum.into_iter().collect()
}

impl<const D: usize> fmt::Debug for FollowingPressure<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "FollowingPressure({} Pa on {} faces)", self.pressure, self.len())
    }
}

impl<const D: usize> ForceField<D> for FollowingPressure<D> {
    fn add(
        &self,
        _: &dyn BodyGeometry<D>,
        displacement: &Field<D>,
        part: f64,
        share: f64,
        force: &mut Field<D>,
    ) {
        let pressure = share * self.pressure * self.amplitude.multiple(part);
        let push = |(face, gradient): (usize, &Vec<(u32, [f64; D])>)| {
            if gradient.is_empty() {
                return [0.0; D];
            }
            let mut whole = BodyTensor::<D>::identity();
            for (site, part) in gradient {
                let u = displacement.get(*site as usize);
                (0..D).for_each(|a| (0..D).for_each(|b| whole[(a, b)] += u[a] * part[b]));
            }
            let (area, normal) = (cofactor(&whole), self.faces.normals[face]);
            std::array::from_fn(|a| {
                let along: f64 = (0..D).map(|b| area[(a, b)] * normal[b]).sum();
                -pressure * self.faces.areas[face] * along
            })
        };
        let each = self.gradients.par_iter().enumerate().with_min_len(BATCH);
        let pushes: Vec<[f64; D]> = each.map(push).collect();
        self.faces.spread(&pushes, &self.volumes, 0, &mut force.components_mut());
    }

    fn follows(&self) -> bool {
        true
    }
}
