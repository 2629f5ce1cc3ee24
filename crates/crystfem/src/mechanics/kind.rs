//! Elements of all kinds.

use super::element::{Hexahedron, Modal, POINTS, Six, Wide};
use super::tetrahedron::{self, Tetrahedron};

/// Nodes of an element at most.
pub const MOST: usize = 10;
/// A hexahedron of 8 nodes, or a tetrahedron of 4 or 10.
#[derive(Clone, Debug)]
pub enum Element {
    /// 8 nodes, 8 Gauss points.
    Hexahedron(Box<Hexahedron>),
    /// 4 nodes and 1 Gauss point, or 10 and 4.
    Tetrahedron(Box<Tetrahedron>),
}

/// Returns whether stress can be computed in an element of this number of nodes.
pub fn is_known(nodes: usize) -> bool {
    matches!(nodes, 4 | 8 | 10)
}

/// Number of Gauss points of an element of so many nodes.
pub fn points(nodes: usize) -> usize {
    match nodes {
        4 => 1,
        10 => 4,
        _ => POINTS,
    }
}

/// Shares of the nodes at a Gauss point of an element of so many nodes.
pub fn shares(nodes: usize, point: usize) -> [f64; MOST] {
    if nodes != 8 {
        return tetrahedron::shares(nodes, point);
    }
    let own = Hexahedron::shapes(point);
    std::array::from_fn(|node| own.get(node).copied().unwrap_or(0.0))
}

/// Elements of one shape have one key: their edges to 1e-12 of their size.
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

impl Element {
    /// Builds the element of 8, 4 or 10 nodes, m; `None` of others, and where it is turned inside out.
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

    /// K̂ over the modulus, without what is condensed, column by column.
    pub fn condensed(&self) -> &[f64] {
        match self {
            Self::Hexahedron(own) => own.condensed.as_slice(),
            Self::Tetrahedron(own) => &own.stiffness,
        }
    }

    /// σ over the modulus of an elastic strain.
    pub fn stress(&self, strain: &Six) -> Six {
        match self {
            Self::Hexahedron(own) => own.stress(strain),
            Self::Tetrahedron(own) => own.stress(strain),
        }
    }

    /// See [`Hexahedron::forces`].
    pub fn forces(&self, stresses: &[Six; POINTS]) -> (Wide, Modal) {
        match self {
            Self::Hexahedron(own) => {
                let (nodal, modal) = own.forces(stresses);
                let mut all = Wide::zeros();
                all.fixed_rows_mut::<24>(0).copy_from(&nodal);
                (all, modal)
            }
            Self::Tetrahedron(own) => (own.forces(stresses), Modal::zeros()),
        }
    }

    /// See [`Hexahedron::strains`].
    pub fn strains(&self, displacement: &Wide, modal: &Modal, modulus: f64) -> [Six; POINTS] {
        match self {
            Self::Hexahedron(own) => {
                own.strains(&displacement.fixed_rows::<24>(0).into_owned(), modal, modulus)
            }
            Self::Tetrahedron(own) => own.strains(displacement),
        }
    }

    /// Half the curl of nodal displacements in the middle, rad.
    pub fn rotation(&self, displacement: &Wide) -> [f64; 3] {
        match self {
            Self::Hexahedron(own) => own.rotation(&displacement.fixed_rows::<24>(0).into_owned()),
            Self::Tetrahedron(own) => own.rotation(displacement),
        }
    }
}
