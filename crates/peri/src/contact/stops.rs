//! Directions in which rigid surfaces may hold a body.

use super::Contact;
use super::surface::{RigidSurface, SurfaceShape};
use crate::bonds::BodyGeometry;
use crate::field::Field;
use crate::parallel;

/// Overlap, over the radius of a particle, by which a translation must run into a surface to be stopped: flat
/// faces that pass below a sphere of two spacings come nearer by a quarter of it, as particles lie beside the
/// axis.
const STOPPED: f64 = 0.5;

impl<const D: usize> Contact<D> {
    /// Directions in which rigid surfaces, where they stand, may push a body; one with a force of its own
    /// stops nothing.
    pub fn stops(&self, bonds: &dyn BodyGeometry<D>, displacement: &Field<D>) -> Vec<[f64; D]> {
        let Some(surfaces) = &self.surfaces else { return Vec::new() };
        let centre = |&site: &u32| -> [f64; D] {
            let (rest, moved) = (bonds.position(site as usize), displacement.get(site as usize));
            std::array::from_fn(|d| rest[d] + moved[d])
        };
        let centres: Vec<[f64; D]> = bonds.particles().iter().map(centre).collect();
        let standing = surfaces.each.iter().filter(|placed| placed.surface.force.is_none());
        let radius = 0.5 * bonds.spacing();
        standing.flat_map(|placed| placed.surface.stops(&placed.now, &centres, radius)).collect()
    }
}

impl<const D: usize> RigidSurface<D> {
    /// Directions in which the surface, moved by `shift`, m, may push a body of particles of these centres
    /// and this radius, m. A plane pushes along its normal. Another surface pushes against each axis along
    /// which some translation of the body runs into it: without friction it holds along normals of its
    /// contact only.
    pub fn stops(&self, shift: &[f64; D], centres: &[[f64; D]], radius: f64) -> Vec<[f64; D]> {
        if let SurfaceShape::Plane(normal) = self.shape {
            return vec![normal];
        }
        let most = |height: &(dyn Fn([f64; D]) -> f64 + Sync)| {
            let beside = |centre: &[f64; D]| std::array::from_fn(|d| centre[d] - shift[d]);
            let overlaps = parallel::map_each(centres, |centre| radius - height(beside(centre)));
            overlaps.into_iter().fold(f64::NEG_INFINITY, f64::max)
        };
        let present = most(&|centre| self.height(centre)).max(0.0);
        let signed = |d: usize, sign: f64| std::array::from_fn(|e| if e == d { sign } else { 0.0 });
        let ways = (0..D).flat_map(|d| [1.0, -1.0].map(|sign| signed(d, sign)));
        ways.filter(|way| {
            most(&|centre| self.least_height(centre, 0.25 * radius, way)) > present + STOPPED * radius
        })
        .map(|way| way.map(|x| -x))
        .collect()
    }

    /// Least height above the surface at rest on the way from a place along the unit vector `way`, m, to
    /// about `fine`, m.
    fn least_height(&self, place: [f64; D], fine: f64, way: &[f64; D]) -> f64 {
        let dot = |a: &[f64; D], b: &[f64; D]| (0..D).map(|d| a[d] * b[d]).sum::<f64>();
        let across = match &self.shape {
            SurfaceShape::Facets(facets) => return self.least_height_on_way(facets, place, fine, way),
            SurfaceShape::Cylinder(axis, _) => super::friction_pair::across(axis, *way),
            _ => *way,
        };
        let (square, ahead) = (dot(&across, &across), -dot(&self.offset_of(place), &across));
        let nearest = if square > 0.0 { (ahead / square).max(0.0) } else { 0.0 };
        self.height(std::array::from_fn(|d| place[d] + nearest * way[d]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_surfaces_hold_along_normals_only() {
        let axis = |n: u32| (0..n).map(|k| f64::from(k) + 0.5);
        let centres: Vec<[f64; 3]> =
            axis(10).flat_map(|x| axis(10).flat_map(move |y| axis(4).map(move |z| [x, y, z]))).collect();
        // on the middle of the upper side, a gap above it, beside the edge of a side, above an edge
        let stops = |surface: RigidSurface<3>| surface.stops(&[0.0; 3], &centres, 0.5);
        let down = vec![[0.0, 0.0, -1.0]];
        for height in [14.0, 13.9, 16.0] {
            assert_eq!(stops(RigidSurface::sphere([5.0, 5.0, height], 10.0)), down);
            let cylinder = RigidSurface::cylinder([5.0, 5.0, height], [0.0, 1.0, 0.0], 10.0);
            assert_eq!(stops(cylinder), down);
        }
        assert_eq!(stops(RigidSurface::sphere([5.1, 4.8, 6.0], 2.0)), down, "the smallest sphere");
        assert_eq!(stops(RigidSurface::sphere([-10.0, 5.0, 2.0], 10.0)), [[1.0, 0.0, 0.0]]);
        // its lowest point is 1.2 m below the upper side, beside the edge at 7.05 m from its centre
        let corner = stops(RigidSurface::sphere([14.0, 5.0, 9.8], 7.0));
        let passes = stops(RigidSurface::sphere([14.0, 5.0, 11.0], 7.0));
        assert_eq!(passes, down, "the body passes below it");
        assert_eq!(corner, [[-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]);
        // in a hole of the body it holds across its axis
        let around: Vec<[f64; 3]> =
            centres.iter().filter(|at| (at[0] - 5.0).hypot(at[1] - 5.0) > 3.0).copied().collect();
        let pin = RigidSurface::cylinder([5.0, 5.0, 0.0], [0.0, 0.0, 1.0], 2.5);
        assert_eq!(pin.stops(&[0.0; 3], &around, 0.5).len(), 4);
    }
}
