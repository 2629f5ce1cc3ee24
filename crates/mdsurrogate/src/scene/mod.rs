//! Scenes, as written in TOML: data and what is learnt from them.

use crate::dataset::{Columns, Fractions, Method};
use polycore::report::Expect;
use polycore::scene::{SceneError, Source};
use polycore::units::{Length, Stress};
use serde::Deserialize;
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
    /// What is read.
    pub data: Data,
    /// How it is divided.
    #[serde(default)]
    pub split: SplitSpec,
    /// Laws to train, in this order.
    #[serde(default)]
    pub model: Vec<ModelSpec>,
    /// How they are trained.
    #[serde(default)]
    pub training: TrainingSpec,
    /// A search for hyperparameters of an `ann`.
    pub search: Option<SearchSpec>,
    /// What the results must be.
    #[serde(default)]
    pub expect: Vec<Expect>,
}

/// The JSON Schema of scenes.
pub fn schema() -> serde_json::Value {
    polycore::scene::schema("mdsurrogate", |generator| vec![generator.subschema_for::<Scene>()])
}

impl Scene {
    /// Rules that serde does not know.
    ///
    /// # Errors
    /// What is wrong and where.
    pub fn check(&self, source: &Source) -> Result<(), SceneError> {
        check_models(source, &self.model, &self.training)?;
        match &self.search {
            Some(_) if !self.model.is_empty() => {
                return Err(source.error(
                    "search",
                    "`[search]` beside `[[model]]`",
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
    /// Edges of the undeformed box; default: where the file's own F is 1.
    pub reference_lengths: Option<[Length; 3]>,
    /// The unit of stress columns without a unit in their heading; default 1 MPa.
    pub stress_unit: Option<Stress>,
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
    /// Names the shuffle.
    #[serde(default)]
    pub seed: u64,
}
