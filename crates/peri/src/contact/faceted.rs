//! Rigid surfaces of facets: where they touch a ball on their way, and what a body meets on its.

use super::surface::{RigidSurface, SurfaceShape};
use super::surfaces::RigidSurfaces;
use crate::field::Field;
use crate::geometry::SignedDistance;

/// Distance over the size of the surface at which a ball touches it.
const TOUCH: f64 = 1e-12;
/// Largest number of steps to the first touch; a ball that grazes a flat facet needs as many.
const STEPS: u32 = 200;

impl<const D: usize> RigidSurface<D> {
    /// Interval of ways along `way`, m, from a place at rest on which a ball of this radius may touch the
    /// sphere around the facets.
    fn passage(
        &self,
        facets: &SignedDistance<D>,
        place: [f64; D],
        radius: f64,
        way: &[f64; D],
    ) -> Option<[f64; 2]> {
        let (middle, size) = facets.ball();
        let to: [f64; D] = std::array::from_fn(|d| self.point[d] + middle[d] - place[d]);
        let dot = |a: &[f64; D], b: &[f64; D]| (0..D).map(|d| a[d] * b[d]).sum::<f64>();
        let ahead = dot(&to, way);
        let inside = ahead * ahead - dot(&to, &to) + (size + radius).powi(2);
        (inside >= 0.0).then(|| [ahead - inside.sqrt(), ahead + inside.sqrt()])
    }

    /// Way along `way`, m, on which a ball at a place first touches facets, by steps of its distance from
    /// them.
    pub(super) fn way_to_facets(
        &self,
        facets: &SignedDistance<D>,
        place: [f64; D],
        radius: f64,
        way: &[f64; D],
    ) -> Option<f64> {
        let [mut at, end] = self.passage(facets, place, radius, way)?;
        let touch = TOUCH * facets.ball().1;
        for _ in 0..STEPS {
            let gap = self.height(std::array::from_fn(|d| place[d] + at * way[d])) - radius;
            if gap <= touch {
                return Some(at);
            }
            at += gap;
            if at > end {
                return None;
            }
        }
        Some(at)
    }

    /// Least height above facets, m, on the way from a place along `way`; below −`fine`, m, by steps of it.
    pub(super) fn least_height_on_way(
        &self,
        facets: &SignedDistance<D>,
        place: [f64; D],
        fine: f64,
        way: &[f64; D],
    ) -> f64 {
        let mut least = self.height(place);
        let Some([start, end]) = self.passage(facets, place, 0.0, way) else { return least };
        let mut at = start.max(0.0);
        while at <= end {
            let height = self.height(std::array::from_fn(|d| place[d] + at * way[d]));
            least = least.min(height);
            at += height.max(fine);
        }
        least
    }
}

impl<const D: usize> RigidSurfaces<D> {
    /// Returns false for an element farther than `gap`, m, from the box around facets moved by `shift`, m;
    /// true for other surfaces.
    pub(super) fn is_beside(
        &self,
        surface: &RigidSurface<D>,
        shift: &[f64; D],
        field: &Field<D>,
        element: usize,
        gap: f64,
    ) -> bool {
        let SurfaceShape::Facets(facets) = &surface.shape else { return true };
        let ((home, radius, _), moved) = (self.ball(element), self.displacement(field, element));
        let from = surface.offset_of(std::array::from_fn(|d| home[d] + moved[d] - shift[d]));
        !facets.is_beyond(&from, radius + gap)
    }
}
