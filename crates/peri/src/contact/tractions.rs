//! Tractions on a body: forces of contact over the areas on which they act.
//!
//! A face of the undeformed area A and normal N has the present area A|cof F N| (Nanson), F the deformation
//! gradient of the particle nearest to it; a plane body keeps its thickness. A particle that has lost bonds
//! has its undeformed area.

use super::Contact;
use super::friction_pair::{ContactPair, across};
use super::surface::SurfaceReaction;
use super::surfaces::{MovingSurface, RigidSurfaces, SurfaceContact};
use crate::bonds::BodyGeometry;
use crate::field::Field;
use crate::geometry::{determinant, length};
use crate::stress::deformation_gradient;
use nalgebra::{SMatrix, SVector};

/// Distance from a face, in spacings, up to which particles lie on the surface below it.
const BELOW: f64 = 1.0;

/// Traction of a rigid surface on a face of a body or on a particle without one, or of particles on another.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceTraction<const D: usize> {
    /// Number of the surface; of particles the number of surfaces.
    pub surface: usize,
    /// Sites of the particles on the surface of the body below the face.
    pub sites: Vec<u32>,
    /// Present position, m.
    pub place: [f64; D],
    /// Normal of the surface there, towards the body.
    pub normal: [f64; D],
    /// Present area, m².
    pub area: f64,
    /// Pressure, Pa; below 0 where a bonded plane pulls.
    pub pressure: f64,
    /// Traction across the normal on the body, Pa: friction, or that of a bonded plane.
    pub shear: [f64; D],
}

impl<const D: usize> Contact<D> {
    /// Finds the contacts of a displacement and places surfaces where they were in a row of the history,
    /// beside the bonds that are intact.
    pub fn prepare_tractions(
        &mut self,
        bonds: &dyn BodyGeometry<D>,
        displacement: &Field<D>,
        resting: &[SurfaceReaction],
    ) {
        self.rebuild(bonds, displacement);
        let placed = self.surfaces.iter_mut().flat_map(|surfaces| &mut surfaces.each);
        placed.zip(resting).for_each(|(placed, at)| placed.now = std::array::from_fn(|d| at.moved[d]));
    }

    /// Returns the tractions of all surfaces, then those of particles on each other, at a displacement, with
    /// forces of friction, N, by pair.
    pub fn tractions(
        &self,
        bonds: &dyn BodyGeometry<D>,
        displacement: &Field<D>,
        drags: &[(ContactPair, [f64; 3])],
    ) -> Vec<SurfaceTraction<D>> {
        let surfaces = self.surfaces.as_ref();
        let mut found =
            surfaces.map_or_else(Vec::new, |surfaces| surfaces.tractions(bonds, displacement, drags));
        found.append(&mut self.pair_tractions(bonds, displacement, drags));
        found
    }
}

impl<const D: usize> RigidSurfaces<D> {
    /// Returns the tractions of all surfaces at a displacement, with forces of friction, N, by pair.
    fn tractions(
        &self,
        bonds: &dyn BodyGeometry<D>,
        displacement: &Field<D>,
        drags: &[(ContactPair, [f64; 3])],
    ) -> Vec<SurfaceTraction<D>> {
        let mut rubs: Vec<(usize, usize, [f64; 3])> = drags
            .iter()
            .filter_map(|&(pair, force)| {
                let (surface, element) = self.element(pair)?;
                Some((surface, element, force))
            })
            .collect();
        rubs.sort_unstable_by_key(|rub| (rub.0, rub.1));
        let of = |(surface, placed): (usize, &MovingSurface<D>)| {
            let each = self.touches(placed, displacement).into_iter();
            let traction = |touch: SurfaceContact<D>| {
                let at = rubs.binary_search_by_key(&(surface, touch.element), |rub| (rub.0, rub.1));
                let rub = at.map_or([0.0; 3], |at| rubs[at].2);
                let area = self.present_area(bonds, displacement, &touch);
                let force = touch.force();
                let aside = across(&touch.normal, force);
                SurfaceTraction {
                    surface,
                    sites: self.sites_below(bonds, touch.element),
                    place: touch.place,
                    normal: touch.normal,
                    area,
                    pressure: push(&touch) / area,
                    shear: std::array::from_fn(|d| (aside[d] + rub[d]) / area),
                }
            };
            each.map(traction).collect::<Vec<_>>()
        };
        self.each.iter().enumerate().flat_map(of).collect()
    }

    /// Greatest pressure of each surface, Pa; 0 where nothing is pressed.
    pub fn greatest_pressures(&self, bonds: &dyn BodyGeometry<D>, displacement: &Field<D>) -> Vec<f64> {
        let of = |placed: &MovingSurface<D>| {
            let touches = self.touches(placed, displacement).into_iter().filter(|touch| push(touch) > 0.0);
            touches
                .map(|touch| push(&touch) / self.present_area(bonds, displacement, &touch))
                .fold(0.0, f64::max)
        };
        self.each.iter().map(of).collect()
    }

    /// Present area of an element, m².
    fn present_area(
        &self,
        bonds: &dyn BodyGeometry<D>,
        displacement: &Field<D>,
        touch: &SurfaceContact<D>,
    ) -> f64 {
        let Some(&normal) = self.faces.normals.get(touch.element) else { return touch.area };
        let Some(site) = self.nearest(bonds, touch.element) else { return touch.area };
        let gradient = deformation_gradient(bonds, displacement, site);
        let matrix = SMatrix::<f64, D, D>::from_fn(|a, b| gradient[a][b]);
        // cof F = J F⁻ᵀ
        let ratio = matrix.try_inverse().map(|inverse| {
            let turned: SVector<f64, D> = inverse.transpose() * SVector::from(normal);
            determinant(&gradient).abs() * length(turned.into())
        });
        touch.area * ratio.filter(|ratio| ratio.is_normal()).unwrap_or(1.0)
    }

    /// Distance of a site from a face at rest, in spacings.
    fn distance(&self, bonds: &dyn BodyGeometry<D>, face: usize, site: usize) -> f64 {
        let (here, place) = (bonds.position(site), self.faces.places[face]);
        length::<D>(std::array::from_fn(|d| here[d] - place[d])) / self.spacing
    }

    /// Site of the particle nearest to a face at rest.
    fn nearest(&self, bonds: &dyn BodyGeometry<D>, face: usize) -> Option<usize> {
        let each = self.faces.below(face).map(|(site, _)| (self.distance(bonds, face, site), site));
        each.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, site)| site)
    }

    /// Sites of the particles on the surface of the body below an element.
    fn sites_below(&self, bonds: &dyn BodyGeometry<D>, element: usize) -> Vec<u32> {
        if let Some(bare) = element.checked_sub(self.faces.len()) {
            return vec![self.bare[bare]];
        }
        let below = self.faces.below(element).map(|(site, _)| site);
        let near = below.filter(|&site| self.distance(bonds, element, site) < BELOW);
        near.map(|site| site as u32).collect()
    }
}

/// Force of a rigid surface on the body along its normal, N.
fn push<const D: usize>(touch: &SurfaceContact<D>) -> f64 {
    touch.force().iter().zip(touch.normal).map(|(force, n)| force * n).sum()
}
