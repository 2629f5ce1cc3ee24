//! Bodies from shapes: boxes, disks, balls, cylinders, closed surfaces, added and cut in order; cracks of
//! zero width; point clouds.

mod cuts;
mod distance;
mod enclosure;
mod facet_set;
mod facets;
mod gaps;
mod parts;

pub use cuts::{Cut, cuts_within, severed};
pub(crate) use cuts::{determinant, length};
pub use distance::{NearestFacet, SignedDistance};
pub use enclosure::{Enclosure, moments};
pub use facet_set::FacetSet;
pub use facets::{Facet, Facets};
pub use gaps::{Gaps, NearbyGaps};
pub use parts::Parts;

use crate::error::Error;
use polycore::memory::{available, gib};
use std::sync::Arc;

/// A box of cells, some of them occupied by particles.
#[derive(Clone, Debug)]
pub struct Lattice<const D: usize> {
    /// Edge of a cell, the distance of neighbouring particles, m.
    pub spacing: f64,
    /// Centre of the first cell, m.
    pub origin: [f64; D],
    /// Cells along each axis.
    pub cells: [usize; D],
    /// True for cells that hold a particle; first axis fastest.
    pub occupied: Vec<bool>,
    /// Volume of each particle, m³ (in 2D with the thickness).
    pub volume: f64,
}

impl<const D: usize> Lattice<D> {
    /// Adds empty layers beyond both sides along each axis; returns with them the cells there that repeat an
    /// occupied one: the index of each and that of the cell it repeats.
    pub(crate) fn widened(self, layers: [usize; D]) -> (Self, Vec<[usize; 2]>) {
        if layers == [0; D] {
            return (self, Vec::new());
        }
        let cells: [usize; D] = std::array::from_fn(|d| self.cells[d] + 2 * layers[d]);
        let index = |cells: [usize; D], place: [usize; D]| {
            (0..D).rev().fold(0, |index, d| index * cells[d] + place[d])
        };
        let (mut occupied, mut copies) = (vec![false; cells.iter().product()], Vec::new());
        for (own, occupied) in occupied.iter_mut().enumerate() {
            let place = cell(own, cells);
            let inner = |d: usize| {
                let from_first = place[d] as isize - layers[d] as isize;
                from_first.rem_euclid(self.cells[d] as isize) as usize
            };
            let repeated: [usize; D] = std::array::from_fn(inner);
            if self.occupied[index(self.cells, repeated)] {
                let origin = index(cells, std::array::from_fn(|d| repeated[d] + layers[d]));
                *occupied = origin == own;
                if origin != own {
                    copies.push([own, origin]);
                }
            }
        }
        let origin = std::array::from_fn(|d| self.origin[d] - self.spacing * layers[d] as f64);
        (Self { origin, cells, occupied, ..self }, copies)
    }
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
    /// Body inside closed facets, facets included.
    Enclosed(Arc<Enclosure<D>>),
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
    /// Returns true if the open interior contains a point. Points on a box's face belong to the box.
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
            Self::Enclosed(body) => body.contains(point),
        }
    }

    /// Bounding box as (lower corner, upper corner).
    pub fn bounds(&self) -> ([f64; D], [f64; D]) {
        match self {
            Self::Box { min, max } => (*min, *max),
            Self::Ball { centre, radius } => (centre.map(|c| c - radius), centre.map(|c| c + radius)),
            Self::Cylinder { centre, radius, length, axis } => {
                let half = |d: usize| if d == *axis { 0.5 * length } else { *radius };
                (std::array::from_fn(|d| centre[d] - half(d)), std::array::from_fn(|d| centre[d] + half(d)))
            }
            Self::Enclosed(body) => body.facets().bounds(),
        }
    }
}

/// An operation that adds or removes a shape.
#[derive(Clone, Debug, PartialEq)]
pub enum Operation<const D: usize> {
    /// Union with the shape.
    Add(Shape<D>),
    /// Difference with the shape.
    Cut(Shape<D>),
}

impl<const D: usize> Operation<D> {
    /// Returns the closed facets that it adds.
    pub fn enclosure(&self) -> Option<&Enclosure<D>> {
        if let Self::Add(Shape::Enclosed(body)) = self { Some(body) } else { None }
    }
}

/// Returns true if a point belongs to the body built by a list of operations.
pub fn inside<const D: usize>(operations: &[Operation<D>], point: [f64; D]) -> bool {
    operations.iter().fold(false, |inside, operation| match operation {
        Operation::Add(shape) => inside || shape.contains(point),
        Operation::Cut(shape) => inside && !shape.contains(point),
    })
}

/// Bounding box of all added shapes; `None` if nothing is added.
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

/// Cells along each axis of a lattice of `spacing` over a box, as real numbers: they may exceed integers.
pub fn cell_counts<const D: usize>(low: [f64; D], high: [f64; D], spacing: f64) -> [f64; D] {
    std::array::from_fn(|d| ((high[d] - low[d]) / spacing).round().max(1.0))
}

/// Builds the lattice of cells whose centres lie inside the body. Cells are centred: the first centre lies
/// half a spacing inside the lower corner of the bounding box.
///
/// # Errors
/// [`Error::Geometry`] if the spacing is not positive, nothing is added, no centre is inside, or the cells
/// exceed 2·10⁹ or the available memory, before any is allocated.
pub fn lattice<const D: usize>(
    operations: &[Operation<D>],
    spacing: f64,
    thickness: f64,
) -> Result<Lattice<D>, Error> {
    if !(spacing > 0.0 && spacing.is_finite()) {
        return Err(Error::geometry(format!("spacing: found {spacing} m; allowed: above 0, finite")));
    }
    let (low, high) = bounds(operations).ok_or_else(|| Error::geometry("no shape is added".to_owned()))?;
    let counts = cell_counts(low, high, spacing);
    let count: f64 = counts.iter().product();
    refuse_too_large(spacing, [count, MOST_CELLS], count)?;
    let cells = counts.map(|c| c as usize);
    // the box keeps its centre if its edges are no multiples of the spacing
    let origin: [f64; D] =
        std::array::from_fn(|d| 0.5 * (low[d] + high[d]) - 0.5 * spacing * (cells[d] - 1) as f64);
    let total: usize = cells.iter().product();
    let occupied: Vec<bool> = (0..total)
        .map(|index| {
            let cell = cell(index, cells);
            inside(operations, std::array::from_fn(|d| origin[d] + spacing * cell[d] as f64))
        })
        .collect();
    if !occupied.contains(&true) {
        return Err(Error::geometry(format!(
            "no particle of a lattice with spacing {spacing} m lies inside the body"
        )));
    }
    Ok(Lattice { spacing, origin, cells, occupied, volume: spacing.powi(D as i32) * thickness })
}

/// Returns the cell along each axis of an index into cells of which the first axis varies fastest.
pub(crate) fn cell<const D: usize>(mut index: usize, cells: [usize; D]) -> [usize; D] {
    cells.map(|count| {
        let cell = index % count;
        index /= count;
        cell
    })
}

/// Largest number of cells of a body, whatever the memory: sites are counted in 32 bits.
pub const MOST_CELLS: f64 = 2e9;

/// Refuses a body before any of it is allocated.
///
/// # Errors
/// [`Error::Geometry`] with the number of cells and the bytes that they need.
pub(crate) fn refuse_too_large(spacing: f64, [cells, most]: [f64; 2], bytes: f64) -> Result<(), Error> {
    let available = available();
    if cells <= most && bytes <= available {
        return Ok(());
    }
    Err(Error::geometry(format!(
        "spacing: found {spacing} m, with which the body has {cells:.3e} cells that need at least {}; \
        allowed: at most {most:.0e} \
         cells and {} (the available memory)",
        gib(bytes),
        gib(available)
    )))
}

/// Recognises the regular lattice of points of one volume; `None` if there is none.
///
/// The spacing is the edge of a particle's cube (square in plane bodies). Every coordinate must be within
/// 1e-9 spacings of the lattice, no cell may hold two points, and along every axis at least half of the
/// points must have a next neighbour.
pub fn recognise<const D: usize>(points: &[[f64; D]], volumes: &[f64], thickness: f64) -> Option<Lattice<D>> {
    let volume = *volumes.first()?;
    if volumes.iter().any(|&v| v != volume) {
        return None;
    }
    let spacing = (volume / thickness).powf(1.0 / D as f64);
    let [low, high] = polycore::numerics::bounds(points.iter().copied());
    let extent: [f64; D] = std::array::from_fn(|d| ((high[d] - low[d]) / spacing).round() + 1.0);
    // a sparse box would waste more than a neighbour list; a spacing of 0 makes the extent NaN
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
}
