//! Material points at nodes, for materials with constant conductivity: one for each node, material and birth.
//!
//! At a node all elements of one material and birth share one temperature history, hence one state, for any
//! fill fraction; a mesh of hexahedra needs an eighth of the calls that Gauss points would need.

use super::vector::{CHUNK, items};
use super::{Evaluation, MaterialBehaviour, NONE, PointMoves, PointStates, StepInput};
use crate::error::Error;
use crate::material::{Crystallization, Increments, PointInput, Scratch, ThermalMaterial};
use crate::problem::Problem;
use nalgebra::Vector3;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// Points at nodes, in the order of the nodes.
#[derive(Clone, Debug, Default)]
pub struct NodalPoints {
    /// First point of each node, and at the end the number of points.
    pub starts: Vec<u32>,
    /// Material of each point, one of `like`.
    pub material: Vec<u16>,
    /// Birth of each point.
    pub birth: Vec<u32>,
    /// Mass ρV, kg; empty if energies are linear and all elements belong to a class: see
    /// [`super::ThermalSystem::mass`].
    pub mass: Vec<f64>,
    /// True if masses are stored.
    pub weighed: bool,
    /// Number of state variables of a point.
    pub stride: usize,
    /// Followers: materials with linear energy, whose state follows the temperature without effect on it.
    pub followers: Vec<bool>,
    /// True if energies are stored, for materials whose energy is not linear.
    pub energies: bool,
    /// True if a point has such a material.
    pub coupled: bool,
    /// Laws of crystallization of followers.
    pub laws: Vec<Crystallization>,
    /// Index in `laws` of each material.
    pub law_of: Vec<Option<u16>>,
    /// First material with the same states, for each material: materials that differ only in the fraction of
    /// the elements they fill share points.
    pub like: Vec<u16>,
}

/// Buffers for one work item of [`NodalPoints::follow`].
#[derive(Default)]
struct PointScratch {
    /// Points of one law, and their nodes, both within the item.
    points: Vec<u32>,
    nodes: Vec<u32>,
    z: Vec<f64>,
    scratch: Scratch,
    before: Vec<f64>,
}

impl NodalPoints {
    /// Returns an empty set with the laws of the followers.
    pub fn laws_of(problem: &Problem, behaviours: &[MaterialBehaviour]) -> Self {
        let mut laws: Vec<Crystallization> = Vec::new();
        let mut law = |(material, behaviour): (&Arc<dyn ThermalMaterial>, &MaterialBehaviour)| {
            let own =
                material.crystals().filter(|_| behaviour.capacity.is_some() && behaviour.states == 1)?;
            let known = laws.iter().position(|law| law == own);
            Some(known.unwrap_or_else(|| {
                laws.push(*own);
                laws.len() - 1
            }) as u16)
        };
        let law_of = problem.materials.iter().zip(behaviours).map(&mut law).collect();
        let whole = |material: &Arc<dyn ThermalMaterial>| {
            Arc::as_ptr(material.filling().unwrap_or(material)).cast::<()>()
        };
        let first = |own| problem.materials.iter().position(|other| whole(other) == whole(own));
        let like = problem.materials.iter().map(|own| first(own).unwrap_or(0) as u16).collect();
        Self { laws, law_of, like, ..Self::default() }
    }

    /// Returns true without points.
    pub fn is_empty(&self) -> bool {
        self.material.is_empty()
    }

    /// Points of a node.
    pub fn points_of(&self, node: usize) -> std::ops::Range<usize> {
        if self.is_empty() { 0..0 } else { self.starts[node] as usize..self.starts[node + 1] as usize }
    }

    /// Returns true for a follower.
    pub fn follows(&self, material: u16) -> bool {
        self.followers.get(usize::from(material)).is_some_and(|&follows| follows)
    }

    /// Rebuilds the points of `changed` equations, ascending, and of all new ones up to `size`; `keys` lists
    /// birth and material of the points of a node. New points have no mass yet. Returns the moves of points.
    pub fn replace(
        &mut self,
        size: usize,
        touched: &[u32],
        mut keys: impl FnMut(u32, &mut Vec<(u32, u16)>),
    ) -> PointMoves {
        if self.starts.is_empty() {
            self.starts.push(0);
        }
        let first = touched.first().map_or(size, |&e| e as usize).min(self.starts.len() - 1);
        let start = self.starts[first] as usize;
        let ends = self.starts.split_off(first + 1);
        let (birth, material) = (self.birth.split_off(start), self.material.split_off(start));
        let mass = if self.weighed { self.mass.split_off(start) } else { Vec::new() };
        let mut moves = PointMoves { first: start, from: Vec::new() };
        let mut touched = touched.iter().peekable();
        let mut list = Vec::new();
        let mut begin = 0;
        for equation in first as u32..size as u32 {
            let end = ends.get(equation as usize - first).map_or(begin, |&end| end as usize - start);
            list.clear();
            let anew = touched.next_if(|&&e| e == equation).is_some();
            if anew {
                keys(equation, &mut list);
                list.sort_unstable();
            } else {
                list.extend((begin..end).map(|point| (birth[point], material[point])));
            }
            for &key in &list {
                let old = (begin..end).find(|&point| (birth[point], material[point]) == key);
                self.birth.push(key.0);
                self.material.push(key.1);
                if self.weighed {
                    self.mass.push(old.filter(|_| !anew).map_or(0.0, |old| mass[old]));
                }
                self.coupled |= !self.follows(key.1);
                moves.from.push(old.map_or(NONE, |old| (start + old) as u32));
            }
            self.starts.push(self.material.len() as u32);
            begin = end;
        }
        moves
    }

    /// Evaluates materials whose energy is not linear: adds to `change` and `capacity`, sets the new points.
    pub fn evaluate(
        &self,
        problem: &Problem,
        at: &StepInput,
        old: &PointStates,
        out: &mut Evaluation,
    ) -> Result<(), Error> {
        if self.coupled {
            let ratio = self.respond(problem, at, old, out)?;
            out.step_ratio = ratio.into_iter().chain(out.step_ratio).reduce(f64::min);
        }
        Ok(())
    }

    /// Restores the states of followers in `new` from `old`.
    pub fn keep_followers(&self, old: &PointStates, new: &mut PointStates) {
        let PointStates { state, energy } = new;
        if !self.coupled {
            state.clone_from(&old.state);
            energy.clone_from(&old.energy);
            return;
        }
        for (point, _) in self.material.iter().enumerate().filter(|(_, material)| self.follows(**material)) {
            let own = point * self.stride..(point + 1) * self.stride;
            state[own.clone()].copy_from_slice(&old.state[own]);
            energy[point] = old.energy[point];
        }
    }

    /// Integrates the followers over the increment; returns the smallest requested ratio of next to present
    /// step, and the number of points.
    pub fn follow(
        &self,
        problem: &Problem,
        at: &StepInput,
        states: &mut [f64],
    ) -> Result<(Option<f64>, u64), Error> {
        if !self.followers.contains(&true) || self.is_empty() {
            return Ok((None, 0));
        }
        let nodes = self.starts.len() - 1;
        let mut work = Vec::with_capacity(items(nodes));
        let mut rest = states;
        for first in (0..nodes).step_by(CHUNK) {
            let last = (first + CHUNK).min(nodes);
            let points = (self.starts[last] - self.starts[first]) as usize;
            let (here, others) = rest.split_at_mut(points * self.stride);
            work.push((first..last, here));
            rest = others;
        }
        let found: Vec<(Option<f64>, u64)> = work
            .into_par_iter()
            .map_init(PointScratch::default, |room, (nodes, states)| {
                self.follow_item(problem, at, nodes, states, room)
            })
            .collect::<Result<_, Error>>()?;
        let count = found.iter().map(|found| found.1).sum();
        Ok((found.into_iter().filter_map(|found| found.0).reduce(f64::min), count))
    }

    fn follow_item(
        &self,
        problem: &Problem,
        at: &StepInput,
        range: Range<usize>,
        states: &mut [f64],
        room: &mut PointScratch,
    ) -> Result<(Option<f64>, u64), Error> {
        let offset = self.starts[range.start] as usize;
        let place = |node: usize| {
            let start = at.start[node];
            let increment = at.temperature[node] - start;
            PointInput { temperature: start, increment, gradient: Vector3::zeros(), dt: at.dt }
        };
        let PointScratch { points, nodes, z, scratch, before } = room;
        let (mut ratio, mut count): (Option<f64>, u64) = (None, 0);
        let law_of = |point: usize| self.law_of[usize::from(self.material[point])];
        for (number, law) in (0..).zip(&self.laws) {
            points.clear();
            nodes.clear();
            for (k, node) in (0..).zip(range.clone()) {
                for point in self.points_of(node).filter(|&point| law_of(point) == Some(number)) {
                    if nodes.last() != Some(&k) {
                        place(node).check()?;
                    }
                    nodes.push(k);
                    points.push((point - offset) as u32);
                }
            }
            if points.is_empty() {
                continue;
            }
            z.clear();
            z.extend(points.iter().map(|&point| states[point as usize * self.stride]));
            let increments = Increments {
                start: &at.start[range.clone()],
                end: &at.temperature[range.clone()],
                dt: at.dt,
            };
            let wish = law.advance_all(increments, nodes, z, scratch);
            ratio = wish.into_iter().chain(ratio).reduce(f64::min);
            for (&point, z) in points.iter().zip(&*z) {
                states[point as usize * self.stride] = *z;
            }
            count += points.len() as u64;
        }
        for node in range {
            for point in self.points_of(node) {
                let index = self.material[point];
                if !self.follows(index) || law_of(point).is_some() {
                    continue;
                }
                let material: &dyn ThermalMaterial = &*problem.materials[usize::from(index)];
                let own = &mut states[(point - offset) * self.stride..][..material.state_names().len()];
                before.clear();
                before.extend_from_slice(own);
                let response = material.respond(&place(node), before, own)?;
                ratio = response.step_ratio.into_iter().chain(ratio).reduce(f64::min);
                count += 1;
            }
        }
        Ok((ratio, count))
    }

    fn respond(
        &self,
        problem: &Problem,
        at: &StepInput,
        old: &PointStates,
        out: &mut Evaluation,
    ) -> Result<Option<f64>, Error> {
        let Evaluation { change, capacity, memory, .. } = out;
        let new = &mut memory.nodal;
        new.state.resize(old.state.len(), 0.0);
        new.energy.resize(old.energy.len(), 0.0);
        let nodes = change.len();
        let mut work = Vec::with_capacity(items(nodes));
        let (mut state, mut energy) = (new.state.as_mut_slice(), new.energy.as_mut_slice());
        for (item, (change, capacity)) in change.chunks_mut(CHUNK).zip(capacity.chunks_mut(CHUNK)).enumerate()
        {
            let first = item * CHUNK;
            let points = (self.starts[first + change.len()] - self.starts[first]) as usize;
            let (here, rest) = state.split_at_mut(points * self.stride);
            let (energies, others) = energy.split_at_mut(points);
            work.push((first, change, capacity, here, energies));
            (state, energy) = (rest, others);
        }
        let ratios: Vec<Option<f64>> = work
            .into_par_iter()
            .map(|(first, change, capacity, state, energy)| {
                self.item(problem, at, old, first, change, capacity, state, energy)
            })
            .collect::<Result<_, _>>()?;
        let coupled = self.material.iter().filter(|&&material| !self.follows(material)).count();
        out.responses += coupled as u64;
        Ok(ratios.into_iter().flatten().reduce(f64::min))
    }

    #[allow(clippy::too_many_arguments)]
    fn item(
        &self,
        problem: &Problem,
        at: &StepInput,
        old: &PointStates,
        first: usize,
        change: &mut [f64],
        capacity: &mut [f64],
        state: &mut [f64],
        energy: &mut [f64],
    ) -> Result<Option<f64>, Error> {
        let mut ratio: Option<f64> = None;
        let offset = self.starts[first] as usize;
        for k in 0..change.len() {
            let start = at.start[first + k];
            let place = PointInput {
                temperature: start,
                increment: at.temperature[first + k] - start,
                gradient: Vector3::zeros(),
                dt: at.dt,
            };
            for point in self.points_of(first + k) {
                if self.follows(self.material[point]) {
                    continue;
                }
                let material: &dyn ThermalMaterial = &*problem.materials[usize::from(self.material[point])];
                let local = point - offset;
                let (old_state, new_state) = (
                    &old.state[point * self.stride..(point + 1) * self.stride],
                    &mut state[local * self.stride..(local + 1) * self.stride],
                );
                let count = material.state_names().len();
                let response = material.respond(&place, &old_state[..count], &mut new_state[..count])?;
                ratio = response.step_ratio.into_iter().chain(ratio).reduce(f64::min);
                energy[local] = response.energy;
                change[k] += self.mass[point] * (response.energy - old.energy[point]);
                capacity[k] += self.mass[point] * response.d_energy_d_temperature;
            }
        }
        Ok(ratio)
    }
}
