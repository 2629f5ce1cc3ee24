//! Flux, film, radiation and sources on existing elements.
//!
//! With lumped capacity they act at nodes, q(T_i) ∮ N_i dA: the tangent is diagonal, and no cold neighbour
//! can heat a node. With consistent capacity they act at the Gauss points of faces.

use super::{Evaluation, StepInput};
use crate::boundary::{Condition, STEFAN_BOLTZMANN};
use crate::element::FaceGeometry;
use crate::mesh::Face;
use crate::problem::Problem;

/// Heat into the body, by kind: W, or J when integrated over time.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Exchange {
    /// Heat by prescribed flux.
    pub flux: f64,
    /// Heat by films.
    pub film: f64,
    /// Heat by radiation.
    pub radiation: f64,
    /// Heat of sources.
    pub source: f64,
}

impl Exchange {
    /// Sum of all kinds.
    pub fn total(&self) -> f64 {
        self.flux + self.film + self.radiation + self.source
    }

    /// Sum of all magnitudes.
    pub fn gross(&self) -> f64 {
        self.flux.abs() + self.film.abs() + self.radiation.abs() + self.source.abs()
    }

    /// Adds a multiple of another exchange.
    pub fn add(&mut self, factor: f64, other: &Self) {
        self.flux += factor * other.flux;
        self.film += factor * other.film;
        self.radiation += factor * other.radiation;
        self.source += factor * other.source;
    }
}

/// A face with its quadrature.
#[derive(Clone, Debug)]
struct QuadratureFace<const N: usize, const P: usize> {
    equations: [u32; N],
    geometry: FaceGeometry<N, P>,
}

impl<const N: usize, const P: usize> QuadratureFace<N, P> {
    fn new(problem: &Problem, face: Face, equation: &[u32]) -> Self {
        let nodes = problem.mesh.face_nodes(face);
        let (mut corners, mut equations) = ([[0.0; 3]; N], [0; N]);
        for (k, &node) in nodes.iter().enumerate() {
            corners[k] = problem.mesh.points[node as usize];
            equations[k] = equation[node as usize];
        }
        Self { equations, geometry: FaceGeometry::new(&corners[..nodes.len()]) }
    }
}

/// Equation that takes heat, equation whose temperature sets it, and ∮ N N dA, m², or ∫ N N dV, m³.
type Pairs = Vec<(u32, u32, f64)>;

/// A condition on existing faces.
#[derive(Clone, Debug, Default)]
struct ConditionFaces {
    condition: usize,
    radiates: bool,
    /// Equations with ∮ N dA, m², ascending.
    nodes: Vec<(u32, f64)>,
    /// Equation that takes a flux, equation whose temperature sets it, and ∮ N N dA, m², of second-order
    /// faces, whose ∮ N dA is negative at corners.
    pairs: Pairs,
    /// Faces, for film and radiation with consistent capacity.
    faces: Vec<QuadratureFace<4, 4>>,
    /// Second-order faces, likewise.
    wide: Vec<QuadratureFace<8, 9>>,
    /// Earlier part that has the same faces, which are stored there.
    shared: Option<usize>,
}

/// Conditions on the current outer surface, and sources in existing elements.
#[derive(Clone, Debug, Default)]
pub struct Surfaces {
    parts: Vec<ConditionFaces>,
    /// Source index, and equations with ∫ N dV, m³, ascending.
    sources: Vec<(usize, Vec<(u32, f64)>)>,
    /// Source index, and pairs of equations with ∫ N N dV, m³, of second-order elements.
    wide_sources: Vec<(usize, Pairs)>,
}

/// Sorts by equation and sums equal ones in the given order.
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

/// Sorts pairs and sums equal ones in the given order.
fn gather_pairs(mut list: Pairs) -> Pairs {
    list.sort_by_key(|entry| (entry.0, entry.1));
    list.dedup_by(|next, kept| {
        let same = (next.0, next.1) == (kept.0, kept.1);
        if same {
            kept.2 += next.2;
        }
        same
    });
    list
}

/// Set of equations that have gained elements.
pub struct TouchedEquations {
    /// Equations, without duplicates, ascending after [`Self::sort`].
    pub list: Vec<u32>,
    marks: Vec<bool>,
}

impl TouchedEquations {
    /// Returns an empty set for `size` equations.
    pub fn new(size: usize) -> Self {
        Self { list: Vec::new(), marks: vec![false; size] }
    }

    /// Adds an equation.
    pub fn add(&mut self, equation: u32) {
        if !std::mem::replace(&mut self.marks[equation as usize], true) {
            self.list.push(equation);
        }
    }

    /// Sorts the list, once all are added.
    pub fn sort(&mut self) {
        self.list.sort_unstable();
    }

    /// Returns true if an equation is in the set.
    pub fn contains(&self, equation: u32) -> bool {
        self.marks[equation as usize]
    }

    /// Replaces the entries of touched equations.
    fn replace(&self, list: &mut Vec<(u32, f64)>, new: Vec<(u32, f64)>) {
        let Some(&first) = self.list.first() else { return };
        let tail = list.split_off(list.partition_point(|entry| entry.0 < first));
        let mut new = gather(new).into_iter().peekable();
        for entry in tail.into_iter().filter(|entry| !self.contains(entry.0)) {
            while let Some(before) = new.next_if(|new| new.0 < entry.0) {
                list.push(before);
            }
            list.push(entry);
        }
        list.extend(new);
    }
}

impl Surfaces {
    /// Returns all conditions and sources, without faces and elements yet.
    pub fn new(problem: &Problem) -> Self {
        let surfaces = (0..problem.conditions.len()).filter(|&k| problem.conditions[k].surface().is_some());
        let part = |condition: usize| {
            let radiates = matches!(problem.conditions[condition], Condition::Radiation { .. });
            ConditionFaces { condition, radiates, ..ConditionFaces::default() }
        };
        let sources = (0..problem.sources.len()).map(|source| (source, Vec::new())).collect();
        Self { parts: surfaces.map(part).collect(), sources, wide_sources: Vec::new() }
    }

    /// Updates conditions at touched equations, on those exposed `faces` there on which one `acts`. With
    /// consistent capacity all equations are touched.
    pub fn set_condition(
        &mut self,
        problem: &Problem,
        faces: &[Face],
        equation: &[u32],
        consistent: bool,
        touched: &TouchedEquations,
        acts: impl Fn(usize, Face) -> bool,
    ) {
        for index in 0..self.parts.len() {
            let (earlier, rest) = self.parts.split_at_mut(index);
            let part = &mut rest[0];
            let by_nodes =
                !consistent || matches!(problem.conditions[part.condition], Condition::Flux { .. });
            let (mut list, mut pairs) = (Vec::new(), Vec::new());
            part.faces.clear();
            part.wide.clear();
            for &face in faces.iter().filter(|&&face| acts(part.condition, face)) {
                let nodes = problem.mesh.face_nodes(face).len();
                if nodes > 4 {
                    let acting = QuadratureFace::<8, 9>::new(problem, face, equation);
                    if !by_nodes {
                        part.wide.push(acting);
                        continue;
                    }
                    let QuadratureFace { equations, geometry } = acting;
                    for (a, b) in (0..nodes).flat_map(|a| (0..nodes).map(move |b| (a, b))) {
                        let of =
                            |g: usize| geometry.weights[g] * geometry.shapes[g][a] * geometry.shapes[g][b];
                        pairs.push((equations[a], equations[b], (0..geometry.points).map(of).sum()));
                    }
                    continue;
                }
                let acting = QuadratureFace::<4, 4>::new(problem, face, equation);
                if by_nodes {
                    let QuadratureFace { equations, geometry } = acting;
                    let areas = (0..nodes).map(|k| (equations[k], geometry.corner_areas[k]));
                    list.extend(areas.filter(|entry| touched.contains(entry.0)));
                } else {
                    part.faces.push(acting);
                }
            }
            touched.replace(&mut part.nodes, list);
            part.pairs = gather_pairs(pairs);
            part.shared = earlier.iter().position(|earlier| part.has_faces_of(earlier));
            if part.shared.is_some() {
                (part.faces, part.wide) = (Vec::new(), Vec::new());
            }
        }
    }

    /// Updates a source at touched equations, from ∫ N dV at the nodes of its first-order elements, and ∫ N N
    /// dV of second-order ones, which are never born later.
    pub fn set_source(
        &mut self,
        source: usize,
        volumes: Vec<(u32, f64)>,
        pairs: Pairs,
        touched: &TouchedEquations,
    ) {
        touched.replace(&mut self.sources[source].1, volumes);
        if !pairs.is_empty() {
            self.wide_sources.push((source, gather_pairs(pairs)));
        }
    }

    /// Returns true if a condition radiates.
    pub fn radiates(&self) -> bool {
        let acts = |part: &ConditionFaces| {
            !(part.nodes.is_empty() && part.faces.is_empty() && part.wide.is_empty()) || part.shared.is_some()
        };
        self.parts.iter().any(|part| part.radiates && acts(part))
    }

    /// Returns true if a film coefficient differs between two times, and with it the matrix.
    pub fn varies(&self, problem: &Problem, between: [f64; 2]) -> bool {
        self.parts.iter().any(|part| match &problem.conditions[part.condition] {
            Condition::Film { coefficient, .. } => {
                coefficient.value_at(between[0]) != coefficient.value_at(between[1])
            }
            _ => false,
        })
    }

    /// Adds the heat that radiation takes beyond its tangent at T, R(δ) = ∮ N (q(T + δ) − q(T) − ∂q/∂T δ) dA,
    /// W, as R(δ₀ + δ₁) − R(δ₀) of two `changes`; all other conditions are linear in T.
    pub fn add_remainder(
        &self,
        problem: &Problem,
        temperature: &[f64],
        changes: [&[f64]; 2],
        to: &mut [f64],
    ) {
        let fields = [temperature, changes[0], changes[1]];
        for part in &self.parts {
            let Condition::Radiation { emissivity, .. } = problem.conditions[part.condition] else {
                continue;
            };
            let remainder = |[t, before, change]: [f64; 3]| {
                let fourth = |t: f64| t.abs() * t * t * t;
                let tangent = 4.0 * t.abs() * t * t * change;
                emissivity * STEFAN_BOLTZMANN * (fourth(t + before + change) - fourth(t + before) - tangent)
            };
            for &(equation, area) in &part.nodes {
                let equation = equation as usize;
                to[equation] += area * remainder(fields.map(|field| field[equation]));
            }
            let faces = part.shared.map_or(part, |shared| &self.parts[shared]);
            for face in &faces.faces {
                face.add_remainder(fields, to, remainder);
            }
            for face in &faces.wide {
                face.add_remainder(fields, to, remainder);
            }
        }
    }

    /// Adds to `rate`, `conductance` and `faces`; sets `exchange`.
    pub fn evaluate(&self, problem: &Problem, nodes: &[u32], at: &StepInput, out: &mut Evaluation) {
        let mut exchange = Exchange::default();
        out.faces.clear();
        let place = |equation: u32| problem.mesh.points[nodes[equation as usize] as usize];
        // first value of each part's matrices
        let mut starts: Vec<usize> = Vec::with_capacity(self.parts.len());
        for part in &self.parts {
            let start = part.shared.map_or(out.faces.values.len(), |shared| starts[shared]);
            starts.push(start);
            let faces = &self.parts[part.shared.unwrap_or(starts.len() - 1)];
            match &problem.conditions[part.condition] {
                Condition::Temperature { .. } => {}
                Condition::Flux { inward, .. } => {
                    for &(equation, area) in &part.nodes {
                        let heat = area * inward.value_at(place(equation), at.time);
                        out.rate[equation as usize] -= heat;
                        exchange.flux += heat;
                    }
                    for &(equation, at_equation, area) in &part.pairs {
                        let heat = area * inward.value_at(place(at_equation), at.time);
                        out.rate[equation as usize] -= heat;
                        exchange.flux += heat;
                    }
                }
                Condition::Film { coefficient, ambient, .. } => {
                    let (film, ambient) = (coefficient.value_at(at.time), ambient.value_at(at.time));
                    exchange.film -= part.add_loss(faces, start, at, out, |t| (film * (t - ambient), film));
                }
                Condition::Radiation { emissivity, ambient, .. } => {
                    let ambient = ambient.value_at(at.time);
                    let (factor, fourth) = (emissivity * STEFAN_BOLTZMANN, ambient.powi(4));
                    // odd continuation below 0 K, which iterates may reach
                    exchange.radiation -= part.add_loss(faces, start, at, out, |t| {
                        let cube = t.abs() * t * t;
                        (factor * (cube * t - fourth), 4.0 * factor * cube)
                    });
                }
            }
        }
        for (source, volumes) in &self.sources {
            let power = &problem.sources[*source].power;
            for &(equation, volume) in volumes {
                let heat = volume * power.value_at(place(equation), at.time);
                out.rate[equation as usize] -= heat;
                exchange.source += heat;
            }
        }
        for (source, pairs) in &self.wide_sources {
            let power = &problem.sources[*source].power;
            for &(equation, at_equation, volume) in pairs {
                let heat = volume * power.value_at(place(at_equation), at.time);
                out.rate[equation as usize] -= heat;
                exchange.source += heat;
            }
        }
        out.exchange = exchange;
    }
}

impl ConditionFaces {
    /// Returns true if both act on the same faces, in the same order.
    fn has_faces_of(&self, other: &Self) -> bool {
        let (faces, wide) = (&self.faces, &self.wide);
        faces.len() + wide.len() > 0
            && faces.len() == other.faces.len()
            && wide.len() == other.wide.len()
            && faces.iter().zip(&other.faces).all(|(a, b)| a.equations == b.equations)
            && wide.iter().zip(&other.wide).all(|(a, b)| a.equations == b.equations)
    }

    /// Adds a heat loss (q, ∂q/∂T) that depends on temperature, on own or shared `faces` whose matrices begin
    /// at `start`; returns its sum, W.
    fn add_loss(
        &self,
        faces: &Self,
        mut start: usize,
        at: &StepInput,
        out: &mut Evaluation,
        loss: impl Fn(f64) -> (f64, f64),
    ) -> f64 {
        let mut total = 0.0;
        for &(equation, area) in &self.nodes {
            let (q, slope) = loss(at.temperature[equation as usize]);
            out.rate[equation as usize] += area * q;
            out.conductance.push((equation, area * slope));
            total += area * q;
        }
        for face in &faces.faces {
            total = face.add_loss(&mut start, at, out, &loss, total);
        }
        for face in &faces.wide {
            total = face.add_loss(&mut start, at, out, &loss, total);
        }
        total
    }
}

impl<const N: usize, const P: usize> QuadratureFace<N, P> {
    /// Adds to `rate` and, from `start` on, `faces`, and the heat loss, W, to `total`.
    fn add_loss(
        &self,
        start: &mut usize,
        at: &StepInput,
        out: &mut Evaluation,
        loss: &impl Fn(f64) -> (f64, f64),
        mut total: f64,
    ) -> f64 {
        let nodes = self.geometry.nodes;
        let matrix = *start;
        if at.tangent {
            *start += nodes * nodes;
            // another condition may have made it
            if matrix == out.faces.values.len() {
                out.faces.nodes.push(nodes as u8);
                out.faces.equations.extend_from_slice(&self.equations[..nodes]);
                out.faces.values.resize(matrix + nodes * nodes, 0.0);
            }
        }
        for g in 0..self.geometry.points {
            let shapes = &self.geometry.shapes[g];
            let t = (0..nodes).map(|a| shapes[a] * at.temperature[self.equations[a] as usize]).sum();
            let (q, slope) = loss(t);
            let weight = self.geometry.weights[g];
            total += weight * q;
            for a in 0..nodes {
                out.rate[self.equations[a] as usize] += weight * shapes[a] * q;
                if at.tangent {
                    for b in 0..nodes {
                        out.faces.values[matrix + nodes * a + b] += weight * slope * shapes[a] * shapes[b];
                    }
                }
            }
        }
        total
    }

    /// Adds ∮ N f dA, with f of the fields' values at Gauss points.
    fn add_remainder(&self, fields: [&[f64]; 3], to: &mut [f64], of: impl Fn([f64; 3]) -> f64) {
        let equations = &self.equations[..self.geometry.nodes];
        for g in 0..self.geometry.points {
            let shapes = &self.geometry.shapes[g];
            let value = |field: &[f64]| {
                equations.iter().zip(shapes).map(|(&equation, shape)| shape * field[equation as usize]).sum()
            };
            let flux = self.geometry.weights[g] * of(fields.map(value));
            for (&equation, shape) in equations.iter().zip(shapes) {
                to[equation as usize] += shape * flux;
            }
        }
    }
}
