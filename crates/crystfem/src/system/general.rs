//! Material points in elements, for materials whose conductivity depends on temperature or state, and with
//! consistent capacity for all materials that are not linear.
//!
//! Point g has the temperature gradient of Gauss point g. With lumped capacity it has the temperature of the
//! adjacent corner g, and its energy is counted there; with consistent capacity it has the temperature of the
//! Gauss point. The matrix contains the symmetric part of −∂f/∂(∇T) without ∂f/∂T, so that it stays
//! symmetric: with varying k Newton's iteration then converges linearly, at a rate given by the relative
//! change of k over the last iterate.
//!
//! If k jumps, that iteration stalls, and with k at points the flux of an element would depend on which of
//! its points the jump has passed. The flux is then −D ∇θ with Kirchhoff's θ = ∫k dT at the nodes (Carslaw &
//! Jaeger, §1.6), exact at the nodes of a line at steady state; its tangent ∇N_a·D∇N_b k(T_b) is complete,
//! and not symmetric.

use super::rows::ConductionRows;
use super::{Evaluation, NONE, PointMoves, PointStates, StepInput};
use crate::element::{self, FIRST_ORDER_NODES, Geometry, MAX_ELEMENT_NODES, MAX_ELEMENT_POINTS};
use crate::error::Error;
use crate::material::PointInput;
use crate::mesh::Mesh;
use crate::problem::Problem;
use nalgebra::Vector3;
use rayon::prelude::*;

/// Number of elements of a work item.
const ITEM: usize = 256;
/// Number of elements evaluated before their sums are added.
const BATCH: usize = 64 * ITEM;

/// Elements with material points.
#[derive(Clone, Debug, Default)]
pub struct ElementPoints {
    /// Elements of the mesh, ascending.
    pub elements: Vec<u32>,
    /// First point of each element, and the number of points.
    pub starts: Vec<u32>,
    /// Equations of all elements' nodes, element by element.
    pub equations: Vec<u32>,
    /// End of each element's equations.
    pub ends: Vec<u32>,
    /// State variables stored for each point.
    pub stride: usize,
    /// True if a flux follows Kirchhoff's potential: the tangent is then not symmetric.
    pub potential: bool,
}

/// Contribution of an element.
struct ElementContribution<const N: usize> {
    change: [f64; N],
    rate: [f64; N],
    capacity: [f64; N],
    /// Conduction and capacity.
    matrices: Option<Box<[[[f64; N]; N]; 2]>>,
    ratio: Option<f64>,
}

impl ElementPoints {
    /// Returns an empty set with `stride` state variables a point.
    pub fn new(stride: usize) -> Self {
        Self { starts: vec![0], stride, ..Self::default() }
    }

    /// Inserts elements, ascending; returns the moves of points.
    pub fn insert(&mut self, mesh: &Mesh, new: &[u32], equation: &[u32]) -> PointMoves {
        let first =
            new.first().map_or(self.elements.len(), |least| self.elements.partition_point(|e| e < least));
        let mut moves = PointMoves { first: self.starts[first] as usize, from: Vec::new() };
        self.equations.truncate(first.checked_sub(1).map_or(0, |before| self.ends[before] as usize));
        let points = self.starts.split_off(first + 1);
        let kept = self.elements.split_off(first);
        self.ends.truncate(first);
        let (mut old, mut added) = (kept.iter().zip(points).peekable(), new.iter().peekable());
        let mut before = moves.first as u32;
        while old.peek().is_some() || added.peek().is_some() {
            let least = old.peek().map_or(NONE, |(element, _)| **element);
            let (element, from) = match added.next_if(|new| **new < least) {
                Some(&element) => (element, None),
                None => {
                    let Some((&element, end)) = old.next() else { break };
                    (element, Some(std::mem::replace(&mut before, end)))
                }
            };
            let nodes = mesh.nodes(element);
            self.elements.push(element);
            self.equations.extend(nodes.iter().map(|&node| equation[node as usize]));
            self.ends.push(self.equations.len() as u32);
            let count = element::points(nodes.len()) as u32;
            moves.from.extend((0..count).map(|point| from.map_or(NONE, |from| from + point)));
            self.starts.push((self.points() + count as usize) as u32);
        }
        moves
    }

    /// Returns true without points.
    pub fn is_empty(&self) -> bool {
        self.elements.is_empty()
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.starts.last().map_or(0, |&points| points as usize)
    }

    /// Equations of an element's nodes.
    pub fn equations_of(&self, index: usize) -> &[u32] {
        let first = index.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.equations[first as usize..self.ends[index] as usize]
    }

    /// Adds to `change`, `rate`, `capacity` and, for tangents, to the rows; sets the new points.
    pub fn evaluate(
        &self,
        problem: &Problem,
        consistent: bool,
        at: &StepInput,
        old: &PointStates,
        rows: &mut ConductionRows,
        out: &mut Evaluation,
    ) -> Result<(), Error> {
        if problem.mesh.is_second_order() {
            return self.evaluate_all::<MAX_ELEMENT_NODES, MAX_ELEMENT_POINTS>(
                problem, consistent, at, old, rows, out,
            );
        }
        self.evaluate_all::<FIRST_ORDER_NODES, FIRST_ORDER_NODES>(problem, consistent, at, old, rows, out)
    }

    fn evaluate_all<const N: usize, const P: usize>(
        &self,
        problem: &Problem,
        consistent: bool,
        at: &StepInput,
        old: &PointStates,
        rows: &mut ConductionRows,
        out: &mut Evaluation,
    ) -> Result<(), Error> {
        let mut memory = std::mem::take(&mut out.memory.general);
        memory.state.resize(old.state.len(), 0.0);
        memory.energy.resize(old.energy.len(), 0.0);
        let (mut state, mut energy) = (memory.state.as_mut_slice(), memory.energy.as_mut_slice());
        let mut first = 0;
        while first < self.elements.len() {
            let last = (first + BATCH).min(self.elements.len());
            let mut work = Vec::new();
            for start in (first..last).step_by(ITEM) {
                let end = (start + ITEM).min(last);
                let points = (self.starts[end] - self.starts[start]) as usize;
                let (here, rest) = state.split_at_mut(points * self.stride);
                let (energies, others) = energy.split_at_mut(points);
                work.push((start..end, here, energies));
                (state, energy) = (rest, others);
            }
            let parts: Vec<Vec<ElementContribution<N>>> = work
                .into_par_iter()
                .map(|(range, state, energy)| {
                    let offset = self.starts[range.start] as usize;
                    range
                        .map(|element| {
                            let points = self.starts[element] as usize - offset
                                ..self.starts[element + 1] as usize - offset;
                            let state = &mut state[points.start * self.stride..points.end * self.stride];
                            let energy = &mut energy[points];
                            self.element::<N, P>(problem, consistent, at, old, element, state, energy)
                        })
                        .collect::<Result<Vec<_>, _>>()
                })
                .collect::<Result<_, _>>()?;
            for (element, part) in (first..).zip(parts.iter().flatten()) {
                let equations = self.equations_of(element);
                let nodes = equations.len();
                for a in 0..nodes {
                    let row = equations[a] as usize;
                    out.change[row] += part.change[a];
                    out.rate[row] += part.rate[a];
                    out.capacity[row] += part.capacity[a];
                    if let Some(matrices) = &part.matrices {
                        for b in 0..nodes {
                            rows.add(row, equations[b] as usize, matrices[0][a][b], matrices[1][a][b]);
                        }
                    }
                }
                out.step_ratio = part.ratio.into_iter().chain(out.step_ratio).reduce(f64::min);
            }
            first = last;
        }
        out.responses += self.points() as u64;
        out.memory.general = memory;
        Ok(())
    }

    #[allow(clippy::too_many_arguments)]
    fn element<const N: usize, const P: usize>(
        &self,
        problem: &Problem,
        consistent: bool,
        at: &StepInput,
        old: &PointStates,
        index: usize,
        state: &mut [f64],
        energy: &mut [f64],
    ) -> Result<ElementContribution<N>, Error> {
        let number = self.elements[index];
        let (corners, nodes) = problem.mesh.positions::<N>(number);
        let material = &*problem.materials[usize::from(problem.material_of[number as usize])];
        let Some(geometry) = Geometry::<N, P>::new(&corners[..nodes]) else {
            return Err(Error::Mesh(format!("element {number}: inverted, flat or folded")));
        };
        let (density, count) = (material.density(), material.state_names().len());
        let shapes = element::shapes::<N, P>(nodes);
        let equations = self.equations_of(index);
        let (mut start, mut end) = ([0.0; N], [0.0; N]);
        for a in 0..nodes {
            let equation = equations[a] as usize;
            (start[a], end[a]) = (at.start[equation], at.temperature[equation]);
        }
        let mut part = ElementContribution {
            change: [0.0; N],
            rate: [0.0; N],
            capacity: [0.0; N],
            matrices: at.tangent.then(|| Box::new([[[0.0; N]; N]; 2])),
            ratio: None,
        };
        // Kirchhoff's potential and k at the nodes, if the flux follows it
        let mut potential = [[0.0; 2]; N];
        let mut kirchhoff = false;
        for a in 0..nodes {
            if let Some(found) = material.potential(end[a]) {
                (potential[a], kirchhoff) = (found, true);
            }
        }
        let first = self.starts[index] as usize;
        for g in 0..geometry.points {
            let gradients = &geometry.gradients[g];
            let mut gradient = Vector3::zeros();
            for a in 0..nodes {
                let difference = if kirchhoff { potential[a][0] - potential[0][0] } else { end[a] - end[0] };
                gradient += Vector3::from(gradients[a]) * difference;
            }
            let (from, to) = if consistent {
                let at = |values: &[f64; N]| (0..nodes).map(|a| shapes[g][a] * values[a]).sum();
                (at(&start), at(&end))
            } else {
                (start[g], end[g])
            };
            // k ∇T = ∇θ
            let own = match material.potential(to) {
                Some([_, conductivity]) => conductivity,
                None => 1.0,
            };
            gradient /= own;
            let place = PointInput { temperature: from, increment: to - from, gradient, dt: at.dt };
            let old_state = &old.state[(first + g) * self.stride..];
            let new_state = &mut state[g * self.stride..];
            let response = material.respond(&place, &old_state[..count], &mut new_state[..count])?;
            energy[g] = response.energy;
            part.ratio = response.step_ratio.into_iter().chain(part.ratio).reduce(f64::min);
            let change = density * (response.energy - old.energy[first + g]);
            let capacity = density * response.d_energy_d_temperature;
            let weight = geometry.weights[g];
            for a in 0..nodes {
                part.rate[a] -= weight * Vector3::from(gradients[a]).dot(&response.flux);
                if consistent {
                    part.change[a] += weight * shapes[g][a] * change;
                    part.capacity[a] += weight * shapes[g][a] * capacity;
                }
            }
            if !consistent {
                part.change[g] += geometry.corner_volumes[g] * change;
                part.capacity[g] += geometry.corner_volumes[g] * capacity;
            }
            if let Some(matrices) = &mut part.matrices {
                let tangent = -0.5 * (response.d_flux_d_gradient + response.d_flux_d_gradient.transpose());
                if kirchhoff {
                    let scale: [f64; N] = std::array::from_fn(|b| potential[b][1] / own);
                    geometry.add_scaled_conduction(g, &tangent, &scale, &mut matrices[0]);
                } else {
                    geometry.add_conduction(g, &tangent, &mut matrices[0]);
                }
                if consistent {
                    for a in 0..nodes {
                        for b in 0..nodes {
                            matrices[1][a][b] += weight * capacity * shapes[g][a] * shapes[g][b];
                        }
                    }
                }
            }
        }
        Ok(part)
    }
}
