//! Bodies as cells of a grid, each with its fill fraction.

use crate::error::Error;
use crate::mesh::structured::check_node_count;
use crate::mesh::{Grid, Mesh};

/// Accepted range of cell volume over body volume.
pub const RATIOS: [f64; 2] = [0.9, 1.1];

/// Bin width of fill fractions.
const BIN: f64 = 0.05;

/// A body of cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Voxels {
    /// Mesh of the filled cells: element sets `part`, `layer-1`, … (layers of cells), and the sides of the
    /// bounding box.
    pub mesh: Mesh,
    /// Fill fraction of each element; above 1 for overlapping beads. The filled volumes sum to `volume`.
    pub fill: Vec<f64>,
    /// Volume of the body, m³.
    pub volume: f64,
    /// Volume of the elements over that of the body.
    pub ratio: f64,
    /// Fraction of the volume that was in omitted cells.
    pub left_out: f64,
}

/// Grid of cells around a box, at multiples of their size.
pub(super) struct VoxelGrid {
    first: [f64; 3],
    count: [usize; 3],
    size: [f64; 3],
}

impl VoxelGrid {
    /// Encloses a box; faces within a millionth of a cell of a line count as on it.
    pub fn around(low: [f64; 3], high: [f64; 3], size: [f64; 3]) -> Result<Self, Error> {
        if let Some(found) = size.into_iter().find(|size| !(*size > 0.0 && size.is_finite())) {
            let (name, allowed) = ("size of a cell", "positive and finite, m".into());
            return Err(Error::Parameter { name, found, allowed });
        }
        let ends = [0, 1, 2].map(|d| [(low[d] / size[d] + 1e-6).floor(), (high[d] / size[d] - 1e-6).ceil()]);
        check_node_count(ends.map(|[first, last]| last - first))?;
        let count = ends.map(|[first, last]| ((last - first) as usize).max(1));
        Ok(Self { first: [0, 1, 2].map(|d| ends[d][0] * size[d]), count, size })
    }

    /// Number of cells along each axis.
    pub fn counts(&self) -> [usize; 3] {
        self.count
    }

    /// Converts a coordinate to units of cells from the grid's corner.
    pub fn units(&self, at: f64, d: usize) -> f64 {
        (at - self.first[d]) / self.size[d]
    }

    /// Index of the cell at a position; rounding at the border stays inside.
    pub fn cell(&self, at: [f64; 3]) -> usize {
        let [i, j, k] =
            [0, 1, 2].map(|d| self.units(at[d], d).floor().clamp(0.0, (self.count[d] - 1) as f64) as usize);
        i + self.count[0] * (j + self.count[1] * k)
    }

    /// Builds the cells with a filled volume, m³, of at least `least` of the whole, for a body of `volume`;
    /// the content of other cells is distributed in proportion. Returns also which cells they are.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a `least` outside 0 to 1, or that no cell reaches.
    pub fn voxels(&self, filled: &[f64], least: f64, volume: f64) -> Result<(Voxels, Vec<bool>), Error> {
        let name = "least filled part of a cell";
        if !(0.0..=1.0).contains(&least) {
            return Err(Error::Parameter { name, found: least, allowed: "0 to 1".into() });
        }
        let whole: f64 = self.size.iter().product();
        let taken: Vec<bool> = filled.iter().map(|own| *own >= least * whole && *own > 0.0).collect();
        let kept: f64 = filled.iter().zip(&taken).filter(|(_, taken)| **taken).map(|(own, _)| own).sum();
        if kept <= 0.0 {
            return Err(Error::Parameter {
                name,
                found: least,
                allowed: "one that some cell reaches".into(),
            });
        }
        let line = |d: usize| (0..=self.count[d]).map(|k| self.first[d] + k as f64 * self.size[d]).collect();
        let mesh = Grid { lines: [line(0), line(1), line(2)] }.cells("part", &taken)?;
        let all: f64 = filled.iter().sum();
        let own = filled.iter().zip(&taken).filter(|(_, taken)| **taken).map(|(own, _)| own);
        let fill: Vec<f64> = own.map(|own| own / whole * (volume / kept)).collect();
        let ratio = whole * fill.len() as f64 / volume;
        Ok((Voxels { mesh, fill, volume, ratio, left_out: 1.0 - kept / all }, taken))
    }
}

impl Voxels {
    /// Merges fill fractions that differ by less than a twentieth into their mean, which keeps the volume:
    /// returns the values, and the index of each element's value.
    pub fn bins(&self) -> (Vec<f64>, Vec<usize>) {
        let key = |fill: f64| (fill / BIN).round() as u64;
        let mut sums = std::collections::BTreeMap::new();
        for &fill in &self.fill {
            let (sum, count) = sums.entry(key(fill)).or_insert((0.0, 0.0));
            *sum += fill;
            *count += 1.0;
        }
        let keys: Vec<u64> = sums.keys().copied().collect();
        let of = self.fill.iter().map(|&fill| keys.partition_point(|other| *other < key(fill))).collect();
        (sums.into_values().map(|(sum, count)| sum / count).collect(), of)
    }

    /// Returns true if full cells may represent the body.
    pub fn can_be_full(&self) -> bool {
        (RATIOS[0]..=RATIOS[1]).contains(&self.ratio)
    }
}
