//! Stress and warpage of a part during a simulation.

use super::bed::{bed_nodes, loose_elements, out_of_flatness, remove_rigid_motion, statically_determinate};
use crate::error::Error;
use crate::mechanics::{
    Body, BodyState, EnergyBalance, FixedComponent, MAX_NODES_PER_ELEMENT, Roller, SolidifyingMaxwell,
    points, shares,
};
use crate::mesh::Mesh;
use crate::simulation::Simulation;
use polycore::tensor::von_mises;

/// Relative residual at which a solution ends: its error is far below that of the model.
const TOLERANCE: f64 = 1e-8;

/// Default of [`StressSettings::strain_step`].
pub const STRAIN_STEP: f64 = 2e-4;

/// Settings of a part that bears stress.
#[derive(Clone, Debug)]
pub struct StressSettings {
    /// Mechanical constants.
    pub law: SolidifyingMaxwell,
    /// Relative crystallinity α of fresh material; default 0.
    pub initial_alpha: f64,
    /// Elements that bear stress.
    pub bears: Vec<bool>,
    /// Bed nodes, ascending, held during the print.
    pub bed: Vec<u32>,
    /// Largest change of the linear free strain in any element between two solutions; default
    /// [`STRAIN_STEP`].
    pub strain_step: f64,
    /// Longest time between two solutions, s; default infinite: a hold at one temperature is one step.
    pub longest_step: f64,
    /// Release of the part from the bed; default true.
    pub release: bool,
    /// Release at the end of the first step that reaches this time, s; the free part then anneals. Default:
    /// at the end.
    pub release_at: Option<f64>,
    /// Rollers on planes of symmetry that contain the z axis, at an angle: a free part moves along z alone,
    /// and its bed side has a constant z. Default: none.
    pub rollers: Vec<Roller>,
    /// Temperature of each element at which it is free of stress if it is there from the start, K. Default:
    /// the initial temperatures of its nodes, of which one between two materials has a single one.
    pub stress_free: Option<Vec<f64>>,
}

impl StressSettings {
    /// Returns settings for the bearing elements of a mesh, held at the nodes of [`bed_nodes`].
    ///
    /// # Errors
    /// Errors of [`bed_nodes`].
    pub fn new(
        mesh: &Mesh,
        law: SolidifyingMaxwell,
        bears: Vec<bool>,
        bed: Option<&str>,
    ) -> Result<Self, Error> {
        let bed = bed_nodes(mesh, &bears, bed)?;
        Ok(Self {
            law,
            initial_alpha: 0.0,
            bears,
            bed,
            strain_step: STRAIN_STEP,
            longest_step: f64::INFINITY,
            release: true,
            release_at: None,
            rollers: Vec::new(),
            stress_free: None,
        })
    }
}

/// State of an element at the last solution.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
struct ElementThermalState {
    /// Temperatures of the nodes, K.
    nodes: [f64; MAX_NODES_PER_ELEMENT],
    /// Number of nodes.
    count: usize,
    /// α.
    degree: f64,
    /// Time, s.
    time: f64,
}

/// State of a coupling, for checkpoints.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct StressState {
    body: BodyState,
    last: Vec<Option<ElementThermalState>>,
    solutions: u64,
    mises_on_bed: f64,
    /// Time of the last solution, s.
    time: f64,
    /// Warpage, m, and largest Mises stress, Pa, after the release.
    released: Option<[f64; 2]>,
}

/// Quasi-static stress of a part whose free strain follows temperature and crystallization
/// ([`SolidifyingMaxwell`]), without effect on temperatures.
pub struct StressCoupling<'a> {
    settings: StressSettings,
    mesh: &'a Mesh,
    body: Body<'a>,
    state: StressState,
}

impl<'a> StressCoupling<'a> {
    /// Starts with an empty part on the mesh of a simulation.
    ///
    /// # Errors
    /// Errors of [`Body::new`] and [`SolidifyingMaxwell::check`]; [`Error::Mesh`] for fewer than three nodes
    /// on the bed, and elements that are not connected to it.
    pub fn new(mesh: &'a Mesh, settings: StressSettings) -> Result<Self, Error> {
        settings.law.check()?;
        let mut body = Body::new(mesh, settings.law.poisson)?;
        body.tolerance = TOLERANCE;
        body.rollers.clone_from(&settings.rollers);
        if settings.bed.len() < 3 {
            let found = settings.bed.len();
            return Err(Error::Mesh(format!("{found} nodes of the part on the bed; allowed: at least 3")));
        }
        let loose = loose_elements(mesh, &settings.bears, &settings.bed);
        if loose > 0 {
            return Err(Error::Mesh(format!(
                "{loose} elements are not connected with the bed; allowed: none"
            )));
        }
        let state = StressState { last: vec![None; settings.bears.len()], ..StressState::default() };
        Ok(Self { settings, mesh, body, state })
    }

    /// Returns the state for a checkpoint.
    pub fn save(&self) -> StressState {
        StressState { body: self.body.state.clone(), ..self.state.clone() }
    }

    /// Restores a state of the same part.
    pub fn restore(&mut self, mut state: StressState) {
        self.body.state = std::mem::take(&mut state.body);
        self.state = state;
    }

    /// Updates after an accepted step, and before the first: activates new elements; solves if the free
    /// strain changed by more than the strain step, if the longest step has passed, or if elements appear
    /// next. Releases the part at its time.
    ///
    /// # Errors
    /// Errors of [`Body::step`]; [`Error::Parameter`] for a temperature outside the range of the law.
    pub fn after_step(&mut self, simulation: &Simulation) -> Result<(), Error> {
        let due = self.settings.release_at.is_some_and(|time| time <= simulation.time());
        if due && self.state.released.is_none() {
            self.update(simulation, true)?;
            return self.release();
        }
        self.update(simulation, false)
    }

    /// Solves at the end of a simulation; then releases the part from the bed, if set and still to come, by a
    /// step of no duration with six supports.
    ///
    /// # Errors
    /// Errors of [`Self::after_step`].
    pub fn finish(&mut self, simulation: &Simulation) -> Result<(), Error> {
        self.update(simulation, true)?;
        if self.state.released.is_none() {
            self.state.mises_on_bed = self.largest_mises();
            return if self.settings.release { self.release() } else { Ok(()) };
        }
        self.forget_rigid_motion();
        Ok(())
    }

    fn release(&mut self) -> Result<(), Error> {
        self.state.mises_on_bed = self.largest_mises();
        let present = self.state.last.clone();
        self.solve(&present, &self.free_supports())?;
        self.forget_rigid_motion();
        self.state.released = Some([self.warpage(), self.largest_mises()]);
        Ok(())
    }

    fn free_supports(&self) -> Vec<FixedComponent> {
        let bed = self.present_bed(&self.displacement());
        if self.settings.rollers.is_empty() {
            return statically_determinate(self.mesh, &bed);
        }
        bed.first().map(|&node| (node, 2)).into_iter().collect()
    }

    fn forget_rigid_motion(&mut self) {
        let bed = self.present_bed(&self.displacement());
        let displacement = &mut self.body.state.displacement;
        if self.settings.rollers.is_empty() {
            return remove_rigid_motion(self.mesh, &bed, displacement);
        }
        let shift = bed.iter().map(|&node| displacement[node as usize][2]).sum::<f64>() / bed.len() as f64;
        displacement.iter_mut().for_each(|u| u[2] -= shift);
    }

    fn update(&mut self, simulation: &Simulation, must: bool) -> Result<(), Error> {
        let time = simulation.time();
        let degrees = simulation.element_means("alpha");
        let births = &simulation.problem().births;
        let now = |element: usize| -> Option<ElementThermalState> {
            let (mut nodes, own) = ([0.0; MAX_NODES_PER_ELEMENT], self.mesh.nodes(element as u32));
            for (value, &node) in nodes.iter_mut().zip(own) {
                *value = simulation.temperature(node)?;
            }
            Some(ElementThermalState {
                nodes,
                count: own.len(),
                degree: degrees[element].unwrap_or(0.0),
                time,
            })
        };
        let StressSettings { law, bears, .. } = &self.settings;
        let mut present = vec![None; bears.len()];
        let (mut born, mut change) = (Vec::new(), 0.0_f64);
        for element in (0..bears.len()).filter(|&element| bears[element]) {
            if !simulation.is_born(element as u32) {
                continue;
            }
            present[element] = now(element);
            if let Some(state) = &present[element] {
                state.nodes[..state.count].iter().try_for_each(|&kelvin| law.check_temperature(kelvin))?;
            }
            if self.state.last[element].is_none() {
                // birth temperature: the exchange with neighbours at birth is part of the strain
                let birth = (simulation.state().born[element] as usize).checked_sub(1);
                self.state.last[element] = match birth.and_then(|birth| births.get(birth)) {
                    Some(birth) => Some(ElementThermalState {
                        nodes: [birth.temperature; MAX_NODES_PER_ELEMENT],
                        count: self.mesh.nodes(element as u32).len(),
                        degree: self.settings.initial_alpha,
                        time: birth.time,
                    }),
                    // of the initial state: a surface at another temperature strains it from the start
                    None => present[element].map(|state| self.initial(simulation, element, state)),
                };
                born.push(element);
            }
            if let (Some(before), Some(after)) = (self.state.last[element], present[element]) {
                let strain =
                    |[from, to]: [f64; 2]| law.volume.strain([from, before.degree], [to, after.degree]);
                let pairs = before.nodes.into_iter().zip(after.nodes).take(after.count);
                change = pairs.map(|(from, to)| strain([from, to]).abs()).fold(change, f64::max);
            }
        }
        self.body.activate(born, law.branches());
        // elements born now have no part in the past step
        let about = births.get(simulation.state().births).is_some_and(|birth| birth.time <= time);
        let long = time - self.state.time >= self.settings.longest_step;
        if must || about || long || change > self.settings.strain_step {
            let bed = self.settings.bed.iter();
            let supports = match self.state.released {
                Some(_) => self.free_supports(),
                None => bed.flat_map(|&node| (0..3).map(move |d| (node, d))).collect(),
            };
            self.state.time = time;
            self.solve(&present, &supports)?;
            self.state.last = present;
        }
        Ok(())
    }

    /// Replaces the temperatures of an element's nodes by those at which it is free of stress.
    fn initial(
        &self,
        simulation: &Simulation,
        element: usize,
        mut state: ElementThermalState,
    ) -> ElementThermalState {
        if let Some(own) = self.settings.stress_free.as_ref().and_then(|all| all.get(element)) {
            state.nodes[..state.count].fill(*own);
            return state;
        }
        let initial = &simulation.problem().initial;
        for (kelvin, &node) in state.nodes.iter_mut().zip(self.mesh.nodes(element as u32)) {
            *kelvin = initial.value_at(self.mesh.points[node as usize], 0.0);
        }
        state
    }

    /// Solves for the step from the last states of elements to the present ones.
    fn solve(
        &mut self,
        present: &[Option<ElementThermalState>],
        supports: &[FixedComponent],
    ) -> Result<(), Error> {
        let (law, last) = (&self.settings.law, &self.state.last);
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
                Some((before, after)) => law.increment(before.mean(), after.mean(), after.time - before.time),
                None => law.increment([300.0, 0.0], [300.0, 0.0], 0.0),
            },
            |element, point, _| {
                let Some((before, after)) = pair(element) else { return 0.0 };
                law.volume.strain(
                    [before.temperature_at(point), before.degree],
                    [after.temperature_at(point), after.degree],
                )
            },
            supports,
        )?;
        self.state.solutions += 1;
        Ok(())
    }

    /// Bed nodes that have a displacement.
    fn present_bed(&self, displacement: &[f64]) -> Vec<u32> {
        let present = |&node: &u32| !displacement[3 * node as usize].is_nan();
        self.settings.bed.iter().copied().filter(present).collect()
    }

    fn is_present(&self, element: usize) -> bool {
        self.state.last.get(element).is_some_and(Option::is_some)
    }

    /// Displacements of the nodes, m, three a node; NaN for nodes without bearing elements.
    pub fn displacement(&self) -> Vec<f64> {
        let mut all = vec![f64::NAN; 3 * self.mesh.points.len()];
        for element in (0..self.state.last.len()).filter(|&element| self.is_present(element)) {
            for &node in self.mesh.nodes(element as u32) {
                let node = node as usize;
                all[3 * node..3 * node + 3].copy_from_slice(&self.body.state.displacement[node]);
            }
        }
        all
    }

    /// Largest displacement of a node, m.
    pub fn largest_displacement(&self) -> f64 {
        let lengths = self.displacement();
        let lengths = lengths.chunks(3).map(|u| u[0].hypot(u[1]).hypot(u[2]));
        lengths.filter(|x| !x.is_nan()).fold(0.0, f64::max)
    }

    /// Mises stress of each element, Pa: maximum over its Gauss points; NaN for elements that bear no stress.
    pub fn mises(&self) -> Vec<f64> {
        let largest = |element: usize| {
            let points = 0..self.body.points(element);
            let points = points.map(|point| von_mises(self.body.stress(element, point)));
            if self.is_present(element) { points.fold(0.0, f64::max) } else { f64::NAN }
        };
        (0..self.mesh.element_count()).map(largest).collect()
    }

    /// Mean stress of each element, Pa, in VTK's order of symmetric tensors, xx, yy, zz, xy, yz, zx; NaN for
    /// elements that bear no stress.
    pub fn stresses(&self) -> Vec<f64> {
        let mean = |element: usize| match self.is_present(element) {
            true => self.body.mean_stress(element),
            false => [f64::NAN; 6],
        };
        (0..self.mesh.element_count()).flat_map(mean).collect()
    }

    /// Largest Mises stress of an element, Pa.
    pub fn largest_mises(&self) -> f64 {
        self.mises().into_iter().filter(|x| !x.is_nan()).fold(0.0, f64::max)
    }

    /// Largest Mises stress at the end of the print, before the release, Pa; 0 before [`Self::finish`].
    pub fn mises_on_bed(&self) -> f64 {
        self.state.mises_on_bed
    }

    /// Warpage, m, and largest Mises stress, Pa, right after the release.
    pub fn at_release(&self) -> Option<[f64; 2]> {
        self.state.released
    }

    /// Warpage, m: range of distances of the bed side from its least-squares plane; of a part with rollers
    /// from a plane across z, to which its whole is symmetric.
    pub fn warpage(&self) -> f64 {
        let moved = self.displacement();
        let place = |&node: &u32| -> [f64; 3] {
            std::array::from_fn(|d| self.mesh.points[node as usize][d] + moved[3 * node as usize + d])
        };
        let places = self.settings.bed.iter().map(place).filter(|place| place.iter().all(|x| x.is_finite()));
        let places: Vec<[f64; 3]> = places.collect();
        if self.settings.rollers.is_empty() {
            return out_of_flatness(&places);
        }
        let heights = places.iter().map(|place| place[2]);
        let (low, high) =
            (heights.clone().fold(f64::INFINITY, f64::min), heights.fold(f64::NEG_INFINITY, f64::max));
        (high - low).max(0.0)
    }

    /// Largest rotation of an element since it solidified, rad.
    pub fn largest_rotation(&self) -> f64 {
        self.body.largest_rotation()
    }

    /// Energy balance of all solutions.
    pub fn energy_balance(&self) -> &EnergyBalance {
        &self.body.state.balance
    }

    /// Numbers of solutions and of conjugate-gradient iterations.
    pub fn work(&self) -> [u64; 2] {
        [self.state.solutions, self.body.state.iterations]
    }

    /// Settings.
    pub fn settings(&self) -> &StressSettings {
        &self.settings
    }
}

impl ElementThermalState {
    /// Returns mean T, K, and α.
    fn mean(&self) -> [f64; 2] {
        // corners of first order have equal shares
        if self.count <= 8 {
            return [self.nodes[..self.count].iter().sum::<f64>() / self.count as f64, self.degree];
        }
        let points = points(self.count);
        [(0..points).map(|point| self.temperature_at(point)).sum::<f64>() / points as f64, self.degree]
    }

    /// Returns T at a Gauss point, K.
    fn temperature_at(&self, point: usize) -> f64 {
        let shares = shares(self.count, point);
        shares[..self.count].iter().zip(self.nodes).map(|(share, t)| share * t).sum()
    }
}
