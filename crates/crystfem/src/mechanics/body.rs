//! A body of solidifying Maxwell elements on hexahedra and tetrahedra: births, steps, supports.

use super::branch::BranchEnergies;
use super::element::{GAUSS_POINTS, VoigtVector};
use super::element_kind::{self, MechanicalElement};
use super::maxwell::MaxwellIncrement;
use super::product::{NodalLoad, gather};
use crate::error::Error;
use crate::mesh::Mesh;
use nalgebra::Vector3;

/// Default relative residual at which a solution ends.
const TOLERANCE: f64 = 1e-12;

/// Body of elements with their state and displacements.
///
/// Strains of an element count from its birth. Only increments of displacement enter, so that earlier
/// positions of shared nodes do not matter.
pub struct Body<'a> {
    pub(super) mesh: &'a Mesh,
    /// Matrices of distinct element shapes.
    shapes: Vec<MechanicalElement>,
    shape: Vec<u32>,
    /// Relative residual at which a solution ends.
    pub tolerance: f64,
    /// State of the body.
    pub state: BodyState,
}

/// State of a body, sufficient to continue with the same bits.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct BodyState {
    /// Elastic strains of the branches at each Gauss point, element by element (0 beyond the element's
    /// points); empty before birth.
    strains: Vec<Vec<[[f64; 6]; GAUSS_POINTS]>>,
    /// Σ E b s e at the Gauss points of each element at the end of the last step, Pa: the stress over Ĉ.
    stresses: Vec<[[f64; 6]; GAUSS_POINTS]>,
    /// Displacements of the nodes, m.
    pub displacement: Vec<[f64; 3]>,
    /// Total number of conjugate-gradient iterations.
    pub iterations: u64,
    /// Rotation of each element since it solidified, rad: half the curl of the displacement at its centre.
    rotations: Vec<[f64; 3]>,
    /// Energies of all past steps.
    pub balance: EnergyBalance,
}

/// Energies of the steps of a body, J.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct EnergyBalance {
    /// Sum over all branches of all elements.
    pub energies: BranchEnergies,
    /// Energy dissipated by the minimum stiffness of the melt.
    pub floor: f64,
    /// Largest |[`BranchEnergies::closure`]| of a step over the energies moved and stored.
    pub worst: f64,
}

/// A fixed node and component: zero displacement increment.
pub type FixedComponent = (u32, usize);

impl<'a> Body<'a> {
    /// Returns a body without active elements.
    ///
    /// # Errors
    /// [`Error::Parameter`] for elements other than first-order hexahedra and tetrahedra, for inverted
    /// elements, and for a Poisson's ratio outside −1 … 0.5.
    pub fn new(mesh: &'a Mesh, poisson: f64) -> Result<Self, Error> {
        let fault =
            |name, found: f64, allowed: &str| Error::Parameter { name, found, allowed: allowed.to_owned() };
        if !(poisson > -1.0 && poisson < 0.5) {
            return Err(fault("poisson", poisson, "above -1 and below 0.5"));
        }
        let count = mesh.element_count();
        let others = (0..count as u32)
            .filter(|&element| !element_kind::is_supported(mesh.nodes(element).len()))
            .count();
        if others > 0 {
            return Err(fault("elements other than 8-node hexahedra and tetrahedra", others as f64, "none"));
        }
        let (mut shapes, mut shape, mut known) = (Vec::new(), Vec::new(), std::collections::HashMap::new());
        for element in 0..count as u32 {
            let places = places(mesh, element);
            let key = element_kind::key(&places);
            let index = match known.get(&key) {
                Some(&index) => index,
                None => {
                    let own = MechanicalElement::new(&places, poisson);
                    shapes.push(own.ok_or_else(|| fault("volume of an element", f64::NAN, "above 0"))?);
                    known.insert(key, shapes.len() as u32 - 1);
                    shapes.len() as u32 - 1
                }
            };
            shape.push(index);
        }
        Ok(Self {
            mesh,
            shapes,
            shape,
            tolerance: TOLERANCE,
            state: BodyState {
                strains: vec![Vec::new(); count],
                stresses: vec![[[0.0; 6]; GAUSS_POINTS]; count],
                displacement: vec![[0.0; 3]; mesh.points.len()],
                iterations: 0,
                rotations: vec![[0.0; 3]; count],
                balance: EnergyBalance::default(),
            },
        })
    }

    /// Activates elements, free of stress and strain.
    pub fn activate(&mut self, elements: impl IntoIterator<Item = usize>, branches: usize) {
        for element in elements {
            self.state.strains[element] = vec![[[0.0; 6]; GAUSS_POINTS]; branches];
            self.state.stresses[element] = [[0.0; 6]; GAUSS_POINTS];
            self.state.rotations[element] = [0.0; 3];
        }
    }

    pub(super) fn shape_of(&self, element: usize) -> &MechanicalElement {
        &self.shapes[self.shape[element] as usize]
    }

    /// Largest rotation of an element since it solidified, rad. The theory assumes small strains: a rotation
    /// θ appears as a strain ½θ².
    pub fn largest_rotation(&self) -> f64 {
        self.state.rotations.iter().map(|r| r[0].hypot(r[1]).hypot(r[2])).fold(0.0, f64::max)
    }

    /// Cauchy stress at a Gauss point, Pa: xx, yy, zz, xy, yz, zx.
    pub fn stress(&self, element: usize, point: usize) -> [f64; 6] {
        self.shape_of(element).stress(&VoigtVector::from(self.state.stresses[element][point])).into()
    }

    /// Number of Gauss points of an element.
    pub fn points(&self, element: usize) -> usize {
        self.shape_of(element).weights().len()
    }

    /// Volume average of an element's stress over its Gauss points, Pa.
    pub fn mean_stress(&self, element: usize) -> [f64; 6] {
        let weights = self.shape_of(element).weights();
        let volume: f64 = weights.iter().sum();
        let points = (0..weights.len()).map(|point| (self.stress(element, point), weights[point] / volume));
        points.fold([0.0; 6], |sum, (stress, share)| std::array::from_fn(|k| sum[k] + share * stress[k]))
    }

    /// Nodes of an element.
    pub(super) fn nodes(&self, element: usize) -> &'a [u32] {
        self.mesh.nodes(element as u32)
    }

    /// Makes one step of all active elements, by one linear solution. `increment` gives the increment of an
    /// element, and the linear free strain at a Gauss point and its position (a value at the centre alone
    /// would leave stresses in a freely bending body).
    ///
    /// # Errors
    /// [`Error::Parameter`] if conjugate gradients do not converge: the supports leave a rigid motion that
    /// the loads drive.
    pub fn step(
        &mut self,
        increment: impl Fn(usize) -> MaxwellIncrement,
        free_strain: impl Fn(usize, usize, [f64; 3]) -> f64,
        supports: &[FixedComponent],
    ) -> Result<(), Error> {
        let alive: Vec<usize> = (0..self.state.strains.len())
            .filter(|&element| !self.state.strains[element].is_empty())
            .collect();
        let mut free = vec![[false; 3]; self.state.displacement.len()];
        for &element in &alive {
            self.nodes(element).iter().for_each(|&node| free[node as usize] = [true; 3]);
        }
        supports.iter().for_each(|&(node, component)| free[node as usize][component] = false);
        let mut load = NodalLoad { sum: vec![Vector3::zeros(); self.state.displacement.len()], parts: 0.0 };
        let mut steps = Vec::with_capacity(alive.len());
        for &element in &alive {
            let (shape, increment) = (&self.shapes[self.shape[element] as usize], increment(element));
            let (places, count) = (places(self.mesh, element as u32), shape.weights().len());
            let mut free = [0.0; GAUSS_POINTS];
            for (point, free) in free.iter_mut().enumerate().take(count) {
                *free = free_strain(element, point, place(&places, point));
            }
            // stress of a step without displacement
            let predicted: [VoigtVector; GAUSS_POINTS] = std::array::from_fn(|point| {
                let mut strains: Vec<[f64; 6]> =
                    self.state.strains[element].iter().map(|branch| branch[point]).collect();
                let mechanical = mechanical(&VoigtVector::zeros(), free[point]);
                increment.advance(&mut strains, &mechanical);
                let floor = VoigtVector::from(mechanical) * increment.floor;
                shape.stress(&(VoigtVector::from(increment.stress(&strains)) + floor))
            });
            let (forces, modal) = shape.forces(&predicted);
            for (k, &node) in self.nodes(element).iter().enumerate() {
                load.sum[node as usize] -= Vector3::from(forces.fixed_rows::<3>(3 * k));
            }
            load.parts += forces.norm_squared();
            steps.push((element, increment, free, modal));
        }
        let moduli: Vec<(usize, f64)> =
            steps.iter().map(|(element, increment, ..)| (*element, increment.stiffness)).collect();
        let moved = self.solve(&moduli, &free, load)?;
        let (mut energies, mut floor) = (BranchEnergies::default(), 0.0);
        for (element, increment, free, modal) in steps {
            let shape = &self.shapes[self.shape[element] as usize];
            let local = gather(self.nodes(element), &moved);
            let strains = shape.strains(&local, &modal, increment.stiffness);
            for (point, &volume) in shape.weights().iter().enumerate() {
                let mechanical = mechanical(&strains[point], free[point]);
                let mut branches: Vec<[f64; 6]> =
                    self.state.strains[element].iter().map(|branch| branch[point]).collect();
                let product = |a: &[f64; 6], b: &[f64; 6]| {
                    VoigtVector::from(*a).dot(&shape.stress(&VoigtVector::from(*b)))
                };
                energies.add(&increment.energies(&branches, &mechanical, product), volume);
                floor += 0.5 * volume * increment.floor * product(&mechanical, &mechanical);
                increment.advance(&mut branches, &mechanical);
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
        for (place, moved) in self.state.displacement.iter_mut().zip(&moved) {
            (0..3).for_each(|d| place[d] += moved[d]);
        }
        Ok(())
    }
}

/// Initial positions of an element's nodes.
fn places(mesh: &Mesh, element: u32) -> Vec<[f64; 3]> {
    mesh.nodes(element).iter().map(|&node| mesh.points[node as usize]).collect()
}

/// Position of a Gauss point.
fn place(places: &[[f64; 3]], point: usize) -> [f64; 3] {
    let mut place = [0.0; 3];
    for (node, share) in places.iter().zip(element_kind::shares(places.len(), point)) {
        (0..3).for_each(|d| place[d] += share * node[d]);
    }
    place
}

/// Mechanical strain increment Δε − Δε* 1.
fn mechanical(strain: &VoigtVector, free: f64) -> [f64; 6] {
    std::array::from_fn(|k| strain[k] - if k < 3 { free } else { 0.0 })
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
