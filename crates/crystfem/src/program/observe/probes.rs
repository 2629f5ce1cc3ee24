//! Probes: places whose temperature and material state are recorded in each step.

use super::celsius::CELSIUS;
use crate::error::Error;
use crate::mesh::LocatedPoint;
use crate::program::quantities as q;
use crate::program::scene::{PartScene, PartTask, ProbeSpec};
use crate::simulation::Simulation;
use harness::observe::{Observer, Outputs, Scalars};
use harness::output::csv;
use harness::output::picture::{LinePlot, Series};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Largest number of drawn rows per probe.
const MOST_ROWS: usize = 4000;

/// A place, and the values recorded there since it exists.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProbeRecord {
    name: String,
    place: LocatedPoint,
    time: Vec<f64>,
    /// °C.
    temperature: Vec<f64>,
    /// Values of each material field.
    fields: Vec<Vec<f64>>,
}

impl ProbeRecord {
    /// Creates an empty record at a place.
    pub fn new(spec: &ProbeSpec, place: &LocatedPoint, fields: usize) -> Self {
        Self {
            name: spec.name.clone(),
            place: place.clone(),
            time: Vec::new(),
            temperature: Vec::new(),
            fields: vec![Vec::new(); fields],
        }
    }

    /// Returns the name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns temperature, °C, and a field at a time, interpolated between rows; `None` outside the record.
    pub fn value_at(&self, time: f64, field: usize) -> Option<[f64; 2]> {
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

    /// Tells if an element that contains the place exists.
    fn exists(&self, simulation: &Simulation) -> bool {
        self.place.elements().iter().any(|&element| simulation.is_born(element))
    }
}

/// Adds a row to each probe that exists; NaN for a field that no material there has.
///
/// # Errors
/// Returns [`Error::NotFinite`] for a non-finite value.
pub fn record(
    probes: &mut [ProbeRecord],
    simulation: &Simulation,
    names: &[&'static str],
) -> Result<(), Error> {
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
        let value =
            |field: &Vec<Option<f64>>| probe.place.value(|node| field[nodes.binary_search(&node).ok()?]);
        let values: Vec<Option<f64>> = fields.iter().map(value).collect();
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

/// Observer that records the probes of a scene.
pub struct ProbeObserver<'a> {
    scene: &'a PartScene,
    task: &'a PartTask,
    names: Vec<&'static str>,
    probes: Vec<ProbeRecord>,
}

impl<'a> ProbeObserver<'a> {
    /// Creates empty records.
    pub fn new(scene: &'a PartScene, task: &'a PartTask) -> Self {
        let names = task.problem.field_names();
        let probes = scene.probe.iter().zip(&task.probes);
        let probes = probes.map(|(spec, place)| ProbeRecord::new(spec, place, names.len())).collect();
        Self { scene, task, names, probes }
    }

    /// Adds the effects of births on a probe: NAME.jump_at_birth_N, the rise of the temperature between the
    /// N-th birth and the next, K; for each field FIELD_at_birth_N, its value just before, and
    /// FIELD_lost_at_birth_N, its largest drop afterwards.
    fn births(&self, probe: &ProbeRecord, to: &mut Scalars<Simulation>) {
        let births = &self.task.problem.births;
        for (number, birth) in (1..).zip(births) {
            // a row at the time of a birth shows the state before it
            let first = probe.time.partition_point(|&time| time <= birth.time);
            let next = births.get(number).map_or(f64::INFINITY, |next| next.time);
            let last = probe.time.partition_point(|&time| time <= next);
            // skip the row at which the probe itself is born
            let seen = first > 0 && last > first && probe.time[0] < birth.time;
            let before = |values: &[f64]| Some(values[first - 1]).filter(|value| !value.is_nan());
            let after = |values: &[f64], pick: fn(f64, f64) -> f64| {
                values[first..last].iter().copied().fold(values[first - 1], pick) - values[first - 1]
            };
            let (name, number) = (probe.name.as_str(), number.to_string());
            let rise = |_: &Simulation| seen.then(|| after(&probe.temperature, f64::max));
            to.add_if(q::JUMP.named(&[name, &number]), rise);
            for (field, values) in self.names.iter().zip(&probe.fields) {
                let known = || seen.then(|| before(values)).flatten();
                to.add_if(q::AT_BIRTH.named(&[name, field, &number]), |_| known());
                let lost = |_: &Simulation| known().map(|_| after(values, f64::min).abs());
                to.add_if(q::LOST_AT_BIRTH.named(&[name, field, &number]), lost);
            }
        }
    }
}

impl Observer<Simulation, Error> for ProbeObserver<'_> {
    fn scalars(&self, to: &mut Scalars<Simulation>) {
        for probe in &self.probes {
            let name = probe.name.as_str();
            to.add(q::DISTANCE.named(&[name]), |_| probe.place.distance());
            // `record` has refused other non-finite values: NaN means that no material there has the field
            let last = |values: &[f64]| values.last().copied().filter(|last| !last.is_nan());
            let at = q::AT_PROBE.named(&[name, "temperature"]).in_unit("degC");
            to.add_if(at, |_| last(&probe.temperature));
            for (quantity, values) in self.names.iter().zip(&probe.fields) {
                to.add_if(q::AT_PROBE.named(&[name, quantity]).in_unit(""), |_| last(values));
            }
            let extreme = |pick: fn(f64, f64) -> f64| probe.temperature.iter().copied().reduce(pick);
            to.add_if(q::LOWEST_TEMPERATURE.named(&[name]), |_| extreme(f64::min));
            to.add_if(q::HIGHEST_TEMPERATURE.named(&[name]), |_| extreme(f64::max));
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

/// Draws temperatures and fields of all probes over time.
fn draw(
    probes: &[ProbeRecord],
    names: &[&'static str],
    scene: &PartScene,
    output: &Path,
) -> Result<(), Error> {
    let quantities =
        std::iter::once(("temperature", "T [°C]")).chain(names.iter().map(|name| (*name, *name)));
    for (index, (name, label)) in quantities.enumerate() {
        let mut plot = LinePlot::new(&scene.title).axes("t [s]", label);
        let mut drawn = false;
        for probe in probes.iter().filter(|probe| probe.time.len() > 1) {
            let values = if index == 0 { &probe.temperature } else { &probe.fields[index - 1] };
            if values.iter().any(|x| x.is_finite()) {
                let every = values.len().div_ceil(MOST_ROWS);
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
