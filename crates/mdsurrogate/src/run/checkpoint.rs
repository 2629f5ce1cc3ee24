//! What a killed run needs to go on with the same bits.

use crate::error::Error;
use polycore::checkpoint::{FILE_NAME, Magic};
use polycore::scene::Source;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

const MAGIC: &Magic = b"mdsg-ck1";

/// The part of a checkpoint that tells the scene.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Header {
    /// The scene's text, so that a changed scene is not continued with an old state.
    pub scene: String,
    /// The scene's path, for relative paths and messages.
    pub scene_path: PathBuf,
    /// Whether this is a `--quick` run.
    pub quick: bool,
}

impl Header {
    /// The header of a scene's run.
    pub fn new(source: &Source, quick: bool) -> Self {
        // files that a scene names lie beside it, from wherever the run is resumed
        let scene_path = std::path::absolute(&source.path).unwrap_or_else(|_| source.path.clone());
        Self { scene: source.text.clone(), scene_path, quick }
    }
}

/// Writes a checkpoint into an output directory, atomically.
///
/// # Errors
/// As [`polycore::checkpoint::write`].
pub fn write<T: Serialize>(directory: &Path, header: &Header, progress: &T) -> Result<(), Error> {
    Ok(polycore::checkpoint::write(&directory.join(FILE_NAME), MAGIC, &(header, progress))?)
}

/// Reads which scene a directory's checkpoint belongs to.
///
/// # Errors
/// As [`polycore::checkpoint::read`].
pub fn header(directory: &Path) -> Result<Header, Error> {
    Ok(polycore::checkpoint::read(&directory.join(FILE_NAME), MAGIC)?)
}

/// Reads where a run stood.
///
/// # Errors
/// As [`polycore::checkpoint::read`].
pub fn read<T: DeserializeOwned>(directory: &Path) -> Result<T, Error> {
    let (_, progress): (Header, T) = polycore::checkpoint::read(&directory.join(FILE_NAME), MAGIC)?;
    Ok(progress)
}
