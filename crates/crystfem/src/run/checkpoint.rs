//! What a killed run of a part needs to go on with the same bits.

use super::probe::Probe;
use crate::error::Error;
use crate::simulation::State;
use polycore::checkpoint::{FILE_NAME, Magic};
use polycore::scene::Source;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

const MAGIC: &Magic = b"part-ck3";

/// The part of a checkpoint that tells the scene; all of it for a run of several studies.
#[derive(Debug, Serialize, Deserialize)]
pub struct Header {
    /// The scene's text, so that a changed scene is not continued with an old state.
    pub scene: String,
    /// The scene's path, for relative paths and messages.
    pub scene_path: PathBuf,
    /// Whether this is a `--quick` run.
    pub quick: bool,
    /// The study, of the run in the folder above.
    pub study: Option<String>,
}

impl Header {
    /// Of a scene, or of one of its studies.
    pub fn new(source: &Source, quick: bool, study: Option<&str>) -> Self {
        // files that a scene names lie beside it, from wherever the run is resumed
        let scene_path = std::path::absolute(&source.path).unwrap_or_else(|_| source.path.clone());
        Self { scene: source.text.clone(), scene_path, quick, study: study.map(str::to_owned) }
    }

    /// Writes a checkpoint that tells no more than the scene.
    ///
    /// # Errors
    /// As [`polycore::checkpoint::write`].
    pub fn write(&self, directory: &Path) -> Result<(), Error> {
        Ok(polycore::checkpoint::write(&directory.join(FILE_NAME), MAGIC, self)?)
    }
}

/// Where a run stood.
#[derive(Debug, Deserialize)]
pub struct Checkpoint {
    #[expect(dead_code, reason = "read by `Header`")]
    header: Header,
    /// Frames of the fields that are written.
    pub frames: usize,
    /// The simulation.
    pub state: State,
    /// Rows of the probes.
    pub probes: Vec<Probe>,
}

/// Borrowed form for writing, so that no field is copied.
#[derive(Serialize)]
struct Written<'a> {
    header: &'a Header,
    frames: usize,
    state: &'a State,
    probes: &'a [Probe],
}

/// Writes a checkpoint into an output directory, atomically.
///
/// # Errors
/// As [`polycore::checkpoint::write`].
pub fn write(
    directory: &Path,
    header: &Header,
    frames: usize,
    state: &State,
    probes: &[Probe],
) -> Result<(), Error> {
    let written = Written { header, frames, state, probes };
    Ok(polycore::checkpoint::write(&directory.join(FILE_NAME), MAGIC, &written)?)
}

/// Reads which scene a directory's checkpoint belongs to.
///
/// # Errors
/// As [`polycore::checkpoint::read`].
pub fn header(directory: &Path) -> Result<Header, Error> {
    Ok(polycore::checkpoint::read(&directory.join(FILE_NAME), MAGIC)?)
}

/// Reads a directory's checkpoint.
///
/// # Errors
/// As [`polycore::checkpoint::read`].
pub fn read(directory: &Path) -> Result<Checkpoint, Error> {
    Ok(polycore::checkpoint::read(&directory.join(FILE_NAME), MAGIC)?)
}
