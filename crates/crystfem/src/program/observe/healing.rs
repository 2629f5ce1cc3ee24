//! Healing of interfaces between layers and beads.

use super::part_skin::{PartSkin, SolidFrame};
use crate::coupling::{HealingCoupling, HealingSettings};
use crate::error::Error;
use crate::program::quantities as q;
use crate::program::scene::PartScene;
use crate::simulation::Simulation;
use harness::observe::{Fields, Observer, Outputs, Place, Scalars};
use harness::output::picture::{ColorMap, Solids, Strip};
use std::path::Path;

/// Observer of the degree of healing of all interfaces.
pub struct HealingObserver<'a> {
    scene: &'a PartScene,
    coupling: HealingCoupling,
}

impl<'a> HealingObserver<'a> {
    /// Creates the observer, with unhealed interfaces.
    pub fn new(scene: &'a PartScene, settings: &HealingSettings) -> Self {
        Self { scene, coupling: HealingCoupling::new(settings.clone()) }
    }

    /// Returns the strength of a fully healed interface, MPa.
    fn strength(&self) -> Option<f64> {
        self.coupling.settings().strength.map(|strength| 1e-6 * strength)
    }
}

impl Observer<Simulation, Error> for HealingObserver<'_> {
    fn scalars(&self, to: &mut Scalars<Simulation>) {
        let of = |scale: f64, which: usize| {
            move |_: &Simulation| Some(self.coupling.least_and_mean(scale)?[which])
        };
        to.add_if(q::LEAST_HEALING, of(1.0, 0));
        to.add_if(q::MEAN_HEALING, of(1.0, 1));
        if let Some(strength) = self.strength() {
            to.add_if(q::LEAST_INTERLAYER_STRENGTH, of(strength, 0));
            to.add_if(q::MEAN_INTERLAYER_STRENGTH, of(strength, 1));
        }
    }

    fn fields(&self, to: &mut Fields<Simulation>) {
        to.add("healing", 1, Place::Cells, |s| self.coupling.element_degrees(s));
        if let Some(strength) = self.coupling.settings().strength {
            to.add("interlayer_strength_Pa", 1, Place::Cells, |s| {
                self.coupling.element_degrees(s).iter().map(|degree| strength * degree).collect()
            });
        }
    }

    fn see(&mut self, simulation: &Simulation) -> Result<(), Error> {
        self.coupling.after_step(simulation);
        Ok(())
    }

    fn work(&self, _: &Simulation) -> Vec<(&'static str, u64)> {
        vec![("interfaces", self.coupling.settings().interfaces.len() as u64)]
    }

    fn draw(&self, simulation: &Simulation, to: &Outputs) -> Result<(), Error> {
        draw(&self.coupling, self.scene, simulation, to.folder)
    }

    fn save(&self) -> Vec<u8> {
        harness::observe::encode(&self.coupling.save())
    }

    fn restore(&mut self, saved: &[u8]) -> Result<(), Error> {
        self.coupling.restore(harness::observe::decode(saved)?);
        Ok(())
    }
}

/// Draws healing.png: D_h at the end (at each node the smallest of its elements) and, if given, the strength.
///
/// # Errors
/// Returns an error if the picture cannot be written.
fn draw(
    healing: &HealingCoupling,
    scene: &PartScene,
    simulation: &Simulation,
    output: &Path,
) -> Result<(), Error> {
    let mesh = &simulation.problem().mesh;
    let degrees = healing.element_degrees(simulation);
    let own: Vec<u32> = (0..).zip(&degrees).filter(|(_, x)| x.is_finite()).map(|(e, _)| e).collect();
    let Some(bounds) = mesh.bounds_of(&own) else { return Ok(()) };
    let mut least = vec![f64::NAN; mesh.points.len()];
    for &element in &own {
        for &node in mesh.nodes(element) {
            // `f64::min` ignores NaN
            least[node as usize] = least[node as usize].min(degrees[element as usize]);
        }
    }
    let strip =
        |label: &str, most: f64| Strip { label: label.into(), range: (0.0, most), colors: ColorMap::Viridis };
    let (mut fields, mut values) = (vec![strip("degree of healing", 1.0)], vec![least.clone()]);
    if let Some(strength) = healing.settings().strength.map(|strength| 1e-6 * strength) {
        fields.push(strip("interlayer strength [MPa]", strength));
        values.push(least.iter().map(|degree| strength * degree).collect());
    }
    let view = scene.output.solid.view();
    let solids = Solids { title: scene.title.clone(), bounds, unit: ("mm".into(), 1e-3), view, fields };
    let outside = PartSkin::new(mesh, &own, scene.output.solid.plane(bounds))?;
    let title = format!("t = {} s", (simulation.time() * 100.0).round() / 100.0);
    let exists = degrees.iter().map(|degree| degree.is_finite()).collect();
    let (title, skin) = outside.skin(SolidFrame { title, values, exists });
    solids.write(output.join("healing.png"), 1, |_| Ok((title.clone(), skin.clone())))?;
    Ok(())
}
