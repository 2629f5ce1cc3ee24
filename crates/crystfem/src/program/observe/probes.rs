//! Places whose temperature and state are recorded in every step of a part's run.

use super::celsius::CELSIUS;
use crate::error::Error;
use crate::mesh::LocatedPoint;
use crate::program::quantities as q;
use crate::program::scene::{PartScene, ProbeSpec, Task};
use crate::simulation::Simulation;
use harness::observe::{Observer, Outputs, Scalars};
use harness::output::csv;
use harness::output::picture::{LinePlot, Series};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Rows of a probe that are drawn at most.
const ROWS: usize = 4000;

/// A place and what was recorded there since it exists.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Probe {
    name: String,
    place: LocatedPoint,
    time: Vec<f64>,
    /// °C.
    temperature: Vec<f64>,
    /// Of each quantity of the materials.
    fields: Vec<Vec<f64>>,
}

impl Probe {
    /// At a place, of which nothing is recorded yet.
    pub fn new(spec: &ProbeSpec, place: &LocatedPoint, fields: usize) -> Self {
        Self {
            name: spec.name.clone(),
            place: place.clone(),
            time: Vec::new(),
            temperature: Vec::new(),
            fields: vec![Vec::new(); fields],
        }
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Temperature, °C, and a field at a time, linear between rows; `None` where it was not there.
    pub fn at(&self, time: f64, field: usize) -> Option<[f64; 2]> {
        let after = self.time.partition_point(|&row| row < time).max(1);
        let (from, to) = (*self.time.get(after - 1)?, *self.time.get(after)?);
        let share = (time - from) / (to - from);
        if !(0.0..=1.0).contains(&share) {
            return None;
        }
        let between = |values: &[f64]| values[after - 1] + share * (values[after] - values[after - 1]);
        Some([between(&self.temperature), between(&self.fields[field])])
    }

    fn last(&self) -> Option<f64> {
        self.time.last().copied()
    }

    /// Whether an element that holds the place is there.
    fn exists(&self, simulation: &Simulation) -> bool {
        self.place.elements().iter().any(|&element| simulation.is_born(element))
    }
}

/// Adds a row to every probe whose place exists; NaN stands for a quantity that no material there has.
///
/// # Errors
/// [`Error::NotFinite`] of a value at a probe.
pub fn record(probes: &mut [Probe], simulation: &Simulation, names: &[&'static str]) -> Result<(), Error> {
    if !probes.iter().any(|probe| probe.exists(simulation)) {
        return Ok(());
    }
    let time = simulation.time();
    let mut nodes: Vec<u32> = probes.iter().flat_map(|probe| probe.place.nodes()).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let fields: Vec<_> = names.iter().map(|name| simulation.field_of(name, &nodes)).collect();
    for probe in probes.iter_mut().filter(|probe| probe.exists(simulation)) {
        let Some(temperature) = probe.place.value(|node| simulation.temperature(node)) else { continue };
        if probe.last() == Some(time) {
            continue;
        }
        let of =
            |field: &Vec<Option<f64>>| probe.place.value(|node| field[nodes.binary_search(&node).ok()?]);
        let values: Vec<Option<f64>> = fields.iter().map(of).collect();
        let all = std::iter::once(("temperature", Some(temperature)))
            .chain(names.iter().copied().zip(values.iter().copied()));
        for (quantity, value) in all {
            if value.is_some_and(|value| !value.is_finite()) {
                let place = format!("probe `{}`", probe.name);
                return Err(Error::NotFinite { quantity, place, time });
            }
        }
        probe.time.push(time);
        probe.temperature.push(temperature - CELSIUS);
        for (list, value) in probe.fields.iter_mut().zip(values) {
            list.push(value.unwrap_or(f64::NAN));
        }
    }
    Ok(())
}

/// The probes of a scene.
pub struct Probes<'a> {
    scene: &'a PartScene,
    task: &'a Task,
    names: Vec<&'static str>,
    probes: Vec<Probe>,
}

impl<'a> Probes<'a> {
    /// Probes of which nothing is recorded yet.
    pub fn new(scene: &'a PartScene, task: &'a Task) -> Self {
        let names = task.problem.field_names();
        let probes = scene.probe.iter().zip(&task.probes);
        let probes = probes.map(|(spec, place)| Probe::new(spec, place, names.len())).collect();
        Self { scene, task, names, probes }
    }

    /// Effects of births on a probe that is there: NAME.jump_at_birth_N, by how much the temperature rises after the N-th birth before
    /// the next one, K, and of each field FIELD_at_birth_N, its value just before, and FIELD_lost_at_birth_N, by how
    /// much it falls below that.
    fn births(&self, probe: &Probe, to: &mut Scalars<Simulation>) {
        let births = &self.task.problem.births;
        for (number, birth) in (1..).zip(births) {
            // a row at the time of a birth shows what was before it
            let first = probe.time.partition_point(|&time| time <= birth.time);
            let next = births.get(number).map_or(f64::INFINITY, |next| next.time);
            let last = probe.time.partition_point(|&time| time <= next);
            // the row at which the probe itself was born says nothing
            let seen = first > 0 && last > first && probe.time[0] < birth.time;
            let before = |values: &[f64]| Some(values[first - 1]).filter(|value| !value.is_nan());
            let after = |values: &[f64], pick: fn(f64, f64) -> f64| {
                values[first..last].iter().copied().fold(values[first - 1], pick) - values[first - 1]
            };
            let (name, number) = (probe.name.as_str(), number.to_string());
            let rise = |_: &Simulation| seen.then(|| after(&probe.temperature, f64::max));
            to.add_if(q::JUMP.of(&[name, &number]), rise);
            for (field, values) in self.names.iter().zip(&probe.fields) {
                let known = || seen.then(|| before(values)).flatten();
                to.add_if(q::AT_BIRTH.of(&[name, field, &number]), |_| known());
                let lost = |_: &Simulation| known().map(|_| after(values, f64::min).abs());
                to.add_if(q::LOST_AT_BIRTH.of(&[name, field, &number]), lost);
            }
        }
    }
}

impl Observer<Simulation, Error> for Probes<'_> {
    fn scalars(&self, to: &mut Scalars<Simulation>) {
        for probe in &self.probes {
            let name = probe.name.as_str();
            to.add(q::DISTANCE.of(&[name]), |_| probe.place.distance());
            // `record` has refused all others: no material there has it
            let last = |values: &[f64]| values.last().copied().filter(|last| !last.is_nan());
            let at = q::AT_PROBE.of(&[name, "temperature"]).in_unit("degC");
            to.add_if(at, |_| last(&probe.temperature));
            for (quantity, values) in self.names.iter().zip(&probe.fields) {
                to.add_if(q::AT_PROBE.of(&[name, quantity]).in_unit(""), |_| last(values));
            }
            let extreme = |pick: fn(f64, f64) -> f64| probe.temperature.iter().copied().reduce(pick);
            to.add_if(q::LOWEST_TEMPERATURE.of(&[name]), |_| extreme(f64::min));
            to.add_if(q::HIGHEST_TEMPERATURE.of(&[name]), |_| extreme(f64::max));
            if !self.task.layers.is_empty() {
                self.births(probe, to);
            }
        }
    }

    fn see(&mut self, simulation: &Simulation) -> Result<(), Error> {
        record(&mut self.probes, simulation, &self.names)
    }

    fn write(&self, _: &Simulation, to: &Outputs) -> Result<(), Error> {
        for probe in &self.probes {
            let mut columns: Vec<csv::Column> =
                vec![("time", "s", &probe.time), ("temperature", "degC", &probe.temperature)];
            let fields = self.names.iter().zip(&probe.fields);
            columns.extend(fields.map(|(name, values)| (*name, "", values.as_slice())));
            csv::write(to.folder.join(format!("probe_{}.csv", probe.name)), &columns)?;
        }
        Ok(())
    }

    fn draw(&self, _: &Simulation, to: &Outputs) -> Result<(), Error> {
        draw(&self.probes, &self.names, self.scene, to.folder)
    }

    fn save(&self) -> Vec<u8> {
        harness::observe::encode(&self.probes)
    }

    fn restore(&mut self, saved: &[u8]) -> Result<(), Error> {
        self.probes = harness::observe::decode(saved)?;
        Ok(())
    }
}

/// Temperatures and fields of all probes over time.
fn draw(probes: &[Probe], names: &[&'static str], scene: &PartScene, output: &Path) -> Result<(), Error> {
    let quantities =
        std::iter::once(("temperature", "T [°C]")).chain(names.iter().map(|name| (*name, *name)));
    for (index, (name, label)) in quantities.enumerate() {
        let mut plot = LinePlot::new(&scene.title).axes("t [s]", label);
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
