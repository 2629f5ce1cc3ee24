//! Bodies inside closed facets: polygons in 2D, meshes and STL surfaces in 3D.

use super::facets::{Facet, Facets};
use crate::error::Error;
use std::collections::HashMap;

/// Distance from the facets, over the largest extent, within which a point lies on them.
const ON: f64 = 1e-9;

/// A body inside closed, oriented facets. Points on the facets belong to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Enclosure<const D: usize> {
    facets: Facets<D>,
    /// Distance within which a point lies on the facets, m.
    near: f64,
    volume: f64,
}

impl<const D: usize> Enclosure<D> {
    /// Encloses a body by its facets: triangles, anticlockwise seen from outside; in 2D segments, the body on
    /// their left.
    ///
    /// # Errors
    /// [`Error::Geometry`] for coordinates that are not finite, facets that are not closed, with the number
    /// of open edges, and a volume that is not positive.
    pub fn new(corners: Vec<Facet<D>>) -> Result<Self, Error> {
        if let Some(corner) = corners.iter().flatten().find(|corner| corner.iter().any(|x| !x.is_finite())) {
            return Err(Error::geometry(format!("a corner at {corner:?} m; allowed: finite coordinates")));
        }
        let (open, first) = open_edges(&corners);
        if open > 0 {
            let place = first.map(|x| (x * 1e9).round() / 1e6);
            return Err(Error::geometry(format!(
                "{open} open edges, the first at {place:?} mm; allowed: a closed surface, without any"
            )));
        }
        let facets = Facets::new(corners);
        let (low, high) = facets.bounds();
        let near = ON * (0..D).map(|d| high[d] - low[d]).fold(0.0, f64::max);
        let (volume, _) = moments(facets.corners());
        if volume > 0.0 {
            return Ok(Self { facets, near, volume });
        }
        Err(Error::geometry(format!("facets around a volume of {volume:e}; allowed: above 0")))
    }

    /// Volume inside, m³; in 2D the area, m².
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// The facets.
    pub fn facets(&self) -> &Facets<D> {
        &self.facets
    }

    /// Returns true for a point inside or on the facets.
    pub fn contains(&self, point: [f64; D]) -> bool {
        let (low, high) = self.facets.bounds();
        let boxed = (0..D).all(|d| low[d] - self.near <= point[d] && point[d] <= high[d] + self.near);
        boxed && (self.facets.windings(point) > 0 || self.facets.is_within(point, self.near))
    }

    /// Returns true for a point inside or within `reach`, m, of the facets.
    pub fn is_near(&self, point: [f64; D], reach: f64) -> bool {
        self.facets.is_within(point, reach) || self.facets.windings(point) > 0
    }

    /// Counts how often a point lies inside: 2 where pieces overlap; 0 outside and on the facets.
    pub fn depth(&self, point: [f64; D]) -> i32 {
        let count = self.facets.windings(point);
        if count > 0 && !self.facets.is_within(point, self.near) { count } else { 0 }
    }

    /// Finds a point that lies by more than `margin`, m, inside this body at one of its facets, and inside
    /// `other`, or inside another piece of this body if `other` is this one.
    pub fn shared_point(&self, other: &Self, margin: f64) -> Option<[f64; D]> {
        let own = i32::from(std::ptr::eq(self, other));
        let ((low, high), (from, to)) = (self.facets.bounds(), other.facets.bounds());
        if (0..D).any(|d| high[d] < from[d] || to[d] < low[d]) {
            return None;
        }
        // the middle of a facet, and beside its corners
        let inside = (0..self.facets.corners().len()).flat_map(|facet| {
            let (corners, normal) = (self.facets.corners()[facet], self.facets.normal(facet));
            let middle: [f64; D] =
                std::array::from_fn(|d| corners.iter().map(|corner| corner[d]).sum::<f64>() / D as f64);
            let beside = corners.into_iter().map(move |corner| {
                let inwards: [f64; D] = std::array::from_fn(|d| middle[d] - corner[d]);
                let part = (3.0 * margin / dot(inwards, inwards).sqrt()).min(0.5);
                std::array::from_fn(|d| corner[d] + part * inwards[d])
            });
            let points = std::iter::once(middle).chain(beside);
            points.map(move |point| std::array::from_fn(|d| point[d] - margin * normal[d]))
        });
        inside
            .filter(|&point| !self.facets.is_within(point, 0.5 * margin))
            .filter(|&point| !other.facets.is_within(point, 0.5 * margin))
            .filter(|&point| self.facets.windings(point) > 0)
            .find(|&point| other.facets.windings(point) > own)
    }

    /// Returns true if facets face each other across a gap narrower than `width`, m.
    pub(super) fn has_slots(&self, width: f64) -> bool {
        let corners = self.facets.corners();
        (0..corners.len()).any(|one| {
            let [low, high] = polycore::numerics::bounds(corners[one].iter().copied());
            let normal = self.facets.normal(one);
            self.facets.any_near(low.map(|x| x - width), high.map(|x| x + width), |other| {
                let back = self.facets.normal(other);
                let opposed = dot(normal, back) < FACING;
                let before = |from: usize, to: usize, normal: [f64; D]| {
                    let offset = |corner: &[f64; D]| {
                        dot(std::array::from_fn(|d| corner[d] - corners[from][0][d]), normal)
                    };
                    corners[to].iter().any(|corner| offset(corner) > self.near)
                };
                opposed && before(one, other, normal) && before(other, one, back)
            })
        })
    }

    /// Collects the normals of the facets that the segment from `a` to `b` meets, by the fraction of its
    /// length.
    pub(super) fn normals(&self, a: [f64; D], b: [f64; D], to: &mut Vec<(f64, [f64; D])>) {
        self.facets.meet(a, b, |facet, part| to.push((part.clamp(0.0, 1.0), self.facets.normal(facet))));
    }
}

/// Greatest cosine of the angle between the normals of faces that face each other: turned by 120° or more.
pub(super) const FACING: f64 = -0.5;

pub(super) fn dot<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    (0..D).map(|d| a[d] * b[d]).sum()
}

/// Volume inside closed facets, m³ (in 2D the area, m²), and its centroid, m.
pub fn moments<const D: usize>(corners: &[Facet<D>]) -> (f64, [f64; D]) {
    let origin = corners.first().map_or([0.0; D], |facet| facet[0]);
    let (mut volume, mut moment) = (0.0, [0.0; D]);
    for facet in corners {
        let own = cone(facet, origin);
        volume += own;
        for (d, moment) in moment.iter_mut().enumerate() {
            let sum: f64 = facet.iter().map(|corner| corner[d] - origin[d]).sum();
            *moment += own * sum / (D + 1) as f64;
        }
    }
    (volume, std::array::from_fn(|d| origin[d] + moment[d] / volume))
}

/// Signed volume between an origin and a facet.
fn cone<const D: usize>(corners: &Facet<D>, origin: [f64; D]) -> f64 {
    let at = |k: usize, d: usize| corners[k.min(D - 1)][d % D] - origin[d % D];
    match D {
        2 => 0.5 * (at(0, 0) * at(1, 1) - at(0, 1) * at(1, 0)),
        _ => {
            let cross = |d: usize| at(1, d + 1) * at(2, d + 2) - at(1, d + 2) * at(2, d + 1);
            (0..D).map(|d| at(0, d) * cross(d)).sum::<f64>() / 6.0
        }
    }
}

/// Counts the edges (in 2D: ends) that facets do not pass equally often in both directions; returns also the
/// middle of the first.
fn open_edges<const D: usize>(corners: &[Facet<D>]) -> (usize, [f64; D]) {
    // −0 is 0
    let key = |corner: &[f64; D]| corner.map(|x| (x + 0.0).to_bits());
    let mut edges: HashMap<[[u64; D]; 2], (i64, [f64; D])> = HashMap::new();
    for facet in corners {
        let mut count = |p: &[f64; D], q: &[f64; D], way: i64| {
            let (a, b, way) = if key(p) <= key(q) { (p, q, way) } else { (q, p, -way) };
            let middle = std::array::from_fn(|d| 0.5 * (a[d] + b[d]));
            edges.entry([key(a), key(b)]).or_insert((0, middle)).0 += way;
        };
        if D == 2 {
            count(&facet[0], &facet[0], -1);
            count(&facet[1], &facet[1], 1);
        } else {
            (0..D).for_each(|k| count(&facet[k], &facet[(k + 1) % D], 1));
        }
    }
    let open = edges.values().filter(|(count, _)| *count != 0).map(|(_, middle)| *middle);
    let first = open.clone().min_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    (open.count(), first.unwrap_or([0.0; D]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn polygon(points: &[[f64; 2]]) -> Vec<[[f64; 2]; 2]> {
        (0..points.len()).map(|k| [points[k], points[(k + 1) % points.len()]]).collect()
    }

    /// Faces of a box as two triangles each.
    fn cuboid(low: [f64; 3], high: [f64; 3]) -> Vec<[[f64; 3]; 3]> {
        let at = |k: usize| std::array::from_fn(|d| if k >> d & 1 == 1 { high[d] } else { low[d] });
        let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        sides.iter().flat_map(|[a, b, c, d]| [[at(*a), at(*b), at(*c)], [at(*a), at(*c), at(*d)]]).collect()
    }

    /// A square with a hole: points inside, in the hole, on edges and corners, above corners.
    #[test]
    fn points_in_a_polygon_with_a_hole() {
        let mut facets = polygon(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]);
        facets.extend(polygon(&[[1.0, 1.0], [1.0, 3.0], [3.0, 3.0], [3.0, 1.0]]));
        let body = Enclosure::new(facets).unwrap();
        assert_eq!(body.volume(), 12.0);
        for (point, inside, depth) in [
            ([0.5, 0.5], true, 1),
            ([2.0, 2.0], false, 0),
            ([1.0, 0.5], true, 1),
            ([3.0, 3.5], true, 1),
            ([4.0, 4.0], true, 0),
            ([0.0, 2.0], true, 0),
            ([3.0, 2.0], true, 0),
            ([4.1, 2.0], false, 0),
            ([2.0, -0.1], false, 0),
        ] {
            assert_eq!((body.contains(point), body.depth(point)), (inside, depth), "{point:?}");
        }
    }

    /// Rays through edges and corners of the triangulation meet one facet each.
    #[test]
    fn rays_through_edges_count_once() {
        let body = Enclosure::new(cuboid([0.0; 3], [2.0; 3])).unwrap();
        assert!((body.volume() - 8.0).abs() < 1e-14);
        for k in 0..9 * 9 * 9 {
            let point = [k % 9, k / 9 % 9, k / 81].map(|n| 0.25 * f64::from(n));
            let strictly = point.iter().all(|x| *x > 0.0 && *x < 2.0);
            assert_eq!(body.depth(point), i32::from(strictly), "{point:?}");
            assert!(body.contains(point), "{point:?}");
        }
        let mut parts = Vec::new();
        body.normals([1.0, 1.0, -1.0], [1.0, 1.0, 3.0], &mut parts);
        parts.sort_by(|a, b| a.0.total_cmp(&b.0));
        assert!(parts.first().is_some_and(|part| *part == (0.25, [0.0, 0.0, -1.0])), "{parts:?}");
        assert!(parts.last().is_some_and(|part| *part == (0.75, [0.0, 0.0, 1.0])), "{parts:?}");
    }

    /// The volume of a body of n boxes is exact, that of a polygon converges to the circle by n⁻².
    #[test]
    fn volumes() {
        let circle = |n: i32| {
            let at = |k: i32| {
                let (sin, cos) = (2.0 * PI * f64::from(k % n) / f64::from(n)).sin_cos();
                [cos, sin]
            };
            Enclosure::new((0..n).map(|k| [at(k), at(k + 1)]).collect()).unwrap().volume()
        };
        let [coarse, fine] = [32, 64].map(|n| PI - circle(n));
        assert!((coarse / fine - 4.0).abs() < 0.02, "{coarse} {fine}");
        assert!(Enclosure::new(cuboid([2.0; 3], [0.0; 3])).is_err(), "inside out");
        let (volume, centroid) = moments(&cuboid([1.0, 2.0, 3.0], [3.0, 3.0, 4.0]));
        assert!((volume - 2.0).abs() < 1e-14);
        assert!(centroid.iter().zip([2.0, 2.5, 3.5]).all(|(x, y)| (x - y).abs() < 1e-14), "{centroid:?}");
    }

    #[test]
    fn open_surfaces_are_refused() {
        let mut facets = cuboid([0.0; 3], [1.0; 3]);
        facets.pop();
        let error = Enclosure::new(facets).unwrap_err().to_string();
        assert!(error.contains("3 open edges"), "{error}");
        let error = Enclosure::new(vec![[[0.0, 0.0], [1.0, 0.0]]]).unwrap_err().to_string();
        assert!(error.contains("2 open edges"), "{error}");
    }

    /// Slots count below their width, convex bodies have none.
    #[test]
    fn faces_that_face_each_other() {
        let notched = polygon(&[
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 4.0],
            [2.5, 4.0],
            [2.5, 2.0],
            [2.0, 2.0],
            [2.0, 4.0],
            [0.0, 4.0],
        ]);
        let body = Enclosure::new(notched).unwrap();
        assert!(body.has_slots(0.6) && !body.has_slots(0.4));
        assert!(!Enclosure::new(cuboid([0.0; 3], [1.0, 1.0, 0.1])).unwrap().has_slots(0.5));
    }
}
