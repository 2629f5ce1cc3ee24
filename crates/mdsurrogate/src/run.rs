//! Runs a scene: reads and measures the data, splits, draws, writes HDF5, CSV, PNG and `report.json`.

use crate::dataset::{
    Dataset, Noise, ReadOptions, Row, Split, Standardisation, hdf5, leak, noise, read, split,
};
use crate::error::Error;
use crate::kinematics::{ANGSTROM, NAMES, PeriodicBox};
use crate::scene::{Data, Scene};
use polycore::output::picture::{LinePlot, Series};
use polycore::output::{csv, prepare_directory};
use polycore::report::{Phases, Report};
use polycore::scene::Source;
use polycore::tensor::Voigt;
use std::path::{Path, PathBuf};

/// What stops a run: a fault in the scene, or one met on the way.
pub type Failure = polycore::scene::Failure<Error>;

/// A finished run.
pub struct Finished {
    /// As written to `report.json`.
    pub report: Report,
    /// Lines that no number can say: names of constant components, provenance.
    pub remarks: Vec<String>,
}

/// Reads, checks and joins the files of a scene; paths are relative to it.
///
/// # Errors
/// [`Failure`]: reference lengths or a unit out of range, and all of [`read`].
pub fn load(source: &Source, data: &Data, files: &[PathBuf], key: &str) -> Result<Dataset, Failure> {
    let mut options = ReadOptions { columns: data.columns, ..ReadOptions::default() };
    if let Some(lengths) = data.reference_lengths {
        let lengths = lengths.map(|length| length.si() / ANGSTROM);
        if let Some(length) = lengths.iter().find(|length| !(0.1..=1e7).contains(*length)) {
            let found = format!("{length:e} Å");
            return Err(source.error("data.reference_lengths", found, "0.1 Å to 1 mm").into());
        }
        options.reference = Some(PeriodicBox::orthogonal(lengths));
    }
    if let Some(unit) = data.stress_unit {
        if unit.si() <= 0.0 {
            return Err(source.error("data.stress_unit", unit, "a positive stress, as \"1 MPa\"").into());
        }
        options.stress_unit = unit.si();
    }
    if files.is_empty() {
        return Err(source.error(key, "no file", "at least one").into());
    }
    let folder = source.path.parent().unwrap_or(Path::new(""));
    let mut set = Dataset::default();
    for file in files {
        set.append(read(folder.join(file), &options)?)?;
    }
    set.check()?;
    Ok(set)
}

/// Runs a scene.
///
/// # Errors
/// [`Failure`]; nothing half-written remains.
pub fn run(source: &Source, scene: &Scene, output: &Path, quick: bool) -> Result<Finished, Failure> {
    prepare_directory(output)?;
    let mut phases = Phases::new();
    phases.start("read");
    let set = load(source, &scene.data, &scene.data.files, "data.files")?;
    let heldout = match &scene.data.heldout[..] {
        [] => None,
        files => Some(load(source, &scene.data, files, "data.heldout")?),
    };
    phases.start("measure");
    let split = split(&set, scene.split.by, scene.split.fractions, scene.split.seed)
        .map_err(|error| source.error("split", error.to_string(), "a split that the data allow"))?;
    let rows: Vec<&Row> = set.rows().collect();
    let training: Vec<Voigt> = split.train.iter().map(|&row| rows[row].c).collect();
    let standardisation = Standardisation::of(training.iter())?;
    let mut report = Report::new("mdsurrogate", env!("CARGO_PKG_VERSION"), &source.text);
    describe(&mut report, "", &set);
    measure_split(&mut report, &set, &split, &standardisation);
    if let Some(heldout) = &heldout {
        describe(&mut report, "heldout ", heldout);
    }
    let mut remarks = set.provenance.clone();
    remarks.extend(heldout.iter().flat_map(|set| set.provenance.clone()));
    let constant = set.constant_components();
    if !constant.is_empty() {
        remarks.push(format!(
            "without variance: {} (standardised to 0; other values of them are not to be trusted)",
            constant.join(", ")
        ));
    }
    phases.start("write");
    hdf5::write(output.join("data.h5"), &set, Some((&split, &standardisation)))?;
    if let Some(heldout) = &heldout {
        hdf5::write(output.join("heldout.h5"), heldout, None)?;
    }
    draw(&set, heldout.as_ref(), output)?;
    phases.stop();
    report.phases(&phases).work("rows", set.len() as u64).work("paths", set.paths.len() as u64);
    report.judge(&scene.expect, quick).write(output)?;
    Ok(Finished { report, remarks })
}

/// Counts, ranges and noise of a set.
pub fn describe(report: &mut Report, prefix: &str, set: &Dataset) {
    let mut value = |name: &str, value: f64, unit: &str| {
        report.value(&format!("{prefix}{name}"), value, unit);
    };
    value("rows", set.len() as f64, "");
    value("paths", set.paths.len() as f64, "");
    value("rows skipped", set.skipped as f64, "");
    value("duplicate rows", set.duplicate_rows() as f64, "");
    value("constant components", set.constant_components().len() as f64, "");
    for (kind, count) in set.kinds() {
        value(&format!("paths of kind {kind}"), count as f64, "");
    }
    for (name, [low, high]) in NAMES.iter().zip(set.box_of_c()) {
        value(&format!("least C{name}"), low, "");
        value(&format!("greatest C{name}"), high, "");
    }
    let noises = [("cauchy", noise(set, |row| row.cauchy)), ("S", noise(set, |row| row.s))];
    for (letter, noise) in noises {
        let Some(noise) = noise else { continue };
        let Noise { deviation, floor, lag_1, lag_1_of_white_noise, .. } = noise;
        for (name, deviation) in NAMES.iter().zip(&deviation) {
            value(&format!("noise of {letter}{name}"), deviation / 1e6, "MPa");
        }
        value(&format!("noise floor of {letter}"), floor / 1e12, "MPa²");
        if let Some(lag) = lag_1 {
            value(&format!("lag-1 correlation of {letter} residuals"), lag, "");
            value(&format!("lag-1 correlation of {letter} residuals if white"), lag_1_of_white_noise, "");
        }
    }
}

fn measure_split(report: &mut Report, set: &Dataset, split: &Split, standardisation: &Standardisation) {
    let sets = [("training", &split.train), ("validation", &split.validation), ("test", &split.test)];
    for (name, rows) in sets {
        report.value(&format!("{name} rows"), rows.len() as f64, "");
    }
    for (a, name) in NAMES.iter().enumerate() {
        report.value(&format!("training mean of C{name}"), standardisation.mean[a], "");
        report.value(&format!("training deviation of C{name}"), standardisation.deviation[a], "");
    }
    if let Some(leak) = leak(set, split, standardisation) {
        report.value("nearest training row of a test row", leak.across, "");
        report.value("nearest other training row of a training row", leak.within, "");
        report.value("test rows with a neighbour of their run in training", leak.same_path, "");
        if let Some(ratio) = leak.ratio {
            report.value("leak ratio", ratio, "");
        }
        report.work("distances", leak.distances);
    }
}

/// Stress against engineering strain of the uniaxial runs, one picture a direction as in Fig. 3.5.
fn draw(set: &Dataset, heldout: Option<&Dataset>, output: &Path) -> Result<(), Error> {
    for (axis, name) in ["x", "y", "z"].iter().enumerate() {
        let kind = format!("u{name}");
        let mut plot = LinePlot::new(&format!("Uniaxial tension in {name}"))
            .axes("engineering strain", "Cauchy stress (MPa)");
        let (mut strains, mut stresses, mut rates) = (Vec::new(), Vec::new(), Vec::new());
        let own = set.paths.iter().filter(|path| path.kind == kind);
        let kept = heldout.into_iter().flat_map(|set| &set.paths).filter(|path| path.kind == kind);
        for (path, held) in own.map(|path| (path, false)).chain(kept.map(|path| (path, true))) {
            let strain: Vec<f64> =
                path.rows.iter().map(|row| row.deformation.matrix()[(axis, axis)] - 1.0).collect();
            let stress: Vec<f64> = path.rows.iter().map(|row| row.cauchy[axis] / 1e6).collect();
            let label = format!("{}: {:.3e}/s", path.id, path.rates[axis]);
            let series = if held { Series::reference } else { Series::line };
            plot = plot.series(series(&label, &strain, &stress));
            rates.extend(std::iter::repeat_n(path.rates[axis], strain.len()));
            strains.extend(strain);
            stresses.extend(stress);
        }
        if strains.is_empty() {
            continue;
        }
        csv::write(
            output.join(format!("uniaxial-{name}.csv")),
            &[("rate", "1/s", &rates), ("strain", "", &strains), ("stress", "MPa", &stresses)],
        )?;
        plot.write(output.join(format!("uniaxial-{name}.png")))?;
    }
    Ok(())
}
