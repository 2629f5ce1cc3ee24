//! Compensation of warpage: a mesh with the opposite displacement, and a scale of each layer.

use super::stress::{StressCoupling, StressSettings};
use crate::error::Error;
use crate::mesh::Mesh;
use crate::problem::Problem;
use crate::simulation::{Settings, Simulation};
use std::sync::Arc;

/// Scale of a layer in its plane that cancels its mean strain.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerScale {
    /// Mean height of the nodes, m.
    pub height: f64,
    /// Factors on x and y about the centre of the layer (of [`axial_scales`] about the z axis): 1/(1 + ε), ε
    /// the slope of the displacement by least squares; 1 along an axis in which the layer has no extent.
    pub factors: [f64; 2],
    /// Shift of the layer in x and y, m: the opposite of its mean displacement.
    pub shift: [f64; 2],
}

/// Returns the scale of each layer, given as elements, from displacements of the nodes, m, three a node; NaN
/// for nodes that do not count. Layers without such nodes are left out.
pub fn layer_scales(mesh: &Mesh, layers: &[Vec<u32>], displacement: &[f64]) -> Vec<LayerScale> {
    let scale = |layer: &Vec<u32>| {
        let mut nodes: Vec<u32> = layer.iter().flat_map(|&element| mesh.nodes(element)).copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes.retain(|&node| displacement[3 * node as usize].is_finite());
        let mean = |of: &dyn Fn(usize) -> f64| {
            nodes.iter().map(|&node| of(node as usize)).sum::<f64>() / nodes.len() as f64
        };
        let along = |d: usize| {
            let (centre, moved) = (mean(&|n| mesh.points[n][d]), mean(&|n| displacement[3 * n + d]));
            let square = mean(&|n| (mesh.points[n][d] - centre).powi(2));
            let slope = mean(&|n| (mesh.points[n][d] - centre) * (displacement[3 * n + d] - moved));
            (if square > 0.0 { 1.0 / (1.0 + slope / square) } else { 1.0 }, -moved)
        };
        let [x, y] = [along(0), along(1)];
        let height = mean(&|n| mesh.points[n][2]);
        (!nodes.is_empty()).then_some(LayerScale { height, factors: [x.0, y.0], shift: [x.1, y.1] })
    };
    layers.iter().filter_map(scale).collect()
}

/// Returns the scale of each layer of a sector whose cuts are planes of symmetry through the z axis: one
/// factor about the axis, 1/(1 + ε) with u = ε r by least squares, and no shift. Other arguments are those of
/// [`layer_scales`].
pub fn axial_scales(mesh: &Mesh, layers: &[Vec<u32>], displacement: &[f64]) -> Vec<LayerScale> {
    let mut scales = Vec::new();
    for layer in layers {
        // a layer alone, with the heights of its nodes
        let Some(own) = layer_scales(mesh, std::slice::from_ref(layer), displacement).pop() else { continue };
        let mut nodes: Vec<usize> =
            layer.iter().flat_map(|&element| mesh.nodes(element)).map(|&node| node as usize).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes.retain(|node| displacement[3 * node].is_finite());
        let sum = |of: &dyn Fn(usize, usize) -> f64| {
            nodes.iter().map(|&node| of(node, 0) + of(node, 1)).sum::<f64>()
        };
        let square = sum(&|node, d| mesh.points[node][d].powi(2));
        let slope = sum(&|node, d| mesh.points[node][d] * displacement[3 * node + d]);
        let factor = if square > 0.0 { 1.0 / (1.0 + slope / square) } else { 1.0 };
        scales.push(LayerScale { factors: [factor; 2], shift: [0.0; 2], ..own });
    }
    scales
}

/// Returns the mesh with each node moved by the opposite of its displacement, m, three a node; NaN moves
/// nothing.
pub fn opposite(mesh: &Mesh, displacement: &[f64]) -> Mesh {
    let mut moved = mesh.clone();
    for (point, u) in moved.points.iter_mut().zip(displacement.chunks_exact(3)) {
        (0..3).filter(|&d| u[d].is_finite()).for_each(|d| point[d] -= u[d]);
    }
    moved
}

/// Prints a compensated shape in simulation to the time `end`, s, and returns the largest distance of a node
/// from its place in the mesh of `problem` over the largest `displacement` of the uncompensated print: 0 if
/// the compensation is complete, 1 if it is useless.
///
/// # Errors
/// Errors of both simulations, [`Error::Mesh`] for elements that the opposite displacement inverts.
pub fn residual(
    problem: &Problem,
    settings: Settings,
    stress: StressSettings,
    end: f64,
    displacement: &[f64],
) -> Result<f64, Error> {
    let mesh = opposite(&problem.mesh, displacement);
    let problem_of_shape = Arc::new(Problem { mesh, ..problem.clone() });
    let mesh = &problem_of_shape.mesh;
    let release = stress.release_at.filter(|&time| time > 0.0 && time < end);
    let mut coupling = StressCoupling::new(mesh, stress)?;
    let mut simulation = Simulation::new(Arc::clone(&problem_of_shape), settings)?;
    coupling.after_step(&simulation)?;
    for until in release.into_iter().chain([end]) {
        simulation.observe(until, |simulation| coupling.after_step(simulation))?;
    }
    coupling.finish(&simulation)?;
    let moved = coupling.displacement();
    let (mut left, mut largest) = (0.0_f64, 0.0_f64);
    for (node, nominal) in problem.mesh.points.iter().enumerate() {
        let own = |of: &dyn Fn(usize) -> f64| (0..3).map(|d| of(d).powi(2)).sum::<f64>().sqrt();
        let distance = own(&|d| mesh.points[node][d] + moved[3 * node + d] - nominal[d]);
        if distance.is_finite() {
            left = left.max(distance);
            largest = largest.max(own(&|d| displacement[3 * node + d]));
        }
    }
    Ok(if largest > 0.0 { left / largest } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Bar, abaqus};
    use evidence::near;

    /// A quarter of a tube that shrinks by 2 % towards its axis: one factor about the axis, no shift.
    #[test]
    fn a_sector_is_scaled_about_its_axis() {
        let mut mesh = Bar::new([20e-3, 5e-3], 2, 1e-3).mesh().unwrap();
        // radius from x, angle from y
        for point in &mut mesh.points {
            let (radius, angle) = (0.01 + 0.1 * point[0], point[1] / 5e-3 * std::f64::consts::FRAC_PI_2);
            (point[0], point[1]) = (radius * angle.cos(), radius * angle.sin());
        }
        let layers = vec![(0..mesh.element_count() as u32).collect::<Vec<u32>>()];
        let moved: Vec<f64> = mesh.points.iter().flat_map(|p| [-0.02 * p[0], -0.02 * p[1], 1e-4]).collect();
        let scales = axial_scales(&mesh, &layers, &moved);
        for d in 0..2 {
            near("compensation_axial_scale", scales[0].factors[d], 1.0 / 0.98, 1e-12);
        }
        assert_eq!((scales.len(), scales[0].shift), (1, [0.0; 2]));
        // about its centre, the sector would be moved off the axis
        assert!(layer_scales(&mesh, &layers, &moved)[0].shift[0] > 1e-5);
    }

    /// Layers that shrink by 1 and 2 % along x and are moved get the factors 1/0.99 and 1/0.98; the mesh with
    /// the opposite displacement has the same elements and is read back from its file.
    #[test]
    fn layers_are_scaled_back() {
        let mesh = Bar::new([20e-3, 5e-3], 2, 1e-3).mesh().unwrap();
        let layers = crate::mesh::layers::Layers::from_sets(&mesh, "layer-").unwrap().elements;
        for (layer, strain) in [(0, -0.01), (1, -0.02)] {
            let mut moved = vec![f64::NAN; 3 * mesh.points.len()];
            for &node in layers[layer].iter().flat_map(|&element| mesh.nodes(element)) {
                let own = 3 * node as usize;
                moved[own..own + 3].copy_from_slice(&[strain * mesh.points[own / 3][0] + 1e-4, 2e-4, 0.0]);
            }
            let scales = layer_scales(&mesh, &layers[layer..=layer], &moved);
            near("compensation_scale", scales[0].factors[0], 1.0 / (1.0 + strain), 1e-12);
            near("compensation_scale_y", scales[0].factors[1], 1.0, 1e-12);
            near("compensation_shift", scales[0].shift[1], -2e-4, 1e-15);
            let shape = opposite(&mesh, &moved);
            let mut text = Vec::new();
            abaqus::write(&shape, true, &mut text).unwrap();
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("compensated.inp");
            std::fs::write(&path, text).unwrap();
            let read = crate::mesh::read(&path, 1.0).unwrap().mesh;
            assert_eq!((read.hexahedra, read.element_sets), (shape.hexahedra, shape.element_sets));
            for ((found, own), (nominal, u)) in
                read.points.iter().zip(&shape.points).zip(mesh.points.iter().zip(moved.chunks(3)))
            {
                for d in 0..3 {
                    near("compensation_file", found[d], own[d], 1e-12);
                    let expected = if u[d].is_nan() { nominal[d] } else { nominal[d] - u[d] };
                    assert_eq!(own[d], expected);
                }
            }
        }
    }
}
