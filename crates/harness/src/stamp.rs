//! Identity of results: the scene, files and inputs that they were computed from.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Hashes of all that results were computed from, beside the program and its version.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stamp {
    /// SHA-256 of the scene's text.
    pub scene: String,
    /// True if parts marked `quick = false` were left out.
    pub quick: bool,
    /// Files that were read, relative to the scene where they lie beside it, with the SHA-256 of their
    /// contents.
    pub files: BTreeMap<PathBuf, String>,
    /// Results of other scenes that were read.
    pub inputs: BTreeMap<String, InputStamp>,
}

/// Results of another scene, as a run has read them.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputStamp {
    /// Folder of the results.
    pub output: PathBuf,
    /// The [`Stamp::identity`] of them.
    pub identity: String,
}
