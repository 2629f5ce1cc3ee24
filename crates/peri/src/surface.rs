//! Surface of a body as face points, about one for each particle on it: rigid planes act there.

use crate::bonds::{BodyGeometry, LatticeBonds};
use crate::geometry::{Operation, Shape, bounds, cell, cell_counts, inside, length};
use std::collections::HashSet;
use std::f64::consts::{PI, TAU};

/// Distance from a surface, in spacings, at which a point counts as on one side of it.
const SIDE: f64 = 0.01;

/// A point of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceFace<const D: usize> {
    /// Reference position, m.
    pub place: [f64; D],
    /// Outward unit normal.
    pub normal: [f64; D],
    /// Number of the face's patch.
    pub patch: u32,
}

/// A smooth part of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Patch<const D: usize> {
    /// Faces with normals along an axis.
    Flat { axis: usize, outward: f64 },
    /// Part of a circle, a sphere, or a circular cylinder along `axis`; `outward` is −1 for the wall of a
    /// hole.
    Round { centre: [f64; D], radius: f64, axis: Option<usize>, outward: f64 },
}

impl<const D: usize> Patch<D> {
    /// Vector from the axis or centre of a round patch to a point, m.
    fn radial(centre: &[f64; D], axis: Option<usize>, point: [f64; D]) -> [f64; D] {
        std::array::from_fn(|d| if Some(d) == axis { 0.0 } else { point[d] - centre[d] })
    }

    /// Distance along the surface between a face and the point of the surface above a particle, and depth of
    /// the particle, m.
    fn reach(&self, face: &SurfaceFace<D>, point: [f64; D]) -> (f64, f64) {
        match *self {
            Self::Flat { axis, outward } => {
                let aside: f64 =
                    (0..D).filter(|&d| d != axis).map(|d| (point[d] - face.place[d]).powi(2)).sum();
                (aside.sqrt(), outward * (face.place[axis] - point[axis]))
            }
            Self::Round { centre, radius, axis, outward } => {
                let from = Self::radial(&centre, axis, point);
                let size = length(from);
                let above: [f64; D] = std::array::from_fn(|d| {
                    let along = if Some(d) == axis { point[d] } else { centre[d] };
                    along + if size > 0.0 { from[d] * radius / size } else { 0.0 }
                });
                (
                    length(std::array::from_fn::<f64, D, _>(|d| above[d] - face.place[d])),
                    outward * (radius - size),
                )
            }
        }
    }
}

/// Face points and their patches.
#[derive(Clone, Debug, Default)]
pub struct BodySurface<const D: usize> {
    faces: Vec<SurfaceFace<D>>,
    patches: Vec<Patch<D>>,
    /// Number of faces, at the end of the list, that only bound the region below the others.
    bounds: usize,
}

impl<const D: usize> BodySurface<D> {
    /// Samples the boundary of shapes: flat sides above the columns of the lattice, round ones at equal arcs
    /// of about `spacing`, m; of bodies with closed facets the free sides of the cells inside.
    pub fn of_shapes(operations: &[Operation<D>], spacing: f64) -> Self {
        let mut surface = Self { faces: Vec::new(), patches: Vec::new(), bounds: 0 };
        let Some((low, high)) = bounds(operations) else { return surface };
        let counts = cell_counts(low, high, spacing);
        let origin = std::array::from_fn(|d| 0.5 * (low[d] + high[d]) - 0.5 * spacing * (counts[d] - 1.0));
        let columns = CellColumns { origin, counts: counts.map(|count| count as usize), spacing };
        let is_enclosed = |operation: &Operation<D>| {
            let (Operation::Add(shape) | Operation::Cut(shape)) = operation;
            matches!(shape, Shape::Enclosed(_))
        };
        if operations.iter().any(is_enclosed) {
            return Self::of_cells(operations, &columns);
        }
        for operation in operations {
            let (shape, outward) = match operation {
                Operation::Add(shape) => (shape, 1.0),
                Operation::Cut(shape) => (shape, -1.0),
            };
            surface.sample(shape, outward, &columns);
        }
        let side = |face: &SurfaceFace<D>, sign: f64| {
            let place = std::array::from_fn(|d| face.place[d] + sign * SIDE * spacing * face.normal[d]);
            inside(operations, place)
        };
        // sides of two shapes may lie in one plane
        let mut known = HashSet::new();
        let mut is_new = |face: &SurfaceFace<D>| known.insert((face.patch, face.place.map(f64::to_bits)));
        surface.faces.retain(|face| side(face, -1.0) && !side(face, 1.0) && is_new(face));
        surface
    }

    /// Takes the free sides of the cells whose centres lie inside: closed facets have no smooth patches.
    fn of_cells(operations: &[Operation<D>], columns: &CellColumns<D>) -> Self {
        let patches = Self::axes();
        let mut faces = Vec::new();
        for index in 0..columns.counts.iter().product() {
            let cell = cell(index, columns.counts);
            let place: [f64; D] = std::array::from_fn(|d| columns.coordinate(d, cell[d]));
            if !inside(operations, place) {
                continue;
            }
            for (patch, kind) in patches.iter().enumerate() {
                let Patch::Flat { axis, outward } = *kind else { continue };
                let (mut beside, mut face) = (place, place);
                beside[axis] += outward * columns.spacing;
                face[axis] += 0.5 * outward * columns.spacing;
                if !inside(operations, beside) {
                    let normal = std::array::from_fn(|d| if d == axis { outward } else { 0.0 });
                    faces.push(SurfaceFace { place: face, normal, patch: patch as u32 });
                }
            }
        }
        Self { faces, patches, bounds: 0 }
    }

    /// Takes the free sides of the cells of a lattice.
    pub fn of_lattice(lattice: &LatticeBonds<D>) -> Self {
        let patches = Self::axes();
        let mut occupied = vec![false; lattice.sites()];
        lattice.particles().iter().for_each(|&site| occupied[site as usize] = true);
        let mut faces = Vec::new();
        for &site in lattice.particles() {
            for (patch, kind) in patches.iter().enumerate() {
                let Patch::Flat { axis, outward } = *kind else { continue };
                let offset = std::array::from_fn(|d| if d == axis { outward as i32 } else { 0 });
                let beside = (site as usize).checked_add_signed(lattice.shift(offset));
                if beside.and_then(|beside| occupied.get(beside)).is_some_and(|&occupied| occupied) {
                    continue;
                }
                let mut place = lattice.position(site as usize);
                place[axis] += 0.5 * outward * lattice.spacing();
                let normal = std::array::from_fn(|d| if d == axis { outward } else { 0.0 });
                faces.push(SurfaceFace { place, normal, patch: patch as u32 });
            }
        }
        Self { faces, patches, bounds: 0 }
    }

    /// Collects flat sides whose patches are those of [`Self::of_lattice`]: 2d and 2d + 1 for the normals
    /// along −d and d.
    pub(crate) fn of_sides(faces: Vec<SurfaceFace<D>>) -> Self {
        Self { faces, patches: Self::axes(), bounds: 0 }
    }

    /// Adds the faces of another surface of the same body, on the other side of the region below these.
    pub fn bounded_by(mut self, other: &Self) -> Self {
        let shift = self.patches.len() as u32;
        self.patches.extend(&other.patches);
        let own = other.faces.len() - other.bounds;
        self.faces
            .extend(other.faces[..own].iter().map(|face| SurfaceFace { patch: face.patch + shift, ..*face }));
        self.bounds += own;
        self
    }

    /// Returns true for a face, by its number, that only bounds the region below the others.
    pub fn is_bound(&self, face: usize) -> bool {
        face + self.bounds >= self.faces.len()
    }

    fn axes() -> Vec<Patch<D>> {
        (0..2 * D).map(|k| Patch::Flat { axis: k / 2, outward: [-1.0, 1.0][k % 2] }).collect()
    }

    /// The face points.
    pub fn faces(&self) -> &[SurfaceFace<D>] {
        &self.faces
    }

    /// Distance along the surface between a face and the point of the surface above a particle, and depth of
    /// the particle, m.
    pub fn reach(&self, face: &SurfaceFace<D>, point: [f64; D]) -> (f64, f64) {
        self.patches[face.patch as usize].reach(face, point)
    }

    fn patch(&mut self, patch: Patch<D>) -> u32 {
        let known = self.patches.iter().position(|other| *other == patch);
        let number = known.unwrap_or(self.patches.len());
        if known.is_none() {
            self.patches.push(patch);
        }
        number as u32
    }

    /// Adds face points on all sides of a shape.
    fn sample(&mut self, shape: &Shape<D>, outward: f64, columns: &CellColumns<D>) {
        match *shape {
            Shape::Box { min, max } => {
                for axis in 0..D {
                    self.flat(shape, axis, (min[axis], max[axis]), outward, columns);
                }
            }
            Shape::Ball { centre, radius } => {
                let patch = self.patch(Patch::Round { centre, radius, axis: None, outward });
                let rings = if D == 2 { 1 } else { around(PI * radius, columns.spacing) };
                for ring in 0..rings {
                    let polar = PI * (ring as f64 + 0.5) / rings as f64;
                    let (across, along) = if D == 2 { (1.0, 0.0) } else { polar.sin_cos() };
                    let count = around(TAU * radius * across, columns.spacing);
                    self.ring(patch, count, outward, |cos, sin| {
                        let normal = std::array::from_fn(|d| [across * cos, across * sin, along][d]);
                        (normal, std::array::from_fn(|d| centre[d] + radius * normal[d]))
                    });
                }
            }
            Shape::Cylinder { centre, radius, length, axis } => {
                let ends = (centre[axis] - 0.5 * length, centre[axis] + 0.5 * length);
                self.flat(shape, axis, ends, outward, columns);
                let patch = self.patch(Patch::Round { centre, radius, axis: Some(axis), outward });
                let count = around(TAU * radius, columns.spacing);
                for layer in (0..columns.counts[axis]).map(|k| columns.coordinate(axis, k)) {
                    if layer <= ends.0 || layer >= ends.1 {
                        continue;
                    }
                    self.ring(patch, count, outward, |cos, sin| {
                        let mut normal = [0.0; D];
                        (normal[(axis + 1) % D], normal[(axis + 2) % D]) = (cos, sin);
                        let mut place = std::array::from_fn(|d| centre[d] + radius * normal[d]);
                        place[axis] = layer;
                        (normal, place)
                    });
                }
            }
            Shape::Enclosed(_) => {}
        }
    }

    /// Adds `count` points of a ring, given by normal and position of each direction.
    fn ring(
        &mut self,
        patch: u32,
        count: usize,
        outward: f64,
        at: impl Fn(f64, f64) -> ([f64; D], [f64; D]),
    ) {
        for k in 0..count {
            let (sin, cos) = (TAU * (k as f64 + 0.5) / count as f64).sin_cos();
            let (normal, place) = at(cos, sin);
            self.faces.push(SurfaceFace { place, normal: normal.map(|n| outward * n), patch });
        }
    }

    /// Adds the points of both flat sides of a shape across an axis, above the columns of the lattice.
    fn flat(
        &mut self,
        shape: &Shape<D>,
        axis: usize,
        ends: (f64, f64),
        outward: f64,
        columns: &CellColumns<D>,
    ) {
        let middle = 0.5 * (ends.0 + ends.1);
        for (end, sign) in [(ends.0, -outward), (ends.1, outward)] {
            let patch = self.patch(Patch::Flat { axis, outward: sign });
            let across: usize = (0..D).filter(|&d| d != axis).map(|d| columns.counts[d]).product();
            for index in 0..across {
                let mut rest = index;
                let mut place = std::array::from_fn(|d| {
                    if d == axis {
                        return middle;
                    }
                    let cell = rest % columns.counts[d];
                    rest /= columns.counts[d];
                    columns.coordinate(d, cell)
                });
                if shape.contains(place) {
                    place[axis] = end;
                    let normal = std::array::from_fn(|d| if d == axis { sign } else { 0.0 });
                    self.faces.push(SurfaceFace { place, normal, patch });
                }
            }
        }
    }
}

/// Columns of the lattice that fills a body.
struct CellColumns<const D: usize> {
    origin: [f64; D],
    counts: [usize; D],
    spacing: f64,
}

impl<const D: usize> CellColumns<D> {
    fn coordinate(&self, axis: usize, cell: usize) -> f64 {
        self.origin[axis] + self.spacing * cell as f64
    }
}

/// Number of points on a closed curve, m, a multiple of 4.
fn around(curve: f64, spacing: f64) -> usize {
    4 * ((curve / (4.0 * spacing)).round() as usize).max(1)
}
