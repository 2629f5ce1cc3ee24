//! Classes of first-order elements with equal shape and material, whose matrices are computed once.

use super::MaterialBehaviour;
use crate::element::{FIRST_ORDER_NODES, Geometry};
use crate::mesh::Mesh;

/// Limit on classes; further shapes get their own matrices.
const MAX_CLASSES: usize = 256;

/// Marks an element with constant conduction and its own matrix.
pub const OWN: u16 = u16::MAX;
/// Marks an element whose conduction depends on temperature or state.
pub const VARYING: u16 = u16::MAX - 1;

/// Matrices of elements that differ only by a translation, to 1e-10 of their size.
pub struct ElementClass {
    material: u16,
    nodes: usize,
    shape: [[f64; 3]; FIRST_ORDER_NODES],
    tolerance: f64,
    /// ∫ ∇N·k∇N dV, W/K.
    pub conduction: [[f64; FIRST_ORDER_NODES]; FIRST_ORDER_NODES],
    /// ∫ ρ c N N dV, J/K; zero for materials that are not linear.
    pub capacity: [[f64; FIRST_ORDER_NODES]; FIRST_ORDER_NODES],
    /// ∫ N dV, m³.
    pub volumes: [f64; FIRST_ORDER_NODES],
}

/// Returns the class of each element that ever exists, or [`OWN`] or [`VARYING`], and the classes.
pub fn classify(
    mesh: &Mesh,
    material_of: &[u16],
    behaviours: &[MaterialBehaviour],
) -> (Vec<u16>, Vec<ElementClass>) {
    let mut classes: Vec<ElementClass> = Vec::new();
    let mut last = 0;
    let kinds = (0..)
        .zip(material_of)
        .map(|(element, &material)| {
            let behaviour = &behaviours[usize::from(material)];
            if behaviour.conductivity.is_none() {
                return VARYING;
            }
            if mesh.nodes(element).len() > FIRST_ORDER_NODES {
                return OWN;
            }
            let (corners, nodes) = mesh.positions::<FIRST_ORDER_NODES>(element);
            let mut shape = [[0.0; 3]; FIRST_ORDER_NODES];
            for k in 0..nodes {
                for d in 0..3 {
                    shape[k][d] = corners[k][d] - corners[0][d];
                }
            }
            let fits = |class: &ElementClass| {
                class.material == material
                    && class.nodes == nodes
                    && (0..nodes)
                        .all(|k| (0..3).all(|d| (class.shape[k][d] - shape[k][d]).abs() <= class.tolerance))
            };
            if classes.get(last).is_some_and(fits) {
                return last as u16;
            }
            if let Some(found) = classes.iter().position(fits) {
                last = found;
                return found as u16;
            }
            if classes.len() == MAX_CLASSES {
                return OWN;
            }
            // elements were checked before
            let Some(geometry) = Geometry::new(&corners[..nodes]) else { return OWN };
            last = classes.len();
            classes.push(ElementClass::new(material, shape, &geometry, behaviour));
            last as u16
        })
        .collect();
    (kinds, classes)
}

impl ElementClass {
    fn new(
        material: u16,
        shape: [[f64; 3]; FIRST_ORDER_NODES],
        geometry: &Geometry,
        behaviour: &MaterialBehaviour,
    ) -> Self {
        let size = shape.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
        let (conduction, capacity) = matrices(geometry, behaviour);
        Self {
            material,
            nodes: geometry.nodes,
            shape,
            tolerance: 1e-10 * size,
            conduction,
            capacity,
            volumes: geometry.corner_volumes,
        }
    }
}

/// Conduction (W/K) and capacity (J/K) of an element; zero if not constant.
pub fn matrices<const N: usize, const P: usize>(
    geometry: &Geometry<N, P>,
    behaviour: &MaterialBehaviour,
) -> ([[f64; N]; N], [[f64; N]; N]) {
    let conduction = behaviour.conductivity.map_or([[0.0; N]; N], |k| geometry.conduction(&k));
    let capacity =
        behaviour.capacity.map_or([[0.0; N]; N], |c| geometry.mass().map(|row| row.map(|m| c * m)));
    (conduction, capacity)
}
