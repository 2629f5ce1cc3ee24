//! Meshes of hexahedra in field files, and fields over them.

use harness::output::vtkhdf::Series;
use polycore::transfer::{Overlap, integral};

/// VTK's number of a hexahedron.
const HEXAHEDRON: u8 = 12;

/// Points and hexahedra of a file.
pub struct HexMesh {
    /// Positions of the nodes, m.
    pub points: Vec<[f64; 3]>,
    /// Nodes of each hexahedron.
    pub cells: Vec<[u32; 8]>,
}

impl HexMesh {
    /// Reads the mesh of the first step.
    ///
    /// # Errors
    /// A mesh without cells, or with cells other than hexahedra.
    pub fn new(series: &Series) -> Result<Self, String> {
        let points = series.points(0).map_err(|error| error.to_string())?;
        let cells = series.cells().map_err(|error| error.to_string())?;
        if cells.is_empty() {
            return Err("it has particles and no cells".to_owned());
        }
        if let Some(kind) = cells.types.iter().find(|&&kind| kind != HEXAHEDRON) {
            return Err(format!("it has cells of VTK's type {kind}"));
        }
        let cells = cells.connectivity.chunks_exact(8).filter_map(|cell| cell.try_into().ok()).collect();
        Ok(Self { points, cells })
    }
}

/// Field over nodes (trilinear in each cell) or over cells: a scalar, or the six components of a symmetric
/// tensor.
pub struct MeshField {
    of_cells: bool,
    /// Number of components, 1 or 6.
    pub components: usize,
    /// Values of each component.
    data: Vec<Vec<f64>>,
}

impl MeshField {
    /// Reads an array at a step.
    ///
    /// # Errors
    /// As [`Series::data`].
    pub fn new(series: &Series, step: usize, array: &str) -> Result<Self, polycore::Error> {
        let known = series.arrays().iter().find(|(name, _)| *name == array).map(|(_, n)| *n);
        let of_cells = series.cell_arrays().iter().find(|(name, _)| *name == array).map(|(_, n)| *n);
        let data = if known.is_some() { series.data(step, array) } else { series.cell_data(step, array) }?;
        let components = known.or(of_cells).unwrap_or(1);
        let data =
            (0..components).map(|c| data.iter().skip(c).step_by(components).copied().collect()).collect();
        Ok(Self { of_cells: known.is_none(), components, data })
    }

    /// Returns the scalar, or a third of the trace of the tensor.
    pub fn mean_of(&self, component: impl Fn(usize) -> f64) -> f64 {
        if self.components == 6 { (0..3).map(component).sum::<f64>() / 3.0 } else { component(0) }
    }

    /// Builds a tensor from components in VTK's order xx, yy, zz, xy, yz, xz.
    pub fn tensor(component: impl Fn(usize) -> f64) -> [[f64; 3]; 3] {
        [[0, 3, 5], [3, 1, 4], [5, 4, 2]].map(|row| row.map(&component))
    }

    /// Returns the node or the middle of the cell in a box at which the field is not finite, and the value
    /// there.
    pub fn missing(&self, mesh: &HexMesh, overlap: &Overlap, index: usize) -> Option<([f64; 3], f64)> {
        let wrong = |at: u32| self.data.iter().map(|values| values[at as usize]).find(|x| !x.is_finite());
        if self.of_cells {
            let (cell, value) = overlap.cells_of(index).find_map(|cell| Some((cell, wrong(cell)?)))?;
            let corners = mesh.cells[cell as usize].map(|node| mesh.points[node as usize]);
            let middle = |d: usize| corners.iter().map(|corner| corner[d]).sum::<f64>() / 8.0;
            return Some(([middle(0), middle(1), middle(2)], value));
        }
        let (node, value) = overlap.nodes_of(index).find_map(|node| Some((node, wrong(node)?)))?;
        Some((mesh.points[node as usize], value))
    }

    /// Returns the means over the boxes, by component.
    ///
    /// # Errors
    /// As [`Overlap::from_nodes`].
    pub fn means(&self, overlap: &Overlap) -> Result<Vec<Vec<Option<f64>>>, polycore::Error> {
        let means = |values: &Vec<f64>| match self.of_cells {
            true => overlap.from_cells(values),
            false => overlap.from_nodes(values),
        };
        self.data.iter().map(means).collect()
    }

    /// Returns the volume of the mesh where the field is finite, and the integral of [`Self::mean_of`].
    ///
    /// # Errors
    /// As [`integral`].
    pub fn integral(&self, mesh: &HexMesh) -> Result<[f64; 2], polycore::Error> {
        let value = |at: usize| self.mean_of(|component| self.data[component][at]);
        if !self.of_cells {
            let values: Vec<f64> = (0..mesh.points.len()).map(value).collect();
            let finite = |cell: &&[u32; 8]| cell.iter().all(|&node| values[node as usize].is_finite());
            let cells: Vec<[u32; 8]> = mesh.cells.iter().filter(finite).copied().collect();
            return integral(&mesh.points, &cells, &values);
        }
        let ones = vec![1.0; mesh.points.len()];
        let mut sums = [0.0; 2];
        for (at, cell) in mesh.cells.iter().enumerate() {
            let value = value(at);
            if value.is_finite() {
                let [volume, _] = integral(&mesh.points, std::slice::from_ref(cell), &ones)?;
                sums = [sums[0] + volume, sums[1] + volume * value];
            }
        }
        Ok(sums)
    }
}
