//! Facets that are a part of the surface of a body, and the points below them.

use super::cuts::length;
use super::enclosure::dot;
use super::facets::{Facet, Facets, distance, nearest};
use std::collections::BTreeMap;

/// Part of a segment at its ends where it may touch a wall.
const END: f64 = 1e-6;

/// Length along a facet, over the depth below it, that counts as none.
const UPRIGHT: f64 = 1e-6;

/// Facets, lines (in 3D) and points of a surface or inside of a body.
#[derive(Clone, Debug)]
pub struct FacetSet<const D: usize> {
    facets: Facets<D>,
    /// Sides of facets that no other facet has, as facets without an extent.
    rim: Facets<D>,
}

impl<const D: usize> FacetSet<D> {
    /// Joins facets whose corners coincide. A facet whose corners are two points is a line, of one point a
    /// point.
    pub fn new(corners: Vec<Facet<D>>) -> Self {
        let mut sides: BTreeMap<Vec<[u64; D]>, (usize, Facet<D>)> = BTreeMap::new();
        for facet in &corners {
            let own = distinct(facet);
            // of a triangle its edges, of a line its ends
            for left_out in 0..if own.len() > 1 { own.len() } else { 0 } {
                let side: Vec<[f64; D]> = (1..own.len()).map(|k| own[(left_out + k) % own.len()]).collect();
                let mut key: Vec<[u64; D]> = side.iter().map(bits).collect();
                key.sort_unstable();
                let facet = std::array::from_fn(|k| side[k.min(side.len() - 1)]);
                sides.entry(key).or_insert((0, facet)).0 += 1;
            }
        }
        let rim = sides.into_values().filter(|(count, _)| *count == 1).map(|(_, facet)| facet).collect();
        Self { facets: Facets::new(corners), rim: Facets::new(rim) }
    }

    /// Returns true for a point at most `reach`, m, below the facets: its nearest point of one of them is its
    /// foot, or lies where facets meet and is the nearest of all these; beyond the rim there is no such
    /// point. The segment to it passes no wall.
    pub fn covers(&self, point: [f64; D], reach: f64, walls: &Facets<D>) -> bool {
        let slack = UPRIGHT * reach;
        let (low, high) = (point.map(|x| x - reach), point.map(|x| x + reach));
        self.facets.any_near(low, high, |facet| {
            let corners = &self.facets.corners()[facet];
            let foot = nearest(point, corners);
            let offset: [f64; D] = std::array::from_fn(|d| point[d] - foot[d]);
            let depth = length(offset);
            if depth > reach {
                return false;
            }
            let is_upright = length(along(corners, offset)) <= slack;
            let is_below =
                is_upright || !self.rim.is_within(foot, slack) && self.is_least(point, foot, depth);
            is_below && !parts(walls, point, foot)
        })
    }

    /// Returns true if one of the facets is as near to a point as any of `all`, and nearer than `reach`, m.
    pub fn is_nearest(&self, point: [f64; D], reach: f64, all: &Facets<D>) -> bool {
        let least = |facets: &Facets<D>| {
            let mut least = f64::INFINITY;
            facets.near(point.map(|x| x - reach), point.map(|x| x + reach), |facet| {
                least = least.min(distance(point, &facets.corners()[facet]));
            });
            least
        };
        let own = least(&self.facets);
        own < reach && own <= least(all) + UPRIGHT * reach
    }

    /// Returns true if no facet at a point `foot` is nearer to a point than `depth`, m.
    fn is_least(&self, point: [f64; D], foot: [f64; D], depth: f64) -> bool {
        let slack = UPRIGHT * depth;
        !self.facets.any_near(foot.map(|x| x - slack), foot.map(|x| x + slack), |facet| {
            let corners = &self.facets.corners()[facet];
            distance(foot, corners) <= slack && distance(point, corners) < depth - slack
        })
    }
}

/// Returns true if a wall lies between two points.
fn parts<const D: usize>(walls: &Facets<D>, from: [f64; D], to: [f64; D]) -> bool {
    let mut found = false;
    walls.meet(from, to, |_, part| found = found || part > END && part < 1.0 - END);
    found
}

/// Component of a vector along a facet.
fn along<const D: usize>(corners: &Facet<D>, vector: [f64; D]) -> [f64; D] {
    let own = distinct(corners);
    if own.len() == D {
        let normal = Facets::new(vec![*corners]).normal(0);
        let height = dot(vector, normal);
        return std::array::from_fn(|d| vector[d] - height * normal[d]);
    }
    let [Some(a), Some(b)] = [own.first(), own.get(1)] else { return [0.0; D] };
    let line: [f64; D] = std::array::from_fn(|d| b[d] - a[d]);
    let part = dot(vector, line) / dot(line, line);
    line.map(|x| part * x)
}

/// Corners that differ from those before.
fn distinct<const D: usize>(corners: &Facet<D>) -> Vec<[f64; D]> {
    let mut own: Vec<[f64; D]> = Vec::with_capacity(D);
    corners.iter().for_each(|corner| {
        if !own.contains(corner) {
            own.push(*corner);
        }
    });
    own
}

/// Bits of a corner; −0 is 0.
fn bits<const D: usize>(corner: &[f64; D]) -> [u64; D] {
    corner.map(|x| (x + 0.0).to_bits())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Enclosure;

    fn ring(points: &[[f64; 2]]) -> Vec<Facet<2>> {
        (0..points.len()).map(|k| [points[k], points[(k + 1) % points.len()]]).collect()
    }

    /// Counts the cell centres of a lattice of spacing 1 in [0, 10]² inside of walls that facets cover.
    fn count(facets: Vec<Facet<2>>, walls: &[Facet<2>], reach: f64) -> usize {
        let (set, body) = (FacetSet::new(facets), Enclosure::new(walls.to_vec()).unwrap());
        let at = |k: usize| [k % 10, k / 10].map(|n| n as f64 + 0.5);
        let inside = (0..100).map(at).filter(|&place| body.contains(place));
        inside.filter(|&place| set.covers(place, reach, body.facets())).count()
    }

    /// Two layers of a box have all particles of the box region, corners included, in one facet or three.
    #[test]
    fn layers_of_a_box_reach_its_corners() {
        let walls = ring(&[[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]]);
        assert_eq!(count(vec![walls[0]], &walls, 2.0 + 1e-9), 20);
        let pieces = [[0.0, 3.0], [3.0, 3.25], [3.25, 10.0]].map(|[a, b]| [[a, 0.0], [b, 0.0]]);
        assert_eq!(count(pieces.to_vec(), &walls, 2.0 + 1e-9), 20);
        // two sides with the corner between them
        assert_eq!(count(walls[..2].to_vec(), &walls, 2.0 + 1e-9), 36);
    }

    /// The foot of an L ends at its leg; both sides of the corner take the disk around it, too: of 2 × 2
    /// particles there the three within 2.
    #[test]
    fn a_face_ends_at_its_rim() {
        let walls = ring(&[[0.0, 0.0], [10.0, 0.0], [10.0, 4.0], [4.0, 4.0], [4.0, 10.0], [0.0, 10.0]]);
        assert_eq!(count(vec![walls[2]], &walls, 2.0 + 1e-9), 12);
        assert_eq!(count(walls[2..4].to_vec(), &walls, 2.0 + 1e-9), 12 + 12 + 3);
    }

    /// A slot of half a spacing parts its flanks; a wall of two spacings has no particles behind it.
    #[test]
    fn walls_end_the_depth() {
        let slot = ring(&[
            [0.0, 0.0],
            [10.0, 0.0],
            [10.0, 10.0],
            [5.25, 10.0],
            [5.25, 2.0],
            [4.75, 2.0],
            [4.75, 10.0],
            [0.0, 10.0],
        ]);
        // of the right flank
        assert_eq!(count(vec![slot[3]], &slot, 3.0), 8 * 3);
        let thin = ring(&[[0.0, 0.0], [2.0, 0.0], [2.0, 10.0], [0.0, 10.0]]);
        assert_eq!(count(vec![thin[3]], &thin, 5.0), 20);
    }

    /// A line in space has the points around it, none beyond its ends; a point those around it.
    #[test]
    fn lines_and_points() {
        let (a, b) = ([0.0, 0.0, 0.0], [4.0, 0.0, 0.0]);
        let none = Facets::new(Vec::new());
        let line = FacetSet::new(vec![[a, b, b]]);
        assert!(line.covers([2.0, 0.6, 0.8], 1.0 + 1e-9, &none));
        assert!(!line.covers([4.5, 0.0, 0.5], 1.0, &none));
        let point = FacetSet::new(vec![[a; 3]]);
        assert!(
            point.covers([0.6, 0.0, 0.8], 1.0 + 1e-9, &none) && !point.covers([1.1, 0.0, 0.0], 1.0, &none)
        );
    }
}
