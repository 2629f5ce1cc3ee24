//! Hexahedra with incompatible modes, of modulus 1: no locking in bending, free strains at Gauss points.

use nalgebra::{SMatrix, SVector};
use polycore::numerics::hexahedron::{self, CORNERS, slopes};

/// Strain or stress, xx, yy, zz, xy, yz, zx, with engineering shear strains.
pub type VoigtVector = SVector<f64, 6>;
/// Components of an element's nodes, 0 beyond its number.
pub type ElementVector = SVector<f64, 30>;
/// Forces of the modes of a hexahedron.
pub type ModalVector = SVector<f64, 9>;
type HexahedronVector = SVector<f64, 24>;

/// Number of Gauss points.
pub const GAUSS_POINTS: usize = 8;

/// Local coordinates of a Gauss point.
pub fn gauss(point: usize) -> [f64; 3] {
    CORNERS[point].map(|sign| sign / 3.0_f64.sqrt())
}

/// Stiffness Ĉ of an isotropic body of Young's modulus 1.
pub fn stiffness(poisson: f64) -> SMatrix<f64, 6, 6> {
    let lame = poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
    let shear = 0.5 / (1.0 + poisson);
    SMatrix::from_fn(|i, j| match (i < 3 && j < 3, i == j) {
        (true, true) => lame + 2.0 * shear,
        (true, false) => lame,
        (false, true) => shear,
        (false, false) => 0.0,
    })
}

/// Strain of a shape function of gradient g times unit displacements along x, y, z.
pub fn strain_of(gradient: [f64; 3]) -> SMatrix<f64, 6, 3> {
    let [x, y, z] = gradient;
    SMatrix::from_row_slice(&[x, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, z, y, x, 0.0, 0.0, z, y, z, 0.0, x])
}

/// Eight-node hexahedron with the modes 1 − ξ², 1 − η², 1 − ζ² in each displacement (Wilson and Taylor 1973).
/// Gradients of the modes use the Jacobian at the centre (Taylor, Beresford and Wilson 1976,
/// doi:10.1002/nme.1620100602), so that the patch test holds. The modes are condensed.
#[derive(Clone, Debug)]
pub struct Hexahedron {
    /// Volumes of the Gauss points, m³.
    pub weights: [f64; GAUSS_POINTS],
    /// Strains of nodal displacements.
    nodes: [SMatrix<f64, 6, 24>; GAUSS_POINTS],
    /// Strains of the modes.
    modes: [SMatrix<f64, 6, 9>; GAUSS_POINTS],
    /// K̂ after condensation, over the modulus.
    pub condensed: SMatrix<f64, 24, 24>,
    /// Coupling of nodes and modes.
    coupling: SMatrix<f64, 24, 9>,
    /// Inverse of the modes' own block.
    inverse: SMatrix<f64, 9, 9>,
    elastic: SMatrix<f64, 6, 6>,
    /// Gradients of the corner functions at the centre, 1/m.
    middle: [SVector<f64, 3>; 8],
}

impl Hexahedron {
    /// Computes an element from eight corners, m; `None` if inverted.
    pub fn new(corners: &[[f64; 3]; 8], poisson: f64) -> Option<Self> {
        let elastic = stiffness(poisson);
        let centre = jacobian(corners, [0.0; 3]);
        let (centre_inverse, centre_volume) = (centre.try_inverse()?, centre.determinant());
        let mut weights = [0.0; GAUSS_POINTS];
        let mut nodes = [SMatrix::<f64, 6, 24>::zeros(); GAUSS_POINTS];
        let mut modes = [SMatrix::<f64, 6, 9>::zeros(); GAUSS_POINTS];
        for point in 0..GAUSS_POINTS {
            let at = gauss(point);
            let jacobian = jacobian(corners, at);
            let volume = jacobian.determinant();
            if volume.is_nan() || volume <= 0.0 {
                return None;
            }
            let inverse = jacobian.try_inverse()?;
            weights[point] = volume;
            for (node, local) in slopes(at).into_iter().enumerate() {
                let gradient = inverse.transpose() * SVector::<f64, 3>::from(local);
                nodes[point].fixed_columns_mut::<3>(3 * node).copy_from(&strain_of(gradient.into()));
            }
            for mode in 0..3 {
                let mut local = SVector::<f64, 3>::zeros();
                local[mode] = -2.0 * at[mode];
                let gradient = centre_inverse.transpose() * local * (centre_volume / volume);
                modes[point].fixed_columns_mut::<3>(3 * mode).copy_from(&strain_of(gradient.into()));
            }
        }
        let own = Condensed::new(&nodes, &modes, |point| elastic * weights[point])?;
        let Condensed { stiffness: condensed, coupling, inverse } = own;
        let middle =
            slopes([0.0; 3]).map(|local| centre_inverse.transpose() * SVector::<f64, 3>::from(local));
        Some(Self { weights, nodes, modes, condensed, coupling, inverse, elastic, middle })
    }

    /// Condensed stiffness of moduli at the Gauss points; `None` if the modes have none.
    pub(super) fn tangent(&self, moduli: &[SMatrix<f64, 6, 6>; GAUSS_POINTS]) -> Option<Condensed> {
        Condensed::new(&self.nodes, &self.modes, |point| moduli[point] * self.weights[point])
    }

    /// Key of a shape: the edges to 1e-12 of their size; equal for elements of the same shape.
    pub fn key(corners: &[[f64; 3]; 8]) -> Vec<i64> {
        let size = (0..3).map(|d| (corners[6][d] - corners[0][d]).abs()).fold(0.0, f64::max);
        let edges = corners
            .iter()
            .flat_map(|corner| (0..3).map(|d| ((corner[d] - corners[0][d]) / size * 1e12).round() as i64));
        edges.chain([(size * 1e15).round() as i64]).collect()
    }

    /// Stress over the modulus, from an elastic strain.
    pub fn stress(&self, strain: &VoigtVector) -> VoigtVector {
        self.elastic * strain
    }

    /// Nodal forces of stresses at the Gauss points, with condensed modes, and the forces of the modes, an
    /// input of [`Self::strains`].
    pub fn forces(&self, stresses: &[VoigtVector; GAUSS_POINTS]) -> (HexahedronVector, SVector<f64, 9>) {
        let (nodal, modal) = self.whole_forces(stresses);
        (nodal - self.coupling * (self.inverse * modal), modal)
    }

    /// Forces of the nodes, without condensation, and of the modes.
    pub(super) fn whole_forces(
        &self,
        stresses: &[VoigtVector; GAUSS_POINTS],
    ) -> (HexahedronVector, SVector<f64, 9>) {
        let (mut nodal, mut modal) = (HexahedronVector::zeros(), SVector::<f64, 9>::zeros());
        for point in 0..GAUSS_POINTS {
            let weighed = stresses[point] * self.weights[point];
            nodal += self.nodes[point].transpose() * weighed;
            modal += self.modes[point].transpose() * weighed;
        }
        (nodal, modal)
    }

    /// Strain increments at the Gauss points from nodal displacements, with modes in equilibrium with the
    /// forces `modal` of the initial stresses over a stiffness `modulus` Ĉ.
    pub fn strains(
        &self,
        displacement: &HexahedronVector,
        modal: &SVector<f64, 9>,
        modulus: f64,
    ) -> [VoigtVector; GAUSS_POINTS] {
        let modes = -(self.inverse * (modal / modulus + self.coupling.transpose() * displacement));
        self.strains_of(displacement, &modes)
    }

    /// Strains of nodal displacements and modes.
    pub(super) fn strains_of(
        &self,
        displacement: &HexahedronVector,
        modes: &SVector<f64, 9>,
    ) -> [VoigtVector; GAUSS_POINTS] {
        std::array::from_fn(|point| self.nodes[point] * displacement + self.modes[point] * modes)
    }

    /// Rotation at the centre by nodal displacements, half their curl, rad.
    pub fn rotation(&self, displacement: &HexahedronVector) -> [f64; 3] {
        let parts = self.middle.iter().enumerate();
        parts
            .fold(SVector::<f64, 3>::zeros(), |sum, (k, gradient)| {
                sum + gradient.cross(&displacement.fixed_rows::<3>(3 * k)) * 0.5
            })
            .into()
    }

    /// Shape functions of the corners at a Gauss point.
    pub fn shapes(point: usize) -> [f64; 8] {
        hexahedron::shapes(gauss(point))
    }
}

/// Stiffness of a hexahedron after condensation of its modes.
#[derive(Clone, Debug)]
pub(super) struct Condensed {
    pub stiffness: SMatrix<f64, 24, 24>,
    /// Coupling of nodes and modes.
    pub coupling: SMatrix<f64, 24, 9>,
    /// Inverse of the modes' own block.
    pub inverse: SMatrix<f64, 9, 9>,
}

impl Condensed {
    /// Condenses from strains of nodes and modes, and moduli times volumes.
    fn new(
        nodes: &[SMatrix<f64, 6, 24>; GAUSS_POINTS],
        modes: &[SMatrix<f64, 6, 9>; GAUSS_POINTS],
        modulus: impl Fn(usize) -> SMatrix<f64, 6, 6>,
    ) -> Option<Self> {
        let mut full = SMatrix::<f64, 24, 24>::zeros();
        let mut coupling = SMatrix::<f64, 24, 9>::zeros();
        let mut own = SMatrix::<f64, 9, 9>::zeros();
        for point in 0..GAUSS_POINTS {
            let weighed = modulus(point);
            full += nodes[point].transpose() * weighed * nodes[point];
            coupling += nodes[point].transpose() * weighed * modes[point];
            own += modes[point].transpose() * weighed * modes[point];
        }
        let inverse = own.try_inverse()?;
        Some(Self { stiffness: full - coupling * inverse * coupling.transpose(), coupling, inverse })
    }
}

/// Jacobian ∂x/∂ξ.
fn jacobian(corners: &[[f64; 3]; 8], at: [f64; 3]) -> SMatrix<f64, 3, 3> {
    let mut jacobian = SMatrix::zeros();
    for (corner, local) in corners.iter().zip(slopes(at)) {
        jacobian += SVector::<f64, 3>::from(*corner) * SVector::<f64, 3>::from(local).transpose();
    }
    jacobian
}
