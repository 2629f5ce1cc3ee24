//! A body of solidifying Maxwell elements on hexahedra and tetrahedra: births, steps, supports.

use super::branch::BranchEnergies;
use super::element::{GAUSS_POINTS, VoigtVector};
use super::element_kind::{self, MechanicalElement};
use crate::error::Error;
use crate::mesh::Mesh;
use nalgebra::Vector3;

/// Default relative residual at which a solution ends.
const TOLERANCE: f64 = 1e-12;

/// Length of the free part of a normal below which it is rounding.
const SMALLEST_NORMAL: f64 = 1e-9;

/// Body of elements with their state and displacements.
///
/// Strains of an element count from its birth. Only increments of displacement enter, so that earlier
/// positions of shared nodes do not matter.
pub struct Body<'a> {
    pub(super) mesh: &'a Mesh,
    /// Matrices of distinct element shapes.
    pub(super) shapes: Vec<MechanicalElement>,
    pub(super) shape: Vec<u32>,
    pub(super) poisson: f64,
    /// Relative residual at which a solution ends.
    pub tolerance: f64,
    /// Rollers, at most one a node; none by default.
    pub rollers: Vec<Roller>,
    /// State of the body.
    pub state: BodyState,
}

/// State of a body, sufficient to continue with the same bits.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct BodyState {
    /// Elastic strains of the branches at each Gauss point, element by element (0 beyond the element's
    /// points); empty before birth.
    pub(super) strains: Vec<Vec<[[f64; 6]; GAUSS_POINTS]>>,
    /// Σ E b s e at the Gauss points of each element at the end of the last step, Pa: the stress over Ĉ.
    pub(super) stresses: Vec<[[f64; 6]; GAUSS_POINTS]>,
    /// Displacements of the nodes, m.
    pub displacement: Vec<[f64; 3]>,
    /// Total number of conjugate-gradient iterations.
    pub iterations: u64,
    /// Rotation of each element since it solidified, rad: half the curl of the displacement at its centre.
    pub(super) rotations: Vec<[f64; 3]>,
    /// Energies of all past steps.
    pub balance: EnergyBalance,
}

/// Energies of the steps of a body, J.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct EnergyBalance {
    /// Sum over all branches of all elements.
    pub energies: BranchEnergies,
    /// Energy dissipated by the minimum stiffness of the melt.
    pub floor: f64,
    /// Largest |[`BranchEnergies::closure`]| of a step over the energies moved and stored.
    pub worst: f64,
}

/// A fixed node and component: zero displacement increment.
pub type FixedComponent = (u32, usize);

/// Node without a displacement increment along a unit normal, as on a plane of symmetry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roller {
    /// Node of the mesh.
    pub node: u32,
    /// Unit normal of its plane.
    pub normal: [f64; 3],
}

impl Roller {
    /// Rollers of a sector of a body of revolution that starts at y = 0 and has an angle, rad, above 0 and
    /// below π: on its cuts, node sets `start` and `end`, and in both directions across z on its `axis`.
    pub fn on_cuts(mesh: &Mesh, angle: f64) -> Vec<Self> {
        let nodes = |name: &str| mesh.node_sets.get(name).map_or(&[][..], Vec::as_slice);
        let axis = nodes("axis");
        let (sine, cosine) = angle.sin_cos();
        let cuts = [("start", [0.0, -1.0, 0.0]), ("end", [-sine, cosine, 0.0])];
        let cuts = cuts.into_iter().flat_map(|(cut, normal)| {
            let off_axis = nodes(cut).iter().filter(|node| axis.binary_search(node).is_err());
            off_axis.map(move |&node| Self { node, normal })
        });
        // normals of one node are orthogonal
        let across = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let held = across.into_iter().flat_map(|normal| axis.iter().map(move |&node| Self { node, normal }));
        cuts.chain(held).collect()
    }
}

impl<'a> Body<'a> {
    /// Returns a body without active elements.
    ///
    /// # Errors
    /// [`Error::Parameter`] for elements other than first-order hexahedra and tetrahedra, for inverted
    /// elements, and for a Poisson's ratio outside −1 … 0.5.
    pub fn new(mesh: &'a Mesh, poisson: f64) -> Result<Self, Error> {
        let fault =
            |name, found: f64, allowed: &str| Error::Parameter { name, found, allowed: allowed.to_owned() };
        if !(poisson > -1.0 && poisson < 0.5) {
            return Err(fault("poisson", poisson, "above -1 and below 0.5"));
        }
        let count = mesh.element_count();
        let others = (0..count as u32)
            .filter(|&element| !element_kind::is_supported(mesh.nodes(element).len()))
            .count();
        if others > 0 {
            return Err(fault("elements other than 8-node hexahedra and tetrahedra", others as f64, "none"));
        }
        let (mut shapes, mut shape, mut known) = (Vec::new(), Vec::new(), std::collections::HashMap::new());
        for element in 0..count as u32 {
            let places = places(mesh, element);
            let key = element_kind::key(&places);
            let index = match known.get(&key) {
                Some(&index) => index,
                None => {
                    let own = MechanicalElement::new(&places, poisson);
                    shapes.push(own.ok_or_else(|| fault("volume of an element", f64::NAN, "above 0"))?);
                    known.insert(key, shapes.len() as u32 - 1);
                    shapes.len() as u32 - 1
                }
            };
            shape.push(index);
        }
        Ok(Self {
            mesh,
            shapes,
            shape,
            poisson,
            tolerance: TOLERANCE,
            rollers: Vec::new(),
            state: BodyState {
                strains: vec![Vec::new(); count],
                stresses: vec![[[0.0; 6]; GAUSS_POINTS]; count],
                displacement: vec![[0.0; 3]; mesh.points.len()],
                iterations: 0,
                rotations: vec![[0.0; 3]; count],
                balance: EnergyBalance::default(),
            },
        })
    }

    /// Activates elements, free of stress and strain.
    pub fn activate(&mut self, elements: impl IntoIterator<Item = usize>, branches: usize) {
        for element in elements {
            self.state.strains[element] = vec![[[0.0; 6]; GAUSS_POINTS]; branches];
            self.state.stresses[element] = [[0.0; 6]; GAUSS_POINTS];
            self.state.rotations[element] = [0.0; 3];
        }
    }

    pub(super) fn shape_of(&self, element: usize) -> &MechanicalElement {
        &self.shapes[self.shape[element] as usize]
    }

    /// Largest rotation of an element since it solidified, rad. The theory assumes small strains: a rotation
    /// θ appears as a strain ½θ².
    pub fn largest_rotation(&self) -> f64 {
        self.state.rotations.iter().map(|r| r[0].hypot(r[1]).hypot(r[2])).fold(0.0, f64::max)
    }

    /// Cauchy stress at a Gauss point, Pa: xx, yy, zz, xy, yz, zx.
    pub fn stress(&self, element: usize, point: usize) -> [f64; 6] {
        self.shape_of(element).stress(&VoigtVector::from(self.state.stresses[element][point])).into()
    }

    /// Number of Gauss points of an element.
    pub fn points(&self, element: usize) -> usize {
        self.shape_of(element).weights().len()
    }

    /// Volume average of an element's stress over its Gauss points, Pa.
    pub fn mean_stress(&self, element: usize) -> [f64; 6] {
        let weights = self.shape_of(element).weights();
        let volume: f64 = weights.iter().sum();
        let points = (0..weights.len()).map(|point| (self.stress(element, point), weights[point] / volume));
        points.fold([0.0; 6], |sum, (stress, share)| std::array::from_fn(|k| sum[k] + share * stress[k]))
    }

    /// Nodes with rollers and their normals among free components.
    pub(super) fn normals(&self, free: &[[bool; 3]]) -> Vec<(usize, Vector3<f64>)> {
        let own = |roller: &Roller| {
            let node = roller.node as usize;
            let normal = Vector3::from_fn(|d, _| if free[node][d] { roller.normal[d] } else { 0.0 });
            // of a held node nothing is left
            (normal.norm() > SMALLEST_NORMAL).then(|| (node, normal.normalize()))
        };
        self.rollers.iter().filter_map(own).collect()
    }

    /// Nodes of an element.
    pub(super) fn nodes(&self, element: usize) -> &'a [u32] {
        self.mesh.nodes(element as u32)
    }
}

/// Removes the components along normals.
pub(super) fn slide(vectors: &mut [Vector3<f64>], normals: &[(usize, Vector3<f64>)]) {
    for (node, normal) in normals {
        let along = normal.dot(&vectors[*node]);
        vectors[*node] -= normal * along;
    }
}

/// Initial positions of an element's nodes.
pub(super) fn places(mesh: &Mesh, element: u32) -> Vec<[f64; 3]> {
    mesh.nodes(element).iter().map(|&node| mesh.points[node as usize]).collect()
}

/// Position of a Gauss point.
pub(super) fn gauss_position(places: &[[f64; 3]], point: usize) -> [f64; 3] {
    let mut place = [0.0; 3];
    for (node, share) in places.iter().zip(element_kind::shares(places.len(), point)) {
        (0..3).for_each(|d| place[d] += share * node[d]);
    }
    place
}

/// Mechanical strain increment Δε − Δε* 1.
pub(super) fn mechanical(strain: &VoigtVector, free: f64) -> [f64; 6] {
    std::array::from_fn(|k| strain[k] - if k < 3 { free } else { 0.0 })
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
