//! What a killed run needs to go on with the same bits.

use crate::error::Error;
use crate::run::Outcome;
use crate::solver::State;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

pub use polycore::checkpoint::FILE_NAME;

/// First bytes of the file: name and version of the format.
const MAGIC: &polycore::checkpoint::Magic = b"peri-ck6";

/// The state of a run.
#[derive(Debug, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Checkpoint<const D: usize> {
    /// The scene's text, so that a changed scene is not continued with an old state.
    pub scene: String,
    /// The scene's path, for relative paths and messages.
    pub scene_path: PathBuf,
    /// Whether this is a `--quick` run.
    pub quick: bool,
    /// Results of the finished variants.
    pub finished: Vec<Outcome>,
    /// The variant under way; none between variants.
    pub state: Option<State<D>>,
}

/// The part of a checkpoint that does not depend on its dimension.
#[derive(Debug, Deserialize)]
pub struct Header {
    /// As in [`Checkpoint`].
    pub scene: String,
    /// As in [`Checkpoint`].
    pub scene_path: PathBuf,
    /// As in [`Checkpoint`].
    pub quick: bool,
}

/// Borrowed form for writing, so that no field is copied.
#[derive(Serialize)]
#[serde(bound = "")]
struct Written<'a, const D: usize> {
    scene: &'a str,
    scene_path: &'a Path,
    quick: bool,
    finished: &'a [Outcome],
    state: Option<&'a State<D>>,
}

/// Writes a checkpoint into an output directory, atomically.
///
/// # Errors
/// [`Error::Shared`] where the file cannot be written.
pub fn write<const D: usize>(
    directory: &Path,
    scene: &polycore::scene::Source,
    quick: bool,
    finished: &[Outcome],
    state: Option<&State<D>>,
) -> Result<(), Error> {
    // files that a scene names lie beside it, from wherever the run is resumed
    let scene_path = std::path::absolute(&scene.path).unwrap_or_else(|_| scene.path.clone());
    let written = Written { scene: &scene.text, scene_path: &scene_path, quick, finished, state };
    Ok(polycore::checkpoint::write(&directory.join(FILE_NAME), MAGIC, &written)?)
}

/// Reads which scene a directory's checkpoint belongs to.
///
/// # Errors
/// [`polycore::Error::Checkpoint`], or [`Error::Shared`] where there is no file.
pub fn header(directory: &Path) -> Result<Header, Error> {
    Ok(polycore::checkpoint::read(&directory.join(FILE_NAME), MAGIC)?)
}

/// Reads a directory's checkpoint.
///
/// # Errors
/// As [`header`].
pub fn read<const D: usize>(directory: &Path) -> Result<Checkpoint<D>, Error> {
    Ok(polycore::checkpoint::read(&directory.join(FILE_NAME), MAGIC)?)
}
