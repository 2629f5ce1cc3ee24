//! Scenes, as written in TOML: data and what is learnt from them.

use crate::dataset::{Columns, Fractions, LammpsUnits, Measure, Method, Origin, PROPERTIES};
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

pub use model::{KindName, ModelSpec, Outputs, ThesisNetwork, TrainingSpec, check_models};
pub use search::SearchSpec;

/// A whole scene.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// The program that runs it: `mdsurrogate`.
    pub program: Program,
    /// One line for tables and pictures.
    #[serde(default)]
    pub title: String,
    /// The data.
    pub data: Option<Data>,
    /// Instead of data, or beside them: the crystal, the grid of runs and the networks of the thesis, in numbers.
    pub crystal: Option<CrystalSpec>,
    /// Division into training, validation and test rows.
    #[serde(default)]
    pub split: SplitSpec,
    /// Laws to train, in this order.
    #[serde(default)]
    pub model: Vec<ModelSpec>,
    /// Training settings.
    #[serde(default)]
    pub training: TrainingSpec,
    /// A search for hyperparameters of an `ann`.
    pub search: Option<SearchSpec>,
    /// A stability suite: expected behaviour with other data or at other strains. The models are trained in trials only.
    #[serde(default)]
    pub trial: Vec<TrialSpec>,
    /// Expected results.
    #[serde(default)]
    pub expect: Vec<Expect>,
}

/// The JSON Schema of scenes.
pub fn schema() -> serde_json::Value {
    harness::scene::schema("mdsurrogate", quantities::ALL, |generator| {
        vec![generator.subschema_for::<Scene>()]
    })
}

impl Scene {
    /// Rules that serde does not know.
    ///
    /// # Errors
    /// What is wrong and where.
    pub fn check(&self, source: &Source) -> Result<(), SceneError> {
        harness::case::check_expectations(source, &self.expect, quantities::ALL)?;
        if self.data.is_none() {
            if self.crystal.is_none() {
                return Err(source.error("data", "no `[data]`", "`[data]` with `files`, or `[crystal]`"));
            }
            if !self.model.is_empty() || self.search.is_some() {
                let key = if self.model.is_empty() { "search" } else { "model" };
                return Err(source.error(key, "laws without data", "`[data]` with `files`"));
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
                return Err(source.error(
                    "search",
                    "`[search]` together with `[[model]]`",
                    "one of them in a scene",
                ));
            }
            Some(search) => search.check(source)?,
            None => {}
        }
        self.refuse_too_large(source)
    }
}

/// The only program that runs these scenes.
#[derive(Clone, Copy, Debug, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Program {
    /// This crate.
    Mdsurrogate,
}

/// Files and how to read them.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Data {
    /// CSV (also gzip) or HDF5 files to learn from, relative to the scene.
    pub files: Vec<PathBuf>,
    /// Files that are kept out of the split.
    #[serde(default)]
    pub heldout: Vec<PathBuf>,
    /// `averaged` or `instantaneous` columns of molecular dynamics tables.
    #[serde(default)]
    pub columns: Columns,
    /// The row of undeformed lengths: `run`, the first of each run, or `file`, the first of the file; default: where the
    /// run's own F is 1, and the first row of a LAMMPS log with one run.
    pub reference: Option<Origin>,
    /// Edges of the undeformed box.
    pub reference_lengths: Option<[Length; 3]>,
    /// Its tilts xy, xz, yz; default 0.
    pub reference_tilts: Option<[Length; 3]>,
    /// The unit of stress columns without a unit in their heading; default 1 MPa.
    pub stress_unit: Option<Stress>,
    /// `pressure`: columns `pxx …` are read as pressures of LAMMPS, σ = −p.
    pub stress: Option<Measure>,
    /// Units of files of LAMMPS: `real`, `metal`, `si`, `cgs`, `electron`, `micro`, `nano`; default: as a log says.
    pub units: Option<LammpsUnits>,
    /// Headings of columns by property, as `{ lx = "v_lx", pxx = "c_p[1]" }`.
    #[serde(default)]
    pub names: BTreeMap<String, String>,
    /// Runs of a LAMMPS log that are read, from 1; default all.
    #[serde(default)]
    pub blocks: Vec<usize>,
}

impl Data {
    /// # Errors
    /// What is wrong and where.
    fn check(&self, source: &Source) -> Result<(), SceneError> {
        if let Some(wrong) = self.names.keys().find(|name| !PROPERTIES.contains(&name.as_str())) {
            return Err(source.unknown("data.names", wrong, &PROPERTIES));
        }
        if self.reference.is_some() && self.reference_lengths.is_some() {
            let allowed = "one of `reference` and `reference_lengths`";
            return Err(source.error("data.reference", "two references", allowed));
        }
        if self.reference_tilts.is_some() && self.reference_lengths.is_none() {
            let allowed = "`reference_lengths` beside them";
            return Err(source.error("data.reference_tilts", "tilts alone", allowed));
        }
        if self.blocks.contains(&0) {
            return Err(source.error("data.blocks", 0, "numbers of runs, from 1"));
        }
        Ok(())
    }
}

/// The γ-PA12 crystal of Table 3.1 and the grid of Table 3.2.
#[derive(Clone, Copy, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CrystalSpec {
    /// Cells of the supercell along x, y, z; default: the thesis' 8, 4, 2.
    #[serde(default = "thesis_cells")]
    pub cells: [usize; 3],
    /// Levels of rate a direction; default: the thesis' 15.
    #[serde(default = "thesis_levels")]
    pub levels: usize,
}

/// A trial of a stability suite.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrialSpec {
    /// Names its row and its value `NAME as expected`.
    pub name: String,
    /// Expected behaviour, for the table of the suite.
    pub description: String,
    /// Instead of the scene's `data.files`.
    pub files: Option<Vec<PathBuf>>,
    /// Models by name; default: all.
    pub models: Option<Vec<String>>,
    /// The trial must end with an error that contains this.
    pub refused: Option<String>,
    /// A C at which the trained models are evaluated, as C11, C22, C33, C12, C13, C23.
    pub at: Option<[f64; 6]>,
    /// Whether all of their predictions there must be flagged, or none.
    pub flagged: Option<bool>,
}

fn check_trials(source: &Source, trials: &[TrialSpec], models: &[ModelSpec]) -> Result<(), SceneError> {
    for (index, trial) in trials.iter().enumerate() {
        let at = |key: &str| format!("trial[{index}].{key}");
        if trials[..index].iter().any(|other| other.name == trial.name) {
            return Err(source.error(
                &at("name"),
                format!("`{}` twice", trial.name),
                "a name for each trial",
            ));
        }
        let titles: Vec<String> = models.iter().map(ModelSpec::title).collect();
        if let Some(name) = trial.models.iter().flatten().find(|name| !titles.contains(name)) {
            let known: Vec<&str> = titles.iter().map(String::as_str).collect();
            return Err(source.unknown(&at("models"), name, &known));
        }
        if trial.flagged.is_some() && (trial.at.is_none() || trial.refused.is_some()) {
            let allowed = "`at`, and no `refused`, beside it";
            return Err(source.error(&at("flagged"), "`flagged` without a prediction", allowed));
        }
    }
    Ok(())
}

fn thesis_cells() -> [usize; 3] {
    crate::md::Protocol::default().cells
}

fn thesis_levels() -> usize {
    crate::md::Grid::default().levels
}

impl CrystalSpec {
    /// # Errors
    /// What is wrong and where.
    fn check(&self, source: &Source) -> Result<(), SceneError> {
        // pictures of more are black
        if self.cells.iter().any(|n| !(1..=20).contains(n)) {
            return Err(source.error("crystal.cells", format!("{:?}", self.cells), "1 to 20 each"));
        }
        if !(1..=200).contains(&self.levels) {
            return Err(source.error("crystal.levels", self.levels, "1 to 200"));
        }
        Ok(())
    }
}

/// How rows are divided.
#[derive(Clone, Copy, Debug, Default, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SplitSpec {
    /// `path` (default) or `random` (the thesis').
    #[serde(default)]
    pub by: Method,
    /// Shares of train, validation, test; default 0.64, 0.16, 0.2.
    #[serde(default)]
    pub fractions: Fractions,
    /// Seed of the shuffle.
    #[serde(default)]
    pub seed: u64,
}
