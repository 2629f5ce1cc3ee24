//! Material states as fields over nodes and elements.

use crate::element::{self, FIRST_ORDER_NODES, MAX_ELEMENT_NODES, MAX_ELEMENT_POINTS};
use crate::error::Error;
use crate::simulation::Simulation;
use crate::system::{NONE, PointStates};

/// Volume-weighted statistics of a field over nodes; not finite if a value is not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// Volume-weighted mean.
    pub mean: f64,
    /// Smallest value.
    pub least: f64,
    /// Largest value.
    pub largest: f64,
    /// Volume-weighted standard deviation.
    pub deviation: f64,
}

impl Statistics {
    /// Computes the statistics over nodes that have a value and a volume; `None` if there are none.
    pub fn new(values: &[Option<f64>], volumes: &[f64]) -> Option<Self> {
        let (mut sum, mut volume) = (0.0, 0.0);
        let (mut least, mut largest) = (f64::INFINITY, f64::NEG_INFINITY);
        let present = || {
            let with_volume = values.iter().zip(volumes).filter(|(_, volume)| **volume > 0.0);
            with_volume.filter_map(|(value, volume)| Some(((*value)?, *volume)))
        };
        for (value, weight) in present() {
            sum += value * weight;
            volume += weight;
            least = least.min(value);
            largest = largest.max(value);
        }
        let mean = sum / volume;
        // `min` and `max` pass over NaN
        let known = |extreme: f64| if mean.is_finite() { extreme } else { mean };
        let squares = present().map(|(value, weight)| weight * (value - mean).powi(2)).sum::<f64>();
        let deviation = (squares / volume).sqrt();
        (volume > 0.0).then(|| Self { mean, least: known(least), largest: known(largest), deviation })
    }
}

impl Simulation {
    /// Names of the output quantities of all materials, without duplicates, in the order of the materials.
    pub fn field_names(&self) -> Vec<&'static str> {
        self.problem.field_names()
    }

    /// Returns a quantity of a material at one of its points; `None` if the material lacks it.
    fn value(
        &self,
        name: &str,
        points: &PointStates,
        stride: usize,
        point: usize,
        material: u16,
    ) -> Option<f64> {
        let law = &self.problem.materials[usize::from(material)];
        let (states, names) = (law.state_names().len(), law.field_names());
        let place = names.iter().position(|other| *other == name)?;
        let mut values = [0.0; 16];
        let values = values.get_mut(..names.len())?;
        law.fields(&points.state[point * stride..point * stride + states], values);
        Some(values[place])
    }

    /// Returns Σ m f and Σ m over the points at a node.
    fn at_node(&self, name: &str, equation: usize) -> [f64; 2] {
        let (nodal, points) = (&self.system.nodal, &self.state.memory.nodal);
        let mut sums = [0.0; 2];
        for point in nodal.points_of(equation) {
            if let Some(value) = self.value(name, points, nodal.stride, point, nodal.material[point]) {
                let mass = self.system.mass(&self.problem, &self.state.born, equation, point);
                sums[0] += mass * value;
                sums[1] += mass;
            }
        }
        sums
    }

    /// [`Self::field`] at a node if all points are at nodes.
    fn mean_at(&self, name: &str, node: u32) -> Option<f64> {
        let equation = self.system.equation.get(node as usize).filter(|equation| **equation != NONE)?;
        let [sum, mass] = self.at_node(name, *equation as usize);
        (mass > 0.0).then(|| sum / mass)
    }

    /// [`Self::field`] at some nodes; computes no others if all points are at nodes.
    pub fn field_of(&self, name: &str, nodes: &[u32]) -> Vec<Option<f64>> {
        if !self.system.general.is_empty() {
            let field = self.field(name);
            return nodes.iter().map(|&node| field[node as usize]).collect();
        }
        nodes.iter().map(|&node| self.mean_at(name, node)).collect()
    }

    /// Returns a quantity at all nodes of the mesh: the mass-weighted mean of the points at each; `None` at
    /// nodes without material that has it.
    pub fn field(&self, name: &str) -> Vec<Option<f64>> {
        let (problem, system) = (&self.problem, &self.system);
        let nodes = problem.mesh.points.len();
        if system.general.is_empty() {
            return (0..nodes as u32).map(|node| self.mean_at(name, node)).collect();
        }
        let (mut sum, mut mass) = (vec![0.0; nodes], vec![0.0; nodes]);
        for (equation, &node) in system.nodes().iter().enumerate() {
            let [own, of_mass] = self.at_node(name, equation);
            sum[node as usize] += own;
            mass[node as usize] += of_mass;
        }
        for (index, &number) in system.general.elements.iter().enumerate() {
            let material = problem.material_of[number as usize];
            let law = &problem.materials[usize::from(material)];
            if !law.field_names().contains(&name) {
                continue;
            }
            let nodes = problem.mesh.nodes(number);
            let first = system.general.starts[index] as usize;
            let density = law.density();
            let (points, stride) = (&self.state.memory.general, system.general.stride);
            let mut add = |node: u32, weight: f64, point: usize| {
                if let Some(value) = self.value(name, points, stride, point, material) {
                    sum[node as usize] += weight * value;
                    mass[node as usize] += weight;
                }
            };
            if nodes.len() > FIRST_ORDER_NODES {
                // all points of a second-order element, weighted by the squared shape function
                let Some(geometry) = problem.mesh.geometry(number) else { continue };
                let shapes = element::shapes::<MAX_ELEMENT_NODES, MAX_ELEMENT_POINTS>(nodes.len());
                for (g, shapes) in shapes.iter().enumerate().take(geometry.points) {
                    for (&node, shape) in nodes.iter().zip(shapes) {
                        add(node, density * geometry.weights[g] * shape * shape, first + g);
                    }
                }
                continue;
            }
            let volumes = problem.mesh.node_volumes(number).unwrap_or([0.0; MAX_ELEMENT_NODES]);
            for (g, &node) in nodes.iter().enumerate() {
                add(node, density * volumes[g], first + g);
            }
        }
        sum.iter().zip(&mass).map(|(sum, mass)| (*mass > 0.0).then(|| sum / mass)).collect()
    }

    /// Returns a quantity in each element: the mean over the element's points; `None` if the element does not
    /// exist or its material lacks it.
    pub fn element_means(&self, name: &str) -> Vec<Option<f64>> {
        let (problem, system) = (&self.problem, &self.system);
        let mean = |sum: f64, count: usize| (count > 0).then(|| sum / count as f64);
        let mut means = vec![None; problem.material_of.len()];
        for (element, slot) in
            means.iter_mut().enumerate().filter(|(element, _)| self.is_born(*element as u32))
        {
            let (material, birth) = (problem.material_of[element], self.state.born[element]);
            // general materials have no points at nodes, uniform or not
            let like = system.nodal.like[usize::from(material)];
            let (mut sum, mut count) = (0.0, 0);
            for &node in problem.mesh.nodes(element as u32) {
                let equation = system.equation[node as usize];
                let own = |point: &usize| {
                    system.nodal.material[*point] == like && system.nodal.birth[*point] == birth
                };
                let found = system.nodal.points_of(equation as usize).find(own);
                let (points, stride) = (&self.state.memory.nodal, system.nodal.stride);
                let found = found.and_then(|point| self.value(name, points, stride, point, material));
                if let Some(found) = found {
                    (sum, count) = (sum + found, count + 1);
                }
            }
            *slot = mean(sum, count);
        }
        for (index, &element) in system.general.elements.iter().enumerate() {
            let material = problem.material_of[element as usize];
            let own = system.general.starts[index] as usize..system.general.starts[index + 1] as usize;
            let (count, points, stride) = (own.len(), &self.state.memory.general, system.general.stride);
            let sum: Option<f64> = own.map(|point| self.value(name, points, stride, point, material)).sum();
            means[element as usize] = sum.and_then(|sum| mean(sum, count));
        }
        means
    }

    /// Returns a quantity at a position, interpolated from [`Self::field`]; `None` without a material that
    /// has it.
    pub fn field_at(&self, name: &str, place: [f64; 3]) -> Option<f64> {
        let field = self.field(name);
        self.problem.mesh.locate(place)?.value(|node| field[node as usize])
    }

    /// Checks that temperatures, energies and state variables are finite.
    ///
    /// # Errors
    /// [`Error::NotFinite`] with the first that is not, its node and the time.
    pub fn check_finite(&self) -> Result<(), Error> {
        let (problem, system, state) = (&self.problem, &self.system, &self.state);
        let fail = |quantity: &'static str, node: u32| {
            let [x, y, z] = problem.mesh.points[node as usize].map(|x| (1e9 * x).round() / 1e6);
            let place = format!("node {node}, ({x}, {y}, {z}) mm");
            Err(Error::NotFinite { quantity, place, time: state.time })
        };
        if let Some(wrong) = state.temperature.iter().position(|t| !t.is_finite()) {
            return fail("temperature", system.nodes()[wrong]);
        }
        let wrong = |points: &PointStates, stride: usize| -> Option<(usize, Option<usize>)> {
            let in_state = points.state.iter().position(|x| !x.is_finite());
            let in_energy = || points.energy.iter().position(|x| !x.is_finite()).map(|point| (point, None));
            in_state.map(|at| (at / stride, Some(at % stride))).or_else(in_energy)
        };
        let named = |material: usize, variable: Option<usize>| {
            let names = problem.materials[material].state_names();
            variable.and_then(|variable| names.get(variable)).copied().unwrap_or("energy")
        };
        let (nodal, general) = (&state.memory.nodal, &state.memory.general);
        if let Some((point, variable)) = wrong(nodal, system.nodal.stride) {
            let equation = system.nodal.starts.partition_point(|&first| first as usize <= point) - 1;
            let material = usize::from(system.nodal.material[point]);
            return fail(named(material, variable), system.nodes()[equation]);
        }
        if let Some((point, variable)) = wrong(general, system.general.stride) {
            let index = system.general.starts.partition_point(|&first| first as usize <= point) - 1;
            let number = system.general.elements[index];
            let nodes = problem.mesh.nodes(number);
            // second-order elements have more points than nodes
            let node = nodes[(point - system.general.starts[index] as usize).min(nodes.len() - 1)];
            return fail(named(usize::from(problem.material_of[number as usize]), variable), node);
        }
        Ok(())
    }

    /// Volume of each node within the existing elements among `elements`, m³: weights of means over them.
    pub fn volumes(&self, elements: &[u32]) -> Vec<f64> {
        let mut volumes = vec![0.0; self.problem.mesh.points.len()];
        for &number in elements.iter().filter(|&&element| self.is_born(element)) {
            let own = self.problem.mesh.node_volumes(number).unwrap_or([0.0; MAX_ELEMENT_NODES]);
            for (&node, own) in self.problem.mesh.nodes(number).iter().zip(own) {
                volumes[node as usize] += own;
            }
        }
        volumes
    }
}
