//! Births: elements that appear with a temperature, and conserve energy.
//!
//! A node of new elements only takes their temperature. A node that old and new elements share takes the temperature
//! T* at which the energy counted at it is the sum of what both had:
//! Σ_old m [U(T*) − U(T_old)] + Σ_new m [U(T*) − U(T_birth)] = 0, with the material's own energy and what its state does
//! in a jump of no duration (Δt = 0). Nothing is lost, however thin the layer; with linear materials it is the mixture
//! by heat capacity. A prescribed temperature stays, and its support takes the difference.

use crate::element::{self, Geometry, MOST, WIDE, WIDE_POINTS};
use crate::error::Error;
use crate::material::Point;
use crate::simulation::{Simulation, State};
use crate::system::{Memory, NONE, Points, System};
use crate::time::Steps;
use nalgebra::Vector3;
use std::collections::HashMap;

/// Iterations for a temperature of mixture at most; bisection alone needs about 60.
const MOST_ITERATIONS: usize = 200;

/// Material at a node that may change its temperature.
struct Part {
    material: u16,
    /// ρV, kg.
    mass: f64,
    /// What it has, K.
    temperature: f64,
    /// U there, J/kg.
    energy: f64,
    state: Vec<f64>,
    /// Where its state and energy are kept.
    general: bool,
    point: usize,
    old: bool,
}

/// Linear material at a node.
#[derive(Clone, Copy, Default)]
struct Sum {
    /// ΣρcV of new elements, J/K.
    capacity: f64,
    /// Σ ρcV T_birth, J.
    heat: f64,
    coldest: f64,
    hottest: f64,
}

impl Simulation {
    /// Lets appear what is due.
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
        self.state.work.builds += 1;
        let build = self.state.work.builds;
        let new = System::build(&self.problem, &self.behaviours, &self.state.born, build)?;
        let old = std::mem::replace(&mut self.system, new);
        let sums = self.linear_sums(first)?;
        let mut state = std::mem::take(&mut self.state);
        let result = self.migrate(&old, &mut state, &sums);
        self.state = state;
        result?;
        self.restart();
        Ok(())
    }

    /// After a jump: no slope, no rate, the first step's length.
    fn restart(&mut self) {
        self.state.slope.clear();
        self.state.rate.clear();
        self.state.jump = true;
        if let Steps::Adaptive { first, .. } = self.settings.steps {
            self.state.next_dt = first;
        }
        self.forget();
    }

    /// Points of what exists at the start, at its temperature.
    pub(crate) fn fresh_points(&mut self) -> Result<(), Error> {
        let (problem, system) = (&self.problem, &self.system);
        let mut memory = Memory::empty(system);
        for node in 0..system.size() {
            for point in system.nodal.of(node) {
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
            let shapes = element::shapes::<WIDE, WIDE_POINTS>(nodes);
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

    /// Linear material of the elements born since `first`, at their nodes.
    fn linear_sums(&self, first: usize) -> Result<HashMap<u32, Sum>, Error> {
        let mut sums: HashMap<u32, Sum> = HashMap::new();
        for birth in &self.problem.births[first..self.state.births] {
            for &number in &birth.elements {
                let material = usize::from(self.problem.material_of[number as usize]);
                let (corners, nodes) = element::corners(&self.problem.mesh, number);
                let volumes = match <Geometry>::new(&corners[..nodes]) {
                    Some(geometry) => geometry.corner_volumes,
                    None => return Err(Error::Mesh(format!("element {number}: inverted"))),
                };
                for (&node, volume) in self.problem.mesh.nodes(number).iter().zip(volumes) {
                    let sum = sums.entry(self.system.equation[node as usize]).or_insert(Sum {
                        coldest: f64::INFINITY,
                        hottest: f64::NEG_INFINITY,
                        ..Sum::default()
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

    /// Takes temperatures and points over to the new equations, and mixes at the nodes in `sums`.
    fn migrate(&mut self, old: &System, state: &mut State, sums: &HashMap<u32, Sum>) -> Result<(), Error> {
        let (problem, new) = (&self.problem, &self.system);
        let mut memory = Memory::empty(new);
        let mut temperature = vec![0.0; new.size()];
        let mut parts: HashMap<u32, Vec<Part>> = HashMap::new();
        // points at nodes
        for equation in 0..new.size() {
            let before = old.equation[new.nodes[equation] as usize];
            if before != NONE {
                temperature[equation] = state.temperature[before as usize];
            }
            for point in new.nodal.of(equation) {
                let key = (new.nodal.birth[point], new.nodal.material[point]);
                let kept = (before != NONE)
                    .then(|| {
                        old.nodal
                            .of(before as usize)
                            .find(|&p| (old.nodal.birth[p], old.nodal.material[p]) == key)
                    })
                    .flatten();
                let stride = new.nodal.stride;
                let from = match kept {
                    Some(from) => {
                        memory.nodal.copy(&state.memory.nodal, from, point, stride);
                        temperature[equation]
                    }
                    None => {
                        let birth = problem.births[key.0 as usize - 1].temperature;
                        memory.nodal.fresh(problem, usize::from(key.1), stride, point, birth);
                        birth
                    }
                };
                if sums.contains_key(&(equation as u32)) {
                    let coupled = !new.nodal.follows(key.1);
                    parts.entry(equation as u32).or_default().push(Part {
                        material: key.1,
                        mass: if coupled { new.nodal.mass[point] } else { 0.0 },
                        temperature: from,
                        energy: memory.nodal.energy[point],
                        state: memory.nodal.state[point * stride..(point + 1) * stride].to_vec(),
                        general: false,
                        point,
                        old: kept.is_some(),
                    });
                }
            }
        }
        // points in elements
        for (index, &number) in new.general.elements.iter().enumerate() {
            let kept = old.general.elements.binary_search(&number).ok();
            let (corners, nodes) = element::corners(&problem.mesh, number);
            let material = problem.material_of[number as usize];
            let stride = new.general.stride;
            let volumes = <Geometry>::new(&corners[..nodes]).map_or([0.0; MOST], |g| g.corner_volumes);
            for g in 0..nodes {
                let point = new.general.starts[index] as usize + g;
                let equation = new.general.equations_of(index)[g];
                let from = match kept {
                    Some(kept) => {
                        let from = old.general.starts[kept] as usize + g;
                        memory.general.copy(&state.memory.general, from, point, stride);
                        temperature[equation as usize]
                    }
                    None => {
                        let birth = state.born[number as usize] as usize - 1;
                        let birth = problem.births[birth].temperature;
                        memory.general.fresh(problem, usize::from(material), stride, point, birth);
                        birth
                    }
                };
                if sums.contains_key(&equation) {
                    parts.entry(equation).or_default().push(Part {
                        material,
                        mass: problem.materials[usize::from(material)].density() * volumes[g],
                        temperature: from,
                        energy: memory.general.energy[point],
                        state: memory.general.state[point * stride..(point + 1) * stride].to_vec(),
                        general: true,
                        point,
                        old: kept.is_some(),
                    });
                }
            }
        }
        // mixture
        let mut prescribed = temperature.clone();
        new.prescribe(problem, state.time, &mut prescribed);
        let (mut stored, mut brought, mut reaction) = (0.0, 0.0, 0.0);
        let mut equations: Vec<u32> = sums.keys().copied().collect();
        equations.sort_unstable();
        for equation in equations {
            let sum = &sums[&equation];
            let k = equation as usize;
            let before = old.equation[new.nodes[k] as usize];
            let existed = before != NONE;
            let capacity = if existed { old.capacity[before as usize] } else { 0.0 };
            let mut list = parts.remove(&equation).unwrap_or_default();
            let fixed = (new.free[k] == 0.0).then_some(prescribed[k]);
            let mixture = Mixture { capacity, temperature: temperature[k], existed, sum };
            let reached = mixture.settle(self, fixed, &mut list)?;
            let old_heat = if existed { capacity * temperature[k] } else { 0.0 };
            let mut change = (capacity + sum.capacity) * reached - old_heat;
            let mut new_heat = sum.heat;
            for part in &list {
                let points = if part.general { &mut memory.general } else { &mut memory.nodal };
                let stride = part.state.len();
                points.state[part.point * stride..(part.point + 1) * stride].copy_from_slice(&part.state);
                let before = points.energy[part.point];
                points.energy[part.point] = part.energy;
                change += part.mass * if part.old { part.energy - before } else { part.energy };
                new_heat += if part.old { 0.0 } else { part.mass * before };
            }
            stored += change;
            brought += new_heat;
            reaction += if fixed.is_some() { change - new_heat } else { 0.0 };
            temperature[k] = reached;
        }
        (state.temperature, state.memory) = (temperature, memory);
        state.ledger.add_birth(stored, brought, reaction);
        Ok(())
    }
}

/// What meets at a node.
struct Mixture<'a> {
    /// ΣρcV of old linear material, J/K.
    capacity: f64,
    /// Its temperature, K.
    temperature: f64,
    existed: bool,
    sum: &'a Sum,
}

impl Mixture<'_> {
    /// The common temperature; `parts` take their state and energy there.
    fn settle(&self, simulation: &Simulation, fixed: Option<f64>, parts: &mut [Part]) -> Result<f64, Error> {
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
                for _ in 0..MOST_ITERATIONS {
                    let (mut surplus, mut slope) = (linear * guess - heat, linear);
                    for part in parts.iter() {
                        let (energy, capacity, _) = part.at(simulation, guess)?;
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
            let (energy, _, state) = part.at(simulation, reached)?;
            (part.energy, part.state) = (energy, state);
        }
        Ok(reached)
    }
}

impl Part {
    /// U, ∂U/∂T and the state after a jump to a temperature.
    fn at(&self, simulation: &Simulation, temperature: f64) -> Result<(f64, f64, Vec<f64>), Error> {
        let material = &simulation.problem.materials[usize::from(self.material)];
        let count = material.state_names().len();
        let increment = temperature - self.temperature;
        let at = Point { temperature: self.temperature, increment, gradient: Vector3::zeros(), dt: 0.0 };
        let mut state = self.state.clone();
        let response = material.respond(&at, &self.state[..count], &mut state[..count])?;
        Ok((response.energy, response.d_energy_d_temperature, state))
    }
}

impl Memory {
    /// Room for the points of a system.
    pub(crate) fn empty(system: &System) -> Self {
        let room = |points: usize, stride: usize| Points {
            state: vec![0.0; points * stride],
            energy: vec![0.0; points],
        };
        Self {
            nodal: room(system.nodal.material.len(), system.nodal.stride),
            general: room(system.general.points(), system.general.stride),
        }
    }
}

impl Points {
    /// Fresh material at a temperature.
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
        self.energy[point] = material.energy(temperature, state);
    }

    fn copy(&mut self, from: &Self, source: usize, point: usize, stride: usize) {
        self.state[point * stride..(point + 1) * stride]
            .copy_from_slice(&from.state[source * stride..(source + 1) * stride]);
        self.energy[point] = from.energy[source];
    }
}
