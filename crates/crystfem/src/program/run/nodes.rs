//! Crystallinity at the nodes of a thermal analysis that another program made.

use super::celsius::CELSIUS;
use crate::error::Error;
use crate::material::{Point, ThermalMaterial};
use crate::program::quantities as q;
use crate::program::scene::NodesSpec;
use crate::program::thermal;
use harness::output::vtkhdf::MeshSeries;
use harness::report::{Quantity, Report};
use nalgebra::Vector3;
use rayon::prelude::*;
use std::path::Path;

/// Largest change of temperature in a step of a history that is linear between its times, K.
const STEP: f64 = 0.25;
/// Steps between two times at most.
const MOST: f64 = 10_000.0;
/// Relative crystallinities whose temperature is a value.
const DEGREES: [f64; 3] = [0.01, 0.5, 0.99];

/// A node: its temperature, its state, and the temperatures at which it reached [`DEGREES`].
#[derive(Clone)]
struct Node {
    temperature: f64,
    state: Vec<f64>,
    fields: Vec<f64>,
    reached: [f64; 3],
}

impl Node {
    /// Over a linear change of temperature.
    fn advance(&mut self, material: &dyn ThermalMaterial, to: f64, duration: f64) -> Result<(), Error> {
        let change = to - self.temperature;
        let steps = (change.abs() / STEP).ceil().clamp(1.0, MOST);
        for _ in 0..steps as usize {
            let (increment, dt) = (change / steps, duration / steps);
            let at = Point { temperature: self.temperature, increment, gradient: Vector3::zeros(), dt };
            let (old, before) = (self.state.clone(), self.fields[0]);
            material.respond(&at, &old, &mut self.state)?;
            material.fields(&self.state, &mut self.fields);
            for (reached, degree) in self.reached.iter_mut().zip(DEGREES) {
                if reached.is_nan() && self.fields[0] >= degree {
                    *reached = self.temperature + increment * part(before, self.fields[0], degree);
                }
            }
            self.temperature += increment;
        }
        self.temperature = to;
        Ok(())
    }
}

/// Where between two values of α a value lies: in ln(−ln(1 − α)), which Avrami's law makes linear in ln t.
fn part(before: f64, after: f64, degree: f64) -> f64 {
    let of = |alpha: f64| (-(-alpha).ln_1p()).ln();
    let part = (of(degree) - of(before)) / (of(after) - of(before));
    if part.is_finite() { part } else { (degree - before) / (after - before) }
}

/// What a file holds: its mesh, and its temperatures at the first time. Files of later times are there, but not read.
///
/// # Errors
/// As [`run`], as far as the first time goes.
pub fn explain(spec: &NodesSpec, path: &Path) -> Result<String, Error> {
    let mut analysis = thermal::open(path, spec.array.as_deref())?;
    let Some(first) = analysis.frames.next().transpose()? else {
        return Err(none(path));
    };
    kelvin(spec, path, &first)?;
    let span = |pick: fn(f64, f64) -> f64, start| first.temperature.iter().copied().fold(start, pick);
    let [low, high] = [span(f64::min, f64::INFINITY), span(f64::max, f64::NEG_INFINITY)];
    let unit = if spec.zero() == 0.0 { "K" } else { "°C" };
    let (nodes, cells, time) = (analysis.points.len(), analysis.cells.len(), first.time);
    let file = spec.file.display();
    Ok(format!("at {nodes} nodes of {cells} elements of {file}, from {low} to {high} {unit} at t = {time} s"))
}

fn none(path: &Path) -> Error {
    let reason = "no temperatures; allowed: those of one time at least (CalculiX: *NODE FILE, NT)".into();
    Error::Data { what: path.display().to_string(), reason }
}

/// Temperatures of a time, K.
fn kelvin(spec: &NodesSpec, path: &Path, frame: &thermal::Frame) -> Result<Vec<f64>, Error> {
    let kelvin: Vec<f64> = frame.temperature.iter().map(|value| value + spec.zero()).collect();
    let Some(wrong) = kelvin.iter().find(|kelvin| !(kelvin.is_finite() && **kelvin > 0.0)) else {
        return Ok(kelvin);
    };
    let time = frame.time;
    let reason =
        format!("{wrong} K at t = {time} s; allowed: above 0 K (`unit` is that of the file's temperatures)");
    Err(Error::Data { what: path.display().to_string(), reason })
}

/// Integrates at every node, writes `NAME.vtkhdf` and the values of the end.
///
/// # Errors
/// A file that cannot be read, temperatures below 0 K, times that do not grow; I/O errors.
pub fn run(
    spec: &NodesSpec,
    name: &str,
    path: &Path,
    material: &dyn ThermalMaterial,
    output: &Path,
    report: &mut Report,
) -> Result<(), Error> {
    let analysis = thermal::open(path, spec.array.as_deref())?;
    let mut series =
        MeshSeries::create(output.join(format!("{name}.vtkhdf")), analysis.points, analysis.cells)?;
    let (mut nodes, mut time) = (Vec::<Node>::new(), 0.0);
    let mut frames = 0u64;
    let data = |reason: String| Error::Data { what: path.display().to_string(), reason };
    for frame in analysis.frames {
        let frame = frame?;
        let values = kelvin(spec, path, &frame)?;
        if nodes.is_empty() {
            let fresh = |value: &f64| {
                let start = spec.start.map_or(*value, |start| start.si());
                let mut state = vec![0.0; material.state_names().len()];
                material.initial_state(start, &mut state);
                let mut fields = vec![0.0; material.field_names().len()];
                material.fields(&state, &mut fields);
                Node { temperature: start, state, fields, reached: [f64::NAN; 3] }
            };
            nodes = values.iter().map(fresh).collect();
            time = if spec.start.is_some() { 0.0 } else { frame.time };
        }
        let duration = frame.time - time;
        if duration.is_nan() || duration < 0.0 {
            return Err(data(format!("t = {} s after {time} s; allowed: times that grow", frame.time)));
        }
        nodes
            .par_iter_mut()
            .zip(&values)
            .try_for_each(|(node, value)| node.advance(material, *value, duration))?;
        time = frame.time;
        frames += 1;
        let temperatures: Vec<f64> = nodes.iter().map(|node| node.temperature - CELSIUS).collect();
        let fields: Vec<Vec<f64>> = (0..material.field_names().len())
            .map(|field| nodes.iter().map(|node| node.fields[field]).collect())
            .collect();
        let mut arrays = vec![("temperature_degC", 1, temperatures.as_slice())];
        arrays.extend(
            material.field_names().iter().zip(&fields).map(|(name, values)| (*name, 1, values.as_slice())),
        );
        series.step(time, &arrays, &[])?;
    }
    if frames == 0 {
        return Err(none(path));
    }
    series.finish()?;
    report.work(&format!("{name}.frames"), frames).work(&format!("{name}.nodes"), nodes.len() as u64);
    let mut span =
        |least: Quantity, mean: Quantity, largest: Quantity, of: &dyn Fn(&Node) -> f64, keys: &[&str]| {
            let values: Vec<f64> = nodes.iter().map(of).filter(|value| value.is_finite()).collect();
            if values.len() == nodes.len() {
                let fold = |pick: fn(f64, f64) -> f64, first| values.iter().copied().fold(first, pick);
                report.value(least.of(keys), fold(f64::min, f64::INFINITY));
                report.value(mean.of(keys), values.iter().sum::<f64>() / values.len() as f64);
                report.value(largest.of(keys), fold(f64::max, f64::NEG_INFINITY));
            }
        };
    for (field, quantity) in material.field_names().iter().enumerate() {
        span(q::NODES_LEAST, q::NODES_MEAN, q::NODES_LARGEST, &|node| node.fields[field], &[name, quantity]);
    }
    for (index, degree) in DEGREES.iter().enumerate() {
        let of = |node: &Node| node.reached[index] - CELSIUS;
        let keys = [name, &degree.to_string()];
        span(q::NODES_COLDEST_AT, q::NODES_MEAN_AT, q::NODES_HOTTEST_AT, &of, &keys);
    }
    Ok(())
}
