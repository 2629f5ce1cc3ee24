//! Converts results of LAMMPS to a report, a history, a curve and fields.

use crate::program::quantities as q;
use crate::program::run::PeriFailure;
use crate::program::scene::{NAMING, Scene};
use harness::output::csv;
use harness::output::picture::{LinePlot, Series};
use harness::output::vtkhdf::{Data, ParticleSeries};
use harness::report::{Quantity, Report};
use harness::scene::Source;
use polycore::Error;
use polycore::file::prepare_directory;
use std::collections::BTreeMap;
use std::fs::read_to_string;
use std::path::{Path, PathBuf};

/// Header of an export.
#[derive(serde::Deserialize)]
struct ExportHeader {
    format: String,
    variant: String,
    critical_stretch: Option<f64>,
}

/// Columns of drive.py and their names in our histories.
const NAMES: [(&str, &str); 3] =
    [("residual", "out_of_balance"), ("rounds", "equilibria"), ("broken", "broken_bonds")];

/// Reads the results of `drive.py` in `folder`, and writes history.csv, load.png, fields.vtkhdf and
/// report.json into `output`. Judges the expectations of the scene whose values LAMMPS gives.
///
/// # Errors
/// A folder without an export or without steps, a truncated file, results that cannot be written.
pub fn import(folder: &Path, output: &Path) -> Result<Report, PeriFailure> {
    let path = folder.join("model.json");
    let model: ExportHeader =
        serde_json::from_str(&read_to_string(&path).map_err(Error::from_io("read", &path))?)
            .map_err(|error| fault(&path, "model of an export", error.to_string()))?;
    if model.format != "peri-lammps 1" {
        return Err(fault(&path, "model of an export", format!("its format is `{}`", model.format)).into());
    }
    let source = Source::read(folder.join("scene.toml"))?;
    let scene: Scene = source.parse()?;
    let path = folder.join("history.csv");
    let history = csv::read(&path)?;
    let column = |name: &str| -> Result<&[f64], Error> {
        let found = history.iter().find(|(heading, _)| heading.split(" [").next() == Some(name));
        found
            .map(|(_, list)| list.as_slice())
            .filter(|list| !list.is_empty())
            .ok_or_else(|| fault(&path, "history of drive.py", format!("it has no rows of `{name}`")))
    };
    let (steps, displacement, load) = (column("step")?, column("displacement")?, column("load")?);
    let (broken, last) = (column("broken")?, load.len() - 1);
    prepare_directory(output)?;
    let columns: Vec<csv::Column> = history
        .iter()
        .filter(|(heading, _)| !["step", "factor"].contains(&heading.as_str()))
        .map(|(heading, list)| {
            let (name, unit) = heading.split_once(" [").unwrap_or((heading, ""));
            let ours = NAMES.iter().find(|(theirs, _)| *theirs == name).map_or(name, |(_, ours)| ours);
            (ours, unit.trim_end_matches(']'), list.as_slice())
        })
        .collect();
    csv::write(output.join("history.csv"), &columns)?;
    let mut report = Report::new("peri", env!("CARGO_PKG_VERSION"), &source.text);
    let mut value = |quantity: Quantity, value: f64| {
        let name = match model.variant.as_str() {
            "" => quantity.name.to_owned(),
            variant => NAMING.value(variant, quantity.name),
        };
        report.value(harness::report::Named::new(name, quantity.unit), value);
    };
    if let Some(peak) = (0..=last).filter(|_| last > 0).max_by(|&a, &b| load[a].total_cmp(&load[b])) {
        value(q::PEAK_LOAD, load[peak]);
        value(q::DISPLACEMENT_AT_PEAK, displacement[peak]);
    }
    if model.critical_stretch.is_some() {
        if let Some(first) = broken.iter().position(|&count| count > 0.0) {
            value(q::FIRST_BREAK, displacement[first]);
        }
        value(q::BROKEN_BONDS, broken[last]);
        value(q::LAST_LOAD, load[last]);
        value(q::LAST_DISPLACEMENT, displacement[last]);
    }
    report.work("steps", steps.len() as u64);
    report.work("iterations", column("iterations")?.iter().sum::<f64>() as u64);
    if last > 0 {
        let shown: Vec<f64> = displacement.iter().map(|u| 1e3 * u).collect();
        let plot = LinePlot::new("Load, by LAMMPS").axes("displacement (mm)", "load (N)");
        plot.series(Series::line("LAMMPS", &shown, load)).write(output.join("load.png"))?;
    }
    write_fields(folder, output, |step| {
        let row = steps.iter().position(|&own| own == step as f64)?;
        Some([displacement[row], load[row]])
    })?;
    let known: Vec<_> = scene
        .expect
        .iter()
        .filter(|expect| expect.names().all(|name| report.values.contains_key(name)))
        .cloned()
        .collect();
    report.threads(1).judge(&known, false);
    report.write(output)?;
    Ok(report)
}

/// Writes displacements and damage at each dumped step, with its displacement and load.
fn write_fields(
    folder: &Path,
    output: &Path,
    moments: impl Fn(u64) -> Option<[f64; 2]>,
) -> Result<(), Error> {
    let body = folder.join("peri.data");
    let (places, bonds) = read_body(&body)?;
    let mut whole = vec![0_u32; places.len()];
    bonds.iter().flatten().for_each(|&end| whole[end] += 1);
    let pairs = read_broken(folder, places.len())?;
    let mut series = ParticleSeries::create(output.join("fields.vtkhdf"))?;
    for (step, path) in find_dumps(folder)? {
        let Some([displacement, load]) = moments(step) else { continue };
        let points = read_dump(&path, places.len())?;
        let moved: Vec<f64> =
            points.iter().zip(&places).flat_map(|(now, at)| [0, 1, 2].map(|d| now[d] - at[d])).collect();
        let mut cut = vec![0_u32; places.len()];
        pairs.iter().filter(|pair| pair.0 <= step).for_each(|pair| {
            cut[pair.1] += 1;
            cut[pair.2] += 1;
        });
        let damage: Vec<f64> =
            cut.iter().zip(&whole).map(|(&cut, &all)| f64::from(cut) / f64::from(all.max(1))).collect();
        let data: [Data; 2] = [("displacement", 3, &moved), ("damage", 1, &damage)];
        series.moment(step as f64, &points, &data, &[("displacement", displacement), ("load", load)])?;
    }
    series.finish()?;
    Ok(())
}

fn fault(path: &Path, format: &'static str, reason: String) -> Error {
    Error::Format { path: path.to_path_buf(), format, reason }
}

fn numbers(path: &Path, line: &str, between: char) -> Result<Vec<f64>, Error> {
    let fields = line.split(between).map(|field| field.trim().parse::<f64>());
    let found: Result<Vec<f64>, _> = fields.collect();
    let found = found.ok().filter(|row| row.iter().all(|x| x.is_finite()));
    found.ok_or_else(|| fault(path, "table of LAMMPS", format!("`{line}`: expected finite numbers")))
}

/// Reference positions, m, and the ends of all bonds, from 0.
type ReferenceBody = (Vec<[f64; 3]>, Vec<[usize; 2]>);

fn read_body(path: &Path) -> Result<ReferenceBody, Error> {
    let text = read_to_string(path).map_err(Error::from_io("read", path))?;
    let section = |name: &'static str| {
        let mut lines = text.lines().skip_while(move |line| !line.starts_with(name));
        lines.next();
        lines.skip(1).take_while(|line| !line.is_empty())
    };
    let (mut places, mut bonds) = (Vec::new(), Vec::new());
    let short = |line: &str| fault(path, "LAMMPS data", format!("`{line}` is truncated"));
    for line in section("Atoms") {
        let [_, _, _, x, y, z] = numbers(path, line, ' ')?[..] else { return Err(short(line)) };
        places.push([x, y, z].map(|x| 1e-3 * x));
    }
    for line in section("Bonds") {
        let [_, _, a, b] = numbers(path, line, ' ')?[..] else { return Err(short(line)) };
        let ends = [a, b].map(|end| end as usize - 1);
        if ends.iter().any(|&end| end >= places.len()) {
            return Err(fault(path, "LAMMPS data", format!("`{line}`: no such particle")));
        }
        bonds.push(ends);
    }
    Ok((places, bonds))
}

/// Reads the step and the ends, from 0, of each broken bond, of all ranks.
fn read_broken(folder: &Path, count: usize) -> Result<Vec<(u64, usize, usize)>, Error> {
    let mut pairs = Vec::new();
    for path in find_numbered(folder, "broken.", ".csv")?.into_values() {
        for line in read_to_string(&path).map_err(Error::from_io("read", &path))?.lines() {
            match numbers(&path, line, ',')?[..] {
                [step, _, a, b] if (1.0..=count as f64).contains(&a) && (1.0..=count as f64).contains(&b) => {
                    pairs.push((step as u64, a as usize - 1, b as usize - 1));
                }
                _ => return Err(fault(&path, "list of broken bonds", format!("`{line}`"))),
            }
        }
    }
    Ok(pairs)
}

/// Finds the dumps by step.
fn find_dumps(folder: &Path) -> Result<BTreeMap<u64, PathBuf>, Error> {
    find_numbered(folder, "step.", ".dump")
}

/// Finds the files PREFIX NUMBER SUFFIX of a folder.
fn find_numbered(folder: &Path, prefix: &str, suffix: &str) -> Result<BTreeMap<u64, PathBuf>, Error> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).map_err(Error::from_io("read", folder))?.flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let number = name.strip_prefix(prefix).and_then(|rest| rest.strip_suffix(suffix)?.parse().ok());
        found.extend(number.map(|number| (number, entry.path())));
    }
    Ok(found)
}

/// Reads the positions, m, of a dump sorted by id.
fn read_dump(path: &Path, count: usize) -> Result<Vec<[f64; 3]>, Error> {
    let text = read_to_string(path).map_err(Error::from_io("read", path))?;
    let mut places = Vec::with_capacity(count);
    for line in text.lines().skip(9) {
        match numbers(path, line.trim(), ' ')?[..] {
            [id, _, x, y, z, ..] if id == (places.len() + 1) as f64 => {
                places.push([x, y, z].map(|x| 1e-3 * x))
            }
            _ => {
                return Err(fault(
                    path,
                    "LAMMPS dump",
                    format!("`{line}` is not particle {}", places.len() + 1),
                ));
            }
        }
    }
    if places.len() != count {
        let reason = format!("{} particles, the body has {count}", places.len());
        return Err(fault(path, "LAMMPS dump", reason));
    }
    Ok(places)
}
