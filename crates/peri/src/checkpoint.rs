//! What a killed run needs to go on with the same bits.

use crate::error::Error;
use crate::run::Outcome;
use crate::solver::State;
use serde::{Deserialize, Serialize};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// File name inside an output directory.
pub const FILE_NAME: &str = "checkpoint.bin";
/// First bytes of the file: name and version of the format.
const MAGIC: &[u8; 8] = b"peri-ck4";

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
    let path = directory.join(FILE_NAME);
    let bytes = postcard::to_stdvec(&written)
        .map_err(|error| Error::Checkpoint { path: path.clone(), why: error.to_string() })?;
    polycore::output::atomic_write(&path, |file| {
        file.write_all(MAGIC)?;
        file.write_all(&checksum(&bytes).to_le_bytes())?;
        file.write_all(&bytes)
    })?;
    Ok(())
}

fn bytes(path: &Path) -> Result<Vec<u8>, Error> {
    let fail = |why: &str| Err(Error::Checkpoint { path: path.into(), why: why.into() });
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) if [ErrorKind::NotFound, ErrorKind::NotADirectory].contains(&error.kind()) => {
            return fail("there is none; a run begins with `peri run`");
        }
        Err(error) => return Err(polycore::Error::io("read", path)(error).into()),
    };
    let Some((sum, rest)) = bytes.strip_prefix(MAGIC).and_then(|rest| rest.split_first_chunk()) else {
        return fail("not a checkpoint of this version");
    };
    if u64::from_le_bytes(*sum) != checksum(rest) {
        return fail("damaged or cut short: its checksum does not fit; run the scene again");
    }
    Ok(rest.to_vec())
}

/// FNV-1a over words of 8 bytes, with the length: finds cuts and changed bytes, not forgeries.
fn checksum(bytes: &[u8]) -> u64 {
    const PRIME: u64 = 0x0000_0100_0000_01b3;
    let start = 0xcbf2_9ce4_8422_2325 ^ bytes.len() as u64;
    bytes.chunks(8).fold(start, |sum, chunk| {
        let mut word = [0; 8];
        word[..chunk.len()].copy_from_slice(chunk);
        // the rotation carries the high bytes, which the product alone would only move up, back down
        (sum ^ u64::from_le_bytes(word)).wrapping_mul(PRIME).rotate_left(23)
    })
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
