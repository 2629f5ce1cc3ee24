//! MeshSection through a mesh, sampled on a regular grid for pictures.

use crate::mesh::Mesh;

/// Samples along the longer side.
const SAMPLES: f64 = 560.0;

/// Samples in the plane y = middle, on a grid along x and z.
pub struct MeshSection {
    /// Number of samples along x and z.
    pub samples: [usize; 2],
    /// Lower left corner (x, z), m.
    pub low: [f64; 2],
    /// Distance between neighbouring samples, m.
    pub spacing: f64,
    /// Sample and element of each sample inside the mesh.
    inside: Vec<(usize, u32)>,
    /// Shape functions of the nodes, sample by sample.
    shapes: Vec<f64>,
}

impl MeshSection {
    /// Samples the section through the middle of some elements along y. Returns `None` for an empty set.
    pub fn through_the_middle(mesh: &Mesh, elements: &[u32]) -> Option<Self> {
        let [low, high] = mesh.bounds_of(elements)?;
        let longest = (high[0] - low[0]).max(high[2] - low[2]);
        if !(longest > 0.0 && longest.is_finite()) {
            return None;
        }
        let spacing = longest / SAMPLES;
        // samples whose center lies inside
        let count = |d: usize| ((high[d] - low[d]) / spacing - 0.5).ceil().max(1.0) as usize;
        let samples = [count(0), count(2)];
        let middle = 0.5 * (low[1] + high[1]);
        let within = |from: f64, to: f64, d: usize, most: usize| {
            let first = ((from - low[d]) / spacing - 0.5).ceil().max(0.0) as usize;
            let last = ((to - low[d]) / spacing - 0.5).ceil().max(0.0) as usize;
            first.min(most)..last.min(most)
        };
        let (mut inside, mut all) = (Vec::new(), Vec::new());
        for &element in elements {
            let Some([lower, upper]) = mesh.bounds_of(&[element]) else { continue };
            if !(lower[1] <= middle && middle < upper[1]) {
                continue;
            }
            for k in within(lower[2], upper[2], 2, samples[1]) {
                for i in within(lower[0], upper[0], 0, samples[0]) {
                    let x = low[0] + (i as f64 + 0.5) * spacing;
                    let z = low[2] + (k as f64 + 0.5) * spacing;
                    if let Some(shapes) = mesh.shapes_at(element, [x, middle, z]) {
                        inside.push((k * samples[0] + i, element));
                        all.extend_from_slice(&shapes[..mesh.nodes(element).len()]);
                    }
                }
            }
        }
        Some(Self { samples, low: [low[0], low[2]], spacing, inside, shapes: all })
    }

    /// Values of a field over nodes at the samples of elements that exist, NaN elsewhere.
    pub fn values(&self, mesh: &Mesh, field: &[f64], exists: &dyn Fn(u32) -> bool) -> Vec<f64> {
        let mut values = vec![f64::NAN; self.samples[0] * self.samples[1]];
        let mut rest = self.shapes.as_slice();
        for (sample, element) in &self.inside {
            let (shapes, others) = rest.split_at(mesh.nodes(*element).len());
            rest = others;
            if !exists(*element) {
                continue;
            }
            // a nonexistent node is NaN, but has no weight in a sample on the far side
            let parts = mesh.nodes(*element).iter().zip(shapes).filter(|(_, shape)| **shape != 0.0);
            let at = |node: u32| field.get(node as usize).copied().unwrap_or(f64::NAN);
            values[*sample] = parts.map(|(&node, shape)| shape * at(node)).sum();
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Block, CellSplit, Grid};

    /// A trilinear field is reproduced at each sample; nonexistent elements give NaN.
    #[test]
    fn sections_interpolate() {
        let mesh = Grid::uniform([0.0; 3], [3.0, 2.0, 1.0], [6, 3, 2]).unwrap().mesh("brick").unwrap();
        let field: Vec<f64> = mesh.points.iter().map(|[x, y, z]| 1.0 + 2.0 * x - y + 3.0 * x * z).collect();
        let all: Vec<u32> = (0..36).collect();
        let section = MeshSection::through_the_middle(&mesh, &all).unwrap();
        let [across, up] = section.samples;
        assert_eq!((across, up), (560, 187));
        let place = |k: usize| {
            let at = |index: usize, d: usize| section.low[d] + (index as f64 + 0.5) * section.spacing;
            [at(k % across, 0), at(k / across, 1)]
        };
        for (k, value) in section.values(&mesh, &field, &|_| true).iter().enumerate() {
            let [x, z] = place(k);
            assert!((value - (1.0 + 2.0 * x - 1.0 + 3.0 * x * z)).abs() < 1e-12, "{x} {z} {value}");
        }
        let lower = |element: u32| mesh.centre(element)[2] < 0.5;
        for (k, value) in section.values(&mesh, &field, &lower).iter().enumerate() {
            assert_eq!(value.is_nan(), place(k)[1] > 0.5, "{k}");
        }
        assert!(MeshSection::through_the_middle(&mesh, &[]).is_none());
    }

    /// A tetrahedron fills the triangle of its section, not its bounding box; a brick of tetrahedra fills the
    /// whole section.
    #[test]
    fn tetrahedra_are_cut() {
        let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let one = Mesh { points, tetrahedra: vec![[0, 1, 2, 3]], ..Mesh::default() };
        let section = MeshSection::through_the_middle(&one, &[0]).unwrap();
        let filled =
            section.values(&one, &[1.0; 4], &|_| true).iter().filter(|value| !value.is_nan()).count();
        let share = filled as f64 / (section.samples[0] * section.samples[1]) as f64;
        // legs of 1/2: an eighth of the square
        assert!((share - 0.125).abs() < 2e-3, "{share}");
        let block = Block { name: "brick".into(), lower: [0.0; 3], upper: [3.0, 2.0, 1.0] };
        let grid = Grid::uniform([0.0; 3], [3.0, 2.0, 1.0], [5, 3, 2]).unwrap();
        let mesh = grid.blocks(&[block], CellSplit::FiveTetrahedra).unwrap();
        let all: Vec<u32> = (0..mesh.element_count() as u32).collect();
        let section = MeshSection::through_the_middle(&mesh, &all).unwrap();
        let field: Vec<f64> = mesh.points.iter().map(|[x, y, z]| 1.0 + 2.0 * x - y + 3.0 * z).collect();
        for (k, value) in section.values(&mesh, &field, &|_| true).iter().enumerate() {
            let at = |index: usize, d: usize| section.low[d] + (index as f64 + 0.5) * section.spacing;
            let [x, z] = [at(k % section.samples[0], 0), at(k / section.samples[0], 1)];
            assert!((value - (2.0 * x + 3.0 * z)).abs() < 1e-9, "{x} {z} {value}");
        }
    }
}
