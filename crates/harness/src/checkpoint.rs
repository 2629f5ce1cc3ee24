//! Checkpoint of a run: one file with a checksum, written whole or not at all.

use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::scene::{Source, Stamp};
use polycore::Error;
use polycore::file::atomic_write;

/// File name inside an output directory.
pub const FILE_NAME: &str = "checkpoint.bin";

/// First bytes of a file: program and version of what it holds.
pub type Magic = [u8; 8];

/// Beginning of the magic of each program, up to a hyphen, and the program.
pub const PROGRAMS: [(&str, &str); 4] =
    [("mdsg", "mdsurrogate"), ("part", "crystfem"), ("peri", "peri"), ("poly", "polycore")];

/// The part of a run's checkpoint that names its scene.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Header {
    /// The scene's text, so that a changed scene is not continued with an old state.
    pub scene: String,
    /// The scene's path, for relative paths and messages.
    pub scene_path: PathBuf,
    /// True for a `--quick` run.
    pub quick: bool,
    /// Hashes of all that the run is computed from.
    pub stamp: Stamp,
}

impl Header {
    /// Creates the header of a run of a scene.
    pub fn new(source: &Source, quick: bool) -> Self {
        // files that a scene names lie beside it, from wherever the run is resumed
        let scene_path = std::path::absolute(&source.path).unwrap_or_else(|_| source.path.clone());
        Self { scene: source.text.clone(), scene_path, quick, stamp: source.stamp(quick) }
    }

    /// Reads which scene the checkpoint of an output directory belongs to.
    ///
    /// # Errors
    /// As [`read`].
    pub fn read(directory: &Path, magic: &Magic) -> Result<Self, Error> {
        read(&directory.join(FILE_NAME), magic)
    }

    /// Refuses to go on with other files, or other results of inputs, than the run began with.
    ///
    /// # Errors
    /// [`Error::Checkpoint`].
    pub fn check(&self, directory: &Path) -> Result<(), Error> {
        match self.stamp.changed(&self.scene_path) {
            None => Ok(()),
            Some(changed) => {
                let why = format!("{changed} since this run began; run the scene again");
                Err(refused(&directory.join(FILE_NAME), why))
            }
        }
    }
}

/// Writes the checkpoint of an output directory: its scene, and how far the run is.
///
/// # Errors
/// As [`write()`].
pub fn save<T: Serialize>(
    directory: &Path,
    magic: &Magic,
    header: &Header,
    state: Option<&T>,
) -> Result<(), Error> {
    write(&directory.join(FILE_NAME), magic, &(header, state))
}

/// Reads how far the run of an output directory was; nothing where it had just begun.
///
/// # Errors
/// As [`read`].
pub fn resume<T: DeserializeOwned>(directory: &Path, magic: &Magic) -> Result<Option<T>, Error> {
    let (_, state): (Header, Option<T>) = read(&directory.join(FILE_NAME), magic)?;
    Ok(state)
}

/// Writes a value (postcard, behind magic and checksum).
///
/// # Errors
/// [`Error::Checkpoint`] for what cannot be serialised, [`Error::Io`] where the file cannot be written.
pub fn write(path: &Path, magic: &Magic, value: &impl Serialize) -> Result<(), Error> {
    let bytes = encode(path, value)?;
    atomic_write(path, |file| {
        file.write_all(magic)?;
        file.write_all(&checksum(&bytes).to_le_bytes())?;
        file.write_all(&bytes)
    })
}

/// Reads a value. A type with the first fields of what was written reads these.
///
/// # Errors
/// [`Error::Checkpoint`] for none, another version, damage, and what is no such value.
pub fn read<T: DeserializeOwned>(path: &Path, magic: &Magic) -> Result<T, Error> {
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) if [ErrorKind::NotFound, ErrorKind::NotADirectory].contains(&error.kind()) => {
            return Err(refused(path, "there is none; start a run with `run`"));
        }
        Err(error) => return Err(Error::from_io("read", path)(error)),
    };
    let Some((sum, rest)) = bytes.strip_prefix(magic).and_then(|rest| rest.split_first_chunk()) else {
        return Err(refused(path, foreign(&bytes, magic)));
    };
    if u64::from_le_bytes(*sum) != checksum(rest) {
        let why = "damaged or truncated: its checksum is wrong; run the scene again";
        return Err(refused(path, why));
    }
    decode(path, rest)
}

/// Returns the bytes of a value in the checkpoint at `path`.
pub(crate) fn encode(path: &Path, value: &impl Serialize) -> Result<Vec<u8>, Error> {
    postcard::to_stdvec(value).map_err(|error| refused(path, error))
}

/// Decodes a value of [`encode`].
pub(crate) fn decode<T: DeserializeOwned>(path: &Path, bytes: &[u8]) -> Result<T, Error> {
    postcard::take_from_bytes(bytes).map(|(value, _)| value).map_err(|error| refused(path, error))
}

/// Describes a file with another magic.
fn foreign(bytes: &[u8], magic: &Magic) -> String {
    let name = |magic: &[u8]| magic.split(|&byte| byte == b'-').next().map(<[u8]>::to_vec);
    let found = bytes.get(..magic.len()).and_then(name);
    match PROGRAMS.iter().find(|(prefix, _)| found.as_deref() == Some(prefix.as_bytes())) {
        Some((_, program)) if found != name(magic) => {
            format!("of a run of `{program}`; `{program} resume` continues it")
        }
        _ => "not a checkpoint of this version".to_owned(),
    }
}

fn refused(path: &Path, why: impl ToString) -> Error {
    Error::Checkpoint { path: path.into(), why: why.to_string() }
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

#[cfg(test)]
mod tests {
    use super::*;

    const MAGIC: &Magic = b"test-ck1";

    #[test]
    fn values_come_back_and_damage_is_told() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join(FILE_NAME);
        let value = ("scene".to_owned(), vec![1.5, f64::NAN, -0.0], 7_u32);
        write(&path, MAGIC, &value).unwrap();
        let back: (String, Vec<f64>, u32) = read(&path, MAGIC).unwrap();
        assert_eq!(
            back.1.iter().map(|x| x.to_bits()).collect::<Vec<_>>(),
            value.1.iter().map(|x| x.to_bits()).collect::<Vec<_>>()
        );
        assert_eq!((back.0, back.2), (value.0, value.2));
        // the first fields alone
        assert_eq!(read::<(String,)>(&path, MAGIC).unwrap().0, "scene");
        let bytes = std::fs::read(&path).unwrap();
        let told = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            read::<(String, Vec<f64>, u32)>(&path, MAGIC).unwrap_err().to_string()
        };
        for length in 16..bytes.len() {
            assert!(told(&bytes[..length]).contains("damaged or truncated"), "{length}");
        }
        for at in 8..bytes.len() {
            let mut changed = bytes.clone();
            changed[at] ^= 0x10;
            assert!(told(&changed).contains("damaged or truncated"), "{at}");
        }
        assert!(told(b"").contains("not a checkpoint of this version"));
        assert!(told(b"test-ck0").contains("not a checkpoint of this version"));
        assert!(told(b"part-ck2 and more").contains("of a run of `crystfem`; `crystfem resume`"));
        std::fs::remove_file(&path).unwrap();
        let none = read::<(String,)>(&path, MAGIC).unwrap_err();
        assert!(none.to_string().contains("there is none") && none.exit_code() == 2);
    }
}
