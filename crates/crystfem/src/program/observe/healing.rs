//! Files and values of the healing of interfaces.

use super::outside::{Frame, Outside};
use crate::coupling::HealingCoupling;
use crate::error::Error;
use crate::program::quantities as q;
use crate::program::scene::PartScene;
use crate::simulation::Simulation;
use harness::output::picture::{ColorMap, Solids, Strip};
use harness::report::Report;
use std::path::Path;

/// healing.png: D_h of the part at the end, at each node the least of the elements around it, and the strength where the scene gives it.
///
/// # Errors
/// A picture that cannot be written.
pub fn draw(
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
            // the least of a number and NaN is the number
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
    let outside = Outside::new(mesh, &own, scene.output.solid.plane(bounds))?;
    let title = format!("t = {} s", (simulation.time() * 100.0).round() / 100.0);
    let exists = degrees.iter().map(|degree| degree.is_finite()).collect();
    let (title, skin) = outside.skin(Frame { title, values, exists });
    solids.write(output.join("healing.png"), 1, |_| Ok((title.clone(), skin.clone())))?;
    Ok(())
}

/// Least and mean by area.
pub fn record(healing: &HealingCoupling, report: &mut Report) {
    let settings = healing.settings();
    if let Some([least, mean]) = healing.least_and_mean(1.0) {
        report.value(q::LEAST_HEALING, least);
        report.value(q::MEAN_HEALING, mean);
    }
    if let Some([least, mean]) =
        settings.strength.and_then(|strength| healing.least_and_mean(1e-6 * strength))
    {
        report.value(q::LEAST_INTERLAYER_STRENGTH, least);
        report.value(q::MEAN_INTERLAYER_STRENGTH, mean);
    }
    report.work("interfaces", settings.interfaces.len() as u64);
}
