//! Bodies from shapes: boxes, disks, balls, cylinders, added and cut in order; cracks of zero width; point clouds.

use crate::error::Error;

/// Where particles sit: a box of cells, some of them occupied.
#[derive(Clone, Debug)]
pub struct Lattice<const D: usize> {
    /// Edge of a cell = distance of neighbouring particles, m.
    pub spacing: f64,
    /// Centre of the first cell, m.
    pub origin: [f64; D],
    /// Cells along each axis.
    pub cells: [usize; D],
    /// Which cells hold a particle; first axis fastest.
    pub occupied: Vec<bool>,
    /// Volume of each particle, m³ (in 2D with the thickness).
    pub volume: f64,
}

/// A solid region of dimension `D`; lengths in m.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape<const D: usize> {
    /// Axis-parallel box, edges included.
    Box {
        /// Lower corner.
        min: [f64; D],
        /// Upper corner.
        max: [f64; D],
    },
    /// Disk (2D) or ball (3D).
    Ball {
        /// Centre.
        centre: [f64; D],
        /// Radius.
        radius: f64,
    },
    /// Cylinder of finite length along one axis.
    Cylinder {
        /// Centre of the axis.
        centre: [f64; D],
        /// Radius.
        radius: f64,
        /// Length along the axis.
        length: f64,
        /// The axis' index.
        axis: usize,
    },
}

impl Shape<2> {
    /// A rectangle between two corners.
    pub fn rectangle(min: [f64; 2], max: [f64; 2]) -> Self {
        Self::Box { min, max }
    }

    /// A disk.
    pub fn disk(centre: [f64; 2], radius: f64) -> Self {
        Self::Ball { centre, radius }
    }
}

impl Shape<3> {
    /// A cuboid between two corners.
    pub fn cuboid(min: [f64; 3], max: [f64; 3]) -> Self {
        Self::Box { min, max }
    }

    /// A ball.
    pub fn ball(centre: [f64; 3], radius: f64) -> Self {
        Self::Ball { centre, radius }
    }
}

impl<const D: usize> Shape<D> {
    /// Whether the open interior contains a point. Points on a box's face belong to the box.
    pub fn contains(&self, point: [f64; D]) -> bool {
        match self {
            Self::Box { min, max } => (0..D).all(|d| min[d] <= point[d] && point[d] <= max[d]),
            Self::Ball { centre, radius } => {
                (0..D).map(|d| (point[d] - centre[d]).powi(2)).sum::<f64>() < radius * radius
            }
            Self::Cylinder { centre, radius, length, axis } => {
                let radial: f64 = (0..D).filter(|d| d != axis).map(|d| (point[d] - centre[d]).powi(2)).sum();
                radial < radius * radius && 2.0 * (point[*axis] - centre[*axis]).abs() <= *length
            }
        }
    }

    /// Smallest box around it, as (lower corner, upper corner).
    pub fn bounds(&self) -> ([f64; D], [f64; D]) {
        match self {
            Self::Box { min, max } => (*min, *max),
            Self::Ball { centre, radius } => (centre.map(|c| c - radius), centre.map(|c| c + radius)),
            Self::Cylinder { centre, radius, length, axis } => {
                let half = |d: usize| if d == *axis { 0.5 * length } else { *radius };
                (std::array::from_fn(|d| centre[d] - half(d)), std::array::from_fn(|d| centre[d] + half(d)))
            }
        }
    }
}

/// A shape put on or taken away.
#[derive(Clone, Debug, PartialEq)]
pub enum Operation<const D: usize> {
    /// Union with the shape.
    Add(Shape<D>),
    /// Difference with the shape.
    Cut(Shape<D>),
}

/// Whether a point belongs to the body that a list of operations builds.
pub fn inside<const D: usize>(operations: &[Operation<D>], point: [f64; D]) -> bool {
    operations.iter().fold(false, |inside, operation| match operation {
        Operation::Add(shape) => inside || shape.contains(point),
        Operation::Cut(shape) => inside && !shape.contains(point),
    })
}

/// Smallest box around all added shapes; `None` where nothing is added.
pub fn bounds<const D: usize>(operations: &[Operation<D>]) -> Option<([f64; D], [f64; D])> {
    operations
        .iter()
        .filter_map(|operation| match operation {
            Operation::Add(shape) => Some(shape.bounds()),
            Operation::Cut(_) => None,
        })
        .reduce(|(low, high), (l, h)| {
            (std::array::from_fn(|d| low[d].min(l[d])), std::array::from_fn(|d| high[d].max(h[d])))
        })
}

/// Cells along each axis of a lattice of `spacing` over a box, as real numbers: they may be too many to count.
pub fn cell_counts<const D: usize>(low: [f64; D], high: [f64; D], spacing: f64) -> [f64; D] {
    std::array::from_fn(|d| ((high[d] - low[d]) / spacing).round().max(1.0))
}

/// The lattice of cells whose centres lie inside the body. Cells are centred: the first centre lies half a spacing
/// inside the lower corner of the bounding box.
///
/// # Errors
/// [`Error::Geometry`] where the spacing is not positive, nothing is added or no centre is inside.
pub fn lattice<const D: usize>(
    operations: &[Operation<D>],
    spacing: f64,
    thickness: f64,
) -> Result<Lattice<D>, Error> {
    if !(spacing > 0.0 && spacing.is_finite()) {
        return Err(Error::geometry(format!("spacing: found {spacing} m; allowed: above 0, finite")));
    }
    let (low, high) = bounds(operations).ok_or_else(|| Error::geometry("no shape is added".to_owned()))?;
    let cells = cell_counts(low, high, spacing).map(|c| c as usize);
    // the box keeps its centre where its edges are no multiple of the spacing
    let origin: [f64; D] =
        std::array::from_fn(|d| 0.5 * (low[d] + high[d]) - 0.5 * spacing * (cells[d] - 1) as f64);
    let total: usize = cells.iter().product();
    let occupied: Vec<bool> = (0..total)
        .map(|index| {
            let mut rest = index;
            let centre = std::array::from_fn(|d| {
                let cell = rest % cells[d];
                rest /= cells[d];
                origin[d] + spacing * cell as f64
            });
            inside(operations, centre)
        })
        .collect();
    if !occupied.contains(&true) {
        return Err(Error::geometry(format!(
            "no particle of a lattice with spacing {spacing} m lies inside the body"
        )));
    }
    Ok(Lattice { spacing, origin, cells, occupied, volume: spacing.powi(D as i32) * thickness })
}

/// The regular lattice that points of one volume lie on; `None` where they lie on none.
///
/// The spacing is the edge of a particle's cube (plane bodies: square). Every coordinate must be within 1e-9 spacings of
/// the lattice, no cell may hold two points, and along every axis at least half of the points have a next neighbour.
pub fn recognise<const D: usize>(points: &[[f64; D]], volumes: &[f64], thickness: f64) -> Option<Lattice<D>> {
    let volume = *volumes.first()?;
    if volumes.iter().any(|&v| v != volume) {
        return None;
    }
    let spacing = (volume / thickness).powf(1.0 / D as f64);
    let low: [f64; D] = std::array::from_fn(|d| points.iter().map(|p| p[d]).fold(f64::INFINITY, f64::min));
    let high: [f64; D] =
        std::array::from_fn(|d| points.iter().map(|p| p[d]).fold(f64::NEG_INFINITY, f64::max));
    let extent: [f64; D] = std::array::from_fn(|d| ((high[d] - low[d]) / spacing).round() + 1.0);
    // a sparse box would waste more than a neighbour list; of a spacing of 0 the extent is not a number
    let sparse = extent.iter().product::<f64>() > 8.0 * points.len() as f64;
    if sparse || !extent.iter().all(|e| e.is_finite()) {
        return None;
    }
    let cells = extent.map(|e| e as usize);
    let mut occupied = vec![false; cells.iter().product()];
    let mut places = Vec::with_capacity(points.len());
    for point in points {
        let mut index = 0;
        for d in (0..D).rev() {
            let place = (point[d] - low[d]) / spacing;
            if (place - place.round()).abs() > 1e-9 {
                return None;
            }
            index = index * cells[d] + place.round() as usize;
        }
        if std::mem::replace(&mut occupied[index], true) {
            return None;
        }
        places.push(index);
    }
    let mut stride = 1;
    for d in 0..D {
        let next = |&index: &usize| index / stride % cells[d] + 1 < cells[d] && occupied[index + stride];
        if cells[d] > 1 && 2 * places.iter().copied().filter(next).count() < points.len() {
            return None;
        }
        stride *= cells[d];
    }
    Some(Lattice { spacing, origin: low, cells, occupied, volume })
}

/// A crack of zero width that severs the bonds crossing it: a segment in 2D, a parallelogram in 3D.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut<const D: usize> {
    /// One corner.
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
    /// Its two ends in 2D, its four corners in 3D.
    pub fn corners(&self) -> Vec<[f64; D]> {
        self.edges.iter().take(D - 1).fold(vec![self.corner], |corners, edge| {
            let moved = corners.iter().map(|c| std::array::from_fn(|d| c[d] + edge[d]));
            corners.iter().copied().chain(moved.collect::<Vec<_>>()).collect()
        })
    }

    /// Where the segment from `a` to `b` meets the closed cut; `None` where it does not, lies along it or ends on it.
    fn meets(&self, a: [f64; D], b: [f64; D]) -> Option<Meeting<D>> {
        let mut columns = [[0.0; D]; D];
        columns[0] = std::array::from_fn(|d| b[d] - a[d]);
        (1..D).for_each(|i| columns[i] = self.edges[i - 1].map(|x| -x));
        let sizes = columns.map(length);
        let volume = determinant(&columns);
        if volume.abs() <= NEAR * sizes.iter().product::<f64>() {
            return None;
        }
        let solution: [f64; D] = std::array::from_fn(|i| {
            let mut replaced = columns;
            replaced[i] = std::array::from_fn(|d| self.corner[d] - a[d]);
            determinant(&replaced) / volume
        });
        if !(NEAR..=1.0 - NEAR).contains(&solution[0]) {
            return None;
        }
        let mut meeting = Meeting { at: solution[0], rims: Vec::new(), inward: [0.0; D] };
        for edge in 0..D - 1 {
            let (place, near) = (solution[edge + 1], NEAR * sizes[0] / sizes[edge + 1]);
            if !(-near..=1.0 + near).contains(&place) {
                return None;
            }
            if !(near..=1.0 - near).contains(&place) {
                meeting.rims.push(self.edges[(D - 2) - edge]);
            }
            (0..D).for_each(|d| meeting.inward[d] += (0.5 - place) * self.edges[edge][d]);
        }
        Some(meeting)
    }

    /// A vector of length 1 across it.
    pub fn normal(&self) -> [f64; D] {
        let [a, b] = [self.edges[0], self.edges[D - 2]];
        let across: [f64; D] = match D {
            2 => std::array::from_fn(|d| if d == 0 { -a[1] } else { a[0] }),
            _ => std::array::from_fn(|d| a[(d + 1) % D] * b[(d + 2) % D] - a[(d + 2) % D] * b[(d + 1) % D]),
        };
        let size = length(across);
        across.map(|x| x / size)
    }

    /// Distance of a point from it, m; infinite beside its ends.
    pub fn distance(&self, point: [f64; D]) -> f64 {
        let normal = self.normal();
        let height: f64 = (0..D).map(|d| (point[d] - self.corner[d]) * normal[d]).sum();
        // a short way through it meets it, unless it passes beside
        let reach = self.edges.iter().take(D - 1).map(|&edge| length(edge)).fold(height.abs(), f64::max);
        let [below, above] =
            [-reach, reach].map(|way| std::array::from_fn(|d| point[d] + (way - height) * normal[d]));
        if self.meets(below, above).is_some() { height.abs() } else { f64::INFINITY }
    }

    /// Whether a way of length `reach` from a point may meet it.
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
        // a cut without area has no normal, and no height: near as far as its box tells
        let away = height.abs() > reach;
        !away && !(0..D).any(beside)
    }

    /// [`severed`] by this cut alone.
    pub fn severs(&self, a: [f64; D], b: [f64; D]) -> bool {
        severed(std::slice::from_ref(self), a, b)
    }
}

/// The cuts that bonds of length `reach` from a point may meet.
pub fn cuts_within<const D: usize>(cuts: &[Cut<D>], point: [f64; D], reach: f64) -> Vec<Cut<D>> {
    cuts.iter().filter(|cut| cut.is_within(point, reach)).copied().collect()
}

/// Part of a bond's length within which it counts as touching a cut's rim, or as ending on a cut.
const NEAR: f64 = 1e-9;

/// ‖x‖.
#[inline]
pub(crate) fn length<const D: usize>(x: [f64; D]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Of two or three columns.
fn determinant<const D: usize>(c: &[[f64; D]; D]) -> f64 {
    let minor = |i: usize, j: usize| c[D - 2][i] * c[D - 1][j] - c[D - 2][j] * c[D - 1][i];
    if D == 2 { minor(0, 1) } else { (0..D).map(|d| c[0][d] * minor((d + 1) % 3, (d + 2) % 3)).sum() }
}

/// Where a bond meets a cut.
struct Meeting<const D: usize> {
    /// Part of the bond's length.
    at: f64,
    /// Directions of the cut's rims there (in 2D its end: any vector); none inside.
    rims: Vec<[f64; D]>,
    /// From there towards the cut's middle.
    inward: [f64; D],
}

/// Whether cuts break the bond of `a` and `b`: solves a + s(b − a) = corner + Σ wᵢ edgeᵢ and asks for 0 < s < 1, 0 < w < 1.
///
/// The answer is one for the pair, whichever end comes first. A bond through a tip (in 3D: the rim) stays, however the
/// tip is rounded, unless another cut continues from there on the bond's other side. A bond parallel to a cut, or that ends
/// on it, stays.
pub fn severed<const D: usize>(cuts: &[Cut<D>], a: [f64; D], b: [f64; D]) -> bool {
    let (a, b) = if a <= b { (a, b) } else { (b, a) };
    let met: Vec<Meeting<D>> = cuts.iter().filter_map(|cut| cut.meets(a, b)).collect();
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
            let mut near = met.iter().filter(|other| (other.at - one.at).abs() <= NEAR);
            near.any(|other| side(rim, &one.inward) * side(rim, &other.inward) < 0.0)
        };
        one.rims.iter().all(goes_on)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn operations_apply_in_order() {
        let outer = Shape::Box { min: [0.0, 0.0], max: [4.0, 4.0] };
        let hole = Shape::Ball { centre: [2.0, 2.0], radius: 1.0 };
        let body = [Operation::Add(outer), Operation::Cut(hole.clone())];
        assert!(inside(&body, [0.5, 0.5]) && !inside(&body, [2.0, 2.5]) && inside(&body, [3.0, 2.0]));
        let refilled = [body[0].clone(), body[1].clone(), Operation::Add(hole)];
        assert!(inside(&refilled, [2.0, 2.5]));
    }

    #[test]
    fn cells_are_centred_in_the_box() {
        let body = [Operation::Add(Shape::Box { min: [-5.0, 0.0], max: [5.0, 2.0] })];
        let lattice = lattice(&body, 1.0, 0.5).unwrap();
        assert_eq!(lattice.cells, [10, 2]);
        assert_eq!(lattice.origin, [-4.5, 0.5]);
        assert_eq!(lattice.volume, 0.5);
        assert!(lattice.occupied.iter().all(|&o| o));
    }

    #[test]
    fn regular_points_are_a_lattice() {
        let points: Vec<[f64; 2]> = (0..20)
            .filter(|i| *i != 7)
            .map(|i| [0.3 + 0.1 * f64::from(i % 5), -0.2 + 0.1 * f64::from(i / 5)])
            .collect();
        let volumes = vec![0.1 * 0.1 * 0.5; 19];
        let lattice = recognise(&points, &volumes, 0.5).unwrap();
        assert_eq!(lattice.cells, [5, 4]);
        assert!((lattice.spacing - 0.1).abs() < 1e-15 && !lattice.occupied[7] && lattice.occupied[19]);
        let mut moved = points.clone();
        moved[3][0] += 1e-6;
        assert!(recognise(&moved, &volumes, 0.5).is_none(), "off the lattice");
        moved[3] = points[4];
        assert!(recognise(&moved, &volumes, 0.5).is_none(), "two in one cell");
        let mut uneven = volumes.clone();
        uneven[5] *= 2.0;
        assert!(recognise(&points, &uneven, 0.5).is_none(), "unequal volumes");
        let apart: Vec<[f64; 2]> = points.iter().map(|p| p.map(|x| 2.0 * x)).collect();
        assert!(recognise(&apart, &volumes, 0.5).is_none(), "no next neighbours");
        let row = [[0.0, 0.0], [1.0, 0.0]];
        assert!(recognise(&row, &[1e-30; 2], 1e300).is_none(), "a spacing that underflows to 0");
    }

    #[test]
    fn a_cylinder_stops_at_its_ends() {
        let bar = Shape::Cylinder { centre: [0.0; 3], radius: 1.0, length: 4.0, axis: 0 };
        assert!(
            bar.contains([2.0, 0.0, 0.9]) && !bar.contains([2.1, 0.0, 0.0]) && !bar.contains([0.0, 0.8, 0.8])
        );
        assert_eq!(bar.bounds(), ([-2.0, -1.0, -1.0], [2.0, 1.0, 1.0]));
    }

    /// Two cuts that meet in a corner are one crack: what passes through the corner from one side to the other goes,
    /// what only touches it stays.
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
