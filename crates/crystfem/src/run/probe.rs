//! Places whose temperature and state are recorded in every step of a part's run.

use super::point::CELSIUS;
use crate::error::Error;
use crate::mesh::Place;
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
    place: Place,
    time: Vec<f64>,
    /// °C.
    temperature: Vec<f64>,
    /// Of each quantity of the materials.
    fields: Vec<Vec<f64>>,
}

impl Probe {
    /// At a place, of which nothing is recorded yet.
    pub fn new(spec: &ProbeSpec, place: &Place, fields: usize) -> Self {
        Self {
            name: spec.name.clone(),
            place: place.clone(),
            time: Vec::new(),
            temperature: Vec::new(),
            fields: vec![Vec::new(); fields],
        }
    }

    fn last(&self) -> Option<f64> {
        self.time.last().copied()
    }

    /// Whether an element that holds the place is there.
    fn exists(&self, simulation: &Simulation) -> bool {
        self.place.elements().iter().any(|&element| simulation.is_born(element))
    }
}

/// Adds a row to every probe whose place exists.
pub fn record(probes: &mut [Probe], simulation: &Simulation, names: &[&'static str]) {
    if !probes.iter().any(|probe| probe.exists(simulation)) {
        return;
    }
    let fields: Vec<Vec<f64>> = names.iter().map(|name| simulation.field(name)).collect();
    for probe in probes.iter_mut().filter(|probe| probe.exists(simulation)) {
        let Some(temperature) = probe.place.value(|node| simulation.temperature(node)) else { continue };
        if probe.last() == Some(simulation.time()) {
            continue;
        }
        probe.time.push(simulation.time());
        probe.temperature.push(temperature - CELSIUS);
        for (list, values) in probe.fields.iter_mut().zip(&fields) {
            let value = probe.place.value(|node| values.get(node as usize).copied());
            list.push(value.unwrap_or(f64::NAN));
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
        report.value(&format!("{name}.distance"), probe.place.distance(), "m");
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
