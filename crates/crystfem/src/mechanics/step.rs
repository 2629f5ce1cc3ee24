//! A step of a body: one linear solution, or Newton's method where branches flow.

use super::body::{Body, FixedComponent, gauss_position, mechanical, places, slide};
use super::branch::BranchEnergies;
use super::element::{GAUSS_POINTS, ModalVector, VoigtVector};
use super::element_kind::ElementTangent;
use super::maxwell::MaxwellIncrement;
use super::product::{NodalLoad, gather};
use super::solve::ROUNDING_RATIO;
use crate::error::Error;
use nalgebra::Vector3;

/// Limit on Newton steps and their halvings, and on halvings of one step.
const NEWTON_STEPS: usize = 100;
const HALVINGS: u32 = 8;
/// Linear residual of a Newton step, over the present one.
const FORCING: f64 = 1e-4;

/// An element in a step.
struct ElementStep {
    element: usize,
    increment: MaxwellIncrement,
    /// Free strains at the Gauss points.
    free: [f64; GAUSS_POINTS],
    modal: ModalVector,
    flowing: Option<Box<Flowing>>,
}

/// An element of a body that flows.
struct Flowing {
    /// Strains Δε at the Gauss points, and their last change.
    strains: [VoigtVector; GAUSS_POINTS],
    change: [VoigtVector; GAUSS_POINTS],
    tangent: Option<ElementTangent>,
}

impl Body<'_> {
    /// Makes one step of all active elements, by one linear solution if no branch flows. `increment` gives
    /// the increment of an element, and the linear free strain at a Gauss point and its position (a value at
    /// the centre alone would leave stresses in a freely bending body).
    ///
    /// # Errors
    /// [`Error::Parameter`] if conjugate gradients do not converge: the supports leave a rigid motion that
    /// the loads drive; or if Newton's method does not.
    pub fn step(
        &mut self,
        increment: impl Fn(usize) -> MaxwellIncrement,
        free_strain: impl Fn(usize, usize, [f64; 3]) -> f64,
        supports: &[FixedComponent],
    ) -> Result<(), Error> {
        let alive = (0..self.state.strains.len()).filter(|&element| !self.state.strains[element].is_empty());
        let each = |element: usize| {
            let (increment, places) = (increment(element), places(self.mesh, element as u32));
            let mut free = [0.0; GAUSS_POINTS];
            for (point, free) in free.iter_mut().enumerate().take(self.points(element)) {
                *free = free_strain(element, point, gauss_position(&places, point));
            }
            ElementStep { element, increment, free, modal: ModalVector::zeros(), flowing: None }
        };
        let mut steps: Vec<ElementStep> = alive.map(each).collect();
        let flows = steps.iter().any(|step| step.increment.flows());
        if flows {
            let zero = [VoigtVector::zeros(); GAUSS_POINTS];
            let still = || Some(Box::new(Flowing { strains: zero, change: zero, tangent: None }));
            steps.iter_mut().for_each(|step| step.flowing = still());
        }
        let mut free = vec![[false; 3]; self.state.displacement.len()];
        for step in &steps {
            self.nodes(step.element).iter().for_each(|&node| free[node as usize] = [true; 3]);
        }
        supports.iter().for_each(|&(node, component)| free[node as usize][component] = false);
        let load = self.load(&mut steps, &free)?;
        let moved = self.solve(&moduli(&steps), &free, &load, self.tolerance)?;
        let moved = if flows { self.iterate(&mut steps, &free, &load, moved)? } else { moved };
        self.accept(steps, &moved);
        Ok(())
    }

    /// Load that is out of balance at the present strains, without that on rollers, with tangents and modal
    /// forces.
    fn load(&self, steps: &mut [ElementStep], free: &[[bool; 3]]) -> Result<NodalLoad, Error> {
        let mut load = NodalLoad { sum: vec![Vector3::zeros(); self.state.displacement.len()], parts: 0.0 };
        for ElementStep { element, increment, free: strains_free, modal, flowing } in steps {
            let shape = self.shape_of(*element);
            let mut moduli = [nalgebra::SMatrix::zeros(); GAUSS_POINTS];
            let stresses: [VoigtVector; GAUSS_POINTS] = std::array::from_fn(|point| {
                let mut strains: Vec<[f64; 6]> =
                    self.state.strains[*element].iter().map(|branch| branch[point]).collect();
                let strain = flowing.as_ref().map_or_else(VoigtVector::zeros, |flow| flow.strains[point]);
                let mechanical = mechanical(&strain, strains_free[point]);
                if flowing.is_some() {
                    let step = increment.point(self.poisson, &strains, &mechanical);
                    moduli[point] = step.tangent();
                    step.advance(&mut strains, &mechanical);
                } else {
                    increment.advance(&mut strains, &mechanical);
                }
                let floor = VoigtVector::from(mechanical) * increment.floor;
                shape.stress(&(VoigtVector::from(increment.stress(&strains)) + floor))
            });
            let (forces, found) = match flowing {
                Some(flowing) => {
                    let tangent = shape.tangent(&moduli).ok_or_else(|| Error::Parameter {
                        name: "stiffness of an element, Pa",
                        found: moduli[0][(0, 0)],
                        allowed: "above 0 (a floor above 0 if all branches relax)".to_owned(),
                    })?;
                    shape.forces_with(flowing.tangent.insert(tangent), &stresses)
                }
                None => shape.forces(&stresses),
            };
            *modal = found;
            for (k, &node) in self.nodes(*element).iter().enumerate() {
                load.sum[node as usize] -= Vector3::from(forces.fixed_rows::<3>(3 * k));
            }
            load.parts += forces.norm_squared();
        }
        slide(&mut load.sum, &self.normals(free));
        Ok(load)
    }

    /// Iterates by Newton's method from the first load and its solution, with steps halved until the load out
    /// of balance falls. Returns the displacements of the step.
    fn iterate(
        &mut self,
        steps: &mut [ElementStep],
        free: &[[bool; 3]],
        first: &NodalLoad,
        first_moved: Vec<Vector3<f64>>,
    ) -> Result<Vec<Vector3<f64>>, Error> {
        let norm = |load: &NodalLoad, steps: &[ElementStep]| -> f64 {
            let nodes = load.sum.iter().zip(free);
            let own = |(force, free): (&Vector3<f64>, &[bool; 3])| -> f64 {
                (0..3).filter(|&d| free[d]).map(|d| force[d] * force[d]).sum()
            };
            let modes = steps.iter().map(|step| step.modal.norm_squared());
            (nodes.map(own).sum::<f64>() + modes.sum::<f64>()).sqrt()
        };
        let mut least = norm(first, steps);
        let goal = (self.tolerance * least).max(ROUNDING_RATIO * first.parts.sqrt());
        let mut moved = vec![Vector3::zeros(); first_moved.len()];
        let (mut change, mut halvings) = (first_moved, 0);
        self.move_by(steps, &change);
        for _ in 0..NEWTON_STEPS {
            let load = self.load(steps, free)?;
            let found = norm(&load, steps);
            if found.is_finite() && (found < least || halvings == HALVINGS || found <= goal) {
                moved
                    .iter_mut()
                    .zip(&change)
                    .for_each(|(sum, more)| *sum += more * 0.5_f64.powi(halvings as i32));
                if found <= goal.max(ROUNDING_RATIO * load.parts.sqrt()) {
                    return Ok(moved);
                }
                (least, halvings) = (found, 0);
                let tolerance = (0.1 * goal / found).clamp(self.tolerance, FORCING);
                change = self.solve(&moduli(steps), free, &load, tolerance)?;
                self.move_by(steps, &change);
            } else {
                halvings += 1;
                for flowing in steps.iter_mut().filter_map(|step| step.flowing.as_mut()) {
                    let Flowing { strains, change, .. } = &mut **flowing;
                    for (strain, change) in strains.iter_mut().zip(change) {
                        *change *= 0.5;
                        *strain -= *change;
                    }
                }
            }
        }
        Err(Error::Parameter {
            name: "residual of the flow, N",
            found: least,
            allowed: format!("at most {goal:e}: shorten the step"),
        })
    }

    /// Adds the strains of displacements to flowing elements.
    fn move_by(&self, steps: &mut [ElementStep], moved: &[Vector3<f64>]) {
        for step in steps {
            let Some(flowing) = &mut step.flowing else { continue };
            let Some(tangent) = &flowing.tangent else { continue };
            let local = gather(self.nodes(step.element), moved);
            flowing.change = self.shape_of(step.element).strains_with(tangent, &local, &step.modal);
            flowing.strains.iter_mut().zip(&flowing.change).for_each(|(sum, more)| *sum += more);
        }
    }

    /// Updates the state from the displacements of a step.
    fn accept(&mut self, steps: Vec<ElementStep>, moved: &[Vector3<f64>]) {
        let (mut energies, mut floor) = (BranchEnergies::default(), 0.0);
        for ElementStep { element, increment, free, modal, flowing } in steps {
            let shape = &self.shapes[self.shape[element] as usize];
            let local = gather(self.mesh.nodes(element as u32), moved);
            let strains = match &flowing {
                Some(flowing) => flowing.strains,
                None => shape.strains(&local, &modal, increment.stiffness),
            };
            for (point, &volume) in shape.weights().iter().enumerate() {
                let mechanical = mechanical(&strains[point], free[point]);
                let mut branches: Vec<[f64; 6]> =
                    self.state.strains[element].iter().map(|branch| branch[point]).collect();
                let product = |a: &[f64; 6], b: &[f64; 6]| {
                    VoigtVector::from(*a).dot(&shape.stress(&VoigtVector::from(*b)))
                };
                floor += 0.5 * volume * increment.floor * product(&mechanical, &mechanical);
                if flowing.is_some() {
                    let step = increment.point(self.poisson, &branches, &mechanical);
                    energies.add(&step.energies(&branches, &mechanical, product), volume);
                    step.advance(&mut branches, &mechanical);
                } else {
                    energies.add(&increment.energies(&branches, &mechanical, product), volume);
                    increment.advance(&mut branches, &mechanical);
                }
                self.state.stresses[element][point] = increment.stress(&branches);
                self.state.strains[element]
                    .iter_mut()
                    .zip(branches)
                    .for_each(|(branch, strain)| branch[point] = strain);
            }
            let turned = &mut self.state.rotations[element];
            if increment.melt {
                *turned = [0.0; 3];
            } else {
                turned.iter_mut().zip(shape.rotation(&local)).for_each(|(sum, more)| *sum += more);
            }
        }
        let balance = &mut self.state.balance;
        balance.energies.add(&energies, 1.0);
        balance.floor += floor;
        let moved_energy = energies.size() + balance.energies.stored.abs();
        if moved_energy > 0.0 {
            balance.worst = balance.worst.max(energies.closure().abs() / moved_energy);
        }
        for (place, moved) in self.state.displacement.iter_mut().zip(moved) {
            (0..3).for_each(|d| place[d] += moved[d]);
        }
    }
}

/// Stiffness of the elements.
fn moduli(steps: &[ElementStep]) -> Vec<(usize, Option<&[f64]>, f64)> {
    let tangents = steps.iter().map(|step| step.flowing.as_ref()?.tangent.as_ref());
    let each = steps.iter().zip(tangents).map(|(step, tangent)| {
        let factor = if tangent.is_some() { 1.0 } else { step.increment.stiffness };
        (step.element, tangent.map(ElementTangent::stiffness), factor)
    });
    each.collect()
}
