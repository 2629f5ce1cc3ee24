//! Signed distance from a closed surface of facets, by a tree of bounding boxes.

use super::cuts::length;
use super::enclosure::{Enclosure, dot};
use super::facets::Facet;

/// Largest number of facets of a leaf.
const LEAF: usize = 4;
/// Distance over the extent within which a point lies on a facet, whose normal is that of the surface there.
const ON: f64 = 1e-9;

/// A facet nearest to a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearestFacet<const D: usize> {
    /// Number of the facet.
    pub facet: usize,
    /// Nearest point of the facet, m.
    pub place: [f64; D],
    /// Distance of the point, m.
    pub distance: f64,
    /// Number of facets whose distance was computed.
    pub tried: usize,
}

/// A box around facets: of a leaf, facets of the order from `first` on; of a branch (`count` 0) two boxes.
#[derive(Clone, Debug, PartialEq)]
struct FacetBox<const D: usize> {
    low: [f64; D],
    high: [f64; D],
    first: usize,
    count: usize,
}

impl<const D: usize> FacetBox<D> {
    /// Square of the distance of a point, m².
    fn square(&self, point: &[f64; D]) -> f64 {
        (0..D).map(|d| (self.low[d] - point[d]).max(point[d] - self.high[d]).max(0.0).powi(2)).sum()
    }
}

/// Signed distance h of points from a closed surface, positive outside, with its gradient.
#[derive(Clone, Debug, PartialEq)]
pub struct SignedDistance<const D: usize> {
    body: Enclosure<D>,
    /// Boxes, the root first, the two of a branch one after the other.
    boxes: Vec<FacetBox<D>>,
    /// Numbers of the facets in the order of the leaves.
    order: Vec<usize>,
}

impl<const D: usize> SignedDistance<D> {
    /// Builds the tree of a body: boxes halved along their longest axis at the middle facet.
    pub fn new(body: Enclosure<D>) -> Self {
        let corners = body.facets().corners();
        let middle = |facet: usize, d: usize| corners[facet].iter().map(|corner| corner[d]).sum::<f64>();
        let boxed = |order: &[usize], first: usize| {
            let [low, high] =
                polycore::numerics::bounds(order.iter().flat_map(|&facet| corners[facet].iter().copied()));
            FacetBox { low, high, first, count: order.len() }
        };
        let mut order: Vec<usize> = (0..corners.len()).collect();
        let mut boxes = vec![boxed(&order, 0)];
        let mut next = 0;
        while next < boxes.len() {
            let FacetBox { low, high, first, count } = boxes[next].clone();
            if count > LEAF {
                let longest = (0..D).max_by(|&a, &b| (high[a] - low[a]).total_cmp(&(high[b] - low[b])));
                let own = &mut order[first..first + count];
                own.sort_by(|&a, &b| {
                    let d = longest.unwrap_or(0);
                    middle(a, d).total_cmp(&middle(b, d)).then(a.cmp(&b))
                });
                let (left, right) = own.split_at(count / 2);
                let both = [boxed(left, first), boxed(right, first + count / 2)];
                (boxes[next].first, boxes[next].count) = (boxes.len(), 0);
                boxes.extend(both);
            }
            next += 1;
        }
        Self { body, boxes, order }
    }

    /// The body inside.
    pub fn body(&self) -> &Enclosure<D> {
        &self.body
    }

    /// Finds the facet nearest to a point.
    pub fn nearest_facet(&self, point: [f64; D]) -> NearestFacet<D> {
        let corners = self.body.facets().corners();
        let mut best = NearestFacet { facet: 0, place: point, distance: f64::INFINITY, tried: 0 };
        let mut least = f64::INFINITY;
        let mut open = vec![(0, self.boxes[0].square(&point))];
        while let Some((at, square)) = open.pop() {
            if square >= least {
                continue;
            }
            let FacetBox { first, count, .. } = self.boxes[at];
            if count == 0 {
                let left = (first, self.boxes[first].square(&point));
                let right = (first + 1, self.boxes[first + 1].square(&point));
                // the nearer one is taken next
                open.extend(if left.1 >= right.1 { [left, right] } else { [right, left] });
            }
            for &facet in &self.order[first..first + count] {
                let place = closest(point, &corners[facet]);
                let square: f64 = (0..D).map(|d| (point[d] - place[d]).powi(2)).sum();
                best.tried += 1;
                if square < least {
                    least = square;
                    (best.facet, best.place) = (facet, place);
                }
            }
        }
        best.distance = least.sqrt();
        best
    }

    /// Signed distance h of a point, m, and its gradient ∇h, which is the normal of the nearest facet on the
    /// surface.
    pub fn height_and_normal(&self, point: [f64; D]) -> (f64, [f64; D]) {
        let facets = self.body.facets();
        let nearest = self.nearest_facet(point);
        let (low, high) = facets.bounds();
        let extent = (0..D).map(|d| high[d] - low[d]).fold(0.0, f64::max);
        let sign = if facets.windings(point) > 0 { -1.0 } else { 1.0 };
        let height = sign * nearest.distance;
        if nearest.distance <= ON * extent {
            let normal = facets.normal(nearest.facet);
            return (height, if normal.iter().all(|x| x.is_finite()) { normal } else { [0.0; D] });
        }
        (height, std::array::from_fn(|d| (point[d] - nearest.place[d]) / height))
    }

    /// Returns true if the box around the surface is farther than `reach`, m, from a point.
    pub fn is_beyond(&self, point: &[f64; D], reach: f64) -> bool {
        self.boxes[0].square(point) > reach * reach
    }

    /// Centre and radius of a sphere around the surface, m.
    pub fn ball(&self) -> ([f64; D], f64) {
        let (low, high) = self.body.facets().bounds();
        let half: [f64; D] = std::array::from_fn(|d| 0.5 * (high[d] - low[d]));
        (std::array::from_fn(|d| low[d] + half[d]), length(half))
    }
}

/// Point of a facet nearest to a point: Ericson, Real-Time Collision Detection (2005), section 5.1.5.
fn closest<const D: usize>(point: [f64; D], corners: &Facet<D>) -> [f64; D] {
    let [a, b, c] = [corners[0], corners[1.min(D - 1)], corners[2.min(D - 1)]];
    let from = |p: [f64; D], q: [f64; D]| -> [f64; D] { std::array::from_fn(|d| q[d] - p[d]) };
    let on =
        |p: [f64; D], e: [f64; D], part: f64| -> [f64; D] { std::array::from_fn(|d| p[d] + part * e[d]) };
    let (ab, ac) = (from(a, b), from(a, c));
    let part = |e: [f64; D], p: [f64; D]| {
        let square = dot(e, e);
        if square > 0.0 { (dot(e, from(p, point)) / square).clamp(0.0, 1.0) } else { 0.0 }
    };
    if D == 2 {
        return on(a, ab, part(ab, a));
    }
    // a map over the corners would not be inlined
    let sides = |p: [f64; D]| (dot(ab, from(p, point)), dot(ac, from(p, point)));
    let ((d1, d2), (d3, d4), (d5, d6)) = (sides(a), sides(b), sides(c));
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    if d1 <= 0.0 && d2 <= 0.0 {
        a
    } else if d3 >= 0.0 && d4 <= d3 {
        b
    } else if d6 >= 0.0 && d5 <= d6 {
        c
    } else if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        on(a, ab, part(ab, a))
    } else if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        on(a, ac, part(ac, a))
    } else if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        on(b, from(b, c), part(from(b, c), b))
    } else {
        let sum = va + vb + vc;
        std::array::from_fn(|d| a[d] + (vb * ab[d] + vc * ac[d]) / sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Facets of a sphere of radius 1 about the origin: `bands` rings of 2·`bands` quadrangles in halves.
    fn sphere(bands: u32) -> Vec<[[f64; 3]; 3]> {
        let around = 2 * bands;
        let corner = |i: u32, k: u32| {
            let (theta, phi) = (
                std::f64::consts::PI * f64::from(i) / f64::from(bands),
                std::f64::consts::TAU * f64::from(k % around) / f64::from(around),
            );
            let across = if i == 0 || i == bands { 0.0 } else { theta.sin() };
            [across * phi.cos(), across * phi.sin(), theta.cos()]
        };
        let mut facets = Vec::new();
        for (i, k) in (0..bands).flat_map(|i| (0..around).map(move |k| (i, k))) {
            let [p, q, r, s] = [corner(i, k), corner(i + 1, k), corner(i + 1, k + 1), corner(i, k + 1)];
            if i + 1 < bands {
                facets.push([p, q, r]);
            }
            if i > 0 {
                facets.push([p, r, s]);
            }
        }
        facets
    }

    #[test]
    fn distances_are_those_of_all_facets() {
        let body = SignedDistance::new(Enclosure::new(sphere(12)).unwrap());
        let corners = body.body().facets().corners();
        for k in 0..500_u32 {
            let part = |n: f64| (f64::from(k) * n).fract() * 3.0 - 1.5;
            let point = [part(0.618_033_9), part(0.754_877_6), part(0.569_840_2)];
            let all = corners.iter().map(|facet| {
                let place = closest(point, facet);
                length(std::array::from_fn::<f64, 3, _>(|d| point[d] - place[d]))
            });
            let least = all.fold(f64::INFINITY, f64::min);
            let (height, normal) = body.height_and_normal(point);
            assert!((height.abs() - least).abs() < 1e-15, "{point:?}");
            assert!((height < 0.0) == body.body().contains(point), "{point:?}: {height}");
            // the gradient by central differences
            for d in 0..3 {
                let moved = |step: f64| {
                    body.height_and_normal(std::array::from_fn(|e| {
                        point[e] + if e == d { step } else { 0.0 }
                    }))
                };
                let slope = (moved(1e-7).0 - moved(-1e-7).0) / 2e-7;
                let kink = (moved(1e-7).1[d] - moved(-1e-7).1[d]).abs() > 1e-3;
                assert!(kink || (slope - normal[d]).abs() < 1e-5, "{point:?}: {slope} {normal:?}");
            }
        }
    }

    /// A point beside a surface of 10⁴ facets costs the distances of a few leaves.
    #[test]
    fn work_grows_with_the_depth_of_the_tree() {
        let facets = sphere(50);
        assert_eq!(facets.len(), 9800);
        let body = SignedDistance::new(Enclosure::new(facets).unwrap());
        let count = 2000_u32;
        let tried: usize = (0..count)
            .map(|k| {
                let [z, phi] =
                    [(f64::from(k) + 0.5) / f64::from(count) * 2.0 - 1.0, 2.399_963 * f64::from(k)];
                let (across, size) = ((1.0 - z * z).sqrt(), 0.97 + 0.06 * f64::from(k % 7) / 6.0);
                body.nearest_facet([across * phi.cos(), across * phi.sin(), z].map(|x| size * x)).tried
            })
            .sum();
        let mean = tried as f64 / f64::from(count);
        assert!(mean < 20.0, "{mean} facets a point");
        eprintln!("{mean} facets of {} a point", body.body().facets().corners().len());
    }
}
