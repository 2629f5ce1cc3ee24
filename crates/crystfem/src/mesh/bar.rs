//! Printed bar on its substrate, Fig. 4.2 of the thesis.

use crate::error::Error;
use crate::mesh::structured::{MAX_NODES, check_node_count, count as fill};
use crate::mesh::{Block, CellSplit, Face, Grid, Mesh, graded};

/// A bar printed in layers, with its lower face at z = 0 and its centre at x = y = 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Bar {
    /// Extents along x and y, m.
    pub size: [f64; 2],
    /// Number of layers.
    pub layers: usize,
    /// Height of a layer, m.
    pub layer_height: f64,
    /// Number of elements through a layer.
    pub elements_per_layer: usize,
    /// Largest element along x and y, m.
    pub element_size: f64,
    /// Substrate; `None` for a bar alone.
    pub substrate: Option<Substrate>,
    /// Element type.
    pub cells: CellSplit,
}

/// A plate below the bar, with its upper face at z = 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Substrate {
    /// Extents along x and y, m; at least those of the bar.
    pub size: [f64; 2],
    /// Thickness, m.
    pub thickness: f64,
    /// Ratio of lengths of neighbouring elements, growing away from the bar sideways and down: 1 or more.
    pub growth: f64,
}

impl Bar {
    /// Returns a bar alone, m: two elements through a layer, hexahedra about two layer heights long.
    pub fn new(size: [f64; 2], layers: usize, layer_height: f64) -> Self {
        let (elements_per_layer, element_size, cells) = (2, 2.0 * layer_height, CellSplit::Hexahedra);
        Self { size, layers, layer_height, elements_per_layer, element_size, substrate: None, cells }
    }

    /// Meshes bar and substrate with conforming elements: element sets `bar`, `layer-1` … `layer-N`,
    /// `substrate`; surfaces and node sets on the sides of the bounding box, [`crate::mesh::BOX_SIDES`]
    /// (`bottom` is the substrate's lower face), and `interface`, the bar's lower face.
    ///
    /// # Errors
    /// [`Error::Parameter`] for sizes or counts that are not positive, a layer without thickness or elements,
    /// a substrate smaller than the bar, and more than 2²⁸ nodes.
    pub fn mesh(&self) -> Result<Mesh, Error> {
        let grid = self.grid()?;
        let [x, y] = self.size.map(|size| 0.5 * size);
        let height = |layer: usize| layer as f64 * self.layer_height;
        let block = |name: String, z: [f64; 2]| Block { name, lower: [-x, -y, z[0]], upper: [x, y, z[1]] };
        let mut blocks = vec![block("bar".into(), [0.0, height(self.layers)])];
        blocks.extend(
            (1..=self.layers)
                .map(|layer| block(format!("layer-{layer}"), [height(layer - 1), height(layer)])),
        );
        if let Some(substrate) = &self.substrate {
            let [x, y] = substrate.size.map(|size| 0.5 * size);
            let (lower, upper) = ([-x, -y, -substrate.thickness], [x, y, 0.0]);
            blocks.push(Block { name: "substrate".into(), lower, upper });
        }
        let mut mesh = grid.blocks(&blocks, self.cells)?;
        let under =
            |face: &Face| mesh.face_nodes(*face).iter().all(|node| mesh.points[*node as usize][2] == 0.0);
        let first = &mesh.element_sets["layer-1"];
        let interface: Vec<Face> =
            first.iter().flat_map(|&element| mesh.faces_of(element)).filter(under).collect();
        mesh.node_sets.insert("interface".into(), mesh.nodes_of(&interface));
        mesh.surfaces.insert("interface".into(), interface);
        Ok(mesh)
    }

    /// Number of elements along each axis of the grid through bar and substrate, as real numbers: they may be
    /// too many to build.
    ///
    /// # Errors
    /// Errors of [`Bar::mesh`].
    pub fn elements(&self) -> Result<[f64; 3], Error> {
        let count = |name, found: usize| match (1..MAX_NODES).contains(&found) {
            true => Ok(()),
            false => {
                let allowed = format!("1 … {}", MAX_NODES - 1);
                Err(Error::Parameter { name, found: found as f64, allowed })
            }
        };
        count("layers", self.layers)?;
        count("elements per layer", self.elements_per_layer)?;
        count("layers", self.layers.saturating_mul(self.elements_per_layer))?;
        let positive = |name, found: f64, most: f64| match found > 0.0 && most.is_finite() {
            true => Ok(()),
            false => Err(Error::Parameter { name, found, allowed: "positive and finite, m".into() }),
        };
        positive("height of a layer", self.layer_height, self.layer_height * self.layers as f64)?;
        for size in self.size {
            positive("extent of the bar", size, size)?;
        }
        if let Some(Substrate { thickness, .. }) = self.substrate {
            positive("thickness of the substrate", thickness, thickness)?;
        }
        let mut elements = [0.0, 0.0, self.layers as f64 * self.elements_per_layer as f64];
        for d in 0..2 {
            elements[d] = fill(self.size[d], self.element_size, 1.0)?;
            if let Some(substrate) = &self.substrate {
                let beside = 0.5 * (substrate.size[d] - self.size[d]);
                if beside.is_nan() || beside < 0.0 {
                    let allowed = format!("at least the bar's, {} m", self.size[d]);
                    let name = "extent of the substrate";
                    return Err(Error::Parameter { name, found: substrate.size[d], allowed });
                }
                if beside > 1e-9 * substrate.size[d] {
                    elements[d] += 2.0 * fill(beside, self.size[d] / elements[d], substrate.growth)?;
                }
            }
        }
        if let Some(substrate) = &self.substrate {
            let step = self.layer_height / self.elements_per_layer as f64;
            elements[2] += fill(substrate.thickness, step, substrate.growth)?;
        }
        check_node_count(elements)?;
        Ok(elements)
    }

    /// Grid lines of bar and substrate.
    fn grid(&self) -> Result<Grid, Error> {
        self.elements()?;
        let mut lines = [const { Vec::new() }; 3];
        for d in 0..2 {
            let lengths = graded(self.size[d], self.element_size, 1.0)?;
            let half = 0.5 * self.size[d];
            let count = lengths.len();
            let mut line: Vec<f64> =
                (0..=count).map(|k| half * ((2 * k) as f64 / count as f64 - 1.0)).collect();
            if let Some(substrate) = &self.substrate {
                let beside = 0.5 * (substrate.size[d] - self.size[d]);
                if beside > 1e-9 * substrate.size[d] {
                    let outside = end_points(half, graded(beside, lengths[0], substrate.growth)?);
                    let left = outside.iter().rev().map(|x| -x);
                    line = left.chain(line).chain(outside.iter().copied()).collect();
                }
            }
            lines[d] = line;
        }
        let step = self.elements_per_layer as f64;
        if let Some(substrate) = &self.substrate {
            let below = graded(substrate.thickness, self.layer_height / step, substrate.growth)?;
            lines[2].extend(end_points(0.0, below).into_iter().rev().map(|z| -z));
        }
        // layer faces are computed like the bounds of the layers' blocks
        lines[2].extend((0..=self.layers * self.elements_per_layer).map(|k| {
            (k / self.elements_per_layer) as f64 * self.layer_height
                + self.layer_height * ((k % self.elements_per_layer) as f64 / step)
        }));
        Ok(Grid { lines })
    }
}

/// Ends of elements of the given lengths, from `start` on.
fn end_points(start: f64, lengths: Vec<f64>) -> Vec<f64> {
    let mut end = start;
    lengths
        .into_iter()
        .map(|length| {
            end += length;
            end
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::quality;

    fn bar() -> Bar {
        Bar {
            size: [0.02, 0.004],
            layers: 8,
            layer_height: 2e-4,
            elements_per_layer: 2,
            element_size: 5e-4,
            substrate: Some(Substrate { size: [0.04, 0.02], thickness: 4e-3, growth: 1.4 }),
            cells: CellSplit::Hexahedra,
        }
    }

    #[test]
    fn layers_and_substrate_have_their_volumes() {
        let mesh = bar().mesh().unwrap();
        let quality = quality::check(&mesh, None).unwrap();
        assert!(quality.notes.is_empty(), "{:?}", quality.notes);
        let exact = 0.02 * 0.004 * 8.0 * 2e-4 + 0.04 * 0.02 * 4e-3;
        assert!((quality.volume / exact - 1.0).abs() < 1e-12);
        assert_eq!(mesh.element_sets["bar"].len(), 40 * 8 * 16);
        for layer in 1..=8 {
            let set = &mesh.element_sets[&format!("layer-{layer}")];
            assert_eq!(set.len(), 40 * 8 * 2);
            for element in set {
                let z = mesh.centre(*element)[2];
                assert!(z > (layer - 1) as f64 * 2e-4 && z < layer as f64 * 2e-4);
            }
        }
        let rest = mesh.element_count() - 40 * 8 * 16;
        assert_eq!(mesh.element_sets["substrate"].len(), rest);
        assert_eq!(mesh.surfaces["interface"].len(), 40 * 8);
        assert_eq!(mesh.surfaces["top"].len(), 40 * 8);
        assert_eq!(mesh.surfaces["bottom"].len() * 9, rest, "nine elements through the glass");
        // lengths along x, y and z in the glass, and one shape in the bar
        assert_eq!(mesh.bricks().unwrap().sizes.len(), 8 * 7 * 9 + 1);
    }

    #[test]
    fn a_bar_alone_and_a_substrate_of_its_own_size() {
        let alone = Bar { substrate: None, ..bar() }.mesh().unwrap();
        assert_eq!(alone.surfaces["bottom"], alone.surfaces["interface"]);
        assert!(!alone.element_sets.contains_key("substrate"));
        let same = Substrate { size: [0.02, 0.004], thickness: 2e-4, growth: 1.0 };
        let mesh = Bar { substrate: Some(same), ..bar() }.mesh().unwrap();
        assert_eq!(mesh.element_count(), 40 * 8 * 18);
        assert_eq!(mesh.bricks().unwrap().sizes.len(), 1);
    }

    #[test]
    fn a_bar_of_tetrahedra() {
        let mesh = Bar { cells: CellSplit::SixTetrahedra, ..bar() }.mesh().unwrap();
        let quality = quality::check(&mesh, None).unwrap();
        let exact = 0.02 * 0.004 * 8.0 * 2e-4 + 0.04 * 0.02 * 4e-3;
        assert!((quality.volume / exact - 1.0).abs() < 1e-12);
        assert_eq!(mesh.element_sets["layer-8"].len(), 6 * 40 * 8 * 2);
        assert_eq!(mesh.surfaces["interface"].len(), 2 * 40 * 8);
        assert_eq!(mesh.node_sets["interface"].len(), 41 * 9);
    }

    #[test]
    fn invalid_bars_are_refused() {
        let refused = |bar: Bar, words: &str| {
            let text = bar.mesh().unwrap_err().to_string();
            assert!(text.contains(words), "{text}");
        };
        refused(Bar { layer_height: 0.0, ..bar() }, "height of a layer: found 0; allowed: positive");
        refused(Bar { layer_height: f64::NAN, ..bar() }, "height of a layer");
        refused(Bar { layers: 0, ..bar() }, "layers: found 0; allowed: 1");
        refused(Bar { elements_per_layer: 0, ..bar() }, "elements per layer: found 0");
        refused(Bar { layers: usize::MAX, elements_per_layer: 2, ..bar() }, "layers: found");
        refused(Bar { element_size: 1e-12, ..bar() }, "elements along an axis: found");
        refused(Bar { size: [-1.0, 1.0], ..bar() }, "extent of the bar: found -1");
        let small = Substrate { size: [0.01, 0.02], thickness: 4e-3, growth: 1.4 };
        refused(
            Bar { substrate: Some(small), ..bar() },
            "extent of the substrate: found 0.01; allowed: at least",
        );
        let thin = Substrate { size: [0.04, 0.02], thickness: 0.0, growth: 1.4 };
        refused(Bar { substrate: Some(thin), ..bar() }, "thickness of the substrate: found 0");
        let shrinking = Substrate { size: [0.04, 0.02], thickness: 1e-3, growth: 0.5 };
        refused(
            Bar { substrate: Some(shrinking), ..bar() },
            "growth of elements: found 0.5; allowed: 1 or more",
        );
    }
}
