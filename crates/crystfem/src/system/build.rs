//! Building the equations of what exists.

use super::classes::{Class, OWN, VARYING, classify, matrices};
use super::general::General;
use super::nodal::Nodal;
use super::rows::{Row, Rows};
use super::surfaces::Surfaces;
use super::{Behaviour, NONE, System};
use crate::boundary::{Condition, Where};
use crate::element::{self, Geometry, MOST, WIDE, WIDE_POINTS};
use crate::error::Error;
use crate::mesh::{Face, Mesh};
use crate::problem::{Capacity, Problem};
use rayon::prelude::*;
use std::collections::HashSet;

/// Elements whose matrices are made before they are added.
const BATCH: usize = 4096;

/// The elements around each node, as `stride` × (position in the list of active elements) + number of the node in it.
struct Around {
    starts: Vec<u32>,
    corners: Vec<u32>,
    /// 8, or 32 of a mesh with second-order elements.
    stride: u32,
}

/// Matrices of an element of its own.
enum Own {
    Narrow(Box<Geometry>),
    Wide(Box<Geometry<WIDE, WIDE_POINTS>>),
}

impl Around {
    fn new(mesh: &Mesh, active: &[u32], equation: &[u32], size: usize) -> Self {
        let mut starts = vec![0_u32; size + 1];
        let stride = if mesh.is_second_order() { 32 } else { 8 };
        let each = |visit: &mut dyn FnMut(usize, u32)| {
            for (position, &number) in active.iter().enumerate() {
                for (corner, &node) in mesh.nodes(number).iter().enumerate() {
                    visit(equation[node as usize] as usize, stride * position as u32 + corner as u32);
                }
            }
        };
        each(&mut |node, _| starts[node + 1] += 1);
        for k in 0..size {
            starts[k + 1] += starts[k];
        }
        let mut next = starts.clone();
        let mut corners = vec![0; starts[size] as usize];
        each(&mut |node, corner| {
            corners[next[node] as usize] = corner;
            next[node] += 1;
        });
        Self { starts, corners, stride }
    }

    fn of(&self, node: usize) -> &[u32] {
        &self.corners[self.starts[node] as usize..self.starts[node + 1] as usize]
    }
}

/// Sides of existing elements that no other existing element shares, ascending.
fn outer(mesh: &Mesh, active: &[u32], equation: &[u32], around: &Around) -> Vec<Face> {
    let faces: Vec<Vec<Face>> = active
        .par_chunks(BATCH)
        .enumerate()
        .map(|(chunk, numbers)| {
            let mut faces = Vec::new();
            for (k, &number) in numbers.iter().enumerate() {
                let position = chunk * BATCH + k;
                for side in 0..mesh.side_count(number) {
                    let corners = mesh.face_nodes(Face { element: number, side });
                    let covered = around.of(equation[corners[0] as usize] as usize).iter().any(|&other| {
                        let other = (other / around.stride) as usize;
                        other != position && {
                            let others = mesh.nodes(active[other]);
                            corners[1..].iter().all(|corner| others.contains(corner))
                        }
                    });
                    if !covered {
                        faces.push(Face { element: number, side });
                    }
                }
            }
            faces
        })
        .collect();
    faces.concat()
}

/// Corners of a face, sorted.
fn nodes_of(mesh: &Mesh, face: Face) -> [u32; 4] {
    mesh.face_nodes(face).key()
}

fn by_nodes(mesh: &Mesh, faces: &[Face]) -> HashSet<[u32; 4]> {
    faces.iter().map(|&face| nodes_of(mesh, face)).collect()
}

impl System {
    /// Of the elements that are born: those whose entry in `born` is not [`NONE`].
    ///
    /// # Errors
    /// [`Error::Mesh`] for an inverted element.
    pub fn build(
        problem: &Problem,
        behaviours: &[Behaviour],
        born: &[u32],
        build: u64,
    ) -> Result<Self, Error> {
        let mesh = &problem.mesh;
        let consistent = problem.capacity == Capacity::Consistent;
        let elements: Vec<u32> = (0..born.len() as u32).filter(|&e| born[e as usize] != NONE).collect();
        let mut equation = vec![NONE; mesh.points.len()];
        for &number in &elements {
            for &node in mesh.nodes(number) {
                equation[node as usize] = 0;
            }
        }
        let mut nodes = Vec::new();
        for (node, equation) in equation.iter_mut().enumerate() {
            if *equation == 0 {
                *equation = nodes.len() as u32;
                nodes.push(node as u32);
            }
        }
        let size = nodes.len();
        let (kinds, classes) = classify(mesh, &elements, &problem.material_of, behaviours);
        let around = Around::new(mesh, &elements, &equation, size);

        let rows = Rows::build(size, consistent, |index, row: &mut Row| {
            // corners, classes and relative nodes of the elements around say all, but for elements of no class
            let repeated = row.begin(around.of(index).iter().flat_map(|&corner| {
                let position = (corner / around.stride) as usize;
                let here = [corner % around.stride, u32::from(kinds[position])];
                let others = mesh.nodes(elements[position]).iter();
                here.into_iter().chain(others.map(|&n| equation[n as usize].wrapping_sub(index as u32)))
            }));
            if repeated {
                return;
            }
            for &corner in around.of(index) {
                let (position, a) = ((corner / around.stride) as usize, (corner % around.stride) as usize);
                let class = classes.get(usize::from(kinds[position]));
                row.own |= class.is_none();
                for (b, &node) in mesh.nodes(elements[position]).iter().enumerate() {
                    let offset = equation[node as usize].wrapping_sub(index as u32) as i32;
                    match class {
                        Some(class) => row.add(offset, class.conduction[a][b], class.capacity[a][b]),
                        None => row.add(offset, 0.0, 0.0),
                    }
                }
            }
        });
        let mut system = Self {
            elements,
            nodes,
            equation,
            rows,
            capacity: vec![0.0; size],
            nodal: Nodal::default(),
            general: General::default(),
            surfaces: Surfaces::default(),
            fixed: Vec::new(),
            free: vec![1.0; size],
            consistent,
            base: None,
            build,
            generation: build << 32,
            evaluated_at: f64::NEG_INFINITY,
        };
        system.collect_points(problem, behaviours, born, &kinds, &around);
        let volumes = system.add_elements(problem, behaviours, born, &kinds, &classes)?;
        if !system.general.is_empty() {
            system.base = Some(system.rows.values());
        }
        system.act(problem, &around, &volumes);
        Ok(system)
    }

    /// Which points there are; their masses follow in `add_elements`.
    fn collect_points(
        &mut self,
        problem: &Problem,
        behaviours: &[Behaviour],
        born: &[u32],
        kinds: &[u16],
        around: &Around,
    ) {
        let nodal = |number: u32| behaviours[usize::from(problem.material_of[number as usize])].nodal();
        let stride = |wanted: &dyn Fn(&Behaviour) -> bool| {
            behaviours.iter().filter(|b| wanted(b)).map(|b| b.states).max().unwrap_or(0)
        };
        if self.elements.iter().any(|&number| nodal(number)) {
            self.nodal.stride = stride(&Behaviour::nodal);
            self.nodal.starts.push(0);
            let mut keys = Vec::new();
            for node in 0..self.size() {
                keys.clear();
                for &corner in around.of(node) {
                    let number = self.elements[(corner / around.stride) as usize];
                    let key = (born[number as usize], problem.material_of[number as usize]);
                    if nodal(number) && !keys.contains(&key) {
                        keys.push(key);
                    }
                }
                keys.sort_unstable();
                for &(birth, material) in &keys {
                    self.nodal.birth.push(birth);
                    self.nodal.material.push(material);
                    self.nodal.mass.push(0.0);
                }
                self.nodal.starts.push(self.nodal.material.len() as u32);
            }
        }
        self.nodal.followers = behaviours.iter().map(|b| b.capacity.is_some()).collect();
        self.nodal.coupled = self.nodal.material.iter().any(|&material| !self.nodal.follows(material));
        self.general.stride = stride(&|b| b.conductivity.is_none());
        self.general.starts.push(0);
        for (&number, _) in self.elements.iter().zip(kinds).filter(|(_, kind)| **kind == VARYING) {
            let nodes = problem.mesh.nodes(number);
            self.general.equations.extend(nodes.iter().map(|&node| self.equation[node as usize]));
            self.general.ends.push(self.general.equations.len() as u32);
            let material = problem.material_of[number as usize];
            self.general.potential |= behaviours[usize::from(material)].potential;
            let first = self.general.points();
            self.general.elements.push(number);
            self.general.starts.push((first + element::points(nodes.len())) as u32);
        }
    }

    /// Adds what elements of no class have of their own, and the capacity of all; returns ∫ N dV of each first-order element
    /// with a source.
    fn add_elements(
        &mut self,
        problem: &Problem,
        behaviours: &[Behaviour],
        born: &[u32],
        kinds: &[u16],
        classes: &[Class],
    ) -> Result<Vec<(u32, [f64; MOST])>, Error> {
        let mesh = &problem.mesh;
        let mut heated: Vec<u32> = problem.sources.iter().flat_map(|s| s.elements.iter().copied()).collect();
        heated.sort_unstable();
        heated.dedup();
        let mut volumes = Vec::new();
        for first in (0..self.elements.len()).step_by(BATCH) {
            let range = first..(first + BATCH).min(self.elements.len());
            // boxed: most elements have none, and a geometry has thousands of bytes
            let own: Vec<Option<Own>> = range
                .clone()
                .into_par_iter()
                .map(|position| {
                    if usize::from(kinds[position]) < classes.len() {
                        return Ok(None);
                    }
                    let number = self.elements[position];
                    let geometry = if mesh.nodes(number).len() > MOST {
                        element::wide(mesh, number).map(|geometry| Own::Wide(Box::new(geometry)))
                    } else {
                        let (corners, nodes) = element::corners(mesh, number);
                        Geometry::new(&corners[..nodes]).map(|geometry| Own::Narrow(Box::new(geometry)))
                    };
                    geometry.map(Some).ok_or_else(|| Error::Mesh(format!("element {number}: inverted")))
                })
                .collect::<Result<_, _>>()?;
            for (position, geometry) in range.zip(own) {
                let number = self.elements[position];
                let material = problem.material_of[number as usize];
                let behaviour = &behaviours[usize::from(material)];
                let nodes = mesh.nodes(number);
                let corner_volumes = match geometry.as_ref() {
                    Some(Own::Narrow(geometry)) => &geometry.corner_volumes[..],
                    Some(Own::Wide(geometry)) => &geometry.corner_volumes[..],
                    None => &classes[usize::from(kinds[position])].volumes[..],
                };
                match geometry.as_ref().filter(|_| kinds[position] == OWN) {
                    Some(Own::Narrow(geometry)) => self.add_own(nodes, &matrices(geometry, behaviour)),
                    Some(Own::Wide(geometry)) => self.add_own(nodes, &matrices(geometry, behaviour)),
                    None => {}
                }
                if let (Some(volume), Ok(_)) =
                    (corner_volumes.first_chunk::<MOST>(), heated.binary_search(&number))
                    && nodes.len() <= MOST
                {
                    volumes.push((number, *volume));
                }
                for (&node, &volume) in nodes.iter().zip(corner_volumes) {
                    let node = self.equation[node as usize] as usize;
                    if let Some(capacity) = behaviour.capacity {
                        self.capacity[node] += capacity * volume;
                    }
                    if behaviour.nodal() {
                        let key = (born[number as usize], material);
                        let density = problem.materials[usize::from(material)].density();
                        for point in self.nodal.of(node) {
                            if (self.nodal.birth[point], self.nodal.material[point]) == key {
                                self.nodal.mass[point] += density * volume;
                            }
                        }
                    }
                }
            }
        }
        Ok(volumes)
    }

    /// Conduction and capacity of one element.
    fn add_own<const N: usize>(
        &mut self,
        nodes: &[u32],
        (conduction, capacity): &([[f64; N]; N], [[f64; N]; N]),
    ) {
        for (a, &row) in nodes.iter().enumerate() {
            for (b, &column) in nodes.iter().enumerate() {
                let [row, column] = [row, column].map(|node| self.equation[node as usize] as usize);
                self.rows.add(row, column, conduction[a][b], capacity[a][b]);
            }
        }
    }

    /// Conditions on the outer surface, prescribed temperatures, sources.
    fn act(&mut self, problem: &Problem, around: &Around, volumes: &[(u32, [f64; MOST])]) {
        let mesh = &problem.mesh;
        let exposed = if problem.conditions.iter().any(|condition| condition.surface().is_some()) {
            outer(mesh, &self.elements, &self.equation, around)
        } else {
            Vec::new()
        };
        let mut fixed = vec![NONE; if problem.conditions.is_empty() { 0 } else { self.size() }];
        for (index, condition) in problem.conditions.iter().enumerate() {
            let faces = match condition.surface() {
                None => {
                    if let Condition::Temperature { nodes, .. } = condition {
                        for &node in nodes {
                            let equation = self.equation[node as usize];
                            if equation != NONE {
                                fixed[equation as usize] = index as u32;
                            }
                        }
                    }
                    continue;
                }
                // by their nodes, so that a face between two elements counts from either side
                Some(Where::Faces(faces)) => {
                    let named = by_nodes(mesh, faces);
                    exposed.iter().filter(|&&face| named.contains(&nodes_of(mesh, face))).copied().collect()
                }
                Some(Where::Outer { except }) => {
                    let except = by_nodes(mesh, except);
                    let left = |face: &&Face| except.is_empty() || !except.contains(&nodes_of(mesh, **face));
                    exposed.iter().filter(left).copied().collect::<Vec<_>>()
                }
            };
            self.surfaces.act(problem, index, &faces, &self.equation, self.consistent);
        }
        for (equation, &condition) in fixed.iter().enumerate() {
            if condition != NONE {
                self.fixed.push((equation as u32, condition));
                self.free[equation] = 0.0;
            }
        }
        for (index, source) in problem.sources.iter().enumerate() {
            let (mut list, mut pairs) = (Vec::new(), Vec::new());
            for &number in &source.elements {
                let nodes = mesh.nodes(number);
                if nodes.len() > MOST && self.elements.binary_search(&number).is_ok() {
                    let Some(geometry) = element::wide(mesh, number) else { continue };
                    let equation = |a: usize| self.equation[nodes[a] as usize];
                    let mass = geometry.mass();
                    for (a, b) in (0..nodes.len()).flat_map(|a| (0..nodes.len()).map(move |b| (a, b))) {
                        pairs.push((equation(a), equation(b), mass[a][b]));
                    }
                }
                if let Ok(at) = volumes.binary_search_by_key(&number, |entry| entry.0) {
                    for (&node, volume) in mesh.nodes(number).iter().zip(volumes[at].1) {
                        list.push((self.equation[node as usize], volume));
                    }
                }
            }
            self.surfaces.release(index, list, pairs);
        }
    }
}
