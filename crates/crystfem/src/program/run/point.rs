//! Run of a point scene: curves, events and pictures of the material alone.

use super::draw::{self, PointRun};
use crate::error::Error;
use crate::point::{CurveEvent, Curves, Drive, PointProcess, Stepping};
use crate::program::observe::celsius::CELSIUS;
use crate::program::quantities as q;
use crate::program::scene::{NodesSpec, PointScene};
use harness::output::csv;
use harness::report::{Phases, Quantity, Report};
use harness::scene::{Failure, SceneError, Source};
use polycore::numerics::range;
use std::path::Path;

/// Relative crystallinities at which temperature and time are reported.
const DEGREES: [f64; 3] = [0.01, 0.5, 0.99];

/// Runs each point with each of its materials.
pub fn run(
    source: &Source,
    scene: &PointScene,
    run: &mut harness::case::Run,
) -> Result<Report, Failure<Error>> {
    let (output, quick) = (run.options.output, run.options.quick);
    let materials = scene.materials(source)?;
    let mut built = Vec::new();
    for (name, spec, key) in &materials {
        built.push((name.as_str(), *spec, spec.build(source, key)?));
    }
    let courses = scene.courses(source)?;
    let thermal = scene.nodes.iter().enumerate().filter(|(_, nodes)| !quick || nodes.quick);
    thermal.map(|(index, nodes)| explain_nodes(source, index, nodes)).collect::<Result<Vec<_>, _>>()?;
    run.begin()?;
    let mut report = Report::new("crystfem", env!("CARGO_PKG_VERSION"), &source.text);
    let (mut phases, mut runs) = (Phases::new(), Vec::new());
    for (point, (drive, stepping)) in scene.point.iter().zip(courses) {
        if quick && !point.quick {
            continue;
        }
        for (material_name, _, material) in &built {
            if point.materials.as_ref().is_some_and(|names| !names.iter().any(|name| name == material_name)) {
                continue;
            }
            let name = [point.name.as_str(), material_name].join(".");
            let name = name.trim_end_matches('.').to_owned();
            phases.start("integrate");
            let course = PointProcess { material: &**material, drive: drive.clone(), stepping };
            let curves = course.run()?;
            let broken = non_finite(&course, &curves);
            match broken.first() {
                Some((quantity, time)) if !point.non_finite => {
                    let (quantity, place) = (*quantity, format!("point `{name}`"));
                    return Err(Error::NotFinite { quantity, place, time: *time }.into());
                }
                None if point.non_finite => {
                    return Err(Error::Finite { place: format!("point `{name}`") }.into());
                }
                _ => report.value(q::NON_FINITE_ROWS.named(&[&name]), broken.len() as f64),
            };
            record(&mut report, &name, &course, &curves)?;
            phases.start("write");
            write(output, &name, &course, &curves)?;
            runs.push(PointRun { name, fields: material.field_names(), curves });
        }
    }
    for nodes in scene.nodes.iter().filter(|nodes| !quick || nodes.quick) {
        phases.start("integrate");
        let matches =
            |(name, ..): &&(&str, _, _)| nodes.material.as_deref().is_none_or(|given| given == *name);
        if let Some((.., material)) = built.iter().find(matches) {
            let path = source.file(&nodes.file);
            super::nodes::run(nodes, &nodes.name, &path, &**material, output, &mut report)?;
        }
    }
    compare(&mut report, scene);
    if scene.output.pictures {
        phases.start("draw");
        if !runs.is_empty() {
            draw::draw_curves(&scene.title, &runs, output)?;
        }
        for (name, spec, key) in &materials {
            if spec.law == crate::program::scene::Law::Semicrystalline {
                let material = spec.semicrystalline(source, key)?;
                draw::draw_laws(name, &material, output)?;
            }
        }
    }
    phases.stop();
    report.phases(&phases).threads(1).judge(&scene.expect, quick);
    Ok(report)
}

/// Describes a scene, line by line.
///
/// # Errors
/// Returns an error for an invalid scene.
pub fn explain(source: &Source, scene: &PointScene, quick: bool) -> Result<Vec<String>, SceneError> {
    let mut lines = Vec::new();
    for (name, spec, key) in scene.materials(source)? {
        let material = spec.build(source, &key)?;
        let coupled = if spec.latent_heat.is_some() { "latent heat" } else { "no latent heat" };
        let melting = if spec.melting.is_some() { "melting" } else { "no melting" };
        let linear = if material.is_linear() { "linear heat" } else { "non-linear heat" };
        let name = if name.is_empty() { "" } else { &format!(" {name}") };
        lines.push(format!("material{name}: {:?}, {linear}, {melting}, {coupled}", spec.law));
    }
    let courses = scene.point.iter().zip(scene.courses(source)?);
    for (point, (drive, stepping)) in courses.filter(|(point, _)| !quick || point.quick) {
        let drive = match drive {
            Drive::Prescribed(history) => {
                let [from, to] = history.span();
                let jumps = history.segments().filter(|segment| segment.times[0] == segment.times[1]).count();
                let mut text = format!(
                    "prescribed temperature, {} segments, {} s",
                    history.segments().count(),
                    to - from
                );
                if jumps > 0 {
                    text += &format!(", {jumps} of them jumps (without `rate` and `duration`)");
                }
                text
            }
            Drive::Lumped { exchange: None, duration, .. } => format!("adiabatic, {duration} s"),
            Drive::Lumped { exchange: Some([ambient, constant]), duration, .. } => {
                format!("lumped body, surroundings {ambient} K, time constant {constant} s, {duration} s")
            }
        };
        let steps = match stepping {
            Stepping::Adaptive { degree, kelvin } => {
                format!("adaptive steps, at most {degree} in alpha and {kelvin} K")
            }
            Stepping::Kelvin(kelvin) => format!("steps of {kelvin} K"),
            Stepping::Seconds(seconds) => format!("steps of {seconds} s"),
        };
        lines.push(format!("point {}: {drive}; {steps}", point.name));
    }
    for (index, nodes) in scene.nodes.iter().enumerate().filter(|(_, nodes)| !quick || nodes.quick) {
        lines.push(format!("nodes {}: {}", nodes.name, explain_nodes(source, index, nodes)?));
    }
    Ok(lines)
}

/// Describes the file of a thermal analysis.
fn explain_nodes(source: &Source, index: usize, nodes: &NodesSpec) -> Result<String, SceneError> {
    let text = super::nodes::explain(nodes, &source.file(&nodes.file));
    text.map_err(|error| source.refused(&format!("nodes[{index}].file"), &error))
}

/// Returns name and time of the first non-finite value in each row.
fn non_finite(course: &PointProcess, curves: &Curves) -> Vec<(&'static str, f64)> {
    let names = course.material.field_names();
    let wrong = |row: usize| {
        let fields = names.iter().copied().zip(curves.fields[row].iter().copied());
        let others = [
            ("temperature", curves.temperature[row]),
            ("energy", curves.energy[row]),
            ("rate of crystallization", curves.rate[row]),
        ];
        fields.chain(others).find(|(_, value)| !value.is_finite()).map(|(name, _)| name)
    };
    (0..curves.time.len()).filter_map(|row| Some((wrong(row)?, curves.time[row]))).collect()
}

/// Reports the scalars of a run (its finite rows only); temperatures in °C, as in the thesis.
fn record(report: &mut Report, name: &str, course: &PointProcess, curves: &Curves) -> Result<(), Error> {
    let rows = curves.time.len();
    let last = rows - 1;
    let key = |quantity: &str| format!("{name}.{quantity}");
    report.work(&key("steps"), last as u64).work(&key("rejected"), curves.rejected as u64);
    let span = |values: &[f64]| range(values.iter().copied());
    let named = |quantity: Quantity| quantity.named(&[name]);
    let [coldest, hottest] = span(&curves.temperature);
    report.value(named(q::COLDEST), coldest - CELSIUS);
    report.value(named(q::HOTTEST), hottest - CELSIUS);
    report.value(named(q::FINAL_TEMPERATURE), curves.temperature[last] - CELSIUS);
    report.value(named(q::TEMPERATURE_RISE), curves.temperature[last] - curves.temperature[0]);
    report.value(named(q::ENERGY_CHANGE), curves.energy[last] - curves.energy[0]);
    for (index, field) in course.material.field_names().iter().enumerate() {
        let values: Vec<f64> = curves.fields.iter().map(|f| f[index]).filter(|x| x.is_finite()).collect();
        let [least, most] = span(&values);
        report.value(q::LOWEST.named(&[name, field]), least);
        report.value(q::HIGHEST.named(&[name, field]), most);
        if curves.fields[last][index].is_finite() {
            report.value(q::FINAL.named(&[name, field]), curves.fields[last][index]);
        }
        if rows > 1 && curves.fields[1][index].is_finite() {
            report.value(q::FIRST_STEP.named(&[name, field]), curves.fields[1][index]);
        }
    }
    let mut event = |what: &str, event: CurveEvent| {
        report.value(q::TEMPERATURE_AT.named(&[name, what]), event.temperature - CELSIUS);
        report.value(q::TIME_TO.named(&[name, what]), event.time - curves.time[0]);
        event
    };
    for degree in DEGREES {
        if let Some(found) = course.reaching(curves, degree)? {
            event(&degree.to_string(), found);
        }
    }
    if let Some(peak) = course.peak(curves)? {
        let rate = event("peak", peak).rate;
        report.value(q::PEAK_RATE.named(&[name]), rate);
    }
    Ok(())
}

/// Reports shifts of temperature and time between two materials, at each point with both.
fn compare(report: &mut Report, scene: &PointScene) {
    for pair in &scene.compare {
        for point in &scene.point {
            for degree in DEGREES {
                let value = |quantity: Quantity, material: &str| {
                    let key = format!("{}.{material}", point.name);
                    report.scalar(&quantity.named(&[&key, &degree.to_string()]).name)
                };
                let both = |quantity| Some([value(quantity, &pair.material)?, value(quantity, &pair.with)?]);
                let (temperatures, times) = (both(q::TEMPERATURE_AT), both(q::TIME_TO));
                if let (Some([a, b]), Some([c, d])) = (temperatures, times) {
                    report.value(q::SHIFT_AT.named(&[&point.name, &degree.to_string()]), a - b);
                    report.value(q::LONGER_TO.named(&[&point.name, &degree.to_string()]), c / d - 1.0);
                }
            }
        }
    }
}

/// Writes NAME.csv with all rows.
fn write(output: &Path, name: &str, course: &PointProcess, curves: &Curves) -> Result<(), polycore::Error> {
    let celsius: Vec<f64> = curves.temperature.iter().map(|t| t - CELSIUS).collect();
    let mut columns: Vec<(&str, &str, Vec<f64>)> =
        vec![("time", "s", curves.time.clone()), ("temperature", "degC", celsius)];
    let material = course.material;
    for (index, state) in material.state_names().iter().enumerate() {
        if !material.field_names().contains(state) {
            columns.push((state, "", curves.states.iter().map(|s| s[index]).collect()));
        }
    }
    for (index, field) in material.field_names().iter().enumerate() {
        columns.push((field, "", curves.fields.iter().map(|f| f[index]).collect()));
    }
    columns.push(("alpha_rate", "1/s", curves.rate.clone()));
    columns.push(("energy", "J/kg", curves.energy.clone()));
    let columns: Vec<csv::Column> = columns.iter().map(|(n, u, data)| (*n, *u, data.as_slice())).collect();
    csv::write(output.join(format!("{name}.csv")), &columns)
}
