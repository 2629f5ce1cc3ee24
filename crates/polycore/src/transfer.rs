//! Transfer of fields between discretisations: from the hexahedra of a mesh to the particles of a body, and
//! back, weighted by the common volume of cells and particles.
//!
//! A particle is an axis-parallel box. Each part that a cell and a box have in common has a volume V and a
//! place, the natural coordinates of its middle in the cell. Then
//! - a field over cells gives a box Σ V v / Σ V,
//! - a field over nodes gives it Σ V Σ_a N_a(place) v_a / Σ V, with the trilinear shape functions N_a of the
//!   cell,
//!
//! and both keep the integral over everything covered. Cells that are axis-parallel boxes themselves are cut
//! exactly: a product of linear functions has its mean over a box in the middle of that box, so that the
//! second line is the mean of the interpolated field, and the value in the middle of the box where the field
//! is linear and the box is covered. Any other hexahedron is replaced by Gauss points, two along each axis of
//! each of its n³ equal pieces in natural coordinates, with pieces of at most half a box: their weights
//! integrate a trilinear field over the cell exactly, and each point belongs to one box, so that integrals
//! are kept, but which share a box has of a cell is as coarse as the points.

use crate::Error;
use crate::numerics::hexahedron::{CORNERS, shapes};
use crate::numerics::{Groups, bounds};

/// Distance of corners from those of a box, over its edges, up to which a cell counts as a box.
const ALIGNED: f64 = 1e-9;
/// Overlap, over an edge, below which boxes only touch: rounding.
const TOUCHING: f64 = 1e-11;
/// Largest number of pieces of a general hexahedron along an axis.
const MOST_PIECES: f64 = 16.0;

/// An axis-parallel box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cuboid {
    /// Lower corner, m.
    pub min: [f64; 3],
    /// Upper corner, m.
    pub max: [f64; 3],
}

impl Cuboid {
    /// Volume, m³.
    pub fn volume(&self) -> f64 {
        (0..3).map(|d| self.max[d] - self.min[d]).product()
    }

    /// Bounding box of points.
    pub fn bounding(points: &[[f64; 3]]) -> Self {
        let [min, max] = bounds(points.iter().copied());
        Self { min, max }
    }
}

/// Intersection of a cell and a box.
#[derive(Clone, Copy, Debug, PartialEq)]
struct OverlapPart {
    cell: u32,
    volume: f64,
    /// Natural coordinates of its centre in the cell.
    place: [f64; 3],
}

/// Intersections of the cells of a mesh with boxes.
#[derive(Clone, Debug)]
pub struct Overlap {
    cells: Vec<[u32; 8]>,
    nodes: usize,
    /// Intersections of each box.
    parts: Groups<OverlapPart>,
}

impl Overlap {
    /// Cuts cells (nodes in VTK's order) with boxes that do not overlap one another.
    ///
    /// # Errors
    /// [`Error::Data`]: a node that does not exist or is not finite, a cell or a box without volume.
    pub fn new(points: &[[f64; 3]], cells: &[[u32; 8]], boxes: &[Cuboid]) -> Result<Self, Error> {
        let fail = |what: String, reason: &str| Err(Error::Data { what, reason: reason.to_owned() });
        if let Some(index) =
            boxes.iter().position(|b| (0..3).any(|d| b.max[d] <= b.min[d] || !b.volume().is_finite()))
        {
            return fail(format!("box {index} of a transfer, {:?}", boxes[index]), "without volume");
        }
        let bins = Bins::new(boxes);
        let mut found: Vec<(u32, OverlapPart)> = Vec::new();
        for (index, cell) in cells.iter().enumerate() {
            if cell
                .iter()
                .any(|&node| points.get(node as usize).is_none_or(|p| p.iter().any(|x| !x.is_finite())))
            {
                return fail(
                    format!("cell {index} of a transfer"),
                    "with a node that does not exist or is not finite",
                );
            }
            let corners = cell.map(|node| points[node as usize]);
            let bounds = Cuboid::bounding(&corners);
            let number = index as u32;
            let before = found.len();
            if is_box(&corners, &bounds) {
                if bounds.volume() <= 0.0 {
                    return fail(format!("cell {index} of a transfer"), "without volume");
                }
                bins.within(&bounds, &mut |at| {
                    cut(&bounds, &boxes[at], number)
                        .into_iter()
                        .for_each(|part| found.push((at as u32, part)))
                });
            } else {
                let pieces = bins.pieces(&bounds);
                for (part, point) in gauss_points(&corners, number, pieces) {
                    if part.volume <= 0.0 {
                        return fail(format!("cell {index} of a transfer"), "turned inside out");
                    }
                    let mut best: Option<(f64, usize)> = None;
                    bins.within(&Cuboid { min: point, max: point }, &mut |at| {
                        let distance = boxes[at].distance(point);
                        if distance <= 1.0 + ALIGNED && best.is_none_or(|(least, _)| distance < least) {
                            best = Some((distance, at));
                        }
                    });
                    found.extend(best.map(|(_, at)| (at as u32, part)));
                }
            }
            // the order of bins is not that of boxes
            found[before..].sort_by_key(|(at, _)| *at);
        }
        let parts = Groups::new(boxes.len(), found.iter().map(|&(at, part)| (at as usize, part)));
        Ok(Self { cells: cells.to_vec(), nodes: points.len(), parts })
    }

    /// Number of boxes.
    pub fn boxes(&self) -> usize {
        self.parts.count()
    }

    /// Volume of the mesh in a box, m³.
    pub fn covered_volume(&self, index: usize) -> f64 {
        self.parts.group(index).iter().map(|part| part.volume).sum()
    }

    /// Nodes of the cells that intersect a box.
    pub fn nodes_of(&self, index: usize) -> impl Iterator<Item = u32> + '_ {
        self.parts.group(index).iter().flat_map(|part| self.cells[part.cell as usize])
    }

    /// Cells that intersect a box.
    pub fn cells_of(&self, index: usize) -> impl Iterator<Item = u32> + '_ {
        self.parts.group(index).iter().map(|part| part.cell)
    }

    /// Computes means over the boxes of a field over cells; `None` outside the mesh.
    ///
    /// # Errors
    /// [`Error::Data`]: another number of values than cells.
    pub fn from_cells(&self, values: &[f64]) -> Result<Vec<Option<f64>>, Error> {
        fits("cells", self.cells.len(), values)?;
        Ok(self.means(|part| values[part.cell as usize]))
    }

    /// Computes means over the boxes of a field over nodes, trilinear in each cell; `None` outside the mesh.
    ///
    /// # Errors
    /// [`Error::Data`]: another number of values than nodes.
    pub fn from_nodes(&self, values: &[f64]) -> Result<Vec<Option<f64>>, Error> {
        fits("nodes", self.nodes, values)?;
        Ok(self.means(|part| {
            let (nodes, shape) = (self.cells[part.cell as usize], shapes(part.place));
            (0..8).map(|a| shape[a] * values[nodes[a] as usize]).sum()
        }))
    }

    /// Computes means over the cells of a field over boxes; `None` outside the boxes.
    ///
    /// # Errors
    /// [`Error::Data`]: another number of values than boxes.
    pub fn to_cells(&self, values: &[f64]) -> Result<Vec<Option<f64>>, Error> {
        fits("boxes", self.boxes(), values)?;
        let mut sums = vec![(0.0, 0.0); self.cells.len()];
        for (index, value) in values.iter().enumerate() {
            for part in self.parts.group(index) {
                let (volume, sum) = &mut sums[part.cell as usize];
                *volume += part.volume;
                *sum += part.volume * value;
            }
        }
        Ok(sums.into_iter().map(mean).collect())
    }

    /// Computes nodal values from a field over boxes: Σ V N_a v / Σ V N_a over all intersections, the lumped
    /// projection, which keeps the integral Σ_a v_a ∫N_a dV; `None` outside the boxes.
    ///
    /// # Errors
    /// [`Error::Data`]: another number of values than boxes.
    pub fn to_nodes(&self, values: &[f64]) -> Result<Vec<Option<f64>>, Error> {
        fits("boxes", self.boxes(), values)?;
        let mut sums = vec![(0.0, 0.0); self.nodes];
        for (index, value) in values.iter().enumerate() {
            for part in self.parts.group(index) {
                let (nodes, shape) = (self.cells[part.cell as usize], shapes(part.place));
                for a in 0..8 {
                    let (volume, sum) = &mut sums[nodes[a] as usize];
                    *volume += part.volume * shape[a];
                    *sum += part.volume * shape[a] * value;
                }
            }
        }
        Ok(sums.into_iter().map(mean).collect())
    }

    fn means(&self, value: impl Fn(&OverlapPart) -> f64) -> Vec<Option<f64>> {
        let of_box =
            |index| {
                let parts = self.parts.group(index).iter();
                mean(parts.fold((0.0, 0.0), |(all, sum), part| {
                    (all + part.volume, sum + part.volume * value(part))
                }))
            };
        (0..self.boxes()).map(of_box).collect()
    }
}

fn mean((volume, sum): (f64, f64)) -> Option<f64> {
    (volume > 0.0).then(|| sum / volume)
}

fn fits(what: &str, count: usize, values: &[f64]) -> Result<(), Error> {
    if values.len() == count {
        return Ok(());
    }
    let reason = format!("{} values for {count} {what}", values.len());
    Err(Error::Data { what: "a field to transfer".to_owned(), reason })
}

/// Volume of hexahedra and the integral of a field over their nodes, by two Gauss points along each axis;
/// exact for the trilinear field.
///
/// # Errors
/// As [`Overlap::new`]; another number of values than nodes.
pub fn integral(points: &[[f64; 3]], cells: &[[u32; 8]], values: &[f64]) -> Result<[f64; 2], Error> {
    fits("nodes", points.len(), values)?;
    let mut sums = [0.0; 2];
    for (index, cell) in cells.iter().enumerate() {
        if cell.iter().any(|&node| node as usize >= points.len()) {
            let what = format!("cell {index} of a transfer");
            return Err(Error::Data { what, reason: "with a node that does not exist".to_owned() });
        }
        let corners = cell.map(|node| points[node as usize]);
        for (part, _) in gauss_points(&corners, index as u32, 1) {
            let shape = shapes(part.place);
            sums[0] += part.volume;
            sums[1] += part.volume * (0..8).map(|a| shape[a] * values[cell[a] as usize]).sum::<f64>();
        }
    }
    Ok(sums)
}

impl Cuboid {
    /// Distance of a point from the middle, over half the edge: at most 1 inside.
    fn distance(&self, point: [f64; 3]) -> f64 {
        let along =
            |d: usize| (2.0 * point[d] - self.min[d] - self.max[d]).abs() / (self.max[d] - self.min[d]);
        (0..3).map(along).fold(0.0, f64::max)
    }
}

fn is_box(corners: &[[f64; 3]; 8], bounds: &Cuboid) -> bool {
    corners.iter().zip(CORNERS).all(|(corner, sign)| {
        (0..3).all(|d| {
            let expected = if sign[d] < 0.0 { bounds.min[d] } else { bounds.max[d] };
            (corner[d] - expected).abs() <= ALIGNED * (bounds.max[d] - bounds.min[d])
        })
    })
}

/// Returns the intersection of two boxes.
fn cut(cell: &Cuboid, other: &Cuboid, number: u32) -> Option<OverlapPart> {
    let (mut volume, mut place) = (1.0, [0.0; 3]);
    for d in 0..3 {
        let (low, high) = (cell.min[d].max(other.min[d]), cell.max[d].min(other.max[d]));
        let edge = (cell.max[d] - cell.min[d]).min(other.max[d] - other.min[d]);
        if high - low <= TOUCHING * edge {
            return None;
        }
        volume *= high - low;
        place[d] = (low + high - cell.min[d] - cell.max[d]) / (cell.max[d] - cell.min[d]);
    }
    Some(OverlapPart { cell: number, volume, place })
}

/// Gauss points of a hexahedron in n³ pieces: volume and natural coordinates, and the point itself.
fn gauss_points(corners: &[[f64; 3]; 8], number: u32, n: usize) -> Vec<(OverlapPart, [f64; 3])> {
    let step = 2.0 / n as f64;
    let at = |k: usize| {
        let sign = if k.is_multiple_of(2) { -1.0 } else { 1.0 };
        -1.0 + step * ((k / 2) as f64 + 0.5 + sign * 0.5 / 3_f64.sqrt())
    };
    let mut points = Vec::with_capacity(8 * n * n * n);
    for index in 0..8 * n * n * n {
        let place = [at(index % (2 * n)), at(index / (2 * n) % (2 * n)), at(index / (4 * n * n))];
        let (mut point, mut jacobian) = ([0.0; 3], [[0.0; 3]; 3]);
        let shape = shapes(place);
        for (a, corner) in corners.iter().enumerate() {
            for d in 0..3 {
                point[d] += shape[a] * corner[d];
                for (e, row) in jacobian.iter_mut().enumerate() {
                    let factor =
                        |k: usize| if k == e { CORNERS[a][k] } else { 1.0 + CORNERS[a][k] * place[k] };
                    row[d] += corner[d] * factor(0) * factor(1) * factor(2) / 8.0;
                }
            }
        }
        let [a, b, c] = jacobian;
        let determinant = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
            + a[2] * (b[0] * c[1] - b[1] * c[0]);
        points.push((OverlapPart { cell: number, volume: determinant * (0.5 * step).powi(3), place }, point));
    }
    points
}

/// Boxes sorted by their centres into bins as large as the largest box.
struct Bins {
    origin: [f64; 3],
    edge: [f64; 3],
    least: [f64; 3],
    counts: [usize; 3],
    boxes: Groups<usize>,
}

impl Bins {
    fn new(boxes: &[Cuboid]) -> Self {
        let middles: Vec<[f64; 3]> =
            boxes.iter().map(|b| std::array::from_fn(|d| 0.5 * (b.min[d] + b.max[d]))).collect();
        let bounds = Cuboid::bounding(&middles);
        let size = |d: usize| boxes.iter().map(move |b| b.max[d] - b.min[d]);
        let least = std::array::from_fn(|d| size(d).fold(f64::INFINITY, f64::min));
        let mut edge: [f64; 3] = std::array::from_fn(|d| size(d).fold(0.0, f64::max));
        let extent = |d: usize, edge: f64| ((bounds.max[d] - bounds.min[d]) / edge).floor().max(0.0) + 1.0;
        // no more bins than a few per box, however far they lie apart
        while (0..3).map(|d| extent(d, edge[d])).product::<f64>() > 8.0 * boxes.len() as f64 + 64.0 {
            edge = edge.map(|edge| 2.0 * edge);
        }
        let counts: [usize; 3] = match boxes.is_empty() {
            true => [1; 3],
            false => std::array::from_fn(|d| extent(d, edge[d]) as usize),
        };
        let boxes = Groups::new(0, std::iter::empty());
        let mut bins = Self { origin: bounds.min, edge, least, counts, boxes };
        let place: Vec<usize> = middles.iter().map(|&middle| bins.index(bins.bin(middle))).collect();
        bins.boxes = Groups::new(counts.iter().product(), place.into_iter().zip(0..));
        bins
    }

    fn bin(&self, point: [f64; 3]) -> [usize; 3] {
        std::array::from_fn(|d| {
            let at = ((point[d] - self.origin[d]) / self.edge[d]).floor();
            at.clamp(0.0, (self.counts[d] - 1) as f64) as usize
        })
    }

    fn index(&self, [a, b, c]: [usize; 3]) -> usize {
        a + self.counts[0] * (b + self.counts[1] * c)
    }

    /// Visits boxes that may intersect `bounds`, each once.
    fn within(&self, bounds: &Cuboid, visit: &mut dyn FnMut(usize)) {
        if self.boxes.items().is_empty() {
            return;
        }
        // centres of intersecting boxes lie at most half an edge outside
        let low = self.bin(std::array::from_fn(|d| bounds.min[d] - 0.51 * self.edge[d]));
        let high = self.bin(std::array::from_fn(|d| bounds.max[d] + 0.51 * self.edge[d]));
        for c in low[2]..=high[2] {
            for b in low[1]..=high[1] {
                let (first, last) = (self.index([low[0], b, c]), self.index([high[0], b, c]));
                self.boxes.groups(first, last).iter().for_each(|&index| visit(index));
            }
        }
    }

    /// Number of pieces of a cell along each axis: at most half a box each.
    fn pieces(&self, bounds: &Cuboid) -> usize {
        let ratio = |d: usize| 2.0 * (bounds.max[d] - bounds.min[d]) / self.least[d];
        (0..3).map(ratio).fold(1.0, f64::max).ceil().min(MOST_PIECES) as usize
    }
}

#[cfg(test)]
mod tests;
