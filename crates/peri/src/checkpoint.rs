//! What a killed run needs to go on with the same bits.

use crate::error::Error;
use crate::run::Outcome;
use crate::solver::State;
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::{Path, PathBuf};

/// File name inside an output directory.
pub const FILE_NAME: &str = "checkpoint.bin";
/// First bytes of the file: name and version of the format.
const MAGIC: &[u8; 8] = b"peri-ck1";

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
    let written = Written { scene: &scene.text, scene_path: &scene.path, quick, finished, state };
    let path = directory.join(FILE_NAME);
    let bytes = postcard::to_stdvec(&written)
        .map_err(|error| Error::Checkpoint { path: path.clone(), why: error.to_string() })?;
    polycore::output::atomic_write(&path, |file| {
        file.write_all(MAGIC)?;
        file.write_all(&bytes)
    })?;
    Ok(())
}

fn bytes(path: &Path) -> Result<Vec<u8>, Error> {
    let bytes = std::fs::read(path).map_err(polycore::Error::io("read", path))?;
    match bytes.strip_prefix(MAGIC) {
        Some(rest) => Ok(rest.to_vec()),
        None => Err(Error::Checkpoint { path: path.into(), why: "not a checkpoint of this version".into() }),
    }
}

/// Reads which scene a directory's checkpoint belongs to.
///
/// # Errors
/// [`Error::Checkpoint`], or [`Error::Shared`] where there is no file.
pub fn header(directory: &Path) -> Result<Header, Error> {
    let path = directory.join(FILE_NAME);
    let bytes = bytes(&path)?;
    postcard::take_from_bytes::<Header>(&bytes)
        .map(|(header, _)| header)
        .map_err(|error| Error::Checkpoint { path, why: error.to_string() })
}

/// Reads a directory's checkpoint.
///
/// # Errors
/// As [`header`].
pub fn read<const D: usize>(directory: &Path) -> Result<Checkpoint<D>, Error> {
    let path = directory.join(FILE_NAME);
    let bytes = bytes(&path)?;
    postcard::from_bytes(&bytes).map_err(|error| Error::Checkpoint { path, why: error.to_string() })
}
