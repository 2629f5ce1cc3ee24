//! Assembly: all elements that exist at first, and those of a birth later.
//!
//! The cost of a birth is proportional to what it adds. Equations are appended ([`super::numbering`]); rows,
//! capacity, points and faces are rebuilt at the nodes of new elements only, and later entries of lists move.
//! The result equals that of building everything at once, bit by bit.

use super::classes::{ElementClass, OWN, VARYING, classify, matrices};
use super::general::ElementPoints;
use super::nodal::NodalPoints;
use super::node_elements::NodeElements;
use super::numbering::Numbering;
use super::rows::bands::Bands;
use super::rows::{ConductionRows, RowBuilder};
use super::surfaces::{Surfaces, TouchedEquations};
use super::{MaterialBehaviour, NONE, ThermalSystem};
use crate::boundary::{Condition, FaceSelection};
use crate::element::{FIRST_ORDER_NODES, Geometry, MAX_ELEMENT_NODES, MAX_ELEMENT_POINTS};
use crate::error::Error;
use crate::mesh::{Face, Mesh};
use crate::problem::{Capacity, Problem};
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};

/// Number of elements whose matrices are computed before they are added.
const BATCH: usize = 4096;

/// Moves of points from an index on.
#[derive(Clone, Debug, Default)]
pub struct PointMoves {
    /// First index that may have moved.
    pub first: usize,
    /// Former index of each point from there on, or [`NONE`].
    pub from: Vec<u32>,
}

/// Changes of a system by added elements.
#[derive(Clone, Debug, Default)]
pub struct Added {
    /// Equations of their nodes, ascending, with the former capacity of linear materials, J/K; `None` for new
    /// nodes.
    pub before: Vec<(u32, Option<f64>)>,
    /// Moves of points at nodes.
    pub nodal: PointMoves,
    /// Moves of points in elements.
    pub general: PointMoves,
    /// Number of visited elements: new ones and their neighbours.
    pub visited: u64,
}

/// Constant data of a problem, for assembly.
pub struct AssemblyPlan {
    pub(super) numbering: Numbering,
    around: NodeElements,
    /// Class of each element.
    kinds: Vec<u16>,
    classes: Vec<ElementClass>,
    /// Faces on which each condition acts, or does not, by their corners.
    named: Vec<HashSet<[u32; 4]>>,
    /// Last condition that prescribes the temperature of a node.
    held: HashMap<u32, u32>,
    /// Elements of each source, ascending.
    heated: Vec<Vec<u32>>,
}

/// Geometry of an element outside all classes.
enum ElementGeometry {
    Narrow(Box<Geometry>),
    Wide(Box<Geometry<MAX_ELEMENT_NODES, MAX_ELEMENT_POINTS>>),
}

impl ElementGeometry {
    fn new(mesh: &Mesh, element: u32) -> Result<Self, Error> {
        let geometry = if mesh.nodes(element).len() > FIRST_ORDER_NODES {
            mesh.geometry(element).map(|geometry| Self::Wide(Box::new(geometry)))
        } else {
            let (corners, nodes) = mesh.positions::<FIRST_ORDER_NODES>(element);
            Geometry::new(&corners[..nodes]).map(|geometry| Self::Narrow(Box::new(geometry)))
        };
        geometry.ok_or_else(|| Error::Mesh(format!("element {element}: inverted")))
    }
}

impl AssemblyPlan {
    fn new(problem: &Problem, behaviours: &[MaterialBehaviour], born: &[u32]) -> Self {
        let mesh = &problem.mesh;
        let (kinds, classes) = classify(mesh, &problem.material_of, behaviours);
        let by_corners = |condition: &Condition| {
            let faces: &[Face] = match condition.surface() {
                Some(FaceSelection::Faces(faces)) => faces,
                Some(FaceSelection::Outer { except }) => except,
                None => &[],
            };
            faces.iter().map(|&face| mesh.face_nodes(face).key()).collect()
        };
        let mut held = HashMap::new();
        for (index, condition) in (0..).zip(&problem.conditions) {
            if let Condition::Temperature { nodes, .. } = condition {
                held.extend(nodes.iter().map(|&node| (node, index)));
            }
        }
        let sorted = |elements: &[u32]| {
            let mut elements = elements.to_vec();
            elements.sort_unstable();
            elements
        };
        Self {
            numbering: Numbering::new(problem, born),
            around: NodeElements::new(mesh, &problem.absent),
            kinds,
            classes,
            named: problem.conditions.iter().map(by_corners).collect(),
            held,
            heated: problem.sources.iter().map(|source| sorted(&source.elements)).collect(),
        }
    }

    /// Returns true if a condition acts on a face.
    fn acts(&self, problem: &Problem, condition: usize, face: Face) -> bool {
        let named = &self.named[condition];
        match problem.conditions[condition].surface() {
            Some(FaceSelection::Faces(_)) => named.contains(&problem.mesh.face_nodes(face).key()),
            Some(FaceSelection::Outer { .. }) => {
                named.is_empty() || !named.contains(&problem.mesh.face_nodes(face).key())
            }
            None => false,
        }
    }
}

impl ThermalSystem {
    /// Assembles the elements that are born (entry in `born` not [`NONE`]) after `births` births.
    ///
    /// # Errors
    /// [`Error::Mesh`] for an inverted element.
    pub fn build(
        problem: &Problem,
        behaviours: &[MaterialBehaviour],
        born: &[u32],
        births: usize,
    ) -> Result<Self, Error> {
        let consistent = problem.capacity == Capacity::Consistent;
        let stride = |wanted: &dyn Fn(&MaterialBehaviour) -> bool| {
            behaviours.iter().filter(|b| wanted(b)).map(|b| b.states).max().unwrap_or(0)
        };
        let mut nodal = NodalPoints {
            stride: stride(&MaterialBehaviour::nodal),
            followers: behaviours.iter().map(|b| b.capacity.is_some()).collect(),
            energies: behaviours.iter().any(|b| b.nodal() && b.capacity.is_none()),
            ..NodalPoints::laws_of(problem, behaviours)
        };
        let plan = AssemblyPlan::new(problem, behaviours, born);
        nodal.weighed = nodal.energies || plan.kinds.contains(&OWN);
        let mut system = Self {
            elements: 0,
            equation: vec![NONE; problem.mesh.points.len()],
            rows: ConductionRows::new(consistent),
            capacity: Vec::new(),
            nodal,
            general: ElementPoints::new(stride(&|b| b.conductivity.is_none())),
            surfaces: Surfaces::new(problem),
            fixed: Vec::new(),
            free: Vec::new(),
            consistent,
            build: 0,
            generation: 0,
            evaluated_at: f64::NEG_INFINITY,
            plan,
        };
        let elements = (0..born.len() as u32).filter(|&e| born[e as usize] != NONE).collect::<Vec<_>>();
        system.add(problem, behaviours, born, births, &elements)?;
        Ok(system)
    }

    /// Born elements of an equation's node, ascending, with the local number of the node.
    pub fn around(&self, equation: u32, born: &[u32]) -> impl Iterator<Item = (u32, usize)> {
        self.plan.around.elements_of(self.nodes()[equation as usize], born)
    }

    /// Mass ρV of a point at a node, kg.
    pub fn mass(&self, problem: &Problem, born: &[u32], equation: usize, point: usize) -> f64 {
        let NodalPoints { birth, material, mass, weighed, like, .. } = &self.nodal;
        if *weighed {
            return mass[point];
        }
        let mut sum = 0.0;
        for (element, corner) in self.around(equation as u32, born) {
            let own = usize::from(problem.material_of[element as usize]);
            let key = (born[element as usize], like[own]);
            let class = self.plan.classes.get(usize::from(self.plan.kinds[element as usize]));
            if let Some(class) = class.filter(|_| key == (birth[point], material[point])) {
                sum += problem.materials[own].density() * class.volumes[corner];
            }
        }
        sum
    }

    /// Adds elements, ascending, that appear with the last of `births` births.
    ///
    /// # Errors
    /// [`Error::Mesh`] for an inverted element.
    pub fn add(
        &mut self,
        problem: &Problem,
        behaviours: &[MaterialBehaviour],
        born: &[u32],
        births: usize,
        new: &[u32],
    ) -> Result<Added, Error> {
        let (mesh, old) = (&problem.mesh, self.size());
        let size = self.plan.numbering.end(births);
        self.capacity.resize(size, 0.0);
        self.free.resize(size, 0.0);
        let mut touched = TouchedEquations::new(size);
        let mut fresh = Vec::new();
        for &node in new.iter().flat_map(|&element| mesh.nodes(element)) {
            if self.equation[node as usize] == NONE {
                let around = self.plan.around.elements_of(node, born);
                let first = around.map(|(element, _)| born[element as usize]).min().unwrap_or(NONE);
                let Some(equation) = self.plan.numbering.equation(node, first) else {
                    return Err(Error::Mesh(format!("node {node} of birth {first}: has no equation")));
                };
                self.equation[node as usize] = equation;
                self.free[equation as usize] = 1.0;
                fresh.push(equation);
            }
            touched.add(self.equation[node as usize]);
        }
        fresh.sort_unstable();
        let new_fresh = |equation: u32| fresh.binary_search(&equation).is_ok();
        // face matrices of consistent capacity have no order that allows additions
        if self.consistent && old > 0 {
            self.equation.iter().filter(|equation| **equation != NONE).for_each(|&e| touched.add(e));
        }
        touched.sort();
        let before = touched.list.iter().map(|&e| (e, (!new_fresh(e)).then_some(self.capacity[e as usize])));
        let mut added = Added { before: before.collect(), ..Added::default() };
        let mut ring = Vec::new();
        if old == 0 {
            ring.extend_from_slice(new);
        } else {
            let around = |&e: &u32| self.plan.around.elements_of(self.nodes()[e as usize], born);
            ring.extend(touched.list.iter().flat_map(around).map(|(element, _)| element));
            ring.sort_unstable();
            ring.dedup();
        }
        added.visited = ring.len() as u64;
        self.elements += new.len();
        if old == 0
            && let Some(bands) = self.bands(problem, size, new)
        {
            self.rows = ConductionRows::from_bands(bands);
        } else {
            self.connect(mesh, born, size, &touched);
        }
        let Self { plan, nodal, .. } = self;
        if behaviours.iter().any(MaterialBehaviour::nodal) {
            let like = nodal.like.clone();
            added.nodal = nodal.replace(size, &touched.list, |equation, keys| {
                for (element, _) in plan.around.elements_of(plan.numbering.nodes[equation as usize], born) {
                    let material = usize::from(problem.material_of[element as usize]);
                    let key = (born[element as usize], like[material]);
                    if behaviours[material].nodal() && !keys.contains(&key) {
                        keys.push(key);
                    }
                }
            });
        }
        let varying: Vec<u32> =
            new.iter().copied().filter(|&element| self.plan.kinds[element as usize] == VARYING).collect();
        let material = |element: &u32| &behaviours[usize::from(problem.material_of[*element as usize])];
        self.general.potential |= varying.iter().any(|element| material(element).potential);
        added.general = self.general.insert(mesh, &varying, &self.equation);
        touched.list.iter().for_each(|&equation| self.capacity[equation as usize] = 0.0);
        let volumes = self.add_elements(problem, behaviours, born, &ring, &touched)?;
        if !self.general.is_empty() {
            self.rows.keep();
        }
        self.update_surfaces(problem, born, &ring, &touched, &volumes);
        for &equation in &fresh {
            if let Some(&condition) = self.plan.held.get(&self.nodes()[equation as usize]) {
                self.fixed.push((equation, condition));
                self.free[equation as usize] = 0.0;
            }
        }
        self.fixed.sort_unstable();
        // only births and rows without own masses ask for neighbours later
        if self.rows.bands().is_some() {
            self.plan.around.free_lists();
        }
        self.build += 1;
        self.generation = self.build << 32;
        self.evaluated_at = f64::NEG_INFINITY;
        Ok(added)
    }

    /// Returns empty diagonals for all elements, if most have their own matrices, none varies, and none is
    /// born later.
    fn bands(&self, problem: &Problem, size: usize, new: &[u32]) -> Option<Bands> {
        let kind = |element: &u32| self.plan.kinds[*element as usize];
        let own = new.iter().filter(|element| kind(element) == OWN).count();
        if !problem.births.is_empty() || 2 * own <= new.len() || new.iter().any(|e| kind(e) == VARYING) {
            return None;
        }
        Bands::find(size, self.consistent, new.iter(), |&element, equations| {
            equations.extend(problem.mesh.nodes(element).iter().map(|&node| self.equation[node as usize]));
        })
    }

    /// Assembles the rows of touched equations.
    fn connect(&mut self, mesh: &Mesh, born: &[u32], size: usize, touched: &TouchedEquations) {
        let Self { rows, plan, equation, .. } = self;
        let AssemblyPlan { around, kinds, classes, numbering, .. } = plan;
        rows.update(size, &touched.list, |index, row: &mut RowBuilder| {
            let around = || around.elements_of(numbering.nodes[index], born);
            // corners, classes and relative nodes of the surrounding elements determine a row, except for
            // elements outside all classes
            let repeated = row.begin(around().flat_map(|(element, corner)| {
                let here = [corner as u32, u32::from(kinds[element as usize])];
                let others = mesh.nodes(element).iter();
                here.into_iter().chain(others.map(|&n| equation[n as usize].wrapping_sub(index as u32)))
            }));
            if repeated {
                return;
            }
            for (element, a) in around() {
                let class = classes.get(usize::from(kinds[element as usize]));
                row.own |= class.is_none();
                for (b, &node) in mesh.nodes(element).iter().enumerate() {
                    let offset = equation[node as usize].wrapping_sub(index as u32) as i32;
                    match class {
                        Some(class) => row.add(offset, class.conduction[a][b], class.capacity[a][b]),
                        None => row.add(offset, 0.0, 0.0),
                    }
                }
            }
        });
    }

    /// Adds, at touched equations, elements outside all classes, and the capacity of all; returns ∫ N dV of
    /// each first-order element with a source.
    fn add_elements(
        &mut self,
        problem: &Problem,
        behaviours: &[MaterialBehaviour],
        born: &[u32],
        elements: &[u32],
        touched: &TouchedEquations,
    ) -> Result<Vec<(u32, [f64; FIRST_ORDER_NODES])>, Error> {
        let mesh = &problem.mesh;
        let mut volumes = Vec::new();
        for elements in elements.chunks(BATCH) {
            let AssemblyPlan { kinds, classes, .. } = &self.plan;
            // most elements have none
            let own: Vec<Option<ElementGeometry>> = elements
                .par_iter()
                .with_min_len(64)
                .map(|&element| match usize::from(kinds[element as usize]) < classes.len() {
                    true => Ok(None),
                    false => ElementGeometry::new(mesh, element).map(Some),
                })
                .collect::<Result<_, _>>()?;
            for (&element, geometry) in elements.iter().zip(own) {
                let kind = self.plan.kinds[element as usize];
                let material = problem.material_of[element as usize];
                let behaviour = &behaviours[usize::from(material)];
                let nodes = mesh.nodes(element);
                match geometry.as_ref().filter(|_| kind == OWN) {
                    Some(ElementGeometry::Narrow(geometry)) => {
                        self.add_own(nodes, &matrices(geometry, behaviour), touched);
                    }
                    Some(ElementGeometry::Wide(geometry)) => {
                        self.add_own(nodes, &matrices(geometry, behaviour), touched)
                    }
                    None => {}
                }
                // rows by diagonals take equal elements one by one, too
                if self.rows.bands().is_some()
                    && let Some(class) = self.plan.classes.get(usize::from(kind))
                {
                    let both = (class.conduction, class.capacity);
                    self.add_own(nodes, &both, touched);
                }
                let corner_volumes = match geometry.as_ref() {
                    Some(ElementGeometry::Narrow(geometry)) => &geometry.corner_volumes[..],
                    Some(ElementGeometry::Wide(geometry)) => &geometry.corner_volumes[..],
                    None => &self.plan.classes[usize::from(kind)].volumes[..],
                };
                if let Some(volume) = corner_volumes.first_chunk::<FIRST_ORDER_NODES>()
                    && nodes.len() <= FIRST_ORDER_NODES
                    && self.plan.heated.iter().any(|list| list.binary_search(&element).is_ok())
                {
                    volumes.push((element, *volume));
                }
                for (&node, &volume) in nodes.iter().zip(corner_volumes) {
                    let node = self.equation[node as usize];
                    if !touched.contains(node) {
                        continue;
                    }
                    if let Some(capacity) = behaviour.capacity {
                        self.capacity[node as usize] += capacity * volume;
                    }
                    if behaviour.nodal() && self.nodal.weighed {
                        let key = (born[element as usize], self.nodal.like[usize::from(material)]);
                        let density = problem.materials[usize::from(material)].density();
                        for point in self.nodal.points_of(node as usize) {
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

    /// Adds conduction and capacity of one element to touched rows.
    fn add_own<const N: usize>(
        &mut self,
        nodes: &[u32],
        (conduction, capacity): &([[f64; N]; N], [[f64; N]; N]),
        touched: &TouchedEquations,
    ) {
        for (a, &row) in nodes.iter().enumerate() {
            let row = self.equation[row as usize];
            if !touched.contains(row) {
                continue;
            }
            for (b, &column) in nodes.iter().enumerate() {
                let column = self.equation[column as usize] as usize;
                self.rows.add(row as usize, column, conduction[a][b], capacity[a][b]);
            }
        }
    }

    /// Updates conditions on the outer surface, and sources, at touched equations.
    fn update_surfaces(
        &mut self,
        problem: &Problem,
        born: &[u32],
        elements: &[u32],
        touched: &TouchedEquations,
        volumes: &[(u32, [f64; FIRST_ORDER_NODES])],
    ) {
        let Self { plan, surfaces, equation, consistent, .. } = self;
        let mesh = &problem.mesh;
        if problem.conditions.iter().any(|condition| condition.surface().is_some()) {
            let wanted = |node: u32| touched.contains(equation[node as usize]);
            let exposed = plan.around.outer(mesh, born, elements, wanted);
            surfaces.set_condition(problem, &exposed, equation, *consistent, touched, |condition, face| {
                plan.acts(problem, condition, face)
            });
        }
        for (source, heated) in plan.heated.iter().enumerate() {
            let (mut list, mut pairs) = (Vec::new(), Vec::new());
            for &number in elements {
                let first = heated.partition_point(|&element| element < number);
                for _ in heated[first..].iter().take_while(|&&element| element == number) {
                    let nodes = mesh.nodes(number);
                    if nodes.len() > FIRST_ORDER_NODES {
                        let Some(geometry) = mesh.geometry(number) else { continue };
                        let equation = |a: usize| equation[nodes[a] as usize];
                        let mass = geometry.mass();
                        for (a, b) in (0..nodes.len()).flat_map(|a| (0..nodes.len()).map(move |b| (a, b))) {
                            pairs.push((equation(a), equation(b), mass[a][b]));
                        }
                    }
                    if let Ok(at) = volumes.binary_search_by_key(&number, |entry| entry.0) {
                        let nodes = nodes.iter().map(|&node| equation[node as usize]).zip(volumes[at].1);
                        list.extend(nodes.filter(|entry| touched.contains(entry.0)));
                    }
                }
            }
            surfaces.set_source(source, list, pairs, touched);
        }
    }
}
