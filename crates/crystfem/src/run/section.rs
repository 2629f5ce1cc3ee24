//! A section through a mesh, sampled on a regular raster for pictures.

use crate::mesh::Mesh;

/// Samples along the longer side.
const SAMPLES: f64 = 600.0;

/// Samples in the plane y = middle, as (x, z), and where each takes its value from.
pub struct Section {
    /// x, z of each sample, m.
    pub places: Vec<[f64; 2]>,
    /// Distance of neighbouring samples, m.
    pub spacing: f64,
    /// Element, and coordinates in the box around it, 0 to 1.
    inside: Vec<(u32, [f64; 3])>,
}

impl Section {
    /// Through the middle of some elements along y. An element counts as the box around it: exact for bricks, near
    /// enough for a picture of others.
    pub fn through_the_middle(mesh: &Mesh, elements: &[u32]) -> Self {
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
        let mut section = Self { places: Vec::new(), spacing: longest / SAMPLES, inside: Vec::new() };
        if !(longest > 0.0 && longest.is_finite()) {
            return section;
        }
        let middle = 0.5 * (low[1] + high[1]);
        let samples = |from: f64, to: f64, d: usize| {
            let first = ((from - low[d]) / section.spacing - 0.5).ceil().max(0.0) as usize;
            let last = ((to - low[d]) / section.spacing - 0.5).ceil().max(0.0) as usize;
            first..last
        };
        let mut found = Vec::new();
        for (&element, [lower, upper]) in elements.iter().zip(&boxes) {
            if !(lower[1] <= middle && middle < upper[1]) {
                continue;
            }
            for i in samples(lower[0], upper[0], 0) {
                for k in samples(lower[2], upper[2], 2) {
                    let place = [
                        low[0] + (i as f64 + 0.5) * section.spacing,
                        low[2] + (k as f64 + 0.5) * section.spacing,
                    ];
                    let part = |x: f64, d: usize| (x - lower[d]) / (upper[d] - lower[d]);
                    found.push((place, (element, [part(place[0], 0), part(middle, 1), part(place[1], 2)])));
                }
            }
        }
        (section.places, section.inside) = found.into_iter().unzip();
        section
    }

    /// Values of a field over nodes at the samples: trilinear in a hexahedron, the mean of a tetrahedron's nodes.
    pub fn values(&self, mesh: &Mesh, field: &[f64]) -> Vec<f64> {
        let value = |&(element, [x, y, z]): &(u32, [f64; 3])| {
            let nodes = mesh.nodes(element);
            let at = |node: u32| field.get(node as usize).copied().unwrap_or(f64::NAN);
            if nodes.len() != 8 {
                return nodes.iter().map(|&node| at(node)).sum::<f64>() / nodes.len() as f64;
            }
            let [lower, upper] = bounds(mesh, element);
            nodes
                .iter()
                .map(|&node| {
                    let place = mesh.points[node as usize];
                    let near = |d: usize, part: f64| {
                        if place[d] > 0.5 * (lower[d] + upper[d]) { part } else { 1.0 - part }
                    };
                    near(0, x) * near(1, y) * near(2, z) * at(node)
                })
                .sum()
        };
        self.inside.iter().map(value).collect()
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

    /// A trilinear field comes back at every sample.
    #[test]
    fn sections_interpolate() {
        let mesh = Grid::uniform([0.0; 3], [3.0, 2.0, 1.0], [6, 3, 2]).unwrap().mesh("brick").unwrap();
        let field: Vec<f64> = mesh.points.iter().map(|[x, y, z]| 1.0 + 2.0 * x - y + 3.0 * x * z).collect();
        let all: Vec<u32> = (0..36).collect();
        let section = Section::through_the_middle(&mesh, &all);
        assert_eq!(section.places.len(), 600 * 200);
        for (&[x, z], value) in section.places.iter().zip(section.values(&mesh, &field)) {
            assert!((value - (1.0 + 2.0 * x - 1.0 + 3.0 * x * z)).abs() < 1e-12, "{x} {z} {value}");
        }
        assert!(Section::through_the_middle(&mesh, &[]).places.is_empty());
    }
}
