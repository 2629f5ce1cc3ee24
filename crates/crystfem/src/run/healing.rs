//! Healing of interfaces on their way through the temperatures of a simulation.

use crate::healing::Healing;
use crate::quantities as q;
use crate::scene::Interfaces;
use crate::simulation::Simulation;
use polycore::report::Report;

/// What a resumed run needs: of each interface its integral and, once both sides are there, time, s, temperature, K, and the melt's share.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Healed(Vec<(f64, Option<[f64; 3]>)>);

/// Interfaces that heal.
pub struct Healer<'a> {
    spec: &'a Interfaces,
    healed: Healed,
}

impl<'a> Healer<'a> {
    /// Of a part of which nothing exists, or as far as a run was.
    pub fn new(spec: &'a Interfaces, mut healed: Healed) -> Self {
        healed.0.resize(spec.list.len(), (0.0, None));
        Self { spec, healed }
    }

    /// What a checkpoint needs.
    pub fn reached(&self) -> Healed {
        self.healed.clone()
    }

    /// Sees an accepted step.
    pub fn see(&mut self, simulation: &Simulation) {
        let (time, degrees) = (simulation.time(), simulation.element_means("alpha"));
        let warmth = |element: u32| {
            let nodes = simulation.problem().mesh.corners(element);
            nodes.iter().filter_map(|&node| simulation.temperature(node)).sum::<f64>() / nodes.len() as f64
        };
        for (interface, (integral, last)) in self.spec.list.iter().zip(&mut self.healed.0) {
            if !interface.sides.iter().all(|&element| simulation.is_born(element)) {
                continue;
            }
            let [new, old] = interface.sides;
            let colder = if warmth(new) < warmth(old) { new } else { old };
            let melt = 1.0 - degrees[colder as usize].unwrap_or(1.0);
            let nodes = &interface.nodes;
            let temperature = nodes.iter().filter_map(|&node| simulation.temperature(node)).sum::<f64>()
                / nodes.len() as f64;
            if let Some([before, from, share]) = *last {
                *integral += self.spec.law.progress([from, temperature], [share, melt], time - before);
            }
            *last = Some([time, temperature, melt]);
        }
    }

    fn degrees(&self) -> impl Iterator<Item = Option<f64>> {
        self.healed.0.iter().map(|(integral, last)| last.map(|_| Healing::degree(*integral)))
    }

    /// The least D_h of the interfaces of each element; 1 inside of a layer, NaN of elements that are not printed or not there yet.
    pub fn field(&self, simulation: &Simulation) -> Vec<f64> {
        let within = |(element, &printed): (u32, &bool)| {
            if printed && simulation.is_born(element) { 1.0 } else { f64::NAN }
        };
        let mut least: Vec<f64> = (0..).zip(&self.spec.printed).map(within).collect();
        for (interface, degree) in self.spec.list.iter().zip(self.degrees()) {
            let Some(degree) = degree else { continue };
            for &element in &interface.sides {
                let own = &mut least[element as usize];
                *own = own.min(degree);
            }
        }
        least
    }

    /// Least and mean by area.
    pub fn record(&self, report: &mut Report) {
        let (mut least, mut sum, mut area) = (f64::INFINITY, 0.0, 0.0);
        for (interface, degree) in self.spec.list.iter().zip(self.degrees()) {
            let Some(degree) = degree else { continue };
            least = least.min(degree);
            sum += interface.area * degree;
            area += interface.area;
        }
        if area > 0.0 {
            report.value(q::LEAST_HEALING, least);
            report.value(q::MEAN_HEALING, sum / area);
        }
        report.work("interfaces", self.spec.list.len() as u64);
    }
}
