//! The data of a scene: read, measured, divided, drawn, written as HDF5.

use super::{Failure, uniaxial};
use crate::dataset::{
    Dataset, Method, Noise, Path as Path_, ReadOptions, Row, Split, Standardisation, hdf5, leak, noise, read,
    split,
};
use crate::error::Error;
use crate::kinematics::{ANGSTROM, NAMES, PeriodicBox};
use crate::program::quantities as q;
use crate::program::scene::{Data, Scene};
use crate::surrogate::{Kind, Symmetry};
use crate::train::loading;
use harness::report::{Named, Report};
use harness::scene::Source;
use polycore::tensor::Voigt;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Reads, checks and joins the files of a scene; paths are relative to it.
///
/// # Errors
/// [`Failure`]: reference lengths or a unit out of range, and all of [`read`].
pub fn load(source: &Source, data: &Data, files: &[PathBuf], key: &str) -> Result<Dataset, Failure> {
    let mut options = ReadOptions {
        columns: data.columns,
        origin: data.reference,
        measure: data.stress,
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
            return Err(source.error("data.stress_unit", unit, "a positive stress, as \"1 MPa\"").into());
        }
        options.stress_unit = Some(unit.si());
    }
    if files.is_empty() {
        return Err(source.error(key, "no file", "at least one").into());
    }
    let mut set = Dataset::default();
    for (index, file) in files.iter().enumerate() {
        let path = source.file(file);
        let part = read(&path, &options).map_err(|error| match error {
            Error::Shared(polycore::Error::Io { source: reason, .. }) => {
                let allowed = format!("a file that can be read ({reason})");
                Failure::from(source.error(&format!("{key}[{index}]"), path.display(), allowed))
            }
            other => other.into(),
        })?;
        set.append(if set.shares_a_name(&part) { part.of_folder(&path) } else { part })?;
    }
    set.check()?;
    Ok(set)
}

/// What a scene learns from and is judged by.
pub struct Prepared {
    /// The runs to learn from.
    pub set: Dataset,
    /// The runs kept out of the split.
    pub heldout: Option<Dataset>,
    /// Which rows of `set` are for what.
    pub split: Split,
    /// The same by the other method, where a model asks for it.
    pub second: Option<Split>,
}

impl Prepared {
    /// Reads and divides the data of a scene.
    ///
    /// # Errors
    /// [`load`]; a split that the data do not allow.
    pub fn new(source: &Source, scene: &Scene) -> Result<Self, Failure> {
        let Some(data) = &scene.data else {
            return Err(source.error("data", "no `[data]`", "`[data]` with `files`").into());
        };
        let set = load(source, data, &data.files, "data.files")?;
        let heldout = match &data.heldout[..] {
            [] => None,
            files => Some(load(source, data, files, "data.heldout")?),
        };
        let divide = |by: Method| {
            split(&set, by, scene.split.fractions, scene.split.seed).map_err(|error| match error {
                Error::Parameter { found, allowed, .. } | Error::Data { found, allowed, .. } => {
                    source.error("split", found, allowed)
                }
                other => source.error("split", other, "a split that the data allow"),
            })
        };
        let own = divide(scene.split.by)?;
        let other = scene.model.iter().filter_map(|model| model.split).find(|by| *by != scene.split.by);
        let second = other.map(divide).transpose()?;
        let data = Self { set, heldout, split: own, second };
        data.check_models(source, scene)?;
        Ok(data)
    }

    /// The split of a model.
    pub fn split_of(&self, model: Option<Method>) -> &Split {
        match (&self.second, model) {
            (Some(second), Some(by)) if second.method == by => second,
            _ => &self.split,
        }
    }

    /// Whether every model can learn from these data.
    fn check_models(&self, source: &Source, scene: &Scene) -> Result<(), Failure> {
        if self.set.is_nominal() && scene.search.is_some() {
            let found = "a search for an ann, which has no pressure to eliminate";
            return Err(source.error("search", found, "data of whole stresses").into());
        }
        for (index, model) in scene.model.iter().enumerate() {
            let at = |key: &str| format!("model[{index}].{key}");
            let isotropic = matches!(model.law(), Kind::Energy { symmetry: Symmetry::Isotropic, .. });
            if self.set.is_nominal() && !isotropic {
                let key = if model.symmetry.is_some() { "symmetry" } else { "kind" };
                let allowed = "`kind = \"energy\"` and `symmetry = \"isotropic\"` for nominal stresses of an \
                               incompressible body";
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
            if model.softening.is_some() {
                let turned = |path: &&Path_| loading(path).contains(&false);
                if self.set.is_nominal() {
                    let found = "nominal stresses";
                    return Err(source.error(&at("softening"), found, "data of whole stresses").into());
                }
                if split.method == Method::Random {
                    let allowed = "`split = \"path\"`: the history of a row is that of its run";
                    return Err(source
                        .error(&at("softening"), "rows of runs divided at random", allowed)
                        .into());
                }
                if !self.paths_of(&split.train, &model.runs).iter().any(turned) {
                    let allowed = "training runs that turn round (`md write --path z=6e-5,unload=0.6`)";
                    return Err(source.error(&at("softening"), "no run that unloads", allowed).into());
                }
            }
            if self.rows_of(&split.train, &model.runs).is_empty() {
                let found = "runs without a training row";
                return Err(source.error(&at("runs"), found, "runs that the split trains on").into());
            }
        }
        Ok(())
    }

    /// Rows of the set by their numbers, of some runs; of all where none is named.
    pub fn rows_of(&self, numbers: &[usize], runs: &[String]) -> Vec<&Row> {
        let paths = self.set.path_of_rows();
        let of = |row: &&usize| runs.is_empty() || runs.contains(&self.set.paths[paths[**row]].id);
        self.rows(&numbers.iter().filter(of).copied().collect::<Vec<_>>())
    }

    /// The runs that rows are of, as [`Self::rows_of`].
    pub fn paths_of(&self, numbers: &[usize], runs: &[String]) -> Vec<&Path_> {
        let of_row = self.set.path_of_rows();
        let used: BTreeSet<usize> = numbers.iter().map(|&row| of_row[row]).collect();
        let named = |path: &&Path_| runs.is_empty() || runs.contains(&path.id);
        used.into_iter().map(|path| &self.set.paths[path]).filter(named).collect()
    }

    /// Rows of the set by their numbers.
    pub fn rows(&self, numbers: &[usize]) -> Vec<&Row> {
        let all: Vec<&Row> = self.set.rows().collect();
        numbers.iter().map(|&row| all[row]).collect()
    }

    /// Measures the data into a report; gives lines that no number can say.
    ///
    /// # Errors
    /// Numbers that are not finite.
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
                "without variance: {} (standardised to 0; predictions for other values are not reliable)",
                constant.join(", ")
            ));
        }
        Ok(remarks)
    }

    fn standardisation(&self) -> Result<Standardisation, Error> {
        let training: Vec<Voigt> = self.rows(&self.split.train).iter().map(|row| row.c).collect();
        Standardisation::of(training.iter())
    }

    /// Writes the data as HDF5 and draws the uniaxial runs.
    ///
    /// # Errors
    /// I/O errors.
    pub fn write(&self, output: &Path) -> Result<(), Error> {
        // the layout has no place for what was not measured
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

/// Counts, ranges and noise of a set.
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
        value(q::PATHS_OF_KIND.of(&[kind]), count as f64);
    }
    for (name, [low, high]) in NAMES.iter().zip(set.box_of_c()) {
        value(q::LEAST_C.of(&[name]), low);
        value(q::GREATEST_C.of(&[name]), high);
    }
    let stretches = || set.rows().flat_map(|row| row.deformation.principal_stretches());
    value(q::LEAST_PRINCIPAL_STRETCH.into(), stretches().fold(f64::INFINITY, f64::min));
    value(q::GREATEST_PRINCIPAL_STRETCH.into(), stretches().fold(0.0, f64::max));
    let noises = [("cauchy", noise(set, |row| row.cauchy)), ("S", noise(set, |row| row.s))];
    for (letter, noise) in noises {
        let Some(noise) = noise else { continue };
        let Noise { deviation, floor, lag_1, lag_1_of_white_noise, .. } = noise;
        for (name, deviation) in NAMES.iter().zip(&deviation) {
            value(q::NOISE.of(&[letter, name]), deviation / 1e6);
        }
        value(q::NOISE_FLOOR.of(&[letter]), floor / 1e12);
        if let Some(lag) = lag_1 {
            value(q::LAG_1.of(&[letter]), lag);
            value(q::LAG_1_IF_WHITE.of(&[letter]), lag_1_of_white_noise);
        }
    }
}

fn measure_split(report: &mut Report, set: &Dataset, split: &Split, standardisation: &Standardisation) {
    let sets = [("training", &split.train), ("validation", &split.validation), ("test", &split.test)];
    for (name, rows) in sets {
        report.value(q::SET_ROWS.of(&[name]), rows.len() as f64);
    }
    for (a, name) in NAMES.iter().enumerate() {
        report.value(q::TRAINING_MEAN.of(&[name]), standardisation.mean[a]);
        report.value(q::TRAINING_DEVIATION.of(&[name]), standardisation.deviation[a]);
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
