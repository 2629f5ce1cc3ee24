//! Data of a scene: reading, measures, split, pictures and HDF5.

use super::uniaxial;
use crate::dataset::{
    DataRow, DataSplit, Dataset, Noise, Path as Path_, ReadOptions, SplitMethod, Standardisation, hdf5, leak,
    noise, read, split,
};
use crate::error::Error;
use crate::eval::overstress;
use crate::kinematics::{ANGSTROM, NAMES, PeriodicBox};
use crate::program::quantities as q;
use crate::program::scene::{DatasetSpec, Scene};
use crate::surrogate::{Kind, Symmetry};
use crate::train::loading;
use harness::report::{Named, Report};
use harness::scene::{Failure, Source};
use polycore::constitutive::viscoelastic::Branch;
use polycore::tensor::Voigt;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Reads, checks and joins the files of a scene; paths are relative to it.
///
/// # Errors
/// Returns a [`Failure`] for invalid reference lengths or units, and the errors of [`read`].
pub fn load(
    source: &Source,
    data: &DatasetSpec,
    files: &[PathBuf],
    key: &str,
) -> Result<Dataset, Failure<Error>> {
    let mut options = ReadOptions {
        columns: data.columns,
        origin: data.reference,
        pressure: data.stress,
        units: data.units,
        names: data.names.clone(),
        blocks: data.blocks.clone(),
        ..ReadOptions::default()
    };
    if let Some(lengths) = data.reference_lengths {
        let lengths = lengths.map(|length| length.si() / ANGSTROM);
        if let Some(length) = lengths.iter().find(|length| !(0.1..=1e7).contains(*length)) {
            let found = format!("{length:e} Å");
            return Err(source.error("data.reference_lengths", found, "0.1 Å to 1 mm").into());
        }
        let tilts = data.reference_tilts.map_or([0.0; 3], |tilts| tilts.map(|tilt| tilt.si() / ANGSTROM));
        options.reference = Some(PeriodicBox { lengths, tilts });
    }
    if let Some(unit) = data.stress_unit {
        if unit.si() <= 0.0 {
            return Err(source.error("data.stress_unit", unit, "a positive stress, e.g. \"1 MPa\"").into());
        }
        options.stress_unit = Some(unit.si());
    }
    if files.is_empty() {
        return Err(source.error(key, "no files", "at least one file").into());
    }
    let mut set = Dataset::default();
    for (index, file) in files.iter().enumerate() {
        let path = source.file(file);
        let part = read(&path, &options).map_err(|error| match error {
            Error::Shared(polycore::Error::Io { source: reason, .. }) => {
                let allowed = format!("a readable file ({reason})");
                Failure::from(source.error(&format!("{key}[{index}]"), path.display(), allowed))
            }
            other => other.into(),
        })?;
        set.append(if set.shares_a_name(&part) { part.with_folder_prefix(&path) } else { part })?;
    }
    set.check()?;
    Ok(set)
}

/// Data of a scene, with their split.
#[derive(Clone)]
pub struct Prepared {
    /// Runs of the split.
    pub set: Dataset,
    /// Held-out runs, outside the split.
    pub heldout: Option<Dataset>,
    /// Split of the rows of `set`.
    pub split: DataSplit,
    /// Split by the other method, if a model requests it.
    pub second: Option<DataSplit>,
}

impl Prepared {
    /// Reads and splits the data of a scene.
    ///
    /// # Errors
    /// Returns the errors of [`load`], and an error for an impossible split.
    pub fn new(source: &Source, scene: &Scene) -> Result<Self, Failure<Error>> {
        let Some(data) = &scene.data else {
            return Err(source.missing("data", "the scene needs `[data]` with `files`").into());
        };
        let set = load(source, data, &data.files, "data.files")?;
        let heldout = match &data.heldout[..] {
            [] => None,
            files => Some(load(source, data, files, "data.heldout")?),
        };
        let divide = |by: SplitMethod| {
            split(&set, by, scene.split.fractions, scene.split.seed).map_err(|error| match error {
                Error::Parameter { found, allowed, .. } | Error::Data { found, allowed, .. } => {
                    source.error("split", found, allowed)
                }
                other => source.error("split", other, "a possible split of the data"),
            })
        };
        let first = divide(scene.split.by)?;
        let other = scene.model.iter().filter_map(|model| model.split).find(|by| *by != scene.split.by);
        let second = other.map(divide).transpose()?;
        let data = Self { set, heldout, split: first, second };
        data.check_models(source, scene)?;
        Ok(data)
    }

    /// Returns the split of a model.
    pub fn split_of(&self, model: Option<SplitMethod>) -> &DataSplit {
        match (&self.second, model) {
            (Some(second), Some(by)) if second.method == by => second,
            _ => &self.split,
        }
    }

    /// Checks that each model can be trained on these data.
    fn check_models(&self, source: &Source, scene: &Scene) -> Result<(), Failure<Error>> {
        if self.set.is_nominal() && scene.search.is_some() {
            let found = "a search for an ann with nominal stresses";
            return Err(source.error("search", found, "data with full stresses").into());
        }
        for (index, model) in scene.model.iter().enumerate() {
            let at = |key: &str| format!("model[{index}].{key}");
            let isotropic = matches!(model.law(), Kind::Energy { symmetry: Symmetry::Isotropic, .. });
            if self.set.is_nominal() && !isotropic {
                let key = if model.symmetry.is_some() { "symmetry" } else { "kind" };
                let allowed = "`kind = \"energy\"` with `symmetry = \"isotropic\"`, for nominal stresses of \
                    an incompressible body";
                return Err(source.error(&at(key), "another law", allowed).into());
            }
            for name in &model.runs {
                if !self.set.paths.iter().any(|path| path.id == *name) {
                    let known: Vec<&str> =
                        self.set.paths.iter().map(|path| path.id.as_str()).take(20).collect();
                    return Err(source.error(&at("runs"), format!("`{name}`"), known.join(", ")).into());
                }
            }
            let split = self.split_of(model.split);
            let histories = [("softening", model.softening), ("branches", model.branches)];
            for (key, _) in histories.into_iter().filter(|(_, count)| count.is_some()) {
                let turned = |path: &&Path_| loading(path).contains(&false);
                if self.set.is_nominal() {
                    let found = format!("{key} with nominal stresses");
                    return Err(source.error(&at(key), found, "data with full stresses").into());
                }
                if split.method == SplitMethod::Random {
                    let allowed = "`split = \"path\"`, because the stress of a row depends on its run";
                    return Err(source.error(&at(key), "a random split of rows", allowed).into());
                }
                if !self.paths_of(&split.train, &model.runs).iter().any(turned) {
                    let allowed = "training runs with unloading (`md write --path z=6e-5,unload=0.6`)";
                    return Err(source.error(&at(key), "no run with unloading", allowed).into());
                }
            }
            let timeless = |path: &&Path_| !path.rows.iter().map(|row| row.time).is_sorted_by(|a, b| a < b);
            let all = self.set.paths.iter().chain(self.heldout.iter().flat_map(|set| &set.paths));
            if let Some(path) = all.clone().find(timeless).filter(|_| model.branches.is_some()) {
                let found = format!("the run `{}`, whose times are unknown or do not grow", path.id);
                return Err(source.error(&at("branches"), found, "runs with a time for each row").into());
            }
            if self.rows_of(&split.train, &model.runs).is_empty() {
                let found = "runs without training rows";
                return Err(source.error(&at("runs"), found, "runs in the training set of the split").into());
            }
        }
        Ok(())
    }

    /// Returns the data with S of the runs of the split without that of branches; their other fields, and
    /// the held-out runs, are kept.
    ///
    /// # Errors
    /// Errors of [`overstress`].
    pub fn without_stress_of(&self, branches: &[Branch]) -> Result<Self, Error> {
        let mut data = self.clone();
        for path in &mut data.set.paths {
            for (row, own) in overstress(branches, path)?.into_iter().enumerate() {
                path.rows[row].s -= own;
            }
        }
        Ok(data)
    }

    /// Returns rows by number, restricted to some runs; an empty list means all runs.
    pub fn rows_of(&self, numbers: &[usize], runs: &[String]) -> Vec<&DataRow> {
        let paths = self.set.path_of_rows();
        let is_chosen = |row: &&usize| runs.is_empty() || runs.contains(&self.set.paths[paths[**row]].id);
        self.rows(&numbers.iter().filter(is_chosen).copied().collect::<Vec<_>>())
    }

    /// Returns the runs of rows, with the restriction of [`Self::rows_of`].
    pub fn paths_of(&self, numbers: &[usize], runs: &[String]) -> Vec<&Path_> {
        let of_row = self.set.path_of_rows();
        let used: BTreeSet<usize> = numbers.iter().map(|&row| of_row[row]).collect();
        let named = |path: &&Path_| runs.is_empty() || runs.contains(&path.id);
        used.into_iter().map(|path| &self.set.paths[path]).filter(named).collect()
    }

    /// Returns rows by number.
    pub fn rows(&self, numbers: &[usize]) -> Vec<&DataRow> {
        let all: Vec<&DataRow> = self.set.rows().collect();
        numbers.iter().map(|&row| all[row]).collect()
    }

    /// Reports measures of the data; returns remarks that are not numbers.
    ///
    /// # Errors
    /// Returns an error for non-finite numbers.
    pub fn measure(&self, report: &mut Report) -> Result<Vec<String>, Error> {
        let standardisation = self.standardisation()?;
        describe(report, "", &self.set);
        uniaxial::measure(report, &self.set);
        measure_split(report, &self.set, &self.split, &standardisation);
        if let Some(heldout) = &self.heldout {
            describe(report, "heldout.", heldout);
        }
        let mut remarks = self.set.provenance.clone();
        remarks.extend(self.heldout.iter().flat_map(|set| set.provenance.clone()));
        let constant = self.set.constant_components();
        if !constant.is_empty() {
            remarks.push(format!(
                "constant components: {} (standardised to 0; predictions at other values are not reliable)",
                constant.join(", ")
            ));
        }
        Ok(remarks)
    }

    fn standardisation(&self) -> Result<Standardisation, Error> {
        let training: Vec<Voigt> = self.rows(&self.split.train).iter().map(|row| row.c).collect();
        Standardisation::from_rows(training.iter())
    }

    /// Writes the data as HDF5 and draws the uniaxial runs.
    ///
    /// # Errors
    /// Returns I/O errors.
    pub fn write(&self, output: &Path) -> Result<(), Error> {
        // the layout cannot mark stresses that were not measured
        if !self.set.is_nominal() {
            let labels = Some((&self.split, &self.standardisation()?));
            hdf5::write(output.join("data.h5"), &self.set, labels)?;
        }
        if let Some(heldout) = self.heldout.as_ref().filter(|set| !set.is_nominal()) {
            hdf5::write(output.join("heldout.h5"), heldout, None)?;
        }
        uniaxial::draw(&self.set, self.heldout.as_ref(), output)
    }
}

/// Reports counts, ranges and noise of a set.
pub fn describe(report: &mut Report, prefix: &str, set: &Dataset) {
    let mut value = |quantity: Named, value: f64| {
        report.value(Named { name: format!("{prefix}{}", quantity.name), ..quantity }, value);
    };
    value(q::ROWS.into(), set.len() as f64);
    value(q::PATHS.into(), set.paths.len() as f64);
    value(q::SKIPPED_ROWS.into(), set.skipped as f64);
    value(q::DUPLICATE_ROWS.into(), set.duplicate_rows() as f64);
    value(q::CONSTANT_COMPONENTS.into(), set.constant_components().len() as f64);
    for (kind, count) in set.kinds() {
        value(q::PATHS_OF_KIND.named(&[kind]), count as f64);
    }
    for (name, [low, high]) in NAMES.iter().zip(set.strain_box()) {
        value(q::LEAST_C.named(&[name]), low);
        value(q::GREATEST_C.named(&[name]), high);
    }
    let stretches = || set.rows().flat_map(|row| row.deformation.principal_stretches());
    value(q::LEAST_PRINCIPAL_STRETCH.into(), stretches().fold(f64::INFINITY, f64::min));
    value(q::GREATEST_PRINCIPAL_STRETCH.into(), stretches().fold(0.0, f64::max));
    let noises = [("cauchy", noise(set, |row| row.cauchy)), ("S", noise(set, |row| row.s))];
    for (letter, noise) in noises {
        let Some(noise) = noise else { continue };
        let Noise { deviation, floor, lag_1, lag_1_of_white_noise, .. } = noise;
        for (name, deviation) in NAMES.iter().zip(&deviation) {
            value(q::NOISE.named(&[letter, name]), deviation / 1e6);
        }
        value(q::NOISE_FLOOR.named(&[letter]), floor / 1e12);
        if let Some(lag) = lag_1 {
            value(q::LAG_1.named(&[letter]), lag);
            value(q::LAG_1_IF_WHITE.named(&[letter]), lag_1_of_white_noise);
        }
    }
}

fn measure_split(report: &mut Report, set: &Dataset, split: &DataSplit, standardisation: &Standardisation) {
    let sets = [("training", &split.train), ("validation", &split.validation), ("test", &split.test)];
    for (name, rows) in sets {
        report.value(q::SET_ROWS.named(&[name]), rows.len() as f64);
    }
    for (a, name) in NAMES.iter().enumerate() {
        report.value(q::TRAINING_MEAN.named(&[name]), standardisation.mean[a]);
        report.value(q::TRAINING_DEVIATION.named(&[name]), standardisation.deviation[a]);
    }
    if let Some(leak) = leak(set, split, standardisation) {
        report.value(q::NEAREST_TRAINING_ROW, leak.across);
        report.value(q::NEAREST_OTHER_ROW, leak.within);
        report.value(q::NEIGHBOURS_OF_RUN, leak.same_path);
        if let Some(ratio) = leak.ratio {
            report.value(q::LEAK_RATIO, ratio);
        }
        report.work("distances", leak.distances);
    }
}
