//! A cube with a closed-form finite-element solution: three faces through the origin held, the others
//! insulated.
//!
//! On equal cubes of edge h the products of sin((m + ½)πj/N) are eigenvectors of both the conduction matrix
//! and the lumped capacity, with c_d = cos((m_d + ½)π/N) and
//! λ = (α/h²) Σ_d 2(1 − c_d) Π_{e≠d} (2 + c_e)/3.
//! So the solution in continuous time (e^{−λt}) and that of a time scheme (a product of its amplification
//! factors) are known to rounding, and errors of time steps and linear solvers are measured without the error
//! in space.

use crate::boundary::{Condition, Field};
use crate::material::{Conductor, ThermalProperty};
use crate::mesh::Grid;
use crate::problem::Problem;
use crate::simulation::Simulation;
use std::f64::consts::PI;
use std::sync::Arc;

/// Edge, m.
const EDGE: f64 = 0.01;
/// Conductivity of PA12, W/(m K).
const CONDUCTIVITY: f64 = 0.25;
/// Density of PA12, kg/m³.
const DENSITY: f64 = 1010.0;
/// Specific heat of PA12, J/(kg K).
const SPECIFIC_HEAT: f64 = 2200.0;
/// Temperature of the held faces, K.
const COLD: f64 = 353.15;
/// Largest initial temperature, K.
const HOT: f64 = 493.15;

/// End time, s: Fo = 0.3.
pub const END: f64 = 266.64;

/// Initial temperature of the cube.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CubeStart {
    /// Slowest eigenvector.
    Smooth,
    /// Uniform, with a jump at the held faces.
    Quenched,
}

/// A cube of N³ elements.
pub struct Cube {
    elements: usize,
    start: CubeStart,
}

impl Cube {
    /// Returns a cube with `elements` along an edge.
    pub fn new(elements: usize, start: CubeStart) -> Self {
        Self { elements, start }
    }

    /// Number of equations.
    pub fn size(&self) -> usize {
        (self.elements + 1).pow(3)
    }

    /// Returns the finite-element problem.
    pub fn problem(&self) -> Result<Problem, crate::Error> {
        let mesh = Grid::uniform([0.0; 3], [EDGE; 3], [self.elements; 3])?.mesh("cube")?;
        let property = ThermalProperty::constant;
        let (k, c) = (property("k", CONDUCTIVITY)?, property("c", SPECIFIC_HEAT)?);
        let mut nodes: Vec<u32> =
            ["left", "front", "bottom"].iter().flat_map(|side| mesh.node_sets[*side].clone()).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let conditions = vec![Condition::Temperature { nodes, value: Field::constant(COLD) }];
        let material = Arc::new(Conductor::new(DENSITY, k, c)?);
        let (start, sine) = (self.start, |x: f64| (0.5 * PI * x / EDGE).sin());
        let initial = Field::function(move |place, _| match start {
            CubeStart::Smooth => COLD + (HOT - COLD) * place.map(sine).iter().product::<f64>(),
            CubeStart::Quenched => HOT,
        });
        Ok(Problem { conditions, initial, ..Problem::new(mesh, material, HOT) })
    }

    /// Temperatures of all nodes, K, x fastest, with each eigenvector multiplied by `factor` of its λ (1/s).
    pub fn exact(&self, factor: impl Fn(f64) -> f64) -> Vec<f64> {
        let count = self.elements;
        let angle = |mode: usize| (mode as f64 + 0.5) * PI / count as f64;
        let sine = |mode: usize, node: usize| (angle(mode) * node as f64).sin();
        // expansion of the temperature 1 at all free nodes; the last has half a cell
        let coefficient = |mode: usize| match self.start {
            CubeStart::Smooth => f64::from(u8::from(mode == 0)),
            CubeStart::Quenched => {
                let weight = |node: usize| if node == count { 0.5 } else { 1.0 };
                2.0 / count as f64 * (1..=count).map(|node| weight(node) * sine(mode, node)).sum::<f64>()
            }
        };
        let coefficients: Vec<f64> = (0..count).map(coefficient).collect();
        let cosines: Vec<f64> = (0..count).map(|mode| angle(mode).cos()).collect();
        let spacing = EDGE / count as f64;
        let scale = CONDUCTIVITY / (DENSITY * SPECIFIC_HEAT * spacing * spacing);
        let mut values = vec![0.0; count * count * count];
        for (index, value) in values.iter_mut().enumerate() {
            let modes = [index % count, index / count % count, index / (count * count)];
            let c = modes.map(|mode| cosines[mode]);
            let across = |a: f64, b: f64| (2.0 + a) * (2.0 + b) / 9.0;
            let sum = (1.0 - c[0]) * across(c[1], c[2])
                + (1.0 - c[1]) * across(c[0], c[2])
                + (1.0 - c[2]) * across(c[0], c[1]);
            let amplitude: f64 = modes.iter().map(|&mode| coefficients[mode]).product();
            *value = amplitude * factor(2.0 * scale * sum);
        }
        // transform modes to nodes along one axis after the other; each pass rotates the axes by one
        for _ in 0..3 {
            let lines = values.len() / count;
            let mut next = vec![0.0; lines * (count + 1)];
            for node in 1..=count {
                let sines: Vec<f64> = (0..count).map(|mode| sine(mode, node)).collect();
                for line in 0..lines {
                    let modes = &values[line * count..(line + 1) * count];
                    next[node * lines + line] = modes.iter().zip(&sines).map(|(v, s)| v * s).sum();
                }
            }
            values = next;
        }
        values.into_iter().map(|share| COLD + (HOT - COLD) * share).collect()
    }

    /// Returns the mean square difference to [`Self::exact`] at the nodes, K².
    pub fn mean_square(&self, simulation: &Simulation, factor: impl Fn(f64) -> f64) -> f64 {
        let exact = self.exact(factor);
        let found = simulation.temperatures(f64::NAN);
        found.iter().zip(&exact).map(|(found, exact)| (found - exact).powi(2)).sum::<f64>()
            / exact.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact::Wall;

    /// The initial state is reproduced; many elements approach the product of three walls with held faces
    /// (Carslaw & Jaeger).
    #[test]
    fn closed_form_of_start_and_decay() {
        for start in [CubeStart::Smooth, CubeStart::Quenched] {
            let cube = Cube::new(5, start);
            let problem = cube.problem().unwrap();
            for (place, exact) in problem.mesh.points.iter().zip(cube.exact(|_| 1.0)) {
                let held = place.contains(&0.0);
                let expected = if held { COLD } else { problem.initial.value_at(*place, 0.0) };
                // rounding of sums of 5³ modes of 140 K
                assert!((exact - expected).abs() < 1e-11, "{place:?}: {exact}, {expected}");
            }
        }
        let errors = [8, 16].map(|elements| {
            let cube = Cube::new(elements, CubeStart::Quenched);
            let exact = cube.exact(|lambda| (-lambda * END).exp());
            let fourier = CONDUCTIVITY / (DENSITY * SPECIFIC_HEAT) * END / (EDGE * EDGE);
            let wall = Wall { biot: f64::INFINITY }.share(0.0, fourier);
            (exact[exact.len() - 1] - COLD) / (HOT - COLD) - wall.powi(3)
        });
        // of second order: (πh/2L)²/12 of the exponent
        assert!(errors[1].abs() < 2e-3 && (errors[0] / errors[1] - 4.0).abs() < 0.2, "{errors:?}");
    }

    /// Finite elements step like their eigenvectors.
    #[test]
    fn backward_euler_is_a_product() {
        let cube = Cube::new(4, CubeStart::Quenched);
        let settings = crate::simulation::Settings {
            tolerance: 1e-9,
            ..crate::simulation::Settings::backward_euler(10.0)
        };
        let mut simulation = Simulation::new(cube.problem().unwrap(), settings).unwrap();
        simulation.run_until(20.0).unwrap();
        let error = cube.mean_square(&simulation, |lambda| (1.0 + 10.0 * lambda).powi(-2)).sqrt();
        assert!(error < 1e-8, "{error}");
    }
}
