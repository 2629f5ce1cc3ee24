//! Tangents of conditions at the Gauss points of faces.

/// Tangents ∂Q/∂T of faces, W/K, face by face.
#[derive(Clone, Debug, Default)]
pub struct FaceMatrices {
    /// Number of nodes of each face.
    pub(super) nodes: Vec<u8>,
    pub(super) equations: Vec<u32>,
    pub(super) values: Vec<f64>,
}

/// Tangent ∂Q/∂T of one face, W/K.
#[derive(Clone, Copy, Debug)]
pub struct FaceMatrix<'a> {
    /// Equations of the nodes.
    pub equations: &'a [u32],
    /// Values, row by row.
    pub values: &'a [f64],
}

impl FaceMatrices {
    /// Empty list.
    pub const NONE: &'static Self = &Self { nodes: Vec::new(), equations: Vec::new(), values: Vec::new() };

    /// Returns true if there are no faces.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Iterates over the faces.
    pub fn iter(&self) -> impl Iterator<Item = FaceMatrix<'_>> {
        let (mut equations, mut values) = (self.equations.as_slice(), self.values.as_slice());
        self.nodes.iter().map(move |&nodes| {
            let nodes = usize::from(nodes);
            let (own, rest) = equations.split_at(nodes);
            let (matrix, others) = values.split_at(nodes * nodes);
            (equations, values) = (rest, others);
            FaceMatrix { equations: own, values: matrix }
        })
    }

    /// Removes all faces, but keeps the memory.
    pub fn clear(&mut self) {
        self.nodes.clear();
        self.equations.clear();
        self.values.clear();
    }
}

impl FaceMatrix<'_> {
    /// Adds factor · matrix · x to y.
    pub fn add_product(&self, factor: f64, x: &[f64], y: &mut [f64]) {
        let nodes = self.equations.len();
        for (a, &row) in self.equations.iter().enumerate() {
            let sum: f64 =
                (0..nodes).map(|b| self.values[nodes * a + b] * x[self.equations[b] as usize]).sum();
            y[row as usize] += factor * sum;
        }
    }
}
