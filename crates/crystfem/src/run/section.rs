//! A section through a mesh, sampled on a regular raster for pictures.

use crate::mesh::Mesh;

/// Samples along the longer side.
const SAMPLES: f64 = 560.0;

/// Samples in the plane y = middle, on a grid along x and z.
pub struct Section {
    /// Samples across and up.
    pub samples: [usize; 2],
    /// Lower left corner (x, z), m.
    pub low: [f64; 2],
    /// Distance of neighbouring samples, m.
    pub spacing: f64,
    /// Sample, element, and coordinates in the box around it, 0 to 1.
    inside: Vec<(usize, u32, [f64; 3])>,
}

impl Section {
    /// Through the middle of some elements along y. An element counts as the box around it: exact for bricks, near
    /// enough for a picture of others. `None` where there is nothing to cut.
    pub fn through_the_middle(mesh: &Mesh, elements: &[u32]) -> Option<Self> {
        let boxes: Vec<[[f64; 3]; 2]> = elements.iter().map(|&element| bounds(mesh, element)).collect();
        let none = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        let [low, high] = boxes.iter().fold(none, |[mut low, mut high], [lower, upper]| {
            for d in 0..3 {
                low[d] = low[d].min(lower[d]);
                high[d] = high[d].max(upper[d]);
            }
            [low, high]
        });
        let longest = (high[0] - low[0]).max(high[2] - low[2]);
        if !(longest > 0.0 && longest.is_finite()) {
            return None;
        }
        let spacing = longest / SAMPLES;
        // those whose middle lies inside
        let count = |d: usize| ((high[d] - low[d]) / spacing - 0.5).ceil().max(1.0) as usize;
        let samples = [count(0), count(2)];
        let middle = 0.5 * (low[1] + high[1]);
        let within = |from: f64, to: f64, d: usize, most: usize| {
            let first = ((from - low[d]) / spacing - 0.5).ceil().max(0.0) as usize;
            let last = ((to - low[d]) / spacing - 0.5).ceil().max(0.0) as usize;
            first.min(most)..last.min(most)
        };
        let mut inside = Vec::new();
        for (&element, [lower, upper]) in elements.iter().zip(&boxes) {
            if !(lower[1] <= middle && middle < upper[1]) {
                continue;
            }
            for k in within(lower[2], upper[2], 2, samples[1]) {
                for i in within(lower[0], upper[0], 0, samples[0]) {
                    let part = |x: f64, d: usize| (x - lower[d]) / (upper[d] - lower[d]);
                    let x = low[0] + (i as f64 + 0.5) * spacing;
                    let z = low[2] + (k as f64 + 0.5) * spacing;
                    inside.push((k * samples[0] + i, element, [part(x, 0), part(middle, 1), part(z, 2)]));
                }
            }
        }
        Some(Self { samples, low: [low[0], low[2]], spacing, inside })
    }

    /// Values of a field over nodes at the samples of elements that exist, NaN elsewhere: trilinear in a hexahedron, the
    /// mean of a tetrahedron's nodes.
    pub fn values(&self, mesh: &Mesh, field: &[f64], exists: &dyn Fn(u32) -> bool) -> Vec<f64> {
        let mut values = vec![f64::NAN; self.samples[0] * self.samples[1]];
        for &(sample, element, [x, y, z]) in self.inside.iter().filter(|(_, element, _)| exists(*element)) {
            let nodes = mesh.nodes(element);
            let at = |node: u32| field.get(node as usize).copied().unwrap_or(f64::NAN);
            if nodes.len() != 8 {
                values[sample] = nodes.iter().map(|&node| at(node)).sum::<f64>() / nodes.len() as f64;
                continue;
            }
            let [lower, upper] = bounds(mesh, element);
            values[sample] = nodes
                .iter()
                .map(|&node| {
                    let place = mesh.points[node as usize];
                    let near = |d: usize, part: f64| {
                        if place[d] > 0.5 * (lower[d] + upper[d]) { part } else { 1.0 - part }
                    };
                    near(0, x) * near(1, y) * near(2, z) * at(node)
                })
                .sum();
        }
        values
    }
}

/// The box around an element.
fn bounds(mesh: &Mesh, element: u32) -> [[f64; 3]; 2] {
    let none = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    mesh.nodes(element).iter().fold(none, |[mut low, mut high], &node| {
        for d in 0..3 {
            low[d] = low[d].min(mesh.points[node as usize][d]);
            high[d] = high[d].max(mesh.points[node as usize][d]);
        }
        [low, high]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Grid;

    /// A trilinear field comes back at every sample, and nothing where nothing is.
    #[test]
    fn sections_interpolate() {
        let mesh = Grid::uniform([0.0; 3], [3.0, 2.0, 1.0], [6, 3, 2]).unwrap().mesh("brick").unwrap();
        let field: Vec<f64> = mesh.points.iter().map(|[x, y, z]| 1.0 + 2.0 * x - y + 3.0 * x * z).collect();
        let all: Vec<u32> = (0..36).collect();
        let section = Section::through_the_middle(&mesh, &all).unwrap();
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
        assert!(Section::through_the_middle(&mesh, &[]).is_none());
    }
}
