//! Places whose temperature and state are recorded in every step of a part's run.

use super::point::CELSIUS;
use crate::error::Error;
use crate::mesh::Mesh;
use crate::scene::{PartScene, ProbeSpec};
use crate::simulation::Simulation;
use polycore::output::csv;
use polycore::output::picture::{LegendPlace, LinePlot, Series};
use polycore::report::Report;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Rows of a probe that are drawn at most.
const ROWS: usize = 4000;

/// A place and what was recorded there since it exists.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Probe {
    name: String,
    node: u32,
    /// How far the node is from where it was asked for, m.
    distance: f64,
    time: Vec<f64>,
    /// °C.
    temperature: Vec<f64>,
    /// Of each quantity of the materials.
    fields: Vec<Vec<f64>>,
}

impl Probe {
    /// At the node nearest to where it is asked for.
    pub fn new(spec: &ProbeSpec, mesh: &Mesh, fields: usize) -> Self {
        let at = spec.at.map(|x| x.si());
        let distance = |node: usize| {
            let place = mesh.points[node];
            (0..3).map(|d| (place[d] - at[d]).powi(2)).sum::<f64>().sqrt()
        };
        let nearest = (0..mesh.points.len()).min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
        let node = nearest.unwrap_or(0);
        Self {
            name: spec.name.clone(),
            node: node as u32,
            distance: distance(node),
            time: Vec::new(),
            temperature: Vec::new(),
            fields: vec![Vec::new(); fields],
        }
    }

    fn last(&self) -> Option<f64> {
        self.time.last().copied()
    }
}

/// Adds a row to every probe whose node exists.
pub fn record(probes: &mut [Probe], simulation: &Simulation, names: &[&'static str]) {
    if !probes.iter().any(|probe| simulation.exists(probe.node)) {
        return;
    }
    let fields: Vec<Vec<f64>> = names.iter().map(|name| simulation.field(name)).collect();
    for probe in probes {
        let Some(temperature) = simulation.temperature(probe.node) else { continue };
        if probe.last() == Some(simulation.time()) {
            continue;
        }
        probe.time.push(simulation.time());
        probe.temperature.push(temperature - CELSIUS);
        for (list, values) in probe.fields.iter_mut().zip(&fields) {
            list.push(values[probe.node as usize]);
        }
    }
}

/// probe_NAME.csv, the values at the end, and the extremes of temperature.
pub fn write(
    probes: &[Probe],
    names: &[&'static str],
    output: &Path,
    report: &mut Report,
) -> Result<(), Error> {
    for probe in probes {
        let name = &probe.name;
        report.value(&format!("{name}.distance"), probe.distance, "m");
        let mut columns: Vec<csv::Column> =
            vec![("time", "s", &probe.time), ("temperature", "degC", &probe.temperature)];
        columns.extend(names.iter().zip(&probe.fields).map(|(name, values)| (*name, "", values.as_slice())));
        csv::write(output.join(format!("probe_{name}.csv")), &columns)?;
        let mut last = |quantity: &str, values: &[f64], unit: &str| {
            if let Some(last) = values.last().filter(|last| last.is_finite()) {
                report.value(&format!("{name}.{quantity}"), *last, unit);
            }
        };
        last("temperature", &probe.temperature, "degC");
        for (quantity, values) in names.iter().zip(&probe.fields) {
            last(quantity, values, "");
        }
        if !probe.temperature.is_empty() {
            let extreme = |pick: fn(f64, f64) -> f64| probe.temperature.iter().copied().reduce(pick);
            let [lowest, highest] = [extreme(f64::min), extreme(f64::max)].map(Option::unwrap_or_default);
            report.value(&format!("{name}.lowest_temperature"), lowest, "degC");
            report.value(&format!("{name}.highest_temperature"), highest, "degC");
        }
    }
    Ok(())
}

/// Temperatures and fields of all probes over time.
pub fn draw(probes: &[Probe], names: &[&'static str], scene: &PartScene, output: &Path) -> Result<(), Error> {
    let quantities =
        std::iter::once(("temperature", "T [°C]")).chain(names.iter().map(|name| (*name, *name)));
    for (index, (name, label)) in quantities.enumerate() {
        let mut plot = LinePlot::new(&scene.title).axes("t [s]", label).legend(LegendPlace::TopRight);
        let mut drawn = false;
        for probe in probes.iter().filter(|probe| probe.time.len() > 1) {
            let values = if index == 0 { &probe.temperature } else { &probe.fields[index - 1] };
            if values.iter().any(|x| x.is_finite()) {
                let every = values.len().div_ceil(ROWS);
                let thinned = |list: &[f64]| -> Vec<f64> { list.iter().copied().step_by(every).collect() };
                plot = plot.series(Series::line(&probe.name, &thinned(&probe.time), &thinned(values)));
                drawn = true;
            }
        }
        if drawn {
            plot.write(output.join(format!("probes_{name}.png")))?;
        }
    }
    Ok(())
}
