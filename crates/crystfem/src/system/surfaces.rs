//! Flux, film, radiation and sources on what exists.
//!
//! With lumped capacity they act at nodes, q(T_i) ∮ N_i dA, so that their tangent is diagonal and no cold neighbour
//! can heat a node; with consistent capacity they act at the Gauss points of faces.

use super::{At, Evaluation};
use crate::boundary::{Condition, STEFAN_BOLTZMANN};
use crate::element::FaceGeometry;
use crate::mesh::Face;
use crate::problem::Problem;

/// Heat that goes into the body, by kind: W, or J when summed over time.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Exchange {
    /// Through prescribed flux.
    pub flux: f64,
    /// Through films.
    pub film: f64,
    /// Through radiation.
    pub radiation: f64,
    /// From sources.
    pub source: f64,
}

impl Exchange {
    /// The sum of all.
    pub fn total(&self) -> f64 {
        self.flux + self.film + self.radiation + self.source
    }

    /// The sum of all magnitudes.
    pub fn gross(&self) -> f64 {
        self.flux.abs() + self.film.abs() + self.radiation.abs() + self.source.abs()
    }

    /// Adds a multiple of another.
    pub fn add(&mut self, factor: f64, other: &Self) {
        self.flux += factor * other.flux;
        self.film += factor * other.film;
        self.radiation += factor * other.radiation;
        self.source += factor * other.source;
    }
}

/// ∂Q/∂T of one face, W/K.
#[derive(Clone, Debug)]
pub struct FaceMatrix {
    /// Equations of its nodes.
    pub equations: [u32; 4],
    /// Row a at 4a.
    pub values: [f64; 16],
    /// Nodes: 4 or 3.
    pub nodes: usize,
}

impl FaceMatrix {
    /// y += factor · matrix · x.
    pub fn add_product(&self, factor: f64, x: &[f64], y: &mut [f64]) {
        for a in 0..self.nodes {
            let sum: f64 =
                (0..self.nodes).map(|b| self.values[4 * a + b] * x[self.equations[b] as usize]).sum();
            y[self.equations[a] as usize] += factor * sum;
        }
    }
}

/// A face with its quadrature.
#[derive(Clone, Debug)]
struct Acting {
    equations: [u32; 4],
    geometry: FaceGeometry,
}

/// One condition on what exists.
#[derive(Clone, Debug)]
struct Part {
    condition: usize,
    /// Equations with ∮ N dA, m², ascending.
    nodes: Vec<(u32, f64)>,
    /// Faces, for film and radiation with consistent capacity.
    faces: Vec<Acting>,
}

/// Conditions on the current outer surface, and sources in existing elements.
#[derive(Clone, Debug, Default)]
pub struct Surfaces {
    parts: Vec<Part>,
    /// Source, and equations with ∫ N dV, m³, ascending.
    sources: Vec<(usize, Vec<(u32, f64)>)>,
    radiates: bool,
}

/// Sorts by equation and adds equal ones, in the order given.
fn gather(mut list: Vec<(u32, f64)>) -> Vec<(u32, f64)> {
    list.sort_by_key(|entry| entry.0);
    list.dedup_by(|next, kept| {
        let same = next.0 == kept.0;
        if same {
            kept.1 += next.1;
        }
        same
    });
    list
}

impl Surfaces {
    /// Adds a condition on faces that exist and are not covered.
    pub fn act(
        &mut self,
        problem: &Problem,
        condition: usize,
        faces: &[Face],
        equation: &[u32],
        consistent: bool,
    ) {
        let mut part = Part { condition, nodes: Vec::new(), faces: Vec::new() };
        let kind = &problem.conditions[condition];
        let by_nodes = !consistent || matches!(kind, Condition::Flux { .. });
        for &face in faces {
            let nodes = problem.mesh.face_nodes(face);
            let (mut corners, mut equations) = ([[0.0; 3]; 4], [0; 4]);
            for (k, &node) in nodes.iter().enumerate() {
                corners[k] = problem.mesh.points[node as usize];
                equations[k] = equation[node as usize];
            }
            let geometry = FaceGeometry::new(&corners[..nodes.len()]);
            if by_nodes {
                part.nodes.extend((0..nodes.len()).map(|k| (equations[k], geometry.corner_areas[k])));
            } else {
                part.faces.push(Acting { equations, geometry });
            }
        }
        part.nodes = gather(part.nodes);
        self.radiates |= matches!(kind, Condition::Radiation { .. }) && !faces.is_empty();
        self.parts.push(part);
    }

    /// Adds a source, with ∫ N dV of its elements' nodes.
    pub fn release(&mut self, source: usize, volumes: Vec<(u32, f64)>) {
        self.sources.push((source, gather(volumes)));
    }

    /// Whether something radiates.
    pub fn radiates(&self) -> bool {
        self.radiates
    }

    /// Whether a film has another coefficient at one time than at another: the matrix is another too.
    pub fn varies(&self, problem: &Problem, between: [f64; 2]) -> bool {
        self.parts.iter().any(|part| match &problem.conditions[part.condition] {
            Condition::Film { coefficient, .. } => coefficient.at(between[0]) != coefficient.at(between[1]),
            _ => false,
        })
    }

    /// Adds to `rate`, `conductance`, `faces`; sets `exchange`.
    pub fn evaluate(&self, problem: &Problem, nodes: &[u32], at: &At, out: &mut Evaluation) {
        let mut exchange = Exchange::default();
        out.faces.clear();
        let place = |equation: u32| problem.mesh.points[nodes[equation as usize] as usize];
        for part in &self.parts {
            match &problem.conditions[part.condition] {
                Condition::Temperature { .. } => {}
                Condition::Flux { inward, .. } => {
                    for &(equation, area) in &part.nodes {
                        let heat = area * inward.at(place(equation), at.time);
                        out.rate[equation as usize] -= heat;
                        exchange.flux += heat;
                    }
                }
                Condition::Film { coefficient, ambient, .. } => {
                    let (film, ambient) = (coefficient.at(at.time), ambient.at(at.time));
                    exchange.film -= part.lose(at, out, |t| (film * (t - ambient), film));
                }
                Condition::Radiation { emissivity, ambient, .. } => {
                    let ambient = ambient.at(at.time);
                    let (factor, fourth) = (emissivity * STEFAN_BOLTZMANN, ambient.powi(4));
                    // odd continuation below 0 K, which iterates may visit
                    exchange.radiation -= part.lose(at, out, |t| {
                        let cube = t.abs() * t * t;
                        (factor * (cube * t - fourth), 4.0 * factor * cube)
                    });
                }
            }
        }
        for (source, volumes) in &self.sources {
            let power = &problem.sources[*source].power;
            for &(equation, volume) in volumes {
                let heat = volume * power.at(place(equation), at.time);
                out.rate[equation as usize] -= heat;
                exchange.source += heat;
            }
        }
        out.exchange = exchange;
    }
}

impl Part {
    /// Adds a heat loss (q, ∂q/∂T) of temperature; returns its sum, W.
    fn lose(&self, at: &At, out: &mut Evaluation, loss: impl Fn(f64) -> (f64, f64)) -> f64 {
        let mut total = 0.0;
        for &(equation, area) in &self.nodes {
            let (q, slope) = loss(at.temperature[equation as usize]);
            out.rate[equation as usize] += area * q;
            out.conductance[equation as usize] += area * slope;
            total += area * q;
        }
        for face in &self.faces {
            let nodes = face.geometry.nodes;
            let mut matrix = FaceMatrix { equations: face.equations, values: [0.0; 16], nodes };
            for g in 0..nodes {
                let shapes = &face.geometry.shapes[g];
                let t = (0..nodes).map(|a| shapes[a] * at.temperature[face.equations[a] as usize]).sum();
                let (q, slope) = loss(t);
                let weight = face.geometry.weights[g];
                total += weight * q;
                for a in 0..nodes {
                    out.rate[face.equations[a] as usize] += weight * shapes[a] * q;
                    for b in 0..nodes {
                        matrix.values[4 * a + b] += weight * slope * shapes[a] * shapes[b];
                    }
                }
            }
            if at.tangent {
                out.faces.push(matrix);
            }
        }
        total
    }
}
