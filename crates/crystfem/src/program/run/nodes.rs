//! Crystallinity at the nodes of a thermal analysis from another program.

use crate::error::Error;
use crate::material::ThermalMaterial;
use crate::point::MaterialPoint;
use crate::program::observe::celsius::CELSIUS;
use crate::program::quantities as q;
use crate::program::scene::NodesSpec;
use crate::program::thermal;
use harness::output::vtkhdf::MeshSeries;
use harness::report::{Quantity, Report};
use polycore::numerics::range;
use rayon::prelude::*;
use std::path::Path;

/// Relative crystallinities at which the temperature is reported.
const DEGREES: [f64; 3] = [0.01, 0.5, 0.99];

type AnalysisNode = MaterialPoint<3>;

/// Describes a file: its mesh and its first temperatures. Later times are not read.
///
/// # Errors
/// As [`run`], for the first time only.
pub fn explain(spec: &NodesSpec, path: &Path) -> Result<String, Error> {
    let mut analysis = thermal::open(path, spec.array.as_deref())?;
    let Some(first) = analysis.frames.next().transpose()? else {
        return Err(no_temperatures(path));
    };
    kelvin(spec, path, &first)?;
    let [low, high] = range(first.temperature.iter().copied());
    let unit = if spec.zero() == 0.0 { "K" } else { "°C" };
    let (nodes, cells, time) = (analysis.points.len(), analysis.cells.len(), first.time);
    let file = spec.file.display();
    Ok(format!("at {nodes} nodes of {cells} elements of {file}, from {low} to {high} {unit} at t = {time} s"))
}

fn no_temperatures(path: &Path) -> Error {
    let reason = "found no temperatures; allowed: at least one time (CalculiX: *NODE FILE, NT)".into();
    Error::Data { what: path.display().to_string(), reason }
}

/// Converts the temperatures of one time to K.
fn kelvin(spec: &NodesSpec, path: &Path, frame: &thermal::ThermalFrame) -> Result<Vec<f64>, Error> {
    let kelvin: Vec<f64> = frame.temperature.iter().map(|value| value + spec.zero()).collect();
    let Some(wrong) = kelvin.iter().find(|kelvin| !(kelvin.is_finite() && **kelvin > 0.0)) else {
        return Ok(kelvin);
    };
    let time = frame.time;
    let reason =
        format!("found {wrong} K at t = {time} s; allowed: above 0 K (check `unit`, the unit of the file)");
    Err(Error::Data { what: path.display().to_string(), reason })
}

/// Integrates the crystallinity at each node; writes `NAME.vtkhdf` and reports the final values.
///
/// # Errors
/// Returns an error for an unreadable file, temperatures below 0 K, decreasing times and I/O errors.
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
    let (mut nodes, mut time) = (Vec::<AnalysisNode>::new(), 0.0);
    let mut frames = 0u64;
    let data = |reason: String| Error::Data { what: path.display().to_string(), reason };
    for frame in analysis.frames {
        let frame = frame?;
        let values = kelvin(spec, path, &frame)?;
        if nodes.is_empty() {
            let fresh = |value: &f64| {
                let start = spec.start.map_or(*value, |start| start.si());
                AnalysisNode::new(material, start, DEGREES)
            };
            nodes = values.iter().map(fresh).collect();
            time = if spec.start.is_some() { 0.0 } else { frame.time };
        }
        let duration = frame.time - time;
        if duration.is_nan() || duration < 0.0 {
            return Err(data(format!(
                "found t = {} s after {time} s; allowed: increasing times",
                frame.time
            )));
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
        return Err(no_temperatures(path));
    }
    series.finish()?;
    report.work(&format!("{name}.frames"), frames).work(&format!("{name}.nodes"), nodes.len() as u64);
    let mut span = |least: Quantity,
                    mean: Quantity,
                    largest: Quantity,
                    value: &dyn Fn(&AnalysisNode) -> f64,
                    keys: &[&str]| {
        let values: Vec<f64> = nodes.iter().map(value).filter(|value| value.is_finite()).collect();
        if values.len() == nodes.len() {
            let fold = |pick: fn(f64, f64) -> f64, first| values.iter().copied().fold(first, pick);
            report.value(least.named(keys), fold(f64::min, f64::INFINITY));
            report.value(mean.named(keys), values.iter().sum::<f64>() / values.len() as f64);
            report.value(largest.named(keys), fold(f64::max, f64::NEG_INFINITY));
        }
    };
    for (field, quantity) in material.field_names().iter().enumerate() {
        span(q::NODES_LEAST, q::NODES_MEAN, q::NODES_LARGEST, &|node| node.fields[field], &[name, quantity]);
    }
    for (index, degree) in DEGREES.iter().enumerate() {
        let temperature = |node: &AnalysisNode| node.reached[index] - CELSIUS;
        let keys = [name, &degree.to_string()];
        span(q::NODES_COLDEST_AT, q::NODES_MEAN_AT, q::NODES_HOTTEST_AT, &temperature, &keys);
    }
    Ok(())
}
