//! TOML scenes of `mdsurrogate`: data, and models trained on them.

use crate::dataset::{
    BoxReference, Fractions, LammpsUnits, PROPERTIES, PressureConvention, SampledColumns, SplitMethod,
};
use crate::program::quantities;
use harness::report::Expect;
use harness::scene::{SceneError, Source};
use polycore::units::{Length, Stress};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

mod memory;
mod model;
mod search;

pub use model::{KindName, ModelSpec, OutputUnits, ThesisNetwork, TrainingSpec, check_models};
pub use search::SearchSpec;

/// A scene.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Program of the scene: `mdsurrogate`.
    pub program: Program,
    /// Title for tables and pictures.
    #[serde(default)]
    pub title: String,
    /// Data for training and tests.
    pub data: Option<DatasetSpec>,
    /// Crystal, grid of runs and networks of the thesis, in numbers; instead of data or with them.
    pub crystal: Option<CrystalSpec>,
    /// Split into training, validation and test rows.
    #[serde(default)]
    pub split: SplitSpec,
    /// Laws to train, in this order.
    #[serde(default)]
    pub model: Vec<ModelSpec>,
    /// Training settings.
    #[serde(default)]
    pub training: TrainingSpec,
    /// Search for hyperparameters of an `ann`.
    pub search: Option<SearchSpec>,
    /// Trials of a stability suite, with other data or at other strains. With trials, models are trained in
    /// trials only.
    #[serde(default)]
    pub trial: Vec<TrialSpec>,
    /// Expected results.
    #[serde(default)]
    pub expect: Vec<Expect>,
}

/// Returns the JSON Schema of scenes.
pub fn schema() -> serde_json::Value {
    harness::scene::schema("mdsurrogate", quantities::ALL, |generator| {
        vec![generator.subschema_for::<Scene>()]
    })
}

impl Scene {
    /// Checks rules between keys.
    ///
    /// # Errors
    /// Returns a [`SceneError`] with key and advice.
    pub fn check(&self, source: &Source) -> Result<(), SceneError> {
        harness::case::check_expectations(source, &self.expect, quantities::ALL)?;
        if self.data.is_none() {
            if self.crystal.is_none() {
                return Err(source.missing("data", "the scene needs `[data]` with `files`, or `[crystal]`"));
            }
            if !self.model.is_empty() || self.search.is_some() {
                let key = if self.model.is_empty() { "search" } else { "model" };
                return Err(source.unexpected(key, "laws need data; add `[data]` with `files`"));
            }
        }
        if let Some(data) = &self.data {
            data.check(source)?;
        }
        if let Some(crystal) = &self.crystal {
            crystal.check(source)?;
        }
        check_models(source, &self.model, &self.training)?;
        check_trials(source, &self.trial, &self.model)?;
        match &self.search {
            Some(_) if !self.model.is_empty() => {
                return Err(source.conflict("search", "model", "keep one of them in a scene"));
            }
            Some(search) => search.check(source)?,
            None => {}
        }
        self.refuse_too_large(source)
    }
}

/// Program of these scenes.
#[derive(Clone, Copy, Debug, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Program {
    /// `mdsurrogate`.
    Mdsurrogate,
}

/// Data files, and options for reading them.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DatasetSpec {
    /// CSV (also gzip), LAMMPS or HDF5 files for the split, relative to the scene.
    pub files: Vec<PathBuf>,
    /// Files of held-out runs, outside the split.
    #[serde(default)]
    pub heldout: Vec<PathBuf>,
    /// Kind of columns in molecular-dynamics tables: `averaged` (default) or `instantaneous`.
    #[serde(default)]
    pub columns: SampledColumns,
    /// Undeformed row: `run`, the first row of each run, or `file`, the first row of the file; default: the
    /// row where F of the file is 1, or the first row of a LAMMPS log with one run.
    pub reference: Option<BoxReference>,
    /// Edges of the undeformed box.
    pub reference_lengths: Option<[Length; 3]>,
    /// Tilts xy, xz, yz of the undeformed box; default 0.
    pub reference_tilts: Option<[Length; 3]>,
    /// Unit of stress columns without a unit in their heading; default 1 MPa.
    pub stress_unit: Option<Stress>,
    /// Stress measure of columns `pxx …`: `pressure` as in LAMMPS, σ = −p.
    pub stress: Option<PressureConvention>,
    /// Units of LAMMPS output: `real`, `metal`, `si`, `cgs`, `electron`, `micro`, `nano`; default: those in
    /// the log.
    pub units: Option<LammpsUnits>,
    /// Headings of columns by property, e.g. `{ lx = "v_lx", pxx = "c_p[1]" }`.
    #[serde(default)]
    pub names: BTreeMap<String, String>,
    /// Runs of a LAMMPS log to read, from 1; default: all.
    #[serde(default)]
    pub blocks: Vec<usize>,
}

impl DatasetSpec {
    /// Checks rules between keys.
    ///
    /// # Errors
    /// Returns a [`SceneError`] with key and advice.
    fn check(&self, source: &Source) -> Result<(), SceneError> {
        if let Some(wrong) = self.names.keys().find(|name| !PROPERTIES.contains(&name.as_str())) {
            return Err(source.unknown("data.names", wrong, &PROPERTIES));
        }
        if self.reference.is_some() && self.reference_lengths.is_some() {
            let lengths = "data.reference_lengths";
            return Err(source.conflict("data.reference", lengths, "keep one of them"));
        }
        if self.reference_tilts.is_some() && self.reference_lengths.is_none() {
            let why = "`reference_tilts` need them";
            return Err(source.missing("data.reference_lengths", why));
        }
        if self.blocks.contains(&0) {
            return Err(source.error("data.blocks", 0, "run numbers from 1"));
        }
        Ok(())
    }
}

/// Crystal of γ-PA12 (Table 3.1) and grid of rates (Table 3.2).
#[derive(Clone, Copy, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CrystalSpec {
    /// Cells of the supercell along x, y, z; default: 8, 4, 2 as in the thesis.
    #[serde(default = "thesis_cells")]
    pub cells: [usize; 3],
    /// Levels of rate per direction; default: 15 as in the thesis.
    #[serde(default = "thesis_levels")]
    pub levels: usize,
}

/// Trial of a stability suite.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrialSpec {
    /// Name of its row and its value `NAME.as_expected`.
    pub name: String,
    /// Expected behaviour, for the table of the suite.
    pub description: String,
    /// Data files, instead of `data.files`.
    pub files: Option<Vec<PathBuf>>,
    /// Names of models; default: all.
    pub models: Option<Vec<String>>,
    /// Part of the error with which the trial must end.
    pub refused: Option<String>,
    /// Components C11, C22, C33, C12, C13, C23 at which the trained models are evaluated.
    pub at: Option<[f64; 6]>,
    /// If true, all predictions there must be flagged; if false, none.
    pub flagged: Option<bool>,
}

fn check_trials(source: &Source, trials: &[TrialSpec], models: &[ModelSpec]) -> Result<(), SceneError> {
    for (index, trial) in trials.iter().enumerate() {
        let at = |key: &str| format!("trial[{index}].{key}");
        if trials[..index].iter().any(|other| other.name == trial.name) {
            return Err(source.error(
                &at("name"),
                format!("`{}` twice", trial.name),
                "a different name for each trial",
            ));
        }
        let titles: Vec<String> = models.iter().map(ModelSpec::title).collect();
        if let Some(name) = trial.models.iter().flatten().find(|name| !titles.contains(name)) {
            let known: Vec<&str> = titles.iter().map(String::as_str).collect();
            return Err(source.unknown(&at("models"), name, &known));
        }
        if trial.flagged.is_some() && (trial.at.is_none() || trial.refused.is_some()) {
            let key = at("flagged");
            return Err(match trial.at {
                None => source.missing(&at("at"), "`flagged` needs a strain at which models are evaluated"),
                Some(_) => source.conflict(&key, &at("refused"), "keep one of them"),
            });
        }
    }
    Ok(())
}

fn thesis_cells() -> [usize; 3] {
    crate::md::Protocol::default().cells
}

fn thesis_levels() -> usize {
    crate::md::RateGrid::default().levels
}

impl CrystalSpec {
    /// Checks the ranges.
    ///
    /// # Errors
    /// Returns a [`SceneError`] with key and allowed values.
    fn check(&self, source: &Source) -> Result<(), SceneError> {
        // more atoms cannot be seen in pictures
        if self.cells.iter().any(|n| !(1..=20).contains(n)) {
            return Err(source.error("crystal.cells", format!("{:?}", self.cells), "1 to 20 each"));
        }
        if !(1..=200).contains(&self.levels) {
            return Err(source.error("crystal.levels", self.levels, "1 to 200"));
        }
        Ok(())
    }
}

/// Split of the rows.
#[derive(Clone, Copy, Debug, Default, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SplitSpec {
    /// Method: `path` (default), or `random` as in the thesis.
    #[serde(default)]
    pub by: SplitMethod,
    /// Fractions of training, validation and test; default 0.64, 0.16, 0.2.
    #[serde(default)]
    pub fractions: Fractions,
    /// Seed of the shuffle.
    #[serde(default)]
    pub seed: u64,
}
