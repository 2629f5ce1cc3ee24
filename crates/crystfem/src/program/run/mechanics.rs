//! Stress of a part on its way through the temperatures of a simulation.

use super::probe::Probe;
use crate::error::Error;
use crate::mechanics::{Body, BodyState, MOST, Support, points, shares};
use crate::mesh::Mesh;
use crate::program::quantities as q;
use crate::program::scene::Mechanics;
use crate::simulation::Simulation;
use harness::report::Report;
use nalgebra::{Matrix3, Vector3};
use polycore::tensor::von_mises;

/// Residual over the load at which a solution ends: its error is far below that of the model.
const TOLERANCE: f64 = 1e-8;

/// The state of an element at the last solution.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
struct Last {
    /// Temperatures of the nodes, K, and their number.
    nodes: [f64; MOST],
    count: usize,
    /// α.
    degree: f64,
    /// s.
    time: f64,
}

/// What a resumed run needs.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Reached {
    body: BodyState,
    last: Vec<Option<Last>>,
    /// Solutions.
    steps: u64,
    /// Largest Mises stress before the release, Pa.
    printed: f64,
}

/// A part with stress.
pub struct Follower<'a> {
    spec: &'a Mechanics,
    mesh: &'a Mesh,
    body: Body<'a>,
    reached: Reached,
}

impl<'a> Follower<'a> {
    /// Of a part of which nothing exists, or as far as a run was.
    ///
    /// # Errors
    /// Those of [`Body::new`].
    pub fn new(spec: &'a Mechanics, mesh: &'a Mesh, mut reached: Reached) -> Result<Self, Error> {
        let mut body = Body::new(mesh, spec.law.poisson)?;
        body.tolerance = TOLERANCE;
        if reached.last.is_empty() {
            reached.last = vec![None; spec.bears.len()];
        } else {
            body.state = std::mem::take(&mut reached.body);
        }
        Ok(Self { spec, mesh, body, reached })
    }

    /// What a checkpoint needs.
    pub fn reached(&self) -> Reached {
        Reached { body: self.body.state.clone(), ..self.reached.clone() }
    }

    /// Sees an accepted step: lets appear what was born before it, and solves where the free strain has changed enough, where elements are about
    /// to be born, or where it `must`.
    ///
    /// # Errors
    /// Those of [`Body::step`].
    pub fn see(&mut self, simulation: &Simulation, must: bool) -> Result<(), Error> {
        let time = simulation.time();
        let degrees = simulation.element_means("alpha");
        let births = &simulation.problem().births;
        let now = |element: usize| -> Option<Last> {
            let (mut nodes, own) = ([0.0; MOST], self.mesh.nodes(element as u32));
            for (value, &node) in nodes.iter_mut().zip(own) {
                *value = simulation.temperature(node)?;
            }
            Some(Last { nodes, count: own.len(), degree: degrees[element].unwrap_or(0.0), time })
        };
        let mut present = vec![None; self.spec.bears.len()];
        let (mut born, mut change) = (Vec::new(), 0.0_f64);
        for element in (0..self.spec.bears.len()).filter(|&element| self.spec.bears[element]) {
            if !simulation.is_born(element as u32) {
                continue;
            }
            present[element] = now(element);
            if self.reached.last[element].is_none() {
                // its own temperature at birth: what it shares with neighbours at once is a part of its strain
                let birth = (simulation.state().born[element] as usize).checked_sub(1);
                self.reached.last[element] = match birth.and_then(|birth| births.get(birth)) {
                    Some(birth) => Some(Last {
                        nodes: [birth.temperature; MOST],
                        count: self.mesh.nodes(element as u32).len(),
                        degree: self.spec.fresh,
                        time: birth.time,
                    }),
                    None => present[element],
                };
                born.push(element);
            }
            if let (Some(before), Some(after)) = (self.reached.last[element], present[element]) {
                let strain = |[from, to]: [f64; 2]| {
                    self.spec.law.volume.strain([from, before.degree], [to, after.degree])
                };
                let pairs = before.nodes.into_iter().zip(after.nodes).take(after.count);
                change = pairs.map(|(from, to)| strain([from, to]).abs()).fold(change, f64::max);
            }
        }
        self.body.born(born, self.spec.law.branches());
        // who is born now must not take part in what happened before
        let about = births.get(simulation.state().births).is_some_and(|birth| birth.time <= time);
        if must || about || change > self.spec.strain_step {
            let supports: Vec<Support> =
                self.spec.bed.iter().flat_map(|&node| (0..3).map(move |d| (node, d))).collect();
            self.solve(&present, &supports)?;
            self.reached.last = present;
        }
        Ok(())
    }

    /// From the last states of elements to the present ones.
    fn solve(&mut self, present: &[Option<Last>], supports: &[Support]) -> Result<(), Error> {
        let (law, last) = (&self.spec.law, &self.reached.last);
        if last.iter().all(Option::is_none) {
            return Ok(());
        }
        let pair = |element: usize| {
            let after = present[element].or(last[element]);
            let before = last[element].or(after);
            before.zip(after)
        };
        self.body.step(
            |element| match pair(element) {
                Some((before, after)) => {
                    law.increment(before.state(), after.state(), after.time - before.time)
                }
                None => law.increment([300.0, 0.0], [300.0, 0.0], 0.0),
            },
            |element, point, _| {
                let Some((before, after)) = pair(element) else { return 0.0 };
                law.volume.strain([before.at(point), before.degree], [after.at(point), after.degree])
            },
            supports,
        )?;
        self.reached.steps += 1;
        Ok(())
    }

    /// Off the bed: a step of no duration, with six supports.
    ///
    /// # Errors
    /// Those of [`Body::step`].
    pub fn release(&mut self) -> Result<(), Error> {
        self.reached.printed = self.largest_mises();
        if self.spec.release {
            let present = self.reached.last.clone();
            self.solve(&present, &self.resting())?;
            self.lay();
        }
        Ok(())
    }

    /// Takes away the small rigid motion t + ω × (x − x̄) that is nearest to the displacements of the bed side.
    fn lay(&mut self) {
        let moved = self.displacement();
        let alive = |&node: &u32| !moved[3 * node as usize].is_nan();
        let bed: Vec<u32> = self.spec.bed.iter().copied().filter(alive).collect();
        let place = |node: u32| Vector3::from(self.mesh.points[node as usize]);
        let centre = bed.iter().map(|&node| place(node)).sum::<Vector3<f64>>() / bed.len() as f64;
        let (mut matrix, mut turn, mut shift) = (Matrix3::zeros(), Vector3::zeros(), Vector3::zeros());
        for &node in &bed {
            let arm = place(node) - centre;
            let u = Vector3::from(self.body.state.displacement[node as usize]);
            matrix += Matrix3::identity() * arm.norm_squared() - arm * arm.transpose();
            turn += arm.cross(&u);
            shift += u / bed.len() as f64;
        }
        let turn = matrix.try_inverse().unwrap_or_default() * turn;
        for (u, at) in self.body.state.displacement.iter_mut().zip(&self.mesh.points) {
            let rigid = shift + turn.cross(&(Vector3::from(*at) - centre));
            (0..3).for_each(|d| u[d] -= rigid[d]);
        }
    }

    /// Three nodes of the bed, far from each other, with 3, 2 and 1 components held: no rigid motion is left and no force needed.
    fn resting(&self) -> Vec<Support> {
        let place = |node: u32| Vector3::from(self.mesh.points[node as usize]);
        let alive: std::collections::HashSet<u32> = (0..self.reached.last.len())
            .filter(|&element| self.reached.last[element].is_some())
            .flat_map(|element| self.mesh.nodes(element as u32).iter().copied())
            .collect();
        let bed: Vec<u32> = self.spec.bed.iter().copied().filter(|node| alive.contains(node)).collect();
        let farthest = |of: &dyn Fn(u32) -> f64| {
            bed.iter().copied().max_by(|&a, &b| of(a).total_cmp(&of(b)).then(b.cmp(&a))).unwrap_or(0)
        };
        let first = bed.first().copied().unwrap_or(0);
        let second = farthest(&|node| (place(node) - place(first)).norm());
        let along = (place(second) - place(first)).normalize();
        let third = farthest(&|node| (place(node) - place(first)).cross(&along).norm());
        let normal = along.cross(&(place(third) - place(first)));
        let (axis, upright) = (along.iamax(), normal.iamax());
        let mut supports: Vec<Support> = (0..3).map(|d| (first, d)).collect();
        supports.extend((0..3).filter(|&d| d != axis).map(|d| (second, d)));
        supports.push((third, upright));
        supports
    }

    /// Displacements of the nodes, m, three a node; NaN where nothing bears stress.
    pub fn displacement(&self) -> Vec<f64> {
        let mut all = vec![f64::NAN; 3 * self.mesh.points.len()];
        for element in (0..self.reached.last.len()).filter(|&element| self.reached.last[element].is_some()) {
            for &node in self.mesh.nodes(element as u32) {
                let node = node as usize;
                all[3 * node..3 * node + 3].copy_from_slice(&self.body.state.displacement[node]);
            }
        }
        all
    }

    /// Mises stress of each element, Pa: the largest of its Gauss points; NaN where nothing bears stress.
    pub fn mises(&self) -> Vec<f64> {
        let of = |element: usize| {
            let alive = self.reached.last.get(element).is_some_and(Option::is_some);
            let points =
                (0..self.body.points(element)).map(|point| von_mises(self.body.stress(element, point)));
            if alive { points.fold(0.0, f64::max) } else { f64::NAN }
        };
        (0..self.mesh.element_count()).map(of).collect()
    }

    /// Mean stress of each element, Pa, six each in VTK's order of symmetric tensors, xx, yy, zz, xy, yz, zx; NaN where nothing bears stress.
    pub fn stresses(&self) -> Vec<f64> {
        let of = |element: usize| match self.reached.last.get(element).is_some_and(Option::is_some) {
            true => self.body.mean_stress(element),
            false => [f64::NAN; 6],
        };
        (0..self.mesh.element_count()).flat_map(of).collect()
    }

    fn largest_mises(&self) -> f64 {
        self.mises().into_iter().filter(|x| !x.is_nan()).fold(0.0, f64::max)
    }

    /// By how much the bed side is out of flat, m: largest less smallest distance from its least-squares plane.
    fn warpage(&self) -> f64 {
        let moved = self.displacement();
        let bed: Vec<[f64; 3]> = self
            .spec
            .bed
            .iter()
            .map(|&node| {
                std::array::from_fn(|d| self.mesh.points[node as usize][d] + moved[3 * node as usize + d])
            })
            .filter(|place: &[f64; 3]| place.iter().all(|x| x.is_finite()))
            .collect();
        let count = bed.len() as f64;
        let mean: [f64; 3] = std::array::from_fn(|d| bed.iter().map(|p| p[d]).sum::<f64>() / count);
        let rows = nalgebra::Matrix3xX::from_fn(bed.len(), |d, k| bed[k][d] - mean[d]);
        let eigen = (&rows * rows.transpose()).symmetric_eigen();
        let normal = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        let distances = rows.column_iter().map(|place| place.dot(&normal));
        let [low, high] = distances.fold([0.0_f64; 2], |[low, high], x| [low.min(x), high.max(x)]);
        high - low
    }

    /// The scalars of the end, with the displacements of the probes that are in the part.
    pub fn record(&self, probes: &[Probe], report: &mut Report) {
        let (largest, audit) = (self.largest_mises(), &self.body.state.audit);
        report.value(q::WARPAGE, self.warpage());
        report.value(q::MISES_ON_BED, self.reached.printed);
        report.value(q::MISES, largest);
        if self.spec.law.strength.is_finite() {
            report.value(q::MISES_OVER_STRENGTH, self.reached.printed.max(largest) / self.spec.law.strength);
        }
        report.value(q::LARGEST_ROTATION, self.body.largest_rotation());
        report.value(q::STRESS_WORK, audit.energies.work);
        report.value(q::STRESS_STORED, audit.energies.stored);
        report.value(q::STRESS_LOST, audit.energies.lost());
        report.value(q::STRESS_HARDENING, audit.energies.softening);
        report.value(q::WORST_STRESS_BALANCE, audit.worst);
        let moved = self.displacement();
        for probe in probes {
            for (d, axis) in ["x", "y", "z"].into_iter().enumerate() {
                let at = |node: u32| Some(moved[3 * node as usize + d]).filter(|x| !x.is_nan());
                if let Some(value) = probe.place().value(at) {
                    report.value(q::DISPLACEMENT.of(&[probe.name(), axis]), value);
                }
            }
        }
        let moved =
            moved.chunks(3).map(|u| u[0].hypot(u[1]).hypot(u[2])).filter(|x| !x.is_nan()).fold(0.0, f64::max);
        report.value(q::LARGEST_DISPLACEMENT, moved);
        report.work("stress_steps", self.reached.steps).work("stress_iterations", self.body.state.iterations);
    }
}

impl Last {
    /// Mean T, K, and α.
    fn state(&self) -> [f64; 2] {
        // corners of first order have equal shares
        if self.count <= 8 {
            return [self.nodes[..self.count].iter().sum::<f64>() / self.count as f64, self.degree];
        }
        let points = points(self.count);
        [(0..points).map(|point| self.at(point)).sum::<f64>() / points as f64, self.degree]
    }

    /// T at a Gauss point, K.
    fn at(&self, point: usize) -> f64 {
        let shares = shares(self.count, point);
        shares[..self.count].iter().zip(self.nodes).map(|(share, t)| share * t).sum()
    }
}
