//! Element kinds of the mechanics.

use super::element::{Condensed, ElementVector, GAUSS_POINTS, Hexahedron, ModalVector, VoigtVector};
use super::tetrahedron::{self, Tetrahedron};
use nalgebra::SMatrix;

/// Maximum number of nodes of an element.
pub const MAX_NODES_PER_ELEMENT: usize = 10;
/// A hexahedron of 8 nodes, or a tetrahedron of 4 or 10.
#[derive(Clone, Debug)]
pub enum MechanicalElement {
    /// Hexahedron of 8 nodes and 8 Gauss points.
    Hexahedron(Box<Hexahedron>),
    /// Tetrahedron of 4 nodes and 1 Gauss point, or of 10 and 4.
    Tetrahedron(Box<Tetrahedron>),
}

/// Returns true if stress can be computed in elements with this number of nodes.
pub fn is_supported(nodes: usize) -> bool {
    matches!(nodes, 4 | 8 | 10)
}

/// Number of Gauss points of an element with `nodes` nodes.
pub fn points(nodes: usize) -> usize {
    match nodes {
        4 => 1,
        10 => 4,
        _ => GAUSS_POINTS,
    }
}

/// Shape functions at a Gauss point of an element with `nodes` nodes.
pub fn shares(nodes: usize, point: usize) -> [f64; MAX_NODES_PER_ELEMENT] {
    if nodes != 8 {
        return tetrahedron::shares(nodes, point);
    }
    let own = Hexahedron::shapes(point);
    std::array::from_fn(|node| own.get(node).copied().unwrap_or(0.0))
}

/// Key of a shape: the edges to 1e-12 of their size; equal for elements of the same shape.
pub fn key(places: &[[f64; 3]]) -> Vec<i64> {
    if let Ok(corners) = <&[[f64; 3]; 8]>::try_from(places) {
        return Hexahedron::key(corners);
    }
    let first = places.first().copied().unwrap_or_default();
    let apart = |place: &[f64; 3]| (0..3).map(|d| (place[d] - first[d]).abs()).fold(0.0, f64::max);
    let size = places.iter().map(apart).fold(0.0, f64::max);
    let edges = places
        .iter()
        .flat_map(|place| (0..3).map(move |d| ((place[d] - first[d]) / size * 1e12).round() as i64));
    edges.chain([(size * 1e15).round() as i64]).collect()
}

impl MechanicalElement {
    /// Computes an element from 8, 4 or 10 node positions, m; `None` for other numbers, or if inverted.
    pub fn new(places: &[[f64; 3]], poisson: f64) -> Option<Self> {
        match places.len() {
            8 => Hexahedron::new(places.first_chunk()?, poisson).map(|own| Self::Hexahedron(Box::new(own))),
            4 | 10 => Tetrahedron::new(places, poisson).map(|own| Self::Tetrahedron(Box::new(own))),
            _ => None,
        }
    }

    /// Volumes of the Gauss points, m³.
    pub fn weights(&self) -> &[f64] {
        match self {
            Self::Hexahedron(own) => &own.weights,
            Self::Tetrahedron(own) => &own.weights[..own.points()],
        }
    }

    /// Condensed stiffness K̂ over the modulus, column by column.
    pub fn condensed(&self) -> &[f64] {
        match self {
            Self::Hexahedron(own) => own.condensed.as_slice(),
            Self::Tetrahedron(own) => &own.stiffness,
        }
    }

    /// Stress over the modulus, from an elastic strain.
    pub fn stress(&self, strain: &VoigtVector) -> VoigtVector {
        match self {
            Self::Hexahedron(own) => own.stress(strain),
            Self::Tetrahedron(own) => own.stress(strain),
        }
    }

    /// Nodal and modal forces, see [`Hexahedron::forces`].
    pub fn forces(&self, stresses: &[VoigtVector; GAUSS_POINTS]) -> (ElementVector, ModalVector) {
        match self {
            Self::Hexahedron(own) => {
                let (nodal, modal) = own.forces(stresses);
                let mut all = ElementVector::zeros();
                all.fixed_rows_mut::<24>(0).copy_from(&nodal);
                (all, modal)
            }
            Self::Tetrahedron(own) => (own.forces(stresses), ModalVector::zeros()),
        }
    }

    /// Strain increments, see [`Hexahedron::strains`].
    pub fn strains(
        &self,
        displacement: &ElementVector,
        modal: &ModalVector,
        modulus: f64,
    ) -> [VoigtVector; GAUSS_POINTS] {
        match self {
            Self::Hexahedron(own) => {
                own.strains(&displacement.fixed_rows::<24>(0).into_owned(), modal, modulus)
            }
            Self::Tetrahedron(own) => own.strains(displacement),
        }
    }

    /// Stiffness of moduli at the Gauss points; `None` if singular in the modes of a hexahedron.
    pub(super) fn tangent(&self, moduli: &[SMatrix<f64, 6, 6>; GAUSS_POINTS]) -> Option<ElementTangent> {
        match self {
            Self::Hexahedron(own) => Some(ElementTangent::Hexahedron(Box::new(own.tangent(moduli)?))),
            Self::Tetrahedron(own) => Some(ElementTangent::Tetrahedron(own.tangent(moduli))),
        }
    }

    /// Nodal forces, condensed with a tangent, and modal forces.
    pub(super) fn forces_with(
        &self,
        tangent: &ElementTangent,
        stresses: &[VoigtVector; GAUSS_POINTS],
    ) -> (ElementVector, ModalVector) {
        let (Self::Hexahedron(own), ElementTangent::Hexahedron(tangent)) = (self, tangent) else {
            return self.forces(stresses);
        };
        let (nodal, modal) = own.whole_forces(stresses);
        let mut all = ElementVector::zeros();
        all.fixed_rows_mut::<24>(0).copy_from(&(nodal - tangent.coupling * (tangent.inverse * modal)));
        (all, modal)
    }

    /// Strain increments, with modes by a tangent.
    pub(super) fn strains_with(
        &self,
        tangent: &ElementTangent,
        displacement: &ElementVector,
        modal: &ModalVector,
    ) -> [VoigtVector; GAUSS_POINTS] {
        let (Self::Hexahedron(own), ElementTangent::Hexahedron(tangent)) = (self, tangent) else {
            return self.strains(displacement, modal, 1.0);
        };
        let displacement = displacement.fixed_rows::<24>(0).into_owned();
        let modes = -(tangent.inverse * (modal + tangent.coupling.transpose() * displacement));
        own.strains_of(&displacement, &modes)
    }

    /// Rotation at the centre by nodal displacements, half their curl, rad.
    pub fn rotation(&self, displacement: &ElementVector) -> [f64; 3] {
        match self {
            Self::Hexahedron(own) => own.rotation(&displacement.fixed_rows::<24>(0).into_owned()),
            Self::Tetrahedron(own) => own.rotation(displacement),
        }
    }
}

/// Stiffness of an element of varying moduli.
#[derive(Clone, Debug)]
pub(super) enum ElementTangent {
    /// With the condensation of the modes.
    Hexahedron(Box<Condensed>),
    /// Column by column.
    Tetrahedron(Vec<f64>),
}

impl ElementTangent {
    /// Stiffness, column by column, Pa m.
    pub fn stiffness(&self) -> &[f64] {
        match self {
            Self::Hexahedron(own) => own.stiffness.as_slice(),
            Self::Tetrahedron(own) => own,
        }
    }
}
