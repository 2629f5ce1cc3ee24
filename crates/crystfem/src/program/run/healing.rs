//! Healing of interfaces on their way through the temperatures of a simulation.

use super::outside::{Frame, Outside};
use crate::error::Error;
use crate::healing::Healing;
use crate::program::quantities as q;
use crate::program::scene::{Interfaces, PartScene};
use crate::simulation::Simulation;
use harness::output::picture::{ColorMap, Solids, Strip};
use harness::report::Report;
use std::path::Path;

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

    /// healing.png: D_h of the part at the end, at each node the least of the elements around it, and the strength where the scene gives it.
    ///
    /// # Errors
    /// A picture that cannot be written.
    pub fn draw(&self, scene: &PartScene, simulation: &Simulation, output: &Path) -> Result<(), Error> {
        let mesh = &simulation.problem().mesh;
        let degrees = self.field(simulation);
        let own: Vec<u32> = (0..).zip(&degrees).filter(|(_, x)| x.is_finite()).map(|(e, _)| e).collect();
        let Some(bounds) = mesh.bounds_of(&own) else { return Ok(()) };
        let mut least = vec![f64::NAN; mesh.points.len()];
        for &element in &own {
            for &node in mesh.nodes(element) {
                // the least of a number and NaN is the number
                least[node as usize] = least[node as usize].min(degrees[element as usize]);
            }
        }
        let strip = |label: &str, most: f64| Strip {
            label: label.into(),
            range: (0.0, most),
            colors: ColorMap::Viridis,
        };
        let (mut fields, mut values) = (vec![strip("degree of healing", 1.0)], vec![least.clone()]);
        if let Some(strength) = self.spec.strength.map(|strength| 1e-6 * strength) {
            fields.push(strip("interlayer strength [MPa]", strength));
            values.push(least.iter().map(|degree| strength * degree).collect());
        }
        let view = scene.output.solid.view();
        let solids = Solids { title: scene.title.clone(), bounds, unit: ("mm".into(), 1e-3), view, fields };
        let outside = Outside::new(mesh, &own, scene.output.solid.plane(bounds))?;
        let title = format!("t = {} s", (simulation.time() * 100.0).round() / 100.0);
        let exists = degrees.iter().map(|degree| degree.is_finite()).collect();
        let (title, skin) = outside.skin(Frame { title, values, exists });
        solids.write(output.join("healing.png"), 1, |_| Ok((title.clone(), skin.clone())))?;
        Ok(())
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
            if let Some(strength) = self.spec.strength {
                report.value(q::LEAST_INTERLAYER_STRENGTH, 1e-6 * strength * least);
                report.value(q::MEAN_INTERLAYER_STRENGTH, 1e-6 * strength * sum / area);
            }
        }
        report.work("interfaces", self.spec.list.len() as u64);
    }
}
