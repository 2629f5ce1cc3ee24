//! Flat facets, found by their place: segments in 2D, triangles in 3D.

use super::cuts::{Cut, length};
use robust::{Coord, orient2d};

/// Excess of a facet, over its edges, at which a segment still meets it.
const SLACK: f64 = 1e-9;

/// Corners of a facet, m: two in 2D, three in 3D.
pub type Facet<const D: usize> = [[f64; D]; D];

/// Facets with their corners, binned by their shadow on the first D − 1 axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Facets<const D: usize> {
    corners: Vec<Facet<D>>,
    /// Bounding box of each facet.
    boxes: Vec<[[f64; D]; 2]>,
    low: [f64; D],
    high: [f64; D],
    /// Number of bins along the first D − 1 axes.
    bins: [usize; D],
    /// First member of each bin, and the end of the last one's.
    firsts: Vec<u32>,
    members: Vec<u32>,
}

impl<const D: usize> Facets<D> {
    /// Bins facets; a facet whose corners coincide is a point.
    pub fn new(corners: Vec<Facet<D>>) -> Self {
        let [low, high] = polycore::numerics::bounds(corners.iter().flatten().copied());
        // about one bin a facet
        let along = (corners.len() as f64).powf(1.0 / (D - 1) as f64).ceil().clamp(1.0, 4096.0) as usize;
        let boxes = corners.iter().map(|facet| polycore::numerics::bounds(facet.iter().copied())).collect();
        let (firsts, members) = (Vec::new(), Vec::new());
        let mut facets = Self { corners, boxes, low, high, bins: [1; D], firsts, members };
        facets.bins[..D - 1].fill(along);
        let mut counts = vec![0_u32; facets.bins.iter().product::<usize>() + 1];
        let spans: Vec<[[usize; 2]; D]> = (0..facets.corners.len()).map(|k| facets.span_of(k)).collect();
        spans.iter().flat_map(|&span| facets.bins_of(span)).for_each(|(bin, _)| counts[bin + 1] += 1);
        for bin in 1..counts.len() {
            counts[bin] += counts[bin - 1];
        }
        facets.firsts = counts.clone();
        let mut members = vec![0; counts.last().copied().unwrap_or(0) as usize];
        for (facet, &span) in (0_u32..).zip(&spans) {
            for (bin, _) in facets.bins_of(span) {
                members[counts[bin] as usize] = facet;
                counts[bin] += 1;
            }
        }
        facets.members = members;
        facets
    }

    /// Corners of each facet, m.
    pub fn corners(&self) -> &[Facet<D>] {
        &self.corners
    }

    /// Bounding box as (lower corner, upper corner).
    pub fn bounds(&self) -> ([f64; D], [f64; D]) {
        (self.low, self.high)
    }

    /// Returns the area of all facets, m²; in 2D their length, m.
    pub fn area(&self) -> f64 {
        self.corners.iter().map(|facet| length(area_vector(facet))).sum()
    }

    /// Returns true if a facet lies within `reach`, m, of a point.
    pub fn is_within(&self, point: [f64; D], reach: f64) -> bool {
        let (low, high) = (point.map(|x| x - reach), point.map(|x| x + reach));
        self.any_near(low, high, |facet| distance(point, &self.corners[facet]) <= reach)
    }

    /// Counts how often a ray from a point along the last axis leaves a body within these facets, less how
    /// often it enters: facets have their corners anticlockwise seen from outside, in 2D the body on their
    /// left.
    ///
    /// A ray through a corner or an edge is moved aside by an infinitesimal amount, so that it meets one of
    /// the facets there.
    pub fn windings(&self, point: [f64; D]) -> i32 {
        let (mut low, mut high) = (point, point);
        (low[D - 1], high[D - 1]) = (point[D - 1], f64::INFINITY);
        let mut count = 0;
        self.near(low, high, |facet| count += crossing(&self.corners[facet], point));
        count
    }

    /// Visits the facets that the segment from `a` to `b` meets, with the fraction of its length.
    pub fn meet(&self, a: [f64; D], b: [f64; D], mut visit: impl FnMut(usize, f64)) {
        let low = std::array::from_fn(|d| a[d].min(b[d]));
        let high = std::array::from_fn(|d| a[d].max(b[d]));
        self.near(low, high, |facet| {
            let corners = &self.corners[facet];
            let edges = std::array::from_fn(|k| match corners.get(k + 1) {
                Some(corner) => std::array::from_fn(|d| corner[d] - corners[0][d]),
                None => [0.0; D],
            });
            let Some(parts) = (Cut { corner: corners[0], edges }).passage(a, b) else { return };
            let sum: f64 = parts[1..].iter().sum();
            let inside = parts[1..].iter().all(|part| *part >= -SLACK) && sum <= 1.0 + SLACK;
            if inside && (-SLACK..=1.0 + SLACK).contains(&parts[0]) {
                visit(facet, parts[0]);
            }
        });
    }

    /// Returns the normal of a facet, to the side from which its corners are anticlockwise; not a number
    /// without an area.
    pub fn normal(&self, facet: usize) -> [f64; D] {
        let across = area_vector(&self.corners[facet]);
        let size = length(across);
        across.map(|x| x / size)
    }

    /// Visits the facets whose boxes meet a box, each once.
    pub(super) fn near(&self, low: [f64; D], high: [f64; D], mut visit: impl FnMut(usize)) {
        self.any_near(low, high, |facet| {
            visit(facet);
            false
        });
    }

    /// Returns true if a condition holds for a facet whose box meets a box; asks no other after that.
    pub(super) fn any_near(
        &self,
        low: [f64; D],
        high: [f64; D],
        mut holds: impl FnMut(usize) -> bool,
    ) -> bool {
        let apart = (0..D).any(|d| high[d] < self.low[d] || self.high[d] < low[d]);
        if self.corners.is_empty() || apart {
            return false;
        }
        let range = self.range(low, high);
        self.bins_of(range).any(|(bin, at)| {
            self.members[self.firsts[bin] as usize..self.firsts[bin + 1] as usize].iter().any(|&facet| {
                let [least, most] = &self.boxes[facet as usize];
                let meets = (0..D).all(|d| least[d] <= high[d] && low[d] <= most[d]);
                // in the first of their common bins
                let first = || (0..D - 1).all(|d| at[d] == self.bin(d, least[d]).max(range[d][0]));
                meets && first() && holds(facet as usize)
            })
        })
    }

    /// Bins of a facet along each axis: the first and the last.
    fn span_of(&self, facet: usize) -> [[usize; 2]; D] {
        let [low, high] = self.boxes[facet];
        self.range(low, high)
    }

    fn range(&self, low: [f64; D], high: [f64; D]) -> [[usize; 2]; D] {
        std::array::from_fn(|d| if d + 1 < D { [self.bin(d, low[d]), self.bin(d, high[d])] } else { [0, 0] })
    }

    fn bin(&self, d: usize, x: f64) -> usize {
        let part = (x - self.low[d]) / (self.high[d] - self.low[d]);
        // not a number in a box without width
        (part.clamp(0.0, 1.0) * self.bins[d] as f64).min(self.bins[d] as f64 - 1.0).max(0.0) as usize
    }

    /// Bins of a range, with their numbers and places.
    fn bins_of(&self, range: [[usize; 2]; D]) -> impl Iterator<Item = (usize, [usize; D])> {
        let (bins, counts) = (self.bins, range.map(|[first, last]| last + 1 - first));
        (0..counts.iter().product()).map(move |index| {
            let step = super::cell(index, counts);
            let at: [usize; D] = std::array::from_fn(|d| range[d][0] + step[d]);
            ((0..D).rev().fold(0, |bin, d| bin * bins[d] + at[d]), at)
        })
    }
}

/// Area vector of a facet: in 2D its length, to the right of its direction.
fn area_vector<const D: usize>(corners: &Facet<D>) -> [f64; D] {
    let edge = |k: usize| -> [f64; D] { std::array::from_fn(|d| corners[k.min(D - 1)][d] - corners[0][d]) };
    let (a, b) = (edge(1), edge(2));
    match D {
        2 => std::array::from_fn(|d| if d == 0 { a[1] } else { -a[0] }),
        _ => {
            std::array::from_fn(|d| 0.5 * (a[(d + 1) % D] * b[(d + 2) % D] - a[(d + 2) % D] * b[(d + 1) % D]))
        }
    }
}

/// Side of a point from the line through two points, seen along the last axis: above 0 on the left, with an
/// exact sign, so that one facet of a fan around a corner has the point. The line has one side of a point,
/// whichever end comes first; a point on it is moved by (ε², ε).
fn side<const D: usize>(p: &[f64; D], q: &[f64; D], at: [f64; D]) -> f64 {
    let (low, high) = if p <= q { (p, q) } else { (q, p) };
    let shadow = |x: &[f64; D]| Coord { x: x[0], y: x[1] };
    let mut cross = orient2d(shadow(low), shadow(high), shadow(&at));
    if cross == 0.0 {
        cross = if high[0] > low[0] {
            f64::MIN_POSITIVE
        } else if high[1] > low[1] {
            -f64::MIN_POSITIVE
        } else {
            0.0
        };
    }
    if p <= q { cross } else { -cross }
}

/// Crossing of a facet by the ray from a point along the last axis: 1 where the ray leaves, −1 where it
/// enters, 0 without any.
fn crossing<const D: usize>(corners: &Facet<D>, point: [f64; D]) -> i32 {
    if D == 2 {
        let [p, q] = [corners[0], corners[1]];
        // the body lies on the left of a facet towards −x, below it
        let way = i32::from(q[0] <= point[0]) - i32::from(p[0] <= point[0]);
        let (low, high) = if p <= q { (p, q) } else { (q, p) };
        let above = || low[1] + (high[1] - low[1]) * ((point[0] - low[0]) / (high[0] - low[0])) > point[1];
        return if way != 0 && above() { way } else { 0 };
    }
    let [a, b, c] = [&corners[0], &corners[1], &corners[D - 1]];
    let sides = [side(b, c, point), side(c, a, point), side(a, b, point)];
    let up = sides.iter().all(|side| *side > 0.0);
    if !up && !sides.iter().all(|side| *side < 0.0) {
        return 0;
    }
    let sum: f64 = sides.iter().sum();
    let height: f64 = [a, b, c].iter().zip(sides).map(|(corner, side)| side / sum * corner[D - 1]).sum();
    match height > point[D - 1] {
        true if up => 1,
        true => -1,
        false => 0,
    }
}

/// Distance of a point from a facet, m.
pub(super) fn distance<const D: usize>(point: [f64; D], corners: &Facet<D>) -> f64 {
    foot(point, corners).0
}

/// Returns the point of a facet nearest to a point, m.
pub(super) fn nearest<const D: usize>(point: [f64; D], corners: &Facet<D>) -> [f64; D] {
    foot(point, corners).1
}

/// Distance of a point from a facet, m, and the nearest point of it.
fn foot<const D: usize>(point: [f64; D], corners: &Facet<D>) -> (f64, [f64; D]) {
    if D == 3 {
        let across = area_vector(corners);
        let size = length(across);
        // above the inside of the triangle, by the sides of its edges
        let within = (0..D).all(|k| {
            let (p, q) = (corners[k], corners[(k + 1) % D]);
            let part = std::array::from_fn(|m| [p, q, point][m.min(2)]);
            area_vector(&part).iter().zip(across).map(|(x, y)| x * y).sum::<f64>() >= 0.0
        });
        if within && size > 0.0 {
            let height: f64 = (0..D).map(|d| (point[d] - corners[0][d]) * across[d]).sum();
            let height = height / size;
            return (height.abs(), std::array::from_fn(|d| point[d] - height * across[d] / size));
        }
    }
    let beside = |k: usize| {
        let (p, q) = (corners[k], corners[(k + 1) % D]);
        let along: [f64; D] = std::array::from_fn(|d| q[d] - p[d]);
        let square: f64 = along.iter().map(|x| x * x).sum();
        let dot: f64 = (0..D).map(|d| (point[d] - p[d]) * along[d]).sum();
        let part = if square > 0.0 { (dot / square).clamp(0.0, 1.0) } else { 0.0 };
        let offset = length(std::array::from_fn::<f64, D, _>(|d| point[d] - p[d] - part * along[d]));
        (offset, std::array::from_fn(|d| p[d] + part * along[d]))
    };
    let least = |one: (f64, [f64; D]), other: (f64, [f64; D])| if other.0 < one.0 { other } else { one };
    (0..D).map(beside).fold((f64::INFINITY, corners[0]), least)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_from_a_triangle() {
        let triangle = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
        for (point, expected) in [
            ([0.5, 0.5, 3.0], 3.0),
            ([0.5, 0.5, -3.0], 3.0),
            ([-3.0, 0.0, 4.0], 5.0),
            ([2.0, 2.0, 0.0], 2.0_f64.sqrt()),
            ([1.0, -2.0, 0.0], 2.0),
        ] {
            assert!((distance(point, &triangle) - expected).abs() < 1e-15, "{point:?}");
        }
        assert_eq!(distance([3.0, 4.0], &[[0.0; 2]; 2]), 5.0, "a point");
        let facets = Facets::new(vec![triangle]);
        assert!((facets.area() - 2.0).abs() < 1e-15 && facets.normal(0) == [0.0, 0.0, 1.0]);
        let mut met = Vec::new();
        facets.meet([0.5, 0.5, -1.0], [0.5, 0.5, 3.0], |facet, part| met.push((facet, part)));
        assert_eq!(met, [(0, 0.25)]);
    }
}
