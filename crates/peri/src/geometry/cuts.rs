//! Cracks of zero width: segments and parallelograms that sever the bonds which cross them.

/// A crack of zero width that severs the bonds crossing it: a segment in 2D, a parallelogram in 3D.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut<const D: usize> {
    /// A corner.
    pub corner: [f64; D],
    /// The D − 1 edges from that corner (the last entry is unused).
    pub edges: [[f64; D]; D],
}

impl Cut<2> {
    /// A straight crack between two points.
    pub fn segment(from: [f64; 2], to: [f64; 2]) -> Self {
        Self { corner: from, edges: [[to[0] - from[0], to[1] - from[1]], [0.0; 2]] }
    }
}

impl<const D: usize> Cut<D> {
    /// Corners: two ends in 2D, four corners in 3D.
    pub fn corners(&self) -> Vec<[f64; D]> {
        self.edges.iter().take(D - 1).fold(vec![self.corner], |corners, edge| {
            let moved = corners.iter().map(|c| std::array::from_fn(|d| c[d] + edge[d]));
            corners.iter().copied().chain(moved.collect::<Vec<_>>()).collect()
        })
    }

    /// Finds the point where the segment from `a` to `b` meets the closed cut, or passes it by no more than
    /// `slack` of its length; `None` if it misses, lies along or ends on the cut.
    fn intersection(&self, a: [f64; D], b: [f64; D], slack: f64) -> Option<Intersection<D>> {
        let solution = self.passage(a, b)?;
        let size = length(std::array::from_fn::<f64, D, _>(|d| b[d] - a[d]));
        let sizes = self.edges.map(length);
        if !(NEAR..=1.0 - NEAR).contains(&solution[0]) {
            return None;
        }
        let mut meeting = Intersection { at: solution[0], rims: Vec::new(), inward: [0.0; D] };
        for edge in 0..D - 1 {
            let (place, near) = (solution[edge + 1], NEAR * size / sizes[edge]);
            let slack = slack * size / sizes[edge];
            if !(-slack..=1.0 + slack).contains(&place) {
                return None;
            }
            if !(near..=1.0 - near).contains(&place) {
                meeting.rims.push(self.edges[(D - 2) - edge]);
            }
            (0..D).for_each(|d| meeting.inward[d] += (0.5 - place) * self.edges[edge][d]);
        }
        Some(meeting)
    }

    /// Intersects the line from `a` to `b` with the plane of the cut (in 2D its line): fractions of the
    /// segment and of each edge.
    pub fn passage(&self, a: [f64; D], b: [f64; D]) -> Option<[f64; D]> {
        let mut columns = [[0.0; D]; D];
        columns[0] = std::array::from_fn(|d| b[d] - a[d]);
        (1..D).for_each(|i| columns[i] = self.edges[i - 1].map(|x| -x));
        let volume = determinant(&columns);
        if volume.abs() <= NEAR * columns.map(length).iter().product::<f64>() {
            return None;
        }
        Some(std::array::from_fn(|i| {
            let mut replaced = columns;
            replaced[i] = std::array::from_fn(|d| self.corner[d] - a[d]);
            determinant(&replaced) / volume
        }))
    }

    /// Unit normal of the cut.
    pub fn normal(&self) -> [f64; D] {
        let [a, b] = [self.edges[0], self.edges[D - 2]];
        let across: [f64; D] = match D {
            2 => std::array::from_fn(|d| if d == 0 { -a[1] } else { a[0] }),
            _ => std::array::from_fn(|d| a[(d + 1) % D] * b[(d + 2) % D] - a[(d + 2) % D] * b[(d + 1) % D]),
        };
        let size = length(across);
        across.map(|x| x / size)
    }

    /// Distance of a point from the cut, m; infinite beside its ends.
    pub fn distance(&self, point: [f64; D]) -> f64 {
        let normal = self.normal();
        let height: f64 = (0..D).map(|d| (point[d] - self.corner[d]) * normal[d]).sum();
        // a short segment along the normal meets the cut, unless the point is beside it
        let reach = self.edges.iter().take(D - 1).map(|&edge| length(edge)).fold(height.abs(), f64::max);
        let [below, above] =
            [-reach, reach].map(|way| std::array::from_fn(|d| point[d] + (way - height) * normal[d]));
        if self.intersection(below, above, NEAR).is_some() { height.abs() } else { f64::INFINITY }
    }

    /// Returns true if a segment of length `reach` from a point may meet the cut.
    pub fn is_within(&self, point: [f64; D], reach: f64) -> bool {
        let reach = reach * (1.0 + 1e-6);
        let beside = |d: usize| {
            let along = self.edges.iter().take(D - 1).map(|edge| edge[d]);
            let (low, high) =
                along.fold((self.corner[d], self.corner[d]), |(l, h), x| (l + x.min(0.0), h + x.max(0.0)));
            point[d] < low - reach || point[d] > high + reach
        };
        let normal = self.normal();
        let height: f64 = (0..D).map(|d| (point[d] - self.corner[d]) * normal[d]).sum();
        // a cut without area has no normal and no height: only its box decides
        let away = height.abs() > reach;
        !away && !(0..D).any(beside)
    }

    /// Returns true if this cut alone breaks the bond, see [`severed`].
    pub fn severs(&self, a: [f64; D], b: [f64; D]) -> bool {
        severed(std::slice::from_ref(self), a, b)
    }
}

/// Selects the cuts that bonds of length `reach` from a point may meet.
pub fn cuts_within<const D: usize>(cuts: &[Cut<D>], point: [f64; D], reach: f64) -> Vec<Cut<D>> {
    cuts.iter().filter(|cut| cut.is_within(point, reach)).copied().collect()
}

/// Fraction of a bond's length within which it counts as touching a cut's rim, or as ending on a cut.
const NEAR: f64 = 1e-9;

/// Gap between two cuts that count as connected, over a bond's length: for bonds between the spacing and the
/// horizon about a thousandth of the spacing.
const JOINED: f64 = 5e-4;

/// ‖x‖.
#[inline]
pub(crate) fn length<const D: usize>(x: [f64; D]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Determinant of two or three columns.
pub(crate) fn determinant<const D: usize>(c: &[[f64; D]; D]) -> f64 {
    let minor = |i: usize, j: usize| c[D - 2][i] * c[D - 1][j] - c[D - 2][j] * c[D - 1][i];
    if D == 2 { minor(0, 1) } else { (0..D).map(|d| c[0][d] * minor((d + 1) % 3, (d + 2) % 3)).sum() }
}

/// Intersection of a bond with a cut.
struct Intersection<const D: usize> {
    /// Fraction of the bond's length.
    at: f64,
    /// Directions of the cut's rims there (in 2D its end: any vector); none inside.
    rims: Vec<[f64; D]>,
    /// Direction from there to the cut's middle.
    inward: [f64; D],
}

/// Returns true if cuts break the bond of `a` and `b`: solves a + s(b − a) = corner + Σ wᵢ edgeᵢ and requires
/// 0 < s < 1, 0 < w < 1.
///
/// The result is the same whichever end comes first. A bond through a tip (in 3D: the rim) stays, however the
/// tip is rounded, unless another cut continues from there on the bond's other side: cuts that miss each
/// other by less than a thousandth of the spacing count as connected. A bond parallel to a cut, or that ends
/// on it, stays.
pub fn severed<const D: usize>(cuts: &[Cut<D>], a: [f64; D], b: [f64; D]) -> bool {
    let (a, b) = if a <= b { (a, b) } else { (b, a) };
    let met: Vec<Intersection<D>> = cuts.iter().filter_map(|cut| cut.intersection(a, b, JOINED)).collect();
    let side = |rim: &[f64; D], inward: &[f64; D]| {
        let mut columns = [*inward; D];
        columns[0] = std::array::from_fn(|d| b[d] - a[d]);
        if D == 3 {
            columns[1] = *rim;
        }
        let (size, volume) = (columns.map(length).iter().product::<f64>(), determinant(&columns));
        if volume.abs() > NEAR * size { volume.signum() } else { 0.0 }
    };
    met.iter().any(|one| {
        let goes_on = |rim: &[f64; D]| {
            let mut near = met.iter().filter(|other| (other.at - one.at).abs() <= JOINED);
            near.any(|other| side(rim, &one.inward) * side(rim, &other.inward) < 0.0)
        };
        one.rims.iter().all(goes_on)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two cuts that meet in a corner are one crack: a bond through the corner from one side to the other
    /// breaks, one that only touches it stays.
    #[test]
    fn cuts_that_meet_leave_no_gap() {
        let cut = |from: [f64; 2], to: [f64; 2]| Cut {
            corner: from,
            edges: [[to[0] - from[0], to[1] - from[1]], [0.0; 2]],
        };
        let straight = [cut([0.0, 0.0], [1.0, 0.0]), cut([2.0, 0.0], [1.0, 0.0])];
        let bent = [cut([0.0, 0.0], [1.0, 0.0]), cut([1.0, 0.0], [0.0, 0.7])];
        for (a, b) in [([1.0, -1.0], [1.0, 1.0]), ([0.5, -0.5], [1.5, 0.5]), ([1.5, -0.5], [0.5, 0.5])] {
            assert!(severed(&straight, a, b) && severed(&straight, b, a), "{a:?} {b:?}");
            assert!(!severed(&straight[..1], a, b), "a tip");
        }
        assert!(!severed(&bent, [1.0, -1.0], [1.0, 1.0]), "beside the corner");
        assert!(severed(&bent, [0.0, 0.2], [2.0, -0.2]), "out of the corner");
        let sheet = |edge: [f64; 3]| Cut { corner: [0.0; 3], edges: [edge, [0.0, 0.0, 1.0], [0.0; 3]] };
        let sheets = [sheet([1.0, 0.0, 0.0]), sheet([-1.0, 0.3, 0.0])];
        assert!(severed(&sheets, [0.0, 0.5, 0.5], [0.0, -0.5, 0.5]));
        assert!(!severed(&sheets[..1], [0.0, 0.5, 0.5], [0.0, -0.5, 0.5]));
        assert!(!severed(&sheets, [0.0, 0.5, 0.0], [0.0, -0.5, 0.0]), "past a rim of both");
    }

    #[test]
    fn a_cut_severs_only_what_crosses_it() {
        let crack = Cut { corner: [0.0, 0.0], edges: [[2.0, 0.0], [0.0; 2]] };
        assert!(crack.severs([1.0, -1.0], [1.5, 1.0]));
        assert!(!crack.severs([3.0, -1.0], [3.0, 1.0]), "beside it");
        assert!(!crack.severs([1.0, 0.5], [1.0, 1.0]), "above it");
        assert!(!crack.severs([-1.0, 0.0], [3.0, 0.0]), "along it");
        let plane = Cut { corner: [0.0; 3], edges: [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0; 3]] };
        assert!(plane.severs([1.0, 1.0, -1.0], [1.0, 1.0, 1.0]));
        assert!(!plane.severs([1.0, 3.0, -1.0], [1.0, 3.0, 1.0]));
    }
}
