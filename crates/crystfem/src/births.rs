//! Births: elements appear with a given temperature, and energy is conserved.
//!
//! A node of new elements only takes their temperature. A node shared by old and new elements takes the
//! temperature T* at which its energy is the sum of both contributions:
//! Σ_old m [U(T*) − U(T_old)] + Σ_new m [U(T*) − U(T_birth)] = 0.
//! U is the energy of the material, with the change of its state in a jump of no duration (Δt = 0). So the
//! balance closes for layers of any thickness; for linear materials T* is the mean weighted by heat capacity.
//! A prescribed temperature stays, and its support exchanges the difference.

use crate::element::{self, FIRST_ORDER_NODES, Geometry, MAX_ELEMENT_NODES, MAX_ELEMENT_POINTS};
use crate::error::Error;
use crate::material::PointInput;
use crate::simulation::{Simulation, State};
use crate::system::{Added, NONE, PointMemory, PointMoves, PointStates, ThermalSystem};
use crate::time::Steps;
use nalgebra::Vector3;
use std::collections::HashMap;

/// Limit on iterations for a mixing temperature; bisection alone needs about 60.
const MAX_ITERATIONS: usize = 200;

/// Material at a node that may change its temperature.
struct NodeMaterial {
    material: u16,
    /// ρV, kg.
    mass: f64,
    /// Temperature, K.
    temperature: f64,
    /// U at this temperature, J/kg.
    energy: f64,
    state: Vec<f64>,
    /// Kind of the points: `true` for points of general materials, `false` for nodal ones.
    general: bool,
    point: usize,
    old: bool,
}

/// Linear material at a node.
#[derive(Clone, Copy, Default)]
struct LinearSum {
    /// ΣρcV of new elements, J/K.
    capacity: f64,
    /// Σ ρcV T_birth, J.
    heat: f64,
    coldest: f64,
    hottest: f64,
}

impl Simulation {
    /// Activates the elements due now.
    pub(crate) fn give_birth(&mut self) -> Result<(), Error> {
        let first = self.state.births;
        while let Some(birth) = self.problem.births.get(self.state.births)
            && birth.time <= self.state.time
        {
            self.state.births += 1;
            for &element in &birth.elements {
                self.state.born[element as usize] = self.state.births as u32;
            }
        }
        let births = &self.problem.births[first..self.state.births];
        if births.iter().all(|birth| birth.elements.is_empty()) {
            return Ok(());
        }
        let mut elements: Vec<u32> = births.iter().flat_map(|birth| birth.elements.iter().copied()).collect();
        elements.sort_unstable();
        let Self { problem, behaviours, system, state, .. } = self;
        let added = system.add(problem, behaviours, &state.born, state.births, &elements)?;
        self.state.work.builds += 1;
        self.state.work.visited += added.visited;
        let sums = self.linear_sums(first)?;
        let mut state = std::mem::take(&mut self.state);
        let result = self.migrate(&mut state, &added, &sums);
        self.state = state;
        result?;
        self.restart();
        Ok(())
    }

    /// Resets the rates and the step length after a jump.
    fn restart(&mut self) {
        self.state.slope.clear();
        self.state.rate.clear();
        self.state.jump = true;
        if let Steps::Adaptive { first, .. } = self.settings.steps {
            self.state.next_dt = first;
        }
        self.forget();
    }

    /// Initializes the points of the elements that exist at the start, at their temperature.
    pub(crate) fn fresh_points(&mut self) -> Result<(), Error> {
        let (problem, system) = (&self.problem, &self.system);
        let mut memory = PointMemory::empty(system);
        for node in 0..system.size() {
            for point in system.nodal.points_of(node) {
                let material = usize::from(system.nodal.material[point]);
                memory.nodal.fresh(
                    problem,
                    material,
                    system.nodal.stride,
                    point,
                    self.state.temperature[node],
                );
            }
        }
        let general = &system.general;
        for (index, &number) in general.elements.iter().enumerate() {
            let first = general.starts[index] as usize;
            let equations = general.equations_of(index);
            let nodes = equations.len();
            let shapes = element::shapes::<MAX_ELEMENT_NODES, MAX_ELEMENT_POINTS>(nodes);
            let corner = |a: usize| self.state.temperature[equations[a] as usize];
            for g in 0..general.starts[index + 1] as usize - first {
                let temperature = match system.consistent {
                    true => (0..nodes).map(|a| shapes[g][a] * corner(a)).sum(),
                    false => corner(g),
                };
                let material = usize::from(problem.material_of[number as usize]);
                memory.general.fresh(problem, material, general.stride, first + g, temperature);
            }
        }
        self.state.memory = memory;
        Ok(())
    }

    /// Sums linear material of the elements born since `first`, by node.
    fn linear_sums(&self, first: usize) -> Result<HashMap<u32, LinearSum>, Error> {
        let mut sums: HashMap<u32, LinearSum> = HashMap::new();
        for birth in &self.problem.births[first..self.state.births] {
            for &number in &birth.elements {
                let material = usize::from(self.problem.material_of[number as usize]);
                let (corners, nodes) = self.problem.mesh.positions::<FIRST_ORDER_NODES>(number);
                let volumes = match <Geometry>::new(&corners[..nodes]) {
                    Some(geometry) => geometry.corner_volumes,
                    None => return Err(Error::Mesh(format!("element {number}: inverted"))),
                };
                for (&node, volume) in self.problem.mesh.nodes(number).iter().zip(volumes) {
                    let sum = sums.entry(self.system.equation[node as usize]).or_insert(LinearSum {
                        coldest: f64::INFINITY,
                        hottest: f64::NEG_INFINITY,
                        ..LinearSum::default()
                    });
                    let capacity = self.behaviours[material].capacity.unwrap_or(0.0) * volume;
                    sum.capacity += capacity;
                    sum.heat += capacity * birth.temperature;
                    sum.coldest = sum.coldest.min(birth.temperature);
                    sum.hottest = sum.hottest.max(birth.temperature);
                }
            }
        }
        Ok(sums)
    }

    /// Extends temperatures and points by those of new elements, and mixes at the nodes in `sums`.
    fn migrate(
        &mut self,
        state: &mut State,
        added: &Added,
        sums: &HashMap<u32, LinearSum>,
    ) -> Result<(), Error> {
        let (problem, system) = (&self.problem, &self.system);
        let PointMemory { nodal, general } = &mut state.memory;
        let birth_of = |birth: u32| problem.births[birth as usize - 1].temperature;
        nodal.rearrange(&added.nodal, system.nodal.stride, system.nodal.energies, |nodal, point| {
            let (birth, material) = (system.nodal.birth[point], system.nodal.material[point]);
            nodal.fresh(problem, usize::from(material), system.nodal.stride, point, birth_of(birth));
        });
        general.rearrange(&added.general, system.general.stride, true, |general, point| {
            let index = system.general.starts.partition_point(|&first| first as usize <= point) - 1;
            let number = system.general.elements[index] as usize;
            let material = usize::from(problem.material_of[number]);
            general.fresh(problem, material, system.general.stride, point, birth_of(state.born[number]));
        });
        state.temperature.resize(system.size(), 0.0);
        let (mut stored, mut brought, mut reaction) = (0.0, 0.0, 0.0);
        let mut prescribed = vec![0.0; if system.fixed.is_empty() { 0 } else { system.size() }];
        system.prescribe(problem, state.time, &mut prescribed);
        for &(equation, before) in &added.before {
            // with consistent capacity all nodes change
            let Some(sum) = sums.get(&equation) else { continue };
            let (k, existed) = (equation as usize, before.is_some());
            let old = state.temperature[k];
            let mut list = self.parts(state, added, equation);
            let fixed = system.fixed.binary_search_by_key(&equation, |entry| entry.0);
            let fixed = fixed.ok().map(|_| prescribed[k]);
            let capacity = before.unwrap_or(0.0);
            let mixture = Mixture { capacity, temperature: old, existed, sum };
            let reached = mixture.solve_temperature(self, fixed, &mut list)?;
            let old_heat = if existed { capacity * old } else { 0.0 };
            let mut change = (capacity + sum.capacity) * reached - old_heat;
            let mut new_heat = sum.heat;
            for part in &list {
                let points = if part.general { &mut state.memory.general } else { &mut state.memory.nodal };
                let stride = part.state.len();
                points.state[part.point * stride..(part.point + 1) * stride].copy_from_slice(&part.state);
                // linear materials are in `sum`
                if part.mass > 0.0 {
                    let before = std::mem::replace(&mut points.energy[part.point], part.energy);
                    change += part.mass * if part.old { part.energy - before } else { part.energy };
                    new_heat += if part.old { 0.0 } else { part.mass * before };
                }
            }
            stored += change;
            brought += new_heat;
            reaction += if fixed.is_some() { change - new_heat } else { 0.0 };
            state.temperature[k] = reached;
        }
        state.ledger.add_birth(stored, brought, reaction);
        Ok(())
    }

    /// Returns the materials at a node, old and new.
    fn parts(&self, state: &State, added: &Added, equation: u32) -> Vec<NodeMaterial> {
        let (problem, system) = (&self.problem, &self.system);
        let old = state.temperature[equation as usize];
        let mut parts = Vec::new();
        let part = |points: &PointStates, stride: usize, moves: &PointMoves, point: usize| NodeMaterial {
            material: 0,
            mass: 0.0,
            temperature: old,
            energy: points.energy.get(point).copied().unwrap_or(0.0),
            state: points.state[point * stride..(point + 1) * stride].to_vec(),
            general: false,
            point,
            old: point.checked_sub(moves.first).is_none_or(|k| moves.from.get(k).is_none_or(|&k| k != NONE)),
        };
        let birth_of = |birth: u32| problem.births[birth as usize - 1].temperature;
        let nodal = &system.nodal;
        for point in nodal.points_of(equation as usize) {
            let (birth, material) = (nodal.birth[point], nodal.material[point]);
            let mass = if nodal.follows(material) { 0.0 } else { nodal.mass[point] };
            let part = NodeMaterial {
                material,
                mass,
                ..part(&state.memory.nodal, nodal.stride, &added.nodal, point)
            };
            parts.push(NodeMaterial { temperature: if part.old { old } else { birth_of(birth) }, ..part });
        }
        for (number, g) in system.around(equation, &state.born) {
            let Ok(index) = system.general.elements.binary_search(&number) else { continue };
            let material = problem.material_of[number as usize];
            let (corners, nodes) = problem.mesh.positions::<FIRST_ORDER_NODES>(number);
            let volumes =
                <Geometry>::new(&corners[..nodes]).map_or([0.0; FIRST_ORDER_NODES], |g| g.corner_volumes);
            let mass = problem.materials[usize::from(material)].density() * volumes[g];
            let point = system.general.starts[index] as usize + g;
            let part = part(&state.memory.general, system.general.stride, &added.general, point);
            let temperature = if part.old { old } else { birth_of(state.born[number as usize]) };
            parts.push(NodeMaterial { material, mass, temperature, general: true, ..part });
        }
        parts
    }
}

/// Old and new material at one node.
struct Mixture<'a> {
    /// ΣρcV of old linear material, J/K.
    capacity: f64,
    /// Temperature, K.
    temperature: f64,
    existed: bool,
    sum: &'a LinearSum,
}

impl Mixture<'_> {
    /// Solves for the common temperature, and updates state and energy of `parts`.
    fn solve_temperature(
        &self,
        simulation: &Simulation,
        fixed: Option<f64>,
        parts: &mut [NodeMaterial],
    ) -> Result<f64, Error> {
        let (mut low, mut high) = (self.sum.coldest, self.sum.hottest);
        if self.existed {
            (low, high) = (low.min(self.temperature), high.max(self.temperature));
        }
        let linear = self.capacity + self.sum.capacity;
        let heat = self.sum.heat + if self.existed { self.capacity * self.temperature } else { 0.0 };
        let coupled = parts.iter().any(|part| part.mass > 0.0);
        let reached = match fixed {
            Some(fixed) => fixed,
            None if low >= high => low,
            None if !coupled => heat / linear,
            None => {
                // a monotone function: Newton within a bracket, else bisection
                let mut guess = 0.5 * (low + high);
                for _ in 0..MAX_ITERATIONS {
                    let (mut surplus, mut slope) = (linear * guess - heat, linear);
                    for part in parts.iter() {
                        let (energy, capacity, _) = part.after_jump(simulation, guess)?;
                        surplus += part.mass * (energy - part.energy);
                        slope += part.mass * capacity;
                    }
                    if surplus > 0.0 {
                        high = guess
                    } else {
                        low = guess
                    }
                    let newton = guess - surplus / slope;
                    let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
                    if next == guess || surplus == 0.0 {
                        break;
                    }
                    guess = next;
                    if high - low <= 2.0 * f64::EPSILON * high {
                        break;
                    }
                }
                guess
            }
        };
        for part in parts {
            let (energy, _, state) = part.after_jump(simulation, reached)?;
            (part.energy, part.state) = (energy, state);
        }
        Ok(reached)
    }
}

impl NodeMaterial {
    /// Returns U, ∂U/∂T and the state after a jump to a temperature.
    fn after_jump(&self, simulation: &Simulation, temperature: f64) -> Result<(f64, f64, Vec<f64>), Error> {
        let material = &simulation.problem.materials[usize::from(self.material)];
        let count = material.state_names().len();
        let increment = temperature - self.temperature;
        let at = PointInput { temperature: self.temperature, increment, gradient: Vector3::zeros(), dt: 0.0 };
        let mut state = self.state.clone();
        let response = material.respond(&at, &self.state[..count], &mut state[..count])?;
        Ok((response.energy, response.d_energy_d_temperature, state))
    }
}

impl PointMemory {
    /// Allocates the points of a system.
    pub(crate) fn empty(system: &ThermalSystem) -> Self {
        let room = |points: usize, stride: usize, energies: usize| PointStates {
            state: vec![0.0; points * stride],
            energy: vec![0.0; energies],
        };
        let nodal = system.nodal.material.len();
        let general = system.general.points();
        Self {
            nodal: room(nodal, system.nodal.stride, if system.nodal.energies { nodal } else { 0 }),
            general: room(general, system.general.stride, general),
        }
    }
}

impl PointStates {
    /// Returns fresh material at a temperature.
    fn fresh(
        &mut self,
        problem: &crate::problem::Problem,
        material: usize,
        stride: usize,
        point: usize,
        temperature: f64,
    ) {
        let material = &problem.materials[material];
        let state = &mut self.state[point * stride..][..material.state_names().len()];
        material.initial_state(temperature, state);
        if let Some(energy) = self.energy.get_mut(point) {
            *energy = material.energy(temperature, state);
        }
    }

    /// Moves points, with or without their energies; `fresh` initializes new ones.
    fn rearrange(
        &mut self,
        moves: &PointMoves,
        stride: usize,
        energies: bool,
        fresh: impl Fn(&mut Self, usize),
    ) {
        let state = self.state.split_off(moves.first * stride);
        let energy = if energies { self.energy.split_off(moves.first) } else { Vec::new() };
        for (point, &from) in (moves.first..).zip(&moves.from) {
            match (from as usize).checked_sub(moves.first).filter(|_| from != NONE) {
                Some(from) => {
                    self.state.extend_from_slice(&state[from * stride..(from + 1) * stride]);
                    self.energy.extend(energy.get(from));
                }
                None => {
                    self.state.resize((point + 1) * stride, 0.0);
                    self.energy.resize(if energies { point + 1 } else { 0 }, 0.0);
                    fresh(self, point);
                }
            }
        }
    }
}
