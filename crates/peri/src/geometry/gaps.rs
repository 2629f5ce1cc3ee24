//! Gaps of a body: bonds end between parts that do not touch, and at cut-outs narrower than the horizon.
//!
//! A bond crosses a gap if its straight line
//! * passes from one added shape to another that does not touch it, or
//! * passes through the empty part of a box cut out (a disc: a flat cylinder) with its ends on opposite
//!   sides, or through a hole narrower than the horizon, or
//! * leaves closed facets (of a cut-out: enters) and meets others that are turned by 120° or more.
//!
//! Bonds around a re-entrant corner, and chords of wide holes, stay. Shapes touch if they overlap or share a
//! part of a face; points and edges do not connect them.

use super::enclosure::{FACING, dot};
use super::{Lattice, Operation, Shape, length};
use crate::bonds::CellGrid;
use std::collections::HashMap;

/// Width, over the spacing, below which a gap is closed and a face has no area.
const CLOSED: f64 = 1e-3;
/// Greatest distance of points of one part, over the edge of their cubes (in plane bodies: squares).
const JOINED: f64 = 1.5;

/// The gaps of a body.
#[derive(Clone, Debug)]
pub struct Gaps<const D: usize> {
    horizon: f64,
    /// Width of a closed gap, m.
    closed: f64,
    kind: GapKind<D>,
}

#[derive(Clone, Debug)]
enum GapKind<const D: usize> {
    /// Shapes, the pairs of them that touch: row by row; true if closed facets face each other within the
    /// horizon.
    Shapes { operations: Vec<Operation<D>>, touching: Vec<bool>, facing: bool },
    /// A lattice and the part of each of its cells.
    Cells { spacing: f64, origin: [f64; D], cells: [usize; D], parts: Vec<u32> },
    /// Points, by the bits of their positions, and their parts.
    Points { parts: HashMap<[u64; D], u32> },
}

impl<const D: usize> Gaps<D> {
    /// Finds the gaps of shapes filled with a lattice; `None` if no bond of length `horizon`, m, can cross
    /// one.
    pub fn of_shapes(operations: &[Operation<D>], lattice: &Lattice<D>, horizon: f64) -> Option<Self> {
        let closed = CLOSED * lattice.spacing;
        let adds = operations.iter().filter(|operation| matches!(operation, Operation::Add(_))).count();
        let narrow = operations.iter().any(|operation| match operation {
            Operation::Cut(shape) => shape.width() < horizon,
            Operation::Add(_) => false,
        });
        // two bodies may face each other, and a cut-out has two flanks
        let enclosed = |operation: &&Operation<D>| matches!(operation.shape(), Shape::Enclosed(_));
        let several = operations.iter().filter(enclosed).count() > 1;
        let cut = operations.iter().any(|own| enclosed(&own) && matches!(own, Operation::Cut(_)));
        let slots = || operations.iter().filter_map(Operation::enclosure).any(|body| body.has_slots(horizon));
        let facing = several || cut || slots();
        if adds < 2 && !narrow && !facing {
            return None;
        }
        let touching = vec![true; operations.len().pow(2)];
        let kind = GapKind::Shapes { operations: operations.to_vec(), touching, facing };
        let mut gaps = Self { horizon, closed, kind };
        let found: Vec<bool> = (0..operations.len().pow(2))
            .map(|pair| gaps.touch(lattice, operations, pair / operations.len(), pair % operations.len()))
            .collect();
        let parted = found.contains(&false);
        if let GapKind::Shapes { touching, .. } = &mut gaps.kind {
            *touching = found;
        }
        (narrow || parted || facing).then_some(gaps)
    }

    /// Finds the gaps between the parts of a lattice: cells that share a face, an edge or a corner belong
    /// together. `None` if there is one part.
    pub fn of_cells(lattice: &Lattice<D>) -> Option<Self> {
        let parts = connected(lattice);
        let several = parts.iter().any(|&part| part > 1);
        let Lattice { spacing, origin, cells, .. } = *lattice;
        let kind = GapKind::Cells { spacing, origin, cells, parts };
        several.then_some(Self { horizon: f64::INFINITY, closed: CLOSED * spacing, kind })
    }

    /// Finds the gaps between the parts of a cloud: points nearer than 1.5 edges of the larger of their cubes
    /// belong together. `None` if there is one part, or if parts have fewer than ten points on average, which
    /// are not cubes then.
    pub fn of_points(points: &[[f64; D]], volumes: &[f64], thickness: f64) -> Option<Self> {
        let edges: Vec<f64> = volumes.iter().map(|v| JOINED * (v / thickness).powf(1.0 / D as f64)).collect();
        let largest = edges.iter().copied().fold(0.0, f64::max);
        let grid = CellGrid::new(points, largest);
        let mut parts = vec![0; points.len()];
        let (mut count, mut front) = (0, Vec::new());
        for first in 0..points.len() {
            if parts[first] != 0 {
                continue;
            }
            count += 1;
            parts[first] = count;
            front.push(first);
            while let Some(own) = front.pop() {
                grid.near(points[own], largest, |other| {
                    let apart =
                        length(std::array::from_fn::<f64, D, _>(|d| points[other][d] - points[own][d]));
                    if parts[other] == 0 && apart <= edges[own].max(edges[other]) {
                        parts[other] = count;
                        front.push(other);
                    }
                });
            }
        }
        let parts = points.iter().zip(parts).map(|(point, part)| (point.map(f64::to_bits), part)).collect();
        let parted = count > 1 && 10 * count as usize <= points.len();
        parted.then_some(Self { horizon: f64::INFINITY, closed: 0.0, kind: GapKind::Points { parts } })
    }

    /// Selects the gaps that bonds of length `reach` from a point may meet; `None`: no gap.
    pub fn within(&self, point: [f64; D], reach: f64) -> Option<NearbyGaps<'_, D>> {
        let GapKind::Shapes { operations, touching, facing } = &self.kind else {
            return Some(NearbyGaps { gaps: self, shapes: Vec::new() });
        };
        let near = |shape: &Shape<D>| {
            let (low, high) = shape.bounds();
            let boxed = (0..D).all(|d| low[d] - reach <= point[d] && point[d] <= high[d] + reach);
            boxed && !matches!(shape, Shape::Enclosed(body) if !body.is_near(point, reach))
        };
        let count = operations.len();
        let shapes: Vec<usize> = (0..count).filter(|&index| near(operations[index].shape())).collect();
        let apart = |&a: &usize| shapes.iter().any(|&b| !touching[a * count + b]);
        let gap = shapes.iter().any(|index| match &operations[*index] {
            Operation::Add(Shape::Enclosed(body)) | Operation::Cut(Shape::Enclosed(body))
                if *facing && body.facets().is_within(point, reach) =>
            {
                true
            }
            Operation::Cut(shape) => shape.width() < self.horizon,
            Operation::Add(_) => apart(index),
        });
        gap.then_some(NearbyGaps { gaps: self, shapes })
    }

    /// Returns true if two operations add shapes that touch after all later cuts; true for other operations.
    fn touch(&self, lattice: &Lattice<D>, operations: &[Operation<D>], a: usize, b: usize) -> bool {
        let (Operation::Add(one), Operation::Add(other)) = (&operations[a], &operations[b]) else {
            return true;
        };
        if a == b || !one.touches(other, self.closed) {
            return a == b;
        }
        let enclosed = |shape: &Shape<D>| matches!(shape, Shape::Enclosed(_));
        let cut = |index: usize| matches!(operations[index], Operation::Cut(_));
        if !(enclosed(one) || enclosed(other) || (a.min(b)..operations.len()).any(cut)) {
            return true;
        }
        // a common particle, or two neighbours without a gap between them
        let (low, high) = one.bounds();
        let (from, to) = other.bounds();
        let reach = 1.5 * lattice.spacing;
        let range: [[usize; 2]; D] = std::array::from_fn(|d| {
            let place =
                |x: f64| ((x - lattice.origin[d]) / lattice.spacing).clamp(0.0, lattice.cells[d] as f64);
            [
                place(low[d].max(from[d]) - reach) as usize,
                (place(high[d].min(to[d]) + reach).ceil() as usize).min(lattice.cells[d]),
            ]
        });
        let near = NearbyGaps { gaps: self, shapes: (0..operations.len()).collect() };
        let count: usize = range.iter().map(|[low, high]| high.saturating_sub(*low)).product();
        (0..count).any(|mut index| {
            let mut cell = [0; D];
            for d in 0..D {
                let size = range[d][1] - range[d][0];
                cell[d] = range[d][0] + index % size;
                index /= size;
            }
            let here: [f64; D] =
                std::array::from_fn(|d| lattice.origin[d] + lattice.spacing * cell[d] as f64);
            let apart = matches!(other, Shape::Enclosed(body) if !body.is_near(here, 2.0 * lattice.spacing));
            !apart
                && near.belongs(a, here)
                && (near.belongs(b, here)
                    || (0..3_usize.pow(D as u32)).any(|step| {
                        let there: [f64; D] = std::array::from_fn(|d| {
                            here[d] + lattice.spacing * ((step / 3_usize.pow(d as u32) % 3) as f64 - 1.0)
                        });
                        near.belongs(b, there) && !near.leaves(here, there)
                    }))
        })
    }
}

/// The gaps near a point.
pub struct NearbyGaps<'a, const D: usize> {
    gaps: &'a Gaps<D>,
    /// Operations whose shapes are near.
    shapes: Vec<usize>,
}

impl<const D: usize> NearbyGaps<'_, D> {
    /// Returns true if the bond of `a` and `b` crosses a gap, whichever end comes first.
    pub fn severs(&self, a: [f64; D], b: [f64; D]) -> bool {
        let (a, b) = if a <= b { (a, b) } else { (b, a) };
        let (operations, touching, facing) = match &self.gaps.kind {
            GapKind::Shapes { operations, touching, facing } => (operations, touching, *facing),
            GapKind::Cells { spacing, origin, cells, parts } => {
                let part = |point: [f64; D]| {
                    let place = |d: usize| ((point[d] - origin[d]) / spacing).round() as usize;
                    parts.get((0..D).rev().fold(0, |index, d| index * cells[d] + place(d)))
                };
                return part(a) != part(b);
            }
            GapKind::Points { parts } => {
                return parts.get(&a.map(f64::to_bits)) != parts.get(&b.map(f64::to_bits));
            }
        };
        let joined = |from: &[usize], to: &[usize]| {
            from.iter().any(|&a| to.iter().any(|&b| a == b || touching[a * operations.len() + b]))
        };
        let opposed = |&index: &usize| match &operations[index] {
            Operation::Cut(shape) => shape.is_between(a, b, self.gaps.horizon),
            Operation::Add(_) => false,
        };
        let slots: Vec<usize> = self.shapes.iter().copied().filter(opposed).collect();
        let mut normals = Vec::new();
        for operation in self.shapes.iter().map(|&index| &operations[index]).filter(|_| facing) {
            let Shape::Enclosed(body) = operation.shape() else { continue };
            let known = normals.len();
            body.normals(a, b, &mut normals);
            if matches!(operation, Operation::Cut(_)) {
                // outward of the body that is left
                normals[known..].iter_mut().for_each(|(_, normal)| *normal = normal.map(|x| -x));
            }
        }
        let mut last = self.covering(a);
        let mut crosses = false;
        self.pieces(a, b, |middle, ends| {
            let covering = self.covering(middle);
            if covering.is_empty() {
                crosses |= slots.iter().any(|&slot| operations[slot].shape().contains(middle));
                crosses |= face_each_other(&normals, ends);
            } else {
                crosses |= !last.is_empty() && !joined(&last, &covering);
                last = covering;
            }
        });
        let end = self.covering(b);
        crosses || !(last.is_empty() || end.is_empty() || joined(&last, &end))
    }

    /// Returns true if the segment from `a` to `b` leaves the body.
    fn leaves(&self, a: [f64; D], b: [f64; D]) -> bool {
        let mut leaves = false;
        self.pieces(a, b, |middle, _| leaves |= self.covering(middle).is_empty());
        leaves
    }

    /// Visits the middles of the pieces into which shapes divide the segment from `a` to `b`, with the ends
    /// of each as fractions of it, except closed ones.
    fn pieces(&self, a: [f64; D], b: [f64; D], mut visit: impl FnMut([f64; D], [f64; 2])) {
        let GapKind::Shapes { operations, .. } = &self.gaps.kind else { return };
        let mut ends = vec![0.0, 1.0];
        self.shapes.iter().for_each(|&index| operations[index].shape().passages(a, b, &mut ends));
        ends.sort_by(f64::total_cmp);
        let size = length(std::array::from_fn::<f64, D, _>(|d| b[d] - a[d]));
        for pair in ends.windows(2) {
            if (pair[1] - pair[0]) * size > self.gaps.closed {
                let part = 0.5 * (pair[0] + pair[1]);
                visit(std::array::from_fn(|d| a[d] + part * (b[d] - a[d])), [pair[0], pair[1]]);
            }
        }
    }

    /// Added shapes that contain a point.
    fn covering(&self, point: [f64; D]) -> Vec<usize> {
        self.shapes.iter().copied().filter(|&index| self.belongs(index, point)).collect()
    }

    /// Returns true if an operation adds a point that no later one removes.
    fn belongs(&self, index: usize, point: [f64; D]) -> bool {
        let GapKind::Shapes { operations, .. } = &self.gaps.kind else { return false };
        let (Operation::Add(shape), later) = (&operations[index], &operations[index + 1..]) else {
            return false;
        };
        let cut = |operation: &Operation<D>| matches!(operation, Operation::Cut(cut) if cut.contains(point));
        shape.contains(point) && !later.iter().any(cut)
    }
}

/// Returns true if facets met at both ends of a piece of a segment face each other across it.
fn face_each_other<const D: usize>(normals: &[(f64, [f64; D])], [from, to]: [f64; 2]) -> bool {
    let at = |end: f64| normals.iter().filter(move |(part, _)| (part - end).abs() <= f64::EPSILON);
    at(from).any(|(_, one)| at(to).any(|(_, other)| dot(*one, *other) < FACING))
}

impl<const D: usize> Operation<D> {
    pub(super) fn shape(&self) -> &Shape<D> {
        let (Self::Add(shape) | Self::Cut(shape)) = self;
        shape
    }
}

impl<const D: usize> Shape<D> {
    /// Least width, m.
    fn width(&self) -> f64 {
        let (low, high) = self.bounds();
        (0..D).map(|d| high[d] - low[d]).fold(f64::INFINITY, f64::min)
    }

    /// Returns true if it separates two points as a slot separates its flanks, or is a hole narrower than
    /// `horizon`, m.
    fn is_between(&self, a: [f64; D], b: [f64; D], horizon: f64) -> bool {
        let (low, high) = self.bounds();
        let beyond =
            |d: usize| high[d] - low[d] < horizon && a[d].min(b[d]) <= low[d] && high[d] <= a[d].max(b[d]);
        match self {
            Self::Box { .. } => (0..D).any(beyond),
            Self::Ball { radius, .. } => 2.0 * radius < horizon,
            Self::Cylinder { radius, axis, .. } => 2.0 * radius < horizon || beyond(*axis),
            Self::Enclosed(_) => (0..D).any(beyond) || (0..D).all(|d| high[d] - low[d] < horizon),
        }
    }

    /// Adds the fractions of the segment from `a` to `b` at which it enters or leaves the shape.
    pub fn passages(&self, a: [f64; D], b: [f64; D], to: &mut Vec<f64>) {
        match self {
            Self::Enclosed(body) => body.facets().meet(a, b, |_, part| to.push(part.clamp(0.0, 1.0))),
            _ => to.extend(self.span(a, b).into_iter().flatten()),
        }
    }

    /// Fraction of the segment from `a` to `b` inside a convex shape, from 0 to 1.
    fn span(&self, a: [f64; D], b: [f64; D]) -> Option<[f64; 2]> {
        let slab = |d: usize, low: f64, high: f64| {
            let way = b[d] - a[d];
            if way == 0.0 {
                return if low <= a[d] && a[d] <= high {
                    [f64::NEG_INFINITY, f64::INFINITY]
                } else {
                    [1.0, 0.0]
                };
            }
            let [s, t] = [(low - a[d]) / way, (high - a[d]) / way];
            [s.min(t), s.max(t)]
        };
        let round = |centre: &[f64; D], radius: f64, skip: usize| {
            let [mut square, mut half, mut rest] = [0.0, 0.0, -radius * radius];
            for d in (0..D).filter(|&d| d != skip) {
                let (way, from) = (b[d] - a[d], a[d] - centre[d]);
                square += way * way;
                half += way * from;
                rest += from * from;
            }
            if square == 0.0 {
                return if rest < 0.0 { [f64::NEG_INFINITY, f64::INFINITY] } else { [1.0, 0.0] };
            }
            let root = half * half - square * rest;
            let root = if root > 0.0 { root.sqrt() } else { return [1.0, 0.0] };
            [(-half - root) / square, (-half + root) / square]
        };
        let spans: Vec<[f64; 2]> = match self {
            Self::Box { min, max } => (0..D).map(|d| slab(d, min[d], max[d])).collect(),
            Self::Ball { centre, radius } => vec![round(centre, *radius, D)],
            Self::Cylinder { centre, radius, length, axis } => {
                let middle = centre[*axis];
                vec![round(centre, *radius, *axis), slab(*axis, middle - 0.5 * length, middle + 0.5 * length)]
            }
            Self::Enclosed(_) => return None,
        };
        let joint = spans.iter().fold([0.0_f64, 1.0], |[s, t], span| [s.max(span[0]), t.min(span[1])]);
        (joint[0] < joint[1]).then_some(joint)
    }

    /// Returns true for shapes that overlap or share a part of a face, within `near`, m; for closed facets,
    /// if their boxes do.
    fn touches(&self, other: &Self, near: f64) -> bool {
        let ((low, high), (from, to)) = (self.bounds(), other.bounds());
        let common: [f64; D] = std::array::from_fn(|d| high[d].min(to[d]) - low[d].max(from[d]));
        // flat faces meet along at most one axis
        if common.iter().any(|&c| c < -near) || common.iter().filter(|&&c| c <= near).count() > 1 {
            return false;
        }
        // distance of a point from a box, along some axes
        let beside = |point: &[f64; D], low: &[f64; D], high: &[f64; D], skip: usize| {
            let each = (0..D).filter(|&d| d != skip);
            each.map(|d| (low[d] - point[d]).max(point[d] - high[d]).max(0.0).powi(2)).sum::<f64>().sqrt()
        };
        let apart = |a: &[f64; D], b: &[f64; D], skip: usize| {
            (0..D).filter(|&d| d != skip).map(|d| (a[d] - b[d]).powi(2)).sum::<f64>().sqrt()
        };
        match (self, other) {
            (Self::Box { .. }, Self::Box { .. }) | (Self::Enclosed(_), _) | (_, Self::Enclosed(_)) => true,
            (Self::Ball { centre, radius }, Self::Box { min, max })
            | (Self::Box { min, max }, Self::Ball { centre, radius }) => {
                beside(centre, min, max, D) < radius - near
            }
            (Self::Ball { centre, radius }, Self::Ball { centre: place, radius: reach }) => {
                apart(centre, place, D) < radius + reach - near
            }
            (Self::Cylinder { centre, radius, axis, .. }, Self::Box { min, max })
            | (Self::Box { min, max }, Self::Cylinder { centre, radius, axis, .. }) => {
                beside(centre, min, max, *axis) < radius - near
            }
            (
                Self::Cylinder { centre, radius, length, axis },
                Self::Ball { centre: place, radius: reach },
            )
            | (
                Self::Ball { centre: place, radius: reach },
                Self::Cylinder { centre, radius, length, axis },
            ) => {
                let along = ((place[*axis] - centre[*axis]).abs() - 0.5 * length).max(0.0);
                (apart(centre, place, *axis) - radius).max(0.0).hypot(along) < reach - near
            }
            (
                Self::Cylinder { centre, radius, axis, .. },
                Self::Cylinder { centre: place, radius: reach, axis: other, .. },
            ) => {
                if axis == other {
                    return apart(centre, place, *axis) < radius + reach - near;
                }
                // along the third axis, each is as wide as the other's length leaves it
                let third = (0..D).find(|d| d != axis && d != other).unwrap_or(0);
                let wide =
                    |centre: &[f64; D], radius: f64, across: usize, low: &[f64; D], high: &[f64; D]| {
                        let off = (low[across] - centre[across]).max(centre[across] - high[across]).max(0.0);
                        (radius * radius - off * off).max(0.0).sqrt()
                    };
                let sum = wide(centre, *radius, *other, &from, &to) + wide(place, *reach, *axis, &low, &high);
                (centre[third] - place[third]).abs() < sum - near
            }
        }
    }
}

/// Labels the part of each cell of a lattice, from 1; 0 for empty cells.
fn connected<const D: usize>(lattice: &Lattice<D>) -> Vec<u32> {
    let Lattice { cells, occupied, .. } = lattice;
    let mut parts = vec![0; occupied.len()];
    let mut count = 0;
    let mut front = Vec::new();
    for first in (0..occupied.len()).filter(|&cell| occupied[cell]) {
        if parts[first] != 0 {
            continue;
        }
        count += 1;
        parts[first] = count;
        front.push(first);
        while let Some(cell) = front.pop() {
            'steps: for step in 0..3_usize.pow(D as u32) {
                let (mut rest, mut stride, mut there) = (cell, 1, 0);
                for d in 0..D {
                    let place = rest % cells[d] + step / 3_usize.pow(d as u32) % 3;
                    if !(1..=cells[d]).contains(&place) {
                        continue 'steps;
                    }
                    there += stride * (place - 1);
                    rest /= cells[d];
                    stride *= cells[d];
                }
                if occupied[there] && parts[there] == 0 {
                    parts[there] = count;
                    front.push(there);
                }
            }
        }
    }
    parts
}
