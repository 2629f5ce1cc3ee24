//! Side of a part that lies on the bed: its nodes, its supports after release, its warpage.

use crate::error::Error;
use crate::mechanics::FixedComponent;
use crate::mesh::Mesh;
use crate::mesh::surface::OuterSurface;
use nalgebra::{Matrix3, Matrix3xX, Vector3};
use std::collections::{HashMap, HashSet};

/// Returns the bed nodes, ascending: nodes of bearing elements on a named surface ([`OuterSurface::region`]),
/// or by default those shared with other elements.
///
/// # Errors
/// [`Error::Unknown`] for a name that the mesh lacks.
pub fn bed_nodes(mesh: &Mesh, bears: &[bool], surface: Option<&str>) -> Result<Vec<u32>, Error> {
    let nodes_of = |bearing: bool| -> HashSet<u32> {
        let chosen = (0..bears.len() as u32).filter(|&element| bears[element as usize] == bearing);
        chosen.flat_map(|element| mesh.nodes(element).iter().copied()).collect()
    };
    let bearing = nodes_of(true);
    let mut bed: Vec<u32> = match surface {
        Some(name) => {
            let surface = OuterSurface::of_all(mesh)?;
            let faces = surface.all_in(&surface.region(mesh, name)?);
            let nodes = faces.iter().flat_map(|face| mesh.face_nodes(*face).to_vec());
            nodes.filter(|node| bearing.contains(node)).collect()
        }
        None => nodes_of(false).intersection(&bearing).copied().collect(),
    };
    bed.sort_unstable();
    bed.dedup();
    Ok(bed)
}

/// Counts the bearing elements that are not connected to the bed through shared nodes.
pub fn loose_elements(mesh: &Mesh, bears: &[bool], bed: &[u32]) -> usize {
    let mut around: HashMap<u32, Vec<u32>> = HashMap::new();
    let bearing = || (0..bears.len() as u32).filter(|&element| bears[element as usize]);
    for element in bearing() {
        mesh.nodes(element).iter().for_each(|&node| around.entry(node).or_default().push(element));
    }
    let mut reached = vec![false; bears.len()];
    let mut next: Vec<u32> = bed.to_vec();
    while let Some(node) = next.pop() {
        for element in around.remove(&node).unwrap_or_default() {
            if !std::mem::replace(&mut reached[element as usize], true) {
                next.extend(mesh.nodes(element));
            }
        }
    }
    bearing().filter(|&element| !reached[element as usize]).count()
}

fn place(mesh: &Mesh, node: u32) -> Vector3<f64> {
    Vector3::from(mesh.points[node as usize])
}

/// Supports 3, 2 and 1 components of three distant nodes of the bed: no rigid motion remains, and no reaction
/// arises.
pub(super) fn statically_determinate(mesh: &Mesh, bed: &[u32]) -> Vec<FixedComponent> {
    let place = |node: u32| place(mesh, node);
    let farthest = |of: &dyn Fn(u32) -> f64| {
        bed.iter().copied().max_by(|&a, &b| of(a).total_cmp(&of(b)).then(b.cmp(&a))).unwrap_or(0)
    };
    let first = bed.first().copied().unwrap_or(0);
    let second = farthest(&|node| (place(node) - place(first)).norm());
    let along = (place(second) - place(first)).normalize();
    let third = farthest(&|node| (place(node) - place(first)).cross(&along).norm());
    let normal = along.cross(&(place(third) - place(first)));
    let (axis, upright) = (along.iamax(), normal.iamax());
    let mut supports: Vec<FixedComponent> = (0..3).map(|d| (first, d)).collect();
    supports.extend((0..3).filter(|&d| d != axis).map(|d| (second, d)));
    supports.push((third, upright));
    supports
}

/// Subtracts the rigid motion t + ω × (x − x̄), by least squares over the displacements of the bed, m.
pub(super) fn remove_rigid_motion(mesh: &Mesh, bed: &[u32], displacement: &mut [[f64; 3]]) {
    let centre = bed.iter().map(|&node| place(mesh, node)).sum::<Vector3<f64>>() / bed.len() as f64;
    let (mut matrix, mut turn, mut shift) = (Matrix3::zeros(), Vector3::zeros(), Vector3::zeros());
    for &node in bed {
        let arm = place(mesh, node) - centre;
        let u = Vector3::from(displacement[node as usize]);
        matrix += Matrix3::identity() * arm.norm_squared() - arm * arm.transpose();
        turn += arm.cross(&u);
        shift += u / bed.len() as f64;
    }
    let turn = matrix.try_inverse().unwrap_or_default() * turn;
    for (u, at) in displacement.iter_mut().zip(&mesh.points) {
        let rigid = shift + turn.cross(&(Vector3::from(*at) - centre));
        (0..3).for_each(|d| u[d] -= rigid[d]);
    }
}

/// Returns the range of distances of points from their least-squares plane, m.
pub(super) fn out_of_flatness(places: &[[f64; 3]]) -> f64 {
    let count = places.len() as f64;
    let mean: [f64; 3] = std::array::from_fn(|d| places.iter().map(|p| p[d]).sum::<f64>() / count);
    let rows = Matrix3xX::from_fn(places.len(), |d, k| places[k][d] - mean[d]);
    let eigen = (&rows * rows.transpose()).symmetric_eigen();
    let normal = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let distances = rows.column_iter().map(|place| place.dot(&normal));
    let [low, high] = distances.fold([0.0_f64; 2], |[low, high], x| [low.min(x), high.max(x)]);
    high - low
}
