//! Healing of the interfaces of a part during a simulation.

use crate::error::Error;
use crate::healing::Healing;
use crate::mesh::Mesh;
use crate::mesh::surface::{OuterSurface, area};
use crate::problem::Birth;
use crate::simulation::Simulation;

/// An interface between two elements.
#[derive(Clone, Debug, PartialEq)]
pub struct HealingInterface {
    /// Newer and older element.
    pub sides: [u32; 2],
    /// Shared corners.
    pub nodes: Vec<u32>,
    /// Area, m².
    pub area: f64,
}

impl HealingInterface {
    /// Returns the interfaces between printed elements of different births; `birth_of` is the birth number of
    /// each element.
    ///
    /// # Errors
    /// Errors of [`OuterSurface::of_all`].
    pub fn between_births(mesh: &Mesh, printed: &[bool], birth_of: &[u32]) -> Result<Vec<Self>, Error> {
        let surface = OuterSurface::of_all(mesh)?;
        let mut interfaces = Vec::new();
        for element in (0..mesh.element_count() as u32).filter(|&element| printed[element as usize]) {
            for face in mesh.faces_of(element) {
                let Some(other) = surface.opposite(face).map(|face| face.element) else { continue };
                if printed[other as usize] && birth_of[other as usize] < birth_of[element as usize] {
                    let nodes = mesh.face_nodes(face).to_vec();
                    interfaces.push(Self { sides: [element, other], nodes, area: area(mesh, face) });
                }
            }
        }
        Ok(interfaces)
    }
}

/// Settings of a healing part.
#[derive(Clone, Debug, PartialEq)]
pub struct HealingSettings {
    /// Law of healing.
    pub law: Healing,
    /// Tensile strength of the material, Pa, if known; that of an interface is D_h times it.
    pub strength: Option<f64>,
    /// Interfaces, see [`HealingInterface::between_births`].
    pub interfaces: Vec<HealingInterface>,
    /// Elements printed of the healing material.
    pub printed: Vec<bool>,
}

impl HealingSettings {
    /// Returns settings for all elements of one material, given by its index, with interfaces between births.
    ///
    /// # Errors
    /// Errors of [`HealingInterface::between_births`].
    pub fn new(
        mesh: &Mesh,
        material_of: &[u16],
        births: &[Birth],
        material: u16,
        law: Healing,
    ) -> Result<Self, Error> {
        let mut birth_of = vec![u32::MAX; mesh.element_count()];
        for (number, birth) in (0..).zip(births) {
            birth.elements.iter().for_each(|&element| birth_of[element as usize] = number);
        }
        let births = birth_of.iter().zip(material_of);
        let printed: Vec<bool> = births.map(|(&birth, &of)| of == material && birth != u32::MAX).collect();
        let interfaces = HealingInterface::between_births(mesh, &printed, &birth_of)?;
        Ok(Self { law, strength: None, interfaces, printed })
    }
}

/// State of a coupling, for checkpoints: for each interface its integral and, once both sides exist, time, s,
/// temperature, K, and melt fraction.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct HealingState(Vec<(f64, Option<[f64; 3]>)>);

/// Degree of healing of interfaces over time.
#[derive(Clone, Debug)]
pub struct HealingCoupling {
    settings: HealingSettings,
    state: HealingState,
}

impl HealingCoupling {
    /// Starts with unhealed interfaces.
    pub fn new(settings: HealingSettings) -> Self {
        let state = HealingState(vec![(0.0, None); settings.interfaces.len()]);
        Self { settings, state }
    }

    /// Returns the state for a checkpoint.
    pub fn save(&self) -> HealingState {
        self.state.clone()
    }

    /// Restores a state of the same part.
    pub fn restore(&mut self, state: HealingState) {
        self.state = state;
    }

    /// Updates after an accepted step, and before the first.
    pub fn after_step(&mut self, simulation: &Simulation) {
        let (time, degrees) = (simulation.time(), simulation.element_means("alpha"));
        let mean = |nodes: &[u32]| {
            let temperatures = nodes.iter().filter_map(|&node| simulation.temperature(node));
            temperatures.sum::<f64>() / nodes.len() as f64
        };
        for (interface, (integral, last)) in self.settings.interfaces.iter().zip(&mut self.state.0) {
            if !interface.sides.iter().all(|&element| simulation.is_born(element)) {
                continue;
            }
            let [new, old] = interface.sides;
            let warmth = |element: u32| mean(simulation.problem().mesh.corners(element));
            let colder = if warmth(new) < warmth(old) { new } else { old };
            let melt = 1.0 - degrees[colder as usize].unwrap_or(1.0);
            let temperature = mean(&interface.nodes);
            if let Some([before, from, share]) = *last {
                *integral += self.settings.law.progress([from, temperature], [share, melt], time - before);
            }
            *last = Some([time, temperature, melt]);
        }
    }

    /// D_h of each interface; `None` before both sides exist.
    pub fn degrees(&self) -> impl Iterator<Item = Option<f64>> {
        self.state.0.iter().map(|(integral, last)| last.map(|_| Healing::degree(*integral)))
    }

    /// Smallest D_h of the interfaces of each element; 1 for interior elements, NaN for elements that are not
    /// printed or do not exist yet.
    pub fn element_degrees(&self, simulation: &Simulation) -> Vec<f64> {
        let within = |(element, &printed): (u32, &bool)| {
            if printed && simulation.is_born(element) { 1.0 } else { f64::NAN }
        };
        let mut least: Vec<f64> = (0..).zip(&self.settings.printed).map(within).collect();
        for (interface, degree) in self.settings.interfaces.iter().zip(self.degrees()) {
            let Some(degree) = degree else { continue };
            for &element in &interface.sides {
                let own = &mut least[element as usize];
                *own = own.min(degree);
            }
        }
        least
    }

    /// Smallest and area-weighted mean D_h, times a scale (1, or a strength); `None` before the first
    /// interface.
    pub fn least_and_mean(&self, scale: f64) -> Option<[f64; 2]> {
        let (mut least, mut sum, mut area) = (f64::INFINITY, 0.0, 0.0);
        for (interface, degree) in self.settings.interfaces.iter().zip(self.degrees()) {
            let Some(degree) = degree else { continue };
            least = least.min(degree);
            sum += interface.area * degree;
            area += interface.area;
        }
        (area > 0.0).then(|| [scale * least, scale * sum / area])
    }

    /// Settings.
    pub fn settings(&self) -> &HealingSettings {
        &self.settings
    }
}
