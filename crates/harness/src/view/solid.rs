//! A solid as a page draws it: points, cells of straight edges, and where the points go.

use std::collections::{HashMap, HashSet};

use crate::output::vtkhdf::Cells;

/// VTK's number of a quadrilateral.
pub const QUADRILATERAL: u8 = 9;
const TETRAHEDRON: u8 = 10;
/// VTK's number of a hexahedron.
pub const HEXAHEDRON: u8 = 12;
/// VTK's types that are drawn: number, that of the corners alone, number of corners.
const DRAWN: [(u8, u8, usize); 11] = [
    (5, 5, 3),
    (QUADRILATERAL, QUADRILATERAL, 4),
    (TETRAHEDRON, TETRAHEDRON, 4),
    (HEXAHEDRON, HEXAHEDRON, 8),
    (13, 13, 6),
    (14, 14, 5),
    (22, 5, 3),
    (23, QUADRILATERAL, 4),
    (24, TETRAHEDRON, 4),
    (25, HEXAHEDRON, 8),
    (26, 13, 6),
];
/// Tetrahedra of a cell by its type. Those of a hexahedron share its diagonal from corner 0 to 6, so that
/// cells of a structured mesh fit together.
const PARTS: [(u8, &[[usize; 4]]); 4] = [
    (TETRAHEDRON, &[[0, 1, 2, 3]]),
    (HEXAHEDRON, &[[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]]),
    (13, &[[0, 1, 2, 5], [0, 1, 5, 4], [0, 4, 5, 3]]),
    (14, &[[0, 1, 2, 4], [0, 2, 3, 4]]),
];
/// Cells of a mesh that is drawn as it is.
const MOST: usize = 40_000;
/// Points of a mesh that is drawn in their place.
const POINTS: usize = 9_000;

/// Points, cells, and displacements at steps.
#[derive(Debug, Default)]
pub struct PageSolid {
    /// Before any displacement, m.
    pub points: Vec<[f64; 3]>,
    /// The displacement of each point at each step, m; no steps where nothing moves.
    pub moved: Vec<Vec<[f64; 3]>>,
    /// VTK's type of each cell, one of linear cells.
    pub kinds: Vec<u8>,
    /// Corners of all cells, one cell after another.
    pub corners: Vec<u32>,
    /// The particle or cell of the file that each cell shows.
    pub cell_of: Vec<u32>,
    /// The point of the file that each point shows; none of particles.
    pub point_of: Vec<u32>,
}

/// Corners of a linear cell.
pub fn corners_of(kind: u8) -> usize {
    DRAWN.iter().find(|(_, linear, _)| *linear == kind).map_or(0, |(_, _, corners)| *corners)
}

impl PageSolid {
    /// A mesh; one of very many cells with fewer, `coarser` with fewer still. Cells of other types are left
    /// out.
    pub fn mesh(points: &[[f64; 3]], cells: &Cells, coarser: usize) -> Self {
        let whole = Self::whole(points, cells);
        if whole.kinds.len() <= MOST && coarser <= 1 {
            return whole;
        }
        whole.coarse(POINTS / coarser.max(1))
    }

    fn whole(points: &[[f64; 3]], cells: &Cells) -> Self {
        let mut solid = Self::default();
        let mut number = vec![u32::MAX; points.len()];
        let mut first = 0;
        for (cell, (&kind, &end)) in cells.types.iter().zip(&cells.ends).enumerate() {
            let nodes = cells.connectivity.get(first..end).unwrap_or_default();
            first = end;
            let Some(&(_, kind, count)) = DRAWN.iter().find(|(number, ..)| *number == kind) else { continue };
            let Some(corners) = nodes.get(..count) else { continue };
            for &corner in corners {
                let number = &mut number[corner as usize];
                if *number == u32::MAX {
                    *number = solid.points.len() as u32;
                    solid.points.push(points[corner as usize]);
                    solid.point_of.push(corner);
                }
                solid.corners.push(*number);
            }
            solid.kinds.push(kind);
            solid.cell_of.push(cell as u32);
        }
        solid
    }

    /// About `count` points: one for each cell of a grid, and the tetrahedra that keep four points (clusters
    /// of vertices: Rossignac, Borrel 1993).
    fn coarse(&self, count: usize) -> Self {
        let [low, high] = polycore::numerics::bounds(self.points.iter().copied());
        let longest = (0..3).map(|d| high[d] - low[d]).fold(f64::MIN_POSITIVE, f64::max);
        // corners and edges of a solid have the fewest cells: they stand for those around them
        let mut cells = vec![0u32; self.points.len()];
        self.corners.iter().for_each(|&corner| cells[corner as usize] += 1);
        let clustered = |side: f64| {
            let at =
                |k: u32| [0, 1, 2].map(|d| ((self.points[k as usize][d] - low[d]) / side).round() as i64);
            let mut leaders: HashMap<[i64; 3], u32> = HashMap::new();
            for k in 0..self.points.len() as u32 {
                let leader = leaders.entry(at(k)).or_insert(k);
                if cells[k as usize] < cells[*leader as usize] {
                    *leader = k;
                }
            }
            let of: Vec<u32> = (0..self.points.len() as u32).map(|k| leaders[&at(k)]).collect();
            (leaders.len(), of)
        };
        // the finest grid of as many points
        let mut side = longest / count as f64;
        let mut found = clustered(side);
        while found.0 > count {
            side *= 1.15;
            found = clustered(side);
        }
        let leader = found.1;
        let mut number = vec![u32::MAX; self.points.len()];
        let (mut coarse, mut seen) = (Self::default(), HashSet::new());
        let mut first = 0;
        for (cell, &kind) in self.kinds.iter().enumerate() {
            let corners = &self.corners[first..first + corners_of(kind)];
            first += corners.len();
            let whole = (0..corners.len()).collect::<Vec<usize>>();
            let flat = PARTS.iter().all(|(other, _)| *other != kind);
            let parts: Vec<&[usize]> = match PARTS.iter().find(|(other, _)| *other == kind) {
                Some((_, parts)) => parts.iter().map(|part| part.as_slice()).collect(),
                None => vec![&whole],
            };
            for part in parts {
                let points: Vec<u32> = part.iter().map(|&k| leader[corners[k] as usize]).collect();
                let mut sorted = points.clone();
                sorted.sort_unstable();
                let collapsed = sorted.windows(2).any(|pair| pair[0] == pair[1]);
                if collapsed || !seen.insert(sorted) {
                    continue;
                }
                for point in points {
                    let number = &mut number[point as usize];
                    if *number == u32::MAX {
                        *number = coarse.points.len() as u32;
                        coarse.points.push(self.points[point as usize]);
                        coarse.point_of.push(self.point_of[point as usize]);
                    }
                    coarse.corners.push(*number);
                }
                coarse.kinds.push(if flat { kind } else { TETRAHEDRON });
                coarse.cell_of.push(self.cell_of[cell]);
            }
        }
        coarse
    }

    /// Returns the same solid with its cells sorted by type.
    pub fn by_kind(mut self) -> Self {
        let mut starts = Vec::with_capacity(self.kinds.len());
        let mut first = 0;
        for &kind in &self.kinds {
            starts.push(first);
            first += corners_of(kind);
        }
        let mut order: Vec<usize> = (0..self.kinds.len()).collect();
        order.sort_by_key(|&cell| self.kinds[cell]);
        let corners =
            |&cell: &usize| &self.corners[starts[cell]..starts[cell] + corners_of(self.kinds[cell])];
        self.corners = order.iter().flat_map(corners).copied().collect();
        self.cell_of = order.iter().map(|&cell| self.cell_of[cell]).collect();
        self.kinds = order.iter().map(|&cell| self.kinds[cell]).collect();
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a brick of n³ hexahedra, with a tetrahedron of second order and a vertex beside it.
    fn brick(n: usize) -> (Vec<[f64; 3]>, Cells) {
        let m = n + 1;
        let mut points: Vec<[f64; 3]> =
            (0..m * m * m).map(|k| [k % m, k / m % m, k / m / m].map(|x| x as f64 / n as f64)).collect();
        let mut cells = Cells::default();
        cells.push(1, &[0]);
        for k in 0..n * n * n {
            let first = k % n + m * (k / n % n) + m * m * (k / n / n);
            cells.push(
                HEXAHEDRON,
                &[0, 1, m + 1, m, m * m, m * m + 1, m * m + m + 1, m * m + m].map(|j| (first + j) as u32),
            );
        }
        let first = points.len() as u32;
        points.extend((0..10).map(|k| [5.0 + f64::from(k % 2), f64::from(k / 2 % 2), f64::from(k / 4)]));
        cells.push(24, &std::array::from_fn::<u32, 10, _>(|k| first + k as u32));
        (points, cells)
    }

    fn volume(solid: &PageSolid) -> f64 {
        let (mut sum, mut first) = (0.0, 0);
        for &kind in &solid.kinds {
            let corners = &solid.corners[first..first + corners_of(kind)];
            first += corners.len();
            let (_, parts) = PARTS.iter().find(|(other, _)| *other == kind).unwrap();
            for part in *parts {
                let [o, u, v, w] = part.map(|k| nalgebra::Vector3::from(solid.points[corners[k] as usize]));
                sum += (u - o).cross(&(v - o)).dot(&(w - o)) / 6.0;
            }
        }
        sum
    }

    #[test]
    fn meshes_by_their_corners() {
        let (points, cells) = brick(3);
        let solid = PageSolid::mesh(&points, &cells, 1).by_kind();
        assert_eq!((solid.kinds.len(), solid.points.len()), (28, 64 + 4));
        assert_eq!(
            (solid.kinds[0], solid.cell_of[0]),
            (TETRAHEDRON, 28),
            "types together, vertices left out"
        );
        let hexahedra =
            PageSolid { kinds: solid.kinds[1..].to_vec(), corners: solid.corners[4..].to_vec(), ..solid };
        assert!((volume(&hexahedra) - 1.0).abs() < 1e-12);
    }

    /// Fewer points fill the same brick.
    #[test]
    fn large_meshes_become_coarse() {
        let (points, cells) = brick(35);
        let solid = PageSolid::mesh(&points, &cells, 1);
        assert!(solid.points.len() <= POINTS && solid.points.len() > POINTS / 4, "{}", solid.points.len());
        assert!(solid.kinds.iter().all(|&kind| kind == TETRAHEDRON));
        assert!((volume(&solid) - 1.0).abs() < 0.1, "{}", volume(&solid));
        assert!(PageSolid::mesh(&points, &cells, 4).points.len() <= POINTS / 4);
        let source = |(k, &point): (usize, &u32)| solid.points[k] == points[point as usize];
        assert!(solid.point_of.iter().enumerate().all(source));
    }
}
